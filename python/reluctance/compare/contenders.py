"""Who is compared: each law with the one parameter that trades ripple for switching, and the two
numbers that are searched for beside it."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal

from reluctance.drive import Drive
from reluctance.drive.compiled_law import law_fields
from reluctance.drive.own_code import PYTHON, names_code, own_code, same_code
from reluctance.drive.own_law import law_class
from reluctance.drive.schema import checked, did_you_mean
from reluctance.errors import ParameterError
from reluctance.laws import table_of

Values = Mapping[str, float]
Place = Callable[[Drive, float, float], dict[str, float]]  # of a point of the unit square


@dataclass(frozen=True)
class Free:
    """The parameter that the switching frequency is set with."""

    key: str  # in [control]
    unit: Literal["i_max", "tau", "target", "period"]  # of the range: A, N m, kHz, us
    lowest: float  # of the range, in that unit
    highest: float
    slope: float  # rough d log(frequency)/d log(parameter); its sign is relied on

    def range(self, drive: Drive, f_target: float) -> tuple[float, float]:
        """Least and greatest value for a drive, in the units of the key."""
        unit = {
            "i_max": drive.machine.i_max_A,
            "tau": drive.tau_max,
            "target": f_target / 1e3,
            "period": drive.control.T_s_us,
        }[self.unit]
        return self.lowest * unit, self.highest * unit


@dataclass(frozen=True)
class Contender:
    """A law as the comparison sets it up. Keys that are named nowhere keep the law's defaults."""

    name: str
    law: str
    free: Free
    what: str  # the law in a sentence
    when: str  # to use it
    needs: str  # of the hardware, beside sensors
    keys: tuple[tuple[str, Any], ...] = ()  # of [control], fixed
    place: Place | None = None  # the searched numbers; None: there are none

    @property
    def label(self) -> str:
        """The name where space is short: of a law of one's own, the class."""
        return own_code(self.name).name if names_code(self.name) else self.name

    def drive(self, point: Drive, values: Values) -> Drive:
        """The drive of the comparison with this law in it.

        Raises
        ------
        ParameterError
            If the law cannot work with these values on this machine.
        """
        common = {"T_s_us": point.control.T_s_us, "precision": point.control.precision}
        if point.control.tau_max_Nm is not None:
            common["tau_max_Nm"] = point.control.tau_max_Nm
        common |= self._own_numbers(point)
        table = {"law": self.law, **common, **dict(self.keys), **values}
        control = checked(table_of(self.law), table, f"[control] of {self.name}")
        drive = replace(point, control=control)
        drive.control.check(drive.known())
        return drive

    def _own_numbers(self, point: Drive) -> dict[str, Any]:
        """Of a law of one's own that the drive names too: the numbers that it gives it."""
        law = getattr(point.control, "law", None)
        if not (names_code(self.law) and names_code(law) and same_code(self.law, str(law))):
            return {}
        return dict(point.control.model_extra or {})


def pulse_angles(drive: Drive, x: float, y: float) -> dict[str, float]:
    """Turn-on from 90 deg ahead of unaligned to 60 deg behind it, turn-off from 90 to 175 deg."""
    return {"theta_on_deg": round(-90 + 150 * x, 2), "theta_off_deg": round(90 + 85 * y, 2)}


def overlapping_angles(drive: Drive, x: float, y: float) -> dict[str, float]:
    """The same, but at least a stroke apart."""
    on = -90 + 150 * x
    off = max(90 + 85 * y, on + 360 / drive.machine.n_phases)
    return {"theta_on_deg": round(on, 2), "theta_off_deg": round(off + 0.005, 2)}


def sharing_angles(drive: Drive, x: float, y: float) -> dict[str, float]:
    """Turn-on in the first half of the angle that two phases can share, overlap in the rest."""
    free = 180 - 360 / drive.machine.n_phases
    on = free / 2 * x
    return {
        "theta_on_deg": round(on, 2),
        "theta_ov_deg": round((free - on) * (0.1 + 0.9 * y) - 0.01, 2),
    }


def copper_and_horizon(drive: Drive, x: float, y: float) -> dict[str, float]:
    """Weight of copper and horizon, 1 or 2, of a finite-set law without guide. Beyond, a run takes
    minutes: far from the reference nothing can be pruned."""
    return {"w_i": float(f"{10 ** (5 * x - 7):.3g}"), "horizon": 1 if y < 0.5 else 2}


def tracking_weights(drive: Drive, x: float, y: float) -> dict[str, float]:
    """Weights of the source paper's controller: distance to the guide, increments."""
    return {"w_i": float(f"{10 ** (4 * x - 3):.3g}"), "r_w": float(f"{10 ** (4 * y - 3):.3g}")}


CURRENT_BAND = Free("i_band_A", "i_max", 1e-4, 0.3, slope=-1.0)
ASKED_FREQUENCY = Free("f_switch_kHz", "target", 0.05, 20.0, slope=1.0)
CARRIER = Free("T_s_us", "period", 1.0, 1000.0, slope=-1.0)


def _sharing(shape: str, what: str, when: str, **options: Any) -> Contender:
    return Contender(
        name=f"sharing_{shape}",
        law="torque_sharing",
        keys=(("sharing", shape),),
        free=CURRENT_BAND,
        what=what,
        when=when,
        needs="one current comparator per phase",
        **({"place": sharing_angles} | options),
    )


CONTENDERS: dict[str, Contender] = {
    c.name: c
    for c in (
        Contender(
            name="angles",
            law="angles",
            free=CURRENT_BAND,
            place=pulse_angles,
            what="Flat current pulses between two angles, held in a band by soft chopping.",
            when="Ripple does not matter; or speed is so high that one pulse fills the voltage.",
            needs="one current comparator per phase, position compare",
        ),
        Contender(
            name="pwm_current",
            law="pwm_current",
            free=CARRIER,
            place=pulse_angles,
            what="Flat current pulses between two angles, held by PI control and PWM.",
            when="As `angles`, where the switching frequency has to be constant.",
            needs="PWM timers",
        ),
        _sharing(
            "linear",
            "Torque passed from phase to phase along a straight line, as current in a band.",
            "A first sharing function; its corners ask for steps of current.",
        ),
        _sharing(
            "cubic",
            "Torque passed along a cubic, as current in a band.",
            "The usual choice: small ripple below base speed from a table of currents.",
        ),
        _sharing(
            "sinusoidal",
            "Torque passed along a cosine, as current in a band.",
            "As cubic; hardly different.",
        ),
        _sharing(
            "exponential",
            "Torque passed along an exponential, as current in a band.",
            "Where the outgoing phase must be demagnetised quickly.",
        ),
        _sharing(
            "optimal",
            "Torque passed as in the reference profile without ripple, as current in a band.",
            "Where the drive works near one point, for which the profile is made.",
            place=None,
        ),
        Contender(
            name="ditc",
            law="ditc",
            free=Free("tau_band_Nm", "tau", 1e-4, 0.5, slope=-1.0),
            place=overlapping_angles,
            what="The torque error, from a model, picks the legs in two bands.",
            when="Fast sampling and a good map: small ripple without current references.",
            needs="fast sampling",
        ),
        Contender(
            name="deadbeat",
            law="deadbeat",
            free=CARRIER,
            place=sharing_angles,
            what="Cubic sharing; the duty cycle that brings each flux linkage to its reference.",
            when="Constant switching frequency and a microcontroller's PWM.",
            needs="PWM timers",
        ),
        Contender(
            name="paper_mpc",
            law="paper_mpc",
            free=CURRENT_BAND,
            place=tracking_weights,
            what="The source paper's structure: predictive current references, held in a band.",
            when="To compare with the paper.",
            needs="one current comparator per phase",
        ),
        Contender(
            name="finite_set_short",
            law="finite_set_mpc",
            keys=(("guided", False),),
            free=ASKED_FREQUENCY,
            place=copper_and_horizon,
            what="Finite-control-set MPC as in the literature: torque error, copper, switching.",
            when="To compare with the literature: "
            "its horizon is too short to build up flux in time.",
            needs="fast sampling",
        ),
        Contender(
            name="finite_set_mpc",
            law="finite_set_mpc",
            free=ASKED_FREQUENCY,
            what="Finite-control-set MPC that follows the flux linkage of the reference profile.",
            when="Fast sampling: small ripple at minimum copper loss; one leg state per sample.",
            needs="fast sampling",
        ),
        Contender(
            name="finite_set_mpc_3",
            law="finite_set_mpc",
            keys=(("horizon", 3),),
            free=ASKED_FREQUENCY,
            what="The same over three samples.",
            when="As above, where the frequency is low against the sampling.",
            needs="very fast sampling",
        ),
        Contender(
            name="edge_mpc",
            law="edge_mpc",
            free=ASKED_FREQUENCY,
            what="Predictive: switching instants as variables, flux near the reference profile.",
            when="Least torque ripple at minimum copper loss, with fast or slow sampling.",
            needs="timers with four edges per sample",
        ),
    )
}


def contender(name: str) -> Contender:
    """A contender by its name, or of a law of one's own: `python:FILE:CLASS`, `cpp:FILE:STRUCT`.

    Raises
    ------
    ParameterError
        If the name is unknown, or the class is not there.
    """
    if names_code(name):
        return _own(name)
    if name not in CONTENDERS:
        raise ParameterError(f"control `{name}` is unknown{did_you_mean(name, CONTENDERS)}")
    return CONTENDERS[name]


def _own(law: str) -> Contender:
    """A law of one's own. The names of its numbers say what sets its switching frequency:
    `i_band`, `f_switch`, or else the control period. The others have the values of the drive file
    where it names this law, and else their defaults."""
    if own_code(law).kind == PYTHON:
        kind = law_class(law)
        numbers = list(inspect.signature(kind).parameters)
        what = (inspect.getdoc(kind) or "A law in Python.").partition("\n")[0]
    else:
        numbers, what = law_fields(law), "A law in C++."
    known = {"i_band": CURRENT_BAND, "f_switch": ASKED_FREQUENCY}
    free = next((known[name] for name in numbers if name in known), CARRIER)
    return Contender(name=law, law=law, free=free, what=what, when="", needs="")


def chosen(names: list[str] | None) -> list[Contender]:
    """Contenders by name, or all of the core's.

    Raises
    ------
    ParameterError
        If a name is unknown or given twice.
    """
    if names is None:
        return list(CONTENDERS.values())
    for name in names:
        if names.count(name) > 1:
            raise ParameterError(f"control `{name}` is given twice; name it once")
    return [contender(name) for name in names]
