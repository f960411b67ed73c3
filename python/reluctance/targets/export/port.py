"""A reference port: what a microcontroller's port of the package is set to, from the drive file."""

from __future__ import annotations

import numpy as np

from reluctance.base.errors import ParameterError
from reluctance.drive.drive import Drive
from reluctance.drive.guard.trip_levels import protection
from reluctance.targets.export.constants import literal

CLOCK_HZ = {"stm32g474": 170e6}  # of the timers
MOST_TICKS = 65_535 - 32  # of a period: 16 bits
DC_LINK_RANGE = 1.25  # of the over-voltage level: full scale of the dc-link converter
CODES_ABOVE_ZERO = 4095 - 64  # of a current: code 64 is zero
WATCHDOG_HZ, WATCHDOG_PERIODS, WATCHDOG_LEAST = 8e3, 50, 8  # ticks; control periods; ticks


def port_marks(name: str, drive: Drive, gates: set[int]) -> dict[str, str]:
    """What the templates of a port name, for a drive that fits it.

    Raises
    ------
    ParameterError
        If there is no such port, or the drive needs what it does not have.
    """
    if name not in CLOCK_HZ:
        raise ParameterError(f"--port {name}, need one of: {', '.join(CLOCK_HZ)}")
    sensing = drive.sensing
    for fault, need in (
        (drive.machine.n_phases != 3, "machine with three phases"),
        (gates != {1}, "law that orders timers, or [sensing] comparators = 'sampled'"),
        (sensing.delay_samples != 1, "[sensing] delay_samples = 1"),
        (sensing.adc_bits != 12, "[sensing] adc_bits = 12"),
        (not 0 < sensing.encoder_counts <= 65536, "[sensing] encoder_counts of 1 to 65536"),
        (sensing.hall or sensing.encoder_index, "[sensing] without hall and encoder_index"),
        (
            protection(drive).levels.i_trip > CODES_ABOVE_ZERO / 4096 * sensing.i_range_A,
            f"[sensing] i_range_A with the trip level below {CODES_ABOVE_ZERO}/4096 of it",
        ),
        (drive.converter.t_min <= 0, "[converter] min_pulse_us"),
        (drive.reference.kind == "pv", "reference other than `pv`: it reads no source current"),
    ):
        if fault:
            raise ParameterError(f"the port to {name} cannot run this drive: need a {need}")
    ticks = drive.control.T_s * CLOCK_HZ[name]
    if abs(ticks - round(ticks)) > 1e-6 * ticks or ticks > MOST_TICKS:
        raise ParameterError(
            f"[control] T_s_us = {drive.control.T_s_us:g} is {ticks:.6g} ticks of the timer, need "
            f"a whole number, at most {MOST_TICKS}"
        )
    watchdog = max(int(np.ceil(WATCHDOG_PERIODS * drive.control.T_s * WATCHDOG_HZ)), WATCHDOG_LEAST)
    full = DC_LINK_RANGE * protection(drive).levels.u_dc_max
    return {
        "period_ticks": str(round(ticks)),
        "A_per_code": literal(sensing.i_range_A / 4096, "A per code"),
        "V_per_code": literal(full / 4096, "V per code"),
        "encoder_counts": str(sensing.encoder_counts),
        "watchdog": str(watchdog),
    }
