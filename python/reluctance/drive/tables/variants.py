"""How a law enters a comparison: its variants, the one parameter that trades ripple for switching,
two numbers that are searched for, and how its lines are drawn. Each law's table has its own."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

Place = Callable[[int, float, float], dict[str, float]]  # of phases, a point of the unit square


@dataclass(frozen=True)
class Free:
    """The parameter that the switching frequency is set with."""

    key: str  # in [control]
    unit: Literal["i_max", "tau", "target", "period"]  # of the range: A, N m, kHz, us
    lowest: float  # of the range, in that unit
    highest: float
    slope: float  # rough d log(frequency)/d log(parameter); its sign is relied on


CURRENT_BAND = Free("i_band_A", "i_max", 1e-4, 0.3, slope=-1.0)
WANTED_FREQUENCY = Free("f_switch_kHz", "target", 0.05, 20.0, slope=1.0)
CARRIER = Free("T_s_us", "period", 1.0, 1000.0, slope=-1.0)


@dataclass(frozen=True)
class Variant:
    """A law as a comparison sets it up. Keys that are named nowhere keep the law's defaults."""

    name: str
    free: Free
    what: str  # the law in a sentence
    when: str  # to use it
    needs: str  # of the hardware, besides sensors
    keys: tuple[tuple[str, Any], ...] = ()  # of [control], fixed
    place: Place | None = None  # the searched numbers; None: there are none


@dataclass(frozen=True)
class Look:
    """A law's colour and line; its kind, of which the best shows its torque."""

    kind: str
    color: str  # of M. Okabe and K. Ito, 2008: told apart by colour-blind readers
    line: str  # predictive laws are solid
