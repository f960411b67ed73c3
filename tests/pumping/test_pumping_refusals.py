"""Pumping systems that cannot be: one line each, which says what to change."""

import re
import tomllib
from datetime import date
from pathlib import Path

import pytest

from reluctance.base.errors import ParameterError
from reluctance.pumping import load_system, pump
from reluctance.pumping.site import Site
from reluctance.pumping.system import system_from

EXAMPLES = Path(__file__).parents[2] / "examples"


def data(**changes):
    found = tomllib.loads((EXAMPLES / "sun_day.toml").read_text())
    for name, value in changes.items():
        table, _, key = name.partition("__")
        if key:
            found.setdefault(table, {})[key] = value
        else:
            found[table] = value
    return found


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"arrays": {}}, "unknown table `arrays`; did you mean `array`?"),
        ({"site__lat": 7.0}, "unknown key `lat` in [site]"),
        ({"site__timezone": "Benin"}, "timezone = 'Benin' is unknown"),
        ({"site__timezone": "EAT"}, "'EAT' is unknown; need an IANA name"),
        ({"site__longitude_deg": 98.5}, "5.6 h apart, need at most 4 h; check the sign"),
        ({"site__timezone": "Pacific/Kiritimati"}, "h apart"),
        ({"drive": "none.toml"}, "cannot read"),
        ({"drive": 3}, "need the path of a drive file"),
        ({"pump": "none"}, "neither a file nor in the library"),
        ({"array__module": "Canadian_Solar_CS6X_300M"}, "nearest:"),
        ({"operation__kind": "dcdc"}, "needs efficiency"),
        ({"operation__u_V": 230.0}, "u_V has no effect"),
        ({"limits__u_max_V": 280.0}, "need at most [limits] u_max_V = 280"),
        ({"tank": {"volume_m3": 10.0}}, "[tank] has no effect without [demand]"),
        ({"demand": {"m3_per_day": 9.0, "from_h": 8.0, "to_h": 7.0}}, "is not before to_h"),
        ({"pipe__H_static_m": 60.0}, "lower the head or take another pump"),
        ({"drive": "single_pulse.toml"}, "cannot follow a torque"),
        ({"control": {"T_s_us": 50}}, "change it in sharing_cubic.toml, the file of the drive"),
        ({"site__latitude_deg": 85.0, "weather__start": date(2026, 12, 21)}, "dark"),
    ],
    ids=lambda value: "" if isinstance(value, str) else " ".join(value),
)
def test_a_system_that_cannot_be_is_refused_on_one_line(changes, message):
    with pytest.raises(ParameterError) as fault:
        pump(system_from(data(**changes), folder=EXAMPLES))
    assert message in str(fault.value) and "\n" not in str(fault.value)


def test_a_day_that_no_calendar_has_is_refused_with_its_remedy(tmp_path):
    text = (EXAMPLES / "sun_day.toml").read_text()
    path = tmp_path / "day.toml"
    path.write_text(re.sub("^start = [-0-9]+", "start = 2025-02-29", text, flags=re.M))
    with pytest.raises(ParameterError, match="need a day of the calendar, as in 2025-02-28"):
        load_system(path)


def test_a_day_with_points_is_answered_with_the_day_as_it_is_written(tmp_path):
    text = (EXAMPLES / "sun_day.toml").read_text()
    text = re.sub('"sharing_cubic.toml"', f'"{EXAMPLES / "sharing_cubic.toml"}"', text)
    path = tmp_path / "day.toml"
    path.write_text(re.sub("^start = [-0-9]+", "start = 5.06.2025  # summer", text, flags=re.M))
    with pytest.raises(ParameterError, match="; need a date as 2025-06-05") as fault:
        load_system(path)
    path.write_text(path.read_text().replace("5.06.2025", str(fault.value)[-10:]))
    assert str(load_system(path).weather.start) == "2025-06-05"


@pytest.mark.parametrize(
    ("longitude", "zone"),
    [(73.6, "Asia/Shanghai"), (-157.4, "Pacific/Kiritimati"), (179.0, "UTC"), (-8.7, "Etc/GMT-9")],
)
def test_zones_that_are_far_from_the_sun_but_in_use_pass(longitude, zone):
    place = Site(latitude_deg=0.0, longitude_deg=longitude, timezone=zone)
    assert place.longitude_deg == longitude


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("array.series", "did you mean `array.n_series`?"),
        ("tank.volume", "did you mean `tank.volume_m3`?"),
    ],
)
def test_a_mistyped_value_names_the_nearest(name, said):
    system = load_system(EXAMPLES / "sun_village.toml")
    with pytest.raises(ParameterError) as fault:
        system.with_values({name: 3})
    assert said in str(fault.value)
