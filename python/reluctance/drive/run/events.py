"""What a supervised drive went through: the states that it entered, and its faults."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from reluctance import _core
from reluctance.base.phases import LETTERS

OVER_SPEED, OUT_OF_RANGE, FROZEN = 5, 6, 11  # statuses
MODES = ("off", "precharge", "calibrate", "ready", "run", "fault")  # control/guard/sequence.hpp


@dataclass(frozen=True)
class Event:
    """A state that a drive has entered."""

    t: float  # at this sample [s]
    mode: str
    status: int = 0  # of a fault
    text: str = ""  # likewise, with its evidence

    def __str__(self) -> str:
        return f"{self.mode}: {self.text}" if self.text else self.mode

    def with_units(self) -> dict[str, Any]:
        """The same under the names of files and the command line."""
        return {"t_s": self.t, "mode": self.mode, "status": self.status, "text": self.text}


def events(controller: _core.Controller) -> list[Event] | None:
    """What a controller has gone through; None where it is not supervised."""
    rows = _core.events(controller)
    return None if rows is None else [_event(row) for row in rows.tolist()]


def unready(entered: list[Event] | None, end: float) -> list[str]:
    """On one line, where a run that ends then [s] ends before the drive has run, or the drive first
    runs within the second half of it."""
    first = next((event.t for event in entered or [] if event.mode == "run"), None)
    if first is not None and first > end / 2:
        return [
            f"the drive reaches `run` at {first:.3g} s, within the half that is evaluated: the "
            "figures include its start; run longer (--until)"
        ]
    if not entered or entered[-1].mode not in MODES[:4] or first is not None:
        return []
    last = entered[-1]
    if last.mode == "off" and len(entered) > 1:
        remedy = "it was disabled before; set clear_s later, or restart_s"
    else:
        remedy = "run longer (--until), or enable it earlier"
    return [
        f"the run ends in `{last.mode}`, which began at {last.t:.3g} s: the figures are of a drive "
        f"that has not run yet; {remedy}"
    ]


def trip(entered: list[Event] | None, end: float) -> float | None:
    """When the last fault began that acts in the second half of a run that ends then [s]."""
    faults = [event for event in entered or [] if event.mode == "fault"]
    last = entered[-1] if entered else None
    if not faults or last is None or (last.mode == "run" and last.t <= end / 2):
        return None
    return faults[-1].t


def tripped(t: float | None) -> list[str]:
    """On one line, where a drive trips then [s]."""
    if t is None:
        return []
    return [
        f"the drive trips at {t:.4g} s: the figures are of the second half of the run, "
        "in which it does not work throughout"
    ]


# Of the value and the limit of a fault, by its status (include/srm/control/guard/fault.hpp). Status
# 18 has those of a current or of a flux linkage, and no unit here.
UNITS = {2: "A", 3: "V", 4: "V", 5: "rpm", 7: "deg el.", 8: "Wb", 9: "Wb", 10: "Wb", 12: "V"}
UNITS |= {13: "A", 14: "s", 16: "Wb", 17: "Wb", 19: "Wb"}
CONVERTED = {"rpm": 30 / math.pi, "deg el.": 180 / math.pi}


def evidence(text: str, status: int, phase: int, value: float, limit: float) -> str:
    """A fault in words, with its numbers in their units."""
    text += f" (status {status}"
    if phase >= 0:
        text += f", phase {phase} ({LETTERS[phase]})"
    if limit != 0:
        text += f": {told(status, phase, value, limit)}"
    return text + ")"


def told(status: int, phase: int, value: float, limit: float) -> str:
    """Value and limit of a fault, in their unit where it is known, and the side of the limit that
    the value, or a speed of either sign, is on."""
    if status == FROZEN:
        return f"{value:.4g} A in {limit:.0f} samples"
    size = abs(value) if status == OVER_SPEED else value
    side = "above" if size > limit else "below" if size < limit else "at"
    if status == OUT_OF_RANGE:
        unit = "A" if phase >= 0 else "deg el."
    else:
        unit = UNITS.get(status, "")
    factor, behind = CONVERTED.get(unit, 1.0), f" {unit}" if unit else ""
    if status == OUT_OF_RANGE and phase < 0:
        return f"{factor * value:.4g}{behind}, need 0 to {factor * limit:.4g}"
    return f"{factor * value:.4g}{behind}, {side} the limit of {factor * limit:.4g}{behind}"


def _event(row: Sequence[float]) -> Event:
    t, mode, status, phase, value, limit = row
    if not status:
        return Event(t, MODES[int(mode)])
    text = evidence(_core.describe_status(int(status)), int(status), int(phase), value, limit)
    return Event(t, MODES[int(mode)], int(status), text)
