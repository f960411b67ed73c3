"""A CSV file of weather: the names and units of its columns, its times, and what its head says."""

import csv
import re
from dataclasses import dataclass
from io import StringIO
from pathlib import Path

import pandas as pd

from reluctance.base.columns import BRACKETED, Quantity, recognised, refuse_parted, with_points
from reluctance.base.errors import ParameterError
from reluctance.base.reading import is_number, read_text

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


@dataclass(frozen=True)
class CsvTable:
    """The rows of a file."""

    frame: pd.DataFrame  # under the names of `CSV_COLUMNS`, as far as it has these; cells as read
    factors: dict[str, float]  # of the columns: what makes W/m2, degC and m/s of their numbers
    t: pd.DatetimeIndex  # in UTC where they have an offset, else as written
    head: dict[str, float]  # latitude, longitude [deg] and time zone [h], as far as it names them


def csv_table(path: Path) -> CsvTable:
    """Reads a file whose times are a column, or columns of their parts.

    Raises
    ------
    ParameterError
        If a time is missing or none, or the unit of a column is another.
    """
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
    factors = {quantity: factor for quantity, (_, factor) in known.items()}
    return CsvTable(frame, factors, t, _of_head(content))


def names_light(line: str) -> bool:
    """Whether a line has the names of columns, of light among them."""
    return "ghi" in _known(line)


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
    light = (k for k, line in enumerate(lines[:MOST_HEAD]) if names_light(line))
    start = next(light, _names_line(lines[:MOST_HEAD]))
    separator = _separator(lines[start]) if lines else ","
    lines = with_points(lines[start:], separator)
    if separator == ",":
        refuse_parted([line.split(",") for line in lines[:MOST_HEAD] if '"' not in line])
    return pd.read_csv(StringIO("\n".join(lines)), sep=separator, skipinitialspace=True)


def _of_head(content: str) -> dict[str, float]:
    """Latitude, longitude [deg] and time zone [h] where the head of a file names them: the first
    line of NSRDB above its values, or the lines of NASA POWER with the place and the clock. Its
    local solar time has a zone for each 15 degrees of longitude, about the middle of them."""
    lines = [*content.splitlines()[:MOST_HEAD], "", ""]
    names, values = (line.lower().split(",") for line in lines[:2])
    given = dict(zip(map(str.strip, names), values, strict=False))
    above = "\n".join(lines)
    if place := re.search(r"latitude\s+(-?[\d.]+)\s+longitude\s+(-?[\d.]+)", above, re.I):
        given |= {"latitude": place[1], "longitude": place[2]}
        if clock := re.search(r"through\s+\S+\s+in\s+(UTC|LST)\b", above):
            given["time zone"] = str(round(float(place[2]) / 15)) if clock[1] == "LST" else "0"
    of = ("latitude", "longitude", "time zone")
    return {name: float(given[name]) for name in of if is_number(given.get(name, ""))}


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
