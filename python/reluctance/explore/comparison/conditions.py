"""The conditions that every law of a comparison meets: one operating point, shaft held."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from reluctance.base.errors import ParameterError
from reluctance.base.units import from_si
from reluctance.drive.drive import Drive
from reluctance.drive.tables.load import Load
from reluctance.drive.tables.pv_control import PvControl
from reluctance.drive.tables.sections import Reference
from reluctance.drive.tables.source import Source
from reluctance.explore.limits.point import operating_point as asked_of

COMPARATORS = {
    "analog": "analog: they see the true current and switch at any instant",
    "sampled": "sampled: the control compares the currents that it measures, once per sample",
}


def operating_point(drive: Drive) -> Drive:
    """The drive at its working speed and torque, with the shaft held.

    A speed loop would mix its own ripple into every figure, and a run-up would cost most of the
    time; so the load's torque at the working speed becomes the reference.

    Raises
    ------
    ParameterError
        If the drive has no single working point, or it is standstill.
    """
    omega = drive.omega_nominal
    if omega == 0:
        raise ParameterError(
            "[load] speed_rpm = 0: ripple and switching frequency are means over electrical "
            "periods, and at standstill none ends; give a speed"
        )
    if drive.reference.kind == "none":
        raise ParameterError("[reference] kind = 'none': laws are compared at one torque; give it")
    course = drive.reference.course[1]
    if min(course) != max(course):
        raise ParameterError("[reference] changes over time: laws are compared at one point")
    tau, _ = asked_of(drive, omega_m=omega)
    if tau <= 0:
        raise ParameterError(f"torque {tau:g} N m, need > 0 to compare laws at it")
    speed_rpm = drive.load.speed_rpm if drive.load.kind == "locked" else from_si(omega, "rpm")
    held = Load(kind="locked", speed_rpm=speed_rpm, J_kgm2=drive.load.J_kgm2)
    asked = Reference(kind="torque", tau_Nm=tau)
    if drive.reference.kind != "pv":
        return replace(drive, load=held, reference=asked)
    stiff = Source()  # at the nominal voltage: on an array the light would set the point
    return replace(drive, load=held, reference=asked, source=stiff, pv_control=PvControl())


def period(point: Drive) -> float:
    """Electrical period [s]."""
    return 2 * np.pi / (point.machine.N_r * point.omega_nominal)


def conditions(point: Drive) -> dict[str, str | float | None]:
    """What is the same for all laws, under border names."""
    s, m, c = point.sensing, point.mismatch, point.converter
    return {
        "machine": point.machine.name,
        **{key: getattr(c, key) for key in type(c).model_fields},
        "speed_rpm": point.load.speed_rpm,
        "tau_ref_Nm": point.reference.course[1][0],
        "J_kgm2": point.J,
        "T_s_us": point.control.T_s_us,
        "precision": point.control.precision,
        **{key: getattr(s, key) for key in type(s).model_fields},
        **{key: getattr(m, key) for key in type(m).model_fields},
    }


def in_words(point: Drive, f_target: float) -> list[str]:
    """The conditions as lines of text."""
    s, m, c = point.sensing, point.mismatch, point.converter
    bits = f"{s.adc_bits} bits over {s.i_range_A:g} A" if s.adc_bits else "ideal"
    angle = f"{s.encoder_counts} counts a revolution" if s.encoder_counts else "ideal"
    drops = (
        f"{c.v_switch_V:g} V + {c.R_switch_ohm:g} ohm, "
        f"diodes {c.v_diode_V:g} V + {c.R_diode_ohm:g} ohm"
        if any((c.v_switch_V, c.R_switch_ohm, c.v_diode_V, c.R_diode_ohm))
        else "ideal"
    )
    late = f", dead time {c.dead_time_us:g} us" if c.dead_time_us else ""
    return [
        f"{point.machine.name}; {c.u_dc_V:g} V, {point.load.speed_rpm:g} rpm, "
        f"{point.reference.course[1][0]:g} N m; switches {drops}{late}",
        f"switching frequency {f_target / 1e3:g} kHz per switch; sampling every "
        f"{point.control.T_s_us:g} us (with a carrier: at its period, not below that), "
        f"delay {s.delay_samples} samples, computed in {point.control.precision}",
        f"comparators {COMPARATORS[s.comparators]}",
        f"current {bits}; angle {angle}; model mismatch: R x{m.R_factor:g}, "
        f"flux x{m.flux_factor:g}, angle offset {m.angle_offset_deg:g} deg (electrical)",
    ]
