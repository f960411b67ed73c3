"""The drives that the studio begins from: examples, some with another machine."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from reluctance.base.resources import resources
from reluctance.drive.drive import Drive
from reluctance.drive.laws import LAWS
from reluctance.drive.laws.conduction import ConductionAngles
from reluctance.drive.laws.shared_torque import SharedTorque
from reluctance.drive.load import load
from reluctance.targets.studio.controls import parameters


@dataclass(frozen=True)
class Start:
    """A machine under a law at an operating point."""

    name: str
    example: str
    changes: Mapping[str, Any] = field(default_factory=dict)
    title: str = ""  # in the list of laws, in place of the law's own

    @property
    def law(self) -> str:
        """The control law."""
        given = tomllib.loads((resources("examples") / f"{self.example}.toml").read_text("utf-8"))
        return str(self.changes.get("control.law", given["control"]["law"]))

    def drive(self) -> Drive:
        """The drive, with what its law computes by default written out as keys."""
        drive = load(resources("examples") / f"{self.example}.toml").with_values(self.changes)
        keys: dict[str, Any] = {}
        if isinstance(drive.control, ConductionAngles):
            window = np.degrees(drive.control.window(drive.known()))
            keys = dict(zip(("control.theta_on_deg", "control.theta_off_deg"), window, strict=True))
        elif isinstance(drive.control, SharedTorque) and drive.control.theta_on_deg is None:
            numbers = parameters(drive, of_control=True)
            of = {name.rpartition("law.sharing.")[2]: v for name, v in numbers.items()}
            on, overlap = (np.degrees(of[name]) for name in ("theta_on", "theta_ov"))
            keys = {"control.theta_on_deg": on, "control.theta_ov_deg": overlap}
        if drive.sensing.i_range_A == 0:
            keys["sensing.i_range_A"] = drive.machine.i_max_A  # read once there are bits
        return drive.with_values({key: round(float(v), 1) for key, v in keys.items()})


FOUR_PHASES = {
    "machine": "generic_1hp_8_6",
    "converter.u_dc_V": 300,
    "load.speed_rpm": 1000,
    "reference.tau_Nm": 1.5,
}
LINEAR = {
    "machine": "guc_linear_6_4",
    "converter.u_dc_V": 300,
    "load.speed_rpm": 500,
    "reference.tau_Nm": 2.0,
    "control.i_band_A": 0.1,
}
SUPERVISED = {  # it starts, meets a fault, is cleared and starts again
    "supervision.enable_s": 0.0,
    "supervision.precharge_ms": 20,
    "supervision.fault": "over_current",
    "supervision.fault_phase": "b",
    "supervision.fault_s": 0.15,
    "supervision.clear_s": 0.17,
    "supervision.restart_s": 0.18,
    "protection.command_timeout_ms": 10,
    "protection.diagnosis": True,
    "simulation.until_s": 0.3,
}
SHOWN = (
    Start("sharing", "sharing_cubic"),
    Start("single_pulse", "single_pulse", title="single pulse"),
    Start("pwm", "pwm_current"),
    Start("ditc", "ditc"),
    Start("deadbeat", "deadbeat"),
    Start("paper_mpc", "paper_rated"),
    Start("finite_set", "finite_set_mpc"),
    Start("edge_mpc", "edge_mpc_mcu"),
    Start("hysteresis_60kw", "hysteresis_200A"),
    Start("four_sharing", "sharing_cubic", {**FOUR_PHASES, "control.i_band_A": 0.05}),
    Start("four_ditc", "ditc", FOUR_PHASES),
    Start("map_sharing", "map_mpc", {"control.law": "torque_sharing", "control.T_s_us": 20}),
    Start("map_mpc", "map_mpc"),
    Start("linear_sharing", "sharing_cubic", LINEAR),
    Start("supervised", "sharing_cubic", SUPERVISED, title="torque sharing, with its states"),
)


def _starts() -> tuple[Start, ...]:
    """Those above, and each law that none of them has."""
    shown = {start.law for start in SHOWN}
    return SHOWN + tuple(
        Start(law, "sharing_cubic", {"control.law": law}) for law in LAWS if law not in shown
    )


STARTS = _starts()
