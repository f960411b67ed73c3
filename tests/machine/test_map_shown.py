"""The judge of a map at its gates, what its report says, and figures that show the machine."""

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.figure import Figure
from rich.console import Console
from test_flux_map_judge import GOOD

from reluctance import ParameterError, _core
from reluctance.machine.map_file import machine_text, phases_of
from reluctance.machine.maps import (
    check_map,
    plot_coenergy,
    plot_inductance,
    plot_magnetisation,
    plot_torque,
    surface,
)
from reluctance.machine.maps.check import _reasons
from reluctance.machine.maps.report import check_table, fit_table
from reluctance.machine.maps.single_sample import WrongSample
from reluctance.machine.maps.surface import fit_surface
from reluctance.machine.maps.units import implausible

SOUND = {
    "monotone_share": 1.0,
    "symmetry_error": 0.0,
    "period_error": 0.0,
    "torque_error_rms": 0.0,
    "area_error": 0.0,
    "noise": 0.0,
    "row_error": 0.0,
    "sample_error": 0.0,
}
WRONG = WrongSample(i=9.0, theta_e=np.pi / 2, psi=0.2, expected=0.19, error=0.05, more=2)


@pytest.mark.parametrize(
    ("figure", "gate", "told"),
    [  # docs/flux_maps.md has the gates
        ("symmetry_error", 0.005, "flux differs between the two sides of alignment by"),
        ("period_error", 0.005, "flux differs between the ends of the period by"),
        ("torque_error_rms", 0.05, "torque differs from the co-energy derivative by rms"),
        ("area_error", 0.02, "torque area differs from the co-energy difference by"),
        ("noise", 0.003, "noise of flux"),
        ("row_error", 0.01, "row at 9 A is off by"),
        ("sample_error", 0.005, "the sample at 9 A, 90 deg el. (and 2 more) is off by"),
    ],
)
def test_a_figure_passes_at_its_gate_and_not_beyond(figure, gate, told):
    assert _reasons(SOUND, ["row at 9 A", "compute it again"], WRONG, "") == []
    assert _reasons(SOUND | {figure: gate}, ["row at 9 A", "compute it again"], WRONG, "") == []
    assert _reasons(SOUND | {figure: None}, ["row at 9 A", "compute it again"], WRONG, "") == []
    (reason,) = _reasons(SOUND | {figure: 2 * gate}, ["row at 9 A", "compute it again"], WRONG, "")
    assert reason.startswith(f"{told} {200 * gate:.2g} %, need at most {100 * gate:g} %; ")


def test_flux_that_falls_is_told_with_its_share():
    (reason,) = _reasons(SOUND | {"monotone_share": 0.975}, ["", ""], None, "from 9 to 10 A")
    assert reason.startswith(
        "flux falls with current on 2.5 % of the steps, need none; most from 9 to 10 A; "
    )


@pytest.mark.parametrize(
    ("i", "psi", "told"),
    [
        (10.0, 0.2, None),
        (1e-3, 1e-4, None), (0.9e-3, 1e-4, "largest current 0.0009 A, need 0.001 to 10000"),
        (1e4, 50.0, None), (1.1e4, 50.0, "largest current 1.1e+04 A"),
        (1.0, 0.9e-4, "largest flux linkage 9e-05 Wb, need 0.0001 to 50"),
        (1e3, 51.0, "largest flux linkage 51 Wb"),
        (1e3, 0.9e-3, "largest flux linkage over largest current 9e-07 H, need 1e-06 to 10"),
        (1.0, 10.0, None),
        (0.1, 1.02, "largest flux linkage over largest current 10.2 H"),
    ],
)  # fmt: skip
def test_no_machine_has_less_or_more_than_any_that_is_made(i, psi, told):
    found = implausible(i, psi)
    assert found is None if told is None else (found or "").startswith(told)


def words(table):
    console = Console(width=120)
    with console.capture() as captured:
        console.print(table)
    rows = [line.split("│") for line in captured.get().splitlines() if line.startswith("│")]
    return {row[1].strip(): (row[2].strip(), row[3].strip()) for row in rows}


def test_the_report_has_every_figure_in_its_unit_beside_its_gate():
    report = check_map(GOOD, i_max=600.0)
    shown = words(check_table("mine", report))
    assert shown["grid"] == ("46 currents x 31 angles", "")
    assert shown["currents"] == ("0 to 450 A", "")
    assert shown["angles"] == ("0 to 180 deg el., 4 rotor poles", "")
    assert shown["largest flux linkage"] == (f"{GOOD.psi.max():.4g} Wb", "")
    assert shown["largest torque"] == (f"{np.abs(GOOD.tau).max():.4g} N m", "")
    steps = np.diff(GOOD.psi, axis=0) / np.diff(GOOD.i)[:, None]
    assert shown["least incremental inductance"] == (f"{1e3 * steps.min():.4g} mH", "> 0")
    assert shown["flux rises with current"] == ("100 %", "100 %")
    assert shown["asymmetry about alignment"] == ("not in this map", "<= 0.5 %")
    for row, gate in (
        ("torque against co-energy, rms", "<= 5 %"),
        ("torque area against co-energy", "<= 2 %"),
        ("noise of flux, estimate", "<= 0.3 %"),
        ("row off its neighbours", "<= 1 %"),
    ):
        assert shown[row][1] == gate
    assert shown["current limit past the table"] == ("25 %", "")
    assert shown["verdict"] == ("good", "")
    without = words(check_table("mine", check_map(replace(GOOD, tau=None))))
    assert without["largest torque"][0].endswith("N m (none given: from the flux)")
    assert without["torque against co-energy, rms"][0] == "not in this map"


def test_the_table_of_fits_has_both_residuals_in_percent():
    from reluctance.machine.maps.fit import LeHuyFit, TwoTermFit

    names = ("L_u_H", "L_a_H", "L_sat_H", "i_m_A", "psi_m_Wb")
    simple = LeHuyFit.__new__(LeHuyFit)
    for n, name in enumerate((*names, "psi_error_rms", "psi_error_max"), 1):
        object.__setattr__(simple, name, 0.011 * n)
    better = TwoTermFit.__new__(TwoTermFit)
    for name, value in (("psi_error_rms", 0.001), ("psi_error_max", 0.002)):
        object.__setattr__(better, name, value)
    shown = words(fit_table("mine", simple, better))
    assert shown["L_u_H"] == ("0.011", "") and shown["psi_m_Wb"] == ("0.055", "")
    assert shown["residual flux, rms"] == ("6.6 %", "0.1 %")
    assert shown["residual flux, worst"] == ("7.7 %", "0.2 %")


@pytest.fixture(scope="module")
def machine():
    return surface(GOOD)


def test_curves_are_those_of_the_machine_and_dots_those_of_the_table(machine):
    drawn = plot_magnetisation(machine, GOOD, axes=Figure().add_subplot())
    curves = [line for line in drawn.lines if line.get_label().endswith("deg el.")]
    dots = [line for line in drawn.lines if line.get_linestyle() == "None"]
    assert [line.get_label() for line in curves] == [f"{a} deg el." for a in (0, 45, 90, 135, 180)]
    assert len(dots) == 3  # the table has samples every 6 deg: not at 45 and 135
    for line, angle in zip(curves, (0, 45, 90, 135, 180), strict=True):
        i, psi = line.get_data()
        assert (i[0], i[-1]) == (0, 450)
        at = _core.magnetics(machine, i, np.full_like(i, np.radians(angle)))
        assert psi == pytest.approx(at[:, 0])
    for line, column in zip(dots, (0, 15, 30), strict=True):
        assert line.get_ydata() == pytest.approx(GOOD.psi[:, column])


@pytest.mark.parametrize(
    ("plot", "column", "factor", "unit"),
    [
        (plot_torque, 2, 1.0, "(N m)"),
        (plot_inductance, 3, 1e3, "(mH)"),
        (plot_coenergy, 1, 1, "(J)"),
    ],
)
def test_figures_over_the_angle_are_at_parts_of_the_last_current(
    machine, plot, column, factor, unit
):
    drawn = plot(machine, axes=Figure().add_subplot())
    assert drawn.get_ylabel().endswith(unit) and len(drawn.lines) == 5
    for line, i in zip(drawn.lines, (45, 112.5, 225, 337.5, 450), strict=True):
        degrees, values = line.get_data()
        assert (degrees[0], degrees[-1]) == (0, 360) and line.get_label() == f"{i:.4g} A"
        at = _core.magnetics(machine, np.full(361, i), np.radians(degrees))[:, column]
        assert values == pytest.approx(factor * at)
    assert [*drawn.get_xticks()] == [0, 60, 120, 180, 240, 300, 360]
    assert (drawn.get_yscale() == "log") == (plot is plot_inductance)


def test_torque_of_the_table_stands_at_the_currents_that_it_has(machine):
    drawn = plot_torque(machine, GOOD, axes=Figure().add_subplot())
    (dots,) = [line for line in drawn.lines if line.get_linestyle() == "None"]
    # In steps of 10 A it has 450 A, and not 45, 112.5, 225 and 337.5 A.
    assert dots.get_ydata() == pytest.approx(GOOD.tau[45])
    assert dots.get_xdata() == pytest.approx(np.linspace(0, 180, 31))
    # Within a thousandth of the last current.
    for off, count in ((0.44, 1), (0.46, 0)):
        near = replace(GOOD, i=np.where(GOOD.i > 440, GOOD.i - off, GOOD.i))
        drawn = plot_torque(machine, near, axes=Figure().add_subplot())
        assert sum(line.get_linestyle() == "None" for line in drawn.lines) == count


def test_the_surface_of_a_fine_table_goes_through_its_samples():
    fitted = fit_surface(GOOD)
    i, theta = (x.ravel() for x in np.meshgrid(GOOD.i, GOOD.theta_e, indexing="ij"))
    psi = _core.magnetics(fitted.machine, i, theta)[:, 0]
    error = (psi - GOOD.psi.ravel()) / GOOD.psi.max()
    assert fitted.psi_error_max == pytest.approx(np.abs(error).max())
    assert fitted.psi_error_rms == pytest.approx(np.sqrt(np.mean(error**2)))
    assert fitted.psi_error_max < 2e-3 and fitted.theta_span == np.pi and fitted.notes == ()


WINDING = {
    "name": "mine",
    "source": "a file",
    "map_name": "m.csv",
    "N_s": 12,
    "N_r": 8,
    "R_ohm": 0.5,
    "i_max_A": 20.0,
    "J_kgm2": 0.01,
    "accepted_because": None,
    "notes": ("read as degrees",),
}


def test_a_machine_file_has_what_was_given():
    import tomllib

    text = machine_text(**WINDING, pairs=("p.csv", 1.25))
    found = tomllib.loads(text)["machine"]
    assert found["n_phases"] == 3 and (found["N_s"], found["N_r"]) == (12, 8)
    assert (found["R_ohm"], found["i_max_A"], found["J_kgm2"]) == (0.5, 20, 0.01)
    assert (found["pairs"], found["pair_factor"]) == ("p.csv", 1.25)
    assert "accepted_because" not in found and "# read as degrees" in text
    told = tomllib.loads(machine_text(**WINDING | {"accepted_because": 'a "b"'}))["machine"]
    assert told["accepted_because"] == 'a "b"' and "pairs" not in told


@pytest.mark.parametrize("key", ["R_ohm", "J_kgm2", "i_max_A"])
@pytest.mark.parametrize("value", [0.0, -1.0, float("inf"), float("nan")])
def test_a_machine_file_takes_positive_numbers(key, value):
    with pytest.raises(ParameterError, match=f"{key} = .*need > 0; pass --{key}"):
        machine_text(**WINDING | {key: value})


@pytest.mark.parametrize(("N_s", "N_r", "phases"), [(6, 4, 3), (8, 6, 4), (4, 2, 2), (12, 10, 6)])
def test_phases_follow_from_the_poles(N_s, N_r, phases):
    assert phases_of(N_s, N_r) == phases
    for wrong in ((0, 4), (4, 4), (14, 4)):
        with pytest.raises(ParameterError, match="--N_s"):
            phases_of(*wrong)
