"""The control laws: one file per [control] table, and the controller that the core makes of it."""

from reluctance.drive.compiled_law import CompiledLaw
from reluctance.drive.control import Control
from reluctance.drive.own_code import CPP, PYTHON, names_code
from reluctance.drive.own_law import OwnLaw
from reluctance.drive.schema import did_you_mean
from reluctance.errors import ParameterError
from reluctance.laws.angles import Angles
from reluctance.laws.deadbeat import Deadbeat
from reluctance.laws.ditc import Ditc
from reluctance.laws.edge_mpc import EdgeMpc
from reluctance.laws.finite_set_mpc import FiniteSetMpc
from reluctance.laws.paper_mpc import PaperMpc
from reluctance.laws.pwm_current import PwmCurrent
from reluctance.laws.torque_sharing import TorqueSharing

__all__ = ["LAWS", "Control", "table_of"]

LAWS: dict[str, type[Control]] = {
    "angles": Angles,
    "pwm_current": PwmCurrent,
    "torque_sharing": TorqueSharing,
    "ditc": Ditc,
    "deadbeat": Deadbeat,
    "paper_mpc": PaperMpc,
    "finite_set_mpc": FiniteSetMpc,
    "edge_mpc": EdgeMpc,
}
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
    return LAWS[law]
