"""Parts of the plant at their edges: units of a curve, a thin pipe, names of modules and pumps."""

import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.optimize import brentq

from reluctance.base.errors import Note, ParameterError
from reluctance.base.schema import checked
from reluctance.plant.hydraulics.curve_file import COLUMNS
from reluctance.plant.hydraulics.pipe import Pipe, flow, hydraulics
from reluctance.plant.hydraulics.pump import NamesPump, library, pump_from
from reluctance.plant.solar import pv_module
from reluctance.plant.solar.datasheet import Datasheet

PUMP = pump_from("synthetic_70_25", Path())
POINTS = [(0, 60.0, 0.0), (4, 56.0, 0.4), (8, 45.0, 0.6), (11, 33.0, 0.55)]  # m3/h, m, 1
UNITS = {  # of each, one of the unit [m3/h, m, 1]
    "Q": {"m3ph": 1, "m3/h": 1, "l/s": 3.6, "lps": 3.6, "l/min": 0.06, "lpm": 0.06, "m3/s": 3600}
    | dict.fromkeys(("gpm", "us gpm", "usgpm", "gpm (us)"), 0.2271247070),
    "H": {"m": 1, "ft": 0.3048},
    "eta": {"1": 1, "%": 0.01, "pct": 0.01},
}


def curve_of(tmp_path: Path, head: str, rows: object):
    lines = [",".join(f"{x:.12g}" for x in row) for row in rows]
    (tmp_path / "curve.csv").write_text("\n".join([head, *lines]) + "\n")
    return pump_from({"n_ref_rpm": 1500.0, "curve_csv": "curve.csv"}, tmp_path).curve()


def test_a_curve_is_the_same_in_each_unit_that_its_columns_may_have(tmp_path):
    plain = curve_of(tmp_path, "Q [m3/h],H [m],eta [1]", POINTS)
    Q = np.linspace(0, 11, 23) / 3600
    for place, (name, units) in enumerate(UNITS.items()):
        known = COLUMNS[{"Q": "Q_m3ph", "H": "H_m", "eta": "eta"}[name]]
        assert {*known.units} == {*units}
        for unit, factor in units.items():
            heads = ["Q [m3/h]", "H [m]", "eta [1]"]
            heads[place] = f"{name} [{unit}]"
            rows = np.array(POINTS)
            rows[:, place] /= factor
            other = curve_of(tmp_path, ",".join(heads), rows)
            assert other.head_1(Q) == pytest.approx(plain.head_1(Q), rel=1e-8), unit
            assert other.power_1(Q) == pytest.approx(plain.power_1(Q), rel=1e-8), unit


def test_a_curve_that_begins_above_zero_flow_flattens_towards_shut_off(tmp_path):
    """From 2 to 4 m3/h it falls by 6 m: by half as much again over the 2 before."""
    rows = [(2, 60.0, 0.4), (4, 54.0, 0.5), (6, 40.0, 0.3)]
    with pytest.warns(Note, match="begins above zero flow: continued here from 63 m at shut-off"):
        curve = curve_of(tmp_path, "Q_m3ph,H_m,eta", rows)
    assert float(curve.head_1(0.0)) == pytest.approx(63.0)


def thin(part: float, static: float) -> Pipe:
    """A pipe that lets a part of the end of the curve through at the largest speed."""
    curve, r = PUMP.curve(), PUMP.omega_max / PUMP.curve().omega_ref

    def of(D_mm: float) -> Pipe:
        table = {"H_static_m": static, "L_m": 120.0, "D_mm": D_mm, "roughness_mm": 0.05, "K": 4.0}
        return checked(Pipe, table, "[pipe]")

    def over(D_mm: float) -> float:
        return float(flow(curve, of(D_mm), np.array([r]))[0]) / (curve.Q_end * r) - part

    return of(brentq(over, 1.0, 120.0, xtol=1e-9))


@pytest.mark.parametrize(
    ("part", "spare", "refused"),
    [(0.0198, 0.5, True), (0.0202, 0.5, False), (0.01, 0.052, True), (0.01, 0.048, False)],
)
def test_a_pipe_is_too_thin_below_a_fiftieth_of_the_flow_where_the_head_has_a_twentieth_to_spare(
    part, spare, refused
):
    curve, most = PUMP.curve(), PUMP.omega_max
    given = thin(part, (1 - spare) * curve.H_0 * (most / curve.omega_ref) ** 2)
    if refused:
        with pytest.raises(ParameterError, match=f"D_mm = {given.D_mm:g} lets .* friction takes"):
            hydraulics(curve, given, most)
    else:
        assert hydraulics(curve, given, most).Q[-1] > 0


def test_a_pump_below_one_revolution_is_asked_for_its_unit():
    with pytest.raises(ParameterError, match=r"n_ref_rpm = 0\.5, need at least"):
        pump_from({"n_ref_rpm": 0.5, "H_0_m": 9, "Q_b_m3ph": 6, "H_b_m": 7, "eta_b": 0.2}, Path())


def test_a_name_of_the_library_stays_where_files_move_and_a_path_does_not(tmp_path):
    own = tmp_path / "own.toml"
    own.write_text((library() / "synthetic_70_25.toml").read_text())
    moved = tmp_path / "moved" / "own.toml"
    assert NamesPump().renamed(str(own), lambda _: moved) == str(moved)
    assert NamesPump().renamed("synthetic_70_25", lambda path: tmp_path / path) == "synthetic_70_25"
    moved.parent.mkdir()
    own.rename(moved)  # only where it goes it is
    assert NamesPump().renamed(str(own), lambda _: moved) == str(moved)


@pytest.mark.parametrize(
    ("cells", "told"),
    [
        (120, "60 in a module of 120 half cells"),  # 0.33 V each, 0.67 V of two
        (121, "72 in one of 144 half cells"),  # no module of half cells has an odd number
        (400, "72 in one of 144 half cells"),
        (30, "72 in one of 144 half cells"),
    ],
)
def test_cells_that_are_no_half_cells_are_answered_in_general(cells, told):
    numbers = {"P_mp_W": 330.0, "V_oc_V": 40.0, "I_sc_A": 10.5, "V_mp_V": 33.0, "I_mp_A": 10.0}
    rises = {"alpha_sc_pctpK": 0.05, "beta_oc_pctpK": -0.3, "gamma_mp_pctpK": -0.4}
    with pytest.raises(ParameterError, match=re.escape(told)):
        checked(Datasheet, {**numbers, **rises, "cells": cells}, "[array.datasheet]")


def modules(count: int) -> pd.DataFrame:
    """Some as in the CEC table, of 100, 110, ... W."""
    return pd.DataFrame(
        {f"Maker{n}__Panel_{100 + 10 * n}": {"alpha_sc": 0.1, "STC": 100 + 10.0 * n}
         for n in range(count)}
    )  # fmt: skip


def test_an_unknown_module_is_answered_with_six_that_are_near():
    table = modules(60)
    assert pv_module._nearest("?!", table)[0] == "Maker30__Panel_400"  # says nothing: 400 W
    assert pv_module._nearest("xyzzy 205 Wp", table)[0] in {"Maker10__Panel_200",
                                                            "Maker11__Panel_210"}  # fmt: skip
    assert [*map(len, (pv_module._nearest(text, table) for text in ("?!", "panel")))] == [6, 6]
    assert pv_module._nearest("panel", table)[1] == "Maker10__Panel_200"  # of every tenth
    assert pv_module._nearest("panel 130", table) == ["Maker3__Panel_130"]
