"""The limit of phases that couple, against a programme of its own: SciPy's SLSQP over the currents,
with flux linkage and torque from the tables, no symmetry used, and random starts."""

import functools
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from command import command
from scipy.optimize import minimize

from reluctance.base.errors import ParameterError
from reluctance.machine import optimum
from reluctance.machine.coupling import Coupling, Neighbours, check_pairs
from reluctance.machine.library import machine_from, machine_table
from reluctance.machine.maps.pairs import PairSamples, pair_table
from reluctance.machine.optimum.each_phase import each_phase
from reluctance.machine.pair_file import write_pairs

SEED = int(np.random.SeedSequence().generate_state(1)[0])
MACHINES = Path(__file__).parents[2] / "machines"
N = 36  # points of a period: as many as a programme has at least
OMEGA, U_DC, I_MAX = 120.0, 240.0, 12.0


@pytest.fixture(autouse=True)
def cache_dir(tmp_path, monkeypatch):
    monkeypatch.setenv("RELUCTANCE_CACHE", str(tmp_path / "cache"))


@functools.cache
def machine():
    return machine_from(machine_table("onelab_6_4", Path()))


@functools.cache
def table(mutual, skew):
    """A pair whose mutual flux linkage saturates: mutual [H] of small currents at phi = 0; torque
    of skew times as much again over the angle."""
    i = np.linspace(1.5, I_MAX, 8)
    phi = np.linspace(0, np.pi, 13)
    angle, a, b = np.meshgrid(phi, i, i, indexing="ij")

    def f(x):
        return x / (1 + x / 20), 1 / (1 + x / 20) ** 2

    (fa, da), (fb, db) = f(a), f(b)
    shape, slope = 1 + skew * np.cos(angle), -skew * np.sin(angle)
    samples = PairSamples(
        phi,
        i,
        energy=mutual * shape * fa * fb,
        tau=machine().N_r * mutual * slope * fa * fb,
        psi_first=mutual * shape * da * fb,
        psi_second=mutual * shape * fa * db,
    )
    return pair_table(samples, machine().N_r, tolerance=1e-6)


def coupling(*mutual):
    """Of pairs ab, bc, ca."""
    ends = ((0, 1), (1, 2), (2, 0))
    pairs = [Neighbours(*end, table(M, 0.6)) for end, M in zip(ends, mutual, strict=True)]
    found = Coupling(n_phases=3, pairs=tuple(pairs))
    check_pairs(found, machine().magnetics, I_MAX)
    return found


ALIKE = (-3e-3,) * 3
MIXED = (3e-3, 3e-3, -3e-3)


def point(mutual, omega_m=OMEGA):
    alone = replace(machine().at(u_dc=U_DC, omega_m=omega_m), i_max=I_MAX)
    return replace(alone, coupling=coupling(*mutual))


def at_instants(x):
    """Currents (..., N, 3) at the same instants from (..., 3, N), each over its own angle."""
    return np.stack([np.roll(x[..., k, :], k * N // 3, axis=-1) for k in range(3)], axis=-1)


def linked(at, i, angle):
    """Flux linkages (..., N, 3) and torque (..., N) of currents at angles of the phases."""
    psi, tau = machine().psi(i, angle), machine().tau(i, angle).sum(axis=-1)
    for pair in at.coupling.pairs:
        first, second = pair.first, pair.second
        phi = angle[:, first] - np.pi / 3  # halfway: the second is 2 pi/3 behind the first
        state = pair.table.at(phi, i[..., first], i[..., second])
        psi[..., first] += state.psi_first
        psi[..., second] += state.psi_second
        tau = tau + state.tau
    return psi, tau


def all_phases(at, x):
    """Voltage (..., N, 3) and torque (..., N) of currents (..., 3, N) over the period."""
    i = at_instants(x)
    angle = 2 * np.pi * (np.arange(N)[:, None] / N - np.arange(3) / 3)
    psi, tau = linked(at, i, angle)
    ahead = np.roll(psi, -1, axis=-2) - psi
    u = at.R * (i + np.roll(i, -1, axis=-2)) / 2 + at.N_r * at.omega_m * ahead * N / (2 * np.pi)
    return u, tau


def independent(at, tau_ref, start):
    """Least mean square of the currents of all phases [A^2] from a start (3, N), if found."""
    scale = I_MAX / 3

    def free(x):  # 0: torque; >= 0: voltage left on both sides
        u, tau = all_phases(at, scale * x.reshape(*x.shape[:-1], 3, N))
        u = (u / U_DC).reshape(*x.shape[:-1], -1)
        return tau / tau_ref - 1, np.concatenate([1 - u, 1 + u], axis=-1)

    def slope(x, which):
        h = 1e-6
        rows = np.concatenate([x + h * np.eye(x.size), x - h * np.eye(x.size)])
        ahead, back = np.split(free(rows)[which], 2)
        return (ahead - back).T / (2 * h)

    found = minimize(
        lambda x: np.mean(x * x),
        start.ravel() / scale,
        jac=lambda x: 2 * x / x.size,
        bounds=[(0, I_MAX / scale)] * (3 * N),
        constraints=[
            {"type": kind, "fun": lambda x, n=n: free(x)[n], "jac": lambda x, n=n: slope(x, n)}
            for n, kind in enumerate(("eq", "ineq"))
        ],
        method="SLSQP",
        options={"maxiter": 200, "ftol": 1e-9},
    )
    return scale * found.fun**0.5 if found.success else None


@pytest.mark.long
def test_the_optimum_of_a_torque_near_by_leads_to_the_same():
    """As growing strength of the pairs does; where none without ripple is found, strength grows."""
    programme = optimum.Programme(point(ALIKE), n_points=N, smoothing=1e-3)
    below, grown = (programme.best(tau, "rms") for tau in (2.0, 2.6))
    near = programme.best(2.6, "rms", near=below * 1.3**0.5)
    np.testing.assert_allclose(near, grown, atol=1e-4 * grown.max())
    beyond = programme.best(60.0, "rms", near=below)
    np.testing.assert_allclose(beyond, programme.best(60.0, "rms"), atol=1e-6 * beyond.max())


@pytest.mark.parametrize(("mutual", "shape"), [(ALIKE, (N,)), (MIXED, (3, N))])
def test_the_profile_holds_torque_and_voltage_of_all_phases(mutual, shape):
    at = point(mutual)
    for tau_ref in (3.0, -2.0):
        best = optimum.best_profile(at, tau_ref, n_points=N)
        assert best.i.shape == best.psi.shape == best.u.shape == shape
        x = np.broadcast_to(best.i, (3, N))
        u, tau = all_phases(at, x)
        np.testing.assert_allclose(tau, tau_ref, rtol=1e-5)
        ours = at_instants(np.broadcast_to(best.u, (3, N)))
        np.testing.assert_allclose(u, ours, atol=1e-6 * U_DC)
        assert np.abs(u).max() <= U_DC * (1 + 1e-6)
        assert best.i_rms == pytest.approx(np.sqrt(np.mean(x * x)))


@pytest.mark.long
@pytest.mark.parametrize("mutual", [ALIKE, MIXED])
def test_no_programme_finds_less(mutual):
    """Ten points of torque and speed from a seed: the same current to 0.1 % from the profile, and
    from random starts never less."""
    print(f"seed {SEED}")
    random = np.random.default_rng(SEED)
    found = 0
    for _ in range(5):
        at = point(mutual, float(random.uniform(0, 2.0 * OMEGA)))
        most = optimum.torque_speed_envelope(at, [at.omega_m], n_points=N).tau_max[0]
        tau_ref = float(random.uniform(0.2, 0.9) * most)
        ours = optimum.best_profile(at, tau_ref, n_points=N)
        x = np.broadcast_to(ours.i, (3, N))
        same = independent(at, tau_ref, x)
        assert same == pytest.approx(ours.i_rms, rel=1e-3), f"{at.omega_m} rad/s, {tau_ref} N m"
        for _ in range(2):
            start = np.clip(x * random.uniform(0.6, 1.4, x.shape), 0, I_MAX)
            other = independent(at, tau_ref, start)
            assert other is None or other > ours.i_rms * (1 - 1e-3)
            found += other is not None
    assert found >= 5


@pytest.mark.long
def test_weak_pairs_change_nothing():
    """With pairs of a millionth the limit is that of phases alone."""
    alone = replace(point(ALIKE), coupling=None)
    weak = point((-3e-9,) * 3)
    for of in (
        lambda at: optimum.best_profile(at, 3.0, n_points=N).i_rms,
        lambda at: optimum.torque_speed_envelope(at, [OMEGA], n_points=N).tau_max[0],
    ):
        assert of(weak) == pytest.approx(of(alone), rel=1e-5)
    assert optimum.best_profile(point(ALIKE), 3.0, n_points=N).i_rms != pytest.approx(
        optimum.best_profile(alone, 3.0, n_points=N).i_rms, rel=1e-3
    )


def test_a_mirrored_machine_brakes_as_well_as_it_drives():
    """At standstill the mixed winding makes either sign of torque with the same current: turned
    round, phases change places."""
    at = point(MIXED, 0.0)
    forward, back = (optimum.best_profile(at, tau, n_points=N).i_rms for tau in (3.0, -3.0))
    assert forward == pytest.approx(back, rel=1e-4)


@pytest.mark.parametrize("mutual", [ALIKE, MIXED])
def test_the_ripple_floor_has_the_slopes_of_all_phases(mutual):
    """Torque per flux linkage of each phase, against differences of the tables with the other flux
    linkages held."""
    from reluctance.machine.optimum.ripple import _local

    at = point(mutual)
    smooth = optimum.best_profile(at, 3.0, n_points=N, norm="rms", smoothing=1e-3)
    _, gain, flows = _local(at, smooth)
    floor = optimum.ripple_floor(at, smooth, switching_frequency=20e3)
    assert 0 < floor.bound_rms < floor.returning_rms <= floor.pulse_width_rms * 1.2
    i = at_instants(np.broadcast_to(smooth.i, (3, N)))
    i = (i + np.roll(i, -1, axis=0)) / 2
    angle = smooth.theta_e[:, None] + np.pi / N - 2 * np.pi * np.arange(3) / 3
    h = 1e-5
    steps = [(linked(at, i + h * row, angle), linked(at, i - h * row, angle)) for row in np.eye(3)]
    L = np.stack([(a[0] - b[0]) / (2 * h) for a, b in steps], axis=-1)  # instant, phase, current
    tau_i = np.stack([(a[1] - b[1]) / (2 * h) for a, b in steps], axis=-1)
    if mutual is ALIKE:  # one current, over its own angle
        on, ours = (at_instants(np.broadcast_to(values, (3, N))) for values in (flows, gain))
    else:
        on, ours = flows.reshape(3, N).T, gain.reshape(3, N).T
    for j in range(N):
        k = np.flatnonzero(on[j])
        exact = np.linalg.solve(L[j][np.ix_(k, k)].T, tau_i[j, k])
        np.testing.assert_allclose(ours[j, k], exact, rtol=1e-4, atol=1e-4 * np.abs(gain).max())


@pytest.mark.long
def test_a_drive_with_pairs_gets_a_coupled_limit(tmp_path):
    """`limit` of a machine file with pairs says so, writes a profile of each phase where they
    differ, and leaves out what is not proven."""
    write_pairs(coupling(*MIXED), tmp_path / "pairs.csv")
    for file in MACHINES.glob("onelab_6_4*"):
        (tmp_path / file.name).write_bytes(file.read_bytes())
    with (tmp_path / "onelab_6_4.toml").open("a") as file:
        file.write('\npairs = "pairs.csv"\n')
    (tmp_path / "drive.toml").write_text(
        'machine = "onelab_6_4.toml"\n[converter]\nu_dc_V = 240\n'
        '[load]\nkind = "locked"\nspeed_rpm = 1000\n[reference]\nkind = "torque"\ntau_Nm = 3\n'
        '[control]\nlaw = "edge_mpc"\nT_s_us = 20\n[simulation]\nuntil_s = 0.1\n'
    )
    run = command("limit", tmp_path / "drive.toml", "--out", tmp_path / "profile.csv")
    assert "Neighbouring phases couple" in run.out
    assert "least time" not in run.out.partition("Neighbouring")[0]
    header = (tmp_path / "profile.csv").read_text().splitlines()[0]
    assert header.startswith("theta_e_deg,i_a_A,i_b_A,i_c_A,psi_a_Wb")


def test_what_pairs_do_not_have_is_refused():
    with pytest.raises(ParameterError, match="where phases couple"):
        optimum.fastest_torque_step(point(ALIKE), 3.0)
    with pytest.raises(ParameterError, match="one for all"):
        optimum.profile_table(point(MIXED), 3.0, n_points=N)


@pytest.mark.long
def test_each_phase_has_a_profile_next_to_that_of_the_mean():
    """It makes the torque of the mean within the voltage; its copper is hardly above the least."""
    real = point(MIXED)
    mean = replace(real, coupling=real.coupling.mean)
    table = optimum.profile_table(mean, 3.0, n_points=N, n_levels=4, smoothing=0.0)
    found = each_phase(real, table).i
    programme = optimum.programme.Programme(real, n_points=N)
    assert not found[0].any()
    for i, tau_ref in zip(found[1:], table.tau_ref[1:], strict=True):
        _, u, tau = programme.waveforms(i.ravel())
        np.testing.assert_allclose(tau, tau_ref, rtol=1e-5)
        assert np.abs(u).max() < U_DC * (1 + 1e-6)
        assert 0 <= i.min() and i.max() <= I_MAX
        least = optimum.best_profile(real, tau_ref, n_points=N)
        assert least.i_rms * (1 - 1e-6) <= np.sqrt(np.mean(i**2)) < 1.01 * least.i_rms
    assert np.ptp(found[-1], axis=0).max() > 0.02 * found[-1].max()  # phases differ
