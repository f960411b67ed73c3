"""The [control] table of deadbeat flux control with duty cycles."""

from __future__ import annotations

from typing import Any, ClassVar, Literal

from reluctance import _core
from reluctance.drive.laws.learning import Learns
from reluctance.drive.laws.shared_torque import SharedTorque, sharing_angles
from reluctance.drive.tables.known import Known
from reluctance.drive.tables.variants import CARRIER, Look, Variant


class Deadbeat(SharedTorque, Learns):
    """The duty cycle that brings each phase to its share of the torque in one control period,
    which is the carrier's too."""

    look: ClassVar[Look] = Look("direct", "#E69F00", "--")
    title: ClassVar[str] = "deadbeat flux control"
    variants: ClassVar[tuple[Variant, ...]] = (
        Variant(
            name="deadbeat",
            free=CARRIER,
            place=sharing_angles,
            what="Cubic sharing; the duty cycle that brings each flux linkage to its reference.",
            when="Constant switching frequency and a microcontroller's PWM.",
            needs="PWM timers",
        ),
    )
    law: Literal["deadbeat"] = "deadbeat"
    carriers: Literal["in_phase", "interleaved"] = "in_phase"

    def unused(self, known: Known, *, tau: float, omega_m: float, u_dc: float) -> str:
        return super().unused(self.alone(known), tau=tau, omega_m=omega_m, u_dc=u_dc)

    def core(self, known: Known) -> _core.Law:
        alone = self.alone(known)
        law: dict[str, Any] = {
            "sharing": self.shares(alone),
            **self.hand_over(alone, "psi"),
            "R": known.R,
            "i_max": known.i_max,
            "T_s": self.T_s,
            "delay": known.delay,
            "carriers": getattr(_core.Carriers, self.carriers),
        }
        if not self.learn:
            return self.maker(known, _core.deadbeat, _core.coupled_deadbeat)(**law)
        return self.that_learns(known, _core.learning_deadbeat, law)
