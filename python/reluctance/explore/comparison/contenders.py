"""Who is compared: each law with the one parameter that trades ripple for switching, and the two
numbers that are searched for besides it."""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from reluctance.base.errors import ParameterError
from reluctance.base.schema import checked, did_you_mean
from reluctance.drive.drive import Drive
from reluctance.drive.laws import LAWS, code_meant, table_of
from reluctance.drive.laws.compiled_law import law_fields
from reluctance.drive.laws.own_code import PYTHON, names_code, own_code, same_code
from reluctance.drive.laws.own_law import law_class
from reluctance.drive.tables.variants import CARRIER, CURRENT_BAND, WANTED_FREQUENCY, Variant

Values = Mapping[str, float]


@dataclass(frozen=True)
class Contender(Variant):
    """A variant of a law, and the law."""

    law: str = ""

    @property
    def label(self) -> str:
        """The name where space is short: of a law of one's own, its file and its class."""
        if not names_code(self.name):
            return self.name
        code = own_code(self.name)
        return f"{code.file.name}:{code.name}"

    def range(self, drive: Drive, f_target: float) -> tuple[float, float]:
        """Least and greatest value of the free parameter for a drive, in the units of its key."""
        unit = {
            "i_max": drive.machine.i_max_A,
            "tau": drive.tau_max,
            "target": f_target / 1e3,
            "period": drive.control.T_s_us,
        }[self.free.unit]
        return self.free.lowest * unit, self.free.highest * unit

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
        drive = point.computed(control=control)
        drive.control.check(drive.known())
        return drive

    def _own_numbers(self, point: Drive) -> dict[str, Any]:
        """Of a law of one's own that the drive names too: the numbers that it gives it."""
        law = getattr(point.control, "law", None)
        if not (names_code(self.law) and names_code(law) and same_code(self.law, str(law))):
            return {}
        return dict(point.control.model_extra or {})


CONTENDERS: dict[str, Contender] = {
    variant.name: Contender(**vars(variant), law=law)
    for law in LAWS
    for variant in table_of(law).variants
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
        if of_law := [each for each, one in CONTENDERS.items() if one.law == name]:
            raise ParameterError(f"control `{name}` is a law; compare {', '.join(of_law)}")
        near = code_meant(name) or did_you_mean(name, CONTENDERS)
        raise ParameterError(f"control `{name}` is unknown{near}")
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
    known = {"i_band": CURRENT_BAND, "f_switch": WANTED_FREQUENCY}
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
