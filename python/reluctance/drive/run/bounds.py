"""What a run must stay within, so that it ends by itself: state, steps, memory.

A run is advanced in slices; between two of them it is held against these bounds.
"""

from __future__ import annotations

import numpy as np

from reluctance import _core
from reluctance.base.errors import ParameterError
from reluctance.base.units import from_si, to_si
from reluctance.drive.drive import Drive
from reluctance.drive.plausible import MOST_CURRENT, MOST_SPEED, MOST_STEPS, check_steps, most_speed

MOST_BYTES = 2e9  # of waveforms; a run holds about three times as much while it puts them together
JUDGED = 3e5  # steps after which the pace of a run tells how many it will take
ROWS_A_STEP = 1.5  # at the very least one a step; events add to it


class Bounds:
    """The bounds of one run, computed once."""

    def __init__(self, drive: Drive, end: float, record: float | None) -> None:
        check_steps(drive, end)
        self.drive, self.end = drive, end
        self.omega_m = most_speed(drive)
        self.i = MOST_CURRENT * drive.machine.i_max_A
        self.u_dc = 10 * max(drive.source.points(drive.converter.u_dc_V)[1])
        self.whole = drive.machine.iron is not None  # its loss needs every point
        self.rows = waveform_rows(drive, end, record)
        if self.whole:
            self.rows = max(self.rows, waveform_rows(drive, end, 0.0))
        self.row_bytes = 8 * len(_core.waveform_columns(drive.machine.n_phases))
        if self.rows * self.row_bytes > MOST_BYTES:
            raise self._too_large(self.rows)

    def check(self, loop: _core.Simulation, t: float, rows: int) -> None:
        """Raises ParameterError where the run has left them; `rows` of waveforms are kept."""
        currents, omega_m, theta_m, u_dc = loop.state()
        at = f"after {t:.4g} s"
        if not np.isfinite([*currents, omega_m, theta_m, u_dc]).all():
            raise ParameterError(
                f"the run has no finite numbers {at}; check the machine, the load and the speed "
                "loop, or lower [simulation] dt_max_us"
            )
        if abs(omega_m) > self.omega_m:
            raise ParameterError(
                f"the speed is {from_si(omega_m, 'rpm'):.4g} rpm {at}, need at most "
                f"{from_si(self.omega_m, 'rpm'):.3g} ({MOST_SPEED:g} times the corner speed): "
                "torque and load do not balance; check [load] and [reference]"
            )
        if max(currents) > self.i:
            raise ParameterError(
                f"a phase current is {max(currents):.4g} A {at}, need at most {self.i:.4g} "
                f"({MOST_CURRENT:g} times i_max_A); check u_dc_V, R_ohm and the window of the law"
            )
        if u_dc > self.u_dc:
            raise ParameterError(
                f"the dc link is at {u_dc:.4g} V {at}, need at most {self.u_dc:.4g} (10 times its "
                "source): braking charges it; raise [source] C_uF or allow energy back"
            )
        steps = loop.steps
        if steps > JUDGED and steps * self.end > MOST_STEPS * t:
            raise ParameterError(
                f"the run took {steps:.1e} steps for {t:.4g} s, so {self.end:g} s need more than "
                f"{MOST_STEPS:.0e}: the current switches too often; widen i_band_A or lower u_dc_V"
            )
        if rows * self.row_bytes > MOST_BYTES:
            raise self._too_large(rows * self.end / t)

    def within(self) -> _core.Within:
        """For runs that the core advances by itself: it ends those that `check` refuses."""
        return _core.Within(
            omega_m=self.omega_m, i=self.i, u_dc=self.u_dc, steps=MOST_STEPS, judged=JUDGED
        )

    def _too_large(self, rows: float) -> ParameterError:
        size = rows * self.row_bytes
        grid = 1e6 * self.end * self.row_bytes / MOST_BYTES
        remedy = (
            "the iron loss needs every point: run shorter, or without [machine.iron]"
            if self.whole
            else f"record on a grid, --record-us {max(1.0, np.ceil(2 * grid)):.0f} (record = in s),"
            " or run shorter"
        )
        return ParameterError(
            f"waveforms of {self.end:g} s take about {size / 1e9:.2g} GB, need at most "
            f"{MOST_BYTES / 1e9:g} GB; {remedy}"
        )


def waveform_rows(drive: Drive, end: float, record: float | None) -> float:
    """How many rows of waveforms a run keeps, about; with record = 0 at least."""
    if record is None:
        return 0.0
    if record > 0:
        return end / record
    step = min(drive.control.T_s, to_si(drive.simulation.dt_max_us, "us"))
    return ROWS_A_STEP * end / step


def waveform_bytes(drive: Drive, end: float, record: float | None) -> float:
    """The memory that the waveforms of a run take, about [B]."""
    columns = len(_core.waveform_columns(drive.machine.n_phases))
    return 8 * columns * waveform_rows(drive, end, record)
