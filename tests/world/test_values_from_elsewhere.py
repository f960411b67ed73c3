"""Figures known from elsewhere: closed forms, hand calculation, an integration of their own.

None repeats the formula of the code that it looks at.
"""

import tomllib
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import reluctance as rl
from reluctance.drive.guard.trip_levels import current_error, protection
from reluctance.drive.run import kpis as key_figures
from reluctance.explore.comparison import compare
from reluctance.explore.comparison.contenders import CONTENDERS
from reluctance.explore.efficiency_map import efficiency
from reluctance.explore.sweeps import sweep
from reluctance.machine.map_file import accept_in
from reluctance.machine.maps import FluxTable, check_map, read_map, write_map
from reluctance.machine.optimum import ripple
from reluctance.paper import claims_equations
from reluctance.paper.points import le_huy
from reluctance.targets.gym.spaces import observed

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "examples"


def triangle(slope_up: float, slope_down: float) -> tuple[float, float]:
    """Peak to peak and rms of a saw that rises and falls to where it began, by integration."""
    t = np.linspace(0, 1, 200_001)
    turn = slope_down / (slope_up + slope_down)
    saw = np.where(t < turn, slope_up * t, slope_up * turn - slope_down * (t - turn))
    saw -= np.trapezoid(saw, t)
    return float(np.ptp(saw)), float(np.sqrt(np.trapezoid(saw**2, t)))


@pytest.mark.parametrize(("d", "gain", "u_dc"), [(0.5, 30.0, 240.0), (0.2, 7.0, 400.0)])
def test_ripple_of_one_phase_is_that_of_a_triangle(
    d: float, gain: float, u_dc: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One phase at constant voltage: torque is a triangle with two pulses per turn-on of a switch,
    because the two switches of a leg take turns. No control leaves less."""
    F, n = 5000.0, 24
    ones = np.ones((1, n))
    monkeypatch.setattr(
        ripple, "_local", lambda *_: (d * u_dc * ones, gain * ones, ones.astype(bool))
    )
    monkeypatch.setattr(ripple, "returning_mean", lambda *_, **__: 0.0)
    point: Any = SimpleNamespace(n_phases=1)
    profile: Any = SimpleNamespace(u_dc=u_dc, theta_e=np.ones(n), tau_error_rms=0.0)
    found = ripple.ripple_floor(point, profile, switching_frequency=F)
    pp, rms = triangle(gain * u_dc * (1 - d) / (2 * F), gain * u_dc * d / (2 * F))
    assert found.pulse_width_rms == pytest.approx(rms, rel=1e-6)
    assert found.on_profile_rms == pytest.approx(rms, rel=2e-2)  # the bound takes few weights
    assert found.on_profile_rms <= rms * (1 + 1e-9)
    assert found.bound_pp == pytest.approx(pp, rel=1e-6)


@pytest.mark.parametrize("broken", ["E_source", "E_winding", "W_f", "W_dc", "E_mech"])
def test_energy_that_is_missing_from_a_row_is_in_the_residual(broken: str) -> None:
    drive = rl.load(EXAMPLES / "voltage_sag.toml")
    result = rl.simulate(drive, until=0.05, record=None)
    rows = result.periods
    values = rows.values.copy()
    E = rows["E_dc"][-1] - rows["E_dc"][0]
    values[-2:, rows.names.index(broken)] += 0.01 * E  # two rows of one end
    figures = key_figures.kpis(
        type(rows)(values, rows.names), drive, p_fe=None, wall_s_per_sim_s=0.0
    )
    assert result.kpis.energy_residual is not None and result.kpis.energy_residual < 1e-6
    assert figures.energy_residual is not None and figures.energy_residual > 5e-3


def test_switching_of_a_shared_switch_counts_its_whole_current() -> None:
    """From the waveform: the voltage times the current of each switch that turns on, the shared one
    with the currents of all phases."""
    drive = rl.load(EXAMPLES / "shared_switch.toml").with_values({"simulation.until_s": 0.05})
    result = rl.simulate(drive, record=0.0)
    upper = (result.leg == 1).any(axis=0)
    lower = (result.leg == 1) | ((result.leg == 0) & ~upper)
    on, off = 0.0, 0.0
    for n in range(1, len(result.t)):
        i, u = result.i[:, n], result.u_dc[n]
        changes = lower[:, n].astype(int) - lower[:, n - 1]
        shared = int(upper[n]) - int(upper[n - 1])
        on += u * (i[changes > 0].sum() + (i.sum() if shared > 0 else 0.0))
        off += u * (i[changes < 0].sum() + (i.sum() if shared < 0 else 0.0))
    rows = result.periods
    assert rows["S_on"][-1] == pytest.approx(on, rel=1e-3)
    assert rows["S_off"][-1] == pytest.approx(off, rel=1e-3)
    assert on > 0


def test_trip_levels_of_two_drives() -> None:
    """By hand: 220 A over 4096 codes and noise of 2 codes, six times, and one code more: 13 codes;
    1500 rpm and three tenths more; 150 A and a fifth more."""
    board = rl.load(EXAMPLES / "deadbeat_g474.toml")
    found = protection(board).levels
    assert current_error(board) == pytest.approx(13 * 220 / 4096)
    assert found.omega_max == pytest.approx(1950 * np.pi / 30)
    assert (found.i_trip, found.u_dc_min, found.u_dc_max) == pytest.approx((180, 60, 300))
    assert np.degrees(found.angle_slack) == pytest.approx(0.527, abs=0.001)  # 1.5 steps of 0.352
    pump = rl.load(EXAMPLES / "paper_pump.toml").with_values(
        {"sensing.encoder_counts": 4096, "sensing.adc_bits": 12, "sensing.i_range_A": 800}
        | {"sensing.i_noise_LSB": 2.0}
    )
    assert current_error(pump) == pytest.approx(13 * 800 / 4096)
    # A change of 2 sqrt(2 slack a) within sqrt(2 slack/a): docs/firmware.md; whole samples
    guard = protection(pump)
    tau = guard.advance.parts * guard.advance.block * pump.control.T_s
    change = (2 * guard.levels.angle_slack + guard.advance.bend) / tau / 4 * 30 / np.pi
    assert tau * 9 / 8 == pytest.approx(0.54e-3)
    assert change == pytest.approx(208, abs=1)  # [rpm]
    a = guard.advance.bend / tau**2
    assert change == pytest.approx(15 / np.pi * np.sqrt(2 * guard.levels.angle_slack * a), rel=0.02)


def test_angles_of_braking_that_the_user_gives_are_taken() -> None:
    drive = rl.load(EXAMPLES / "ditc.toml")
    given = drive.with_values({"control.brake_on_deg": 150.0, "control.brake_off_deg": 280.0})
    window = given.control.brake_window(given.known())  # type: ignore[attr-defined]
    assert np.degrees(window) == pytest.approx((150, 280))
    assert np.degrees(drive.control.brake_window(drive.known())) != pytest.approx(  # type: ignore[attr-defined]
        (150, 280)
    )


def two_files(folder: Path) -> tuple[Path, FluxTable]:
    i, theta_e = np.linspace(0, 10, 11), np.linspace(0, np.pi, 19)
    L = 0.02 - 0.01 * np.cos(theta_e)
    table = FluxTable(4, i, theta_e, i[:, None] * L)
    write_map(table, folder / "map.csv")
    path = folder / "machine.toml"
    path.write_text(
        '[machine]\nname = "x"\nsource = "test"\nlicence = "Apache-2.0"\nN_s = 6\nN_r = 4\n'
        'n_phases = 3\nR_ohm = 1.0\ni_max_A = 10\nJ_kgm2 = 0.001\nmodel = "map"\n'
        'map = "map.csv"\nangle_kind = "electrical"\n',
        encoding="utf-8",
    )
    return path, table


def test_a_reason_goes_into_a_machine_file_that_had_none(tmp_path: Path) -> None:
    path, _ = two_files(tmp_path)
    for reason in ("measured twice", "and once more"):
        before = tomllib.loads(path.read_text())["machine"]
        accept_in(path, reason)
        after = tomllib.loads(path.read_text())["machine"]
        assert after == before | {"accepted_because": reason}


def test_a_map_that_ends_below_the_current_limit_says_by_how_much(tmp_path: Path) -> None:
    _, table = two_files(tmp_path)
    assert check_map(table, i_max=12.5).extrapolation_share == pytest.approx(0.2)
    assert check_map(table, i_max=8).extrapolation_share == 0


def test_a_fault_of_the_torque_file_names_the_torque_file(tmp_path: Path) -> None:
    flux = tmp_path / "flux.csv"
    flux.write_text("i_A,theta_e_deg,psi_Wb\n0,0,0\n0,180,0\n1,0,0.1\n1,180,0.2\n")
    torque = tmp_path / "torque.csv"
    for text in ("what,is,this\n0,0,0\n", "i_A,theta_e_deg,tau_Nm\n0,0,0\n0,90,0\n2,0,0\n2,90,1\n"):
        torque.write_text(text)
        with pytest.raises(rl.ParameterError, match=r"torque\.csv: "):
            read_map(flux, N_r=4, torque=torque)
    torque.unlink()
    with pytest.raises(rl.ParameterError, match=r"torque\.csv: no such file"):
        read_map(flux, N_r=4, torque=torque)
    flux.write_text("")
    with pytest.raises(rl.ParameterError, match=r"flux\.csv: "):
        read_map(flux, N_r=4, torque=torque)


def test_the_default_speeds_of_an_efficiency_map_end_at_twice_the_drive_s(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    from reluctance.explore.efficiency_map import map as module

    class Seen(Exception):
        pass

    def stop(base: Any, columns: dict[str, list[float]], *_: Any, **__: Any) -> None:
        raise Seen(max(columns["load.speed_rpm"]), max(columns["reference.tau_Nm"]))

    monkeypatch.setattr(module, "swept", stop)
    drive = rl.load(EXAMPLES / "sharing_cubic.toml")  # 1500 rpm, 41.339 N m
    with pytest.raises(Seen) as seen:
        efficiency(drive)
    assert seen.value.args[0] == pytest.approx(3000)


@pytest.mark.parametrize(
    ("task", "name", "scale"), [("speed", "omega_ref", 50 * np.pi), ("torque", "tau_ref", None)]
)
def test_the_last_number_of_an_observation_is_the_reference_of_the_task(
    task: str, name: str, scale: float | None
) -> None:
    drive = rl.load(EXAMPLES / "sharing_cubic.toml")
    episodes: Any = SimpleNamespace(drive=drive, action="legs", task=task)
    *others, last = observed(episodes)
    assert last.name == name
    assert last.one == pytest.approx(scale or drive.tau_max)
    assert not {"omega_ref", "tau_ref"} & {o.name for o in others}


def test_numbers_of_an_own_law_stay_with_that_law() -> None:
    """A drive with its own law and a number for it; the built-in laws get none of it."""
    contender = next(c for c in CONTENDERS.values() if c.law == "deadbeat")
    own = SimpleNamespace(law="python:laws.py:Own", model_extra={"gain": 3.0})
    point: Any = SimpleNamespace(control=own)
    assert contender._own_numbers(point) == {}
    same = replace(contender, law="python:laws.py:Own")
    assert same._own_numbers(point) == {"gain": 3.0}
    assert replace(contender, law="python:laws.py:Other")._own_numbers(point) == {}


def test_what_cannot_be_meant_is_refused() -> None:
    drive = rl.load(EXAMPLES / "sharing_cubic.toml")
    for f_switch in (0.0, -1.0, 1e9):
        with pytest.raises(rl.ParameterError, match="switching frequency"):
            compare(drive, ["sharing_cubic"], f_switch=f_switch)
    with pytest.raises(rl.ParameterError, match="takes a Drive"):
        sweep("drive.toml", {})  # type: ignore[arg-type]
    with pytest.raises(rl.ParameterError, match="lehuy"):
        le_huy(drive.with_values({"machine": "npf_vector_6_4", "reference.tau_Nm": 5}).machine)
    with pytest.raises(rl.ParameterError, match="kind = 'pv' with"):
        drive.with_values(
            {"reference.kind": "pv", "reference.speed_rpm": 1500.0, "reference.tau_Nm": None}
        )


def test_a_claim_that_is_wrong_is_called_wrong() -> None:
    """Section 3 says that unaligned flux is linear; here a machine is linear aligned as well."""
    machine = rl.load(EXAMPLES / "paper_rated.toml").machine
    assert claims_equations.flux_curves(machine).verdict != "false"
    linear = machine.model_copy(
        update={
            "L_sat_H": machine.L_a_H * 0.9,
            "i_m_A": 1e6,
            "psi_m_Wb": 1e6 * 0.95 * machine.L_a_H,
        }
    )
    assert (
        claims_equations.flux_curves(linear).verdict
        != claims_equations.flux_curves(machine).verdict
    )


def test_angles_by_rule_hold_the_torque_of_a_machine_with_a_map() -> None:
    """The search for the angles keeps what it tried by machine; a map machine has a hash too."""
    base = rl.load(EXAMPLES / "pwm_current.toml")
    given = base.with_values({"machine": "guc_linear_6_4", "reference.tau_Nm": 1.5})
    drive = given.with_values({"converter.u_dc_V": 300, "load.speed_rpm": 500})
    assert hash(drive.machine) == hash(given.machine)
    assert rl.simulate(drive, until=0.05, record=None).kpis.tau_mean == pytest.approx(1.5, rel=0.05)
