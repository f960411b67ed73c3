"""The [weather] table: a clear sky, or a TMY3, EPW, PVGIS or CSV file."""

import csv
import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from datetime import date, timedelta, timezone
from io import StringIO
from pathlib import Path
from typing import Literal
from zoneinfo import ZoneInfo

import numpy as np
import pandas as pd
from pydantic import Field, model_validator

from reluctance.base.columns import (
    BRACKETED,
    Quantity,
    point_hint,
    recognised,
    refuse_parted,
    with_points,
)
from reluctance.base.errors import ParameterError
from reluctance.base.files import is_file, scratch
from reluctance.base.reading import is_number, read_text, reading
from reluctance.base.schema import Section
from reluctance.plant.solar.pv_module import pvlib
from reluctance.pumping.clouds import Clouds, covered, minutes_of, minutes_within
from reluctance.pumping.pvgis import is_pvgis, pvgis_hours
from reluctance.pumping.site import Site, extra_radiation, standard_h, sun_over
from reluctance.pumping.weather import COLUMNS, NO_SHIFT, Weather, as_numbers, interval, weather_of
from reluctance.pumping.weather_quality import doubts

NEAR_DEG = 1.0  # a file from farther away is for another place
SOLAR_CONSTANT = 1367.0  # direct light is never more: near the horizon an estimate may be [W/m^2]
NO_LEAP = "year = {year} has a 29 February, which a typical year has not; take {before}"
A_LEAP_YEAR = 2024  # that a file with a 29 February is shown in
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
            raise ValueError(NO_LEAP.format(year=self.year, before=self.year - 1))
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
        raise ParameterError("[weather] " + NO_LEAP.format(year=year, before=year - 1))
    parts = frame.groupby(frame.index).cumcount().to_numpy()  # within the hour
    t = frame.index.map(lambda hour: hour.replace(year=year))
    frame = frame[[*COLUMNS]]
    step = pd.Timedelta(hours=1) / (parts.max() + 1)
    frame.index = t + (parts + 0.5) * step
    frame.attrs |= {"shift": -0.5 * step, "clock": OF_ITS_HEAD}  # each record is named by its end
    return frame


WATTS = {"w/m2": 1.0, "w/m^2": 1.0, "wpm2": 1.0}
CSV_COLUMNS = {  # names of pvlib, PVGIS, TMY3 and loggers
    "time": Quantity(("time", "date", "datetime", "timestamp", "date_time"), {}),
    "ghi": Quantity(("ghi", "g(h)", "global", "global_horizontal", "allsky_sfc_sw_dwn"), WATTS),
    "dni": Quantity(("dni", "gb(n)", "direct_normal", "allsky_sfc_sw_dni"), WATTS),
    "dhi": Quantity(("dhi", "gd(h)", "diffuse", "diffuse_horizontal", "allsky_sfc_sw_diff"), WATTS),
    "temp_air": Quantity(
        ("temp_air", "t2m", "tair", "temp", "temperature", "dry-bulb"),
        {"degc": 1.0, "c": 1.0, "°c": 1.0},
    ),
    "wind_speed": Quantity(
        ("wind_speed", "ws10m", "ws2m", "wind", "ws", "wspd"),
        {"m/s": 1.0, "mps": 1.0, "km/h": 1 / 3.6, "kmh": 1 / 3.6},
    ),
}
# A time in parts, as in files of NSRDB and NASA POWER
PARTS = {"year": ("year",), "month": ("month", "mo"), "day": ("day", "dy")}
PARTS |= {"hour": ("hour", "hr"), "minute": ("minute", "min")}
UNITS_OF_LIGHT = {  # and how its numbers become W/m2
    "kw/m2": "multiply its numbers by 1000",
    "wh/m2": "divide its sums by the hours of an interval",
    "kwh/m2": "multiply its sums by 1000 over the hours of an interval",
    "j/cm2": "multiply its sums by 10000 over the seconds of an interval, by 2.778 for an hour",
    "kj/m2": "multiply its sums by 1000 over the seconds of an interval, by 0.2778 for an hour",
    "mj/m2": "multiply its sums by 1e6 over the seconds of an interval, by 277.8 for an hour",
}
DAY_FIRST = r"^(\d\d)\.(\d\d)\.(\d{4})"  # with points the day stands first, unlike with slashes
SLASHED = r"^(\d{1,2})/(\d{1,2})/(\d{4})"
MOST_HEAD = 60  # lines before the names of the columns
BYTES_OF_HEAD = 20_000


def _csv(path: Path, table: WeatherTable, site: Site) -> pd.DataFrame:
    """Columns `time` (local without an offset, or with one), ghi, temp_air, wind_speed, dni, dhi;
    dni and dhi are estimated from ghi where both are missing (Erbs)."""
    content = read_text(path)
    try:
        frame = _day_and_time_joined(_table(content))
        known = _recognised([str(name) for name in frame.columns])
        frame = frame.rename(columns={name: quantity for quantity, (name, _) in known.items()})
        text = frame["time"].astype(str) if "time" in frame else _from_parts(frame)
        text = text.str.replace(DAY_FIRST, r"\3-\2-\1", regex=True)
        if (slashed := text.str.extract(SLASHED).dropna()).size:
            _refuse_slashes(slashed)
        offset = text.str.contains(r"(?:[+-]\d\d:?\d\d|Z)$")
        if offset.any() and not offset.all():
            raise ValueError("some with an offset from UTC, some without")
        t = pd.DatetimeIndex(pd.to_datetime(text, format="ISO8601", utc=bool(offset.all())))
    except ParameterError:  # of a column, or of rows
        raise
    except (ValueError, KeyError) as fault:
        what = str(fault).splitlines()[0].partition(" You might")[0]
        raise ParameterError(
            f"{path}: need a column `time` of days that exist, as 2026-03-21 12:00 or "
            f"2026-03-21T12:00+01:00, or columns `date` and `time` ({what})"
        ) from None
    if t.isna().any():
        raise ParameterError(f"data row {int(t.isna().argmax()) + 1} has no time; fill the cell")
    head, clock = _of_head(content), "the offsets of its times from UTC"
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
    for quantity, (_, factor) in known.items():
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


def _refuse_slashes(parts: pd.DataFrame) -> None:
    """Raises ParameterError for days with slashes, with what the day of the first row may be."""
    a, b, year = parts.iloc[0]
    numbers = parts.astype(int).max()
    day_first, month_first = (f"{year}-{m:0>2}-{d:0>2}" for d, m in ((a, b), (b, a)))
    right = f"{day_first} or {month_first}, whichever it is"
    if numbers[0] > 12 or numbers[1] > 12:
        right = day_first if numbers[0] > 12 else month_first
    raise ParameterError(f"the day `{a}/{b}/{year}` has slashes; write {right}")


def _day_and_time_joined(frame: pd.DataFrame) -> pd.DataFrame:
    """A column of the day and one of the time of day become one of the time."""
    names = {str(name).strip().lower(): name for name in frame.columns}
    day, clock = names.get("date"), next((names[n] for n in ("time", "hour") if n in names), None)
    if day is None or clock is None or not frame[clock].astype(str).str.contains(":").all():
        return frame
    joined = frame[day].astype(str) + " " + frame[clock].astype(str)
    return frame.drop(columns=[day, clock]).assign(time=joined)


def _table(content: str) -> pd.DataFrame:
    """The rows of a CSV file below the line that names the light; what stands above is no data."""
    lines = [line for line in content.splitlines() if line.strip() and not line.startswith("#")]
    light = (k for k, line in enumerate(lines[:MOST_HEAD]) if "ghi" in _known(line))
    start = next(light, _names_line(lines[:MOST_HEAD]))
    separator = _separator(lines[start]) if lines else ","
    lines = with_points(lines[start:], separator)
    if separator == ",":
        refuse_parted([line.split(",") for line in lines[:MOST_HEAD] if '"' not in line])
    return pd.read_csv(StringIO("\n".join(lines)), sep=separator, skipinitialspace=True)


def _of_head(content: str) -> dict[str, float]:
    """Latitude, longitude [deg] and time zone [h] where the head of a file names them: the first
    line of NSRDB above its values, or the line of NASA POWER with the place."""
    lines = [*content.splitlines()[:MOST_HEAD], "", ""]
    names, values = (line.lower().split(",") for line in lines[:2])
    given = dict(zip(map(str.strip, names), values, strict=False))
    if place := re.search(
        r"latitude\s+(-?[\d.]+)\s+longitude\s+(-?[\d.]+)", "\n".join(lines), re.I
    ):
        given |= {"latitude": place[1], "longitude": place[2]}
    of = ("latitude", "longitude", "time zone")
    return {name: float(given[name]) for name in of if is_number(given.get(name, ""))}


def _winter(site: Site) -> str:
    """The clock of the place without summer time, where it is a whole number of hours from UTC."""
    hours = standard_h(site.timezone)
    return f" such as Etc/GMT{-hours:+g}" if hours and hours == round(hours) else ""


def _names_line(lines: list[str]) -> int:
    """The line with the names where none names the light: of the lines without numbers above a row
    of numbers, as wide as the last row, the one with most cells filled."""
    rows = [next(csv.reader([line], delimiter=_separator(line))) for line in lines]
    above: list[int] = []
    for k, row in enumerate(rows):
        if len(row) != len(rows[-1]):
            above = []
        elif not any(is_number(cell.replace(",", ".")) for cell in row):
            above.append(k)
        elif above:
            return max(above, key=lambda n: sum(map(bool, rows[n])))
    return 0


def _separator(line: str) -> str:
    return next((mark for mark in ";\t" if mark in line), ",")


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
    return "csv" if any("ghi" in _known(line) for line in lines) else ""


def _recognised(names: list[str]) -> dict[str, tuple[str, float]]:
    """`recognised`, with what makes watts of another unit of light."""
    try:
        return recognised(names, CSV_COLUMNS)
    except ParameterError as fault:
        unit = re.search(r"has the unit `(.*?)`", str(fault))
        todo = UNITS_OF_LIGHT.get(unit[1].replace("^", "")) if unit else None
        raise ParameterError(f"{fault}; {todo}, and name it W/m2" if todo else str(fault)) from None


def _known(line: str) -> dict[str, tuple[str, float]]:
    names = [n.strip() for n in line.split(_separator(line))]
    with_day = any(n.lower() == "date" for n in names)  # and the time of day beside it
    try:
        clocks = ("time", "hour") if with_day else ()
        return recognised([n for n in names if n.lower() not in clocks], CSV_COLUMNS)
    except ParameterError:  # a wrong unit, of light perhaps
        stems = [BRACKETED.sub(r"\g<stem>", name).strip().lower() for name in names]
        return {q: ("", 1.0) for q, of in CSV_COLUMNS.items() if {*of.stems} & {*stems}}


def _from_parts(frame: pd.DataFrame) -> pd.Series:
    """Times from columns of year, month, day, hour and minute."""
    names = {str(name).strip().lower(): name for name in frame.columns}
    parts = {
        part: frame[names[near]]
        for part, stems in PARTS.items()
        if (near := next((s for s in stems if s in names), None))
    }
    if missing := [part for part in ("year", "month", "day", "hour") if part not in parts]:
        listed = ", ".join(map(str, frame.columns))
        raise ValueError(f"columns {listed}; no time, and of its parts no {', '.join(missing)}")
    return pd.to_datetime(pd.DataFrame(parts)).astype(str)


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
