"""What the package's README says of a drive on a photovoltaic array; nothing for other drives."""

from __future__ import annotations

from reluctance.drive.drive import Drive

SIGNAL = (
    "\n| array current | in, analog | drive | before the dc-link capacitor, mean of a period; "
    "`board_read_source_current` |"
)
BY_LEGS = (
    "\n| array current | - | drive | not measured but computed from the phase currents; "
    "`board_read_source_current` returns 0 |"
)
STATES = """
The drive is on a photovoltaic array. The reference of a command is a **greatest speed** in rad/s,
not a torque: the drive takes what the array gives, up to that speed, and 0 stops the pump. A
voltage controller holds the dc link. Tracking ({tracking}) moves its reference between
{u_ref_min:.4g} and {u_ref_max:.4g} V every {interval:g} ms. In state `run` the drive rests until
the dc link has been above {u_wake:.4g} V for {t_wake:g} s. It rests again after {t_sleep:g} s below
{p_sleep:g} W.
{dry} Without load, in full sun at {cold:g} degC, the array gives {u_cold:.4g} V: switches and
capacitor must stand that. The array takes no energy back, so the drive never brakes.
"""
DRY = "A pump that runs dry stops for {rest:g} s."
NOT_DRY = "Dry running is not watched (`k_dry_Nms2`)."
SPIN = """
On the bench, a supply of {u_dc:g} V takes the place of the array, with its current limit at a tenth
of the array's current. The request is a speed: ask for a tenth of {speed:g} rpm first. The speed
rises by {ramp:g} rpm a second at most. A supply has no maximum power point, so the voltage
reference moves to its lower end: judge the tracking on the array alone."""
TENTH = "a tenth of the torque"


def array_marks(drive: Drive) -> dict[str, str]:
    """The marks of the template."""
    if drive.reference.kind != "pv":
        return {"array_signal": "", "array_states": "", "array_spin": "", "first_request": TENTH}
    law, u_dc = drive.pv_control, drive.converter.u_dc_V
    words = {
        **law.voltages(u_dc),
        "tracking": law.tracking.replace("_", " and "),
        "interval": law.interval_ms,
        "t_wake": law.wake_s,
        "t_sleep": law.sleep_s,
        "p_sleep": law.p_sleep_W,
        "dry": DRY.format(rest=law.rest_s) if law.k_dry_Nms2 else NOT_DRY,
        "cold": drive.source.temp_cold_degC,
        "u_cold": drive.source.cold_voltage,
    }
    spin = {"u_dc": u_dc, "speed": drive.reference.speed_rpm, "ramp": law.acceleration_rpmps}
    return {
        "array_signal": SIGNAL if law.current == "sensor" else BY_LEGS,
        "array_states": STATES.format(**words),
        "array_spin": SPIN.format(**spin),
        "first_request": "a tenth of the speed",
    }
