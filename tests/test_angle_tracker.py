"""The angle tracker against motion that is known in closed form."""

import numpy as np
import pytest
from numpy.typing import NDArray

from reluctance import _core_parts

N_R, COUNTS, T_S, BANDWIDTH = 4, 4096, 20e-6, 500.0
COUNT = 2 * np.pi / COUNTS


def tracked(
    theta_m: NDArray[np.float64], *, counts: int = COUNTS, single: bool = False
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Error of the mechanical angle [rad] and speed [rad/s] for a counted motion."""
    count = 2 * np.pi / counts
    counted = (np.floor(theta_m / count) + 0.5) * count
    y = _core_parts.track_angle(
        np.mod(N_R * counted, 2 * np.pi), T_s=T_S, bandwidth=BANDWIDTH, N_r=N_R, single=single
    )
    error = np.mod(y[:, 0] - N_R * theta_m + np.pi, 2 * np.pi) - np.pi
    return error / N_R, y[:, 1]


@pytest.mark.parametrize("rpm", [-1500, 20, 300, 1500, 4000])
@pytest.mark.parametrize("single", [False, True])
def test_constant_speed_is_tracked_within_a_fraction_of_a_count(rpm: float, single: bool) -> None:
    t = np.arange(0, 0.1, T_S)
    error, omega_m = tracked(rpm * np.pi / 30 * t, single=single)
    settled = len(t) // 2
    assert np.abs(error[settled:]).max() < COUNT / 8
    assert omega_m[settled:] == pytest.approx(rpm * np.pi / 30, rel=2e-3, abs=0.05)


def test_acceleration_leaves_the_lag_of_a_type_2_loop() -> None:
    t = np.arange(0, 0.2, T_S)
    acceleration = 2000.0  # [rad/s^2]
    error, omega_m = tracked(acceleration * t * t / 2, counts=2**20)
    lag = acceleration / BANDWIDTH**2
    assert error[-1] == pytest.approx(-lag, rel=0.05)
    assert omega_m[-1] == pytest.approx(
        acceleration * t[-1] - 2 * acceleration / BANDWIDTH, rel=0.02
    )


def test_standstill_is_held_without_drift() -> None:
    error, omega_m = tracked(np.full(5000, 0.3))
    assert np.abs(error).max() <= COUNT / 2 * (1 + 1e-9)
    assert not omega_m.any()
