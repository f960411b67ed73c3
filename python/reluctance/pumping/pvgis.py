"""Hourly CSV files of PVGIS: a typical year (TMY), or a series on the horizontal plane.

Both have a few lines on the place, one line of names that begins with `time`, rows up to an empty
line, and notes. Times are in UTC. The irradiance of a row is that of one instant, at which the
satellite took its image; from a reanalysis it is the mean around it. A series has this instant as
its time (HH:10 in most of Europe and Africa, HH:30 of ERA5). A typical year has full hours; since
version 5.3 its head has how much later the instant is. Here a value stands for the hour around its
instant, in a typical year without that line for its clock hour.
(Joint Research Centre, PVGIS user manual, hourly data and typical meteorological year.)
"""

import io
from pathlib import Path

import numpy as np
import pandas as pd

from reluctance.base.errors import ParameterError
from reluctance.base.reading import read_text
from reluctance.plant.solar.pv_module import pvlib

NAMES = {"T2m": "temp_air", "WS10m": "wind_speed", "G(h)": "ghi", "Gb(n)": "dni", "Gd(h)": "dhi"}
TILTED = {"Gb(i)", "Gd(i)"}  # on the plane that was asked for
LOWEST_SUN = 0.0175  # cosine of the zenith angle at 1 deg: below, no direct light is inferred
OVER_YEAR = 8760  # hours of a typical year
LATER = "Irradiance Time Offset"  # of a typical year, in the head [h]


def is_pvgis(text: str) -> bool:
    """Whether a text begins like a file of PVGIS."""
    return text.startswith("Latitude (decimal degrees):")


def pvgis_hours(path: Path, year: int) -> tuple[pd.DataFrame, dict[str, float]]:
    """Rows under pvlib's names at the instants of their light, and the place. A typical year, whose
    months come from several years, is shown in `year`.

    Raises
    ------
    ParameterError
        If it is another file, or its irradiance is on a tilted plane only. A damaged file raises
        other exceptions: call it within `reading`.
    """
    head, names, body = _parts(read_text(path))
    frame = pd.read_csv(io.StringIO(names + body)).rename(columns=NAMES)
    stamps = pd.to_datetime(frame.iloc[:, 0], format="%Y%m%d:%H%M", utc=True)
    later = pd.Timedelta(0) if (stamps.dt.minute != 0).any() else pd.Timedelta("30min")
    if LATER in head:
        later = pd.Timedelta(hours=head[LATER]).round("min")
    place = {"latitude": head["Latitude"], "longitude": head["Longitude"]}
    light = [name for name in ("Gb(i)", "Gd(i)", "Gr(i)") if name in frame]
    frame = frame.assign(**{n: pd.to_numeric(frame[n], errors="coerce") for n in light})
    t = pd.DatetimeIndex(stamps)
    whole = len(frame) == OVER_YEAR  # a typical year has months of several; it may be cut off
    if t.year.nunique() > 1 and (whole or not t.is_monotonic_increasing):
        t = t.map(lambda when: when.replace(year=year))
    frame = frame.set_index(t + later)
    frame.attrs["shift"] = later
    if TILTED <= set(frame) and "ghi" not in frame:
        frame = _from_horizontal(frame, head, path)
    missing = [name for name in NAMES.values() if name not in frame]
    if missing:
        raise ParameterError(
            f"{path}: columns {', '.join(frame.columns)}; missing {', '.join(missing)}; download "
            "`TMY`, or `hourly data` with slope 0 and radiation components"
        )
    return frame, place


def _parts(text: str) -> tuple[dict[str, float], str, str]:
    """Numbers of the head, the line of names, and the rows."""
    lines = text.splitlines(keepends=True)
    start = next((k for k, line in enumerate(lines) if line.startswith("time")), None)
    if start is None:
        raise ParameterError(
            "no line of names that begins with `time`, so no hourly CSV file of PVGIS; download "
            "`TMY` or `hourly data` as CSV"
        )
    end = next((k for k in range(start, len(lines)) if not lines[k].strip()), len(lines))
    head = {}
    for line in lines[:start]:
        key, _, value = line.partition(":")
        number = value.strip().split(" ")[0]
        if number.replace(".", "").replace("-", "").isdigit():
            head[key.split(" (")[0]] = float(number)
    return head, lines[start], "".join(lines[start + 1 : end])


def _from_horizontal(frame: pd.DataFrame, head: dict[str, float], path: Path) -> pd.DataFrame:
    if head.get("Slope", 0.0) != 0:
        raise ParameterError(
            f"{path}: irradiance on a plane of slope {head['Slope']:g} deg, need 0; download it "
            "with slope 0 and radiation components, or download `TMY`"
        )
    ghi = frame["Gb(i)"] + frame["Gd(i)"] + frame.get("Gr(i)", 0.0)
    sun = pvlib().solarposition.get_solarposition(
        frame.index, head["Latitude"], head["Longitude"], head.get("Elevation", 0.0)
    )
    height = np.cos(np.radians(sun["apparent_zenith"].to_numpy()))
    dni = np.where(height > LOWEST_SUN, frame["Gb(i)"] / np.maximum(height, LOWEST_SUN), 0.0)
    return frame.assign(ghi=ghi, dni=np.minimum(dni, 1200.0), dhi=frame["Gd(i)"])
