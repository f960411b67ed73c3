"""What a reader must know of key figures is said where it holds, and nowhere else."""

from dataclasses import fields

import numpy as np
import pytest

from reluctance.base.key_figures import Kpis, definite, shown, start_included


def kpis(**values):
    """A drive that holds its reference, settled, over ten periods."""
    usual = dict.fromkeys((f.name for f in fields(Kpis)), 1.0)
    held = {"periods": 10, "torque_drift": 0.0, "speed_mean": 100.0, "energy_residual": 1e-7}
    return Kpis(**usual | held | values)


@pytest.mark.parametrize(
    ("values", "told"),
    [
        ({}, None),
        ({"periods": 1}, "one whole electrical period is evaluated"),
        ({"periods": 0, "speed_mean": 0.0}, "no electrical period ends at standstill"),
        ({"periods": 0, "speed_mean": -0.98e-3}, "no electrical period ends at standstill"),
        ({"periods": 0, "speed_mean": 1.02e-3}, "no whole electrical period"),
        ({"periods": 0, "speed_mean": -5.0}, "no whole electrical period"),
        ({"periods": 2}, None),
        ({"torque_drift": 0.021}, "the torque has not settled (a period's mean is up to 2.1% off)"),
        ({"torque_drift": 0.019}, None),
        ({"torque_drift": 0.5, "periods": 2}, "the torque has not settled"),
        ({"tau_mean": 0.5, "periods": 2}, "not held (50% of it)"),
        ({"torque_drift": None}, None),
        ({"torque_drift": 0.5, "periods": 1}, "one whole electrical period"),
        ({"tau_mean": 0.94}, "not held (94% of it); `reluctance limit` tells"),
        ({"tau_mean": 0.96}, None),
        ({"tau_mean": 20.0, "tau_ref_mean": 40.0}, "not held (50% of it)"),
        ({"tau_mean": 40.5, "tau_ref_mean": 40.0}, None),
        ({"tau_mean": 1.06}, "not held (106% of it); the law, its sensors or its model"),
        ({"tau_mean": 1.04}, None),
        ({"tau_mean": -0.5}, "not held (-50% of it); the law"),
        ({"tau_mean": 0.5, "periods": 1}, "one whole electrical period"),
        ({"tau_mean": 0.5, "tau_ref_mean": None}, None),
        ({"tau_mean": 0.5, "tau_ref_mean": 0.0}, None),
        ({"energy_residual": 1.02e-3}, "leaves 0.001 of the energy supplied open"),
        ({"energy_residual": 0.98e-3}, None),
        ({"energy_residual": None}, None),
    ],
)
def test_each_remark_stands_where_it_holds(values, told):
    remarks = kpis(**values).remarks()
    assert len(remarks) == (told is not None)
    assert told is None or told in remarks[0]


def test_figures_that_are_not_there_include_no_start():
    assert start_included(float("nan"), float("nan")) == ""


def test_a_drive_that_is_asked_for_a_course_need_not_settle():
    assert kpis(torque_drift=0.5).remarks(steady=False) == []


def test_figures_have_the_unit_that_their_name_ends_in():
    told = kpis(speed_mean=np.pi, Q_mean=2.0, i_rms=3.0, efficiency=0.5, p_fe=None).with_units()
    assert told["speed_mean_rpm"] == pytest.approx(30) and told["Q_mean_m3ph"] == 7200
    assert told["i_rms_A"] == 3 and told["efficiency"] == 0.5 and told["p_fe_W"] is None
    page = kpis(p_fe=None)._repr_html_()
    assert "<td>p_fe_W</td><td>-</td>" in page and "<td>speed_mean_rpm</td><td>954.93</td>" in page


def test_a_figure_without_meaning_is_a_dash_and_no_number():
    assert shown(None) == "-" and shown(1 / 3) == "0.333333" and shown(0.5, "{:.0%}") == "50%"
    assert definite(2.0) == 2.0
    with pytest.raises(RuntimeError, match="without meaning"):
        definite(None)
