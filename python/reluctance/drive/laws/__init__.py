"""The control laws: one file per [control] table, and the controller that the core makes of it."""

import json
from importlib import import_module
from pathlib import PurePath

from reluctance.base.errors import ParameterError
from reluctance.base.schema import did_you_mean
from reluctance.drive.laws.compiled_law import CompiledLaw
from reluctance.drive.laws.own_code import CPP, PYTHON, names_code
from reluctance.drive.laws.own_law import OwnLaw
from reluctance.drive.tables.control import Control

__all__ = ["LAWS", "Control", "table_of"]

# Each is a file of this folder, with a class of its name: EdgeMpc in edge_mpc.py. It is read when a
# drive asks for it.
LAWS = (
    "angles",
    "pwm_current",
    "torque_sharing",
    "ditc",
    "deadbeat",
    "paper_mpc",
    "finite_set_mpc",
    "edge_mpc",
)
ENDINGS = {".py": PYTHON, ".so": CPP}  # of files with code
OWN: dict[str, type[Control]] = {PYTHON: OwnLaw, CPP: CompiledLaw}  # by how the name begins


def code_meant(law: str) -> str:
    """The ending of an error about the name of a file with code that lacks its kind; else
    nothing."""
    file, colon, name = law.rpartition(":")
    if colon and (kind := ENDINGS.get(PurePath(file).suffix)):
        return f'; did you mean "{kind}{file}:{name}"?'
    if kind := ENDINGS.get(PurePath(law).suffix):
        return f'; did you mean "{kind}{law}:CLASS"?'
    return ""


def _meant(law: str) -> str:
    """The ending of an error about a law that there is not: code in a file, a variant of
    `compare`, or the nearest name."""
    if code := code_meant(law):
        return code
    for known in LAWS:
        for variant in table_of(known).variants:
            if variant.name == law:
                keys = "".join(f", {key} = {json.dumps(value)}" for key, value in variant.keys)
                return f"; `compare` has this name for law = {json.dumps(known)}{keys}"
    return did_you_mean(law, LAWS)


def table_of(law: object) -> type[Control]:
    """The [control] table of a law.

    Raises
    ------
    ParameterError
        If there is no such law.
    """
    if names_code(law):
        return OWN[f"{str(law).partition(':')[0]}:"]
    if not isinstance(law, str) or law not in LAWS:
        raise ParameterError(f"[control] law = {law!r} is unknown{_meant(str(law))}")
    name = "".join(word.capitalize() for word in law.split("_"))
    table: type[Control] = getattr(import_module(f"reluctance.drive.laws.{law}"), name)
    return table
