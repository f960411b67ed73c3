"""Cost of the closed loop at the rated point: wall time inside the core per simulated second.

    python bench/closed_loop.py > bench/closed_loop.csv

Each figure is the median of several runs in one process, so that the ratios between the cases hold
on a busy machine too.
"""

import platform
import statistics
from pathlib import Path

import reluctance as rl

RUNS = 15
SIMULATED = 0.2  # [s]
RATED = Path(__file__).parents[1] / "examples" / "paper_rated.toml"


def cpu() -> str:
    """The processor's name, as the machine gives it."""
    for line in Path("/proc/cpuinfo").read_text().splitlines():
        if line.startswith("model name"):
            return line.partition(":")[2].strip()
    return platform.processor()


def seconds_per_second(overrides: list[str]) -> tuple[float, float, float]:
    """Median, least and greatest wall time per simulated time."""
    drive = rl.load(RATED, overrides)
    times = [
        rl.simulate(drive, until=SIMULATED, record=None).kpis.wall_s_per_sim_s for _ in range(RUNS)
    ]
    return statistics.median(times), min(times), max(times)


def main() -> None:
    print("case,median_s_per_s,min,max,ratio_to_first,machine")
    first = None
    for case, overrides in (
        ("paper_mpc double", []),
        ("paper_mpc float", ["control.precision='float'"]),
        ("paper_mpc double, dt_max 5 us", ["simulation.dt_max_us=5"]),
        ("paper_mpc double, band 2 A", ["control.i_band_A=2.0"]),
        ("paper_mpc double, T_s 40 us", ["control.T_s_us=40"]),
    ):
        median, least, greatest = seconds_per_second(overrides)
        first = first or median
        print(f'"{case}",{median:.4f},{least:.4f},{greatest:.4f},{median / first:.2f},{cpu()}')


if __name__ == "__main__":
    main()
