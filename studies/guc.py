"""Question: does a published linear drive come out the same here? GUC test case 1.

    python studies/guc.py [--out DIR]

The drive: 6/4 machine with straight lines of inductance, 300 V, speed loop, cubic torque sharing,
current hysteresis; 100 rad/s, a load of 1.5 N m from 0.1 s on. Source:
github.com/andrew-abdelmalak/srm-speed-torque-control @ 1a25e52 (MIT); its numbers are in
machines/guc_linear_6_4.toml and below.

Two rows are made. `as published` runs the published control law, written again here from its
description, in the loop of this program; `torque_sharing` runs this program's own law of that name.

Differences from the published script, which steps plant and control with one Euler step of 10 us:

- plant: located events and Runge-Kutta steps, current zero and windings solved between samples;
- angle: 0 is unaligned here; the source's 0 is the start of the rise, 18 deg electrical later;
- inductance: its kinks are rounded over +-1 deg mechanical (the map of the machine library);
- load: it is 0 in a first run to 0.1 s and 1.5 N m in a second one, which goes on with the speed,
  angle and integrator of the first but from zero current;
- ripple: unfiltered over whole electrical periods; the source takes the standard deviation of every
  tenth step over the last 0.1 s;
- `torque_sharing` beside this: comparators instead of sampled switching, soft instead of hard
  chopping, current from the machine's own torque map (the source: sqrt(2 T/(dL/dtheta)), no current
  where dL/dtheta = 0), torque limit +-5 N m (the source: 0 to 5), reference for mid-sample.
"""

from __future__ import annotations

import argparse
import csv
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

import reluctance as rl
from reluctance import _core
from reluctance.drive import Drive
from reluctance.drive.library import machine_table
from reluctance.load import drive_from
from reluctance.run.kpis import definite
from reluctance.run.result import Result

OMEGA_REF, TAU_LOAD = 100.0, 1.5  # [rad/s, N m]
T_LOAD, T_END = 0.1, 0.5  # [s]
T_S = 10e-6  # [s]
K_P, K_I, TAU_MAX = 0.5, 10.0, 5.0  # [N m s, N m, N m]
I_MAX, I_BAND = 15.0, 0.1  # [A]
N_R, STROKE, OVERLAP = 4, math.radians(30), math.radians(10)  # mechanical [rad]
L_MIN, L_MAX, RISE = 0.020, 0.150, math.radians(38)  # [H, rad mechanical]
UNALIGNED = math.radians(4.5)  # before the start of the rise [rad mechanical]

PUBLISHED = {  # of test case 1
    "rise_ms": 32.4,
    "torque_mean_Nm": 1.600,
    "i_peak_A": 7.269,
}
TOLERANCE = 0.01
PUBLISHED_RIPPLE = {"Simulink": 0.337, "Python, older readme": 0.140, "its script run again": 0.060}


@dataclass
class Published:
    """The published control: a function for `_core.controller_from`, and its memory."""

    integral: float = 0.0  # of the speed error [rad]
    legs: tuple[int, ...] = (-1, -1, -1)

    def __call__(
        self,
        i: list[float],
        theta_e: float,
        omega_m: float,
        u_dc: float,
        reference: float,
        i_source: float,
    ) -> list[float]:
        """One sample, at 10 us. Returns the ORDER_COLUMNS of each phase, of which the leg alone
        matters, and the torque reference."""
        error = reference - omega_m
        tau = K_P * error + K_I * self.integral
        if not ((tau >= TAU_MAX and error >= 0) or (tau <= 0 and error <= 0)):
            self.integral += error * T_S
        tau = min(max(tau, 0.0), TAU_MAX)
        pitch = 2 * math.pi / N_R
        legs = []
        for k, last in enumerate(self.legs):
            theta = (theta_e / N_R - UNALIGNED - k * STROKE) % pitch
            i_ref = current(share(theta) * tau, theta)
            legs.append(1 if i[k] < i_ref - I_BAND else -1 if i[k] > i_ref + I_BAND else last)
        self.legs = tuple(legs)
        timer = float(_core.Gate.timer.value)
        orders = [number for leg in legs for number in (*5 * [leg], timer, *13 * [0.0])]
        return [*orders, tau]


def share(theta: float) -> float:
    """Cubic share of a phase at a mechanical angle from the start of its rise."""
    if theta < OVERLAP:
        return cubic(theta / OVERLAP)
    if theta < STROKE:
        return 1.0
    return 1 - cubic((theta - STROKE) / OVERLAP) if theta < STROKE + OVERLAP else 0.0


def cubic(x: float) -> float:
    return x * x * (3 - 2 * x)


def current(tau: float, theta: float) -> float:
    """T = i^2/2 dL/dtheta, solved for i; none where the inductance does not rise."""
    if theta >= RISE:
        return 0.0
    return min(math.sqrt(2 * tau * RISE / (L_MAX - L_MIN)), I_MAX)


def drive(tau_load: float, omega_start: float, theta_start: float) -> Drive:
    """The drive file of the test case; `torque_sharing` is its law unless another is given."""
    return drive_from(
        {
            "machine": machine_table("guc_linear_6_4", Path.cwd()),
            "converter": {"u_dc_V": 300.0},
            "load": {
                "kind": "torque",
                "tau_Nm": tau_load,
                "speed_rpm": omega_start * 30 / math.pi,
            },
            "reference": {"kind": "speed", "speed_rpm": OMEGA_REF * 30 / math.pi},
            "control": {
                "law": "torque_sharing",
                "T_s_us": T_S * 1e6,
                "tau_max_Nm": TAU_MAX,
                "K_p_Nms": K_P,
                "K_i_Nm": K_I,
                "sharing": "cubic",
                "theta_on_deg": math.degrees(UNALIGNED) * N_R,
                "theta_ov_deg": math.degrees(OVERLAP) * N_R,
                "i_band_A": I_BAND,
            },
            "simulation": {"until_s": T_LOAD, "theta_start_deg": math.degrees(theta_start)},
        },
        name="GUC test case 1",
    )


def test_case(controller: _core.Controller | None) -> tuple[Result, Result]:
    """The run-up without load and the run with it; None takes the program's own law."""
    up = drive(0.0, 0.0, UNALIGNED)
    first = rl.simulate(up, until=T_LOAD, record=T_S, controller=controller)
    loaded = drive(TAU_LOAD, float(first.omega_m[-1]), float(first.theta_m[-1]))
    second = rl.simulate(loaded, until=T_END - T_LOAD, record=T_S, controller=controller)
    return first, second


def figures(first: Result, second: Result) -> dict[str, float]:
    """The published figures of a run, and its ripple."""
    t10, t90 = (first.t[np.argmax(first.omega_m >= part * OMEGA_REF)] for part in (0.1, 0.9))
    k = second.kpis
    return {
        "rise_ms": (t90 - t10) * 1e3,
        "torque_mean_Nm": k.tau_mean,
        "i_peak_A": max(first.i.max(), second.i.max()),
        "speed_rad_s": k.speed_mean,
        "ripple_rms_Nm": definite(k.torque_ripple_rms) * k.tau_mean,
        "ripple_pp_Nm": definite(k.torque_ripple_pp) * k.tau_mean,
        "f_switch_kHz": k.f_switch / 1e3,
    }


def plot(runs: dict[str, tuple[Result, Result]]) -> Figure:
    """Speed over the whole test case; torque over the last two electrical periods."""
    figure = Figure(figsize=(11, 4.5), layout="constrained")
    FigureCanvasAgg(figure)
    speed, torque = figure.subplots(1, 2)
    for name, (first, second) in runs.items():
        t = np.concatenate([first.t, T_LOAD + second.t]) * 1e3
        speed.plot(t, np.concatenate([first.omega_m, second.omega_m]), label=name)
        last = second.t > second.t[-1] - 4 * math.pi / (N_R * OMEGA_REF)
        torque.plot((T_LOAD + second.t[last]) * 1e3, second.tau[last], lw=0.7, label=name)
    speed.set(xlabel="time (ms)", ylabel="speed (rad/s)")
    torque.set(xlabel="time (ms)", ylabel="torque (N m)")
    for ax in (speed, torque):
        ax.grid(alpha=0.3)
        ax.legend(loc="lower right")
    return figure


def study() -> tuple[dict[str, dict[str, float]], dict[str, tuple[Result, Result]]]:
    """Figures and waveforms of both rows."""
    runs = {
        "as published": test_case(_core.controller_from(3, Published())),
        "torque_sharing": test_case(None),
    }
    return {name: figures(*run) for name, run in runs.items()}, runs


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("out/guc"))
    out: Path = parser.parse_args().out
    rows, runs = study()
    out.mkdir(parents=True, exist_ok=True)
    plot(runs).savefig(out / "guc.png", dpi=110, metadata={"Software": None})
    with (out / "guc.csv").open("w", newline="") as file:
        writer = csv.DictWriter(file, ["row", *rows["as published"]], lineterminator="\n")
        writer.writeheader()
        writer.writerows({"row": name, **row} for name, row in rows.items())
    for key, published in PUBLISHED.items():
        off = rows["as published"][key] / published - 1
        verdict = "within" if abs(off) <= TOLERANCE else "outside"
        print(
            f"{key}: published {published:g}, here {rows['as published'][key]:.4g} "
            f"({off:+.2%}, {verdict} {TOLERANCE:.0%})"
        )
    for name, row in rows.items():
        print(f"{name}: " + ", ".join(f"{key} {value:.4g}" for key, value in row.items()))
    ripples = ", ".join(f"{value:g} ({who})" for who, value in PUBLISHED_RIPPLE.items())
    print(
        f"ripple rms published: {ripples} N m; "
        f"with located events: {rows['as published']['ripple_rms_Nm']:.4f} N m"
    )


if __name__ == "__main__":
    main()
