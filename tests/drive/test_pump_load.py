"""The pump as a load of a switched drive: the same equations as the pumping chain."""

from pathlib import Path

import numpy as np
import pytest

import reluctance as rl

EXAMPLE = Path(__file__).parents[2] / "examples" / "sun_cloud.toml"
OMEGA_REF = 1500 * np.pi / 30


@pytest.mark.parametrize(
    ("r", "Q_m3ph", "p_shaft"),
    [(0.7, 18.039, 1725.4), (0.8, 52.220, 3285.7), (0.9, 74.039, 5218.2), (1.0, 92.598, 7710.6)],
)
def test_the_table_gives_the_torque_and_flow_of_the_curves(
    r: float, Q_m3ph: float, p_shaft: float
) -> None:
    load = rl.load(EXAMPLE).load
    omega = r * OMEGA_REF
    assert load.torque(omega) == pytest.approx(p_shaft / omega, rel=1e-4)
    assert load.flow([omega], [0.0])[0] * 3600 == pytest.approx(Q_m3ph, abs=0.006)


def test_between_the_nodes_the_table_is_the_curve() -> None:
    """Random speeds and static heads against the equations that the table was made from."""
    from reluctance.plant.hydraulics.pipe import flow as flow_of

    load = rl.load(EXAMPLE, ["load.H_static_m=", "load.t_s=[0, 1]", "load.values=[10, 20]"]).load
    table, (curve, _) = load._pump(), load._curve()
    rng = np.random.default_rng(3)
    for omega, t in zip(rng.uniform(20, 178, 200), rng.uniform(0, 1, 200), strict=True):
        r = np.array([omega / curve.omega_ref])
        power = curve.shaft_power(flow_of(curve, load._pipe(10 + 10 * t), r), r)[0]
        assert table.torque(omega, t) == pytest.approx(power / omega, rel=1e-3)


def test_below_the_static_head_the_torque_is_that_of_a_closed_valve() -> None:
    """H_0 r^2 < H_static: no flow, torque with the square of the speed; r_min = 0.68465."""
    load = rl.load(EXAMPLE).load
    table = load._pump()
    low, high = table.torque(50.0, 0.0), table.torque(100.0, 0.0)
    assert high / low == pytest.approx(4, rel=1e-12)
    assert load.flow([0.6846 * OMEGA_REF], [0.0])[0] == 0
    assert load.flow([0.686 * OMEGA_REF], [0.0])[0] > 0


def test_a_falling_water_level_takes_flow_and_a_dry_intake_takes_torque() -> None:
    load = rl.load(
        EXAMPLE,
        ["load.H_static_m=", "load.t_s=[0, 10]", "load.values=[10, 20]", "load.H_dry_m=18"],
    ).load
    table = load._pump()
    Q = load.flow(np.full(3, OMEGA_REF), [0.0, 5.0, 7.9])
    assert (np.diff(Q) < 0).all()
    assert table.torque(OMEGA_REF, 8.1) == pytest.approx(0.1 * 42.07 / 2 * 32 / 25, rel=0.01)
    assert load.flow([OMEGA_REF], [8.1])[0] == 0
