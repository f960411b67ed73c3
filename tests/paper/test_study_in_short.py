"""A coarse study of the source paper: its runs, its sweeps and its limits agree with each other."""

from types import SimpleNamespace

import numpy as np
import pytest
from brief_study import GRID, VOLTAGE_STEP, brief, coarse

from reluctance.base.errors import ParameterError
from reluctance.paper import pump, study, sweeps
from reluctance.paper.points import HALF, RATED, Runs, le_huy
from reluctance.paper.response import least_time, response_time
from reluctance.paper.sweeps import Response

RPM = np.pi / 30
LEVEL = 0.95  # of the torque reference: how the report defines that it is reached
K_PUMP, FRICTION = 0.0015, 0.02  # Table 1 of the paper
POINTS = [("rated", 41.339, 1500.0, 0.35e-3), ("half", 20.669, 1060.7, 0.28e-3)]  # section 4

of_each_point = pytest.mark.parametrize(("name", "tau", "rpm", "response"), POINTS)
of_both = pytest.mark.parametrize("name", ["rated", "half"])


def runs_of(name: str) -> Runs:
    runs: Runs = getattr(brief().found, name)
    return runs


def response_of(name: str) -> Response:
    found: Response = getattr(brief().found, f"{name}_response")
    return found


@of_each_point
def test_speed_is_held_and_the_mean_torque_is_the_reference(
    name: str, tau: float, rpm: float, response: float
) -> None:
    run = runs_of(name).locked
    np.testing.assert_allclose(run.omega_m, rpm * RPM)
    assert run.kpis.tau_mean == pytest.approx(tau, rel=2e-3)
    assert (run.drive.converter.u_dc_V, run.drive.control.T_s_us) == (240, 20)


@of_each_point
def test_pump_is_driven_from_standstill_to_its_speed_and_the_shaft_is_in_balance_there(
    name: str, tau: float, rpm: float, response: float
) -> None:
    run = runs_of(name).pump
    assert run.omega_m[0] == 0 and run.tau_ref.max() <= 45
    omega_m = run.kpis.speed_mean
    assert omega_m == pytest.approx(rpm * RPM, rel=1e-3)
    assert run.kpis.tau_mean == pytest.approx(K_PUMP * omega_m**2 + FRICTION * omega_m, rel=5e-3)


@of_both
def test_pump_without_speed_loop_rests_where_the_torques_balance(name: str) -> None:
    free = runs_of(name).free
    rest = pump.equilibrium_speed(free.tau_mean, k_pump=K_PUMP, B=FRICTION)
    assert free.speed_mean == pytest.approx(rest, rel=1e-3)


@of_each_point
def test_least_copper_gives_the_torque_at_the_speed_and_no_run_takes_less_current(
    name: str, tau: float, rpm: float, response: float
) -> None:
    runs = runs_of(name)
    given = runs.locked.drive.machine.tau(runs.best.i, runs.best.theta_e)
    assert 3 * given.mean() == pytest.approx(tau, rel=1e-3)
    assert runs.best.omega_m == pytest.approx(rpm * RPM)
    assert runs.best.i_rms <= runs.locked.kpis.i_rms < 1.01 * runs.best.i_rms


@of_each_point
def test_no_response_is_faster_than_physics_and_more_voltage_is_faster(
    name: str, tau: float, rpm: float, response: float
) -> None:
    r = response_of(name)
    assert r.point.response == response
    np.testing.assert_allclose(r.theta_deg, [0, 10, 20])
    np.testing.assert_allclose(r.u_dc, GRID.u_dc)
    assert r.reached.shape == r.bound.shape == (2, 3)
    assert (r.reached >= r.bound - 2e-7).all()
    assert (np.diff(r.bound, axis=0) < 0).all() and (np.diff(r.reached.min(axis=1)) < 0).all()
    assert r.reached.min() < 1.5 * r.bound.min() and r.reached.max() < 4e-3


@of_both
def test_run_of_the_response_starts_at_the_fastest_angle_of_the_drives_own_voltage(
    name: str,
) -> None:
    r = response_of(name)
    assert r.u_dc[r.own] == r.start.drive.converter.u_dc_V == 240
    fastest = r.reached[r.own]
    assert r.theta_start_deg == r.theta_deg[np.argmin(fastest)]
    assert np.degrees(r.start.theta_m[0]) == pytest.approx(r.theta_start_deg)
    assert not r.start.i[:, 0].any()
    after = int(np.argmax(r.start.tau >= LEVEL * r.point.tau_ref))
    assert r.start.t[after - 1] < fastest.min() <= r.start.t[after]


@of_both
def test_least_voltage_is_the_one_below_which_the_torque_is_too_late(name: str) -> None:
    r = response_of(name)
    worst_deg = [0.0, 10.0, 20.0]
    for u, angles, omega_m in (
        (r.u_least, [r.theta_least_deg], r.point.speed_rpm * RPM),
        (r.u_least_any, worst_deg, r.point.speed_rpm * RPM),
        (r.u_least_standstill, worst_deg, 0.0),
    ):
        late = [
            np.isinf(
                least_time(
                    r.start.drive.machine,
                    tau=LEVEL * r.point.tau_ref,
                    omega_m=omega_m,
                    u_dc=factor * u,
                    theta_m=np.radians(angles),
                    horizon=r.point.response,
                )
            )
            for factor in (0.99, 1.01)
        ]
        some_late_or_all = np.any if u == r.u_least_any else np.all
        assert some_late_or_all(late[0])
        assert not (np.any(late[1]) if u == r.u_least_any else np.all(late[1]))
    assert r.u_least_standstill <= r.u_least <= r.u_least_any
    assert r.theta_least_deg in worst_deg  # from 0 on, within a stroke


@of_both
def test_controllers_least_voltage_is_enough_and_one_step_less_is_not(name: str) -> None:
    r = response_of(name)
    assert r.u_reached % VOLTAGE_STEP == 0 and r.u_reached >= r.u_least

    def fastest(u_dc: float) -> float:
        return min(sweeps.controlled(r.point, u_dc, angle) for angle in r.theta_deg)

    with coarse():
        assert fastest(r.u_reached) <= r.point.response < fastest(r.u_reached - VOLTAGE_STEP)


@pytest.mark.parametrize("guess", [100.0, 345.0, 360.0, 900.0])
def test_search_finds_the_first_voltage_of_the_grid_that_is_fast_enough_from_any_guess(
    monkeypatch: pytest.MonkeyPatch, guess: float
) -> None:
    """A controller whose time is V s over voltage, and from its best angle 355 V are enough."""
    volt_seconds = 355 * RATED.response

    def controlled(point: object, u_dc: float, theta_deg: float) -> float:
        return volt_seconds / u_dc * (1 + abs(theta_deg - 10) / 100)

    monkeypatch.setattr(sweeps, "controlled", controlled)
    angles = np.array([0.0, 10.0, 20.0])
    assert sweeps._controllers_least_voltage(RATED, guess, angles) == 360
    monkeypatch.setattr(sweeps, "controlled", lambda *_: np.inf)
    with pytest.raises(RuntimeError, match=r"^rated torque: no response .* up to 1500 V$"):
        sweeps._controllers_least_voltage(RATED, guess, angles)


def test_settings_vary_one_key_and_the_others_are_the_papers() -> None:
    found = brief().found
    assert [(s.name, s.value) for s in found.settings] == [
        (name, value) for name, values in GRID.settings.items() for value in values
    ]
    by = {(s.name, s.value): s for s in found.settings}
    assert by["N_p", 3].kpis.torque_error_rms == by["r_w", 0.05].kpis.torque_error_rms
    assert by["N_p", 3].response == by["r_w", 0.05].response
    r = found.rated_response
    assert by["r_w", 0.05].response == r.reached[r.own].min()
    errors = [by["r_w", w].kpis.torque_error_rms for w in (0.05, 5)]
    assert errors[0] is not None and errors[1] is not None
    assert errors[0] == pytest.approx(found.rated.locked.kpis.torque_error_rms, rel=0.01)
    assert errors[1] > 2 * errors[0]  # a heavier weight follows the reference less
    assert all(s.kpis.periods >= 4 for s in found.settings)


def test_moves_never_outnumber_the_horizon_and_have_room_when_they_are_varied(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    tried: list[tuple[str, int, int]] = []

    def noted(drive: object, **_: object) -> SimpleNamespace:
        control = drive.control
        tried.append((f"{control.r_w:g}", control.N_p, control.N_c))
        return SimpleNamespace(kpis=None)

    monkeypatch.setattr(sweeps, "simulate", noted)
    monkeypatch.setattr(sweeps, "controlled", lambda *_: 1e-3)
    sweeps.settings(RATED, {"N_p": [1, 2, 8], "N_c": [1, 4], "r_w": [0.5]}, 0.0)
    expected = [(1, 1), (2, 2), (8, 2), (4, 1), (4, 4), (3, 2)]
    assert [pair[1:] for pair in tried] == expected
    assert [pair[0] for pair in tried] == ["0.05"] * 5 + ["0.5"]


def test_report_has_the_settings_voltages_and_angles_that_its_texts_name() -> None:
    """N_p = 1..10, N_c = 1..4, r_w = 0.5, 5 and 50; best angles to a degree."""
    of = study.FULL.settings
    assert (min(of["N_p"]), max(of["N_p"])) == (1, 10) and of["N_c"] == [1, 2, 3, 4]
    assert {0.05, 0.5, 5, 50} <= {*of["r_w"]} and 3 in of["N_p"]
    assert 240 in study.FULL.u_dc and study.FULL.angle_step_deg == 1


def test_progress_rises_and_leaves_a_quarter_for_the_figures() -> None:
    shares = brief().shares
    assert shares == sorted(set(shares)) and 0 < shares[0] and shares[-1] == 0.75


@pytest.mark.parametrize("samples", [11, 1000])
def test_response_time_is_where_a_straight_rise_first_passes_95_percent(samples: int) -> None:
    t = np.linspace(0, 1e-3, samples)
    rise = SimpleNamespace(t=t, tau=t / 1e-3 * 20, tau_ref=np.full(samples, 10.0))
    assert response_time(rise) == pytest.approx(0.475e-3)
    rise.tau[-1] = 0  # what comes later does not matter
    assert response_time(rise) == pytest.approx(0.475e-3)
    rise.tau_ref = np.full(samples, 30.0)
    assert response_time(rise) == np.inf


def test_first_of_two_passages_counts() -> None:
    t = np.arange(6.0)
    twice = SimpleNamespace(t=t, tau=np.array([0, 4, 12, 2, 12, 12.0]), tau_ref=np.full(6, 10.0))
    assert response_time(twice) == pytest.approx(1 + (9.5 - 4) / 8)


def test_response_that_takes_longer_than_the_horizon_is_none() -> None:
    machine = RATED.drive().machine
    asked = {"tau": 39.27, "omega_m": 1500 * RPM, "u_dc": 240.0}
    sure = {**asked, "theta_m": np.radians(5.0)}
    time = float(least_time(machine, **sure, horizon=2e-3))
    for factor, expected in ((1.02, time), (0.98, np.inf)):
        found = least_time(machine, **sure, horizon=factor * time)
        assert float(found) == pytest.approx(expected, abs=1e-8)


def test_point_reads_its_drive_with_changes() -> None:
    for point, rpm in ((RATED, 1500), (HALF, 1060.7)):
        drive = point.drive("converter.u_dc_V=300")
        assert drive.converter.u_dc_V == 300
        assert drive.omega_nominal == pytest.approx(rpm * RPM)
        assert drive.tau_max == pytest.approx(point.tau_ref)


def test_machine_of_another_model_is_refused_with_the_one_that_is_needed() -> None:
    machine = RATED.drive().machine
    assert le_huy(machine).L_u == pytest.approx(0.67e-3)
    other = SimpleNamespace(name="other", magnetics=None)
    with pytest.raises(ParameterError, match=r"^other: need the analytic model `lehuy`"):
        le_huy(other)
