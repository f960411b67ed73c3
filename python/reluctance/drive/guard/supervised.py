"""The controller of a drive with its states and its protection around it, as on a target."""

from __future__ import annotations

from reluctance import _core
from reluctance.base.phases import LETTERS
from reluctance.drive.drive import Drive
from reluctance.drive.guard.sequence_levels import sequence
from reluctance.drive.guard.trip_levels import diagnosis, flux_angle, protection

BEYOND = 0.1  # by which a reading passes its level
LAST = 1e30  # a time that does not come [s]


def controller(drive: Drive, law: _core.Law | None = None) -> _core.Controller:
    """The controller of a drive: supervised where its [supervision] says so. law: in the place of
    the drive's own.

    Raises
    ------
    ParameterError
        If the protection of a supervised drive would trip in normal work.
    """
    if law is None and not drive.supervision.on:
        return drive.controller()
    known = drive.known()
    law = drive.law(known) if law is None else law
    frame = drive.frame(known)
    if not drive.supervision.on:
        return _core.Controller(law, frame, drive.pairs(known))
    guard = protection(drive)
    return _core.supervised(
        law,
        frame,
        machine=known.magnetics,
        protection=guard,
        sequence=sequence(drive, guard),
        supervision=supervision(drive, guard),
        coupling=drive.pairs(known),
        diagnosis=diagnosis(drive),
        flux_angle=flux_angle(drive),
    )


def supervision(drive: Drive, guard: _core.Protection) -> _core.Supervision:
    """When the drive is enabled and cleared, and its fault."""
    table, levels = drive.supervision, guard.levels
    start = table.enable_s or 0.0
    clear = LAST if table.clear_s is None else table.clear_s
    again = LAST if table.restart_s is None else table.restart_s
    begins = LAST if table.fault_s is None else table.fault_s
    shown = {
        "over_current": (1 + BEYOND) * levels.i_trip,
        "over_voltage": (1 + BEYOND) * levels.u_dc_max,
        "under_voltage": (1 - BEYOND) * levels.u_dc_min,
    }
    return _core.Supervision(
        T_s=drive.control.T_s,
        enable=_while((start, clear), (again, LAST)),
        clear=_while((clear, again)),
        troubled=_while((begins, clear if table.gone_s is None else table.gone_s)),
        trouble=getattr(_core.Trouble, table.fault),
        phase=LETTERS.index(table.fault_phase),
        level=shown.get(table.fault, 0.0),
    )


def _while(*spans: tuple[float, float]) -> _core.Course:
    """1 from the first to the second time of each span, 0 besides."""
    coming = [(start, end) for start, end in spans if start < LAST]
    if coming in ([], [(0.0, LAST)]):  # what never changes may be changed from outside
        return _core.Course(t=[0.0], value=[float(len(coming))])
    points = [(0.0, 0.0)]
    for start, end in coming:
        points += [(start, 0.0), (start, 1.0), (end, 1.0), (end, 0.0)]
    return _core.Course(t=[t for t, _ in points], value=[on for _, on in points])
