"""The [control] table of finite-control-set predictive torque control."""

from __future__ import annotations

from typing import ClassVar, Literal

from pydantic import Field

from reluctance import _core
from reluctance.drive.laws.flux_guide import CONDUCTS_MOST, FluxGuide, no_guide
from reluctance.drive.laws.guided import FluxGuided, with_room
from reluctance.drive.tables.known import Known
from reluctance.drive.tables.variants import WANTED_FREQUENCY, Look, Variant

PULSES_PER_TURN_ON = 4.8  # pulses a second of the phase in charge, of a turn-on of one switch
# When motoring, a guide that hardly ends (flux_guide.py) is followed closer, by this factor on the
# weight: flux that is left past alignment to win torque now brakes later.
# Measured at the speeds of docs/control/quadrants.md on two of its machines and twelve others that
# were drawn: with 1 the torque of two collapses at three times base speed, 4 and 16 hold all, and 4
# has less ripple.
CLOSER = 4.0  # [1]


def copper_and_horizon(n_phases: int, x: float, y: float) -> dict[str, float]:
    """Weight of copper and horizon, 1 or 2, of a law without guide. Beyond, a run takes minutes:
    far from the reference nothing can be pruned."""
    return {"w_i": float(f"{10 ** (5 * x - 7):.3g}"), "horizon": 1 if y < 0.5 else 2}


class FiniteSetMpc(FluxGuided):
    """One leg combination a sample, by branch and bound over the horizon."""

    look: ClassVar[Look] = Look("predictive", "#0072B2", "-")
    title: ClassVar[str] = "predictive, finite set of legs"
    variants: ClassVar[tuple[Variant, ...]] = (
        Variant(
            name="finite_set_short",
            keys=(("guided", False),),
            free=WANTED_FREQUENCY,
            place=copper_and_horizon,
            what="Finite-control-set MPC as in the literature: torque error, copper, switching.",
            when="To compare with the literature: "
            "its horizon is too short to build up flux in time.",
            needs="fast sampling",
        ),
        Variant(
            name="finite_set_mpc",
            free=WANTED_FREQUENCY,
            what="Finite-control-set MPC that follows the flux linkage of the reference profile.",
            when="Fast sampling: small ripple at minimum copper loss; one leg state per sample.",
            needs="fast sampling",
        ),
        Variant(
            name="finite_set_mpc_3",
            keys=(("horizon", 3),),
            free=WANTED_FREQUENCY,
            what="The same over three samples.",
            when="As above, where the frequency is low against the sampling.",
            needs="very fast sampling",
        ),
    )
    knows_pairs: ClassVar[bool] = True
    law: Literal["finite_set_mpc"] = "finite_set_mpc"
    horizon: int = Field(1, ge=1, le=4)  # samples
    guided: bool = True  # without its guide the law is short-sighted: for comparison only
    w_i: float = Field(0.0, ge=0)  # weight of copper [N^2 m^2/A^2]

    def core(self, known: Known) -> _core.Law:
        guide = self.flux_guide(known)
        if any(guide.feedback):
            guide = with_room(known, self.flux_guide, self.room(known))
        pulse = 1 / (PULSES_PER_TURN_ON * self.f_switch)
        make = self.maker(known, _core.finite_set_mpc, _core.coupled_finite_set_mpc)
        return make(
            guide=guide.profiles if self.guided else no_guide(known.tau_max),
            horizon=self.horizon,
            w_psi=self.w_psi(guide, known) if self.guided else [0.0],
            feedback=guide.feedback if self.guided else [0.0],
            w_i=self.w_i,
            w_sw=guide.w_sw,
            t_end=pulse**2 / (24 * self.horizon * self.T_s),
            R=known.R,
            i_max=known.i_max,
            T_s=self.T_s,
            delay=known.delay,
        )

    def w_psi(self, guide: FluxGuide, known: Known) -> list[float]:
        """Weight of the distance to the guide, (n_speeds,) [N^2 m^2/Wb^2]."""
        return [
            CLOSER * w if conducts > CONDUCTS_MOST and not known.brakes else w
            for w, conducts in zip(guide.w_psi, guide.conducts, strict=True)
        ]
