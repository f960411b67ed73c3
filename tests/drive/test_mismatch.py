"""A control that is wrong about its plant: its machine model, the zero of its angle sensor."""

from pathlib import Path

import numpy as np
import pytest

import reluctance as rl
from reluctance.base.errors import ParameterError
from reluctance.machine.library import machine_from, machine_table
from reluctance.machine.mismatch import Mismatch, as_known

EXAMPLES = Path(__file__).parents[2] / "examples"
MACHINES = sorted((EXAMPLES.parent / "machines").glob("*.toml"))
PULSE = EXAMPLES / "single_pulse.toml"


@pytest.mark.parametrize("path", MACHINES, ids=lambda p: p.stem)
def test_flux_and_torque_of_the_known_machine_are_scaled(path: Path) -> None:
    machine = machine_from(machine_table(path.stem, EXAMPLES))
    known = as_known(machine, Mismatch(R_factor=1.2, flux_factor=0.9))
    currents = machine.i_max_A * np.array([0.01, 0.2, 1.0])
    i, theta = (g.ravel() for g in np.meshgrid(currents, np.linspace(0, 6.2, 40)))
    ours, theirs = (rl._core.magnetics(m.magnetics, i, theta) for m in (known, machine))
    scale = np.abs(theirs).max(axis=0)
    np.testing.assert_allclose(ours / scale, 0.9 * theirs / scale, atol=1e-9)
    assert known.R == pytest.approx(1.2 * machine.R)
    assert as_known(machine, Mismatch()) == machine


@pytest.mark.parametrize("factor", [0.9, 1.1])
def test_torque_falls_by_what_the_control_expects_too_much(factor: float) -> None:
    """A sharing law inverts its own torque map: the plant gives tau_ref/flux_factor."""
    run = [
        rl.simulate(rl.load(EXAMPLES / "sharing_cubic.toml", overrides), until=0.04, record=None)
        for overrides in ([], [f"mismatch.flux_factor={factor}"])
    ]
    right, wrong = (r.kpis.tau_mean for r in run)
    assert wrong == pytest.approx(right / factor, rel=0.01)


@pytest.mark.parametrize("law", ["deadbeat", "paper_rated"])
@pytest.mark.parametrize("factor", [0.8, 1.2])
def test_resistance_is_the_controls_own(law: str, factor: float) -> None:
    """The plant keeps its resistance: copper loss over current squared is that of the machine."""
    drive = rl.load(EXAMPLES / f"{law}.toml", [f"mismatch.R_factor={factor}"])
    result = rl.simulate(drive, until=0.03, record=None)
    right = rl.simulate(rl.load(EXAMPLES / f"{law}.toml"), until=0.03, record=None)
    assert result.kpis.p_cu == pytest.approx(3 * 0.72 * result.kpis.i_rms**2, rel=0.01)
    assert result.kpis.tau_mean != right.kpis.tau_mean
    assert result.kpis.tau_mean == pytest.approx(right.kpis.tau_mean, rel=0.02)


@pytest.mark.parametrize("watch", ["compare", "sampled"])
@pytest.mark.parametrize("offset", [-1.0, 1.0])
def test_angle_offset_shifts_the_window_the_other_way(watch: str, offset: float) -> None:
    """A sensor that runs ahead switches early by as much, to the instant or at the sample."""
    common = [f"control.watch='{watch}'", "control.T_s_us=20"]
    angles = [f"control.theta_on_deg={0 - offset}", f"control.theta_off_deg={110 - offset}"]
    shifted = rl.simulate(rl.load(PULSE, common + angles), until=0.02, record=1e-4)
    fooled = rl.simulate(
        rl.load(PULSE, [*common, f"mismatch.angle_offset_deg={offset}"]), until=0.02, record=1e-4
    )
    right = rl.simulate(rl.load(PULSE, common), until=0.02, record=1e-4)
    np.testing.assert_allclose(fooled.i, shifted.i, atol=1e-6)
    assert np.abs(fooled.i - right.i).max() > 0.1


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ("mismatch.R_factor=0", "R_factor = 0, need > 0"),
        ("mismatch.flux_factor=-1.0", "flux_factor = -1.0, need > 0"),
        ("mismatch.angle_offset_deg=91.0", "angle_offset_deg = 91.0, need <= 90"),
        ("mismatch.angle_offset_deg=-91.0", "angle_offset_deg = -91.0, need >= -90"),
        ("mismatch.pair_factor=1.1", "pair_factor = 1.1, need 1 for a machine whose phases do not"),
        ("mismatch.angle_offset=1.0", "did you mean `angle_offset_deg`"),
    ],
)
def test_wrong_mismatch_is_refused(setting: str, message: str) -> None:
    with pytest.raises(ParameterError, match=message):
        rl.load(PULSE, [setting])
