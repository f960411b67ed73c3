"""Figures of pumping: sums of the samples, units that fit their names, and how sizes are chosen."""

import re
from dataclasses import fields, replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from matplotlib.dates import date2num
from matplotlib.figure import Figure

from reluctance.base.errors import ParameterError
from reluctance.plant.hydraulics.pump import Pump
from reluctance.plant.solar.pv_module import CellNumbers
from reluctance.plant.solar.single_diode import power_point
from reluctance.pumping import (
    Samples,
    chain,
    columns,
    load_system,
    per,
    plots,
    pump,
    remarks,
    report,
    with_units,
)
from reluctance.pumping import loss_map as maps
from reluctance.pumping.clouds import Clouds
from reluctance.pumping.matching import Limit
from reluctance.pumping.sizing import figure, meets, parsed, sizes, smallest, usual, write_sizes
from reluctance.pumping.system import TABLES
from reluctance.pumping.text import LABELS, number, rows, size_table

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "examples"
WRITTEN = {
    "m3": "m³",
    "m3ph": "m³/h",
    "kWh_m2": "kWh/m²",
    "m3_per_kWp": "m³/kWp",
    "m3_per_day": "m³",
}


@pytest.fixture(scope="module")
def found():
    """The reference day, five minutes a sample, with a demand that a small tank cannot meet."""
    values = {"weather.step_min": 5.0, "array.blocking_diode_V": 0.5}
    system = load_system(EXAMPLES / "sun_day.toml").with_values(values)
    system = system.with_table("demand", {"m3_per_day": 400.0})
    return pump(system.with_table("tank", {"volume_m3": 50.0}))


@pytest.fixture(scope="module")
def village():
    return load_system(EXAMPLES / "sun_village.toml")


def test_every_figure_is_a_sum_or_an_extreme_of_the_samples(found):
    """From the columns of the samples, which are in the units of the figures."""
    s, f, hours = columns(found), with_units(found), 5 / 60
    on = s["speed_rpm"] > 0
    kwh = {name: s[name].sum() * hours / 1e3 for name in s if name.endswith("_W")}
    expected = {
        "water_m3": s["Q_m3ph"].sum() * hours,
        "water_m3_per_day": s["Q_m3ph"].sum() * hours,
        "water_m3_per_kWp": s["Q_m3ph"].sum() * hours / f["array_kWp"],
        "pumping_h": on.sum() * hours,
        "days": 1.0,
        "step_min": 5.0,
        "array_kWp": 42 * 0.3,  # of 300 Wp
        "poa_kWh_m2": s["poa_global"].sum() * hours / 1e3,
        "poa_effective_kWh_m2": s["poa_effective"].sum() * hours / 1e3,
        "e_mp_kWh": kwh["p_mp_W"],
        "e_in_kWh": kwh["p_in_W"],
        "e_shaft_kWh": kwh["p_shaft_W"],
        "e_lift_kWh": s["Q_m3ph"].sum() * hours * 15 * 998.2 * 9.80665 / 3.6e6,
        "used_of_mp": kwh["p_in_W"] / kwh["p_mp_W"],
        "eta_motor": kwh["p_shaft_W"] / kwh["p_in_W"],
        "eta_pump": kwh["p_hyd_W"] / kwh["p_shaft_W"],
        "lost_pump_kWh": kwh["p_shaft_W"] - kwh["p_hyd_W"],
        "speed_max_rpm": s["speed_rpm"].max(),
        "Q_max_m3ph": s["Q_m3ph"].max(),
        "demand_m3": 400.0,
        "missing_m3": s["missing_m3"].sum(),
        "overflow_m3": s["overflow_m3"].sum(),
        "level_end_m3": s["level_m3"][-1],
        "level_start_m3": s["level_m3"][-1],  # the days repeat
        "loss_of_load_probability": s["missing_m3"].sum() / 400,
    }
    assert {key: f[key] for key in expected} == pytest.approx(expected, rel=2e-3)
    assert f["eta"] == pytest.approx(f["e_lift_kWh"] / f["e_mp_kWh"])
    c = chain(found)
    assert c.e_sun == pytest.approx(f["poa_kWh_m2"] * f["array_kWp"] * 3.6e6)
    assert c.off_mpp == pytest.approx(0.5 * s["i_A"].sum() * 300)  # in the diode
    assert c.overflow == pytest.approx(c.e_lift * f["overflow_m3"] / f["water_m3"])


def test_sums_by_day_are_the_figures_of_the_day(found):
    f = with_units(found)
    (day,) = per(found, "D").to_dict("records")
    assert day == pytest.approx({key: f[key] for key in day})
    assert {"water_m3", "pumping_h", "demand_m3", "overflow_m3"} <= day.keys()


def test_every_figure_is_shown_in_the_unit_that_ends_its_name(found):
    f = with_units(found)
    for key, (label, unit) in LABELS.items():
        ends = [
            end for end in (*WRITTEN, "kWh", "kWp", "rpm", "V", "h", "degC") if key.endswith(end)
        ]
        end = max(ends, key=len, default=None)
        assert unit == (WRITTEN.get(end, end) if end else "" if key == "days" else "%"), key
        shown = dict(rows(f | {key: 0.25}))[label].split(" ")
        assert shown == ["25" if unit == "%" else "0.25", *([unit] if unit else [])]


def test_a_limit_that_was_never_reached_and_a_figure_without_meaning_have_no_row(found):
    names = {LABELS[key][0] for key in ("limited_well_h", "limited_speed_h", "demand_m3")}
    shown = dict(
        rows(
            with_units(found)
            | {"limited_well_h": 0.0, "limited_h": 0.0}
            | {"limited_speed_h": 1.5, "demand_m3": None}
        )
    )
    assert names & shown.keys() == {"  of the speed"} and shown["at a limit"] == "0 h"


@pytest.mark.parametrize(
    ("value", "text"),
    [(1234.56, "1235"), (9999.0, "9999"), (10000.0, "10000"), (123456.7, "123457"),
     (-12345.6, "-12346"), (0.012346, "0.01235"), (float("nan"), "-")],
)  # fmt: skip
def test_numbers_have_four_digits_and_no_exponent(value, text):
    assert number(value) == text


def test_defaults_of_a_system_file_are_those_of_the_page():
    """`key` (default) in the last table of the page."""
    page = (ROOT / "docs" / "pumping.md").read_text(encoding="utf-8")
    said = page.partition("## Every key of a system file")[2]
    sections = [*TABLES.values(), Clouds, CellNumbers, Pump]
    known = {key: field for part in sections for key, field in part.model_fields.items()}
    told = dict(re.findall(r"`(\w+)` \(([-\w.]+)", said))
    for key in ("linke_turbidity", "seed", "step_min", "azimuth_deg", "nu_m2ps", "from_h", "kind"):
        assert key in told
    for key in told.keys() & known.keys():
        default = known[key].default
        if isinstance(default, float) or type(default) is int:
            assert float(told[key]) == default, key
        elif isinstance(default, bool | str) and key != "name":
            assert told[key] == f"{default}".lower(), key


NOT_IN_NATURE = [
    ("site", {"latitude_deg": 90.1}), ("site", {"latitude_deg": -90.1}),
    ("site", {"longitude_deg": 180.1}), ("site", {"longitude_deg": -180.1}),
    ("site", {"altitude_m": 9500.0}), ("site", {"altitude_m": -501.0}),
    ("array", {"n_series": 0}), ("array", {"n_parallel": 0}), ("array", {"tilt_deg": -0.1}),
    ("array", {"tilt_deg": 90.5}), ("array", {"azimuth_deg": -0.5}),
    ("array", {"azimuth_deg": 360.5}), ("array", {"soiling": -0.01}), ("array", {"soiling": 1.0}),
    ("array", {"blocking_diode_V": -0.1}), ("operation", {"kind": "fraction", "fraction": 1.0}),
    ("operation", {"kind": "dcdc", "u_V": 300.0, "efficiency": 1.01}),
    ("operation", {"kind": "constant", "u_V": 0.0}), ("pipe", {"H_static_m": -0.1}),
    ("pipe", {"L_m": -0.1}), ("pipe", {"D_mm": 0.0}), ("pipe", {"K": -0.1}),
    ("pipe", {"roughness_mm": -0.01}), ("pipe", {"nu_m2ps": 0.0}),
    ("pipe", {"well_yield_m3ph": 0.0}), ("tank", {"volume_m3": -0.1}),
    ("tank", {"start_m3": 41.0}), ("demand", {"m3_per_day": 0.0}), ("demand", {"from_h": -0.1}),
    ("demand", {"from_h": 24.0}), ("demand", {"to_h": 24.1}), ("demand", {"to_h": 6.0}),
    ("limits", {"tau_max_Nm": 0.0}), ("limits", {"u_max_V": 0.0}),
    ("weather", {"days": 0}), ("weather", {"step_min": 0.0}), ("weather", {"step_min": 60.5}),
    ("weather", {"wind_mps": -0.1}), ("weather", {"linke_turbidity": 1.0}),
]  # fmt: skip
AT_THE_EDGE = [
    ("site", {"latitude_deg": 90.0}), ("site", {"latitude_deg": -90.0}),
    ("site", {"longitude_deg": 180.0, "timezone": "Etc/GMT-12"}),
    ("site", {"longitude_deg": -180.0, "timezone": "Etc/GMT+12"}),
    ("array", {"n_series": 1}), ("array", {"n_parallel": 1}), ("array", {"tilt_deg": 0.0}),
    ("array", {"tilt_deg": 90.0}), ("array", {"azimuth_deg": 0.0}),
    ("array", {"azimuth_deg": 360.0}), ("array", {"soiling": 0.0}),
    ("array", {"blocking_diode_V": 0.0}), ("pipe", {"H_static_m": 0.0}), ("pipe", {"L_m": 0.0}),
    ("operation", {"kind": "dcdc", "u_V": 300.0, "efficiency": 1.0}), ("pipe", {"K": 0.0}),
    ("pipe", {"roughness_mm": 0.0}), ("tank", {"volume_m3": 0.0}), ("tank", {"start_m3": 0.0}),
    ("tank", {"start_m3": 40.0}), ("demand", {"from_h": 0.0}), ("demand", {"to_h": 24.0}),
    ("weather", {"wind_mps": 0.0}), ("weather", {"step_min": 60.0}), ("weather", {"days": 1}),
]  # fmt: skip


@pytest.mark.parametrize("refused", [True, False])
def test_values_end_where_nature_ends_them_and_the_end_itself_passes(village, refused):
    """Angles of a sphere and a plane, hours of a day, parts of one, lengths, the water in a tank;
    the atmosphere's turbidity is 1 without dust."""
    for table, values in NOT_IN_NATURE if refused else AT_THE_EDGE:
        section = getattr(village, table)
        given = values if table == "operation" else {**section.given, **values}
        try:
            village.with_table(table, given)
        except ValueError as fault:
            assert refused, f"{table} {values}: {fault}"
            (key,) = values.keys() - {"kind", "u_V"} or values.keys() - {"kind"}
            assert f"[{table}]" in str(fault) and key in str(fault)
        else:
            assert not refused, f"{table} {values}"


def table_of_sizes(*rows):
    """(modules, head, kWp, tank, water, loss of load)"""
    names = "array.n_series pipe.H_static_m array_kWp tank.volume_m3 water_m3"
    names += " loss_of_load_probability"
    table = pd.DataFrame(rows, columns=names.split()).assign(why="")
    table.attrs["days"] = 365.0
    return table


@pytest.mark.parametrize(
    ("kind", "days", "light"),
    [
        *(("clear", 3.0, "under a clear sky"), ("clear", 365.0, "under a clear sky")),
        *(("csv", 3.0, "in 3 days"), ("csv", 359.0, "in 359 days"), ("csv", 365.0, None)),
    ],
)
def test_a_size_for_less_than_a_year_of_weather_has_no_margin(village, kind, days, light):
    table = table_of_sizes((5, 35, 2.0, 40, 65, 0.0))
    table.attrs["days"] = days
    system = SimpleNamespace(weather=SimpleNamespace(kind=kind), pipe=village.pipe)
    told = smallest(table, 0, 0.02, system)[1:]
    assert [line.partition(":")[0] for line in told] == ([light] if light else [])


@pytest.mark.parametrize(
    ("table", "row"),
    [
        ([(5, 35, 2.0, 40, 65, 0.0), (4, 35, 1.6, 40, 50, 0.02), (3, 35, 1.2, 40, 32, 0.021)], 1),
        ([(5, 35, 2.0, 40, 65, 0.0), (5, 35, 2.0, 20, 65, 0.0), (5, 35, 2.0, 30, 65, 0.0)], 1),
        ([(5, 35, 2.0, 40, 65, 0.0), (5, 35, 2.0, 40, 66, 0.0), (5, 35, 2.0, 40, 64, 0.0)], 1),
        ([(3, 20, 1.2, 40, 80, 0.0), (5, 35, 2.0, 40, 65, 0.0)], 1),  # the site's own head
        ([(3, 20, 1.2, 40, 80, 0.0), (5, 30, 2.0, 40, 65, 0.0)], None),  # it is not among them
        ([(3, 35, 1.2, 40, 32, 0.2)], None),
    ],
)
def test_the_smallest_array_then_tank_that_meets_the_demand_at_the_own_head(village, table, row):
    table = table_of_sizes(*table)
    assert meets(table, 0.02, village) == row
    (told, *clear) = smallest(table, row, 0.02, village)
    if 35 not in [*table["pipe.H_static_m"]]:
        assert told == (
            "no size is chosen: pipe.H_static_m is a value of the site, and the system's own 35.0 "
            "is not among those varied"
        )
        return
    if row is None:
        assert told.startswith("no size of these loses at most 2.0% of the demand")
        return
    chosen = table.loc[row]
    assert f"array.n_series = {chosen['array.n_series']:g}" in told
    assert f"{chosen['array_kWp']:g} kWp, {chosen['water_m3']:g} m3" in told
    assert len(clear) == 1 and "under a clear sky" in clear[0]
    lines = size_table(table, ["array.n_series", "pipe.H_static_m"], row)
    assert [line.endswith("*") for line in lines[-len(table) :]] == [
        n == row for n in range(len(table))
    ]


def test_nothing_is_chosen_where_the_site_alone_is_varied(village):
    table = table_of_sizes((5, 35, 2.0, 40, 65, 0.0), (5, 20, 2.0, 40, 80, 0.0))
    table = table.drop(columns=["array.n_series", "tank.volume_m3"])
    assert smallest(table, meets(table, 0.02, village), 0.02, village) == []


def test_a_size_that_cannot_work_is_not_the_smallest_and_its_reason_stands_once_below(village):
    table = table_of_sizes(
        (2, 35, 0.8, 40, 0, 0.0), (1, 35, 0.4, 40, 0, 0.0), (5, 35, 2, 40, 65, 0.0)
    )
    table.loc[:1, "why"] = "too low"
    assert meets(table, 0.02, village) == 2
    lines = size_table(table, ["array.n_series"], 2)
    assert [line[-3:] for line in lines[-4:]] == ["[1]", "[1]", "0 *", "low"]
    assert lines[-1] == "[1] too low" and lines[-2].split()[0] == "5"
    assert meets(table.drop(columns="loss_of_load_probability"), 0.02, village) is None


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("array.n_series=4:7", [4, 5, 6, 7]),
        ("array.n_series=4:7:2", [4, 7]),
        ("array.n_series=4:5:3", [4, 5]),  # whole modules: 4.5 is one of these
        ("pipe.H_static_m=10:12", [10.0, 11.0, 12.0]),
        ("pipe.H_static_m=0:1:5", [0.0, 0.25, 0.5, 0.75, 1.0]),
        ("pipe.H_static_m=7", [7.0]),
        ("pipe.H_static_m=7,5.5", [7.0, 5.5]),
    ],
)
def test_what_to_vary_is_written_as_a_range_or_a_list(village, text, expected):
    assert parsed(text, village) == (text.partition("=")[0], pytest.approx(expected))


def test_a_listed_value_that_is_not_whole_is_refused_where_wholes_are_needed(village):
    with pytest.raises(ParameterError, match="is not whole"):
        parsed("array.n_series=4,4.5", village)


@pytest.mark.parametrize(
    ("parallel", "series", "head", "strings", "modules"),
    [
        (1, 5, 35.0, [1, 2, 3, 4], [2, 3, 4, 5, 6, 7]),
        (6, 7, 20.0, [3, 4, 5, 6, 7, 8], [4, 5, 6, 7, 8, 9]),
        (12, 2, 20.0, [6, 8, 10, 12, 14, 16], [1, 2, 3, 4]),
        (4, 2, 0.0, [2, 3, 4, 5], [1, 2, 3, 4]),
        (100, 2, 20.0, [50, 67, 83, 100, 117, 133], [1, 2, 3, 4]),
    ],
)
def test_sizes_are_varied_around_the_own_where_nothing_is_said(
    village, parallel, series, head, strings, modules
):
    values = {"array.n_parallel": parallel, "array.n_series": series, "pipe.H_static_m": head}
    first, second = usual(village.with_values(values))
    heads = {"pipe.H_static_m": [head * k for k in (0.5, 0.75, 1, 1.25, 1.5)]} if head else {}
    assert first == {**heads, "array.n_parallel": strings}
    assert second == {"array.n_series": modules}


def test_the_figure_of_sizes_has_a_line_for_each_head_and_the_demand():
    table = table_of_sizes(
        *((n, h, 1, 1, n * 100 / h, h / n / 100) for h in (10, 20) for n in (4, 5, 6))
    )
    table.loc[5, "why"] = "too low"  # the last of 20 m
    varied = {"pipe.H_static_m": [], "array.n_series": [4, 5, 6]}
    ax, lost = figure(table, varied, demand=33.0).axes
    first, second, demand = ax.lines
    assert first.get_label() == "pipe.H_static_m = 10" and [*first.get_ydata()] == [40, 50, 60]
    assert [*second.get_xdata()] == [4, 5] and [*second.get_ydata()] == [20, 25]
    assert {*demand.get_ydata()} == {33.0} and ax.get_ylim()[0] == 0
    assert ax.get_xlabel() == "array.n_series" and ax.get_ylabel() == "water (m³)"
    assert all(float(t).is_integer() for t in ax.get_xticks())
    assert [*lost.lines[1].get_ydata()] == [20 / 4, 20 / 5] and len(lost.lines) == 2
    assert lost.get_ylabel() == "demand not met (%)" and lost.get_ylim()[0] == 0
    (ax,) = figure(table, varied).axes  # without a demand
    assert len(ax.lines) == 2
    ax, lost = figure(table[:3], {"array.n_series": [4, 5, 6]}, demand=33.0).axes
    assert len(ax.lines) == 2 and len(lost.lines) == 1 and lost.get_legend() is None


def test_hours_at_a_limit_and_below_the_loss_map_are_told_with_their_count(found):
    f = with_units(found.__class__(**{**found.__dict__, "storage": None}))
    assert f["demand_m3"] is None and f["level_start_m3"] is None
    assert not any("no water" in line or " h at " in line for line in remarks(found))


@pytest.fixture(scope="module")
def dry(found):
    """The same day without water."""
    nothing = np.zeros(len(found.t))
    return replace(found, samples=replace(found.samples, Q=nothing), storage=None)


@pytest.mark.parametrize(("part", "told"), [(0.97, 1), (0.99, 0)])
def test_a_link_below_the_voltages_of_the_loss_map_is_told(dry, part, told):
    """Of the half of the day in which the pump turns; at standstill its voltage says nothing."""
    least = dry.losses.u_dc[0]
    omega = np.where(np.arange(len(dry.t)) % 2, 100.0, 0.0)
    samples = replace(dry.samples, omega=omega, u_dc=np.full(len(dry.t), part * least))
    said = [line for line in remarks(replace(dry, samples=samples)) if "the loss map ends" in line]
    hours = (omega > 0).sum() * dry.step / 3600
    assert said == [
        f"{hours:.1f} h below {least:g} V, where the loss map ends: its edge is used"
    ] * bool(told)


@pytest.mark.parametrize(("given", "told"), [(1.04, 0), (1.2, 1)])
def test_a_law_that_gives_more_than_its_limit_is_told_where_it_is_at_it(dry, given, told):
    losses = replace(dry.losses, given=np.full_like(dry.losses.given, given))
    for limit, expected in ((Limit.torque, told), (Limit.speed, 0)):
        samples = replace(dry.samples, limit=np.full(len(dry.t), float(limit)))
        found = [
            line
            for line in remarks(replace(dry, losses=losses, samples=samples))
            if line.startswith("at the torque limit the control law gives")
        ]
        assert len(found) == expected
        if expected:
            most = losses.tau_set_up
            assert f"gives {1.2 * most:.3g} N m where it is asked for {most:.3g} (+20%)" in found[0]


@pytest.mark.parametrize(
    ("limit", "reach", "told"),
    [
        (Limit.none, None, "at its maximum power point it has"),
        (Limit.torque, 1.0, "the torque limit of 1 N m is too low"),
        (Limit.torque, 0.5, "the machine gives no more at"),
        (Limit.voltage, None, "the voltage is too low"),
    ],
)
def test_why_there_is_no_water_follows_from_what_limits(dry, limit, reach, told):
    """Each with its numbers: the least torque of the pump with the friction of the machine."""
    samples = replace(dry.samples, limit=np.full(len(dry.t), float(limit)))
    losses = dry.losses
    if reach is not None:
        losses = replace(losses, tau_set_up=reach)
    system = dry.system.with_values({"limits.tau_max_Nm": 1.0}) if reach else dry.system
    dry = replace(dry, samples=samples, losses=losses, system=system)
    (line,) = (line for line in remarks(dry) if line.startswith("no water: "))
    omega, load = dry.load.omega[0], dry.load
    tau = load.tau[0] + dry.system.drive.machine.B_Nms * omega
    assert told in line
    if limit != Limit.none:
        rpm = omega * 30 / np.pi
        assert f"the pump needs {tau:.3g} N m at {rpm:.0f} rpm, where it begins to lift" in line
    if limit == Limit.none:
        u = np.median(samples.u_dc[samples.p_mp > 0])
        (p,) = losses.p_in(*(np.array([x]) for x in (u, omega, tau)))
        assert f"the drive needs {p:.0f} W" in line
        assert f"gives at most {samples.p_link.max():.0f} W" in line
        weak = replace(
            dry, samples=replace(samples, p_mp=0.9 * p / samples.p_mp.max() * samples.p_mp)
        )
        assert any("; take more modules or less head" in line for line in remarks(weak))
    if limit == Limit.voltage:
        u = samples.u_dc.max()
        (most,) = losses.greatest_torque(np.array([u]), np.array([omega]))
        assert f"the machine gives {most:.3g} N m there at {u:.0f} V; take more modules" in line


@pytest.mark.parametrize(("part", "asked"), [(0.19, True), (0.21, False)])
def test_a_pump_far_beyond_the_array_is_asked_for_the_unit_of_its_flows(dry, part, asked):
    """By the water power of its best point: rho g Q H."""
    given = {"H_0_m": 40.0, "Q_b_m3ph": 360.0, "H_b_m": 30.0, "eta_b": 0.7}  # 0.1 m3/s
    own = Pump(n_ref_rpm=1450, **given)
    best = 998.2 * 9.80665 * 0.1 * 30
    samples = replace(dry.samples, p_mp=part * best / dry.samples.p_mp.max() * dry.samples.p_mp)
    large = replace(dry, samples=samples, system=replace(dry.system, pump=own))
    (line,) = (line for line in remarks(large) if line.startswith("no water: "))
    assert line.endswith("check the unit of its flows, Q_m3ph; 1000 l/min are 60 m3/h") == asked
    if asked:
        (told,) = re.findall(r"best point has (\d+) W in the water", line)
        assert float(told) == pytest.approx(best, rel=0.01)


def test_a_law_that_does_not_reach_the_torque_is_told_with_the_torque_to_set(found):
    reach = 0.8 * found.system.tau_max
    (line,) = (
        line
        for line in remarks(replace(found, losses=replace(found.losses, tau_set_up=reach)))
        if line.startswith("the control law reaches")
    )
    most = float(re.search(r"tau_max_Nm = ([\d.]+)", line)[1])
    assert reach - 1e-3 < most <= reach  # never above what it reaches
    rpm = found.system.pump.omega_max * 30 / np.pi
    assert f"of {found.system.tau_max:g} N m at {found.system.u_dc:g} V and {rpm:.0f} rpm" in line
    assert not any(line.startswith("the control law reaches") for line in remarks(found))


@pytest.mark.parametrize(("days", "told"), [(60.0, False), (61.0, True), (1000.0, True)])
def test_a_tank_of_more_than_sixty_days_is_asked_about(found, days, told):
    volume = days * found.system.demand.m3_per_day
    large = replace(found, system=found.system.with_values({"tank.volume_m3": volume}))
    asked = [text for text in remarks(large) if "1000 litres are 1 m3" in text]
    assert bool(asked) == told
    if told:
        assert f"volume_m3 = {volume:g} holds the demand of {days:g} days" in asked[0]


@pytest.mark.parametrize(
    ("zone", "hours", "told"),
    [
        ("UTC", (6.0, 20.0), "hours of UTC, 4.9 h behind the sun there"),
        ("Etc/GMT-10", (6.0, 20.0), "hours of Etc/GMT-10, 5.1 h ahead of the sun there"),
        ("UTC", (0.0, 24.0), None),  # the same at each hour
        ("Asia/Kolkata", (6.0, 20.0), None),
        ("Etc/GMT-1", (6.0, 20.0), None),  # 3.9 h
    ],
)
def test_hours_of_a_demand_on_the_clock_of_another_place_are_told(found, zone, hours, told):
    there = {"site.longitude_deg": 73.0, "site.timezone": zone}
    demand = dict(zip(("demand.from_h", "demand.to_h"), hours, strict=True))
    system = found.system.with_values({**there, **demand})
    asked = [text for text in remarks(replace(found, system=system)) if "from_h and to_h" in text]
    assert bool(asked) == bool(told)
    if told:
        assert told in asked[0] and "with their offset, +00:00" in asked[0]


def test_a_demand_that_the_best_flow_does_not_give_is_asked_about(found):
    best = 86400 * found.samples.Q.max()
    for part, told in ((0.99, False), (1.01, True), (1000.0, True)):
        system = found.system.with_values({"demand.m3_per_day": part * best})
        asked = [text for text in remarks(replace(found, system=system)) if "best flow" in text]
        assert bool(asked) == told
        if told:
            assert f"{best:.3g} m3" in asked[0] and "1000 litres are 1 m3" in asked[0]


@pytest.mark.parametrize(
    ("tilt", "told"), [(0.0, False), (1.0, False), (1.6, False), (0.5, True), (0.5236, True)]
)
def test_a_tilt_that_may_be_in_radians_is_asked_about(found, tilt, told):
    system = found.system.with_values({"array.tilt_deg": tilt})
    asked = [text for text in remarks(replace(found, system=system)) if "almost flat" in text]
    assert bool(asked) == told
    if tilt == 0.5236:
        assert "0.5236 rad are 30 deg" in asked[0]


@pytest.mark.parametrize(
    ("latitude", "azimuth", "tilt", "towards"),
    [
        (35, 180, 30, None), (35, 90, 30, None), (35, 270, 30, None), (35, 89, 30, 180),
        (35, 271, 30, 180), (35, 0, 30, 180), (-35, 0, 30, None), (-35, 90, 30, None),
        (-35, 91, 30, 0), (-35, 269, 30, 0), (-35, 180, 30, 0), (-35, 180, 0, None),
        (5, 0, 30, None),  # near the equator the sun stands on either side
    ],
)  # fmt: skip
def test_an_array_that_faces_away_from_the_equator_is_told(found, latitude, azimuth, tilt, towards):
    values = {"site.latitude_deg": latitude, "array.azimuth_deg": azimuth, "array.tilt_deg": tilt}
    turned = replace(found, system=found.system.with_values(values))
    told = [text for text in remarks(turned) if "faces away from the equator" in text]
    assert bool(told) == (towards is not None)
    if told:
        assert f"azimuth_deg = {azimuth} at latitude {latitude}; set" in told[0]
        assert told[0].endswith(f"azimuth_deg = {towards}")


@pytest.mark.parametrize("most", [10.0, 0.4])
@pytest.mark.parametrize("reach", [1.0, 0.9, 0.5, 0.05])
def test_a_law_is_set_up_for_the_greatest_torque_that_it_reaches(found, monkeypatch, reach, most):
    """To within the part of the torque that counts as held, and never beyond."""
    real = maps.at

    def at(drive, **point):
        if point["tau"] > reach * most:
            raise ParameterError(f"no more than {reach}")
        return real(drive, **{**point, "tau": 1.0, "tau_max": 1.0})

    monkeypatch.setattr(maps, "at", at)
    able = maps.set_up(found.system.drive, 100.0, most)
    assert reach * most - 0.03 * most <= able.tau_max <= reach * most
    assert able.tau_max == most or reach < 1


def test_a_law_that_reaches_no_torque_is_refused_with_its_reason(found, monkeypatch):
    def none(drive, **point):
        raise ParameterError(f"not {point['tau']:g}")

    monkeypatch.setattr(maps, "at", none)
    with pytest.raises(ParameterError, match=r"^not 8$"):  # what was asked for
        maps.set_up(found.system.drive, 100.0, 8.0)


def test_sizes_are_written_by_what_is_varied(tmp_path):
    table = table_of_sizes(*((n, h, 1, 1, n / h, 0.1) for h in (10, 30) for n in (4, 5)))
    values = {"pipe.H_static_m": [10, 30], "array.n_series": [4, 5]}
    one = {"array.n_series": [4, 5]}
    paths = write_sizes([table, table[:2]], [values, one], tmp_path / "new")
    stems = "sizes_H_static_m_n_series", "sizes_n_series"
    assert [p.name for p in paths] == [f"{s}.{end}" for s in stems for end in ("csv", "png")]
    again = pd.read_csv(paths[0])
    assert again["water_m3"].to_numpy() == pytest.approx(table["water_m3"].to_numpy(), rel=1e-7)
    assert [*again.columns] == [*table.columns] and len(pd.read_csv(paths[2])) == 2
    assert all(p.read_bytes().startswith(b"\x89PNG") for p in paths[1::2])


def test_sizes_need_a_value_and_one_of_the_system(village):
    with pytest.raises(ParameterError, match=r"^array\.n_series: need at least one value$"):
        sizes(village, {"array.n_series": []})
    with pytest.raises(ParameterError, match=r"unknown value `array\.n_serie`"):
        sizes(village, {"array.n_serie": [3]})


def lines(ax):
    """(x, y) of each labelled or plain curve."""
    return {line.get_label(): line.get_data() for line in ax.lines}


def test_figures_over_a_day_show_the_samples_in_their_units(found):
    s, days = columns(found), plots.best_day(found)
    assert [*days.t] == [*found.t] and days.storage is None  # the only day
    light, power, turns, flow = report.figures(found)["day"].axes
    (sun,) = light.lines
    assert [*sun.get_ydata()] == pytest.approx([*s["poa_global"]])
    drawn = {label: y for label, (_, y) in lines(power).items()}
    assert drawn["maximum power point"] == pytest.approx(s["p_mp_W"] / 1e3)
    assert drawn["drawn by the drive"] == pytest.approx(s["p_in_W"] / 1e3)
    assert drawn["shaft"] == pytest.approx(s["p_shaft_W"] / 1e3)
    hydraulic = s["Q_m3ph"] / 3600 * 15 * 998.2 * 9.80665
    assert drawn["lifted water"] == pytest.approx(hydraulic / 1e3)
    assert turns.lines[0].get_ydata() == pytest.approx(s["speed_rpm"])
    assert flow.lines[0].get_ydata() == pytest.approx(s["Q_m3ph"])
    for ax in (light, power, turns, flow):
        assert ax.get_ylim()[0] == 0
        assert ax.get_xlim() == pytest.approx([*date2num([found.t[0], found.t[-1]])])
    assert "(kW)" in power.get_ylabel() and "rpm" in turns.get_ylabel()
    assert light.figure.get_suptitle() == "the day with most water: 21 March 2026"


def test_the_best_day_is_the_one_with_most_water(village):
    """Of three, the second has the sun highest on the tilted plane: it is cut out whole."""
    week = pump(village.with_values({"weather.days": 3, "weather.step_min": 60}))
    Q = np.where(week.t.day == 16, 2.0, 1.0) * week.samples.Q
    best = plots.best_day(replace(week, samples=replace(week.samples, Q=Q)))
    assert {t.day for t in best.t} == {16} and len(best.t) == len(best.samples.Q) == 24
    assert best.samples.Q == pytest.approx(Q[24:48])
    bars = [bar.get_height() for bar in plots.plot_water(axes(), week).patches]
    assert bars[:3] == pytest.approx(per(week, "D")["water_m3"])
    assert [t.get_text() for t in plots.plot_water(axes(), week).get_xticklabels()] == [
        "15 Aug", "16 Aug", "17 Aug",
    ]  # fmt: skip


def axes():
    return Figure().add_subplot()


def test_water_and_tank_are_shown_by_day_up_to_two_months_and_by_month_beyond(found):
    """The same day again and again: what is drawn is known."""
    n = len(found.t)

    def repeated(days):
        t = pd.date_range(found.t[0], periods=n * days, freq="5min")
        samples = replace(
            found.samples,
            **{f.name: np.tile(getattr(found.samples, f.name), days) for f in fields(Samples)},
        )
        store = found.storage
        names = ("level", "overflow", "missing", "demand")
        store = replace(store, **{name: np.tile(getattr(store, name), days) for name in names})
        return replace(found, weather=replace(found.weather, t=t), samples=samples, storage=store)

    few, many = repeated(61), repeated(62)
    water = plots.plot_water(axes(), few)
    assert water.get_title() == "water by day" and len(water.patches) == 2 * 61
    assert water.patches[0].get_height() == pytest.approx(found.water)
    assert water.patches[61].get_height() == pytest.approx(found.storage.missing.sum())
    (demand,) = water.collections
    drawn = np.array(demand.get_segments())  # across each bar
    assert drawn[..., 1] == pytest.approx(np.full((61, 2), 400.0))
    assert drawn[:, :, 0].mean(axis=1) == pytest.approx(np.arange(61))
    assert water.get_xlim() == pytest.approx((-0.7, 60.7))
    assert plots.plot_water(axes(), found).get_xlim() == pytest.approx((-3, 3))  # a bar, no wall
    (level,) = plots.plot_tank(axes(), few).lines
    assert level.get_ydata() == pytest.approx(few.storage.level)
    water = plots.plot_water(axes(), many)
    assert water.get_title() == "water by month" and len(water.patches) == 2 * 3
    assert sum(bar.get_height() for bar in water.patches[:3]) == pytest.approx(62 * found.water)
    assert [t.get_text() for t in water.get_xticklabels()] == ["Mar", "Apr", "May"]
    tank = plots.plot_tank(axes(), many)
    least = lines(tank)["least of a day"][1]
    assert least == pytest.approx([found.storage.level.min()] * 62)
    (between,) = tank.collections
    assert between.get_datalim(tank.transData).y1 == pytest.approx(found.storage.level.max())
    assert tank.get_title() == f"tank: {found.storage.loss_of_load:.1%} of the demand is missing"


def test_figures_of_the_samples_have_the_threshold_and_the_drive_at_work(found):
    s = columns(found)
    threshold = plots.plot_threshold(axes(), found)
    points, least = threshold.lines
    lit = s["poa_effective"] > 5
    assert len(points.get_xdata()) == lit.sum() <= 4000
    assert points.get_ydata() == pytest.approx(s["Q_m3ph"][lit])
    begins = s["poa_effective"][s["Q_m3ph"] > 0].min()
    assert {*least.get_xdata()} == {begins}
    assert threshold.get_title() == f"flow from {begins:.0f} W/m² on"
    drive = plots.plot_efficiency(axes(), found)
    (points,) = drive.lines
    on = s["speed_rpm"] > 0
    assert points.get_xdata() == pytest.approx(s["speed_rpm"][on])
    assert points.get_ydata() == pytest.approx(s["tau_Nm"][on])
    assert drive.get_title() == f"drive at {np.median(s['u_dc_V'][on]):.0f} V and the samples"
    heads = plots.plot_heads(axes(), found)
    curves = [line for line in heads.lines if len(line.get_xdata()) == 100][:5]
    fastest = found.system.pump.omega_max * 30 / np.pi
    told = [float(text.get_text().removesuffix(" rpm")) for text in heads.texts]
    assert told == pytest.approx(np.linspace(0.6, 1, 5) * fastest, abs=0.5)
    (right,) = [ax for ax in heads.figure.axes if ax is not heads]
    water = 100 * 998.2 * 9.80665 / 3600  # W a m3/h and m, in percent
    for curve, eta, rpm in zip(curves, right.lines, told, strict=True):
        (Q, H), share = curve.get_data(), eta.get_ydata()  # affinity: heads as speeds squared
        assert H[0] == pytest.approx(curves[-1].get_ydata()[0] * (rpm / fastest) ** 2, rel=2e-3)
        Q_ref, r = np.asarray(Q) / 3600, rpm / found.system.pump.n_ref_rpm
        power = found.system.pump.curve().shaft_power(Q_ref, np.full(100, r))
        assert share == pytest.approx(water * Q * H / power, rel=2e-3)
    assert right.get_ylim() == (0, 100) and heads.get_ylim()[0] == heads.get_xlim()[0] == 0
    asked = lines(heads)["static head + pipe"]
    most = max(1.2 * s["Q_m3ph"].max(), 0.5 * curves[-1].get_xdata()[-1])
    assert asked[0][-1] >= 1.2 * s["Q_m3ph"].max() and asked[0][-1] <= most
    pipe = found.system.pipe
    assert asked[1] == pytest.approx(pipe.H_static_m + pipe.friction_head(asked[0] / 3600))
    assert lines(heads)["pumping"][1] == pytest.approx(found.samples.H[on])


def test_operating_points_of_the_array_lie_apart_by_whether_water_flows(found):
    """Of samples with more than 5 W/m2; the curves are those of the cells at the temperatures that
    go with the light, from the short to the open circuit."""
    s = found.samples
    ax = plots.plot_array(axes(), found)
    on, light = s.omega > 0, s.poa_effective > 5
    drawn = lines(ax)
    assert "at a limit the drive draws less" in ax.get_title()
    assert (light & ~on).any() and on.any()
    for name, kept in (("no flow", light & ~on), ("pumping", on)):
        assert drawn[name][0] == pytest.approx(s.u[kept])
        assert drawn[name][1] == pytest.approx(s.i[kept])
    slope, base = np.polyfit(s.poa_effective[light], s.temp_cell[light], 1)
    for G, curve, text in zip((200, 400, 600, 800, 1000), ax.lines, ax.texts, strict=False):
        temp = base + slope * G
        assert text.get_text() == f"{G} W/m², {temp:.0f} °C"
        u, i = curve.get_data()
        best = power_point(found.system.array.diode(np.full(1, G), np.full(1, temp)))
        assert u[0] == 0 and u[-1] == pytest.approx(best.u_oc[0])
        assert i[-1] == pytest.approx(0, abs=1e-6 * i[0])
        assert (u * i).max() == pytest.approx(best.p[0], rel=1e-3)


def test_each_loss_begins_where_the_one_before_ends_and_the_rest_is_lifted(found):
    """In kWh and in parts of the maximum power point; water over the rim has a row of its own."""
    c = chain(found)
    names = "off_mpp converter below_threshold above_limit drive friction pump pipe".split()
    for shown in (found, replace(found, storage=None)):
        ax = plots.plot_losses(axes(), shown)
        bars = [(bar.get_x(), bar.get_width()) for bar in ax.patches]
        whole, *rest = bars
        assert whole == pytest.approx((0, c.e_mp / 3.6e6))
        left = c.e_mp / 3.6e6
        for (start, width), name in zip(rest, names, strict=False):
            left -= getattr(c, name) / 3.6e6
            assert (start, width) == pytest.approx((left, getattr(c, name) / 3.6e6), abs=1e-9)
        assert bars[9] == pytest.approx((0, c.e_lift / 3.6e6)) and left == pytest.approx(bars[9][1])
        spilt = shown.storage is not None
        assert len(bars) == 10 + spilt
        assert not spilt or bars[10] == pytest.approx((0, c.overflow / 3.6e6))
        told = ax.texts[1].get_text()
        assert told.endswith(f"kWh, {100 * c.off_mpp / c.e_mp:.1f} %")
    assert c.overflow > 0


def test_a_loss_map_has_five_voltages_nine_speeds_and_five_torques(found):
    assert found.losses.loss_per_torque.shape == (5, 9, 5)
