"""The [weather] table: a clear sky, or a TMY3, EPW, PVGIS or CSV file."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from datetime import date, timedelta, timezone
from pathlib import Path
from typing import Literal
from zoneinfo import ZoneInfo

import numpy as np
import pandas as pd
from pydantic import Field, model_validator

from reluctance.base.columns import point_hint
from reluctance.base.errors import ParameterError
from reluctance.base.files import is_file, scratch
from reluctance.base.reading import read_text, reading
from reluctance.base.schema import Section
from reluctance.plant.solar.pv_module import pvlib
from reluctance.pumping.clouds import Clouds, covered, minutes_of, minutes_within
from reluctance.pumping.pvgis import is_pvgis, pvgis_hours
from reluctance.pumping.site import Site, extra_radiation, standard_h, sun_over
from reluctance.pumping.weather import COLUMNS, NO_SHIFT, Weather, as_numbers, interval, weather_of
from reluctance.pumping.weather_csv import MOST_HEAD, csv_table, names_light
from reluctance.pumping.weather_quality import doubts

NEAR_DEG = 1.0  # a file from farther away is for another place
SOLAR_CONSTANT = 1367.0  # direct light is never more: near the horizon an estimate may be [W/m^2]
A_LEAP_YEAR = 2024  # that a file with a 29 February is shown in
BYTES_OF_HEAD = 20_000
A_YEAR = 364.9  # days; one hour may be missing
OF_ITS_HEAD = "the time zone in the head of the file"  # is what its times are in
LINKE = 3.0  # turbidity of the clear sky where nothing else is said


# Keys without effect on a file of a kind; a CSV file may lack the columns of temperature and wind.
FOR_OTHERS = {kind: {"stamp", "temp_air_degC", "wind_mps"} for kind in ("tmy3", "epw", "pvgis")}
FOR_OTHERS["csv"] = {"year"}
OF_MINUTES = {"linke_turbidity", "seed"}
USUAL = {"temp_air": ("temp_air_degC", "degC"), "wind_speed": ("wind_mps", "m/s")}


class WeatherTable(Section):
    """[weather]"""

    kind: Literal["clear", "tmy3", "epw", "pvgis", "csv"]
    start: date | None = None  # clear: first day, as in start = 2026-03-21
    days: int = Field(1, ge=1, le=366 * 30)
    step_min: float = Field(1.0, gt=0, le=60)
    linke_turbidity: float = Field(LINKE, gt=1, lt=10)
    temp_air_degC: float = Field(25.0, gt=-60, lt=60)
    wind_mps: float = Field(1.0, ge=0)
    clouds: Clouds | None = None
    file: str | None = None  # "pvlib:NAME" takes a file that comes with pvlib
    year: int = Field(2025, ge=1900, le=2100)  # that a typical year is shown in
    stamp: Literal["start", "middle", "end"] = "start"  # csv: what of its interval a time names
    generate_minutes: bool = False  # within the hours of a file, by clouds from `seed`
    seed: int = Field(1, ge=0)

    @model_validator(mode="after")
    def keys_belong_to_the_kind(self) -> "WeatherTable":
        if self.kind == "clear":
            if self.start is None:
                raise ValueError("kind = 'clear' needs start, as in start = 2026-03-21")
            wrong = self.model_fields_set & {"file", "year", "stamp", "generate_minutes", "seed"}
        else:
            if self.file is None:
                raise ValueError(f"kind = {self.kind!r} needs file")
            wrong = self.model_fields_set & {"start", "days", "step_min", "clouds"}
            wrong |= self.model_fields_set & FOR_OTHERS[self.kind]
            if "generate_minutes" not in self.model_fields_set:
                for key in sorted(self.model_fields_set & OF_MINUTES):
                    raise ValueError(f"{key} has no effect without generate_minutes; remove it")
        for key in sorted(wrong):
            raise ValueError(f"{key} has no effect with kind = {self.kind!r}; remove it")
        if self.kind in ("tmy3", "pvgis") and pd.Timestamp(self.year, 1, 1).is_leap_year:
            raise ValueError(_one_day_more(self.year))
        return self


def read_weather(table: WeatherTable, site: Site, folder: Path) -> Weather:
    """The samples that the table asks for, as they are: without generated minutes."""
    if table.kind == "clear":
        assert table.start is not None
        first = _midnight(pd.Timestamp(table.start), site)
        step = pd.Timedelta(minutes=table.step_min)
        end = _midnight(pd.Timestamp(table.start) + pd.Timedelta(days=table.days), site)
        t = pd.date_range(first, end, freq=step, inclusive="left")
        if table.step_min >= 10:  # the middle of a long interval stands for its mean
            t = t + step / 2
        clear = clear_sky(t, step.total_seconds(), site, table)
        return clear if table.clouds is None else covered(clear, table.clouds)
    assert table.file is not None
    path = _path(table.file, folder)
    read, kind = _READERS[table.kind]
    with reading(path, kind, "check the file and [weather] kind"):
        form = _kind_by_its_form(path)
        if form and form != table.kind:
            its = _READERS[form][1]
            raise ParameterError(f"{path} has the form of {its}; set [weather] kind = {form!r}")
        samples = read(path, table, site)
        found = weather_of(samples, site, where=str(path))
        components = "estimated" not in samples.attrs
        told = list(doubts(found, site, components=components))
        days = len(found.t) * found.step / 86400
        if table.kind != "csv" and days < A_YEAR:
            told.append(
                f"{path.name} has {days:.4g} days, and files of its kind have a year: what is said "
                "of the weather is of these days alone; is it cut off?"
            )
        return replace(found, doubts=(*samples.attrs.get("assumed", ()), *told))


def _midnight(day: pd.Timestamp, site: Site) -> pd.Timestamp:
    """When a day begins: at one o'clock where the clock skips midnight, at the first of two."""
    return day.tz_localize(site.timezone, nonexistent="shift_forward", ambiguous=True)


def clear_sky(t: pd.DatetimeIndex, step: float, site: Site, table: WeatherTable) -> Weather:
    """Ineichen and Perez's clear sky."""
    sun = sun_over(site, t)
    lib = pvlib()
    with np.errstate(all="ignore"):  # at night it divides by zero, and says 0
        airmass = lib.atmosphere.get_relative_airmass(sun.zenith_deg)
        pressure = lib.atmosphere.alt2pres(site.altitude_m)
        sky = lib.clearsky.ineichen(
            sun.zenith_deg,
            lib.atmosphere.get_absolute_airmass(airmass, pressure),
            table.linke_turbidity,
            altitude=site.altitude_m,
            dni_extra=extra_radiation(t),
        )
    ghi, dni, dhi = (np.nan_to_num(np.asarray(sky[name])) for name in ("ghi", "dni", "dhi"))
    return Weather(
        t.tz_convert(site.timezone),
        step,
        ghi,
        dni,
        dhi,
        temp_air=np.full(len(t), table.temp_air_degC),
        wind_speed=np.full(len(t), table.wind_mps),
        sun=sun,
        where="[weather] clear sky",
    )


def with_minutes(hours: Weather, table: WeatherTable, site: Site, *, seed: int) -> Weather:
    """The same weather with clouds within its intervals, generated."""
    t = minutes_of(hours.t, hours.step)
    return minutes_within(hours, clear_sky(t, 60.0, site, table), seed)


def _path(file: str, folder: Path) -> Path:
    if file.startswith("pvlib:"):
        path = Path(pvlib().__file__).parent / "data" / file.removeprefix("pvlib:")
    else:
        path = folder / file
    if not is_file(path):
        raise ParameterError(f"[weather] file = {file!r}: no such file as {path}")
    return path


@contextmanager
def _plain(path: Path) -> Iterator[Path]:
    """The same text in a file that pvlib reads wherever it is: names of places may have accents."""
    text = read_text(path)
    with scratch() as place:
        (place / "weather").write_bytes(text.encode("ascii", "replace"))
        yield place / "weather"


def _tmy3(path: Path, table: WeatherTable, site: Site) -> pd.DataFrame:
    """Hours, labelled by their ends."""
    with _plain(path) as plain:
        frame, place = pvlib().iotools.read_tmy3(plain, coerce_year=table.year, map_variables=True)
    _check_place(place, site, path)
    frame = frame[[*COLUMNS]]
    last = frame.index[-1]
    if last.month > 1:  # pvlib takes the last row for the end of a year, where the file is cut off
        frame.index = [*frame.index[:-1], last.replace(year=table.year)]
    frame.index = frame.index - pd.Timedelta("30min")
    frame.attrs |= {"shift": pd.Timedelta("-30min"), "clock": OF_ITS_HEAD}
    return frame


def _epw(path: Path, table: WeatherTable, site: Site) -> pd.DataFrame:
    """Hours, or equal parts of them, each named by its end."""
    with _plain(path) as plain:
        frame, place = pvlib().iotools.read_epw(plain, coerce_year=A_LEAP_YEAR)
    _check_place(place, site, path)
    leap = bool(((frame["month"] == 2) & (frame["day"] == 29)).any())
    year = table.year if "year" in table.model_fields_set or not leap else A_LEAP_YEAR
    if leap and not pd.Timestamp(year, 1, 1).is_leap_year:
        raise ParameterError(
            f"{path} has a 29 February, [weather] year = {year} has none; take {A_LEAP_YEAR}"
        )
    if pd.Timestamp(year, 1, 1).is_leap_year and not leap:
        raise ParameterError("[weather] " + _one_day_more(year))
    parts = frame.groupby(frame.index).cumcount().to_numpy()  # within the hour
    t = frame.index.map(lambda hour: hour.replace(year=year))
    frame = frame[[*COLUMNS]]
    step = pd.Timedelta(hours=1) / (parts.max() + 1)
    frame.index = t + (parts + 0.5) * step
    frame.attrs |= {"shift": -0.5 * step, "clock": OF_ITS_HEAD}  # each record is named by its end
    return frame


def _one_day_more(year: int) -> str:
    """That a leap year is asked for of a file of a typical year."""
    return f"year = {year} has a 29 February, which a typical year has not; take {year - 1}"


def _csv(path: Path, table: WeatherTable, site: Site) -> pd.DataFrame:
    """Columns `time` (local without an offset, or with one), ghi, temp_air, wind_speed, dni, dhi;
    dni and dhi are estimated from ghi where both are missing (Erbs)."""
    found = csv_table(path)
    frame, t, head = found.frame, found.t, found.head
    clock = "the offsets of its times from UTC"
    if {"latitude", "longitude"} <= head.keys():
        _check_place(head, site, path)
    if t.tz is None:
        its = "time zone" in head
        clock = OF_ITS_HEAD if its else ""
        zone = timezone(timedelta(hours=head["time zone"])) if its else ZoneInfo(site.timezone)
        try:
            t = t.tz_localize(zone, ambiguous="infer")
        except ValueError as fault:
            raise ParameterError(
                f"{path}: a time does not exist once in {site.timezone} ({fault}); write times "
                f"with their offset from UTC, or set a fixed [site] timezone{_winter(site)}"
            ) from None
    listed = ", ".join(map(str, frame.columns))
    assumed = []
    for name, (key, unit) in USUAL.items():
        if name in frame and key in table.model_fields_set:
            raise ParameterError(
                f"{path} has a column of {name}: [weather] {key} has no effect; remove it"
            )
        if name not in frame:
            frame[name] = getattr(table, key)
            if key not in table.model_fields_set:
                assumed.append(
                    f"{path.name} has no column of {name}: {getattr(table, key):g} {unit} is taken "
                    f"throughout; set [weather] {key}, or add the column"
                )
    if "ghi" not in frame or ("dni" in frame) != ("dhi" in frame):
        raise ParameterError(
            f"{path}: columns {listed}; need time, ghi, and both or none of dni and dhi, in W/m2"
        )
    _refuse_commas(frame, t)
    frame = as_numbers(frame)
    for quantity, factor in found.factors.items():
        if factor != 1.0:
            frame[quantity] *= factor
    frame.index = t
    shift = {"start": 0.5, "middle": 0.0, "end": -0.5}[table.stamp]
    shift *= t[1] - t[0] if len(t) > 1 else NO_SHIFT
    frame.index = t + shift
    frame.attrs |= {"shift": shift, "assumed": assumed, "clock": clock}
    if "dni" not in frame:
        interval(t, str(path))  # before the sun is followed through it
        zenith = sun_over(site, pd.DatetimeIndex(frame.index)).zenith_deg
        ghi, day = frame["ghi"].to_numpy(), pd.DatetimeIndex(frame.index).day_of_year.to_numpy()
        frame["dni"] = np.minimum(pvlib().irradiance.erbs(ghi, zenith, day)["dni"], SOLAR_CONSTANT)
        frame["dhi"] = ghi - frame["dni"] * np.maximum(np.cos(np.radians(zenith)), 0.0)
        frame.attrs["estimated"] = True
    return frame[[*COLUMNS]]


def _refuse_commas(frame: pd.DataFrame, t: pd.DatetimeIndex) -> None:
    """Raises ParameterError at the first number with a decimal comma."""
    for name in (name for name in COLUMNS if name in frame):
        for k, cell in enumerate(frame[name]):
            if isinstance(cell, str) and (hint := point_hint(cell)):
                raise ParameterError(f"{name} = `{cell}` at {t[k]} is not a number; {hint}")


def _winter(site: Site) -> str:
    """The clock of the place without summer time, where it is a whole number of hours from UTC."""
    hours = standard_h(site.timezone)
    return f" such as Etc/GMT{-hours:+g}" if hours and hours == round(hours) else ""


def _kind_by_its_form(path: Path) -> str:
    """The kind of file that a text begins like; else nothing."""
    with path.open("rb") as file:
        text = file.read(BYTES_OF_HEAD).decode("utf-8-sig", "replace")
    second = text.partition("\n")[2]
    if is_pvgis(text):
        return "pvgis"
    if text.startswith("LOCATION,"):
        return "epw"
    if second.startswith("Date (MM/DD/YYYY)"):
        return "tmy3"
    lines = text.splitlines()[:MOST_HEAD]
    return "csv" if any(map(names_light, lines)) else ""


def _check_place(place: dict[str, float], site: Site, path: Path) -> None:
    north, east = place["latitude"], place["longitude"]
    if abs(north - site.latitude_deg) > NEAR_DEG or abs(east - site.longitude_deg) > NEAR_DEG:
        raise ParameterError(
            f"{path} is for {north:g} N {east:g} E, [site] is at {site.latitude_deg:g} N "
            f"{site.longitude_deg:g} E; set latitude_deg and longitude_deg, or take another file"
        )


def _pvgis(path: Path, table: WeatherTable, site: Site) -> pd.DataFrame:
    frame, place = pvgis_hours(path, table.year)
    _check_place(place, site, path)
    return frame[[*COLUMNS]]


_READERS = {
    "tmy3": (_tmy3, "a TMY3 file"),
    "epw": (_epw, "an EPW file"),
    "pvgis": (_pvgis, "an hourly CSV file of PVGIS"),
    "csv": (_csv, "a CSV file of weather"),
}
