"""The physical limit: published operating points, laws of the profile, and the cache."""

import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from limit_at import best_profile, profile_table, torque_speed_envelope

import reluctance as rl
from reluctance import _core
from reluctance.base.errors import ParameterError
from reluctance.machine import optimum
from reluctance.machine.optimum import OperatingPoint, phase_magnetics

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "bench"))
from guides import counted  # noqa: E402

EIGHT_SIX = [
    "machine=generic_1hp_8_6",
    "sensing.i_range_A=10",
    "reference.tau_Nm=2",
    "mismatch.flux_factor=1",
    "mismatch.R_factor=1",
]
RATED = 1500 * np.pi / 30  # [rad/s]
L_U, L_SAT, I_M = 0.67e-3, 0.15e-3, 450.0


def machine(L_a: float, psi_m: float) -> _core.LeHuy:
    return _core.LeHuy(N_r=4, L_u=L_U, L_a=L_a, L_sat=L_SAT, i_m=I_M, psi_m=psi_m)


PAPER = machine(23.62e-3, 0.468)
DRIVE = {"n_phases": 3, "R": 0.72, "i_max": 200.0}


@pytest.fixture(autouse=True)
def cache_dir(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("RELUCTANCE_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


def torque_from_alignment(m: _core.LeHuy, i: np.ndarray, theta_e: np.ndarray) -> np.ndarray:
    """The published form: mechanical angle from alignment, cubic shape with powers of N_r/pi."""
    past = theta_e > np.pi
    theta = np.abs(theta_e - np.pi) / m.N_r
    slope = 6 * m.N_r**3 / np.pi**3 * theta**2 - 6 * m.N_r**2 / np.pi**2 * theta
    bracket = (m.L_sat - m.L_u) * i**2 / 2 + m.A * i - m.A / m.B * (1 - np.exp(-m.B * i))
    return bracket * np.where(past, slope, -slope)


def total_torque(m: _core.LeHuy, i: np.ndarray, n_phases: int, finer: int = 1) -> np.ndarray:
    """Torque of all phases (n finer/n_phases,), the current linear between its n points."""
    n = len(i)
    theta_e = 2 * np.pi * np.arange(n * finer) / (n * finer)
    i_fine = np.interp(np.arange(n * finer) / finer, np.arange(n + 1), np.append(i, i[0]))
    return torque_from_alignment(m, i_fine, theta_e).reshape(n_phases, -1).sum(axis=0)


@pytest.mark.parametrize(
    ("i", "psi_a", "psi_mid", "psi_u", "tau_mid"),
    [
        (10, 0.18103, 0.09386, 0.00670, 1.824),
        (50, 0.40059, 0.21705, 0.03350, 25.324),
        (200, 0.44849, 0.29125, 0.13400, 125.729),
        (450, 0.48600, 0.39375, 0.30150, 244.856),
    ],
)
def test_flux_and_torque_are_those_of_the_default_60_kw_machine(
    i: float, psi_a: float, psi_mid: float, psi_u: float, tau_mid: float
) -> None:
    theta_e = np.array([np.pi, np.pi / 2, 0.0, 3 * np.pi / 2])
    psi, tau = phase_magnetics(machine(23.6e-3, 0.486))(ca.DM([i] * 4), theta_e)
    np.testing.assert_allclose(psi.full().ravel(), [psi_a, psi_mid, psi_u, psi_mid], atol=6e-6)
    np.testing.assert_allclose(tau.full().ravel(), [0, tau_mid, 0, -tau_mid], atol=6e-4)


@pytest.mark.parametrize(
    ("u_dc", "rpm", "tau_ref", "i_rms", "i_peak", "p_cu"),
    [
        (240.0, 1500, 41.339, 48.9, 89.3, 5171),
        (540.0, 1500, 41.339, 48.8, 88.9, 5150),
        (150.0, 1060.7, 20.669, 28.7, 52.9, 1780),
        (800.0, 1060.7, 20.669, 28.7, 52.9, 1780),
    ],
)
def test_least_copper_without_ripple_is_the_published_one(
    u_dc: float, rpm: float, tau_ref: float, i_rms: float, i_peak: float, p_cu: float
) -> None:
    p = best_profile(PAPER, **DRIVE, tau_ref=tau_ref, omega_m=rpm * np.pi / 30, u_dc=u_dc)
    assert p.tau_error_max < 1e-6 * tau_ref
    assert [p.i_rms, p.i_peak, p.p_cu] == pytest.approx([i_rms, i_peak, p_cu], rel=0.01)


def test_least_greatest_error_is_the_published_one_where_ripple_must_be() -> None:
    p = best_profile(PAPER, **DRIVE, tau_ref=41.339, omega_m=RATED, u_dc=150.0)
    assert p.tau_error_max == pytest.approx(7.26, rel=0.01)
    assert [p.i_rms, p.i_peak, p.p_cu] == pytest.approx([54.2, 111, 6357], rel=0.01)


def test_each_norm_is_least_in_its_own_measure() -> None:
    point = {**DRIVE, "tau_ref": 41.339, "omega_m": RATED, "u_dc": 150.0}
    by_max = best_profile(PAPER, **point, norm="max")
    by_rms = best_profile(PAPER, **point, norm="rms")
    assert by_max.tau_error_max < by_rms.tau_error_max
    assert by_rms.tau_error_rms < 0.5 * by_max.tau_error_rms


@pytest.mark.parametrize(("n_points", "rms", "greatest"), [(180, 6e-4, 3e-3), (360, 2e-4, 1e-3)])
def test_torque_is_constant_between_the_grid_points_too(
    n_points: int, rms: float, greatest: float
) -> None:
    p = best_profile(PAPER, **DRIVE, tau_ref=41.339, omega_m=RATED, u_dc=240.0, n_points=n_points)
    np.testing.assert_allclose(total_torque(PAPER, p.i, 3), 41.339, rtol=1e-8)
    error = total_torque(PAPER, p.i, 3, finer=8) / 41.339 - 1
    assert np.sqrt(np.mean(error**2)) < rms
    assert np.abs(error).max() < greatest


@pytest.mark.parametrize("tau_ref", [41.339, -41.339])
def test_profile_keeps_the_limits_and_the_energy_balance(tau_ref: float) -> None:
    p = best_profile(PAPER, **DRIVE, tau_ref=tau_ref, omega_m=RATED, u_dc=240.0)
    omega_e = PAPER.N_r * RATED
    dpsi_dt = omega_e * (np.roll(p.psi, -1) - p.psi) / p.theta_e[1]
    i_mean = (p.i + np.roll(p.i, -1)) / 2
    np.testing.assert_allclose(p.u, DRIVE["R"] * i_mean + dpsi_dt, atol=1e-9)
    assert np.abs(p.u).max() <= 240.0 * (1 + 1e-6)
    assert p.i.min() >= 0.0
    p_in = 3 * np.mean(p.u * i_mean)
    assert p_in == pytest.approx(p.p_cu + tau_ref * RATED, abs=2e-3 * abs(tau_ref * RATED))


def test_torque_of_the_other_sign_is_the_mirror_image() -> None:
    forward = best_profile(PAPER, **DRIVE, tau_ref=41.339, omega_m=RATED, u_dc=240.0)
    reverse = best_profile(PAPER, **DRIVE, tau_ref=-41.339, omega_m=-RATED, u_dc=240.0)
    np.testing.assert_allclose(reverse.i[1:], forward.i[:0:-1], atol=1e-12)
    np.testing.assert_allclose(total_torque(PAPER, reverse.i, 3), -41.339, rtol=1e-8)
    assert reverse.i_rms == forward.i_rms


@pytest.mark.parametrize("tau_ref", [2.0, 41.339])
def test_standstill_is_the_best_split_at_every_angle(tau_ref: float) -> None:
    """Without a voltage limit the angles part: compare with a scan of all splits of the torque."""
    p = best_profile(PAPER, **DRIVE, tau_ref=tau_ref, omega_m=0.0, u_dc=240.0, n_points=60)
    i_axis = np.linspace(0.0, 200.0, 40_001)
    squares = []
    for theta_e in 2 * np.pi * np.arange(20) / 60:
        angles = theta_e + 2 * np.pi * np.arange(3) / 3
        curves = [torque_from_alignment(PAPER, i_axis, np.full_like(i_axis, a)) for a in angles]
        rising = [c for c in curves if c[-1] > 1e-9]  # the others only brake
        first, second = rising[0], rising[-1]
        i_rest = np.interp(tau_ref - first, second, i_axis, left=0.0, right=np.inf)
        alone = np.interp(tau_ref, first, i_axis, right=np.inf)
        splits = i_axis**2 + np.where(first <= tau_ref, i_rest, np.inf) ** 2
        squares.append(alone**2 if len(rising) == 1 else min(splits.min(), alone**2))
    assert p.i_rms**2 == pytest.approx(np.sum(squares) / 60, rel=1e-4)


def test_optimum_does_not_depend_on_the_start() -> None:
    point = OperatingPoint(PAPER, **DRIVE, u_dc=240.0, omega_m=RATED)
    programme = optimum.Programme(point, n_points=180)
    rng = np.random.default_rng(3)
    bumps = [100 * np.maximum(np.sin(programme.theta_e + a), 0) for a in (0.0, 0.5, 1.0)]
    starts = [np.full(180, 50.0), rng.uniform(0, 100, 180), *bumps]
    i_rms = [np.sqrt(np.mean(programme.best(41.339, "max", s) ** 2)) for s in starts]
    np.testing.assert_allclose(i_rms, i_rms[0], rtol=1e-6)


@pytest.mark.parametrize("n_phases", [4, 5])
def test_more_phases_hold_the_torque_with_less_current_each(n_phases: int) -> None:
    drive = {**DRIVE, "tau_ref": 41.339, "omega_m": RATED, "u_dc": 240.0}
    p = best_profile(PAPER, **{**drive, "n_phases": n_phases})
    np.testing.assert_allclose(total_torque(PAPER, p.i, n_phases), 41.339, rtol=1e-8)
    fewer = best_profile(PAPER, **{**drive, "n_phases": n_phases - 1})
    assert p.i_rms < fewer.i_rms


def test_table_levels_hold_their_torque_and_record_where_they_cannot() -> None:
    t = profile_table(PAPER, **DRIVE, tau_max=41.339, omega_m=RATED, u_dc=150.0, n_levels=9)
    assert t.i.shape == t.psi.shape == (9, 180)
    assert not t.i[0].any()
    assert not t.psi[0].any()
    for tau_ref, i, error in zip(t.tau_ref, t.i, t.tau_error_max, strict=True):
        measured = np.abs(total_torque(PAPER, i, 3) - tau_ref).max()
        assert measured == pytest.approx(error, abs=1e-6)
    ripple_free = t.tau_error_max < 1e-6
    envelope = torque_speed_envelope(PAPER, **DRIVE, omega_m=RATED, u_dc=150.0)
    np.testing.assert_array_equal(ripple_free, t.tau_ref <= envelope.tau_max[0])
    psi, _ = phase_magnetics(PAPER)(ca.DM(t.i[5]), t.theta_e)
    np.testing.assert_allclose(psi.full().ravel(), t.psi[5], atol=1e-12)


def test_a_torque_just_beyond_the_greatest_without_ripple_has_a_profile() -> None:
    """Where the least error is nearly none, a share of it leaves no room to the least copper."""
    study = rl.load(ROOT / "examples/edge_mpc_learning.toml", EIGHT_SIX).known()
    less = study.machine.computed(
        L_u_H=1.1 * study.machine.L_u_H, psi_m_Wb=0.9 * study.machine.psi_m_Wb
    )
    point = replace(study, machine=less).at(study.omega_m)
    t = optimum.profile_table(point, 2.7, n_points=360, n_levels=2)
    assert 0 < t.tau_error_rms[1] < 2e-3 * t.tau_ref[1]


def test_above_a_torque_with_ripple_the_least_error_comes_first() -> None:
    """Four searches for the least error and one for its copper; none without ripple."""
    point = OperatingPoint(PAPER, **DRIVE, u_dc=150.0, omega_m=RATED)
    asked = optimum.Programme(point, n_points=90)
    asked.best(38.0, "rms")
    with counted() as count:
        i = asked.best(41.339, "rms")
    assert count.searches == 5
    np.testing.assert_allclose(i, optimum.Programme(point, n_points=90).best(41.339, "rms"))


@pytest.mark.parametrize("tau_ref", [1e-4, 0.0068])
def test_however_little_the_torque_its_profile_is_free_of_ripple(tau_ref: float) -> None:
    """0.3 % of the greatest torque of a small machine at 4500 rpm, 1.4e-6 off with tolerances in
    N m: then weighted, with ripple, as was all of the guide above it."""
    study = rl.load(ROOT / "examples/edge_mpc_learning.toml", EIGHT_SIX).known()
    point = study.at(3 * RATED)
    t = optimum.profile_table(point, tau_ref, n_points=360, n_levels=2, ripple_weight=100.0)
    assert t.tau_error_max[1] < 1e-7 * tau_ref


def test_smoothing_of_the_table_costs_next_to_no_copper() -> None:
    t = profile_table(PAPER, **DRIVE, tau_max=41.339, omega_m=RATED, u_dc=240.0, n_levels=3)
    for tau_ref, i_rms, i in zip(t.tau_ref[1:], t.i_rms[1:], t.i[1:], strict=True):
        best = best_profile(PAPER, **DRIVE, tau_ref=float(tau_ref), omega_m=RATED, u_dc=240.0)
        assert best.i_rms <= i_rms < 1.001 * best.i_rms
        assert np.abs(np.diff(i)).max() < np.abs(np.diff(best.i)).max()


def test_envelope_is_the_border_between_ripple_and_none() -> None:
    rpm = np.array([0.0, 1500.0, 2000.0, 3000.0])
    e = torque_speed_envelope(PAPER, **DRIVE, omega_m=rpm * np.pi / 30, u_dc=240.0)
    assert e.tau_max[0] == pytest.approx(e.tau_max[1], rel=1e-3)  # i_max decides, not u_dc
    assert e.tau_max[1] > e.tau_max[2] > e.tau_max[3] > 0
    point = {**DRIVE, "omega_m": float(e.omega_m[2]), "u_dc": 240.0}
    assert best_profile(PAPER, **point, tau_ref=0.99 * e.tau_max[2]).tau_error_max < 1e-4
    assert best_profile(PAPER, **point, tau_ref=1.01 * e.tau_max[2]).tau_error_max > 0.01


def test_cache_gives_back_the_same_profile_without_solving(
    cache_dir: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    point = {**DRIVE, "tau_ref": 20.669, "omega_m": RATED, "u_dc": 240.0, "n_points": 60}
    first = best_profile(PAPER, **point)
    assert len(list(cache_dir.iterdir())) == 1
    with monkeypatch.context() as patch:
        patch.delattr(optimum.profile, "Programme")
        second = best_profile(PAPER, **point)
        with pytest.raises(NameError):
            best_profile(PAPER, **{**point, "u_dc": 241.0})
    for name in ("theta_e", "i", "psi", "u"):
        np.testing.assert_array_equal(getattr(first, name), getattr(second, name))
    assert (first.i_rms, first.p_cu) == (second.i_rms, second.p_cu)


@pytest.mark.parametrize("damage", ["empty", "half", "flipped"])
def test_damaged_cache_file_is_computed_again(cache_dir: Path, damage: str) -> None:
    point = {**DRIVE, "tau_ref": 20.669, "omega_m": RATED, "u_dc": 240.0, "n_points": 60}
    first = best_profile(PAPER, **point)
    (file,) = cache_dir.iterdir()
    whole = file.read_bytes()
    at = len(whole) // 3
    file.write_bytes(
        {
            "empty": b"",
            "half": whole[: len(whole) // 2],
            "flipped": whole[:at] + bytes(255 - b for b in whole[at : at + 64]) + whole[at + 64 :],
        }[damage]
    )
    second = best_profile(PAPER, **point)
    np.testing.assert_array_equal(first.i, second.i)
    with np.load(file) as repaired:
        np.testing.assert_array_equal(repaired["i"], first.i)


@pytest.mark.parametrize("change", [lambda i: i + np.nan, lambda i: i[:, :-1], lambda i: 2 * i])
def test_changed_cache_file_is_computed_again(
    cache_dir: Path, change: Callable[[np.ndarray], np.ndarray]
) -> None:
    """A whole file with other numbers than were stored."""
    point = {**DRIVE, "tau_ref": 20.669, "omega_m": RATED, "u_dc": 240.0, "n_points": 60}
    first = best_profile(PAPER, **point)
    (file,) = cache_dir.iterdir()
    with np.load(file) as stored:
        arrays = dict(stored)
    np.savez(file, **(arrays | {"i": change(np.atleast_2d(arrays["i"]))}))
    np.testing.assert_array_equal(best_profile(PAPER, **point).i, first.i)


def test_cache_that_cannot_be_written_does_no_harm(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").write_text("not a folder")
    monkeypatch.setenv("RELUCTANCE_CACHE", str(tmp_path / "file" / "below"))
    p = best_profile(PAPER, **DRIVE, tau_ref=0.0, omega_m=RATED, u_dc=240.0)
    assert p.p_cu == 0.0


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"n_phases": 1}, "n_phases = 1"),
        ({"n_points": 100}, "n_points = 100"),
        ({"u_dc": 0.0}, "u_dc = 0.0"),
        ({"i_max": -1.0}, "i_max = -1.0"),
        ({"R": -0.1}, "R = -0.1"),
        ({"tau_ref": np.nan}, "tau_ref = nan"),
        ({"omega_m": np.inf}, "omega_m = inf"),
        ({"norm": "least"}, "norm = least"),
    ],
)
def test_wrong_parameter_is_named_with_its_value(change: dict[str, object], message: str) -> None:
    point = {**DRIVE, "tau_ref": 1.0, "omega_m": 1.0, "u_dc": 240.0, **change}
    with pytest.raises(ParameterError, match=message):
        best_profile(PAPER, **point)  # type: ignore[arg-type]


def test_a_weighted_profile_holds_the_mean_torque_and_trades_ripple_for_current() -> None:
    """Of a sum of two costs, more weight on one never raises it. The 60 kW machine at three times
    base speed; at its rated speed, where the current ends, the weight changes nothing."""
    generic = OperatingPoint(machine(23.6e-3, 0.486), 3, 0.05, 400.0, 240.0, 8487.8 * np.pi / 30)
    tables = [
        optimum.profile_table(generic, 49.3, n_levels=2, n_points=90, ripple_weight=w)
        for w in (3.0, 30.0, 300.0)
    ]
    for t in tables:
        at = _core.magnetics(generic.magnetics, t.i[1], t.theta_e)
        assert 3 * at[:, 2].mean() == pytest.approx(49.3, rel=1e-6)
    ripple = [t.tau_error_rms[1] for t in tables]
    current = [t.i_rms[1] for t in tables]
    assert ripple == sorted(ripple, reverse=True) and ripple[0] > 1.1 * ripple[2]
    assert current == sorted(current) and current[2] > 1.05 * current[0]
    slow = replace(generic, omega_m=RATED)
    free, weighted = (
        optimum.profile_table(slow, 80.0, n_levels=2, n_points=90, ripple_weight=w)
        for w in (None, 30.0)
    )
    assert np.array_equal(free.i, weighted.i)
