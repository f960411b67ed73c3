"""The drive of a pumping system on its array: what is simulated to the switch, and exported.

Array, string, pump, pipe and limits come from the system, machine, converter and control law from
its drive file. Nothing of it stands in two files.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from reluctance.base.errors import ParameterError
from reluctance.drive.drive import Drive, drive_from
from reluctance.plant.hydraulics.pipe import hydraulics
from reluctance.pumping.system import WARM, System

# The dc-link capacitor holds the array's nominal power for so long, C u^2 / P [s]. 2.2 mF for 12.6
# kW at 240 V is 10 ms: the ripple of the link takes 0.06 % of the power (docs/pumping_control.md).
LINK_TIME = 10e-3
DRY = 0.4  # of the least torque over speed squared that the pump has with water
SLEEPS = 0.01  # of the nominal power: below it the drive rests
# A cloud from full sun in one second, the course of examples/sun_cloud.toml.
CLOUD = {
    "t_s": [0.0, 7.0, 8.0],
    "poa_global_Wpm2": [1000.0, 1000.0, 300.0],
    "temp_cell_degC": [WARM, WARM, WARM],
}
UNTIL = 13.0  # [s]
TRACKING = {"mppt": "perturb_observe", "constant": "constant"}


def drive_of(system: System) -> Drive:
    """The system's drive on its array and pump, with tracking of the maximum power.

    Raises
    ------
    ParameterError
        If the array is too high for the switches, or the controller has no such operation.
    """
    system.check_voltage()
    kind = system.operation.kind
    if kind not in TRACKING:
        remedy = (
            "the converter tracks, and its drive has a stiff dc link: take the drive file itself"
            if kind == "dcdc"
            else "take kind = 'mppt', or 'constant' with u_V"
        )
        raise ParameterError(
            f"[operation] kind = {kind!r}: the controller of a drive does not do that; {remedy}"
        )
    drive = system.drive
    u_dc, p_mp = system.u_dc, float(system.nominal.p[0])
    load = hydraulics(system.pump.curve(), system.pipe, system.pump.omega_max)
    tables: dict[str, dict[str, Any]] = drive.tables()
    tables["converter"] |= {"u_dc_V": u_dc}
    if system.limits.u_max_V is not None:
        tables["converter"] |= {"u_rating_V": system.limits.u_max_V}
    tables["source"] = {
        "kind": "pv",
        **{k: v for k, v in system.array.given.items() if k in OF_ARRAY},
        "C_uF": system.operation.C_uF or round(1e6 * LINK_TIME * p_mp / u_dc**2, -1),
        "temp_cold_degC": system.limits.temp_cold_degC,
        **CLOUD,
    }
    tables["load"] = {
        "kind": "pump",
        "J_kgm2": drive.load.J_kgm2,
        "pump": system.pump.given,
        **{k: v for k, v in system.pipe.given.items() if k in OF_PIPE},
    }
    tables["reference"] = {
        "kind": "pv",
        "speed_rpm": round(system.pump.omega_max * 30 / np.pi, 3),
    }
    tables["control"] |= {"tau_max_Nm": system.tau_max}
    tables["pv_control"] = {
        "tracking": TRACKING[kind],
        "u_ref_V": system.operation.u_V or u_dc,
        "p_sleep_W": round(SLEEPS * p_mp, 1),
        "k_dry_Nms2": float(f"{DRY * float((load.tau / load.omega**2).min()):.3g}"),
    } | drive.pv_control.given
    tables["simulation"] |= {"until_s": UNTIL}
    return drive_from(tables, name=system.name)


OF_ARRAY = {"module", "cell", "datasheet", "n_series", "n_parallel", "blocking_diode_V"}
OF_PIPE = {"H_static_m", "L_m", "D_mm", "roughness_mm", "K"}
