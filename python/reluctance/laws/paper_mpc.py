"""The [control] table of the source paper's predictive controller."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Literal

from pydantic import Field, model_validator

from reluctance import _core
from reluctance.drive.known import Known
from reluctance.laws.flux_guide import packed
from reluctance.laws.guided import CURRENT_POINTS, Guided
from reluctance.laws.short_voltage import NEVER, short_from

if TYPE_CHECKING:
    from reluctance import limit

BAND_PART = 0.01  # of the current limit: default half width of the band
# Greatest torque of the guide over the greatest reference, where feedback holds the mean [1].
ROOM = 1.1


class PaperMpc(Guided):
    """The source paper's structure: predictive current references, hysteresis regulator."""

    law: Literal["paper_mpc"]
    N_p: int = Field(3, ge=1, le=_core.N_p_max)
    N_c: int = Field(2, ge=1, le=_core.N_c_max)
    r_w: float = Field(0.05, gt=0)  # weight of reference increments [N^2 m^2/A^2]
    w_i: float = Field(0.05, ge=0)  # weight of the distance to the guide [N^2 m^2/A^2]
    i_band_A: float | None = Field(None, gt=0)  # half width of the regulator's band

    @model_validator(mode="after")
    def moves_fit_the_horizon(self) -> PaperMpc:
        if self.N_c > self.N_p:
            raise ValueError(
                f"N_c = {self.N_c}, need <= N_p = {self.N_p}; moves after the horizon do nothing"
            )
        return self

    def tables(self, known: Known, n_points: int = CURRENT_POINTS) -> list[limit.Table]:
        tables = super().tables(known, n_points)
        if short_from(tables, known) == NEVER:
            return tables
        try:
            return super().tables(replace(known, tau_max=ROOM * known.tau_max), n_points)
        except RuntimeError:  # no profile is found above the greatest reference
            return tables

    def controller(self, known: Known) -> _core.Controller:
        i_max, tables = known.i_max, self.tables(known)
        return _core.paper_mpc(
            self.setting(known),
            guide=packed(tables, "i", known.R),
            N_p=self.N_p,
            N_c=self.N_c,
            r_w=self.r_w,
            w_i=self.w_i,
            R=known.R,
            i_max=i_max,
            i_band=BAND_PART * i_max if self.i_band_A is None else self.i_band_A,
            T_s=self.T_s,
            delay=known.delay,
            short_from=short_from(tables, known),
        )
