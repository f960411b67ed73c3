"""A comparison as it is shown: no two laws look alike, no names overlap, the table fits."""

from dataclasses import replace
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from matplotlib.text import Annotation

import reluctance as rl
from reluctance.explore.comparison import CONTENDERS, Comparison, Entry, compare
from reluctance.explore.comparison import figure as drawing
from reluctance.explore.comparison.conditions import in_words
from reluctance.explore.comparison.contest import FrontPoint
from reluctance.explore.comparison.table import (
    COLUMNS,
    NOT_COMPARABLE,
    as_json,
    flat,
    limit_line,
    markdown,
    needs,
    plain,
    star,
    tuned,
)

RATED = Path(__file__).parents[2] / "examples" / "paper_rated.toml"
SHARING = [name for name in CONTENDERS if name.startswith("sharing_")]


@pytest.fixture(scope="module")
def found() -> Comparison:
    drive = rl.load(RATED, ["control.T_s_us=20"])
    return compare(drive, [*SHARING[:3], "deadbeat"], f_switch=5e3, octaves=(), processes=1)


def test_a_notebook_shows_one_line(found: Comparison) -> None:
    names = ", ".join([*SHARING[:3], "deadbeat"])
    assert repr(found) == f"Comparison(paper_rated: {names} at 5 kHz per switch)"


def test_no_two_laws_look_alike() -> None:
    styles = [drawing.style(name) for name in CONTENDERS]
    assert len({(s["color"], s["ls"], s["marker"]) for s in styles}) == len(CONTENDERS)


def test_names_do_not_overlap(found: Comparison) -> None:
    made = drawing.figure(found)
    made.draw_without_rendering()
    for ax in made.axes[:2]:
        names = [text for text in ax.texts if isinstance(text, Annotation)]
        assert {text.get_text() for text in names} == {e.name for e in found.entries}
        boxes = [super(Annotation, text).get_window_extent() for text in names]  # without the line
        assert not any(a.overlaps(b) for a, b in combinations(boxes, 2))


def test_the_name_of_the_lower_bound_lies_below_it(found: Comparison) -> None:
    made = drawing.figure(found)
    made.draw_without_rendering()
    ax = made.axes[0]
    (name,) = [text for text in ax.texts if text.get_text().startswith("below the lower bound")]
    below = ax.collections[-1].get_paths()[0].transformed(ax.transData)
    assert below.contains_point(name.get_window_extent().get_points()[1])


def test_a_law_that_failed_is_named_in_the_title(found: Comparison) -> None:
    failed = Entry("ditc", {}, met=False, note="not possible here: angles", runs=0)
    made = drawing.figure(replace(found, entries=(failed,)))
    assert "ditc" in made.get_suptitle()


def test_the_table_of_all_laws_fits_a_terminal(found: Comparison) -> None:
    rows = tuple(replace(found.entries[0], name=name, met=False) for name in CONTENDERS)
    lines = plain(replace(found, entries=rows, step_time=dict.fromkeys(CONTENDERS, 98765e-9)))
    assert max(map(len, lines)) <= 110
    assert len({len(line) for line in lines[: 2 + len(rows)]}) == 1


def made(found: Comparison) -> Comparison:
    """Two laws with figures that are given: one that meets the frequency, one beside it."""
    first, second = found.entries[0], found.entries[3]
    assert first.kpis is not None
    kpis = replace(
        first.kpis,
        f_switch=5.1e3,
        torque_ripple_pp=0.111,
        torque_ripple_rms=0.0222,
        torque_error_rms=0.0333,
        tau_mean=1.02 * found.bound.tau_ref,
        i_rms=1.25 * found.bound.i_rms,
        i_peak=1.5 * found.bound.i_peak,
        p_cu=1234.4,
        efficiency=0.4567,
    )
    front = (FrontPoint(2.5e3, 0.06, 0.2, 48.0), FrontPoint(5e3, 0.0333, None, 50.0))
    tau = found.bound.tau_ref * np.array([1.0, 1.1, 0.95])
    given = {"kpis": kpis, "front": front, "speed_ripple": 0.00012, "T_s": 20e-6, "note": ""}
    first = replace(first, **given, met=True, torque=np.array([[0, np.pi, 6.0], tau]))
    off = replace(kpis, torque_error_rms=0.05, tau_mean=0.9 * found.bound.tau_ref)
    second = replace(second, **given | {"kpis": off, "note": "too slow"}, met=False)
    time = {first.name: 1.5e-6, second.name: 2.5e-6}
    return replace(found, entries=(first, second), step_time=time, f_target=5e3)


def test_the_table_has_every_figure_in_the_unit_of_its_head(found: Comparison) -> None:
    shown = made(found)
    first, second = shown.entries
    heads, units, *rows = plain(shown)[:4]
    columns = {c.key: " ".join(c.head) for c in COLUMNS}
    assert heads.split()[0] == "control"
    assert units.split() == " ".join(c.head[1] for c in COLUMNS).split()
    cells = rows[0].split()
    assert cells == [
        first.name, "5.10", "11.10", "2.22", "3.33", "+2.00", "1.250", "1.500", "1234", "45.67",
        "0.0120", "20", "1500",
    ]  # fmt: skip
    assert columns["f_switch_Hz"] == "f sw. kHz" and columns["control_period_s"] == "T_s us"
    assert columns["torque_error_mean"] == "mean error %" and columns["p_cu_W"] == "copper W"
    assert columns["i_rms_over_limit"] == "i rms / limit"
    missed = rows[1]
    assert missed.startswith(f"{second.name} * !") and "-10.00" in missed and "5.00" in missed
    lines = plain(shown)
    assert f"{second.name} * !: too slow" in lines and f"{second.name} !: {NOT_COMPARABLE}" in lines
    assert "tuned values, for [control]:" in lines
    text = markdown(shown)
    assert f"| `{first.name}` | 5.10 | 11.10 |" in text and f"`{second.name}` * ! |" in text
    assert f"\\* `{second.name}`: too slow." in text
    assert f"! `{second.name}`: {NOT_COMPARABLE}." in text
    key = CONTENDERS[first.name].free.key
    assert f"| `{first.name}` | " in text and f"{key} = {first.values[key]:g}" in text


@pytest.mark.parametrize(
    ("mean", "met", "mark"),
    [(0.0, True, ""), (0.049, True, ""), (0.051, True, " !"), (-0.051, False, " * !"),
     (0.0, False, " *")],
)  # fmt: skip
def test_a_row_is_marked_by_its_frequency_and_by_a_mean_torque_off_by_a_twentieth(
    mean: float, met: bool, mark: str
) -> None:
    assert star({"torque_error_mean": mean, "met": met}) == mark


def test_records_hold_the_figures_in_the_units_of_their_names(found: Comparison) -> None:
    shown = made(found)
    tree = as_json(shown)
    record, missed = tree["controls"]
    expected = {
        "f_switch_Hz": 5100.0,
        "torque_error_mean": 0.02,
        "i_rms_over_limit": 1.25,
        "i_peak_over_limit": 1.5,
        "control_period_s": 20e-6,
        "ns_per_step": 1500.0,
        "speed_ripple_pp": 0.00012,
    }
    assert {key: record[key] for key in expected} == pytest.approx(expected)
    assert record["met"] and not missed["met"] and missed["note"] == "too slow"
    assert record["front"][0] == {
        "f_switch_Hz": 2.5e3,
        "torque_error_rms": 0.06,
        "torque_ripple_pp": 0.2,
        "i_rms_A": 48.0,
    }
    assert tree["f_switch_target_Hz"] == 5e3
    bound = shown.bound
    assert tree["limit"]["i_rms_A"] == bound.i_rms and tree["limit"]["p_cu_W"] == bound.p_cu
    assert tree["limit"]["ripple_bound_rms_Nm"] == shown.floor.bound_rms
    failed = Entry("ditc", {}, met=False, note="not possible here", runs=3)
    with_it = flat(replace(shown, entries=(*shown.entries, failed)))
    assert len({tuple(row) for row in with_it}) == 1 and np.isnan(with_it[2]["i_rms_A"])
    assert "front" not in with_it[0] and with_it[0]["values"] == tuned(record)


def test_the_line_of_the_limit_says_whether_there_is_ripple(found: Comparison) -> None:
    bound = replace(found.bound, tau_ref=40.0, i_rms=48.876, i_peak=89.33, p_cu=5170.6)
    for error, told in (
        (0.003, "least known rms current: no ripple at 48.88 A rms, 89.3 A peak, 5171 W copper"),
        (0.5, "error at least 0.5 N m (0.25 rms) at 48.88 A rms"),
    ):
        line = limit_line(
            replace(found, bound=replace(bound, tau_error_max=error, tau_error_rms=error / 2))
        )
        assert told in line


def test_figures_show_error_over_frequency_over_current_and_over_the_angle(
    found: Comparison,
) -> None:
    shown = made(found)
    first, _ = shown.entries
    drawn = drawing.figure(shown)
    front, price, torque = drawn.axes[:3]
    line = next(line for line in front.lines if line.get_label() == first.name)
    assert [*line.get_xdata()] == [2.5, 5.0]
    assert [*line.get_ydata()] == pytest.approx([6.0, 3.33])
    target = next(line for line in front.lines if {*line.get_xdata()} == {5.0})
    assert target.get_linestyle() == ":"
    bound = 100 * shown.floor.bound_rms / shown.bound.tau_ref
    (below,) = [c for c in front.collections if c.get_alpha() == 0.12]
    corners = below.get_paths()[0].vertices
    for f, error in corners[corners[:, 1] > 2e-6]:  # as one over the frequency
        assert f * error == pytest.approx(5.0 * bound, rel=1e-6)
    dot = next(line for line in price.lines if line.get_label() == first.name)
    assert (dot.get_xdata()[0], dot.get_ydata()[0]) == pytest.approx((1.25, 3.33))
    hollow = [line.get_markerfacecolor() for line in price.lines if line.get_label() != first.name]
    assert "none" in hollow and dot.get_markerfacecolor() != "none"
    assert price.get_ylim() == pytest.approx((0.8 * bound, 1.2 * 5.0))
    error = torque.lines[0]
    assert error.get_xdata() == pytest.approx(np.degrees([0, np.pi, 6]))
    assert error.get_ydata() == pytest.approx([0, 10, -5], abs=1e-12) and torque.get_xlim() == (
        0,
        360,
    )
    assert "5 kHz per switch" in drawn.get_suptitle()


@pytest.mark.parametrize(
    ("points", "levels"),
    [
        ([0.5], [0.5]),
        ([0.2, 0.8], [0.2, 0.8]),
        ([0.5, 0.5], [0.48, 0.52]),
        ([0.5, 0.5, 0.9], [0.48, 0.52, 0.9]),
        ([0.51, 0.5, 0.52], [0.51, 0.47, 0.55]),
        ([0.0, 0.0, 0.0], [0.0, 0.04, 0.08]),
        ([1.0, 1.0], [0.96, 1.0]),
    ],
)
def test_names_stand_level_with_their_points_or_as_near_as_the_others_let_them(
    points, levels, found: Comparison
) -> None:
    """Twenty-fifths of the height apart, and all beside the axes."""
    ax = drawing.figure(made(found)).axes[0]
    ax.set(xscale="linear", yscale="linear", xlim=(0, 1), ylim=(0, 1))
    entry = found.entries[0]
    before = len(ax.texts)
    drawing._label(ax, found, [(0.3, y, entry) for y in points])
    texts = [text for text in ax.texts[before:] if isinstance(text, Annotation)]
    shown = {round(text.xy[1], 9): [] for text in texts}
    for text in texts:
        shown[round(text.xy[1], 9)].append(text.xyann[1])
    wanted = {y: sorted(h for h, p in zip(levels, points, strict=True) if p == y) for y in points}
    assert shown == {y: pytest.approx(heights) for y, heights in wanted.items()}


def test_a_law_whose_error_is_above_a_fifth_is_not_drawn(found: Comparison) -> None:
    shown = made(found)
    first, second = shown.entries
    assert second.kpis is not None
    for error, left_out in ((0.19, False), (0.21, True)):
        bad = replace(second, kpis=replace(second.kpis, torque_error_rms=error))
        title = drawing.figure(replace(shown, entries=(first, bad))).get_suptitle()
        assert (f"error above 20 %: {second.name}" in title) == left_out


def test_conditions_are_told_in_words_with_their_units() -> None:
    plainly, *_, sensed = in_words(rl.load(RATED), 20e3)
    assert "240 V, 1500 rpm" in plainly and "41.339 N m; switches ideal" in plainly
    assert sensed.startswith("current ideal; angle ideal; model mismatch: R x1, flux x1, angle")
    given = ["converter.v_switch_V=1.5", "converter.R_diode_ohm=0.02", "converter.dead_time_us=2"]
    given += ["sensing.adc_bits=12", "sensing.i_range_A=200", "sensing.encoder_counts=4096"]
    given += ["sensing.delay_samples=1", "mismatch.R_factor=1.1", "mismatch.angle_offset_deg=2"]
    first, second, third, fourth = in_words(rl.load(RATED, given), 12.5e3)
    assert "switches 1.5 V + 0 ohm, diodes 0 V + 0.02 ohm, dead time 2 us" in first
    assert "12.5 kHz per switch" in second and "delay 1 samples" in second
    assert third.startswith("comparators analog")
    assert "current 12 bits over 200 A; angle 4096 counts a revolution" in fourth
    assert "R x1.1, flux x1, angle offset 2 deg" in fourth


def test_a_law_needs_fast_sampling_where_comparators_are_sampled(found: Comparison) -> None:
    analog = {name: needs(found, c) for name, c in CONTENDERS.items()}
    assert "one current comparator per phase" in analog["sharing_cubic"]
    sampled = found.point.computed(
        sensing=found.point.sensing.model_copy(update={"comparators": "sampled"})
    )
    for name, c in CONTENDERS.items():
        told = needs(replace(found, point=sampled), c)
        assert "comparator" not in told and told.count("fast sampling") >= (
            "comparator" in analog[name]
        )
