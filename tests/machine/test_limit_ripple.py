"""The ripple that switching leaves: closed forms, and pulses integrated one by one."""

from itertools import product

import numpy as np
import pytest

from reluctance import _core
from reluctance.base.errors import ParameterError
from reluctance.machine.optimum import (
    OperatingPoint,
    Profile,
    RippleFloor,
    best_profile,
    ripple_floor,
)
from reluctance.machine.optimum.returning_flux import returning_mean
from reluctance.machine.optimum.ripple import _least

PAPER = _core.LeHuy(N_r=4, L_u=0.67e-3, L_a=23.62e-3, L_sat=0.15e-3, i_m=450.0, psi_m=0.468)
TAU_REF, RATED, U_DC = 41.339, 1500 * np.pi / 30, 240.0
POINT = OperatingPoint(PAPER, n_phases=3, R=0.72, i_max=150.0, u_dc=U_DC, omega_m=RATED)


@pytest.fixture(scope="module")
def profile(tmp_path_factory: pytest.TempPathFactory) -> Profile:
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("RELUCTANCE_CACHE", str(tmp_path_factory.mktemp("cache")))
        return best_profile(POINT, TAU_REF, norm="rms", smoothing=1e-3)


@pytest.fixture(scope="module")
def at_60kHz(profile: Profile) -> RippleFloor:
    return floor(profile, 60e3)


def floor(profile: Profile, f_switch: float) -> RippleFloor:
    return ripple_floor(POINT, profile, switching_frequency=f_switch)


@pytest.mark.parametrize("d", [0.1, 0.5, 0.8, -0.3])
def test_one_phase_alone_is_the_triangle_of_pulse_width_modulation(d: float) -> None:
    """Flux pp = u_dc d (1 - d)/f, a triangle: rms = pp/sqrt(12), with two edges a pulse."""
    gain = 150.0
    free, peak, held = _least(np.array([d * U_DC]), np.array([gain]), U_DC)
    f = 10e3
    pp = gain * U_DC * abs(d) * (1 - abs(d)) / f
    assert np.sqrt(held**3 / 3) / (2 * f) == pytest.approx(pp / np.sqrt(12), rel=0.02)
    assert 2 * peak / (2 * f) == pytest.approx(pp, rel=1e-9)
    assert free == pytest.approx(held, rel=1e-9)


def test_returning_fluxes_are_free_where_no_angle_has_two_phases() -> None:
    """One phase alone: its torque holds its flux linkage. Nine pairs of weights: 3e-4."""
    n, N, u_dc = 60, 3, 240.0
    rng = np.random.default_rng(1)
    flows = np.arange(n) < n // N
    u = np.where(flows, rng.uniform(-0.9, 0.9, n) * u_dc, 0.0)
    gain = np.where(flows, rng.uniform(100.0, 900.0, n), 0.0)
    mean = returning_mean(u, gain, flows, n_phases=N, u_dc=u_dc)
    alone = [_least(u[j : j + 1], gain[j : j + 1], u_dc)[0] for j in range(n // N)]
    assert mean == pytest.approx(np.mean(alone), rel=1e-3)


@pytest.mark.parametrize("seed", [9, 17, 23, 26, 28])
def test_a_rounding_of_the_full_voltage_does_not_change_the_bound(seed: int) -> None:
    """A solver leaves 1e-9 of it. With these the programme was called infeasible."""
    n, N, u_dc = 60, 3, 36.0
    rng = np.random.default_rng(seed)
    j = np.arange(n)
    flows = j < 45
    u = np.select([j < 8, j < 28, j < 45], [1.0, rng.uniform(0.2, 0.8, n), -1.0], 0.0)
    rounded = u * (1 - rng.uniform(0, 3e-9, n) * (np.abs(u) == 1))
    gain = np.where(flows, rng.uniform(5, 60, n) * np.where(j < 30, 1, -1), 0.0)
    exact, near = (
        returning_mean(u_dc * v, gain, flows, n_phases=N, u_dc=u_dc) for v in (u, rounded)
    )
    assert near == pytest.approx(exact, rel=1e-9)


def test_no_sharing_of_time_between_vectors_undercuts_the_bound() -> None:
    """Shares of independent phases are one way to hold all fluxes: the bound lies below."""
    rng = np.random.default_rng(6)
    for _ in range(20):
        d, gain = rng.uniform(-1, 1, 2), rng.uniform(-200, 200, 2)
        free, _, held = _least(d * U_DC, gain, U_DC)
        even = odd = 0.0
        for levels in product((0.0, 1.0), repeat=2):
            p = np.prod([abs(x) if on else 1 - abs(x) for x, on in zip(d, levels, strict=True)])
            part = p * abs((np.sign(d) * levels - d) @ gain * U_DC) ** (2 / 3)
            even, odd = (even + part, odd) if levels.count(0.0) % 2 == 0 else (even, odd + part)
        assert free <= held * (1 + 1e-9)
        assert held <= np.cbrt(even**3 + odd**3) * (1 + 1e-9)


def test_ripple_falls_as_one_over_switching_frequency(
    profile: Profile, at_60kHz: RippleFloor
) -> None:
    slow, fast = floor(profile, 15e3), at_60kHz
    for name in ("bound_rms", "bound_pp", "returning_rms", "on_profile_rms", "pulse_width_rms"):
        assert getattr(slow, name) == pytest.approx(4 * getattr(fast, name), rel=1e-9)
    assert 0 < slow.bound_rms < slow.returning_rms < slow.on_profile_rms < slow.pulse_width_rms
    assert slow.bound_pp > slow.bound_rms * np.sqrt(12) * 0.9  # of a triangle; more where it varies


def currents(psi: np.ndarray, theta_e: np.ndarray, i: np.ndarray) -> np.ndarray:
    """Newton from i: the current that has flux psi."""
    for _ in range(6):
        at = _core.magnetics(PAPER, i, theta_e)
        i = np.maximum(i + (psi - at[:, 0]) / at[:, 3], 0.0)
    return i


def test_pulses_one_by_one_leave_the_ripple_that_the_formula_says(
    profile: Profile, at_60kHz: RippleFloor
) -> None:
    """Natural sampling with a carrier whose frequency follows the angle; fluxes integrated, torque
    from the machine itself. Edges are counted, not assumed."""
    F, fine = at_60kHz.switching_frequency, 600
    n = 180 * fine
    theta_e = 2 * np.pi * (np.arange(n) + 0.5) / n
    dt = 2 * np.pi / n / (4 * RATED)
    grid = np.append(profile.theta_e, 2 * np.pi)
    i = np.interp(theta_e, grid, np.append(profile.i, profile.i[0]))
    u = np.repeat(profile.u, fine)
    d = np.minimum(np.abs(u) / U_DC, 1.0)
    at = _core.magnetics(PAPER, i, theta_e)
    flows = i > 1e-3 * profile.i_peak
    a = np.where(flows, np.abs(at[:, 4] / at[:, 3]) * d * (1 - d), 0.0)
    f = a ** (2 / 3)
    f *= 2 * F / f.mean()
    error, edges = [], 0
    for seed in range(4):
        tau = np.zeros(n)
        for k in range(3):
            carrier = np.cumsum(f) * dt + np.random.default_rng([seed, k]).uniform()
            x = np.abs(carrier % 1.0 - 0.5) * 2  # triangle 0..1
            level = np.where(x < d, np.sign(u), 0.0)
            deviation = np.cumsum(np.where(flows, level * U_DC - u, 0.0)) * dt
            window = np.maximum(1.0 / np.maximum(f, 1e3), dt) / dt  # samples of one pulse
            half = (window / 2).astype(int)
            total = np.concatenate([[0.0], np.cumsum(np.concatenate([deviation] * 3))])
            j = np.arange(n) + n
            slow = (total[j + half + 1] - total[j - half]) / (2 * half + 1)
            psi = at[:, 0] + np.where(flows, deviation - slow, 0.0)
            phase = _core.magnetics(PAPER, currents(psi, theta_e, i), theta_e)[:, 2]
            tau += np.roll(phase, k * n // 3)
            edges += np.abs(np.diff(level)).sum()
        error.append(tau - TAU_REF)
    period = 2 * np.pi / (4 * RATED)
    assert edges / (4 * 3 * 4 * period) == pytest.approx(F, rel=0.03)
    rms = np.sqrt(np.mean(np.square(error)))
    assert rms == pytest.approx(at_60kHz.pulse_width_rms, rel=0.05)
    assert rms > at_60kHz.bound_rms


@pytest.mark.parametrize("f_switch", [0.0, -1.0, np.nan])
def test_frequency_must_be_positive(profile: Profile, f_switch: float) -> None:
    with pytest.raises(ParameterError, match="switching_frequency"):
        floor(profile, f_switch)
