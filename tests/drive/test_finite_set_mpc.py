"""Finite-set predictive control: its search against enumeration, its law against the limit."""

import itertools

import numpy as np
import pytest
from mpc_loop import FPGA, HALF, PAPER, RATED, Point, Timing, controller, figures, loop, sums

from reluctance import _core, _core_parts
from reluctance.drive.laws.flux_guide import no_guide

WEIGHTS = {"R": 0.72, "i_max": 150.0, "T_s": 20e-6, "t_end": 30e-6, "u_dc": 240.0, "tau_ref": 40.0}
PSI, CURRENT, TAU, GAIN, DRIFT, GOAL, GOAL_RATE, I_GAIN, I_DRIFT, LEG, IDLE = range(11)


def random_state(rng: np.random.Generator) -> np.ndarray:
    """Three phases (3, 11), one in four of them without current, one in four idle."""
    x = np.empty((3, 11))
    x[:, PSI] = rng.uniform(0, 0.4, 3)
    x[:, CURRENT] = rng.uniform(0, 160, 3)
    x[:, TAU] = rng.uniform(-10, 45, 3)
    x[:, GAIN] = rng.uniform(-200, 1500, 3)
    x[:, DRIFT] = rng.uniform(-1e5, 1e5, 3)
    x[:, GOAL] = rng.uniform(0, 0.4, 3)
    x[:, GOAL_RATE] = rng.uniform(-240, 240, 3)
    x[:, I_GAIN] = 1 / rng.uniform(0.3e-3, 20e-3, 3)
    x[:, I_DRIFT] = rng.uniform(-1e5, 1e5, 3)
    x[:, LEG] = rng.integers(-1, 2, 3)
    x[:, IDLE] = rng.random(3) < 0.25
    without = rng.random(3) < 0.25
    x[np.ix_(without, [PSI, CURRENT, TAU, DRIFT, I_DRIFT])] = 0
    return x


def sequence_cost(x: np.ndarray, legs: np.ndarray, w_psi: float, w_i: float, w_sw: float) -> float:
    """Cost of legs (horizon, 3), written from the formula at the head of leg_search.hpp."""
    w = WEIGHTS
    psi, last, cost = x[:, PSI].copy(), x[:, LEG], 0.0
    for j, level in enumerate(legs):
        t = w["T_s"] * (j + 1)
        carries = psi > 0  # else a switch turns at no cost
        flows = carries | (level > 0)
        psi = np.maximum(psi + flows * w["T_s"] * (level * w["u_dc"] - w["R"] * x[:, CURRENT]), 0)
        moved = psi - x[:, PSI]
        i = np.where(
            psi > 0, np.maximum(x[:, CURRENT] + x[:, I_DRIFT] * t + x[:, I_GAIN] * moved, 0), 0
        )
        tau = np.where(psi > 0, x[:, TAU] + x[:, DRIFT] * t + x[:, GAIN] * moved, 0)
        away = psi - x[:, GOAL] - x[:, GOAL_RATE] * t
        errors = (tau.sum() - w["tau_ref"]) ** 2 + w_psi * away @ away + w_i * i @ i
        cost += (w["t_end"] if j + 1 == len(legs) else w["T_s"]) * errors
        cost += (
            w_sw / 2 * np.abs(level - last)[carries].sum()
            + 1e12 * ((i > w["i_max"]) & (level > -1)).sum()
        )
        last = level
    return cost


def random_weights(rng: np.random.Generator) -> dict[str, float]:
    w_psi, w_i, w_sw = 10 ** rng.uniform([1, -5, -6], [5, -1, -3])
    return {"w_psi": w_psi, "w_i": w_i, "w_sw": w_sw}


@pytest.mark.parametrize("horizon", [1, 2, 3])
def test_branch_and_bound_equals_brute_force_on_random_states(horizon: int) -> None:
    rng = np.random.default_rng(horizon)
    searched, expected = np.zeros(2), 0
    for _ in range(10_000):
        x = random_state(rng)
        setting = {**WEIGHTS, **random_weights(rng), "horizon": horizon}
        *_, cost, pruned = _core_parts.leg_search(x, **setting, prune=True)
        *_, least, all_of_them = _core_parts.leg_search(x, **setting, prune=False)
        assert cost == pytest.approx(least, rel=1e-12)
        searched += pruned, all_of_them
        combinations = 3 ** int(3 - x[:, IDLE].sum())
        expected += sum(combinations**j for j in range(horizon))
    assert searched[1] == expected
    if horizon > 1:  # random states are hard: few are far from the best
        assert searched[0] <= {2: 0.2, 3: 0.1}[horizon] * searched[1]


@pytest.mark.parametrize(("horizon", "n_states"), [(1, 300), (2, 10)])
def test_best_cost_is_that_of_the_written_formula(horizon: int, n_states: int) -> None:
    rng = np.random.default_rng(7)
    for _ in range(n_states):
        x, weights = random_state(rng), random_weights(rng)
        sequences = [
            np.array(s).reshape(horizon, 3)
            for s in itertools.product((-1, 0, 1), repeat=3 * horizon)
        ]
        sequences = [s for s in sequences if (s[:, x[:, IDLE] > 0] == -1).all()]
        costs = [sequence_cost(x, s, **weights) for s in sequences]
        *legs, cost, _ = _core_parts.leg_search(
            x, **WEIGHTS, **weights, horizon=horizon, prune=True
        )
        assert cost == pytest.approx(min(costs), rel=1e-12)
        first = [c for s, c in zip(sequences, costs, strict=True) if list(s[0]) == legs]
        assert min(first) == pytest.approx(cost, rel=1e-12)


def test_no_phase_above_the_current_limit_is_kept_on() -> None:
    x = np.zeros((3, 11))
    x[:, [PSI, CURRENT, I_GAIN, GAIN]] = (
        0.3,
        170.0,
        1000.0,
        1000.0,
    )  # freewheeling takes 2.4 A a sample
    legs = _core_parts.leg_search(
        x, **WEIGHTS, w_psi=0.0, w_i=0.0, w_sw=0.0, horizon=1, prune=True
    )[:3]
    assert legs == (-1, -1, -1)


@pytest.mark.parametrize(
    ("point", "limit_A"),
    [(RATED, 48.93), (HALF, 28.73), (Point(-41.339, -1500, PAPER, guide_rpm=(1500,)), 48.93)],
)
@pytest.mark.parametrize("horizon", [1, 3])
def test_guided_law_reaches_little_ripple_at_the_copper_of_the_limit(
    point: Point, limit_A: float, horizon: int
) -> None:
    law = controller("finite_set_mpc", point, FPGA, 16.5e3, horizon=horizon)
    y = figures(law, point, FPGA, periods=4)
    assert y.error_rms < 0.006
    assert y.ripple_pp < 0.04
    assert y.i_rms < 1.01 * limit_A
    assert y.f_switch < 22e3


def test_without_guide_and_horizon_the_law_is_myopic() -> None:
    """The reason for the guide: more copper, or more ripple, than the guided law by far."""
    core = _core.finite_set_mpc(
        RATED.machine, 3, False, guide=no_guide(1.0), horizon=1, w_psi=[0], feedback=[0], w_i=1e-4,
        w_sw=1e-6, t_end=5e-6, R=0.72, i_max=150, T_s=5e-6, delay=0,
    )  # fmt: skip
    law = _core.Controller(core, _core.Frame())
    y = figures(law, RATED, Timing(5e-6), periods=4)
    assert y.error_rms > 0.05 or y.i_rms > 1.1 * 48.93


def test_starts_from_zero_current_at_every_angle() -> None:
    for tau in (41.339, -41.339):
        for theta_e in np.linspace(0, 2 * np.pi, 12, endpoint=False):
            point = Point(tau, 0.0, PAPER, guide_rpm=(1500,))
            law = controller("finite_set_mpc", point, FPGA, 17e3)
            run = loop(law, point, FPGA, theta_m=theta_e / 4 + 1e-3)
            run.advance(3e-3)
            run.close_period()
            before = sums(run)
            run.advance(5e-3)
            run.close_period()
            after = sums(run)
            mean = (after["tau"] - before["tau"]) / (after["t"] - before["t"])
            assert mean == pytest.approx(tau, rel=0.01)
