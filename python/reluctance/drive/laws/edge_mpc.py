"""The [control] table of predictive torque control with edges inside the sample."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any, ClassVar, Literal

from reluctance import _core
from reluctance.drive.laws.flux_guide import FluxGuide
from reluctance.drive.laws.guided import CURRENT_POINTS, MORE_TORQUE, FluxGuided, with_room
from reluctance.drive.laws.learning import Learns
from reluctance.drive.tables.known import Known
from reluctance.drive.tables.variants import WANTED_FREQUENCY, Look, Variant

if TYPE_CHECKING:
    from reluctance.machine import optimum

# Of a guide for least ripple, which asks for deviations itself; chosen on the paper's machine
# (studies/least_ripple.py measures the result) [1].
SLACK = 0.8


class EdgeMpc(FluxGuided, Learns):
    """Switching instants as variables; torque in a band, flux near the guide."""

    look: ClassVar[Look] = Look("predictive", "#D55E00", "-")
    title: ClassVar[str] = "predictive (edge_mpc)"
    variants: ClassVar[tuple[Variant, ...]] = (
        Variant(
            name="edge_mpc",
            free=WANTED_FREQUENCY,
            what="Predictive: switching instants as variables, flux near the reference profile.",
            when="Least torque ripple at minimum copper loss, with fast or slow sampling.",
            needs="timers with four edges per sample",
        ),
    )
    knows_pairs: ClassVar[bool] = True
    law: Literal["edge_mpc"] = "edge_mpc"
    # What the profiles of the guide have least, without ripple of their own: copper loss, or the
    # ripple that switching leaves, for up to 3 % more copper loss at rated torque
    # (docs/control/least_ripple.csv).
    guide: Literal["least_copper", "least_ripple"] = "least_copper"

    def tables(self, known: Known, n_points: int = CURRENT_POINTS) -> list[optimum.Table]:
        tables = super().tables(known, n_points)
        if self.guide == "least_copper":
            return tables
        from reluctance.machine import optimum

        return [optimum.least_ripple_table(known.at(t.omega_m), t) for t in tables]

    def flux_guide(self, known: Known) -> FluxGuide:
        guide = super().flux_guide(known)
        return guide if self.guide == "least_copper" else replace(guide, slack=SLACK)

    def core(self, known: Known) -> _core.Law:
        # Profiles of least ripple are planned for the torques that are asked for.
        room = 1.0 if self.guide == "least_ripple" else self.room(known)
        if self.learn:
            room = MORE_TORQUE
        guide = with_room(self.alone(known), self.flux_guide, room)
        law: dict[str, Any] = {
            "guide": guide.profiles,
            "w_sw": guide.w_sw,
            "psi_slack": guide.psi_slack,
            "R": known.R,
            "i_max": known.i_max,
            "T_s": self.T_s,
            "delay": known.delay,
        }
        if not self.learn:
            return self.maker(known, _core.edge_mpc, _core.coupled_edge_mpc)(**law)
        return self.that_learns(known, _core.learning_edge_mpc, law, guide.w_sw_powers)
