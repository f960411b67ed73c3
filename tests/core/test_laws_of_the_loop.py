"""Laws that every run obeys: energy, phase order, steps, the sign of currents."""

from pathlib import Path

import numpy as np
import pytest

import reluctance as rl
from reluctance.drive.drive import Drive, drive_from
from reluctance.machine.library import machine_table

ROOT = Path(__file__).parents[2]
LEFT_OUT = (
    "[site]",
    "[pv_control]",
)  # no drive; a drive that waits for the sun, with its own tests
EXAMPLES = sorted(
    p
    for p in (ROOT / "examples").glob("*.toml")
    if not any(word in p.read_text() for word in LEFT_OUT)
)
MACHINES = sorted((ROOT / "machines").glob("*.toml"))
PARTING = "edge_mpc_learning"  # its edges part after differences of rounding, learning or not
every_example = pytest.mark.parametrize("path", EXAMPLES, ids=lambda p: p.stem)


every_other = pytest.mark.parametrize(
    "path", [p for p in EXAMPLES if p.stem != PARTING], ids=lambda p: p.stem
)


def few_periods(drive: Drive, periods: float = 4.2) -> float:
    """The time of some electrical periods at a held speed, else the whole run [s]."""
    if drive.load.kind != "locked":
        return drive.simulation.until_s
    return periods * 2 * np.pi / (drive.machine.N_r * drive.omega_nominal)


def without_quantisers(path: Path) -> list[str]:
    """Overrides that make ideal sensors of quantised ones. A quantiser turns a rounding of 1e-16
    into a whole code, so that two runs which differ in rounding alone part like any two runs of a
    noisy drive; and an encoder whose counts do not divide a stroke tells the strokes apart. What a
    law learns depends on which phase's stroke ends first, and on what just counts as one."""
    drive = rl.load(path)
    if drive.sensing.adc_bits == drive.sensing.encoder_counts == 0:
        return []
    ideal = ["sensing.adc_bits=0", "sensing.encoder_counts=0", "sensing.i_noise_LSB=0"]
    return [*ideal, "control.learn=false"] if drive.control.learns else ideal


@every_example
def test_energy_balance_closes(path: Path) -> None:
    """Source = dc link = winding = copper + mechanical + field, from first instant to last."""
    drive = rl.load(path)
    result = rl.simulate(drive, until=few_periods(drive), record=None)
    rise = result.periods.rise
    assert rise("theta_m") * drive.machine.N_r > 3 * 2 * np.pi
    copper = drive.machine.R * np.ptp(result.periods.phases("i_squared"), axis=1).sum()
    link = rise("E_source") - rise("E_loss") - rise("W_dc") - rise("E_dc")
    winding = rise("E_winding") - copper - rise("E_mech") - rise("W_f")
    assert rise("E_source") > 0
    assert abs(link) + abs(winding) < 1e-6 * rise("E_source")


@every_example
def test_currents_are_never_negative(path: Path) -> None:
    drive = rl.load(path)
    result = rl.simulate(drive, until=few_periods(drive, 2.2))
    assert result.i.min() == 0.0
    assert result.i.max() > 0.0


@every_other
def test_start_one_stroke_on_permutes_phases(path: Path) -> None:
    ideal = without_quantisers(path)
    drive = rl.load(path, ideal)
    stroke_deg = 360 / (drive.machine.n_phases * drive.machine.N_r)
    end = min(few_periods(drive, 2.2), 0.02)
    start_deg = drive.simulation.theta_start_deg
    a = rl.simulate(drive, until=end, record=end / 500)
    shifted = rl.load(path, [*ideal, f"simulation.theta_start_deg={start_deg + stroke_deg!r}"])
    b = rl.simulate(shifted, until=end, record=end / 500)
    assert a.i.max() > 0
    peak = np.abs(a.i).max()
    np.testing.assert_allclose(b.i, np.roll(a.i, 1, axis=0), atol=1e-6 * peak, rtol=0)
    np.testing.assert_allclose(b.tau, a.tau, atol=1e-6 * np.abs(a.tau).max(), rtol=0)
    np.testing.assert_allclose(b.omega_m, a.omega_m, atol=1e-8 * a.omega_m.max(), rtol=0)


@every_other
def test_half_the_step_gives_the_same_key_figures(path: Path) -> None:
    ideal = without_quantisers(path)
    drive = rl.load(path, ideal)
    finer = rl.load(path, [*ideal, f"simulation.dt_max_us={drive.simulation.dt_max_us / 2!r}"])
    end = few_periods(drive)
    a, b = (rl.simulate(d, until=end, record=None).kpis for d in (drive, finer))
    for name in ("tau_mean", "torque_ripple_rms", "i_rms"):
        assert getattr(a, name) == pytest.approx(getattr(b, name), rel=1e-4), name
    # Extremes are those at the ends of steps: one between two ends is missed by O(h^2).
    assert a.torque_ripple_pp == pytest.approx(b.torque_ripple_pp, rel=3e-4)


LAWS = {
    "angles": {"T_s_us": 20},
    "paper_mpc": {"T_s_us": 20},
}


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("path", MACHINES, ids=lambda p: p.stem)
def test_every_machine_of_the_library_runs(path: Path, law: str) -> None:
    """A third of the torque that one phase gives at its limit, at the speed whose flux takes a
    quarter of the dc link's volt-seconds; a warning fails the test."""
    data = {
        "machine": machine_table(path.stem, ROOT),
        "converter": {"u_dc_V": 300},
        "load": {"kind": "locked", "speed_rpm": 1000},
        "reference": {"kind": "torque", "tau_Nm": 1e-3},
        "control": {"law": law, **LAWS[law]},
        "simulation": {"until_s": 1.0},
    }
    model = drive_from(data).machine
    aligned = rl._core.magnetics(model.magnetics, np.array([model.i_max_A]), np.array([np.pi]))
    omega = 300 * np.pi / (4 * model.N_r * aligned[0, 0])
    peak = model.tau(model.i_max_A, np.linspace(0, np.pi, 91)).max()
    data["load"]["speed_rpm"] = omega * 30 / np.pi
    data["reference"]["tau_Nm"] = peak / 3
    drive = drive_from(data)
    result = rl.simulate(drive, until=few_periods(drive))
    assert result.i.min() == 0.0
    assert result.kpis.tau_mean == pytest.approx(peak / 3, rel=0.05)
    assert result.kpis.i_peak < 1.1 * model.i_max_A
    assert abs(result.kpis.energy_residual) < 1e-5
