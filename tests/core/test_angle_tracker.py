"""The angle tracker against motion that is known in closed form."""

import numpy as np
import pytest
from numpy.typing import NDArray

from reluctance import _core, _core_parts

N_R, COUNTS, T_S, BANDWIDTH, J = 4, 4096, 20e-6, 500.0, 0.008
COUNT = 2 * np.pi / COUNTS


def gains(order: int, bandwidth: float) -> _core.TrackerGains:
    """All poles at e^(-bandwidth T_s): (z - r)^order, multiplied out."""
    r = np.exp(-bandwidth * T_S)
    if order == 2:
        return _core.TrackerGains(angle=1 - r**2, speed=(1 - r) ** 2 / T_S, load=0.0)
    return _core.TrackerGains(
        angle=1 - r**3,
        speed=1.5 * (1 - r) ** 2 * (1 + r) / T_S,
        load=J / N_R * (1 - r) ** 3 / T_S**2,
    )


def tracked(
    theta_m: NDArray[np.float64],
    tau: NDArray[np.float64] | float = 0.0,
    *,
    order: int = 2,
    bandwidth: float = BANDWIDTH,
    quiet: float | None = None,
    counts: int = COUNTS,
    single: bool = False,
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Error of the mechanical angle [rad], speed [rad/s] and load torque [N m] for a counted
    motion. tau: known torque [N m]; quiet: bandwidth within half a count, where it is another."""
    count = 2 * np.pi / counts
    counted = (np.floor(theta_m / count) + 0.5) * count
    tracker = _core.AngleTracker(
        T_s=T_S,
        half_step=0.0 if quiet is None else N_R * count / 2,
        acceleration=N_R / J if order == 3 else 0.0,
        within=gains(order, quiet or bandwidth),
        beyond=gains(order, bandwidth),
        N_r=N_R,
    )
    y = _core_parts.track_angle(
        np.mod(N_R * counted, 2 * np.pi),
        np.broadcast_to(np.asarray(tau, float), theta_m.shape).copy(),
        tracker=tracker,
        single=single,
    )
    error = np.mod(y[:, 0] - N_R * theta_m + np.pi, 2 * np.pi) - np.pi
    return error / N_R, y[:, 1], y[:, 2]


@pytest.mark.parametrize("rpm", [-1500, 20, 300, 1500, 4000])
@pytest.mark.parametrize("single", [False, True])
@pytest.mark.parametrize("order", [2, 3])
def test_constant_speed_is_tracked_within_a_fraction_of_a_count(
    rpm: float, single: bool, order: int
) -> None:
    t = np.arange(0, 0.1, T_S)
    bandwidth = {2: BANDWIDTH, 3: BANDWIDTH / 2}[order]
    error, omega_m, _ = tracked(rpm * np.pi / 30 * t, order=order, bandwidth=bandwidth,
                                single=single)  # fmt: skip
    settled = len(t) // 2
    assert np.abs(error[settled:]).max() < COUNT / 8
    assert omega_m[settled:] == pytest.approx(rpm * np.pi / 30, rel=2e-3, abs=0.05)


def test_a_rotor_that_turns_already_is_found_in_two_milliseconds() -> None:
    """The line through n counted angles is wrong by at most sqrt(12/n^3) counts a sample, three
    times over."""
    for rpm in (-1500, 300, 4000):
        omega = rpm * np.pi / 30
        t = np.arange(0, 2e-3, T_S)
        _, omega_m, _ = tracked(0.3 + omega * t)
        n = len(t)
        assert omega_m[-1] == pytest.approx(omega, abs=3 * COUNT / T_S * np.sqrt(1 / n**3))


def test_acceleration_leaves_the_lag_of_a_type_2_loop() -> None:
    t = np.arange(0, 0.2, T_S)
    acceleration = 2000.0  # [rad/s^2]
    error, omega_m, _ = tracked(acceleration * t * t / 2, counts=2**20)
    lag = acceleration / BANDWIDTH**2
    assert error[-1] == pytest.approx(-lag, rel=0.05)
    assert omega_m[-1] == pytest.approx(
        acceleration * t[-1] - 2 * acceleration / BANDWIDTH, rel=0.02
    )


def test_a_known_torque_leaves_no_lag_and_an_unknown_one_is_found() -> None:
    """20 N m move the rotor: told, all of it is known at once; untold, it is a load of -20 N m."""
    t = np.arange(0, 0.1, T_S)
    a = 20 / J
    theta_m = a * t * t / 2
    error, omega_m, load = tracked(theta_m, 20.0, order=3, counts=2**20)
    assert np.abs(error).max() < 2 * np.pi / 2**20
    assert omega_m[1000:] == pytest.approx(a * t[1000:], rel=2e-4)
    assert np.abs(load[1000:]).max() < 0.002
    error, omega_m, load = tracked(theta_m, order=3, counts=2**20)
    assert omega_m[-1] == pytest.approx(a * t[-1], rel=2e-4)
    assert load[-1] == pytest.approx(-20, rel=0.01)


def test_a_load_step_shows_in_the_closed_form_of_three_equal_poles() -> None:
    """From a step of the load the speed error is a e^(-wt)(t + w t^2)."""
    t = np.arange(0, 0.05, T_S)
    start, a = 0.02, -2000.0
    after = np.maximum(t - start, 0)
    theta_m = 100 * t + a * after**2 / 2
    _, omega_m, load = tracked(theta_m, order=3, counts=2**22)
    expected = a * np.exp(-BANDWIDTH * after) * (after + BANDWIDTH * after**2)
    found = 100 + a * after - omega_m
    settled = t > 0.01
    assert found[settled] == pytest.approx(expected[settled], abs=0.03 * np.abs(expected).max())
    assert load[-1] == pytest.approx(-J * a, rel=0.01)


def test_half_a_count_is_filtered_and_more_is_followed() -> None:
    """Two bandwidths: the speed is as quiet as with the small one, and a load step is found as fast
    as with the large one, after the time in which it shows."""
    t = np.arange(0, 0.15, T_S)
    start, a, fast, quiet = 0.1, -5000.0, 1500.0, 250.0
    after = np.maximum(t - start, 0)
    omega = 157.3 + a * after
    theta_m = 157.3 * t + a * after**2 / 2
    before = (t > 0.08) & (t < start)
    noise, dip = {}, {}
    for name, given in {
        "both": {"bandwidth": fast, "quiet": quiet},
        "fast": {"bandwidth": fast},
        "quiet": {"bandwidth": quiet},
    }.items():
        _, omega_m, _ = tracked(theta_m, order=3, **given)
        noise[name] = np.std(omega_m[before] - omega[before])
        dip[name] = np.max((omega_m - omega)[t > start])
    assert noise["both"] < 2 * noise["quiet"]
    assert noise["both"] < noise["fast"] / 4
    shows = np.sqrt(COUNT / -a)  # half a count further
    assert dip["both"] < dip["fast"] - a * shows
    assert dip["both"] < dip["quiet"] / 2


def test_standstill_is_held_without_drift() -> None:
    error, omega_m, _ = tracked(np.full(5000, 0.3))
    assert np.abs(error).max() <= COUNT / 2 * (1 + 1e-9)
    assert not omega_m.any()
