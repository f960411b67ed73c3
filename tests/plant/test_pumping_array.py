"""The array's curve: the reference points, pvlib's own solver, and light that is absent."""

import numpy as np
import pytest
from pvlib import pvsystem

from reluctance.base.errors import ParameterError
from reluctance.base.schema import checked
from reluctance.plant.solar.single_diode import array_diode, current, open_circuit, power_point
from reluctance.pumping.array import Array

MODULE = "Canadian_Solar_Inc__CS6X_300M"
PLANE = {"n_series": 7, "n_parallel": 6, "tilt_deg": 10.0}
# Made with pvlib 0.16: G, T_cell, V_mp, I_mp, P_mp, V_oc, I at 240 V of 7 x 6 modules.
POINTS = [
    (1000, 25, 255.50, 49.320, 12601.3, 315.00, 51.1835),
    (1000, 50, 226.80, 49.339, 11190.3, 286.71, 45.1411),
    (800, 45, 233.30, 39.539, 9224.3, 289.29, 38.1401),
    (300, 30, 247.83, 14.851, 3680.6, 293.42, 15.2106),
    (200, 25, 250.75, 9.896, 2481.4, 294.04, 10.1887),
]


def array(**changes):
    return checked(Array, {"module": MODULE, **PLANE, **changes}, "[array]")


@pytest.mark.parametrize("point", POINTS, ids=lambda p: f"{p[0]}W {p[1]}C")
def test_reference_points_of_the_array(point):
    G, T, *expected = point
    diode = array().diode(np.full(1, float(G)), np.full(1, float(T)))
    best = power_point(diode)
    found = [best.u, best.i, best.p, best.u_oc, current(diode, 240.0)]
    assert np.array(found)[:, 0] == pytest.approx(expected, rel=1e-4)


def test_ten_thousand_random_points_agree_with_pvlib():
    rng = np.random.default_rng(7)
    n = 10_000
    G, T, part = rng.uniform(1, 1300, n), rng.uniform(-20, 85, n), rng.uniform(0, 1.05, n)
    m = array().reference
    five = pvsystem.calcparams_cec(
        G, T, m.alpha_sc, m.a_ref, m.I_L_ref, m.I_o_ref, m.R_sh_ref, m.R_s, m.adjust
    )
    best = pvsystem.singlediode(*five, method="newton")
    diode = array_diode(m, G, T, n_series=1, n_parallel=1)
    found = power_point(diode)
    assert found.u == pytest.approx(best["v_mp"].to_numpy(), rel=1e-6)
    assert found.p == pytest.approx(best["p_mp"].to_numpy(), rel=1e-9)
    assert found.u_oc == pytest.approx(best["v_oc"].to_numpy(), rel=1e-9)
    u = part * found.u_oc
    theirs = pvsystem.i_from_v(u, *five, method="lambertw")
    assert current(diode, u) == pytest.approx(theirs, rel=1e-9, abs=1e-9)


def test_modules_in_series_add_voltage_and_in_parallel_current():
    G, T = np.full(1, 700.0), np.full(1, 40.0)
    one = power_point(array(n_series=1, n_parallel=1).diode(G, T))
    many = power_point(array(n_series=5, n_parallel=3).diode(G, T))
    assert many.u == pytest.approx(5 * one.u, rel=1e-9)
    assert many.i == pytest.approx(3 * one.i, rel=1e-9)


def test_the_power_point_is_the_greatest_of_a_brute_force_search():
    diode = array().diode(np.full(1, 640.0), np.full(1, 51.0))
    u = np.linspace(0, float(open_circuit(diode)[0]), 20_001)
    assert power_point(diode).p[0] == pytest.approx((u * current(diode, u)).max(), rel=1e-7)


def test_without_light_there_is_no_voltage_and_no_power():
    best = power_point(array().diode(np.zeros(3), np.array([-10.0, 20.0, 60.0])))
    assert np.all(best.u == 0) and np.all(best.p == 0) and np.all(np.isfinite(best.i))


def test_five_numbers_do_as_well_as_a_name():
    m = array().reference
    numbers = {
        "I_L_ref_A": m.I_L_ref,
        "I_o_ref_A": m.I_o_ref,
        "R_s_ohm": m.R_s,
        "R_sh_ref_ohm": m.R_sh_ref,
        "a_ref_V": m.a_ref,
        "alpha_sc_ApK": m.alpha_sc,
        "adjust_pct": m.adjust,
    }
    assert array(module=None, cell=numbers).reference == m


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"module": "Canadian_Solar_CS6X_300M"}, "nearest: `Canadian_Solar"),
        ({"module": "Canadian_Solar_Inc__CS6X_300P"}, "alpha_sc = -0.004"),
        ({"module": None}, "need one of `module`"),
        ({"n_series": 0}, "n_series = 0, need >= 1"),
        ({"tilt_deg": 95.0}, "tilt_deg = 95.0, need <= 90"),
        ({"soiling": 1.0}, "soiling = 1.0, need < 1"),
    ],
)
def test_an_array_that_cannot_be_is_refused_on_one_line(changes, message):
    with pytest.raises(ParameterError) as fault:
        _ = array(**changes).reference
    assert message in str(fault.value) and "\n" not in str(fault.value)
