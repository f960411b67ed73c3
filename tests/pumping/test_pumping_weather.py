"""Weather: pvlib's own sky and position, clouds that keep their means, faults on one line."""

from datetime import date
from pathlib import Path

import numpy as np
import pandas as pd
import pvlib
import pytest
from pvgis_file import pvgis_file

from reluctance.base.errors import ParameterError
from reluctance.base.schema import checked
from reluctance.pumping.clouds import HAZE
from reluctance.pumping.pvgis import pvgis_hours
from reluctance.pumping.site import Site, sun_over
from reluctance.pumping.weather_file import WeatherTable, clear_sky, read_weather, with_minutes

BENIN = {
    "latitude_deg": 7.18,
    "longitude_deg": 2.06,
    "altitude_m": 100.0,
    "timezone": "Africa/Porto-Novo",
}
GREENSBORO = {
    "latitude_deg": 36.1,
    "longitude_deg": -79.95,
    "altitude_m": 273.0,
    "timezone": "Etc/GMT+5",
}
CLEAR = {"kind": "clear", "start": date(2026, 3, 21)}
TMY3 = {"kind": "tmy3", "file": "pvlib:723170TYA.CSV", "year": 2026}


def site(**changes):
    return checked(Site, {**BENIN, **changes}, "[site]")


def table(**values):
    return checked(WeatherTable, values, "[weather]")


def read(where=None, folder=Path(), **values):
    return read_weather(table(**values), where or site(), folder)


def test_the_sun_between_the_knots_stands_where_pvlib_says():
    t = pd.date_range("2026-06-21", periods=1440, freq="1min", tz="Europe/Berlin")
    place = site(latitude_deg=52.0, longitude_deg=13.0)
    theirs = pvlib.solarposition.get_solarposition(t, 52.0, 13.0, 100.0)
    ours, up = sun_over(place, t), theirs["apparent_zenith"] < 85
    assert ours.zenith_deg[up] == pytest.approx(theirs["apparent_zenith"][up], abs=0.01)
    assert ours.azimuth_deg[up] == pytest.approx(theirs["azimuth"][up], abs=0.02)


@pytest.mark.filterwarnings("ignore")  # pvlib's, of pandas and of night
def test_the_clear_sky_is_that_of_pvlib():
    found = read(**CLEAR)
    place = pvlib.location.Location(7.18, 2.06, "Africa/Porto-Novo", 100.0)
    with np.errstate(all="ignore"):
        position = pvlib.solarposition.get_solarposition(found.t, 7.18, 2.06, 100.0)
        theirs = place.get_clearsky(
            found.t,
            linke_turbidity=3.0,
            solar_position=position,
        )
    for name in ("ghi", "dni", "dhi"):
        assert getattr(found, name) == pytest.approx(theirs[name].to_numpy(), abs=2.0)
    assert found.ghi.sum() == pytest.approx(theirs["ghi"].sum(), rel=1e-4)


def test_29_february_is_a_day_as_any_other():
    found = read(kind="clear", start=date(2024, 2, 28), days=3, step_min=60.0)
    assert [f"{t:%d %b}" for t in found.t[12::24]] == ["28 Feb", "29 Feb", "01 Mar"]
    assert found.ghi.reshape(3, 24).sum(axis=1) == pytest.approx(found.ghi.sum() / 3, rel=0.02)


@pytest.mark.parametrize(("step_min", "first"), [(1.0, 0), (5.0, 0), (10.0, 5), (60.0, 30)])
def test_a_clear_sky_has_the_middles_of_intervals_from_ten_minutes_on(step_min, first):
    start = read(**CLEAR, step_min=step_min).t[0]
    assert (start.hour, start.minute) == (0, first)


def test_a_day_of_a_summer_time_change_has_its_own_length():
    berlin = site(latitude_deg=52.0, longitude_deg=13.0, timezone="Europe/Berlin")
    assert len(read(berlin, kind="clear", start=date(2026, 3, 29), step_min=60.0).t) == 23


def test_a_typical_year_has_middles_of_its_hours():
    found = read(checked(Site, GREENSBORO, "[site]"), **TMY3)
    assert len(found.t) == 8760 and found.step == 3600
    assert str(found.t[0]) == "2026-01-01 00:30:00-05:00"
    assert str(found.t[-1]) == "2026-12-31 23:30:00-05:00"


def test_clouds_repeat_with_their_seed_and_leave_the_share_they_state():
    weather = [
        read(**CLEAR, clouds={"seed": seed, "clear_min": 6.0, "cloud_min": 3.0, "cover": 0.1})
        for seed in (1, 1, 2)
    ]
    assert np.array_equal(weather[0].ghi, weather[1].ghi)
    assert not np.array_equal(weather[0].ghi, weather[2].ghi)
    year = read(
        kind="clear",
        start=date(2026, 3, 21),
        days=60,
        clouds={"clear_min": 6.0, "cloud_min": 3.0, "cover": 0.1},
    )
    clear = read(kind="clear", start=date(2026, 3, 21), days=60)
    expected = (6 * 1.0 + 3 * 0.1) / 9  # of a two-state chain in equilibrium
    assert year.ghi.sum() / clear.ghi.sum() == pytest.approx(expected, abs=0.02)
    height = clear.sun.height
    assert year.ghi == pytest.approx(year.dhi + year.dni * height, abs=8)


def test_generated_minutes_keep_the_global_light_of_every_hour():
    place = checked(Site, GREENSBORO, "[site]")
    settings = table(**TMY3, generate_minutes=True)
    hours = read_weather(settings, place, Path())
    minutes = with_minutes(hours, settings, place, seed=1)
    assert len(minutes.t) == 525_600 and minutes.step == 60
    means = minutes.ghi.reshape(-1, 60).mean(axis=1)
    assert means == pytest.approx(np.maximum(hours.ghi, 0), abs=1e-6)
    assert np.all(minutes.dni <= HAZE * clear_sky(minutes.t, 60.0, place, settings).dni + 1e-9)
    assert np.all(minutes.dni >= 0) and np.all(minutes.dhi >= 0)
    assert minutes.t[0] == hours.t[0] - pd.Timedelta("29min30s")
    for name in ("temp_air", "wind_speed"):  # straight lines between the middles of the hours
        straight = np.interp(minutes.t.asi8, hours.t.asi8, getattr(hours, name))
        np.testing.assert_allclose(getattr(minutes, name), straight)
    still = minutes.ghi.reshape(-1, 60)[hours.ghi <= 0]
    assert not still.any()  # no light in the night


def sunny(start="2026-05-01", days=2, freq="1h", zone="Africa/Porto-Novo"):
    """An hourly file of the clear sky at the site."""
    t = pd.date_range(start, periods=24 * days, freq=freq, tz=zone)
    found = read(kind="clear", start=date(2026, 5, 1), days=days, step_min=60.0)
    columns = {n: getattr(found, n) for n in ("ghi", "dni", "dhi", "temp_air", "wind_speed")}
    return pd.DataFrame({"time": t.tz_localize(None).astype(str), **columns})


def written(tmp_path, frame):
    frame.to_csv(tmp_path / "w.csv", index=False)
    return {"kind": "csv", "file": "w.csv", "folder": tmp_path}


def test_a_csv_file_gives_back_what_was_written(tmp_path):
    frame = sunny()
    found = read(**written(tmp_path, frame))
    assert found.ghi == pytest.approx(frame["ghi"].to_numpy())
    assert str(found.t[0]) == "2026-05-01 00:30:00+01:00"


@pytest.mark.parametrize(
    ("stamp", "first"), [("start", "00:30"), ("middle", "00:00"), ("end", "23:30")]
)
def test_an_hour_has_its_middle_by_what_its_stamp_names(tmp_path, stamp, first):
    found = read(**written(tmp_path, sunny()), stamp=stamp)
    assert f"{found.t[0]:%H:%M}" == first and found.stamps[0].hour == 0
    assert (np.diff(found.t) == np.timedelta64(1, "h")).all()


def test_a_temperature_and_a_wind_that_a_file_has_not_are_told_with_their_values(tmp_path):
    given = written(tmp_path, sunny()[["time", "ghi"]])
    warm, windy = read(**given).doubts[:2]
    assert "no column of temp_air: 25 degC is taken" in warm and "temp_air_degC" in warm
    assert "no column of wind_speed: 1 m/s is taken" in windy and "wind_mps" in windy
    stated = {"temp_air_degC": 31.0, "wind_mps": 2.0}
    found = read(**given, **stated)
    assert found.temp_air[0] == 31 and not any("no column" in told for told in found.doubts)
    whole = written(tmp_path, sunny())
    assert not any("no column" in told for told in read(**whole).doubts)
    for key, value in stated.items():
        with pytest.raises(ParameterError, match=f"{key} has no effect; remove it"):
            read(**whole, **{key: value})


def test_direct_light_is_estimated_where_a_file_has_only_the_global(tmp_path):
    frame = sunny()
    found = read(**written(tmp_path, frame[["time", "ghi"]]))
    assert found.ghi == pytest.approx(found.dhi + found.dni * found.sun.height, abs=2)
    assert found.dni.sum() == pytest.approx(frame["dni"].sum(), rel=0.25)


def test_an_epw_file_is_read_with_the_middles_of_its_hours(tmp_path):
    frame = sunny()
    lines = ["LOCATION,Here,,BEN,test,0,7.18,2.06,1.0,100.0", *["HEADER"] * 7]
    for k, row in frame.iterrows():
        fields = ["0"] * 35
        fields[:5] = ["2005", "5", str(1 + k // 24), str(1 + k % 24), "60"]
        fields[5] = "?9?9"
        fields[6], fields[21] = f"{row.temp_air:g}", f"{row.wind_speed:g}"
        fields[13:16] = [f"{row[name]:.6f}" for name in ("ghi", "dni", "dhi")]
        lines.append(",".join(fields))
    (tmp_path / "w.epw").write_text("\n".join(lines) + "\n")
    found = read(kind="epw", file="w.epw", year=2026, folder=tmp_path)
    assert str(found.t[0]) == "2026-05-01 00:30:00+01:00" and len(found.t) == 48
    for name in ("ghi", "dni", "dhi", "temp_air", "wind_speed"):
        assert getattr(found, name) == pytest.approx(frame[name].to_numpy(), abs=1e-5)


def test_times_with_an_offset_are_taken_at_their_word(tmp_path):
    frame = sunny()
    frame["time"] = frame["time"] + "+01:00"
    found = read(site(timezone="Etc/UTC"), **written(tmp_path, frame))
    assert str(found.t[0]) == "2026-04-30 23:30:00+00:00"


def without(frame, rows):
    return frame.drop(index=rows)


FILES = [
    (lambda f: without(f, [10, 11]), "a gap from 2026-05-01 09:00:00+01:00 to 2026-05-01 12:00:00"),
    (lambda f: pd.concat([f[:20], f[19:]]), "one time twice from 2026-05-01 19:00:00+01:00 to"),
    (lambda f: f[::-1], "(47 such places), need a row every 3600 s; sort the rows by their time"),
    (
        lambda f: f.assign(ghi=f["ghi"].where(f.index != 30)),
        "or no number, at 2026-05-02 06:00",
    ),
    (lambda f: f.assign(ghi=3 * f["ghi"]), "need -20 to 1800"),
    (lambda f: f.assign(ghi=0.0), "night only"),
    (lambda f: f[0:5], "night only"),
    (lambda f: f[:1], "need at least 2"),
    (lambda f: f.drop(columns="time"), "need a column `time`"),
    (lambda f: f.drop(columns="ghi"), "need time, ghi"),
    (lambda f: f.drop(columns="dhi"), "both or none of dni and dhi"),
    (lambda f: f.assign(time=["no"] * len(f)), "need a column `time`"),
]


@pytest.mark.parametrize(("change", "message"), FILES, ids=[m for _, m in FILES])
def test_a_file_that_cannot_be_used_is_refused_on_one_line(tmp_path, change, message):
    with pytest.raises(ParameterError) as fault:
        read(**written(tmp_path, change(sunny())))
    assert message in str(fault.value) and "\n" not in str(fault.value)


@pytest.mark.parametrize("stamp", ["start", "middle", "end"])
def test_a_message_has_the_time_of_the_row_in_the_file(tmp_path, stamp):
    frame = sunny()
    frame["time"] = pd.to_datetime(frame["time"]) + {
        "start": pd.Timedelta(0), "middle": pd.Timedelta("30min"), "end": pd.Timedelta("1h"),
    }[stamp]  # fmt: skip
    for name, value in (("ghi", np.nan), ("ghi", 1700.0), ("temp_air", 99.9)):
        wrong = frame.copy()
        wrong.loc[31:33, name] = value
        given = written(tmp_path, wrong)
        row = str(wrong["time"][31])
        if value == 1700.0:
            (told,) = (d for d in read(**given, stamp=stamp).doubts if "physically possible" in d)
        else:
            with pytest.raises(ParameterError) as fault:
                read(**given, stamp=stamp)
            told = str(fault.value)
        assert f" at {row}+01:00" in told, told


@pytest.mark.parametrize(
    ("name", "marks"),
    [
        ("temp_air", [99.9, -99.9, -99, -999, 999, -9999]),  # EPW: 99.9 of the dry bulb
        ("wind_speed", [999, 99.9, -9.9, 999.9, -999, -99]),  # EPW: 999
        ("ghi", [9999, -9900, -9999, -999]),  # EPW: 9999; TMY3: -9900
        ("dni", [9999, -9900]),
    ],
)
def test_marks_of_missing_values_are_told_from_values_that_cannot_be(tmp_path, name, marks):
    """Of EPW (EnergyPlus, Auxiliary Programs), TMY3 (NREL TP-581-43156) and loggers."""
    for value in (*marks, 5000, -95):
        frame = sunny()
        frame.loc[12, name] = value
        with pytest.raises(ParameterError, match=f"{name} = {value:g} at .*1 of 48") as fault:
            read(**written(tmp_path, frame))
        assert ("marks a missing value" in str(fault.value)) == (value in marks)


def test_a_file_is_for_places_within_a_degree():
    """A degree of latitude is 111 km."""
    place = {key: GREENSBORO[key] for key in ("latitude_deg", "longitude_deg")}
    near = {key: value + 0.95 for key, value in place.items()}
    assert len(read(checked(Site, {**GREENSBORO, **near}, "[site]"), **TMY3).t) == 8760
    for key, value in place.items():
        for off in (-1.02, 1.02):
            where = checked(Site, {**GREENSBORO, key: value + off}, "[site]")
            with pytest.raises(ParameterError, match="set latitude_deg and longitude_deg"):
                read(where, **TMY3)


@pytest.mark.parametrize("columns", [["ghi"], ["ghi", "dni", "dhi"]])
def test_light_in_kilowatts_is_asked_for_its_unit_and_the_remedy_works(tmp_path, columns):
    frame = sunny()[["time", *columns]]
    kilo = frame.assign(**{name: (frame[name] / 1000).round(3) for name in columns})
    with pytest.raises(ParameterError) as fault:
        read(**written(tmp_path, kilo))
    line = str(fault.value)
    assert "is its unit kW/m2?" in line and "1000 times as much" in line and "\n" not in line
    mended = kilo.assign(**{name: 1000 * kilo[name] for name in columns})
    assert read(**written(tmp_path, mended)).ghi == pytest.approx(frame["ghi"], abs=0.51)


@pytest.mark.parametrize(
    ("name", "factor", "todo"),
    [
        ("ghi [kW/m2]", 1e-3, "multiply its numbers by 1000"),
        ("ghi [J/cm2]", 0.36, "by 2.778 for an hour"),
        ("GHI (Wh/m2)", 1.0, "divide its sums by the hours of an interval"),
        ("ghi [MJ/m²]", 3.6e-3, "by 277.8 for an hour"),
    ],
)
@pytest.mark.parametrize("above", ["", "Station 12\n"])
def test_another_unit_of_light_is_told_first_and_its_remedy_works(
    tmp_path, name, factor, todo, above
):
    frame = sunny()[["time", "ghi"]]
    other = frame.assign(ghi=factor * frame["ghi"]).rename(columns={"ghi": name})
    (tmp_path / "w.csv").write_text(above + other.to_csv(index=False))
    given = {"kind": "csv", "file": "w.csv", "folder": tmp_path}
    with pytest.raises(ParameterError) as fault:
        read(**given)
    line = str(fault.value)
    assert f"w.csv: column `{name}` has the unit" in line and "time" not in line
    assert line.endswith("and name it W/m2") and todo in line
    mended = other.rename(columns={name: "ghi [W/m2]"}).assign(**{"ghi [W/m2]": frame["ghi"]})
    assert len(read(**written(tmp_path, mended)).ghi) == 48
    mended = mended.rename(columns={"ghi [W/m2]": "ghi [W/m²]"})
    assert len(read(**written(tmp_path, mended)).ghi) == 48


@pytest.mark.parametrize(
    "above",
    ["", "Logger X12;Station 4\n", "Logger X12;Station 4;;\n\n", "Logger;4\nHeight;200\nA;7,5\n"],
)
@pytest.mark.parametrize("units", ["", ";;W/m2;C\n"])
def test_names_in_another_language_are_told_as_the_columns_and_no_title(tmp_path, above, units):
    names = "Datum;Zeit;Globalstrahlung [W/m²];Lufttemperatur"
    rows = "".join(f"01.05.2026;{hour:02}:00;{hour},5;20,1\n" for hour in range(24))
    (tmp_path / "w.csv").write_text(f"{above}{names}\n{units}{rows}")
    with pytest.raises(ParameterError) as fault:
        read(kind="csv", file="w.csv", folder=tmp_path)
    assert f"columns {names.replace(';', ', ')};" in str(fault.value)
    assert "Logger" not in str(fault.value)


def test_decimal_commas_between_commas_are_told_as_such(tmp_path):
    frame = sunny()[["time", "ghi"]].round(1)
    parted = "time,ghi\n" + "".join(f"{t},{g}\n".replace(".", ",") for t, g in frame.to_numpy())
    quoted = frame.to_csv(index=False, decimal=",", quoting=1)
    for text, told in (
        (parted, "has 3 cells for 2 names: commas stand in its numbers and between them"),
        (quoted, "ghi = `0,0` at 2026-05-01 00:00:00+01:00 is not a number; write a decimal point"),
    ):
        (tmp_path / "w.csv").write_text(text)
        with pytest.raises(ParameterError) as fault:
            read(kind="csv", file="w.csv", folder=tmp_path)
        assert told in str(fault.value)
    (tmp_path / "w.csv").write_text(frame.to_csv(index=False, sep=";", decimal=","))
    assert len(read(kind="csv", file="w.csv", folder=tmp_path).ghi) == 48


def test_cells_in_quotes_after_a_blank_are_read_as_without(tmp_path):
    frame = sunny()[["time", "ghi"]]
    (tmp_path / "w.csv").write_text(frame.to_csv(index=False, quoting=1).replace(",", ", "))
    found = read(kind="csv", file="w.csv", folder=tmp_path)
    assert found.ghi == pytest.approx(read(**written(tmp_path, frame)).ghi)


@pytest.mark.parametrize(
    ("form", "days", "right"),
    [
        ("%d/%m/%Y %H:%M", 2, "2026-05-01 or 2026-01-05, whichever it is"),
        ("%d/%m/%Y %H:%M", 12, "2026-05-01 or 2026-01-05, whichever it is"),
        ("%d/%m/%Y %H:%M", 13, "write 2026-05-01"),
        ("%m/%d/%Y %H:%M", 13, "write 2026-05-01"),
    ],
)
def test_days_with_slashes_are_answered_with_the_day_to_write(tmp_path, form, days, right):
    frame = sunny(days=days)
    frame["time"] = pd.to_datetime(frame["time"]).dt.strftime(form)
    with pytest.raises(ParameterError) as fault:
        read(**written(tmp_path, frame))
    assert str(fault.value).endswith(right) and "has slashes" in str(fault.value)


def test_an_offset_of_a_sensor_is_no_light_in_kilowatts(tmp_path):
    with pytest.raises(ParameterError, match="night only"):
        read(**written(tmp_path, sunny()[["time", "ghi"]].assign(ghi=0.9)))


@pytest.mark.parametrize("zone", ["Asia/Dubai", "America/Sao_Paulo", "Etc/GMT-9"])
def test_weather_in_a_wrong_zone_is_refused_on_one_line(tmp_path, zone):
    with pytest.raises(ParameterError, match=r"h off the sun at 7\.18 N 2\.06 E"):
        read(site(timezone=zone), **written(tmp_path, sunny()))


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"kind": "clear"}, "needs start"),
        ({"kind": "csv"}, "needs file"),
        ({"kind": "csv", "file": "x.csv", "year": 2020}, "year has no effect with kind = 'csv'"),
        ({"kind": "csv", "file": "x.csv", "seed": 2}, "seed has no effect without generate_min"),
        ({**TMY3, "linke_turbidity": 5.0}, "linke_turbidity has no effect without generate_min"),
        ({**TMY3, "stamp": "end"}, "stamp has no effect with kind = 'tmy3'"),
        ({**TMY3, "temp_air_degC": 30.0}, "temp_air_degC has no effect with kind = 'tmy3'"),
        ({**CLEAR, "file": "x.csv"}, "file has no effect with kind = 'clear'"),
        ({**TMY3, "days": 3}, "days has no effect"),
        ({**TMY3, "year": 2024}, "29 February, which a typical year has not; take 2023"),
        ({**TMY3, "file": "pvlib:none.csv"}, "no such file"),
        ({"kind": "epw", "file": "pvlib:723170TYA.CSV"}, "set [weather] kind = 'tmy3'"),
        ({"kind": "tmy3", "file": "pvlib:12839.tm2"}, "cannot be read as a TMY3 file"),
        (TMY3, "is for 36.1 N -79.95 E, [site] is at 7.18 N"),
    ],
)
def test_a_weather_table_that_cannot_be_is_refused_on_one_line(values, message):
    with pytest.raises(ParameterError) as fault:
        read(**values)
    assert message in str(fault.value) and "\n" not in str(fault.value)


@pytest.mark.parametrize(
    ("zone", "message"), [("Africa/Porto-Nove", "did you mean"), ("", "unknown")]
)
def test_an_unknown_timezone_is_refused(zone, message):
    with pytest.raises(ParameterError, match=message):
        site(timezone=zone)


@pytest.mark.parametrize("minute", [10, 30])
@pytest.mark.parametrize("tmy", [True, False])
def test_a_file_of_pvgis_gives_the_weather_that_it_was_written_from(tmp_path, tmy, minute):
    place = Site(latitude_deg=7.18, longitude_deg=2.06, altitude_m=100.0, timezone="UTC")
    sky = pvgis_file(tmp_path / "p.csv", place, tmy=tmy, minute=minute)
    table = WeatherTable(kind="pvgis", file="p.csv", year=2019)
    found = read_weather(table, place, tmp_path)
    assert found.ghi == pytest.approx(sky.ghi, abs=0.02) and found.step == 3600
    high = sky.sun.zenith_deg < 80
    assert found.dni[high] == pytest.approx(sky.dni[high], rel=2e-3)
    assert (found.t == sky.t).all() and set(found.temp_air) == {28.0}
    assert found.doubts == ()
    if not tmy:  # of a plane's direct light none is inferred where the sun stands on the horizon
        low = sky.sun.zenith_deg > 89
        assert low.sum() > 4000 and not found.dni[low].any() and found.dni.max() <= 1200


@pytest.mark.parametrize("minute", [10, 30])
@pytest.mark.parametrize("tmy", [True, False])
def test_a_message_on_a_file_of_pvgis_has_the_time_of_its_row(tmp_path, tmy, minute):
    place = Site(latitude_deg=7.18, longitude_deg=2.06, altitude_m=100.0, timezone="UTC")
    path = tmp_path / "p.csv"
    pvgis_file(path, place, tmy=tmy, minute=minute)
    lines = path.read_text().splitlines()
    n = next(n for n, line in enumerate(lines) if "0301:12" in line)
    path.write_text("\n".join([*lines[:n], lines[n].replace(",28,", ",99.9,"), *lines[n + 1 :]]))
    with pytest.raises(ParameterError) as fault:
        read_weather(WeatherTable(kind="pvgis", file="p.csv", year=2019), place, tmp_path)
    stamp = "12:00" if tmy else f"12:{minute}"
    assert "temp_air" in str(fault.value) and f"2019-03-01 {stamp}:00" in str(fault.value)


def test_a_file_of_pvgis_is_named_where_another_kind_was_said_and_a_tilted_one_is_refused(tmp_path):
    place = Site(latitude_deg=7.18, longitude_deg=2.06, altitude_m=100.0, timezone="UTC")
    pvgis_file(tmp_path / "p.csv", place, tmy=False, slope=15)
    for kind, message in (("csv", "set [weather] kind = 'pvgis'"), ("pvgis", "with slope 0")):
        with pytest.raises(ParameterError) as fault:
            read_weather(WeatherTable(kind=kind, file="p.csv"), place, tmp_path)
        assert message in str(fault.value)


@pytest.mark.parametrize("column", ["T2m", "G(h)", "WS10m"])
def test_a_file_of_pvgis_without_a_column_is_told_which(tmp_path, column):
    place = Site(latitude_deg=7.18, longitude_deg=2.06, altitude_m=100.0, timezone="UTC")
    pvgis_file(tmp_path / "p.csv", place, tmy=True)
    text = (tmp_path / "p.csv").read_text()
    (tmp_path / "p.csv").write_text(text.replace(f",{column},", ",other,"))
    with pytest.raises(ParameterError, match=r"missing .*; download `TMY`, or `hourly data`"):
        read_weather(WeatherTable(kind="pvgis", file="p.csv", year=2019), place, tmp_path)


@pytest.mark.parametrize("rows", [8759, 8760])
def test_a_file_as_long_as_a_typical_year_is_one_also_where_its_years_are_in_order(tmp_path, rows):
    """A shorter one with two years in order is a part of both."""
    t = pd.date_range("2018-07-01", periods=rows, freq="h")
    text = "Latitude (decimal degrees): 7.18\nLongitude (decimal degrees): 2.06\n"
    text += "time(UTC),T2m,G(h),Gb(n),Gd(h),WS10m\n"
    stamps = t.strftime("%Y%m%d:%H%M")
    (tmp_path / "p.csv").write_text(text + "".join(f"{stamp},28,0,0,0,2\n" for stamp in stamps))
    frame, place = pvgis_hours(tmp_path / "p.csv", 2026)
    assert place == {"latitude": 7.18, "longitude": 2.06} and len(frame) == rows
    assert [*frame.index.year.unique()] == ([2026] if rows == 8760 else [2018, 2019])


def hours_of_two_days():
    t = pd.date_range("2026-03-01", periods=48, freq="h")
    light = np.maximum(0.0, 900 * np.sin((t.hour - 5.5) / 12 * np.pi)).round(1)
    return pd.DataFrame({"t": t, "ghi": light, "air": 25.0 + t.hour / 10, "wind": 3.6})


@pytest.mark.parametrize(("unit", "in_mps"), [("km/h", 3.6), ("kmh", 3.6), ("m/s", 1), ("mps", 1)])
def test_a_loggers_day_and_time_with_its_units_are_the_same_weather(unit, in_mps, tmp_path):
    """A day with points, the time beside it, units of wind, and lines above the names."""
    rows = [*hours_of_two_days().itertuples(index=False)]
    plain = "time,ghi,temp_air,wind_speed\n" + "".join(
        f"{t:%Y-%m-%d %H:%M},{ghi},{air},{wind}\n" for t, ghi, air, wind in rows
    )
    logged = f"Station 12\nDate;Time;GHI [W/m2];Tair [C];Wind [{unit}]\n" + "".join(
        f"{t:%d.%m.%Y};{t:%H:%M};{ghi};{air};{in_mps * wind:.6f}\n" for t, ghi, air, wind in rows
    )
    for name, text in (("plain.csv", plain), ("logged.csv", logged)):
        (tmp_path / name).write_text(text)
    one, other = (read(folder=tmp_path, kind="csv", file=f"{n}.csv") for n in ("plain", "logged"))
    assert (one.t == other.t).all()
    for name in ("ghi", "dni", "dhi", "temp_air", "wind_speed"):
        assert getattr(one, name) == pytest.approx(getattr(other, name), rel=1e-9), name


@pytest.mark.parametrize("kind", ["epw", "tmy3", "pvgis"])
def test_a_file_of_another_kind_is_answered_with_its_kind(tmp_path, kind):
    rows = [*hours_of_two_days().itertuples(index=False)]
    (tmp_path / "w.csv").write_text(
        "time,ghi\n" + "".join(f"{t:%Y-%m-%d %H:%M},{ghi}\n" for t, ghi, *_ in rows)
    )
    with pytest.raises(ParameterError, match=r"set \[weather\] kind = 'csv'$"):
        read(folder=tmp_path, kind=kind, file="w.csv")
    read(folder=tmp_path, kind="csv", file="w.csv")
    with pytest.raises(ParameterError, match=r"set \[weather\] kind = 'tmy3'$"):
        read(kind="csv", file=TMY3["file"])
