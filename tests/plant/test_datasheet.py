"""A module by its datasheet: the diode meets the printed points, and nonsense is refused."""

import numpy as np
import pytest

from reluctance import ParameterError
from reluctance.base.schema import checked
from reluctance.plant.solar.datasheet import Datasheet, _slopes, cell_from
from reluctance.plant.solar.pv_module import check_one_module
from reluctance.plant.solar.single_diode import array_diode, current, open_circuit, power_point

# Typical of a module of 72 cells, 330 W.
SHEET = {
    "P_mp_W": 330,
    "V_oc_V": 45.6,
    "I_sc_A": 9.45,
    "V_mp_V": 37.2,
    "I_mp_A": 8.88,
    "alpha_sc_pctpK": 0.053,
    "beta_oc_pctpK": -0.31,
    "gamma_mp_pctpK": -0.40,
    "cells": 72,
}
SEED = 20261123


def sheet(**other) -> Datasheet:
    numbers = {k: float(v) for k, v in (SHEET | other).items() if k != "cells"}
    return checked(Datasheet, {**numbers, "cells": (SHEET | other)["cells"]}, "[array.datasheet]")


def meets_its_points(of: Datasheet) -> None:
    diode = array_diode(
        cell_from(of, "array"), np.array(1000.0), np.array(25.0), n_series=1, n_parallel=1
    )
    best = power_point(diode)
    assert float(open_circuit(diode)) == pytest.approx(of.V_oc_V, rel=1e-6)
    assert float(current(diode, 0.0)) == pytest.approx(of.I_sc_A, rel=1e-6)
    assert float(best.u) == pytest.approx(of.V_mp_V, rel=1e-4)
    assert float(best.i) == pytest.approx(of.I_mp_A, rel=1e-4)


def test_the_diode_goes_through_the_printed_points():
    meets_its_points(sheet())
    beta, gamma = _slopes(cell_from(sheet(), "array"))
    assert beta == pytest.approx(-0.31, abs=0.02)
    assert gamma == pytest.approx(-0.40, abs=0.03)


def test_a_single_small_cell_is_a_module_too():
    """All its numbers are below one."""
    small = {"V_oc_V": 0.6333, "V_mp_V": 0.5167, "I_sc_A": 0.945, "I_mp_A": 0.888, "cells": 1}
    meets_its_points(sheet(**small, P_mp_W=0.4588))


def test_the_short_circuit_current_rises_with_temperature_as_printed():
    warmer = np.array([25.0, 50.0])
    diode = array_diode(
        cell_from(sheet(), "array"), np.full(2, 1000.0), warmer, n_series=1, n_parallel=1
    )
    cold, hot = current(diode, np.zeros(2))
    assert 100 * (hot / cold - 1) / 25 == pytest.approx(SHEET["alpha_sc_pctpK"], rel=2e-3)


@pytest.mark.long
def test_modules_of_the_cec_table_have_a_diode():
    """Of 40 crystalline modules drawn from it, 33 are taken and meet their points, and half are
    within 0.03 %/K. Two count half cells; of five no diode through the points has coefficients
    within 0.15 %/K, and the line says so."""
    pvlib = pytest.importorskip("pvlib")
    table = pvlib.pvsystem.retrieve_sam("CECMod").T
    table = table[table.Technology.isin(["Mono-c-Si", "Multi-c-Si"]) & (table.alpha_sc > 0)]
    taken, off = 0, []
    for _, row in table.sample(40, random_state=SEED).iterrows():
        try:
            of = sheet(
                P_mp_W=row.V_mp_ref * row.I_mp_ref,
                V_oc_V=row.V_oc_ref,
                I_sc_A=row.I_sc_ref,
                V_mp_V=row.V_mp_ref,
                I_mp_A=row.I_mp_ref,
                alpha_sc_pctpK=100 * row.alpha_sc / row.I_sc_ref,
                beta_oc_pctpK=100 * row.beta_oc / row.V_oc_ref,
                gamma_mp_pctpK=row.gamma_r,
                cells=int(row.N_s),
            )
            meets_its_points(of)
        except ParameterError:
            continue
        taken += 1
        off.append(np.abs(_slopes(cell_from(of, "array")) - (of.beta_oc_pctpK, of.gamma_mp_pctpK)))
    assert taken >= 33, f"seed {SEED}: {taken}"
    assert np.median(off) < 0.03


@pytest.mark.parametrize(
    ("other", "words"),
    [
        ({"cells": 144}, "count the cells in series: 72 in a module of 144 half cells"),
        ({"P_mp_W": 245}, "STC, not NOCT"),
        ({"V_mp_V": 45.6, "V_oc_V": 37.2}, "exchanged"),
        ({"gamma_mp_pctpK": -0.04}, "gamma_mp_pctpK = -0.04"),
        ({"beta_oc_pctpK": -0.031}, "need"),
        ({"beta_oc_pctpK": 0.31}, "beta_oc_pctpK"),
    ],
)
def test_numbers_of_no_module_are_refused_in_one_line(other, words):
    with pytest.raises(ParameterError, match=words) as fault:
        cell_from(sheet(**other), "array")
    assert "\n" not in str(fault.value)


@pytest.mark.parametrize(
    ("key", "printed", "unit"),
    [
        ("alpha_sc_pctpK", 5.01, "mA/K"),
        ("beta_oc_pctpK", -141.4, "mV/K"),
        ("beta_oc_pctpK", -0.1414, "V/K"),
        ("gamma_mp_pctpK", -1.32, "W/K"),
    ],
)
def test_a_coefficient_in_another_unit_is_answered_with_its_share(key, printed, unit):
    with pytest.raises(ParameterError, match=f"if it is in {unit}, write") as fault:
        sheet(**{key: printed})
    written = float(str(fault.value).rpartition(" ")[2])
    assert written == pytest.approx(SHEET[key], rel=0.01)
    meets_its_points(sheet(**{key: written}))


def test_no_crystalline_module_of_the_cec_table_loses_less_than_a_fifth_of_a_per_cent_per_kelvin():
    pvlib = pytest.importorskip("pvlib")
    table = pvlib.pvsystem.retrieve_sam("CECMod").T
    table = table[table.Technology.isin(["Mono-c-Si", "Multi-c-Si"])]
    assert len(table) > 10_000
    assert (100 * table.beta_oc / table.V_oc_ref).max() < -0.2 > table.gamma_r.max()


def test_half_cells_are_answered_with_the_cells_in_series():
    small = {"P_mp_W": 415, "V_oc_V": 37.4, "I_sc_A": 13.98, "V_mp_V": 31.3, "I_mp_A": 13.26}
    with pytest.raises(ParameterError, match="54 in a module of 108 half cells"):
        sheet(**small, cells=108)
    meets_its_points(sheet(**small, beta_oc_pctpK=-0.25, gamma_mp_pctpK=-0.34, cells=54))


def test_a_module_that_is_given_twice_is_told_which_to_remove():
    given = sheet()
    with pytest.raises(ValueError, match=r"`module` = 'X' and \[array.datasheet\] are the same"):
        check_one_module("X", given, None, "array")
    with pytest.raises(ValueError, match="need one of `module`"):
        check_one_module(None, None, None, "array")
    check_one_module(None, given, None, "array")
