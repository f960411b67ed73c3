"""Losses beside the loop, and the energy loop: against closed forms and against the balance."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from command import command
from hypothesis import given
from hypothesis import strategies as st

import reluctance as rl
from reluctance.drive.run.energy_loop import energy_loops, save_energy_loop
from reluctance.drive.run.kpis import evaluated
from reluctance.drive.run.losses import iron_loss, loops
from reluctance.drive.tables.sections import Converter
from reluctance.machine.loss_data import Iron

EXAMPLES = Path(__file__).parents[2] / "examples"
IRON = Iron(p_ref_W=60.0, psi_ref_Wb=0.3, f_ref_Hz=100.0, alpha=1.4, beta=1.9)
HALF = str(EXAMPLES / "paper_half.toml")
IRON_KEYS = [f"machine.iron.{key}={value}" for key, value in IRON.model_dump().items()]
SWITCH_KEYS = [
    "converter.E_on_mJ=2.0",
    "converter.E_off_mJ=1.5",
    "converter.E_rr_mJ=0.5",
    "converter.u_sw_ref_V=600",
    "converter.i_sw_ref_A=100",
]


def sine(f, amplitude, n_phases=3, bias=0.0, n=4001, periods=2):
    t = np.linspace(0, periods / f, n)
    shift = 2 * np.pi / n_phases * np.arange(n_phases)[:, None]
    return t, bias + amplitude * np.sin(2 * np.pi * f * t - shift)


@pytest.mark.parametrize("n_phases", [3, 4, 5])
@pytest.mark.parametrize("bias", [0.0, 0.3])
def test_the_reference_point_gives_the_reference_loss(n_phases, bias):
    t, psi = sine(100.0, 0.3, n_phases, bias)
    assert iron_loss(IRON, t, psi) == pytest.approx(60.0, rel=1e-4)


@given(st.floats(20.0, 2000.0), st.floats(0.01, 2.0))
def test_sinusoidal_flux_obeys_steinmetz(f, amplitude):
    t, psi = sine(f, amplitude, n=801)
    expected = 60.0 * (f / 100) ** 1.4 * (amplitude / 0.3) ** 1.9
    assert iron_loss(IRON, t, psi) == pytest.approx(expected, rel=2e-3)


def test_a_triangle_has_the_closed_form():
    """|dpsi/dt| = 4 a f throughout, so the loss is k_i (4 a f)^alpha (2 a)^(beta - alpha)."""
    t = np.linspace(0, 0.02, 41)
    psi = 0.3 * np.abs((t * 100 * 2) % 2 - 1) * 2 - 0.3
    theta = np.linspace(0, 2 * np.pi, 200001)
    cosine = np.trapezoid(np.abs(np.cos(theta)) ** 1.4, theta)
    k = 20.0 / (100**1.4 * 0.3**1.9)
    k_i = k / ((2 * np.pi) ** 0.4 * cosine * 2**0.5)
    expected = 3 * k_i * (4 * 0.3 * 100) ** 1.4 * 0.6**0.5
    assert iron_loss(IRON, t, np.tile(psi, (3, 1))) == pytest.approx(expected, rel=1e-6)


def test_minor_loops_count_with_their_own_height():
    """0 to 1, back to 0.8, to 1.2, down to 0: one major loop of 1.2 and one minor of 0.2."""
    values = np.array([0.0, 1.0, 0.8, 1.2, 0.0])
    change = np.diff(values)
    found = loops(change, np.abs(change))
    assert sorted(round(span, 12) for span, _ in found) == [0.2, 1.2, 1.2]
    weights = {round(span, 12): 0.0 for span, _ in found}
    for span, weight in found:
        weights[round(span, 12)] += weight
    assert weights == {0.2: pytest.approx(0.4), 1.2: pytest.approx(2.4)}


@given(st.lists(st.floats(-1, 1), min_size=3, max_size=40))
def test_loops_keep_the_whole_weight(values):
    change = np.diff(np.array(values))
    weight = change**2
    assert sum(w for _, w in loops(change, weight)) == pytest.approx(weight.sum(), abs=1e-12)


def test_a_finer_grid_changes_nothing_of_a_piecewise_straight_flux():
    t = np.array([0.0, 1.0, 1.5, 2.0, 3.0, 4.0, 5.0])
    psi = np.array([0.0, 1.0, 0.7, 1.3, 0.4, 0.6, 0.0])
    fine = np.linspace(0, 5, 1001)
    coarse = iron_loss(IRON, t, np.tile(psi, (3, 1)))
    assert iron_loss(IRON, fine, np.tile(np.interp(fine, t, psi), (3, 1))) == pytest.approx(
        coarse, rel=1e-6
    )


def test_losses_are_off_unless_asked_for():
    kpis = rl.simulate(rl.load(HALF), until=0.03, record=None).kpis
    assert kpis.p_fe is None
    assert kpis.p_sw is None
    assert kpis.with_units()["p_fe_W"] is kpis.with_units()["p_sw_W"] is None


@pytest.mark.parametrize(
    ("until_ms", "first", "last"), [(8, 0, None), (12, 0, 10), (25, 10, 20), (45, 30, 40)]
)
def test_figures_are_of_the_whole_periods_of_the_second_half_or_else_of_the_last(
    until_ms, first, last
):
    """A period takes 10 ms here; before the first one ends there is none."""
    rows = rl.simulate(rl.load(HALF, ["load.speed_rpm=1500"]), until=1e-3 * until_ms).periods
    window, periods = evaluated(rows, 4)
    assert periods == (0 if last is None else 1)
    ends = (first, until_ms if last is None else last)
    assert 1e3 * window["t"][[0, -1]] == pytest.approx(ends, abs=1e-6)


def test_losses_join_the_power_balance():
    """Over whole periods the link's power is all that the drive does with it."""
    drops = ["converter.v_switch_V=1.5", "converter.v_diode_V=1.0", "converter.R_switch_ohm=0.01"]
    plain = rl.simulate(rl.load(HALF, drops), until=0.1, record=None)
    lossy = rl.simulate(rl.load(HALF, drops + IRON_KEYS + SWITCH_KEYS), until=0.1, record=None)
    k = lossy.kpis
    assert min(k.p_fe, k.p_sw, k.p_dev, k.p_cu) > 0
    window, periods = evaluated(lossy.periods, 4)
    assert periods >= 2
    field = window.rise("W_f") / window.rise("t")
    spent = k.p_mech + k.p_cu + k.p_dev + k.p_fe + k.p_sw + field
    assert k.p_in == pytest.approx(spent, rel=1e-6)
    assert k.efficiency == pytest.approx(k.p_mech / k.p_in)
    assert k.p_in - plain.kpis.p_in == pytest.approx(k.p_fe + k.p_sw)
    assert k.p_source == pytest.approx(k.p_in)  # of a stiff source
    assert lossy.t.size == 0  # record = None keeps nothing, though the iron loss needed it


def test_rows_at_equal_intervals_are_the_same_where_the_iron_loss_keeps_every_point():
    plain, lossy = (
        rl.simulate(rl.load(HALF, keys), until=0.02, record=1e-3) for keys in ([], IRON_KEYS)
    )
    assert lossy.t == pytest.approx(plain.t, abs=1e-9)
    assert lossy.t == pytest.approx(np.linspace(0, 0.02, 21), abs=1e-9)
    assert np.array_equal(lossy.leg, plain.leg)
    assert lossy.i == pytest.approx(plain.i, abs=1e-3 * plain.i.max())
    assert lossy.tau == pytest.approx(plain.tau, abs=1e-3 * plain.tau.max())


def test_switching_loss_is_that_of_the_legs_in_the_waveforms():
    """Counted independently: each change of a leg state at its current."""
    drive = rl.load(HALF, SWITCH_KEYS)
    result = rl.simulate(drive, until=0.06)
    window, _ = evaluated(result.periods, 4)
    change = np.diff(result.leg, axis=1)
    i = result.i[:, 1:]
    inside = (result.t[1:] > window["t"][0]) & (result.t[1:] <= window["t"][-1])
    on, off = np.clip(change, 0, None) * i * inside, np.clip(-change, 0, None) * i * inside
    energy = 1e-3 * (2.5 * on.sum() + 1.5 * off.sum()) * 240 / 600 / 100
    expected = energy / window.rise("t")
    assert result.kpis.p_sw == pytest.approx(expected, rel=1e-3)


def test_iron_loss_does_not_depend_on_what_is_kept():
    drive = rl.load(HALF, IRON_KEYS)
    full, none, grid = (rl.simulate(drive, until=0.06, record=r) for r in (0.0, None, 30e-6))
    assert full.kpis.p_fe == none.kpis.p_fe == grid.kpis.p_fe
    plain = rl.simulate(rl.load(HALF), until=0.06, record=30e-6)
    np.testing.assert_allclose(grid.t, plain.t, atol=1e-12)
    np.testing.assert_allclose(grid.i, plain.i, atol=1e-3 * plain.i.max())
    same = (grid.leg == plain.leg).all(axis=0)
    assert same.mean() > 0.999


@pytest.mark.parametrize(
    ("keys", "text"),
    [
        (dict(E_on_mJ=1.0), "give u_sw_ref_V and i_sw_ref_A"),
        (dict(u_sw_ref_V=600.0, i_sw_ref_A=50.0), "have no effect without E_on_mJ"),
        (dict(E_off_mJ=-1.0), "need >= 0"),
        (
            dict(E_on_mJ=2000.0, u_sw_ref_V=600.0, i_sw_ref_A=50.0),
            "E_on_mJ = 2000, need at most 600: .* 1000 uJ are 1 mJ",
        ),
    ],
)
def test_energies_need_their_point(keys, text):
    with pytest.raises(ValueError, match=text):
        Converter(u_dc_V=300.0, **keys)


def test_energies_of_slow_and_of_fast_devices_are_taken():
    for energy in (600.0, 2.0, 0.05):
        Converter(u_dc_V=300.0, E_off_mJ=energy, u_sw_ref_V=600.0, i_sw_ref_A=50.0)


def test_exponents_in_the_wrong_order_are_refused():
    with pytest.raises(rl.ParameterError, match=r"beta = 1.2, need >= alpha"):
        rl.load(HALF, [*IRON_KEYS[:-1], "machine.iron.beta=1.2"])


@pytest.mark.parametrize(
    ("override", "text"),
    [
        ("machine.iron.aplha=1", "unknown key `aplha` in [machine.iron]; did you mean `alpha`?"),
        ("machine.iron=3", "iron = 3, need a table"),
        ("converter.E_om_mJ=2", "did you mean `E_on_mJ`?"),
    ],
)
def test_a_mistyped_loss_key_is_named(override, text):
    with pytest.raises(rl.ParameterError) as fault:
        rl.load(EXAMPLES / "five_phases_losses.toml", [override])
    assert text in str(fault.value)


def test_copper_loss_follows_the_winding_temperature():
    """At the same torque the same current flows; the resistance is 39 % larger at 120 degC."""
    cold, hot = (
        rl.simulate(rl.load(HALF, [f"machine.temp_w_degC={c}"]), until=0.06, record=None).kpis
        for c in (20.0, 120.0)
    )
    assert hot.i_rms == pytest.approx(cold.i_rms, rel=0.01)
    ratio = (hot.p_cu / hot.i_rms**2) / (cold.p_cu / cold.i_rms**2)
    assert ratio == pytest.approx(1 + 0.00393 * 100, rel=2e-3)


def test_the_areas_of_the_loops_are_in_the_json_of_a_run(tmp_path):
    line = ("run", EXAMPLES / "single_pulse.toml", "--json", "--energy-loop", tmp_path / "l.png")
    found = json.loads(command(*line).out)["energy_loop"]
    assert [loop["phase"] for loop in found] == ["a", "b", "c"]
    for loop in found:
        assert loop["area_J"] == pytest.approx(loop["work_J"], rel=1e-3)
        assert loop["work_J"] == pytest.approx(17.6, rel=0.01)


@pytest.mark.parametrize("record", [0.0, 10e-6])
@pytest.mark.parametrize("name", ["hysteresis_200A", "single_pulse", "paper_half"])
def test_the_loop_area_is_the_work_of_the_phase(name, record):
    result = rl.simulate(rl.load(EXAMPLES / f"{name}.toml"), until=0.1, record=record)
    found = energy_loops(result)
    assert len(found) == 3
    for loop in found:
        assert loop.area == pytest.approx(loop.work, rel=1e-3)
    drive = result.drive
    strokes = drive.machine.N_r * result.kpis.speed_mean / (2 * np.pi)
    p_mech = sum(loop.work for loop in found) * strokes
    assert p_mech == pytest.approx(result.kpis.p_mech, rel=0.03)


def test_the_loop_needs_a_period_and_waveforms(tmp_path):
    drive = rl.load(HALF)
    period = 60 / drive.load.speed_rpm / drive.machine.N_r
    with pytest.raises(rl.ParameterError, match="one whole electrical period"):
        energy_loops(rl.simulate(drive, until=0.9 * period))
    assert len(energy_loops(rl.simulate(drive, until=period))) == 3
    with pytest.raises(rl.ParameterError, match="no waveforms"):
        energy_loops(rl.simulate(drive, until=0.03, record=None))
    with pytest.raises(rl.ParameterError, match="need one of"):
        save_energy_loop(rl.simulate(drive, until=0.03), tmp_path / "loop.gif")


def test_the_loop_is_that_of_the_last_period_whatever_the_rotor_did_before():
    result = rl.simulate(rl.load(HALF), until=0.05)
    back = result.theta_m.copy()
    back[: back.size // 4] = back[back.size // 4] + np.linspace(0.02, 0.01, back.size // 4)
    turned = replace(result, theta_m=back)
    for one, other in zip(energy_loops(result), energy_loops(turned), strict=True):
        assert other.area == pytest.approx(one.area) and one.work != 0
    there_and_back = replace(result, theta_m=np.minimum(result.theta_m, result.theta_m[::-1]))
    with pytest.raises(rl.ParameterError, match="in one direction"):
        energy_loops(there_and_back)


def test_a_wrong_torque_shows_in_the_loop():
    result = rl.simulate(rl.load(HALF), until=0.05)
    loop = energy_loops(result)[0]
    assert abs(replace(loop, work=1.2 * loop.work).difference) > 0.15
    assert abs(loop.difference) < 1e-3
