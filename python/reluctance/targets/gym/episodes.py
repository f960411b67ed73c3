"""What the episodes of an environment begin with, and what they are judged by."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from numbers import Real
from typing import Literal, get_args

import numpy as np

from reluctance import _core
from reluctance.base.errors import ParameterError
from reluctance.base.resources import resources
from reluctance.base.schema import did_you_mean
from reluctance.base.units import to_si
from reluctance.drive.drive import Drive
from reluctance.drive.load import load
from reluctance.drive.run.plant import loop_parts
from reluctance.drive.tables.control import BAND_PART

Task = Literal["torque", "current", "speed"]
Action = Literal["legs", "duties", "currents"]
Range = tuple[float, float]

EXAMPLES = {"torque": "sharing_cubic", "current": "sharing_cubic", "speed": "fan"}
LENGTHS = {"torque": 1000, "current": 1000, "speed": 5000}  # of an episode, in control periods
REFERENCES: dict[str, Range] = {  # in parts of the greatest torque, current limit, nominal speed
    "torque": (0.3, 1.0),
    "current": (0.2, 0.8),
    "speed": (0.8, 1.0),
}
START_SPEEDS: Range = (0.7, 1.1)  # of the nominal one, where the shaft turns
WINDOW_DEG = (0.0, 150.0)  # of the current pulses that are asked for, electrical
OVER_CURRENT = 1.25  # of i_max_A: an episode ends
OVER_SPEED = 2.0  # of the nominal speed: an episode ends
F_SWITCH = 20e3  # that a switching price of 1 is for; as in `reluctance compare` [Hz]

TOLERANCES: dict[str, Range] = {
    "plant.R": (0.8, 1.4),  # cold to hot winding
    "plant.machine.flux_factor": (0.9, 1.1),
    "plant.source.u_dc.value_0": (0.85, 1.1),
    "plant.shaft.J": (0.5, 2.0),
}
"""Factors on numbers of a drive for `randomise`: what differs between drives of one kind."""


@dataclass(frozen=True)
class Prices:
    """What a control period costs. The reward is the negative sum.

    Attributes
    ----------
    error : float
        Of the mean squared error: torque over the greatest torque reference, current over the
        current limit, or speed over the nominal speed.
    copper : float
        Of the copper loss over the mechanical power at greatest torque and nominal speed.
    switching : float
        Of the switching frequency per switch over 20 kHz.
    trip : float
        Of an episode that ends by over-current or over-speed.
    """

    error: float = 1.0
    copper: float = 0.02
    switching: float = 0.001
    trip: float = 100.0


def default_prices(task: Task) -> Prices:
    """The speed is worth more: its relative errors are small."""
    return Prices(error=100.0) if task == "speed" else Prices()


@dataclass(frozen=True)
class Episodes:
    """A drive, what is asked of it, and what is drawn anew for each episode."""

    drive: Drive
    task: Task
    action: Action
    length: int  # control periods
    drawn: Mapping[str, Range]  # numbers of the core by name, in SI: drawn evenly between these
    rules: _core.Rules

    @property
    def names(self) -> list[str]:
        return list(self.drawn)

    def draw(self, rng: np.random.Generator) -> list[float]:
        """The numbers of an episode."""
        low, high = np.array(list(self.drawn.values())).T
        return list(low + (high - low) * rng.random(len(low)))

    def batch(self, count: int) -> _core.Batch:
        """So many drives in the core."""
        return batch_of(self.drive, self.rules, self.names, count)


def episodes(
    drive: Drive | str | None,
    task: Task,
    action: Action,
    *,
    reference: Range | None,
    randomise: Mapping[str, Range] | None,
    prices: Prices | None,
    length: int | None,
) -> Episodes:
    """The episodes of an environment, checked.

    Raises
    ------
    ParameterError
        If the task, the action, a name or a range is wrong.
    """
    for name, given, known in (("task", task, Task), ("action", action, Action)):
        if given not in get_args(known):
            raise ParameterError(
                f"{name} = {given!r}, need one of {', '.join(get_args(known))}"
                f"{did_you_mean(str(given), get_args(known))}"
            )
    if drive is None:
        drive = load(resources("examples") / f"{EXAMPLES[task]}.toml")
    elif not isinstance(drive, Drive):
        drive = load(drive)
    drive.check_sound("an environment")
    if drive.omega_nominal <= 0:
        raise ParameterError("an environment needs a drive with a working speed; set speed_rpm")
    if task == "speed" and drive.load.kind == "locked":
        raise ParameterError("[load] kind = 'locked' holds the speed; task 'speed' needs another")
    steps = LENGTHS[task] if length is None else length
    if steps < 1:
        raise ParameterError(f"length = {steps}, need >= 1 control period")
    rules = _rules(drive, task, action, prices or default_prices(task))
    top = {"torque": rules_tau(drive), "current": drive.machine.i_max_A}
    low, high = REFERENCES[task] if reference is None else reference
    _check_range("reference", (low, high))
    unit = top.get(task, drive.omega_nominal)
    pitch = 2 * np.pi / drive.machine.N_r
    drawn: dict[str, Range] = {"theta_m": (0.0, pitch), "reference": (low * unit, high * unit)}
    if drive.load.kind != "locked":
        omega = drive.omega_nominal
        drawn["plant.shaft.omega.value_0"] = (START_SPEEDS[0] * omega, START_SPEEDS[1] * omega)
    drawn |= _factored(drive, rules, randomise or {})
    return Episodes(drive, task, action, steps, drawn, rules)


def rules_tau(drive: Drive) -> float:
    """The greatest torque that is asked for [N m]."""
    return drive.tau_max


def _rules(drive: Drive, task: Task, action: Action, prices: Prices) -> _core.Rules:
    parts = loop_parts(drive, -1.0)
    i_max, tau, omega = drive.machine.i_max_A, rules_tau(drive), drive.omega_nominal
    band = drive.control.current_band
    return _core.Rules(
        task=getattr(_core.Task, task),
        action=getattr(_core.Action, action),
        t_dead=parts["t_dead"],
        sampling=parts["sampling"],
        resolution=_core.Resolution(
            dt_max=max(to_si(drive.simulation.dt_max_us, "us"), drive.control.T_s)
            if action == "legs"
            else to_si(drive.simulation.dt_max_us, "us"),
            scale=_core.Scale(i=i_max, u_dc=drive.converter.u_dc_V),
            record_every=-1.0,
        ),
        comparators=getattr(_core.Comparators, drive.sensing.comparators),
        i_band=BAND_PART * i_max if band is None else band,
        theta_on=to_si(WINDOW_DEG[0], "deg"),
        theta_off=to_si(WINDOW_DEG[1], "deg"),
        i_max=i_max,
        u_dc=drive.converter.u_dc_V,
        omega_m=omega,
        tau=tau,
        i_trip=drive.protection.i_trip_A or OVER_CURRENT * i_max,
        omega_trip=OVER_SPEED * omega,
        error_price=prices.error,
        copper_price=prices.copper / (tau * omega),
        switching_price=prices.switching / F_SWITCH,
        trip_price=prices.trip,
    )


def batch_of(drive: Drive, rules: _core.Rules, names: list[str], count: int) -> _core.Batch:
    """Drives in the core."""
    loop = _core.SimulationParts(**loop_parts(drive, -1.0))
    return _core.batch(count, drive.machine.n_phases, loop, rules=rules, drawn=names)


def _factored(drive: Drive, rules: _core.Rules, randomise: Mapping[str, Range]) -> dict[str, Range]:
    """Ranges of numbers from ranges of factors on them. A name of `TOLERANCES` that a drive does
    not have, as the voltage of a stiff source, is an error too."""
    if not randomise:
        return {}
    known = dict(batch_of(drive, rules, [], 1).numbers())
    found = {}
    for name, factors in randomise.items():
        if name not in known:
            raise ParameterError(
                f"randomise: the drive has no number `{name}`{did_you_mean(name, known)}"
            )
        _check_range(f"randomise[{name!r}]", factors)
        if factors[0] <= 0:
            raise ParameterError(f"randomise[{name!r}] = {factors}, need factors > 0")
        low, high = sorted(known[name] * factor for factor in factors)
        found[name] = (low, high)
    return found


def _check_range(what: str, given: Range) -> None:
    pair = isinstance(given, Sequence | np.ndarray) and not isinstance(given, str)
    good = pair and len(given) == 2 and all(isinstance(x, Real) for x in given)
    if not good or not -2 <= given[0] <= given[1] <= 1000:
        raise ParameterError(f"{what} = {given}, need (low, high) with low <= high")
