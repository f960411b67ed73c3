"""The control laws: one file per [control] table, and the controller that the core makes of it."""

from importlib import import_module

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
OWN: dict[str, type[Control]] = {PYTHON: OwnLaw, CPP: CompiledLaw}  # by how the name begins


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
        raise ParameterError(f"[control] law = {law!r} is unknown{did_you_mean(str(law), LAWS)}")
    name = "".join(word.capitalize() for word in law.split("_"))
    table: type[Control] = getattr(import_module(f"reluctance.drive.laws.{law}"), name)
    return table
