"""The runs of a sweep on a Dask cluster. The store stays with the process that asks.

A worker gets the tables of a few drives and returns their figures. Files that the tables name (flux
maps, own laws, pumps) must be found by the workers under the same paths.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice
from typing import Any

import reluctance
from reluctance.base.errors import ParameterError, one_line
from reluctance.base.extension import core_fingerprint
from reluctance.base.key_figures import Kpis
from reluctance.drive.drive import Drive, drive_from
from reluctance.drive.run.simulate_all import finished

AT_ONCE = 8  # drives of one task
AHEAD = 3  # tasks waiting for each thread of the cluster
PATIENCE = 15  # for the scheduler to answer [s]

Task = list[tuple[int, str, dict[str, dict[str, Any]]]]
Answer = list[tuple[int, Kpis | str]]


def finished_on(
    address: str, drives: Iterator[tuple[int, Drive]], *, until: float | None = None
) -> Iterator[tuple[int, Kpis | ParameterError]]:
    """Like `finished`, on the workers of the scheduler at an address. Where a worker is lost, what
    it was at is run by another.

    Raises
    ------
    ParameterError
        If dask is not installed, nobody answers, a worker has another version of this package, or
        runs end their workers again and again.
    """
    try:
        from distributed import Client, as_completed
    except ImportError:
        raise ParameterError(
            "--cluster needs dask; `pip install 'reluctance[cluster]'`, or leave it out"
        ) from None
    try:
        client = Client(address, timeout=PATIENCE, set_as_default=False)
    except (OSError, ValueError) as fault:
        raise ParameterError(
            f"no Dask scheduler answers at {address}: {one_line(fault)}; start one with "
            "`dask scheduler`, and workers with `dask worker ADDRESS`"
        ) from None
    with client:
        _check_versions(client)
        threads = sum(client.nthreads().values())
        if threads == 0:
            raise ParameterError(
                f"the scheduler at {address} has no workers; start one: `dask worker {address}`"
            )
        running = as_completed([], loop=client.loop)
        left, waiting = iter(drives), 0
        while True:
            while waiting < AHEAD * threads and (some := list(islice(left, AT_ONCE))):
                task: Task = [(n, drive.name, drive.tables()) for n, drive in some]
                running.add(client.submit(_work, task, until, pure=False))
                waiting += 1
            if waiting == 0:
                return
            future = next(running)
            waiting -= 1
            if future.status != "finished":
                raise ParameterError(
                    f"a task ended its workers: {one_line(future.exception())}; what has been "
                    "stored stays, and the same command goes on from there"
                )
            for n, found in future.result():
                yield n, ParameterError(found) if isinstance(found, str) else found


def _work(task: Task, until: float | None) -> Answer:
    """What a worker does: in one thread, for the cluster has as many tasks at once as threads."""
    drives = ((n, drive_from(tables, name=name)) for n, name, tables in task)
    return [
        (n, str(found) if isinstance(found, ParameterError) else found)
        for n, found in finished(drives, until=until, jobs=1)
    ]


def _version() -> str:
    return f"{reluctance.__version__} ({core_fingerprint()})"


def _check_versions(client: Any) -> None:
    ours = _version()
    for worker, theirs in client.run(_version).items():
        if theirs != ours:
            raise ParameterError(
                f"worker {worker} has reluctance {theirs}, need {ours} as here; install the same "
                "version on all computers"
            )
