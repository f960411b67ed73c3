"""Single and double precision choose the same legs, at the same instants, but for a stated part.

Both see the samples of one run in double. The margins are about three times what was found.
"""

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import reluctance as rl
from reluctance import _core

EXAMPLES = Path(__file__).parents[2] / "examples"
SAMPLES = 4000
Array = NDArray[np.float64]


def replayed(drive: rl.Drive, *, samples: int = SAMPLES, anew: bool = False) -> tuple[Array, Array]:
    """Orders of the law in double and in float, (sample, phase, column). `anew`: each sample from
    the state after reset, so that no order of the past tells the two apart."""
    n_phases = drive.machine.n_phases
    both = [drive.with_values({"control.precision": p}) for p in ("double", "float")]
    controllers = [d.controller() for d in both]
    rows: tuple[list[list[float]], list[list[float]]] = ([], [])

    def step(y: _core.Measurement, reference: float) -> list[float]:
        answers = [_core.step(c, y, reference) for c in controllers]
        for kept, answer, d in zip(rows, answers, both, strict=True):
            kept.append((_core.step(d.controller(), y, reference) if anew else answer)[:-1])
        return answers[0]

    controller = _core.controller_from(n_phases, step)
    rl.simulate(drive, until=samples * drive.control.T_s, record=None, controller=controller)
    double, single = (np.array(kept).reshape(len(kept), n_phases, -1) for kept in rows)
    return double, single


def column(orders: Array, name: str) -> Array:
    return orders[:, :, _core.ORDER_COLUMNS.index(name)]


def legs(orders: Array, T_s: float) -> Array:
    """The leg state at instants of each sample, (sample, phase, instant)."""
    instants = T_s * (np.arange(200) + 0.5) / 200
    leg = np.repeat(column(orders, "leg_0")[:, :, None], len(instants), axis=2)
    for n in range(4):
        after = instants >= column(orders, f"t_edge_{n}")[:, :, None]
        leg = np.where(after, column(orders, f"leg_{n + 1}")[:, :, None], leg)
    return leg


@pytest.mark.parametrize(
    ("example", "overrides", "part"),  # of the time in which legs differ
    [
        ("ditc", [], 0.0),
        ("sharing_cubic", ["sensing.comparators=sampled"], 0.0),
        ("deadbeat", [], 1e-4),
        ("pwm_current", [], 1e-4),
        ("finite_set_mpc", [], 3e-4),
        ("edge_mpc_fpga", [], 1e-5),
    ],
)
def test_single_precision_chooses_the_legs_of_double(
    example: str, overrides: list[str], part: float
) -> None:
    drive = rl.load(EXAMPLES / f"{example}.toml", overrides)
    double, single = replayed(drive)
    both = legs(double, drive.control.T_s), legs(single, drive.control.T_s)
    assert len(np.unique(both[0])) >= 2
    assert (both[0] != both[1]).mean() <= part


def test_single_precision_plans_what_double_plans_from_the_same_state() -> None:
    """`edge_mpc` one sample late predicts with the orders that it gave before: in a replay the
    law in float takes its own for those of the plant. So from the state after reset."""
    drive = rl.load(EXAMPLES / "edge_mpc_mcu.toml")
    double, single = replayed(drive, samples=400, anew=True)
    both = legs(double, drive.control.T_s), legs(single, drive.control.T_s)
    assert len(np.unique(both[0])) == 3
    assert (both[0] != both[1]).mean() <= 1e-4


@pytest.mark.parametrize("example", ["sharing_cubic", "paper_rated"])
def test_single_precision_asks_for_the_currents_of_double(example: str) -> None:
    """To some ten roundings of the current limit."""
    drive = rl.load(EXAMPLES / f"{example}.toml")
    double, single = (column(orders, "i_ref") for orders in replayed(drive))
    assert np.ptp(double) > 0
    assert np.abs(double - single).max() < 2e-6 * drive.machine.i_max_A
