"""Figures and tables of swept points that are given: what is drawn is what is in the points."""

import numpy as np
import pytest
from matplotlib.collections import LineCollection

import reluctance as rl
from reluctance.explore.sweeps import plots
from reluctance.explore.sweeps.plots import label
from reluctance.explore.sweeps.result import Sweep
from reluctance.explore.sweeps.swept import column_of
from reluctance.explore.sweeps.vary import MOST_POINTS, checked, grid, parsed, samples

BANDS, VOLTS = [0.5, 1.0, 2.0], [200, 240]


def swept(values=None, grid_shape=(3, 2), why=None, **figures):
    """Bands over voltages, the voltage fastest; figures by their rows."""
    values = values or {
        "control.i_band_A": [b for b in BANDS for _ in VOLTS],
        "converter.u_dc_V": VOLTS * 3,
    }
    n = len(next(iter(values.values())))
    named = {name: np.full(n, np.nan) for name in rl.Kpis.border_names()}
    named |= {name: np.array(column, float) for name, column in figures.items()}
    return Sweep("mine", values, named, why or [""] * n, grid_shape, ran=n, known=0)


RIPPLE = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6]
SWITCHED = [6e3, 5e3, 4e3, 3.5e3, 3e3, 2e3]


def test_a_line_for_each_of_the_key_with_fewer_values_over_the_other():
    drawn = plots.plot(swept(torque_ripple_pp=RIPPLE, f_switch_Hz=SWITCHED))
    ripple, switched = drawn.axes  # the usual ones that there are
    assert ripple.get_ylabel() == "torque ripple, peak to peak over mean (1)"
    assert switched.get_ylabel() == "switching frequency (Hz)"
    low, high = ripple.lines
    assert low.get_label() == "u dc 200 V" and high.get_label() == "u dc 240 V"
    assert [*low.get_xdata()] == BANDS and [*low.get_ydata()] == [0.1, 0.3, 0.5]
    assert [*high.get_ydata()] == [0.2, 0.4, 0.6]
    assert ripple.get_xlabel() == "i band (A)" and ripple.get_legend() is not None
    assert [*switched.lines[1].get_ydata()] == [5e3, 3.5e3, 2e3]


def test_values_are_drawn_in_rising_order_and_words_in_their_own():
    one = swept({"control.i_band_A": [2.0, 0.5, 1.0]}, (3,), i_rms_A=[20, 5, 10])
    (line,) = plots.plot(one, "i_rms").axes[0].lines
    assert [*line.get_xdata()] == BANDS and [*line.get_ydata()] == [5, 10, 20]
    assert plots.plot(one, "i_rms").axes[0].get_legend() is None
    words = swept({"control.law": ["ditc", "angles"]}, (2,), i_rms_A=[7, 6])
    (line,) = plots.plot(words, "i_rms").axes[0].lines
    assert [*line.get_xdata()] == ["ditc", "angles"] and [*line.get_ydata()] == [7, 6]


def test_a_heat_map_has_the_first_key_upwards_and_grey_where_there_is_no_figure():
    broken = swept(torque_ripple_pp=[*RIPPLE[:5], np.nan], why=[""] * 5 + ["no"])
    (ax, *_) = plots.plot(broken, "torque_ripple_pp", "heat").axes
    (mesh,) = ax.collections
    z = mesh.get_array().reshape(3, 2)
    assert z[:2].tolist() == [[0.1, 0.2], [0.3, 0.4]] and z.mask[2].tolist() == [False, True]
    assert ax.get_ylabel() == "i band (A)" and ax.get_xlabel() == "dc-link voltage (V)"
    corners = mesh.get_coordinates()
    assert corners[0, :, 0].tolist() == [180, 220, 260]  # around 200 V and 240 V
    assert "grey" in ax.figure.get_supxlabel()
    whole = plots.plot(swept(torque_ripple_pp=RIPPLE), "torque_ripple_pp", "heat")
    assert whole.get_supxlabel() == ""
    with pytest.raises(rl.ParameterError, match="needs a grid over two keys"):
        plots.plot(swept(grid_shape=(), torque_ripple_pp=RIPPLE), "torque_ripple_pp", "heat")
    words = swept(
        {"control.law": ["a", "a", "b", "b"], "machine": ["x", "y"] * 2},
        (2, 2),
        i_rms_A=[1, 2, 3, 4],
    )
    (ax, *_) = plots.plot(words, "i_rms", "heat").axes
    assert [t.get_text() for t in ax.get_xticklabels()] == ["x", "y"]
    assert [t.get_text() for t in ax.get_yticklabels()] == ["a", "b"]


def test_a_parallel_line_goes_through_the_values_of_its_point_between_their_extremes():
    values = {
        "control.i_band_A": [0.5, 1.0, 2.5, 2.0],
        "control.law": ["ditc", "deadbeat", "angles", "ditc"],
        "machine.R_ohm": [1, 1, 1, 1],
    }
    found = swept(values, (), i_rms_A=[10, 20, 30, np.nan], why=["", "", "", "no"])
    (ax,) = plots.plot(found, "i_rms").axes  # no grid over two keys: parallel by itself
    (lines,) = [c for c in ax.collections if isinstance(c, LineCollection)]
    drawn = [segment[:, 1].tolist() for segment in lines.get_segments()]
    # The greatest first, so that the least lies on top; what did not vary has no axis.
    assert drawn == [[1, 1, 1], [0.25, 0.5, 0.5], [0, 0, 0]]
    texts = [text.get_text() for text in ax.texts]
    assert texts[:3] == ["0.5", "1.5", "2.5"] and texts[3].startswith("i band")
    assert texts[4:7] == ["ditc", "deadbeat", "angles"] and texts[8:11] == ["10", "20", "30"]
    assert "colour: rms phase current (A)" in ax.figure.get_supxlabel()
    (bold,) = [text for text in ax.texts if text.get_fontweight() == "bold"]
    assert bold.get_text() == "rms phase current\n(A)"
    assert [*ax.figure.get_size_inches()] == [7.0, 4.6]
    more = {f"control.theta_{n}_deg": [1, 2, 3, 4] for n in range(4)}
    (ax,) = plots.plot(swept(values | more, (), i_rms_A=[10, 20, 30, 40]), "i_rms").axes
    assert [*ax.figure.get_size_inches()] == [1.7 * 7, 4.6]  # for each of the axes


def test_a_front_has_the_points_that_none_beats_and_efficiency_is_better_when_greater():
    found = swept(torque_ripple_pp=RIPPLE, f_switch_Hz=[1, 6, 5, 7, 0.5, 8])
    (ax,) = plots.plot(found, ["torque_ripple_pp", "f_switch"], "pareto").axes
    points, best = ax.lines
    assert len(points.get_xdata()) == 6
    assert [*best.get_xdata()] == [0.1, 0.5] and [*best.get_ydata()] == [1, 0.5]
    found = swept(torque_ripple_pp=RIPPLE, efficiency=[0.5, 0.6, 0.55, 0.7, 0.65, 0.8])
    (ax,) = plots.plot(found, ["torque_ripple_pp", "efficiency"], "pareto").axes
    assert [*ax.lines[1].get_xdata()] == [0.1, 0.2, 0.4, 0.6]
    with pytest.raises(rl.ParameterError, match="two figures, not torque_ripple_pp"):
        plots.plot(found, "torque_ripple_pp", "pareto")


@pytest.mark.parametrize(
    ("counts", "grid_shape", "kind"),
    [
        ((9,), True, "lines"),
        ((9, 8), True, "lines"),  # eight lines in a panel are seen
        ((9, 9), True, "heat"),
        ((2, 2, 2), True, "parallel"),
        ((9, 1, 9), True, "heat"),  # what has one value is not varied
        ((9,), False, "lines"),
        ((4, 4), False, "parallel"),
    ],
)
def test_the_kind_of_figure_suits_what_was_varied(counts, grid_shape, kind):
    values = grid({f"control.{name}": [*range(n)] for name, n in zip("abc", counts)})  # noqa: B905
    assert plots._suits(swept(values, counts if grid_shape else ())) == kind


def test_what_cannot_be_drawn_says_why():
    with pytest.raises(rl.ParameterError, match="kind = 'pie', need one of lines, heat"):
        plots.plot(swept(torque_ripple_pp=RIPPLE), kind="pie")
    broken = swept(why=["the voltage is low"] * 6)
    with pytest.raises(rl.ParameterError, match="no point has i_rms_A; the voltage is low"):
        plots.plot(broken, "i_rms")
    with pytest.raises(rl.ParameterError, match="no point has i_rms; first reason: the voltage"):
        broken.best("i_rms")
    with pytest.raises(rl.ParameterError, match="no point has i_rms; first reason: none"):
        swept().best("i_rms")


def test_the_best_point_is_the_least_and_on_demand_the_greatest():
    found = swept(torque_ripple_pp=[np.nan, *RIPPLE[1:]], why=["no"] + [""] * 5)
    assert (len(found), found.failed, found.reason()) == (6, 1, "no")
    best = found.best("torque_ripple_pp")
    assert (best["control.i_band_A"], best["converter.u_dc_V"]) == (0.5, 240)
    assert best["torque_ripple_pp"] == 0.2
    assert found.best("torque_ripple_pp", most=True)["torque_ripple_pp"] == 0.6
    assert repr(found) == "Sweep(mine: 6 points over control.i_band_A, converter.u_dc_V)"
    table = found.columns()
    assert [*table][:2] == ["control.i_band_A", "converter.u_dc_V"] and [*table][-1] == "why"


@pytest.mark.parametrize(
    ("key", "text"),
    [
        ("i_rms_A", "rms phase current (A)"),
        ("efficiency", "efficiency (1)"),
        ("control.T_s_us", "T s (µs)"),
        ("control.theta_ov_deg", "theta ov (°)"),
        ("machine.R_ohm", "R (Ω)"),
        ("reference.tau_Nm", "tau (N m)"),
        ("control.law", "law"),
        ("sensing.i_offset_A.2", "i offset 2 (A)"),
        ("sensing.i_gain.0", "i gain 0"),
        ("faults.0.t_s", "t (s)"),
        ("machine.N_s", "N s"),
    ],
)
def test_labels_have_the_name_and_the_unit_of_a_key(key, text):
    assert label(key) == text


def test_columns_are_numbers_where_all_values_are():
    assert column_of([1, 2.5]).dtype == float
    assert column_of([1, "a"]).tolist() == ["1", "a"]
    assert column_of([True, False]).tolist() == ["True", "False"]


def test_panels_stand_in_two_columns_and_no_place_is_left_empty():
    four = {name: RIPPLE for name in ("torque_ripple_pp", "efficiency", "i_rms_A")}
    drawn = plots.plot(swept(**four))
    assert len(drawn.axes) == 3
    boxes = [ax.get_subplotspec().get_geometry() for ax in drawn.axes]
    assert [box[:2] for box in boxes] == [(2, 2)] * 3 and [b[2] for b in boxes] == [0, 1, 2]
    (one,) = plots.plot(swept(**four), "i_rms").axes
    assert one.get_subplotspec().get_geometry()[:2] == (1, 1)


@pytest.mark.parametrize(
    ("given", "told"),
    [
        (5, "need a dict"), ({}, "need a dict"), ({"a.b": "12"}, "need a list of values"),
        ({"a.b": 3}, "need a list of values"), ({"a.b": []}, "need at least one value"),
    ],
)  # fmt: skip
def test_what_cannot_be_varied_is_refused(given, told):
    with pytest.raises(rl.ParameterError, match=told):
        checked(given)


def test_lists_of_numbers_may_be_arrays_and_ranges():
    assert checked({"a.b": np.array([1.5, 2.5]), "c.d": range(2)}) == {
        "a.b": [1.5, 2.5],
        "c.d": [0, 1],
    }


def test_more_points_than_fit_into_memory_are_refused():
    with pytest.raises(rl.ParameterError, match=r"the grid has 1e\+08 points, need at most 1e\+07"):
        grid({"a": [0] * 10_000, "b": [0] * 10_000})
    with pytest.raises(rl.ParameterError, match="need at most"):
        parsed(f"a.b=0:1:{MOST_POINTS + 1}")


@pytest.mark.parametrize("wrong", [0, -1, True, 2.0, MOST_POINTS + 1])
def test_a_number_of_samples_is_a_positive_whole_one(wrong):
    with pytest.raises(rl.ParameterError, match="samples = "):
        samples(None, {"a.b": [0, 1]}, wrong, sobol=False, seed=0)
    with pytest.raises(rl.ParameterError, match=r"seed = .*need a whole number >= 0"):
        samples(None, {"a.b": [0, 1]}, 1, sobol=False, seed=-1)
