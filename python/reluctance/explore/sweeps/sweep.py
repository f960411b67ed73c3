"""Run a drive over grids, lists and samples of any of its values."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from reluctance.base import cache
from reluctance.base.errors import ParameterError
from reluctance.base.files import make_folder
from reluctance.base.key_figures import Kpis
from reluctance.drive.drive import Drive, check_drive
from reluctance.drive.run.simulate_all import finished, jobs_of
from reluctance.explore.sweeps.result import Sweep

if TYPE_CHECKING:
    from reluctance.explore.sweeps.points import Points
    from reluctance.explore.sweeps.vary import Columns, Vary


def sweep(
    drive: Drive,
    vary: Vary,
    *,
    sobol: int | None = None,
    random: int | None = None,
    seed: int = 0,
    until: float | None = None,
    out: str | Path | None = None,
    jobs: int | None = None,
    cluster: str | None = None,
    progress: Callable[[float], None] | None = None,
) -> Sweep:
    """Key figures of a drive over values of its file, from as many runs.

    What has been run is never run again: the figures are in a store under the hash of the resolved
    drive, the end of the run and the version. A sweep that was interrupted, in whatever way, goes
    on where it was.

    Parameters
    ----------
    drive : Drive
    vary : mapping
        `section.key` to its values, as in `Drive.with_values`; also `machine` and `control.law`.
        All combinations are run; with `sobol` or `random` two numbers are a range.
    sobol, random : int, optional
        As many points of a Sobol sequence, or random ones, instead of all combinations.
    seed : int
        Of the samples.
    until : float, optional
        End of each run [s]; by default the drive's own.
    out : str or Path, optional
        The store, .sqlite or .db; by default one for all sweeps, beside the other cached results.
    jobs : int, optional
        Threads; by default as many as there are cores.
    cluster : str, optional
        Address of a Dask scheduler that runs the points instead.
    progress : callable, optional
        Is told the part that is done.

    Returns
    -------
    Sweep
        Points that fail are in it, with their reason.

    Raises
    ------
    ParameterError
        If an argument is of the wrong kind, no point works, the store cannot be used, or the
        cluster not be reached.

    Examples
    --------
    >>> import reluctance as rl
    >>> drive = rl.load("examples/sharing_cubic.toml")
    >>> found = rl.sweep(drive, {"control.i_band_A": [0.5, 1, 2]}, until=0.04)
    >>> found.figure("f_switch").round(-3).tolist()
    [7000.0, 4000.0, 2000.0]
    """
    check_drive(drive, "sweep")
    from reluctance.explore.sweeps.vary import (  # here, and below: start-up time
        checked,
        grid,
        samples,
    )

    ranges = checked(vary)
    if sobol is not None and random is not None:
        raise ParameterError("need either sobol or random")
    if sobol is None and random is None:
        columns, shape = grid(ranges), tuple(len(values) for values in ranges.values())
    else:
        count = sobol if sobol is not None else random
        columns = samples(drive, ranges, count or 0, sobol=sobol is not None, seed=seed)
        shape = ()
    found = swept(
        drive, columns, shape, until=until, out=out, jobs=jobs, cluster=cluster, progress=progress
    )
    if found.failed == len(found):
        raise ParameterError(f"none of the {len(found)} points works: {found.reason()}")
    return found


def swept(
    drive: Drive,
    columns: Columns,
    shape: tuple[int, ...],
    *,
    until: float | None = None,
    out: str | Path | None = None,
    jobs: int | None = None,
    cluster: str | None = None,
    progress: Callable[[float], None] | None = None,
) -> Sweep:
    """The same for points that are given; shape: () where they are no grid."""
    from reluctance.explore.sweeps.points import Points
    from reluctance.explore.sweeps.store import Store, check_store

    place = Path(out) if out is not None else _usual_place()
    if cluster is None:
        runner = partial(finished, until=until, jobs=jobs_of(jobs))
    else:
        from reluctance.explore.sweeps.cluster import finished_on

        check_store(place)
        runner = partial(finished_on, cluster, until=until)
    store = Store(place)
    try:
        points = Points(drive, columns, store, until)
        points.work(runner, progress)
        return _found(drive, points, shape)
    finally:
        store.close()


def _usual_place() -> Path:
    remedy = "set RELUCTANCE_CACHE in the environment to a folder of your own"
    return make_folder(cache.folder(), remedy) / "runs.sqlite"


def _found(drive: Drive, points: Points, shape: tuple[int, ...]) -> Sweep:
    """The rows of all points, from the store."""
    at: dict[bytes, list[int]] = {}
    for n, key in enumerate(points.keys):
        if key:
            at.setdefault(key, []).append(n)
    figures = {name: np.full(points.count, np.nan) for name in Kpis.border_names()}
    why = [points.why.get(n, "") for n in range(points.count)]
    for row in points.store.known(list(at)):
        for n in at[row.key]:
            why[n] = row.why
            for name, value in row.figures.items():
                if value is not None:
                    figures[name][n] = value
    return Sweep(drive.name, points.columns, figures, why, shape, points.ran, points.known)
