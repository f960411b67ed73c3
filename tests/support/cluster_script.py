"""A sweep on a local Dask cluster of two workers, one of which is killed in the middle.

python cluster_script.py STORE
"""

import os
import signal
import sys
from pathlib import Path

import reluctance as rl

DRIVE = Path(__file__).parents[2] / "examples" / "sharing_cubic.toml"
BANDS = [0.5 + n / 50 for n in range(80)]
UNTIL = 0.02


def main(store: str) -> None:
    from distributed import Client, LocalCluster

    with LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None
    ) as cluster:
        with Client(cluster) as client:
            workers = list(client.run(os.getpid).values())
        killed: list[int] = []

        def told(part: float) -> None:
            if part > 0.2 and not killed:
                os.kill(workers[0], signal.SIGKILL)
                killed.append(workers[0])

        found = rl.sweep(
            rl.load(DRIVE),
            {"control.i_band_A": BANDS},
            until=UNTIL,
            out=store,
            cluster=cluster.scheduler_address,
            progress=told,
        )
        print(len(workers), len(killed), found.ran, found.failed)


if __name__ == "__main__":
    main(sys.argv[1])
