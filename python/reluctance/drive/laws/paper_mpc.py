"""The [control] table of the source paper's predictive controller."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar, Literal

from pydantic import Field, model_validator

from reluctance import _core
from reluctance.drive.laws.flux_guide import packed
from reluctance.drive.laws.guided import CURRENT_POINTS, MORE_TORQUE, Guided, with_room
from reluctance.drive.laws.short_voltage import NEVER, short_from
from reluctance.drive.tables.known import Known
from reluctance.drive.tables.variants import CURRENT_BAND, Look, Variant

if TYPE_CHECKING:
    from reluctance.machine import optimum


def tracking_weights(n_phases: int, x: float, y: float) -> dict[str, float]:
    """Weights of the source paper's controller: distance to the guide, increments."""
    return {"w_i": float(f"{10 ** (4 * x - 3):.3g}"), "r_w": float(f"{10 ** (4 * y - 3):.3g}")}


class PaperMpc(Guided):
    """The source paper's structure: predictive current references, hysteresis regulator."""

    look: ClassVar[Look] = Look("paper", "#009E73", "-")
    title: ClassVar[str] = "predictive currents (source paper)"
    variants: ClassVar[tuple[Variant, ...]] = (
        Variant(
            name="paper_mpc",
            free=CURRENT_BAND,
            place=tracking_weights,
            what="The source paper's structure: predictive current references, held in a band.",
            when="To compare with the paper.",
            needs="one current comparator per phase",
        ),
    )
    knows_pairs: ClassVar[bool] = True
    band_part: ClassVar[float] = 0.01
    law: Literal["paper_mpc"] = "paper_mpc"
    N_p: int = Field(3, ge=1, le=_core.N_p_max)
    N_c: int = Field(2, ge=1, le=_core.N_c_max)
    r_w: float = Field(0.05, gt=0)  # weight of reference increments [N^2 m^2/A^2]
    w_i: float = Field(0.05, ge=0)  # weight of the distance to the guide [N^2 m^2/A^2]
    i_band_A: float | None = Field(None, gt=0)  # half width of the regulator's band

    @property
    def current_band(self) -> float | None:
        return self.i_band_A

    @property
    def uses_comparators(self) -> bool:
        return True

    @model_validator(mode="after")
    def moves_fit_the_horizon(self) -> PaperMpc:
        if self.N_c > self.N_p:
            raise ValueError(
                f"N_c = {self.N_c}, need <= N_p = {self.N_p}; moves after the horizon do nothing"
            )
        return self

    def tables(self, known: Known, n_points: int = CURRENT_POINTS) -> list[optimum.Table]:
        tables = super().tables(known, n_points)
        if short_from(tables, known) == NEVER:
            return tables
        make = super().tables
        return with_room(known, lambda known: make(known, n_points), self.room(known, MORE_TORQUE))

    def used(self, known: Known) -> dict[str, float]:
        return super().used(known) | {"i_band_A": self.band(known)}

    def core(self, known: Known) -> _core.Law:
        i_max, tables = known.i_max, self.tables(known)
        make = self.maker(known, _core.paper_mpc, _core.coupled_paper_mpc)
        return make(
            guide=packed(tables, "i", known.at(known.omega_m), known.pairs),
            N_p=self.N_p,
            N_c=self.N_c,
            r_w=self.r_w,
            w_i=self.w_i,
            R=known.R,
            i_max=i_max,
            i_band=self.band(known),
            T_s=self.T_s,
            delay=known.delay,
            short_from=short_from(tables, known),
        )
