"""The [site] table, and where the sun stands there."""

import re
from dataclasses import dataclass
from datetime import datetime, timedelta
from zoneinfo import ZoneInfo, ZoneInfoNotFoundError, available_timezones

import numpy as np
import pandas as pd
from pydantic import Field, field_validator, model_validator

from reluctance.base.arrays import FloatArray
from reluctance.base.schema import Section, did_you_mean
from reluctance.plant.solar.pv_module import pvlib

# The position is computed this often and interpolated as a unit vector between: off by less than
# 0.01 deg where the sun is more than 5 deg high, at a tenth of the time for weather by the minute.
KNOTS = 600  # [s]
MOST_OFF = 4.0  # [h] between a zone's clock and the sun's; the west of China has 3.1


class Site(Section):
    """[site]: where the array stands."""

    latitude_deg: float = Field(ge=-90, le=90)  # north positive
    longitude_deg: float = Field(ge=-180, le=180)  # east positive
    altitude_m: float = Field(0.0, ge=-500, le=9000)
    timezone: str  # IANA name: the days and the hours of the demand are local

    @field_validator("timezone")
    @classmethod
    def timezone_is_known(cls, name: str) -> str:
        try:
            ZoneInfo(name)
        except (ZoneInfoNotFoundError, ValueError, OSError):
            short = re.fullmatch("[A-Z]{0,5}", name)  # as EAT: what is near it is another clock
            near = _fixed(name) or ("" if short else did_you_mean(name, available_timezones()))
            if not near.startswith("; did"):
                near = "; need an IANA name as `Africa/Lagos`, or `Etc/GMT-3` for 3 h ahead of UTC"
            raise ValueError(f"timezone = {name!r} is unknown{near}") from None
        return name

    @model_validator(mode="after")
    def timezone_suits_the_longitude(self) -> "Site":
        if self.timezone == "UTC" or self.timezone.startswith("Etc/"):
            return self  # a clock that is meant, wherever the site is
        if abs(self.clock_ahead_h) > MOST_OFF:
            raise ValueError(
                f"longitude_deg = {self.longitude_deg:g} and timezone = {self.timezone!r} are "
                f"{abs(self.clock_ahead_h):.1f} h apart, need at most {MOST_OFF:g} h; "
                "check the sign (east positive)"
            )
        return self

    @property
    def clock_ahead_h(self) -> float:
        """How far the clock is ahead of the sun's, -12 to 12 across the date line [h]."""
        return (standard_h(self.timezone) - self.longitude_deg / 15 + 12) % 24 - 12


def standard_h(timezone: str) -> float:
    """How far a zone is ahead of UTC, without summer time [h]."""
    zone, new_year = ZoneInfo(timezone), datetime(2025, 1, 1)
    ahead = (zone.utcoffset(new_year) or timedelta()) - (zone.dst(new_year) or timedelta())
    return ahead / timedelta(hours=1)


def _fixed(name: str) -> str:
    """The name of a clock that is stated by its hours from UTC, as in GMT+1 or +05:30."""
    match = re.fullmatch(r"(?:UTC|GMT)?\s*([+-])0?(\d{1,2})(?::?(\d\d))?", name.strip(), re.I)
    if match is None:
        return ""
    sign, hours, minutes = match[1], int(match[2]), int(match[3] or 0)
    if minutes:
        return "; need the IANA name of the place, such as `Asia/Kolkata`"
    other = f"`Etc/GMT{'-' if sign == '+' else '+'}{hours}`" if hours else "`Etc/UTC`"
    return f"; did you mean {other}? (an hour ahead of UTC is Etc/GMT-1)"


@dataclass(frozen=True)
class Sun:
    """Apparent position of the sun, one value a sample."""

    zenith_deg: FloatArray
    azimuth_deg: FloatArray  # 0 north, 90 east

    @property
    def height(self) -> FloatArray:
        """Cosine of the zenith angle, 0 at night [1]."""
        return np.asarray(np.maximum(np.cos(np.radians(self.zenith_deg)), 0.0))

    def height_before(self, minutes: float, latitude_deg: float) -> FloatArray:
        """The height so long before, the sky turned back about the earth's axis; the declination
        stays, which moves by 0.02 degrees an hour [1]."""
        zenith, azimuth = np.radians(self.zenith_deg), np.radians(self.azimuth_deg)
        east, north, up = (
            np.sin(zenith) * np.sin(azimuth),
            np.sin(zenith) * np.cos(azimuth),
            np.cos(zenith),
        )
        turn, latitude = np.radians(minutes / 4), np.radians(latitude_deg)
        along = np.cos(latitude) * north + np.sin(latitude) * up
        across = -np.cos(latitude) * east
        back = np.cos(turn) * up + np.sin(turn) * across
        return np.asarray(np.maximum(back + (1 - np.cos(turn)) * along * np.sin(latitude), 0.0))


def sun_over(site: Site, t: pd.DatetimeIndex) -> Sun:
    """Where the sun stands, with refraction."""
    seconds = _seconds(t)
    if len(t) < 3 or np.median(np.diff(seconds)) >= KNOTS:
        zenith, azimuth = _position(site, t)
        return Sun(zenith, azimuth)
    knots = np.arange(seconds[0] - KNOTS, seconds[-1] + 2 * KNOTS, KNOTS)
    zenith, azimuth = map(np.radians, _position(site, pd.to_datetime(knots, unit="s", utc=True)))
    vector = (np.sin(zenith) * np.sin(azimuth), np.sin(zenith) * np.cos(azimuth), np.cos(zenith))
    east, north, up = (np.interp(seconds, knots, part) for part in vector)
    return Sun(
        np.degrees(np.arctan2(np.hypot(east, north), up)),
        np.degrees(np.arctan2(east, north)) % 360,
    )


def extra_radiation(t: pd.DatetimeIndex) -> FloatArray:
    """Irradiance above the atmosphere [W/m^2]."""
    days = t.tz_convert("UTC").day_of_year.to_numpy()
    return np.asarray(pvlib().irradiance.get_extra_radiation(days))


def _position(site: Site, t: pd.DatetimeIndex) -> tuple[FloatArray, FloatArray]:
    found = pvlib().solarposition.get_solarposition(
        t, site.latitude_deg, site.longitude_deg, site.altitude_m
    )
    return found["apparent_zenith"].to_numpy(), found["azimuth"].to_numpy()


def _seconds(t: pd.DatetimeIndex) -> FloatArray:
    return np.asarray((t.tz_convert("UTC").tz_localize(None) - pd.Timestamp(0)).total_seconds())
