"""Weather as samples at equal intervals, and what is refused: gaps, nights only, a wrong zone."""

from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from reluctance.base.arrays import FloatArray
from reluctance.base.errors import ParameterError
from reluctance.pumping.site import Site, Sun, sun_over

DARK_DEG = 96.0  # zenith angle of the end of civil twilight
LIGHT = 50.0  # more at night than a pyranometer's offset [W/m^2]
OF_DAYS = 0.9  # of the light while the sun is up: days; an offset has half of itself there
WRONG_ZONE_H = 1.0  # the light's centroid may be off noon by this, over a month or more
WRONG_ZONE_DAY_H = 2.5  # and by this on few days: clouds may take a morning
DAYLIGHT = (250.0, 1600.0)  # the greatest light of a series, of dim and of tropical days [W/m^2]
NO_SHIFT = pd.Timedelta(0)


@dataclass(frozen=True)
class Weather:
    """Means over the intervals; `t` are their middles."""

    t: pd.DatetimeIndex  # (n,) local time
    step: float  # length of an interval [s]
    ghi: FloatArray  # global horizontal irradiance [W/m^2]
    dni: FloatArray  # direct normal
    dhi: FloatArray  # diffuse horizontal
    temp_air: FloatArray  # [degC]
    wind_speed: FloatArray  # [m/s]
    sun: Sun
    where: str  # for messages
    doubts: tuple[str, ...] = ()  # what a file lacks or contradicts itself in, for notes
    shift: pd.Timedelta = NO_SHIFT  # of the middles, from the times that a file has

    @property
    def stamps(self) -> pd.DatetimeIndex:
        """The times of the file's rows, for messages."""
        return self.t - self.shift


# What stands for a missing value in EPW, TMY3, SRML and the files of loggers
MARKS = (-9999.0, -9900.0, -999.0, -99.0, -99.9, -9.9, 99.9, 999.0, 999.9, 9999.0)
LIMITS = {"temp_air": (-90.0, 60.0), "wind_speed": (0.0, 60.0)}  # else of light [W/m^2]:
LIGHT_LIMITS = (-20.0, 1800.0)
COLUMNS = ("ghi", "dni", "dhi", "temp_air", "wind_speed")


def weather_of(table: pd.DataFrame, site: Site, *, where: str) -> Weather:
    """Checked samples from a table with an index of middles and pvlib's names. Its attribute
    `shift` is how much later these are than the times of the file; `clock` says where their zone
    stands, if not in [site].

    Raises
    ------
    ParameterError
        With one line: a gap, a value that is missing or impossible, light at night, or a day whose
        light is hours off noon.
    """
    t = pd.DatetimeIndex(table.index).tz_convert(site.timezone)
    shift = table.attrs.get("shift", NO_SHIFT)
    step = interval(t - shift, where)
    table = as_numbers(table)
    values = {name: table[name].to_numpy(dtype=float) for name in COLUMNS}
    found = Weather(t=t, step=step, sun=sun_over(site, t), where=where, shift=shift, **values)
    _whole(found.stamps, values["ghi"], "ghi", where)
    # First: a wrong zone makes the other columns wrong too
    _check_light(found, site, table.attrs.get("clock", ""))
    for name in COLUMNS[1:]:
        _whole(found.stamps, values[name], name, where)
    return found


def as_numbers(table: pd.DataFrame) -> pd.DataFrame:
    """The table with NaN where a cell of a column of weather is no number."""
    there = [name for name in COLUMNS if name in table]
    return table.assign(**{n: pd.to_numeric(table[n], errors="coerce") for n in there})


def interval(t: pd.DatetimeIndex, where: str) -> float:
    """The interval between samples [s].

    Raises
    ------
    ParameterError
        If there are fewer than two, or the intervals differ.
    """
    if len(t) < 2:
        raise ParameterError(f"{where}: {len(t)} samples, need at least 2")
    steps = np.diff(t.tz_convert("UTC").tz_localize(None).to_numpy()) / np.timedelta64(1, "s")
    step = float(np.median(steps))
    wrong = np.flatnonzero(~((steps > 0) & (np.abs(steps - step) <= 1e-3 * step)))
    if len(wrong):
        k = int(wrong[0])
        every = float(np.median(np.abs(steps)))
        if steps[k] > every:
            kind, remedy = "a gap", "fill the gaps first"
        elif steps[k] == 0:
            kind, remedy = "one time twice", "remove one row of each such pair"
        elif steps[k] < 0:
            kind, remedy = "times out of order", "sort the rows by their time"
        else:
            kind, remedy = "a shorter interval", "bring the rows to equal intervals"
        raise ParameterError(
            f"{where}: {kind} from {t[k]} to {t[k + 1]} ({len(wrong)} such places), need a row "
            f"every {every:g} s; {remedy}"
        )
    return step


def _whole(t: pd.DatetimeIndex, values: FloatArray, name: str, where: str) -> None:
    missing = np.flatnonzero(~np.isfinite(values))
    if len(missing):
        raise ParameterError(
            f"{where}: {name} is missing, or no number, at {t[missing[0]]} ({len(missing)} of "
            f"{len(t)} samples); fill the gaps first"
        )
    low, high = LIMITS.get(name, LIGHT_LIMITS)
    wrong = np.flatnonzero(~((values >= low) & (values <= high)))
    if len(wrong):
        value = values[wrong[0]]
        remedy = "it marks a missing value: fill these samples first"
        if value not in MARKS:
            remedy = "check the column and its unit"
        raise ParameterError(
            f"{where}: {name} = {value:g} at {t[wrong[0]]} ({len(wrong)} of {len(t)} samples), "
            f"need {low:g} to {high:g}; {remedy}"
        )


def _check_light(weather: Weather, site: Site, clock: str = "") -> None:
    sun, ghi = weather.sun, np.maximum(weather.ghi, 0.0)
    if not ghi.max() >= 5:
        stamps = weather.stamps
        if ghi @ (sun.height > 0) > OF_DAYS * ghi.sum():
            raise ParameterError(
                f"{weather.where}: ghi stays below 5 W/m2 from {stamps[0]} to {stamps[-1]}, "
                f"but follows the days, up to {ghi.max():.3g}: {_smaller_unit(weather)}"
            )
        raise ParameterError(
            f"{weather.where}: night only, ghi stays below 5 W/m2 from {stamps[0]} to "
            f"{stamps[-1]}; take days with sun"
        )
    if (misses := _misses(weather, site)) is not None:
        off, at_night = misses
        raise ParameterError(
            f"{weather.where}: its light is {off:+.1f} h off the sun at {site.latitude_deg:g} N "
            f"{site.longitude_deg:g} E, and {at_night} samples have sun at night; check "
            f"{clock or f'[site] timezone = {site.timezone!r}'}, longitude_deg and the time stamps"
            + ("" if clock else _as_if_in_utc(weather, site))
        )


def _misses(weather: Weather, site: Site) -> tuple[float, int] | None:
    """How much later the light is than the sun [h], and how many samples have light at night, where
    either is too much; else None."""
    sun, ghi, hour = weather.sun, np.maximum(weather.ghi, 0.0), weather.step / 3600
    height = sun.height
    if height.max() == 0:
        off = 12.0
    else:  # time of the light's centroid less that of the sun's, around the mean solar noon
        clock = _solar_clock(weather.t, site)
        off = float((clock @ ghi) / ghi.sum() - (clock @ height) / height.sum())
    allowed = WRONG_ZONE_H if len(ghi) * hour >= 24 * 30 else WRONG_ZONE_DAY_H
    night = (sun.zenith_deg > DARK_DEG + 15 * hour / 2) & (ghi > LIGHT)
    return (off, int(night.sum())) if abs(off) > allowed or night.mean() > 0.01 else None


def _as_if_in_utc(weather: Weather, site: Site) -> str:
    """Asks for times in UTC without an offset, where the light would then be that of the sun."""
    t = weather.t.tz_localize(None).tz_localize("UTC")
    if _misses(replace(weather, t=t, sun=sun_over(site, t)), site) is not None:
        return ""
    return (
        "; are the times in UTC? Then write them with their offset, as in 2026-03-21T12:00+00:00, "
        "and leave the zone as it is: the hours of [demand] are in it"
    )


def _smaller_unit(weather: Weather) -> str:
    """Asks for the units in which the greatest light would be one that there is."""
    low, high = DAYLIGHT
    asked = [
        f"is its unit {unit}? Then write ghi, and dni and dhi where given, in W/m2: {factor:.4g} "
        "times as much"
        for unit, factor in (("kW/m2", 1e3), ("MJ/m2 in each row", 1e6 / weather.step))
        if low <= factor * weather.ghi.max() <= high
    ]
    return "; or ".join(asked) or "check its unit"


def _solar_clock(t: pd.DatetimeIndex, site: Site) -> FloatArray:
    """Hours from the mean solar noon, -12 to 12."""
    utc = t.tz_convert("UTC")
    hours = utc.hour + utc.minute / 60 + utc.second / 3600 + site.longitude_deg / 15
    return np.asarray((hours % 24) - 12, dtype=float)
