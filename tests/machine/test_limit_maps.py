"""The limit of machines given as flux maps: the same numbers as the machine behind the map."""

from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from limit_at import best_profile, profile_table

from reluctance import _core
from reluctance.machine.maps import FluxTable, surface
from reluctance.machine.optimum import phase_magnetics
from reluctance.machine.optimum.magnetics import content

RATED = 1500 * np.pi / 30  # [rad/s]
PAPER = _core.LeHuy(N_r=4, L_u=0.67e-3, L_a=23.62e-3, L_sat=0.15e-3, i_m=450.0, psi_m=0.468)
PSI, TAU = 0, 2


def of_the_paper() -> _core.FluxMap:
    i, theta_e = np.linspace(0, 1, 41) ** 1.5 * 220, np.linspace(0, np.pi, 31)
    at = np.meshgrid(i, theta_e, indexing="ij")
    psi = _core.magnetics(PAPER, at[0].ravel(), at[1].ravel())[:, PSI]
    return surface(FluxTable(4, i, theta_e, psi.reshape(41, 31)))


def leaning() -> _core.FluxMap:
    """A machine without symmetry, so that braking is not the mirror image of driving."""
    i, theta_e = np.linspace(0, 100, 21), np.linspace(0, 2 * np.pi, 49)[:-1]
    shape = (1 - np.cos(theta_e - 0.3 * np.sin(theta_e) ** 2)) / 2
    psi = 2e-3 * i[:, None] + 0.3 * (1 - np.exp(-i[:, None] / 30)) * shape
    return surface(FluxTable(6, i, theta_e, psi), symmetric=False)


MAP, LEANING = of_the_paper(), leaning()


@pytest.fixture(autouse=True)
def cache_dir(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("RELUCTANCE_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


@pytest.mark.parametrize("machine", [MAP, LEANING])
def test_spline_in_current_is_the_map_itself(machine: _core.FluxMap) -> None:
    theta_e = 2 * np.pi * np.arange(90) / 90
    i = np.random.default_rng(4).uniform(0, 300, 90)  # past the last current too
    i[:3] = 0.0, machine.knots[1], machine.knots[-1]
    psi, tau = phase_magnetics(machine)(ca.DM(i), theta_e)
    exact = _core.magnetics(machine, i, theta_e)
    np.testing.assert_allclose(psi.full().ravel(), exact[:, PSI], atol=1e-12)
    np.testing.assert_allclose(tau.full().ravel(), exact[:, TAU], atol=1e-10)


@pytest.mark.parametrize("machine", [MAP, LEANING])
def test_derivatives_for_the_solver_are_those_of_the_core(machine: _core.FluxMap) -> None:
    theta_e = 2 * np.pi * np.arange(30) / 30
    i = ca.MX.sym("i", 30)
    psi, tau = phase_magnetics(machine)(i, theta_e)
    at = np.random.default_rng(5).uniform(0, 150, 30)
    slopes = ca.Function("d", [i], [ca.diag(ca.jacobian(psi, i)), ca.diag(ca.jacobian(tau, i))])
    L_inc, tau_i = (v.full().ravel() for v in slopes(at))
    exact = _core.magnetics(machine, at, theta_e)
    np.testing.assert_allclose(L_inc, exact[:, 3], rtol=1e-9)
    np.testing.assert_allclose(tau_i, exact[:, 4], atol=1e-10)  # Maxwell: dtau/di = dpsi/dtheta


@pytest.mark.parametrize("n_phases", [3, 4, 5])
@pytest.mark.parametrize(
    ("u_dc", "rpm", "tau_ref"), [(240.0, 1500, 41.339), (150.0, 1060.7, 20.669)]
)
def test_map_of_a_machine_has_the_limits_of_the_machine(
    n_phases: int, u_dc: float, rpm: float, tau_ref: float
) -> None:
    point = {"n_phases": n_phases, "R": 0.72, "i_max": 200.0, "u_dc": u_dc}
    point |= {"omega_m": rpm * np.pi / 30, "tau_ref": tau_ref}
    machine, by_map = (best_profile(m, **point) for m in (PAPER, MAP))
    assert by_map.tau_error_max < 1e-6 * tau_ref
    for name in ("i_rms", "i_peak", "p_cu"):
        assert getattr(by_map, name) == pytest.approx(getattr(machine, name), rel=1e-3)


def test_least_error_of_a_map_is_that_of_its_machine_where_ripple_must_be() -> None:
    point = {"n_phases": 3, "R": 0.72, "i_max": 200.0, "u_dc": 150.0}
    point |= {"omega_m": RATED, "tau_ref": 41.339}
    machine, by_map = (best_profile(m, **point) for m in (PAPER, MAP))
    assert by_map.tau_error_max == pytest.approx(machine.tau_error_max, rel=1e-3)


@pytest.mark.parametrize(("tau_ref", "omega_m"), [(20.0, 60.0), (-20.0, 60.0), (-20.0, -60.0)])
def test_map_without_symmetry_holds_torque_of_either_sign(tau_ref: float, omega_m: float) -> None:
    point = {"n_phases": 4, "R": 0.3, "i_max": 100.0, "u_dc": 300.0, "n_points": 120}
    p = best_profile(LEANING, **point, tau_ref=tau_ref, omega_m=omega_m)
    exact = _core.magnetics(LEANING, p.i, p.theta_e)
    torque = exact[:, TAU].reshape(4, -1).sum(axis=0)
    np.testing.assert_allclose(torque, tau_ref, rtol=1e-6)
    np.testing.assert_allclose(p.psi, exact[:, PSI], atol=1e-12)
    dpsi_dt = 6 * omega_m * (np.roll(p.psi, -1) - p.psi) / p.theta_e[1]
    np.testing.assert_allclose(p.u, 0.3 * (p.i + np.roll(p.i, -1)) / 2 + dpsi_dt, atol=1e-9)
    assert np.abs(p.u).max() <= 300.0 * (1 + 1e-6)


def test_table_of_a_map_is_that_of_its_machine() -> None:
    setting = {"n_phases": 3, "R": 0.72, "i_max": 200.0, "u_dc": 240.0}
    setting |= {"omega_m": RATED, "tau_max": 41.339, "n_levels": 5}
    machine, by_map = (profile_table(m, **setting) for m in (PAPER, MAP))
    np.testing.assert_allclose(by_map.i_rms, machine.i_rms, rtol=1e-3, atol=1e-3)
    assert np.abs(by_map.i - machine.i).max() < 0.5


def test_cache_tells_maps_apart_by_every_coefficient() -> None:
    coefficients = MAP.coefficients.copy()
    coefficients[0, 3, 2] *= 1 + 1e-12
    other = _core.FluxMap(
        N_r=4, knots=MAP.knots, coefficients=coefficients, theta_span=MAP.theta_span
    )
    assert content(MAP) == content(of_the_paper())
    assert content(MAP) != content(other)
