"""The balance that a day is made of against switched runs of the same array, drive and pump."""

import importlib.util
from pathlib import Path

import pytest

import reluctance as rl

pytestmark = pytest.mark.long

STUDY = Path(__file__).parents[2] / "studies" / "sun_static.py"


@pytest.fixture(scope="module")
def study():
    spec = importlib.util.spec_from_file_location("sun_static", STUDY)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize(("G", "T"), [(1000, 50), (800, 45), (500, 38), (300, 30)])
def test_speed_and_shaft_power_are_those_of_a_switched_run(study, G, T):
    """Measured: speed within 0.02 %, shaft power within 0.08 %."""
    drive = rl.load(study.EXAMPLE)
    u, omega, p_shaft = study.quasi_static(drive, G, T)
    mean, power, _ = study.switched(drive, (G, T), u, omega, notch=0.02)
    assert mean == pytest.approx(omega, rel=5e-4)
    assert power == pytest.approx(p_shaft, rel=2e-3)


def test_ripple_that_reaches_the_torque_reference_lowers_the_loss(study):
    """Without the notch the reference follows the ripple of the link, in step with the strokes;
    the torque is less smooth."""
    drive, sun = rl.load(study.EXAMPLE), (1000, 50)
    u, omega, p_shaft = study.quasi_static(drive, *sun)
    _, _, smooth = study.switched(drive, sun, u, omega, notch=0.02)
    _, power, ripple = study.switched(drive, sun, u, omega, notch=0.0)
    assert 1.003 < power / p_shaft < 1.01
    assert ripple > 1.5 * smooth
