"""Figures of the report: each curve has the study's numbers in the unit of its axis, in view."""

import re
from collections.abc import Iterator
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from brief_study import brief
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from reluctance.base.arrays import FloatArray
from reluctance.paper import figures
from reluctance.paper.points import Runs
from reluctance.paper.sweeps import Response

RPM = np.pi / 30
UNITS = {"ms": 1e-3, "%": 0.01, "rpm": RPM, "kHz": 1e3, "deg": np.pi / 180}
PERIOD = np.pi / 2  # electrical, of a rotor of four poles [rad]


@cache
def drawn(name: str) -> Figure:
    (picture,) = [p for p in figures.PICTURES if p.name == name]
    return picture.draw(brief().found)


def axes(name: str, rows: int, columns: int) -> list[list[Axes]]:
    found = drawn(name).axes[: rows * columns]
    return [found[row * columns : (row + 1) * columns] for row in range(rows)]


def unit(label: str) -> float:
    """Of the last bracket of an axis: of `time (ms)` 1e-3."""
    return UNITS.get(re.findall(r"\((\w+|%)[^()]*\)", label)[-1], 1.0)


def in_si(ax: Axes, line: Line2D) -> tuple[FloatArray, FloatArray]:
    x, y = (np.asarray(of, float) for of in line.get_data())
    return x * unit(ax.get_xlabel()), y * unit(ax.get_ylabel())


def curve(ax: Axes, start: str) -> tuple[FloatArray, FloatArray]:
    """The one whose name begins so, in SI."""
    (line,) = [line for line in ax.lines if str(line.get_label()).startswith(start)]
    return in_si(ax, line)


def level(ax: Axes, start: str) -> float:
    """Of a horizontal line, in SI."""
    values = np.unique(curve(ax, start)[1])
    assert values.size == 1
    return float(values[0])


def seen(ax: Axes, start: str) -> tuple[FloatArray, FloatArray]:
    """What of a curve lies between the ends of the horizontal axis, in SI; all of it must lie
    between those of the vertical one."""
    x, y = curve(ax, start)
    left, right = (end * unit(ax.get_xlabel()) for end in ax.get_xlim())
    low, high = (end * unit(ax.get_ylabel()) for end in ax.get_ylim())
    x, y = x[(x >= left) & (x <= right)], y[(x >= left) & (x <= right)]
    assert x.size and (y >= low).all() and (y <= high).all()
    return x, y


def points() -> Iterator[tuple[int, Runs, Response]]:
    found = brief().found
    yield 0, found.rated, found.rated_response
    yield 1, found.half, found.half_response


def test_torque_is_that_of_the_step_and_is_marked_where_it_reaches_its_level() -> None:
    for row, _, r in points():
        whole, zoom = axes("fig7_torque", 2, 2)[row]
        tau, rpm = r.point.tau_ref, r.point.speed_rpm
        for ax in (whole, zoom):
            np.testing.assert_allclose(curve(ax, "torque"), (r.start.t, r.start.tau))
            assert level(ax, "reference") == tau
            seen(ax, "torque")
            low, high = ax.get_ylim()
            assert low == 0 and tau < high < 1.3 * tau
        assert whole.get_xlim() == (0, 40) and zoom.get_xlim() == (0, 2)
        assert whole.get_title() == f"{tau} N m at {rpm:g} rpm"
        assert zoom.get_title() == f"its first 2 ms, from {r.theta_start_deg:g} deg"
        assert level(zoom, "95 % of the reference") == pytest.approx(0.95 * tau)
        ((at,), (there,)) = curve(zoom, "reached at")
        assert at == pytest.approx(r.reached[1].min()) and there == pytest.approx(0.95 * tau)
        texts = [text.get_text() for text in zoom.get_legend().get_texts()]
        assert f"reached at {at * 1e3:.2f} ms" in texts
        assert f"the paper: {r.point.response * 1e3:g} ms" in texts
        np.testing.assert_allclose(curve(zoom, "the paper")[0], r.point.response)


def test_speed_is_that_from_standstill_and_its_end_is_magnified() -> None:
    for column, runs, _ in points():
        whole, end = (row[column] for row in axes("fig8_speed", 2, 2))
        run, target = runs.pump, runs.point.speed_rpm * RPM
        for ax in (whole, end):
            np.testing.assert_allclose(curve(ax, "speed"), (run.t, run.omega_m))
            assert level(ax, "reference") == pytest.approx(target)
        assert whole.get_title() == f"from standstill to {runs.point.speed_rpm:g} rpm"
        assert whole.get_xlim() == (0, run.drive.simulation.until_s) and whole.get_ylim()[0] == 0
        seen(whole, "speed")
        t, omega_m = seen(end, "speed")
        assert np.ptp(t) == pytest.approx(0.05, rel=0.01) and end.get_xlim()[1] == run.t[-1]
        low, high = (rpm * RPM for rpm in end.get_ylim())
        assert low + high == pytest.approx(2 * target)
        assert 1 < (high - low) / max(np.ptp(omega_m), 0.01 * RPM) < 5


def test_speed_that_is_held_exactly_is_drawn_in_a_window_all_the_same() -> None:
    found = brief().found
    still = replace(found.rated.pump, omega_m=np.full(found.rated.pump.t.size, 1500 * RPM))
    figure = figures.speed(replace(found, rated=replace(found.rated, pump=still)))
    low, high = figure.axes[2].get_ylim()
    assert low < 1500 < high and high - low > 0.01


def test_phases_show_the_last_two_electrical_periods() -> None:
    for column, runs, _ in points():
        rows = axes("phases", 3, 2)
        t, theta_m = runs.locked.t, runs.locked.theta_m
        for row in rows:
            left, right = (ms * 1e-3 for ms in row[column].get_xlim())
            assert right == pytest.approx(t[-1])
            assert theta_m[-1] - np.interp(left, t, theta_m) == pytest.approx(2 * PERIOD, rel=1e-3)
        where = f"{runs.point.tau_ref} N m at {runs.point.speed_rpm:g} rpm, 240 V"
        torque, currents = rows[0][column], rows[1][column]
        assert torque.get_title(loc="left") == where
        tau = seen(torque, "torque")[1]
        assert torque.get_ylim()[0] == 0 and torque.get_ylim()[1] < 1.2 * tau.max()
        _, i = seen(currents, "phase a")
        assert currents.get_ylim()[0] == 0 and currents.get_ylim()[1] < 1.5 * i.max()


def test_regulator_shows_the_current_of_the_phase_that_carries_most_at_the_end() -> None:
    for column, runs, _ in points():
        currents, legs = (row[column] for row in axes("regulator", 2, 2))
        most = "abc"[int(runs.locked.i[:, -1].argmax())]
        t, i = seen(currents, f"phase {most}")
        assert np.ptp(t) == pytest.approx(0.5e-3, rel=0.1)
        assert currents.get_xlim() == legs.get_xlim()
        assert currents.get_xlim()[1] * 1e-3 == pytest.approx(runs.locked.t[-1])
        low, high = currents.get_ylim()
        assert i.min() - low < 5 and high - i.max() < 10  # [A]: its band of 2 A is seen
        assert currents.get_title(loc="left").startswith(f"{runs.point.tau_ref} N m at")


def test_settings_are_drawn_over_their_values_with_the_papers_marked() -> None:
    found = brief().found
    ours = {"N_p": 3, "N_c": 2, "r_w": 0.05}  # section 4 of the paper
    grid = axes("settings", 4, 3)
    for column, (name, own) in enumerate(ours.items()):
        those = [s for s in found.settings if s.name == name]
        for row, key in enumerate(("torque_ripple_pp", "torque_error_rms", "i_rms", "f_switch")):
            ax = grid[row][column]
            line, marked = ax.lines[:2]
            x, y = np.asarray(line.get_xdata()), np.asarray(line.get_ydata())
            values = [getattr(s.kpis, key) for s in those]
            np.testing.assert_allclose(y * unit(ax.get_ylabel()), values)
            np.testing.assert_array_equal(x, [s.value for s in those])
            assert ax.get_ylim()[0] == 0 and max(y) < ax.get_ylim()[1] < 1.3 * max(y)
            np.testing.assert_array_equal(marked.get_xdata(), own)
            assert ax.get_xscale() == ("log" if name == "r_w" else "linear")
            if name != "r_w":
                np.testing.assert_array_equal(ax.get_xticks(), [s.value for s in those])
        label = grid[-1][column].get_xlabel()
        assert f"${name.replace('_', '_')}$" in label and ("samples" in label) == (name != "r_w")
    (legend,) = [ax.get_legend() for ax in drawn("settings").axes if ax.get_legend()]
    assert [text.get_text() for text in legend.get_texts()] == ["the paper's setting"]


def test_response_is_drawn_over_voltage_and_over_angle() -> None:
    for row, _, r in points():
        voltage, angle = axes("response", 2, 2)[row]
        for start, times in (("best", r.reached.min(axis=1)), ("worst", r.reached.max(axis=1))):
            np.testing.assert_allclose(curve(voltage, f"controller, {start}"), (r.u_dc, times))
        (area,) = voltage.collections
        corners = area.get_paths()[0].vertices * [1, 1e-3]
        for u, times in zip(r.u_dc, r.bound, strict=True):
            here = corners[corners[:, 0] == u, 1]
            assert (here.min(), here.max()) == pytest.approx((times.min(), times.max()))
        ((u,), (time,)) = curve(voltage, "possible from")
        assert (u, time) == pytest.approx((r.u_least, r.point.response))
        assert level(voltage, "the paper") == pytest.approx(r.point.response)
        for start, times in (("physical", r.bound[1]), ("controller", r.reached[1])):
            np.testing.assert_allclose(seen(angle, start), (np.radians(r.theta_deg), times))
        assert level(angle, "the paper") == pytest.approx(r.point.response)
        assert angle.get_xlim() == (0, 30) and angle.get_ylim()[0] == 0  # one stroke of a 6/4
        assert angle.get_title() == "the same, 240 V"
        assert voltage.get_title() == f"{r.point.tau_ref} N m at {r.point.speed_rpm:g} rpm"
        assert (voltage.get_xscale(), voltage.get_yscale()) == ("log", "log")
        for ticks, texts in (
            (voltage.get_xticks(), voltage.get_xticklabels()),
            (voltage.get_yticks(), voltage.get_yticklabels()),
        ):
            assert [float(text.get_text()) for text in texts] == pytest.approx(list(ticks))


def test_angle_that_is_not_reached_in_time_leaves_a_gap_in_the_worst() -> None:
    r = brief().found.rated_response
    late = replace(r, reached=np.array([[np.inf, 1e-3, 2e-3], r.reached[1]]))
    ax = figures.over_voltage(Figure().add_subplot(), late)
    np.testing.assert_array_equal(np.isnan(curve(ax, "controller, worst")[1]), [True, False])
    assert np.isfinite(curve(ax, "controller, best")[1]).all()


def test_position_function_is_mended_where_it_must_fall_to_zero() -> None:
    shape, torque = drawn("model").axes
    for label, at_45 in (("as printed", 6), ("mended", 0)):
        theta, f = curve(shape, label)
        assert np.degrees(theta[[0, -1]]) == pytest.approx([0, 90])
        np.testing.assert_allclose(np.interp(np.radians([0, 45, 90]), theta, f), [1, at_45, 1])
    _, f = curve(shape, "mended")
    assert f.min() >= -1e-12 and f[: f.size // 2].tolist() == sorted(f[: f.size // 2])[::-1]
    machine = brief().found.rated.locked.drive.machine
    for i in (20, 50, 90):
        theta, tau = curve(torque, f"mended, {i} A")
        assert np.degrees(theta[[0, -1]]) == pytest.approx([0, 45])
        assert tau[[0, -1]] == pytest.approx([0, 0], abs=1e-9)
        energy = machine.co_energy(i, np.pi - 4 * theta)
        np.testing.assert_allclose(tau[1:-1], -np.gradient(energy, theta)[1:-1], rtol=0.01)
        assert curve(torque, f"printed, {i} A")[1][0] > 1  # at alignment


def test_current_of_the_controller_follows_the_one_of_least_copper() -> None:
    for column, runs, _ in points():
        (row,) = axes("limit", 1, 2)
        ax = row[column]
        theta_e, i = curve(ax, "minimum copper loss")
        np.testing.assert_allclose((theta_e, i), (runs.best.theta_e, runs.best.i))
        dots, ours = in_si(ax, ax.lines[0])
        assert dots.min() >= 0 and dots.max() < 2 * np.pi and ax.get_xlim() == (0, 360)
        assert np.ptp(dots) > 6.2 and dots.size == pytest.approx(runs.locked.t.size / 4, abs=2)
        off = ours - np.interp(dots, theta_e, i, period=2 * np.pi)
        assert np.sqrt(np.mean(off**2)) < 2 and np.abs(np.mean(off)) < 0.5  # in a band of 1 A
        assert ax.get_title() == f"{runs.point.tau_ref} N m at {runs.point.speed_rpm:g} rpm, 240 V"


@pytest.mark.parametrize("name", [p.name for p in figures.PICTURES])
def test_every_axis_has_its_label_and_its_grid(name: str) -> None:
    for ax in drawn(name).axes:
        assert ax.get_ylabel() and (ax.get_xlabel() or name == "settings")
        assert ax.xaxis.get_gridlines()[0].get_visible()
