"""The fastest torque step: the bound against closed forms and random voltages, a law against it.

`python tests/machine/test_torque_step.py` writes bench/torque_step.csv.
"""

import csv
import sys
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from reluctance import _core
from reluctance.base.errors import ParameterError
from reluctance.drive.run.columns import Rows

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))  # also as a script
from limit_at import best_profile, fastest_torque_step
from mpc_loop import (
    FPGA,
    MICROCONTROLLER,
    PAPER,
    RATED,
    RPM,
    U_DC,
    Point,
    controller,
    loop,
)

GIVEN = {"n_phases": 3, "R": RATED.R, "u_dc": U_DC, "i_max": 150.0}
ANGLES, STROKE = 120, 40  # the steps of three phases repeat after a stroke of forty
SHARE = 0.95


def bound(tau: float, rpm: float, n_angles: int = ANGLES, **given):
    return fastest_torque_step(
        RATED.machine, tau_ref=tau, omega_m=rpm * RPM, n_angles=n_angles, **{**GIVEN, **given}
    )


def torque(i: np.ndarray, theta_e: np.ndarray) -> np.ndarray:
    return np.asarray(_core.magnetics(RATED.machine, i, theta_e % (2 * np.pi)))[:, 2]


def current_of(psi: float, theta_e: float) -> float:
    """Bisection on the flux linkage, up to 150 A."""
    low, high = 0.0, 150.0
    for _ in range(50):
        i = (low + high) / 2
        flux = _core.magnetics(RATED.machine, np.array([i]), np.array([theta_e]))[0, 0]
        low, high = (i, high) if flux < psi else (low, i)
    return low


@pytest.mark.parametrize("tau", [41.339, -20.0])
def test_at_standstill_without_resistance_flux_is_volt_seconds(tau: float) -> None:
    step = bound(tau, 0.0, n_angles=12, R=0.0)
    for theta_0, time in zip(step.theta_e, step.time, strict=True):
        low, high = 0.0, 0.02
        for _ in range(30):
            t = (low + high) / 2
            angles = (theta_0 - 2 * np.pi * np.arange(3) / 3) % (2 * np.pi)
            i = np.array([current_of(U_DC * t, angle) for angle in angles])
            reached = np.maximum(np.sign(tau) * torque(i, angles), 0).sum()
            low, high = (t, high) if reached < SHARE * abs(tau) else (low, t)
        assert time == pytest.approx(low, abs=1e-6)


def test_no_random_voltages_are_faster() -> None:
    """Legs that change at random, mostly magnetizing, in steps of 1 us by the explicit Euler rule:
    its error, of the order of a step, is the tolerance."""
    rng = np.random.default_rng(5)
    n, dt, omega = 400, 1e-6, 1500 * RPM
    least = bound(41.339, 1500.0, n_angles=n).time
    theta_0 = 2 * np.pi * np.arange(n) / n
    i = np.zeros((n, 3))
    level = np.ones((n, 3), int)
    time = np.full(n, np.inf)
    for step in range(3000):
        angle = (theta_0[:, None] - 2 * np.pi * np.arange(3) / 3 + 4 * omega * step * dt) % (
            2 * np.pi
        )
        m = np.asarray(_core.magnetics(RATED.machine, i.ravel(), angle.ravel())).reshape(n, 3, -1)
        met = (m[..., 2].sum(axis=1) >= SHARE * 41.339) & np.isinf(time)
        time[met] = step * dt
        again = rng.random((n, 3)) < 0.001
        level = np.where(again, rng.choice([-1, 0, 1, 1, 1, 1], (n, 3)), level)
        i = i + dt * (level * U_DC - RATED.R * i - omega * m[..., 4]) / m[..., 3]
        i = np.clip(i, 0, 150.0)
    assert np.isfinite(time).sum() > n / 4
    assert (time > least - 3e-6).all()
    assert (time / least).min() < 1.01  # some of them are nearly the fastest


def test_a_lower_current_limit_or_voltage_is_never_faster() -> None:
    times = [
        bound(41.339, 1500.0).time,
        bound(41.339, 1500.0, i_max=100.0).time,
        bound(41.339, 1500.0, i_max=100.0, u_dc=200.0).time,
    ]
    for faster, slower in pairwise(times):
        assert (slower >= faster - 1e-9).all()
        assert slower.mean() > 1.01 * faster.mean()


@pytest.mark.parametrize(
    ("change", "fault"),
    [({"share": 0.0}, "share"), ({"u_dc": -1.0}, "u_dc"), ({"i_max": 0.0}, "i_max")],
)
def test_what_cannot_be_meant_is_refused(change: dict[str, float], fault: str) -> None:
    with pytest.raises(ParameterError, match=fault):
        bound(41.339, 1500.0, **change)
    with pytest.raises(ParameterError, match="tau_ref"):
        bound(0.0, 1500.0)


def reached(point: Point, timing, f_switch: float, before: float, after: float, angle: float):
    """Time [s] to 95 % of a change, and the overshoot after it against |after|; the change comes 20
    ms after the start, at an angle of phase 0."""
    t_step, omega = 0.02, point.rpm * RPM
    guide = replace(point, tau=max(abs(before), abs(after)))
    run = loop(
        controller("edge_mpc", guide, timing, f_switch), point, timing,
        theta_m=(angle + 2 * np.pi * 40) / 4 - omega * t_step, record_every=1e-6,
        reference=([0.0, t_step, t_step], [before, before, after]),
    )  # fmt: skip
    run.advance(t_step - 1e-5)
    run.take_waveforms()
    rows = []
    t = 0.0
    while t < t_step + 4e-3:
        t = run.advance(t_step + 4e-3)
        rows.append(run.take_waveforms())
        run.take_periods()
    table = Rows(np.vstack(rows), _core.waveform_columns(3))
    after_step = table["t"] >= t_step
    tau, t = table["tau"][after_step], table["t"][after_step]
    made = (tau - before) / (after - before)
    first = int(np.argmax(made >= SHARE))
    assert made[first] >= SHARE
    over = (tau[first:] - after).max() if after > before else (after - tau[first:]).max()
    return t[first] - t_step, over / abs(after)


@dataclass(frozen=True)
class Stepped:
    """Steps of the torque from each of forty angles, a stroke of three phases."""

    time: np.ndarray  # to 95 % [s]
    least: np.ndarray  # that physics allows [s]
    overshoot: float  # greatest, of the torque afterwards [1]

    def row(self) -> dict[str, str]:
        ratio = self.time / self.least
        return {
            "mean": f"{self.time.mean() / self.least.mean():.3f}",
            "worst": f"{ratio.max():.3f}",
            "overshoot_pct": f"{100 * self.overshoot:.2f}",
        }


def stepped(timing, f_switch: float, before: float, after: float, rpm: float) -> Stepped:
    """`edge_mpc` on the paper's machine at 240 V."""
    point = Point(41.339, rpm, PAPER)
    start = None
    if before:
        start = best_profile(
            point.machine, tau_ref=before, omega_m=rpm * RPM, n_points=180, **GIVEN
        )
    least = bound(after, rpm, start=start)
    angles = least.theta_e[:STROKE]
    found = [reached(point, timing, f_switch, before, after, theta) for theta in angles]
    times = np.array([time for time, _ in found])
    return Stepped(times, least.time[:STROKE], max(over for _, over in found))


@pytest.mark.parametrize("angle", [0.3, 1.2, 1.9])
def test_a_start_backwards_is_the_mirror_of_a_start_forwards(angle: float) -> None:
    """At standstill, where the sign of the speed says nothing."""
    forwards, backwards = (Point(tau, 0.0, PAPER, guide_rpm=(1500,)) for tau in (41.339, -41.339))
    there, _ = reached(forwards, FPGA, 21e3, 0.0, 41.339, angle)
    back, _ = reached(backwards, FPGA, 21e3, 0.0, -41.339, -angle)
    assert back == pytest.approx(there, abs=3e-6)


TIMINGS = {"2 us": (FPGA, 21e3), "20 us": (MICROCONTROLLER, 16e3)}
TORQUES = [(0.0, 41.339), (0.0, 20.669), (41.339, -41.339), (0.0, -41.339), (0.0, -20.669)]
STEPS = [(*torques, 1500.0) for torques in TORQUES]
FARTHER = [(0.0, 5.0, 1500.0), (0.0, 20.669, 500.0), (0.0, 20.669, 2250.0), (0.0, 20.669, 3000.0)]
FILE = Path(__file__).parents[2] / "bench" / "torque_step.csv"


def named(before: float, after: float, rpm: float) -> str:
    return f"{before:g} to {after:g} N m, {rpm:g} rpm"


def is_in_the_file(found: Stepped, step: str, sampling: str) -> None:
    with FILE.open(encoding="utf-8") as file:
        rows = {(row["step"], row["sampling"]): row for row in csv.DictReader(file)}
    for key, text in found.row().items():
        off = 0.1 if key == "overshoot_pct" else 0.01
        assert float(text) == pytest.approx(float(rows[step, sampling][key]), abs=off), key


@pytest.mark.parametrize(("before", "after", "rpm"), STEPS)
@pytest.mark.parametrize("sampling", TIMINGS)
def test_edge_mpc_steps_the_torque_within_a_tenth_of_the_bound(
    sampling: str, before: float, after: float, rpm: float
) -> None:
    """At each angle of a stroke. With 20 us, one sample late, a braking step may miss the peak of
    the torque of a phase that leaves, which at 2 us it just reaches: the bound jumps there."""
    found = stepped(*TIMINGS[sampling], before, after, rpm)
    ripple = 0.02 * found.least.mean()  # before the step: it helps or hinders
    near = np.minimum(np.roll(found.least, 1), np.roll(found.least, -1))
    slow = found.time > 1.10 * found.least
    assert found.time.mean() < 1.06 * found.least.mean()
    assert slow.sum() <= (1 if sampling == "20 us" and before == 0 and after < 0 else 0)
    assert (found.time > np.minimum(found.least, near) - ripple).all()
    assert found.overshoot < 0.03
    is_in_the_file(found, named(before, after, rpm), sampling)


@pytest.mark.long
@pytest.mark.parametrize("step", FARTHER, ids=lambda step: named(*step))
@pytest.mark.parametrize("sampling", TIMINGS)
def test_steps_at_other_points_are_those_of_the_file(
    sampling: str, step: tuple[float, float, float]
) -> None:
    is_in_the_file(stepped(*TIMINGS[sampling], *step), named(*step), sampling)


def main() -> None:
    """Writes bench/torque_step.csv."""
    rows = [
        {"step": named(*step), "sampling": sampling, **stepped(*timing, *step).row()}
        for step in STEPS + FARTHER
        for sampling, timing in TIMINGS.items()
    ]
    with FILE.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, rows[0].keys(), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


if __name__ == "__main__":
    main()
