"""From weather to the array: irradiance on its plane and cell temperature.

Hay and Davies for the diffuse light, ASHRAE for reflection (b = 0.05), Faiman for the cell
temperature; all by pvlib.
"""

from dataclasses import dataclass

import numpy as np

from reluctance.base.arrays import FloatArray
from reluctance.plant.solar.pv_module import pvlib
from reluctance.pumping.array import Array
from reluctance.pumping.site import extra_radiation
from reluctance.pumping.weather import Weather


@dataclass(frozen=True)
class Sunlight:
    """On the plane of the array, one value a sample."""

    poa_global: FloatArray  # before dirt and reflection [W/m^2]
    poa_effective: FloatArray  # what reaches the cells [W/m^2]
    temp_cell: FloatArray  # [degC]


def sunlight(weather: Weather, array: Array) -> Sunlight:
    """Irradiance and cell temperature, 0 W/m^2 at night."""
    lib, sun = pvlib(), weather.sun
    plane = (array.tilt_deg, array.azimuth_deg)
    poa = lib.irradiance.get_total_irradiance(
        *plane,
        sun.zenith_deg,
        sun.azimuth_deg,
        weather.dni,
        weather.ghi,
        weather.dhi,
        dni_extra=extra_radiation(weather.t),
        model="haydavies",
    )
    total, direct, diffuse = (
        np.maximum(np.nan_to_num(np.asarray(poa[key])), 0.0)
        for key in ("poa_global", "poa_direct", "poa_diffuse")
    )
    aoi = lib.irradiance.aoi(*plane, sun.zenith_deg, sun.azimuth_deg)
    through = direct * np.nan_to_num(lib.iam.ashrae(aoi)) + diffuse
    return Sunlight(
        poa_global=total,
        poa_effective=(1 - array.soiling) * through,
        temp_cell=np.asarray(lib.temperature.faiman(total, weather.temp_air, weather.wind_speed)),
    )
