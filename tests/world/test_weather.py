"""Weather as it comes: each doubt is told with its number, and what can be read is read."""

import re
from collections.abc import Callable
from dataclasses import replace
from datetime import date, timedelta, timezone
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pvlib
import pytest
from pvgis_file import pvgis_file

from reluctance.base.errors import ParameterError
from reluctance.base.schema import checked
from reluctance.pumping.site import Site, sun_over
from reluctance.pumping.weather import Weather
from reluctance.pumping.weather_file import WeatherTable, clear_sky, read_weather
from reluctance.pumping.weather_quality import doubts

PHOENIX = {"latitude_deg": 33.45, "longitude_deg": -111.98, "timezone": "Etc/GMT+7"}
TMY3 = {"kind": "tmy3", "file": "pvlib:723170TYA.CSV"}
NOTHING = Path()


def site(**changes: Any) -> Site:
    return checked(Site, {**PHOENIX, **changes}, "[site]")


def read(where: Site, folder: Path = NOTHING, **values: Any) -> Weather:
    return read_weather(checked(WeatherTable, values, "[weather]"), where, folder)


@lru_cache
def greensboro() -> tuple[Weather, Site]:
    place = site(latitude_deg=36.1, longitude_deg=-79.95, timezone="Etc/GMT+5")
    return read(place, **TMY3), place


def clear_hours(where: Site, first: str, last: str) -> Weather:
    t = pd.date_range(first, last, freq="h", tz=where.timezone, inclusive="left")
    table = WeatherTable(kind="clear", start=date(2024, 1, 1))
    return clear_sky(t + pd.Timedelta("30min"), 3600.0, where, table)


def epw(
    path: Path, sky: Weather, *, wind: float = 1.0, per_hour: int = 1, where: Site | None = None
) -> None:
    place = where or site()
    lines = [
        f"LOCATION,X,,,TMY,0,{place.latitude_deg},{place.longitude_deg},-7.0,340.0",
        *["HEADER"] * 7,
    ]
    hours = sky.t.repeat(per_hour)
    for k, (t, g, b, d) in enumerate(
        zip(hours, *(np.repeat(x, per_hour) for x in (sky.ghi, sky.dni, sky.dhi)), strict=True)
    ):
        minute = 60 * (k % per_hour + 1) // per_hour
        lines.append(
            f"{t.year},{t.month},{t.day},{t.hour + 1},{minute},?9,25.0,5,30,97000,0,0,350,{g:.1f},"
            f"{b:.1f},{d:.1f},0,0,0,0,180,{wind},0,0,9,9,9,9,0,0.0,0,88,0.2,0,0"
        )
    path.write_text("\n".join(lines) + "\n")


def test_a_measured_leap_year_has_366_days(tmp_path: Path) -> None:
    epw(tmp_path / "w.epw", clear_hours(site(), "2024-01-01", "2025-01-01"))
    found = read(site(), tmp_path, kind="epw", file="w.epw")
    assert len(found.t) == 8784 and found.doubts == ()
    with pytest.raises(ParameterError, match=r"29 February.* year = 2023 has none; take 2024"):
        read(site(), tmp_path, kind="epw", file="w.epw", year=2023)
    assert len(read(site(), tmp_path, kind="epw", file="w.epw", year=2024).t) == 8784


def test_an_epw_of_half_hours_is_read(tmp_path: Path) -> None:
    epw(tmp_path / "w.epw", clear_hours(site(), "2023-05-01", "2023-05-04"), per_hour=2)
    found = read(site(), tmp_path, kind="epw", file="w.epw")
    assert found.step == 1800 and str(found.t[1]) == "2025-05-01 00:45:00-07:00"


@pytest.mark.parametrize("wind", [999, 999.9, 99.9, -9.9, -99, 75])
def test_a_wind_that_cannot_be_is_refused_and_a_mark_of_a_missing_one_named(
    tmp_path: Path, wind: float
) -> None:
    epw(tmp_path / "w.epw", clear_hours(site(), "2023-05-01", "2023-05-04"), wind=wind)
    with pytest.raises(ParameterError, match=f"wind_speed = {wind:g} at .*72 of 72") as fault:
        read(site(), tmp_path, kind="epw", file="w.epw")
    assert ("marks a missing value" in str(fault.value)) == (wind != 75)


@pytest.mark.parametrize(
    ("zone", "east", "day", "hours"),
    [
        ("America/Santiago", -70, date(2026, 9, 6), 23),
        ("America/Santiago", -70, date(2026, 9, 5), 24),
        ("Africa/Cairo", 31, date(2026, 4, 24), 23),
        ("Asia/Beirut", 35, date(2026, 3, 29), 23),
        ("America/Havana", -82, date(2026, 11, 1), 25),
        ("America/Havana", -82, date(2026, 10, 31), 24),
    ],
)
def test_a_day_whose_midnight_the_clock_skips_or_repeats(
    zone: str, east: float, day: date, hours: int
) -> None:
    place = site(latitude_deg=0.0, longitude_deg=east, timezone=zone)
    found = read(place, kind="clear", start=day, step_min=60.0)
    assert len(found.t) == hours
    usual = read(place, kind="clear", start=date(day.year, day.month, 15), step_min=60.0)
    assert found.ghi.sum() == pytest.approx(usual.ghi.sum(), rel=0.03)


def moved(weather: Weather, where: Site, minutes: float) -> Weather:
    t = weather.t + pd.Timedelta(minutes=minutes)
    return replace(weather, t=t, sun=sun_over(where, t))


def test_a_typical_year_contradicts_itself_in_nothing() -> None:
    weather, place = greensboro()
    assert weather.doubts == ()
    assert doubts(moved(weather, place, 8), place, components=True) == ()


@pytest.mark.parametrize("components", [True, False])
@pytest.mark.parametrize("minutes", [-60, -30, 20, 45])
def test_an_offset_of_the_stamps_is_told_to_a_few_minutes(minutes: int, components: bool) -> None:
    weather, place = greensboro()
    told = doubts(moved(weather, place, minutes), place, components=components)
    off = [float(text.split()[3]) for text in told if "off the sun" in text]
    assert off == [pytest.approx(minutes, abs=3)]
    assert ("east and west" in told[0]) != components


def dark(w: Weather) -> Weather:
    gap = (w.t.day_of_year >= 130) & (w.t.day_of_year < 134)
    return replace(w, **{n: np.where(gap, 0.0, getattr(w, n)) for n in ("ghi", "dni", "dhi")})


CONTRADICTIONS: list[tuple[Callable[[Weather], Weather], str]] = [
    (lambda w: replace(w, dni=w.dhi, dhi=w.dni), "ghi contradicts dni"),
    (lambda w: replace(w, ghi=1.2 * w.ghi), r"100% of the sunlit.* \+19\.9%"),
    (lambda w: replace(w, dhi=w.dhi + 150 * (w.ghi > 50)), "ghi contradicts"),
    (lambda w: replace(w, dni=2.5 * w.dni), "dni is above what is physically possible"),
    (dark, "4 of 36[56] days are dark.*first 2025-05-10"),
    (
        lambda w: replace(w, ghi=0.36 * w.ghi, dni=0.36 * w.dni, dhi=0.36 * w.dhi),
        r"on the brightest of 36[56] days 2\d% of the light .*, check the unit of ghi \(1 J/cm2",
    ),
]


@pytest.mark.parametrize(("change", "told"), CONTRADICTIONS, ids=[m for _, m in CONTRADICTIONS])
def test_what_a_file_contradicts_itself_in_is_told(
    change: Callable[[Weather], Weather], told: str
) -> None:
    weather, place = greensboro()
    found = " | ".join(doubts(change(weather), place, components=True))
    assert pd.Series([found]).str.contains(told, regex=True).all(), found


def rows(sky: Weather, form: str) -> str:
    """A few lines of each source, written here."""
    lines = {
        "nsrdb": [
            "Source,Location ID,Time Zone",
            "NSRDB,1,-7",
            "Year,Month,Day,Hour,Minute,DNI,DHI,GHI,Temperature,Wind Speed",
        ],
        "nasa": [
            "-BEGIN HEADER-",
            "NASA/POWER hourly",
            "-END HEADER-",
            "YEAR,MO,DY,HR,ALLSKY_SFC_SW_DWN,ALLSKY_SFC_SW_DNI,ALLSKY_SFC_SW_DIFF,T2M,WS10M",
        ],
        "semicolons": ["time;ghi;dni;dhi"],
    }[form]
    for t, g, b, d in zip(sky.t, sky.ghi, sky.dni, sky.dhi, strict=True):
        if form == "nsrdb":
            lines.append(f"{t.year},{t.month},{t.day},{t.hour},30,{b:.1f},{d:.1f},{g:.1f},25,1")
        elif form == "nasa":
            lines.append(f"{t.year},{t.month},{t.day},{t.hour},{g:.2f},{b:.2f},{d:.2f},25,1")
        else:
            light = ";".join(f"{x:.2f}".replace(".", ",") for x in (g, b, d))
            lines.append(f"{t:%Y-%m-%d %H}:00;{light}")
    return "\n".join(lines) + "\n"


@pytest.mark.parametrize(
    ("form", "stamp"), [("nsrdb", "middle"), ("nasa", "start"), ("semicolons", "start")]
)
def test_files_of_other_sources_are_read_as_csv(tmp_path: Path, form: str, stamp: str) -> None:
    sky = clear_hours(site(), "2023-05-01", "2023-05-06")
    (tmp_path / "w.csv").write_text(rows(sky, form))
    found = read(site(), tmp_path, kind="csv", file="w.csv", stamp=stamp)
    assert found.ghi == pytest.approx(sky.ghi, abs=0.06) and (found.t == sky.t).all()
    assert all("has no column of" in told for told in found.doubts)
    if form == "nsrdb":  # which names the middle of its hours, not their start
        late = read(site(), tmp_path, kind="csv", file="w.csv")
        assert "+30 min off the sun" in late.doubts[0] and "stamp" in late.doubts[0]


@pytest.mark.parametrize("zone", ["Etc/GMT+5", "America/Phoenix", "UTC"])
def test_the_times_of_nsrdb_are_in_the_zone_of_its_head(tmp_path: Path, zone: str) -> None:
    sky = clear_hours(site(), "2023-05-01", "2023-05-06")
    (tmp_path / "w.csv").write_text(rows(sky, "nsrdb"))
    found = read(site(timezone=zone), tmp_path, kind="csv", file="w.csv", stamp="middle")
    assert (found.t == sky.t).all() and str(found.t.tz) == zone
    (tmp_path / "w.csv").write_text(rows(sky, "nsrdb").replace("NSRDB,1,-7", "NSRDB,1,5.5"))
    with pytest.raises(ParameterError, match="check the time zone in the head of the file, longi"):
        read(site(timezone=zone), tmp_path, kind="csv", file="w.csv", stamp="middle")


@pytest.mark.parametrize(("clock", "ahead_h"), [("LST", -7), ("UTC", 0)])
@pytest.mark.parametrize("zone", ["America/Denver", "UTC"])
def test_the_times_of_nasa_power_are_of_the_clock_in_its_head(
    tmp_path: Path, zone: str, clock: str, ahead_h: int
) -> None:
    """Denver, at 104.9 deg west: local solar time is seven hours behind UTC, in summer, too."""
    place = site(latitude_deg=39.7, longitude_deg=-104.9, timezone=zone)
    sky = clear_hours(place, "2023-05-01", "2023-05-06")
    written = replace(sky, t=sky.t.tz_convert(timezone(timedelta(hours=ahead_h))))
    head = (
        f"Dates (month/day/year): 05/01/2023 through 05/06/2023 in {clock}\n"
        "Location: latitude  39.7   longitude -104.9\n"
    )
    text = rows(written, "nasa").replace("-END HEADER-", f"{head}-END HEADER-")
    (tmp_path / "w.csv").write_text(text)
    found = read(place, tmp_path, kind="csv", file="w.csv", stamp="start")
    assert (found.t == sky.t).all() and str(found.t.tz) == zone
    assert not any("off the sun" in told for told in found.doubts)


@pytest.mark.parametrize("form", ["nsrdb", "nasa"])
def test_the_place_in_the_head_of_a_file_is_that_of_the_site(tmp_path: Path, form: str) -> None:
    text = rows(clear_hours(site(), "2023-05-01", "2023-05-04"), form)
    of = {
        "nsrdb": ("Location ID,Time Zone\nNSRDB,1,", "Latitude,Longitude,Time Zone\nNSRDB,{},{},"),
        "nasa": ("hourly\n", "hourly\nLocation: Latitude  {}   Longitude {}\n"),
    }[form]
    stamp = {"nsrdb": "middle", "nasa": "start"}[form]
    (tmp_path / "w.csv").write_text(text.replace(of[0], of[1].format(33.5, -112.0)))
    assert len(read(site(), tmp_path, kind="csv", file="w.csv", stamp=stamp).t) == 72
    (tmp_path / "w.csv").write_text(text.replace(of[0], of[1].format(35.5, -112.0)))
    with pytest.raises(ParameterError, match=r"is for 35\.5 N -112 E, \[site\] is at"):
        read(site(), tmp_path, kind="csv", file="w.csv", stamp=stamp)


@pytest.mark.parametrize("kind", ["epw", "tmy3", "pvgis"])
def test_a_year_that_is_cut_off_is_told_and_a_whole_one_is_not(kind: str, tmp_path: Path) -> None:
    place, head = site(), {"epw": 8, "tmy3": 2, "pvgis": 6}[kind]
    if kind == "epw":
        epw(tmp_path / "w", clear_hours(place, "2023-01-01", "2024-01-01"))
    elif kind == "pvgis":
        pvgis_file(tmp_path / "w", place, tmy=True)
    else:
        place = greensboro()[1]
        source = Path(pvlib.__file__).parent / "data" / TMY3["file"].removeprefix("pvlib:")
        (tmp_path / "w").write_bytes(source.read_bytes())
    whole = read(place, tmp_path, kind=kind, file="w")
    assert len(whole.t) == 8760 and not any("cut off" in told for told in whole.doubts)
    lines = (tmp_path / "w").read_text().splitlines(keepends=True)
    (tmp_path / "w").write_text("".join(lines[: head + 24 * 250]))
    cut = read(place, tmp_path, kind=kind, file="w")
    assert any("w has 250 days" in told and "is it cut off?" in told for told in cut.doubts)
    assert cut.ghi == pytest.approx(whole.ghi[: 24 * 250]) and (cut.t == whole.t[: 24 * 250]).all()


def test_times_in_utc_without_an_offset_are_asked_about(tmp_path: Path) -> None:
    """And following the remedy is right."""
    sky = clear_hours(site(), "2023-05-01", "2023-05-06")
    utc = replace(sky, t=sky.t.tz_convert("UTC") - pd.Timedelta("30min"))
    lines = rows(utc, "semicolons")
    (tmp_path / "w.csv").write_text(lines)
    with pytest.raises(ParameterError, match=r"h off the sun.*; are the times in UTC\?"):
        read(site(), tmp_path, kind="csv", file="w.csv")
    (tmp_path / "w.csv").write_text(lines.replace(":00;", ":00+00:00;"))
    found = read(site(), tmp_path, kind="csv", file="w.csv")
    assert (found.t == sky.t).all() and found.t.tz == sky.t.tz


@pytest.mark.parametrize("hours", [-2, -1, 1, 2])
def test_stamps_of_another_zone_are_told_by_the_closure(tmp_path: Path, hours: int) -> None:
    """UTC that is read as a summer time is off by two hours."""
    sky = clear_hours(site(), "2023-06-01", "2023-06-06")
    (tmp_path / "w.csv").write_text(rows(sky, "nasa"))
    zone = site(timezone=f"Etc/GMT{7 + hours:+d}")
    found = read(zone, tmp_path, kind="csv", file="w.csv")
    off = re.match(r"the light is ([-+]\d+) min off the sun", found.doubts[0])
    assert off is not None and abs(int(off[1]) - 60 * hours) < 6
    assert not any("contradicts" in told for told in found.doubts)


def test_a_logger_that_keeps_summer_time_repeats_an_hour(tmp_path: Path) -> None:
    berlin = site(latitude_deg=52.0, longitude_deg=13.0, timezone="Europe/Berlin")
    sky = clear_hours(berlin, "2026-10-24", "2026-10-27")
    text = [
        f"{t - pd.Timedelta('30min'):%Y-%m-%d %H:%M},{g:.1f}"
        for t, g in zip(sky.t, sky.ghi, strict=True)
    ]
    (tmp_path / "w.csv").write_text("time,ghi\n" + "\n".join(text))
    found = read(berlin, tmp_path, kind="csv", file="w.csv")
    assert len(found.t) == 73 and (found.t == sky.t).all()


@pytest.mark.parametrize(
    ("name", "meant"),
    [("GMT+1", "Etc/GMT-1"), ("UTC-7", "Etc/GMT+7"), ("+02:00", "Etc/GMT-2"), ("gmt-0", "Etc/UTC")],
)
def test_hours_from_utc_name_the_clock_of_the_opposite_sign(name: str, meant: str) -> None:
    with pytest.raises(ParameterError, match=f"did you mean `{meant.replace('+', '.')}`"):
        site(timezone=name)
    assert site(timezone=meant, longitude_deg=0).timezone == meant


def test_only_columns_that_a_file_has_are_judged(tmp_path: Path) -> None:
    """Light of twilight within the limit of ghi, all of which is estimated as diffuse."""
    sky = clear_hours(site(), "2024-05-01", "2024-05-05")
    twilight = (sky.sun.zenith_deg > 90) & (sky.sun.zenith_deg < 93)
    ghi = np.where(twilight, 95.0, sky.ghi)
    frame = pd.DataFrame({"time": sky.t - pd.Timedelta("30min"), "ghi": ghi})
    frame["time"] = frame["time"].astype(str).str.replace(" ", "T")
    frame.to_csv(tmp_path / "w.csv", index=False)
    found = read(site(), tmp_path, kind="csv", file="w.csv")
    assert twilight.sum() == (found.dhi[twilight] > 50).sum() > 2  # its limit there
    assert all("has no column of" in told for told in found.doubts)
    assert "dhi is above" in " ".join(doubts(found, site(), components=True))  # were it read
