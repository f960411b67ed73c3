"""Question: how near does `edge_mpc` come to the least ripple of its switching frequency?

    python studies/least_ripple.py [--out DIR]

The example for 2 us without delay, at its rated and at half torque, with either guide. The bound is
that of the least-copper profile at the frequency that the run has.
"""

from __future__ import annotations

import argparse
import csv
from pathlib import Path
from typing import Any

import reluctance as rl
from reluctance.base.key_figures import definite
from reluctance.explore.limits import floor_of

EXAMPLE = Path(__file__).parents[1] / "examples" / "edge_mpc_fpga.toml"
ASKED = {5: 5.65, 10: 11.5, 20: 22.5, 40: 45.0}  # about this frequency, and what to ask for [kHz]
GUIDES = ("least_copper", "least_ripple")
TORQUES = {"rated": 41.339, "half": 20.669}  # [N m]
UNTIL = 0.2  # [s]


def row(guide: str, torque: str, about: int) -> dict[str, Any]:
    """One run and its bound."""
    values = [f"control.guide={guide}", f"control.f_switch_kHz={ASKED[about]}"]
    drive = rl.load(EXAMPLE, [*values, f"reference.tau_Nm={TORQUES[torque]}"])
    k = rl.simulate(drive, until=UNTIL, record=None).kpis
    floor = floor_of(
        drive,
        tau_ref=TORQUES[torque],
        omega_m=drive.omega_nominal,
        switching_frequency=k.f_switch,
    )
    error = definite(k.torque_error_rms) * TORQUES[torque]
    return {
        "case": f"{guide} {torque} {about}",
        "f_switch_Hz": f"{k.f_switch:.0f}",
        "error_rms": f"{definite(k.torque_error_rms):.6f}",
        "i_rms_A": f"{k.i_rms:.3f}",
        "to_bound": f"{error / floor.bound_rms:.4f}",
        "to_returning": f"{error / floor.returning_rms:.4f}",
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("."))
    rows = [row(g, t, about) for g in GUIDES for t in TORQUES for about in ASKED]
    path = parser.parse_args().out / "least_ripple.csv"
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


if __name__ == "__main__":
    main()
