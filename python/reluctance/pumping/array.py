"""The [array] table: modules in series and parallel, by a name of the CEC table or by numbers."""

from pydantic import Field, model_validator

from reluctance.base.arrays import FloatArray
from reluctance.base.schema import Section
from reluctance.plant.solar.datasheet import Datasheet
from reluctance.plant.solar.pv_module import CellNumbers, cell_of, check_one_module
from reluctance.plant.solar.single_diode import MOST_MODULES, Cell, Diode, array_diode


class Array(Section):
    """A field of equal modules on one fixed plane, unshaded."""

    module: str | None = None  # a name of the CEC table
    datasheet: Datasheet | None = None  # what the maker prints
    cell: CellNumbers | None = None
    n_series: int = Field(ge=1, le=MOST_MODULES)
    n_parallel: int = Field(ge=1, le=MOST_MODULES)
    tilt_deg: float = Field(ge=0, le=90)
    azimuth_deg: float = Field(180.0, ge=0, le=360)  # 0 north, 90 east, 180 south
    soiling: float = Field(0.03, ge=0, lt=1)  # part of the light that dirt takes
    blocking_diode_V: float = Field(0.0, ge=0)  # its forward voltage; 0: ideal

    @model_validator(mode="after")
    def has_one_module(self) -> "Array":
        check_one_module(self.module, self.datasheet, self.cell, "array")
        return self

    @property
    def reference(self) -> Cell:
        """One module at 1000 W/m2 and 25 degC."""
        return cell_of(self.module, self.datasheet, self.cell, "array")

    def diode(self, poa_global: FloatArray, temp_cell: FloatArray) -> Diode:
        """The array's curve at irradiance [W/m2] and cell temperature [degC]."""
        return array_diode(
            self.reference,
            poa_global,
            temp_cell,
            n_series=self.n_series,
            n_parallel=self.n_parallel,
        )
