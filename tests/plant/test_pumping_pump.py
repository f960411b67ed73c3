"""Pump, pipe and lift: affinity, the reference table, `fluids` for friction, curves refused."""

import warnings
from pathlib import Path

import numpy as np
import pytest
from fluids import friction_factor
from hypothesis import given
from hypothesis import strategies as st

from reluctance.base.errors import Note, ParameterError
from reluctance.base.schema import checked
from reluctance.plant.hydraulics.curve import GRAVITY, RHO
from reluctance.plant.hydraulics.pipe import Pipe, flow, hydraulics, least_speed
from reluctance.plant.hydraulics.pump import Pump, pump_from

PUMP = pump_from("synthetic_70_25", Path())
PIPE = {"H_static_m": 15.0, "L_m": 120.0, "D_mm": 125.0, "roughness_mm": 0.05, "K": 4.0}


def pipe(**changes):
    return checked(Pipe, {**PIPE, **changes}, "[pipe]")


def test_the_table_of_the_reference_pump_to_four_digits():
    curve, r = PUMP.curve(), np.array([0.70, 0.80, 0.90, 1.00])
    Q = flow(curve, pipe(), r)
    H, P = curve.head(Q, r), curve.shaft_power(Q, r)
    assert Q * 3600 == pytest.approx([18.039, 52.220, 74.039, 92.598], rel=5e-5)
    assert H == pytest.approx([15.215, 16.584, 18.089, 19.751], rel=5e-5)
    assert pipe().friction_head(Q) == pytest.approx([0.215, 1.584, 3.089, 4.751], abs=5e-4)
    assert RHO * GRAVITY * Q * H / P == pytest.approx([0.4325, 0.7167, 0.6979, 0.6450], abs=5e-5)
    assert P == pytest.approx([1725.4, 3285.7, 5218.2, 7710.6], rel=5e-5)
    assert P / (r * curve.omega_ref) == pytest.approx([15.69, 26.15, 36.91, 49.09], abs=5e-3)
    assert least_speed(curve, pipe()) == pytest.approx(0.68465, abs=5e-6)


@given(Q=st.floats(0, 0.03), r=st.floats(0.2, 1.2), k=st.floats(0.3, 2))
def test_affinity_flow_head_and_power_scale_as_one_two_three(Q, r, k):
    curve = PUMP.curve()
    assert curve.head(k * Q, k * r) == pytest.approx(k**2 * curve.head(Q, r), abs=1e-9)
    assert curve.shaft_power(k * Q, k * r) == pytest.approx(
        k**3 * curve.shaft_power(Q, r), rel=1e-9
    )


def test_a_pipe_that_lets_nothing_through_is_refused():
    """0.05 m typed for 50 mm; a thin pipe and a high lift are none."""
    curve, most = PUMP.curve(), PUMP.omega_max
    with pytest.raises(ParameterError, match=r"D_mm = 0.05 lets .* check the unit"):
        hydraulics(curve, pipe(D_mm=0.05), most)
    assert hydraulics(curve, pipe(D_mm=25.0), most).Q[-1] > 0
    lift = 0.97 * curve.H_0 * (most / curve.omega_ref) ** 2
    assert hydraulics(curve, pipe(H_static_m=lift), most).Q[-1] > 0


@pytest.mark.parametrize("mark", [";", "\t"])
def test_a_curve_with_semicolons_and_decimal_commas(mark, tmp_path):
    heads = ("Q [m³/h]", "H [m]", "P1 [kW]", "eta [%]")
    rows = [(0.0, 61.5, 1.5, 0.0), (5.5, 55.0, 2.0, 41.5), (10.0, 45.2, 2.5, 55.5)]
    own, usual = tmp_path / "own.csv", tmp_path / "usual.csv"
    usual.write_text("\n".join([",".join(heads), *(",".join(map(str, row)) for row in rows)]))
    text = [mark.join(str(x).replace(".", ",") for x in row) for row in rows]
    own.write_text("\n".join(["# of the maker", mark.join(heads), *text]), encoding="utf-8-sig")
    a, b = (Pump(n_ref_rpm=2900.0, curve_csv=str(path)).curve() for path in (own, usual))
    Q = np.linspace(0, 0.0027, 9)
    assert a.head(Q, np.ones(9)) == pytest.approx(b.head(Q, np.ones(9)), rel=1e-12)
    assert a.shaft_power(Q, np.ones(9)) == pytest.approx(b.shaft_power(Q, np.ones(9)), rel=1e-12)
    own.write_bytes("Q_m3ph,H_m,eta\n# 20 °C\n0,60,0\n".encode("latin-1"))
    few = pytest.raises(ParameterError, match="Q_m3ph needs at least 3 rising flows")
    with pytest.warns(Note, match="not in UTF-8; it was read as Latin-1"), few:
        Pump(n_ref_rpm=2900.0, curve_csv=str(own)).curve()


def test_shaft_power_is_finite_and_continuous_without_flow():
    curve = PUMP.curve()
    P = curve.shaft_power(np.array([0.0, 1e-9, 1e-6]), np.ones(3))
    assert P[0] > 0 and P == pytest.approx(P[0], rel=1e-3)


@given(
    Q=st.floats(1e-3, 0.05), D_mm=st.floats(50, 300), rough=st.floats(0.0, 0.3), L=st.floats(1, 500)
)
def test_friction_agrees_with_fluids(Q, D_mm, rough, L):
    found = pipe(D_mm=D_mm, roughness_mm=rough, L_m=L, K=2.0).friction_head(np.full(1, Q))[0]
    D = D_mm * 1e-3
    v = Q / (np.pi * D**2 / 4)
    f = friction_factor(Re=v * D / 1e-6, eD=rough / D_mm, Method="Swamee_Jain_1976")
    assert found == pytest.approx((f * L / D + 2.0) * v**2 / (2 * GRAVITY), rel=5e-3)


def test_friction_of_the_reference_pipe_agrees_with_colebrook():
    for Q in np.array([20.0, 50, 75, 95]) / 3600:
        v = Q / (np.pi * 0.125**2 / 4)
        f = friction_factor(Re=v * 0.125 / 1e-6, eD=0.05 / 125)
        expected = (f * 120 / 0.125 + 4) * v**2 / (2 * GRAVITY)
        assert pipe().friction_head(np.full(1, Q))[0] == pytest.approx(expected, rel=5e-3)


def test_nothing_flows_below_the_speed_that_reaches_the_static_head():
    curve = PUMP.curve()
    r = least_speed(curve, pipe()) * np.array([0.0, 0.5, 0.999, 1.001, 1.01])
    Q = flow(curve, pipe(), r)
    assert np.all(Q[:3] == 0) and np.all(np.diff(Q[2:]) > 0)


def test_the_table_over_speed_meets_the_solution_between_its_nodes():
    curve, table = PUMP.curve(), hydraulics(PUMP.curve(), pipe(), PUMP.omega_max)
    omega = np.linspace(table.omega[0], table.omega[-1], 777)
    exact = flow(curve, pipe(), omega / curve.omega_ref)
    assert np.interp(omega, table.omega, table.Q) == pytest.approx(
        exact, rel=1e-3, abs=1e-3 * exact[-1]
    )
    assert np.all(np.diff(table.p_shaft) > 0)


def test_without_static_head_the_pump_lifts_from_a_creeping_speed_on():
    table = hydraulics(PUMP.curve(), pipe(H_static_m=0.0, L_m=600.0, K=20.0), PUMP.omega_max)
    assert table.omega[0] < 0.03 * PUMP.omega_max
    assert np.all(np.isfinite(table.p_shaft)) and np.all(table.Q[1:] > 0)


def written(tmp_path, text):
    (tmp_path / "curve.csv").write_text(text)
    return {"n_ref_rpm": 1500.0, "curve_csv": "curve.csv"}


def test_points_of_a_curve_do_as_well_as_its_parameters(tmp_path):
    curve = PUMP.curve()
    Q = np.linspace(0, curve.Q_end, 15)
    H, P = curve.head(Q, np.ones(15)), curve.shaft_power(Q, np.ones(15))
    rows = [f"{q * 3600},{h},{p}" for q, h, p in zip(Q, H, P, strict=True)]
    table = written(tmp_path, "\n".join(["# a comment", "Q_m3ph,H_m,p_shaft_W", *rows]))
    found = pump_from(table, tmp_path).curve()
    r = np.array([0.75, 0.9, 1.0])
    assert flow(found, pipe(), r) == pytest.approx(flow(curve, pipe(), r), rel=2e-3)
    eta = RHO * GRAVITY * Q * H / P
    rows = [f"{q * 3600},{h},{e}" for q, h, e in zip(Q, H, eta, strict=True)]
    by_eta = pump_from(written(tmp_path, "\n".join(["Q_m3ph,H_m,eta", *rows])), tmp_path).curve()
    q = flow(curve, pipe(), r)
    assert by_eta.shaft_power(q, r) == pytest.approx(curve.shaft_power(q, r), rel=2e-3)


def test_flows_in_litres_per_second_are_asked_about_and_the_answer_is_the_pump(tmp_path):
    points = [(0, 32.0, 700.0), (1.5, 29.0, 900.0), (3.0, 24.0, 1100.0), (4.5, 15.0, 1200.0)]
    rows = "".join(f"{q},{h},{p}\n" for q, h, p in points)
    with pytest.warns(
        Note, match=r"best efficiency is 17\.8 %; .* `Q \[l/s\]`: then it is 64\.1 %"
    ):
        poor = pump_from(written(tmp_path, "Q_m3ph,H_m,p_shaft_W\n" + rows), tmp_path).curve()
    meant = pump_from(written(tmp_path, "Q [l/s],H_m,p_shaft_W\n" + rows), tmp_path).curve()
    assert meant.Q_end == pytest.approx(3.6 * poor.Q_end)


def test_a_small_pump_may_have_heads_and_powers_below_one(tmp_path):
    text = "Q_m3ph,H_m,p_shaft_W\n0,2,0.5\n0.1,1.5,0.8\n0.2,0.5,0.9\n0.25,0,0.8\n"
    curve = pump_from(written(tmp_path, text), tmp_path).curve()
    assert [float(curve.head_1(q / 3600)) for q in (0, 0.2, 0.25)] == pytest.approx([2, 0.5, 0])
    assert float(curve.power_1(0.2 / 3600)) == pytest.approx(0.9)


def test_a_makers_sheet_with_lines_above_its_names_and_foreign_units_is_the_same_curve(tmp_path):
    points = [(0, 60.0, 0.0), (4, 56.0, 0.4), (8, 45.0, 0.6), (11, 33.0, 0.55)]
    plain = "Q_m3ph,H_m,eta\n" + "".join(f"{q},{h},{e}\n" for q, h, e in points)
    sheet = "Pump type: ABC 5-33\nUnits as printed;;\nQ [US gpm];Head [ft];Eff [%]\n" + "".join(
        f"{q / 0.22712470704:.9f};{h / 0.3048:.9f};{100 * e}\n".replace(".", ",")
        for q, h, e in points
    )
    Q = np.linspace(0, 11, 23) / 3600
    curves = [pump_from(written(tmp_path, text), tmp_path).curve() for text in (plain, sheet)]
    assert np.allclose(curves[0].head_1(Q), curves[1].head_1(Q), rtol=1e-8)
    assert np.allclose(curves[0].power_1(Q), curves[1].power_1(Q), rtol=1e-8)


def test_a_pump_that_runs_out_is_answered_with_the_speed_at_which_it_does_not():
    curve, low = PUMP.curve(), pipe(H_static_m=3.0, L_m=1.0, K=0.0)
    with pytest.raises(ParameterError, match="runs out past") as fault:
        hydraulics(curve, low, PUMP.omega_max)
    speed = float(str(fault.value).partition("speed_max_rpm to ")[2].partition(",")[0])
    hydraulics(curve, low, speed * np.pi / 30)
    with pytest.raises(ParameterError, match="runs out past"):
        hydraulics(curve, low, (speed + 2) * np.pi / 30)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("Q_m3ph,H_m,eta\n0,30,0\n10,25,0.3\n20,28,0.5\n30,20,.6", "does not fall from 25 to 28 m"),
        (
            "Q_m3ph,H_m,eta\n0,30,0\n10,31,0.3\n20,32,0.5\n30,20,.6",
            "need at least two points behind",
        ),
        ("Q_m3ph,H_m,eta\n-5,30,0.1\n10,29,0.3\n20,28,0.5", "rising flows, none below 0"),
        (
            "Q_m3ph,H_m,eta\n0,30,0\n10,29,30\n20,28,50",
            "fractions between 0 and 1 where Q > 0; a column in per cent is named `eta [%]`",
        ),
        (
            "Q_m3ph,H_m,Eff [%]\n0,30,0\n10,29,0.4\n20,28,0.6\n30,20,.5",
            "the best efficiency is 0.6 %, need at least 3 %; if the column has fractions, name",
        ),
        (
            "Q_m3ph,H_m,P2 [W]\n0,70,0.5\n4,64,0.9\n10.8,26,1.5",
            "at Q_m3ph = 4 the water takes 696 W and the shaft has 0.9 W; correct the unit",
        ),
        ("Q_m3ph,H_m,p_shaft_W\n0,70,300\n4,64,900\n7,50,950", "takes 952 W and the shaft"),
        (
            "Q_m3ph,H_m,Eff [%],P2 [kW]\n0,70,0,500\n4,64,60,1160\n7,50,62,1540",
            "power means an efficiency of 0.0618 %, the column of the efficiency has 62 %",
        ),
        (
            "Q_m3ph,H_m,eta,p_shaft_W\n0,70,0,500\n4,64,0.2,1160\n7,50,0.6,1540",
            "of 60 %, the column of the efficiency has 20 %; correct the unit of the wrong one",
        ),
        ("Q_m3ph,H_m\n0,30\n10,29\n20,28", "need Q_m3ph, H_m and eta or p_shaft_W"),
        ("Q_m3ph,p [kPa],eta\n0,300,0", "`p` is the shaft power, and a pressure is a head"),
        ("Pump 7,,\nQ_m3ph,p [kPa],eta\n0,300,0", "`p` is the shaft power, and a pressure is a"),
        ("Q_m3ph,H [bar],eta\n0,3,0", "multiply its numbers by 10.22 and name it `H [m]`"),
        ("Q_m3ph,H [psi],eta\n0,40,0", "multiply its numbers by 0.7043 and name it `H [m]`"),
        ("Q_m3ph,H_m,eta\n0,a,0", "data row 1, H_m: `a` is not a number"),
        ("", "the file has no rows"),
    ],
)
def test_a_curve_that_is_none_is_refused_on_one_line(tmp_path, text, message):
    with pytest.raises(ParameterError) as fault:
        pump_from(written(tmp_path, text), tmp_path).curve()
    assert message in str(fault.value) and "\n" not in str(fault.value)


@pytest.mark.parametrize(
    ("names", "told"),
    [
        ("Q,H,eta", "no unit in the names Q, H: m3/h, m are taken"),
        ("Q [l/s],head,eta", "no unit in the names head: m are taken"),
        ("Q_m3ph,H_m,power", "no unit in the names power: W are taken"),
        ("Q [l/s],H [ft],efficiency [%]", None),
        ("Q_m3ph,H_m,eta", None),
    ],
)
def test_units_that_the_names_of_a_curve_leave_open_are_told(tmp_path, names, told):
    rows = "0,30,0\n10,26,0.5\n20,18,0.6\n30,8,0.4"
    if "power" in names:
        rows = "0,30,800\n10,26,1400\n20,18,1700\n30,8,1800"
    if "%" in names:
        rows = "0,30,0\n10,26,50\n20,18,60\n30,8,40"
    given = pump_from(written(tmp_path, f"{names}\n{rows}\n"), tmp_path)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        given.curve()
    units = [str(w.message) for w in caught if "no unit" in str(w.message)]
    assert len(units) == (told is not None)
    assert told is None or told in units[0]


def test_an_efficiency_of_pump_and_motor_beside_a_shaft_power_is_told(tmp_path):
    """80 % of the pump's: the power counts."""
    text = "Q_m3ph,H_m,eta,p_shaft_W\n0,70,0,500\n4,64,0.48,1160\n5.5,57.5,0.5,1410\n7,50,0.5,1560"
    with pytest.warns(Note, match=r"of 60 %, the column .* 48 %; the power counts"):
        both = pump_from(written(tmp_path, text), tmp_path).curve()
    alone = "\n".join(",".join(row.split(",")[i] for i in (0, 1, 3)) for row in text.splitlines())
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        power = pump_from(written(tmp_path, alone), tmp_path).curve()
    assert np.array_equal(both.power_1(both.Q_end / 2), power.power_1(power.Q_end / 2))


def test_an_efficiency_of_zero_at_a_flow_says_nothing_beside_a_power(tmp_path):
    """Some makers leave the end of the column at 0."""
    text = "Q_m3ph,H_m,p_shaft_W,eta\n0,30,800,0\n10,25,1300,0.523\n15,20,1400,0\n20,14,1500,0.507"
    curve = pump_from(written(tmp_path, text), tmp_path).curve()
    assert float(curve.power_1(15 / 3600)) == pytest.approx(1400)


def test_a_pump_may_be_smaller_than_one_in_every_unit():
    small = {"n_ref_rpm": 1500.0, "H_0_m": 0.9, "Q_b_m3ph": 0.6, "H_b_m": 0.7, "eta_b": 0.2}
    curve = pump_from(small, Path()).curve()
    assert float(curve.head_1(0.0)) == pytest.approx(0.9)
    assert float(curve.head_1(0.6 / 3600)) == pytest.approx(0.7)
    for key in small:
        with pytest.raises(ParameterError, match=f"{key} = 0"):
            pump_from(small | {key: 0.0}, Path())


def test_a_curve_that_is_better_between_its_points_than_at_them_is_told(tmp_path):
    text = "Q_m3ph,H_m,p_shaft_W\n0,70,500\n4,64,1160\n7,50,1540"
    with pytest.warns(Note, match="between its points") as told:
        curve = pump_from(written(tmp_path, text), tmp_path).curve()
    Q = np.linspace(0, curve.Q_end, 4001)
    best = (998.2 * 9.80665 * Q * curve.head_1(Q) / curve.power_1(Q)).max()
    at_points = 998.2 * 9.80665 * 7 / 3600 * 50 / 1540
    line = str(told[0].message)
    assert f"an efficiency of {100 * best:.3g} % (at Q_m3ph = 5." in line
    assert f"the best point has {100 * at_points:.3g} %" in line


BEST = {"n_ref_rpm": 1500.0, "H_0_m": 32.0, "Q_b_m3ph": 70.0, "H_b_m": 25.0, "eta_b": 0.72}


@pytest.mark.parametrize(
    ("pump", "message"),
    [
        ({**BEST, "H_b_m": 32.0}, "rises with flow"),
        ({**BEST, "eta_b": 72.0}, "eta_b = 72.0, need < 1"),
        ({**BEST, "n_ref_rpm": 25.0}, "25 revolutions a second are 1500 rpm"),
        ({"n_ref_rpm": 1500.0}, "or curve_csv"),
        ("synthetic_70", "did you mean `synthetic_70_25`"),
        (None, "missing table [pump]"),
    ],
)
def test_a_pump_that_cannot_be_is_refused_on_one_line(pump, message):
    with pytest.raises(ParameterError) as fault:
        pump_from(pump, Path())
    assert message in str(fault.value) and "\n" not in str(fault.value)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"H_static_m": 50.0}, "the pump reaches 42.32 m"),
        ({"H_static_m": 0.0, "L_m": 0.0, "K": 0.0}, "no head at all"),
        ({"L_m": 120000.0}, "L_m = 120000, need at most 20000; check its unit: it is in metres"),
        ({"H_static_m": 0.0, "L_m": 1.0, "K": 0.0}, "runs out past"),
        ({"H_static_m": -1.0}, "H_static_m = -1.0, need >= 0"),
        ({"D_mm": 0.0}, "D_mm = 0.0, need > 0"),
    ],
)
def test_a_lift_that_cannot_be_is_refused_on_one_line(changes, message):
    with pytest.raises(ParameterError) as fault:
        hydraulics(PUMP.curve(), pipe(**changes), PUMP.omega_max)
    assert message in str(fault.value) and "\n" not in str(fault.value)
