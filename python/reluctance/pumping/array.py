"""The [array] table: modules in series and parallel, by a name of the CEC table or by numbers."""

from difflib import get_close_matches
from functools import lru_cache
from typing import Any

from pydantic import Field, model_validator

from reluctance.cache import cached
from reluctance.drive.schema import Section
from reluctance.errors import ParameterError
from reluctance.pumping.single_diode import Cell, Diode, FloatArray, array_diode


class CellNumbers(Section):
    """[array.cell]: a module by its numbers at 1000 W/m2 and 25 degC."""

    I_L_ref_A: float = Field(gt=0)
    I_o_ref_A: float = Field(gt=0)
    R_s_ohm: float = Field(gt=0)
    R_sh_ref_ohm: float = Field(gt=0)
    a_ref_V: float = Field(gt=0)
    alpha_sc_ApK: float = Field(0.0, ge=0)  # of the short-circuit current
    adjust_pct: float = 0.0


class Array(Section):
    """A field of equal modules on one fixed plane, unshaded."""

    module: str | None = None  # a name of the CEC table
    cell: CellNumbers | None = None
    n_series: int = Field(ge=1)
    n_parallel: int = Field(ge=1)
    tilt_deg: float = Field(ge=0, le=90)
    azimuth_deg: float = Field(180.0, ge=0, le=360)  # 0 north, 90 east, 180 south
    soiling: float = Field(0.03, ge=0, lt=1)  # part of the light that dirt takes
    blocking_diode_V: float = Field(0.0, ge=0)  # its forward voltage; 0: ideal

    @model_validator(mode="after")
    def has_one_module(self) -> "Array":
        if (self.module is None) == (self.cell is None):
            raise ValueError("need either `module`, a CEC name, or the table [array.cell]")
        return self

    @property
    def reference(self) -> Cell:
        """One module at 1000 W/m2 and 25 degC."""
        if self.module is not None:
            return cec_module(self.module)
        c = self.cell
        assert c is not None
        return Cell(
            I_L_ref=c.I_L_ref_A,
            I_o_ref=c.I_o_ref_A,
            R_s=c.R_s_ohm,
            R_sh_ref=c.R_sh_ref_ohm,
            a_ref=c.a_ref_V,
            alpha_sc=c.alpha_sc_ApK,
            adjust=c.adjust_pct,
        )

    def diode(self, poa_global: FloatArray, temp_cell: FloatArray) -> Diode:
        """The array's curve at irradiance [W/m2] and cell temperature [degC]."""
        return array_diode(
            self.reference,
            poa_global,
            temp_cell,
            n_series=self.n_series,
            n_parallel=self.n_parallel,
        )


@lru_cache
def cec_module(name: str) -> Cell:
    """A module of the CEC table that comes with pvlib.

    Raises
    ------
    ParameterError
        If pvlib is missing, the name is unknown, or the row has a short-circuit current that falls
        with temperature (223 of 21 535 rows): its hot modules would give too little current.
    """
    cell = cached(
        Cell, ["CEC module", name, pvlib().__version__], lambda: _cec_row(name), algorithm=1
    )
    if cell.alpha_sc < 0:
        raise ParameterError(
            f"[array] module = {name!r}: its row of the CEC table has alpha_sc = "
            f"{cell.alpha_sc:g} A/K, need >= 0 (a wrong sign); take another module or give its "
            "numbers in [array.cell]"
        )
    return cell


def _cec_row(name: str) -> Cell:
    table = pvlib().pvsystem.retrieve_sam("CECMod")
    if name not in table:
        near = [f"`{other}`" for other in get_close_matches(name, table.columns, n=3)]
        near_by = f"; nearest: {', '.join(near)}" if near else ""
        raise ParameterError(
            f"[array] module = {name!r} is not in the CEC table of {len(table.columns)}{near_by}"
        )
    row = table[name]
    return Cell(
        I_L_ref=float(row["I_L_ref"]),
        I_o_ref=float(row["I_o_ref"]),
        R_s=float(row["R_s"]),
        R_sh_ref=float(row["R_sh_ref"]),
        a_ref=float(row["a_ref"]),
        alpha_sc=float(row["alpha_sc"]),
        adjust=float(row["Adjust"]),
    )


def pvlib() -> Any:
    """The pvlib package, imported when it is used.

    Its import takes a second, which the equations of one diode can do without.
    """
    import pvlib as found

    return found
