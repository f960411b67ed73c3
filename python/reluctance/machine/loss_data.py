"""What datasheets and steel data say of losses: the tables that loss figures are made from."""

from __future__ import annotations

from pydantic import Field, model_validator

from reluctance.base.schema import Section

# Energy of one switching over the product of its voltage and current: half the time that it takes.
# Fast modules have 10 to 100 ns, slow ones 1 us.
LONGEST_SWITCHING = 20e-6  # [s]


class Iron(Section):
    """The [machine.iron] table: Steinmetz's exponents, and one measured or computed point.

    At the point every phase carries a sinusoidal flux linkage. From steel data: p_ref_W is the
    specific loss at B_ref and f_ref times the mass of the iron that sees the flux of its pole, and
    psi_ref_Wb = B_ref x turns in series x pole area.
    """

    p_ref_W: float = Field(gt=0)  # iron loss of the whole machine at ...
    psi_ref_Wb: float = Field(gt=0)  # ... this amplitude, without dc part, ...
    f_ref_Hz: float = Field(gt=0)  # ... and frequency
    alpha: float = Field(ge=1, le=3)  # exponent of frequency
    beta: float = Field(ge=1, le=4)  # exponent of flux

    @model_validator(mode="after")
    def exponents_are_in_order(self) -> Iron:
        if self.beta < self.alpha:
            raise ValueError(
                f"beta = {self.beta:g}, need >= alpha = {self.alpha:g} (steel: about 2 and 1.5)"
            )
        return self


class SwitchingEnergies(Section):
    """What a datasheet says of one switching, at one voltage and current. Loss is taken to be
    proportional to both."""

    E_on_mJ: float = Field(0.0, ge=0)  # turn-on of a switch
    E_off_mJ: float = Field(0.0, ge=0)  # turn-off
    E_rr_mJ: float = Field(0.0, ge=0)  # recovery of the diode that a turn-on relieves
    u_sw_ref_V: float | None = Field(None, gt=0)  # where these hold: voltage ...
    i_sw_ref_A: float | None = Field(None, gt=0)  # ... and current

    @model_validator(mode="after")
    def energies_have_a_point(self) -> SwitchingEnergies:
        energies = self.E_on_mJ + self.E_off_mJ + self.E_rr_mJ
        given = (self.u_sw_ref_V is not None) + (self.i_sw_ref_A is not None)
        if energies > 0 and given < 2:
            raise ValueError(
                "E_on_mJ, E_off_mJ, E_rr_mJ hold at one voltage and current: give u_sw_ref_V and "
                "i_sw_ref_A from the same datasheet"
            )
        if energies == 0 and given > 0:
            raise ValueError(
                "u_sw_ref_V and i_sw_ref_A have no effect without E_on_mJ, E_off_mJ or E_rr_mJ; "
                "remove them"
            )
        self._check_units()
        return self

    def _check_units(self) -> None:
        if self.u_sw_ref_V is None or self.i_sw_ref_A is None:
            return
        most = 1e3 * LONGEST_SWITCHING * self.u_sw_ref_V * self.i_sw_ref_A
        for key in ("E_on_mJ", "E_off_mJ", "E_rr_mJ"):
            if (given := getattr(self, key)) > most:
                raise ValueError(
                    f"{key} = {given:g}, need at most {most:.3g}: {LONGEST_SWITCHING * 1e6:g} us "
                    f"of {self.u_sw_ref_V:g} V times {self.i_sw_ref_A:g} A; check its unit: 1000 "
                    "uJ are 1 mJ"
                )
