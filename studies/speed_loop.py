"""Question: how far does the speed dip under a load step, and how fast is a reversal?

    python studies/speed_loop.py [--out DIR]

Three drives with other machines, inertias, periods and delays, each with an ideal angle and with
encoders, under `edge_mpc`. The load comes when the drive has settled, and so does the reversal, at
ten rotor angles of a stroke; the table has the worst of them. `pi_20Hz` is the loop with
`speed_bandwidth_Hz = 20` and `tracker_bandwidth_Hz = 80`: a PI controller, its reference as given.
"""

from __future__ import annotations

import argparse
import csv
import multiprocessing
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import reluctance as rl
from reluctance.base.key_figures import definite
from reluctance.base.picture import Picture
from reluctance.drive.run.result import Result
from reluctance.explore.comparison.comparison import PROCESSES

EXAMPLE = Path(__file__).parents[1] / "examples" / "edge_mpc_mcu.toml"
T_STEP, RECORD = 0.05, 20e-6  # [s]
AFTER = 0.15  # of the load step; its second half gives the ripple [s]
ANGLES = 10
BAND = 0.01  # of the speed: recovered, reversed
RPM = np.pi / 30  # [rad/s]


@dataclass(frozen=True)
class Case:
    """A drive, and what is asked of it."""

    name: str
    machine: str
    u_dc_V: float
    rpm: float  # of the load step
    tau_Nm: float  # load that comes
    tau_max_Nm: float  # during the load step
    reversal_rpm: float
    tau_reversal_Nm: float  # tau_max during the reversal
    T_s_us: float = 20.0
    delay: int = 1
    J_kgm2: float = 0.0  # in addition to the rotor's

    def drive(self, counts: int, *more: str) -> rl.Drive:
        """The drive with a speed loop on a free shaft; counts: 0 is an ideal angle."""
        return rl.load(
            EXAMPLE,
            [
                f"machine={self.machine}",
                f"converter.u_dc_V={self.u_dc_V}",
                f"control.T_s_us={self.T_s_us}",
                f"sensing.delay_samples={self.delay}",
                f"load.J_kgm2={self.J_kgm2}",
                *("sensing.adc_bits=", "sensing.i_range_A=", "load.kind=torque"),
                *("reference.kind=speed", "reference.tau_Nm="),
                f"sensing.encoder_counts={counts or ''}",
                *more,
            ],
        )


CASES = (
    Case("paper", "paper_6_4", 240, 1500, 41.3, 60, 1000, 45),
    Case("paper_10us", "paper_6_4", 240, 1500, 41.3, 60, 1000, 45, T_s_us=10, delay=0),
    Case("paper_inertia", "paper_6_4", 240, 1500, 41.3, 60, 1000, 45, J_kgm2=0.03),
    Case("60kW", "generic_60kw_6_4", 300, 1500, 80, 120, 1000, 120),
    Case("12_8", "design_12_8", 300, 1000, 20, 30, 700, 30),
    Case("1hp_8_6", "generic_1hp_8_6", 300, 1000, 2, 3, 700, 3),
)
COUNTS = (0, 16384, 4096, 1024)
BEFORE = ("control.speed_bandwidth_Hz=20", "sensing.tracker_bandwidth_Hz=80")
LOOPS = {"rule": (), "pi_20Hz": BEFORE}


@dataclass(frozen=True)
class Row:
    """The worst over the angles, except for the mean dip."""

    case: str
    loop: str
    encoder_counts: int
    dip_mean_rpm: float
    dip_rpm: float
    back_ms: float  # until the speed stays within 1 %
    torque_ripple_rms: float
    overshoot_rpm: float  # of the reversal
    reversal_ms: float  # until the speed stays within 1 %
    reversal_least_ms: float  # at tau_max throughout, without friction


def load_step_drive(case: Case, counts: int, theta_deg: float, *more: str) -> rl.Drive:
    """The load comes at T_STEP."""
    return case.drive(
        counts,
        f"control.tau_max_Nm={case.tau_max_Nm}",
        f"load.speed_rpm={case.rpm}",
        f"reference.speed_rpm={case.rpm}",
        f"load.t_s=[{T_STEP}, {T_STEP}]",
        f"load.values=[0, {case.tau_Nm}]",
        f"simulation.theta_start_deg={theta_deg}",
        *more,
    )


def load_step(case: Case, counts: int, theta_deg: float, *more: str) -> Result:
    """A run of it."""
    drive = load_step_drive(case, counts, theta_deg, *more)
    return rl.simulate(drive, until=T_STEP + AFTER, record=RECORD)


def least_time(case: Case, drive: rl.Drive) -> float:
    """Of the reversal at tau_max throughout [s]."""
    return 2 * case.reversal_rpm * RPM * drive.J / case.tau_reversal_Nm


def reversal_drive(case: Case, counts: int, theta_deg: float, *more: str) -> rl.Drive:
    """The reference changes its sign at T_STEP."""
    return case.drive(
        counts,
        f"control.tau_max_Nm={case.tau_reversal_Nm}",
        f"load.speed_rpm={case.reversal_rpm}",
        f"reference.t_s=[{T_STEP}, {T_STEP}]",
        f"reference.values=[{case.reversal_rpm}, {-case.reversal_rpm}]",
        f"simulation.theta_start_deg={theta_deg}",
        *more,
    )


def reversal(case: Case, counts: int, theta_deg: float, *more: str) -> Result:
    """A run of it."""
    drive = reversal_drive(case, counts, theta_deg, *more)
    return rl.simulate(drive, until=T_STEP + 3 * least_time(case, drive), record=RECORD)


def stays(t: np.ndarray, off: np.ndarray) -> float:
    """From T_STEP until the last sample that is off [s]."""
    late = np.flatnonzero(off & (t >= T_STEP))
    return float(t[late[-1]] - T_STEP) if len(late) else 0.0


def measured(task: tuple[Case, str, int]) -> Row:
    """All angles of a case."""
    case, loop, counts = task
    more = LOOPS[loop] if counts else LOOPS[loop][:1]
    drive = case.drive(counts, f"control.tau_max_Nm={case.tau_max_Nm}", "reference.speed_rpm=1")
    stroke = 360 / (drive.machine.n_phases * drive.machine.N_r)
    dips, backs, ripples, overs, times = [], [], [], [], []
    for theta_deg in np.arange(ANGLES) * stroke / ANGLES:
        run = load_step(case, counts, theta_deg, *more)
        rpm = run.omega_m / RPM
        dips.append(case.rpm - rpm[run.t >= T_STEP].min())
        backs.append(stays(run.t, np.abs(rpm - case.rpm) > BAND * case.rpm))
        ripples.append(definite(run.kpis.torque_ripple_rms))
        run = reversal(case, counts, theta_deg, *more)
        rpm = run.omega_m / RPM
        overs.append(-case.reversal_rpm - rpm.min())
        off = np.abs(rpm + case.reversal_rpm) > BAND * case.reversal_rpm
        times.append(stays(run.t, off))
    return Row(
        case=case.name,
        loop=loop,
        encoder_counts=counts,
        dip_mean_rpm=float(np.mean(dips)),
        dip_rpm=max(dips),
        back_ms=1e3 * max(backs),
        torque_ripple_rms=max(ripples),
        overshoot_rpm=max(overs),
        reversal_ms=1e3 * max(times),
        reversal_least_ms=1e3 * least_time(case, drive),
    )


def tasks() -> list[tuple[Case, str, int]]:
    """All cases by rule; the first one with the loop as it was too."""
    by_rule = [(case, "rule", counts) for case in CASES for counts in COUNTS]
    return [*by_rule, *((CASES[0], "pi_20Hz", counts) for counts in (0, 4096))]


def plot() -> Figure:
    """Speed of the first case after a load step and a reversal."""
    figure = Picture(11, 4)
    step, turn = figure.subplots(1, 2)
    case = CASES[0]
    for label, counts, more in (
        ("by rule, ideal angle", 0, ()),
        ("by rule, 4096 counts", 4096, ()),
        ("20 Hz, ideal angle", 0, BEFORE[:1]),
        ("20 Hz, 4096 counts", 4096, BEFORE),
    ):
        style = {"ls": "-" if not more else "--"}
        for ax, run in (
            (step, load_step(case, counts, 0.0, *more)),
            (turn, reversal(case, counts, 0.0, *more)),
        ):
            ax.plot(1e3 * (run.t - T_STEP), run.omega_m / RPM, label=label, **style)
    step.set(xlim=(-5, 60), ylabel="speed (rpm)")
    turn.set(xlim=(-5, 100))
    for ax in (step, turn):
        ax.set(xlabel="time after the step (ms)")
        ax.grid(alpha=0.3)
    step.legend(fontsize=8)
    return figure


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("out/speed_loop"))
    out: Path = parser.parse_args().out
    with multiprocessing.get_context("spawn").Pool(PROCESSES) as pool:
        rows = pool.map(measured, tasks(), chunksize=1)
    out.mkdir(parents=True, exist_ok=True)
    with (out / "speed_loop.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, list(vars(rows[0])), lineterminator="\n")
        writer.writeheader()
        writer.writerows(
            {key: f"{x:.6g}" if isinstance(x, float) else x for key, x in vars(row).items()}
            for row in rows
        )
    plot().savefig(out / "speed_loop.png", dpi=80, metadata={"Software": None})
    for row in rows:
        print(
            f"{row.case:14s} {row.loop:8s} {row.encoder_counts:6d} counts"
            f"  dip {row.dip_rpm:6.1f} rpm, back {row.back_ms:5.1f} ms"
            f"  ripple {100 * row.torque_ripple_rms:5.2f} %"
            f"  over {row.overshoot_rpm:5.1f} rpm"
            f"  reversal {row.reversal_ms:6.1f} ms (least {row.reversal_least_ms:.1f})"
        )


if __name__ == "__main__":
    main()
