"""Control laws of one's own, in C++: `law = "cpp:my_law.so:MyLaw"`, made by `reluctance law build`.

The law is a header. It is compiled against the headers of this package, and exported as firmware
from the very text that was compiled.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pydantic import ConfigDict

from reluctance import _core
from reluctance.base.errors import ParameterError
from reluctance.base.extension import core_fingerprint
from reluctance.base.units import name_and_unit, si_once
from reluctance.drive.laws.own_code import (
    CodeName,
    below,
    check_numbers,
    meant,
    module_of,
    of_the_user,
    own_code,
)
from reluctance.drive.tables.control import Control
from reluctance.drive.tables.known import Known

# Fields that a law need not be given: what a controller may know, under its name in `Known`.
KNOWN = ("R", "i_max", "T_s", "delay", "u_dc", "omega_m", "J", "tau_max", "t_dead")


class CompiledLaw(Control):
    """The [control] table of a law in C++: what every law has, and the fields of its struct."""

    model_config = ConfigDict(extra="allow")
    law: CodeName  # cpp:FILE:STRUCT, the file relative to the drive file

    @property
    def uses_comparators(self) -> bool:
        return True  # what it orders is known when it runs

    def check(self, known: Known) -> None:
        self.core(known)

    def core(self, known: Known) -> _core.Law:
        code = own_code(self.law)
        make, wanted = _struct(self.law), law_fields(self.law)
        given = si_once({"T_s_us": self.T_s_us} | (self.model_extra or {})) | {"T_s": self.T_s}
        check_numbers(self.model_extra or {}, texts=False)
        own = [name for name in given if name != "T_s"]
        for key in self.model_extra or {}:
            name, _ = name_and_unit(key)
            if name not in wanted:
                hint = meant(key, name, wanted, "field")
                raise ParameterError(f"[control] {code.name} has no field `{name}`{hint}")
        values = {name: getattr(known, name) for name in KNOWN} | given
        for name in wanted:
            if name not in values:
                raise ParameterError(
                    f"missing key `{name}` in [control]: {code.name} has this field; give `{name}` "
                    "in SI, or with a known unit as its suffix (docs/extending.md)"
                )
        try:
            made: _core.Law = make(
                *self.built_for(known), **{name: values[name] for name in wanted}
            )
        except (TypeError, ValueError) as fault:
            told = of_the_user(fault).partition(" The following")[0]
            given_text = ", ".join(f"{name} = {given[name]!r}" for name in own)
            raise ParameterError(f"[control] {code.name} with {given_text}: {told}") from fault
        if given.get("i_max", 0.0) > known.i_max:
            raise ParameterError(
                f"[control] i_max_A = {given['i_max']:g}, need <= [machine] i_max_A = "
                f"{known.i_max:g}; lower one or raise the other"
            )
        return made

    @property
    def headers(self) -> Mapping[str, str]:
        texts: dict[str, str] = module_of(own_code(self.law)).HEADERS
        return {below(name): text for name, text in texts.items()}


def law_fields(law: str) -> list[str]:
    """The fields of a compiled law but its machine.

    Raises
    ------
    ParameterError
        If the file is not a compiled law, or was built against other headers.
    """
    _struct(law)
    names: list[str] = module_of(own_code(law)).FIELDS
    return names


def _struct(law: str) -> Any:
    """The function that makes the law."""
    code = own_code(law)
    module = module_of(code)
    if getattr(module, "CORE", None) != core_fingerprint():
        raise ParameterError(
            f"{code.file} was built against another version of reluctance; build it again with "
            "`reluctance law build`"
        )
    if not hasattr(module, code.name):
        raise ParameterError(f"{code.file} holds the law {module.NAME}, not {code.name}")
    return getattr(module, code.name)
