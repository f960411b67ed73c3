"""The [control] table of the source paper's predictive controller."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, model_validator

from reluctance import _core
from reluctance.drive.known import Known
from reluctance.laws.flux_guide import packed
from reluctance.laws.guided import Guided

BAND_PART = 0.01  # of the current limit: default half width of the band


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

    def controller(self, known: Known) -> _core.Controller:
        i_max = known.i_max
        return _core.paper_mpc(
            self.setting(known),
            guide=packed(self.tables(known), "i", known.R),
            N_p=self.N_p,
            N_c=self.N_c,
            r_w=self.r_w,
            w_i=self.w_i,
            R=known.R,
            i_max=i_max,
            i_band=BAND_PART * i_max if self.i_band_A is None else self.i_band_A,
            T_s=self.T_s,
            delay=known.delay,
        )
