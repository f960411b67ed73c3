"""The same job as numba_rk4.py, and as many of them, by this program."""

import json
import time
from pathlib import Path

import reluctance as rl

DRIVE = Path(__file__).parents[2] / "examples" / "single_pulse.toml"
SAME = [
    "load.speed_rpm=1500",
    "control.regulate=current",
    "control.i_ref_A=60",
    "control.i_band_A=1",
    "simulation.dt_max_us=20",
]


def cpu_of(drive: rl.Drive, end: float) -> tuple[float, float]:
    """Least processor time per simulated time of three runs, and the mean torque."""
    times = []
    for _ in range(3):
        start = time.process_time()
        result = rl.simulate(drive, until=end, record=None)
        times.append((time.process_time() - start) / end)
    return min(times), result.kpis.tau_mean


def main() -> None:
    angles, tau = cpu_of(rl.load(DRIVE, SAME), 1.0)
    predictive, _ = cpu_of(rl.load(DRIVE.with_name("paper_rated.toml")), 0.5)
    for name, cpu, job in (
        ("angles", angles, f"angles and hysteresis; instants located; mean torque {tau:.2f} N m"),
        ("paper_mpc", predictive, "predictive torque control every 20 us; instants located"),
    ):
        peer = f"reluctance {rl.__version__}, {name}"
        print(json.dumps({"peer": peer, "cpu_s_per_s": cpu, "job": job}))


if __name__ == "__main__":
    main()
