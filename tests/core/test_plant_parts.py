"""The exchangeable parts of the plant: source, bridge, shaft; each against its own equation."""

from pathlib import Path

import numpy as np
import pytest

import reluctance as rl
from reluctance.drive.run.kpis import evaluated
from reluctance.explore.limits.point import operating_point
from reluctance.targets.export.package import firmware

EXAMPLES = Path(__file__).parents[2] / "examples"


@pytest.mark.parametrize(
    "name", ["load_step", "voltage_sag", "fan", "battery", "shared_switch", "five_phases_losses"]
)
def test_energy_closes_from_the_source_to_the_shaft(name: str) -> None:
    result = rl.simulate(rl.load(EXAMPLES / f"{name}.toml"), until=0.2, record=None)
    assert result.kpis.energy_residual is not None
    assert result.kpis.energy_residual < 1e-6


def test_a_battery_sags_by_what_it_delivers() -> None:
    """Mean dc-link voltage = E - R times the mean battery current, which is p_source/E."""
    drive = rl.load(EXAMPLES / "battery.toml")
    result = rl.simulate(drive, record=10e-6)
    settled = result.t > 0.1
    mean = np.trapezoid(result.u_dc[settled], result.t[settled]) / np.ptp(result.t[settled])
    assert mean == pytest.approx(240 - 0.2 * result.kpis.p_source / 240, abs=0.02)
    assert result.kpis.u_dc_min < mean < result.kpis.u_dc_max
    lost = result.kpis.p_source - result.kpis.p_in
    current = result.kpis.p_source / 240
    assert lost > 0.2 * current**2  # a pulsating current loses more than its mean
    assert lost < 0.4 * current**2


def test_the_capacitor_takes_the_ripple_of_the_bridge() -> None:
    """Ten times the capacitance, a tenth of the voltage ripple, where R C is long against a stroke
    and the battery can take no part in it."""
    drive = rl.load(EXAMPLES / "battery.toml")
    ripple = []
    for C_uF in (20e3, 200e3):
        k = rl.simulate(drive.with_values({"source.C_uF": C_uF}), until=0.5, record=None).kpis
        ripple.append(k.u_dc_max - k.u_dc_min)
    assert ripple[0] / ripple[1] == pytest.approx(10, rel=0.2)


@pytest.mark.parametrize("name", ["paper_rated", "voltage_sag", "load_step"])
def test_the_capacitor_of_a_held_link_carries_all_but_the_mean(name: str) -> None:
    """Phases apart, a voltage that falls, a shaft that turns: from the waveforms, by the legs."""
    result = rl.simulate(rl.load(EXAMPLES / f"{name}.toml"), until=0.02, record=2.5e-7)
    rows, _ = evaluated(result.periods, result.drive.machine.N_r)
    start, end = rows["t"][[0, -1]]
    inside = (result.t >= start) & (result.t <= end)
    i_dc = (result.leg * result.i).sum(axis=0)[inside]
    assert result.kpis.i_cap_rms == pytest.approx(i_dc.std(), rel=2e-3)
    assert result.kpis.i_cap_rms > 0.5 * i_dc.mean()


def test_the_capacitor_current_is_that_of_its_voltage() -> None:
    """C du/dt, from the recorded voltage, over whole periods."""
    result = rl.simulate(rl.load(EXAMPLES / "battery.toml"), until=0.02, record=5e-7)
    rows, _ = evaluated(result.periods, result.drive.machine.N_r)
    inside = (result.t >= rows["t"][0]) & (result.t <= rows["t"][-1])
    C = result.drive.source.C_uF * 1e-6
    i_cap = C * np.diff(result.u_dc[inside]) / np.diff(result.t[inside])
    assert result.kpis.i_cap_rms == pytest.approx(np.sqrt((i_cap**2).mean()), rel=5e-3)


@pytest.mark.parametrize("seed", range(6))
def test_a_small_capacitor_on_a_stiff_battery_settles_within_a_step(seed: int) -> None:
    """Time constants down to a hundredth of the longest step: by the default step as by a short
    one. The explicit rule for the voltage would grow without bound."""
    draw = np.random.default_rng(seed)
    values = {
        "source.kind": "battery",
        "source.R_ohm": float(np.exp(draw.uniform(np.log(0.005), np.log(0.05)))),
        "source.C_uF": float(np.exp(draw.uniform(np.log(120), np.log(2000)))),
        "load.speed_rpm": float(draw.uniform(500, 2500)),
    }
    law = ["sharing_cubic", "pwm_current", "deadbeat"][seed % 3]
    drive = rl.load(EXAMPLES / f"{law}.toml").with_values(values)
    default, fine = (
        rl.simulate(drive.with_values({"simulation.dt_max_us": dt}), until=0.02, record=None).kpis
        for dt in (20.0, 0.5)
    )
    assert default.i_cap_rms == pytest.approx(fine.i_cap_rms, rel=5e-3)
    assert default.u_dc_min == pytest.approx(fine.u_dc_min, rel=1e-3)
    assert default.u_dc_max == pytest.approx(fine.u_dc_max, rel=1e-3)
    assert default.energy_residual is not None and default.energy_residual < 1e-5


def test_a_rectifier_takes_nothing_back() -> None:
    """Braking into a one-way source charges the capacitor: 1/2 C (u^2 - E^2) is what came back."""
    braking = rl.load(
        EXAMPLES / "battery.toml",
        ["reference.tau_Nm=-20", "source.one_way=true", "source.C_uF=20000"],
    )
    result = rl.simulate(braking, until=0.1, record=None)
    rise = result.periods.rise
    assert result.kpis.u_dc_max > 245
    stored = 0.5 * 20e-3 * (result.kpis.u_dc_max**2 - 240**2)
    assert -rise("E_dc") == pytest.approx(stored - rise("E_source") + rise("E_loss"), rel=0.02)


@pytest.mark.parametrize("end", [0.01, 0.02, 0.03])
@pytest.mark.parametrize("chop", ["soft", "hard"])
def test_a_torque_that_ramps_to_zero_ends_the_chopping(end: float, chop: str) -> None:
    """At the end the course leaves a rounding of its torque, and the comparator a band of it."""
    values = {
        "control.law": "angles",
        "control.chop": chop,
        "control.tau_max_Nm": 12.0,
        "converter.bridge": "asymmetric",
        "converter.v_diode_V": 0.8,
        "reference.tau_Nm": None,
        "reference.t_s": [0.0, end, 0.05],
        "reference.values": [5.0, 0.0, 0.0],
    }
    drive = rl.load(EXAMPLES / "shared_switch.toml").with_values(values)
    result = rl.simulate(drive, until=end + 0.005)
    assert np.all(result.i[:, -1] == 0) and np.all(result.leg[:, -1] == -1)


def test_a_sagging_link_slows_the_rise_of_a_current() -> None:
    """A locked, unaligned phase at full voltage: di/dt = u/L, before and after the step."""
    drive = rl.load(
        EXAMPLES / "voltage_sag.toml",
        ["load.speed_rpm=0", "source.t_s=[1e-3, 1e-3]", "source.values=[240, 120]"],
    )
    result = rl.simulate(drive, until=0.002)
    before, after = result.u_dc[result.t < 1e-3], result.u_dc[result.t > 1e-3]
    assert set(before) == {240.0} and set(after) == {120.0}
    magnetized = result.leg[:, result.t > 1e-3] == 1
    assert set(result.u[:, result.t > 1e-3][magnetized]) <= {120.0}


def test_a_ramp_of_the_dc_link_is_followed_within_a_step() -> None:
    drive = rl.load(
        EXAMPLES / "voltage_sag.toml", ["source.t_s=[0, 0.1]", "source.values=[240, 140]"]
    )
    result = rl.simulate(drive, until=0.1)
    assert result.u_dc == pytest.approx(240 - 1000 * result.t, abs=1e-9)


def test_a_held_speed_follows_its_course() -> None:
    drive = rl.load(
        EXAMPLES / "sharing_cubic.toml",
        ["load.speed_rpm=", "load.t_s=[0, 0.1]", "load.values=[0, 1500]"],
    )
    result = rl.simulate(drive, until=0.1)
    alpha = 1500 * np.pi / 30 / 0.1
    assert result.omega_m == pytest.approx(alpha * result.t, abs=1e-9)
    assert result.theta_m == pytest.approx(alpha * result.t**2 / 2, abs=1e-9)


def test_a_load_step_takes_its_torque_from_the_inertia() -> None:
    """J domega/dt = tau - load, before and after the step, over the whole waveform."""
    drive = rl.load(EXAMPLES / "load_step.toml", ["load.t_s=[0.02, 0.02]", "load.values=[5, 25]"])
    result = rl.simulate(drive, until=0.04)
    load = np.where(result.t < 0.02, 5.0, 25.0) + drive.machine.B_Nms * result.omega_m
    impulse = np.trapezoid(result.tau - load, result.t)
    assert drive.J * (result.omega_m[-1] - result.omega_m[0]) == pytest.approx(impulse, abs=2e-3)


def test_a_fan_takes_torque_with_the_square_of_the_speed() -> None:
    k = rl.simulate(rl.load(EXAMPLES / "fan.toml"), record=None).kpis
    drive = rl.load(EXAMPLES / "fan.toml")
    expected = 0.001216 * k.speed_mean**2 + drive.machine.B_Nms * k.speed_mean
    assert k.tau_mean == pytest.approx(expected, rel=2e-3)
    assert k.speed_mean == pytest.approx(1200 * np.pi / 30, rel=1e-3)


def test_a_shared_switch_forbids_what_it_cannot_do() -> None:
    """While one phase is magnetized no other one sees the reverse voltage, and every winding sees
    u_dc, 0 or -u_dc."""
    result = rl.simulate(rl.load(EXAMPLES / "shared_switch.toml"), until=0.1)
    someone = (result.leg == 1).any(axis=0)
    assert someone.any() and (~someone).any()
    assert not (result.leg[:, someone] == -1).any()
    assert set(np.unique(result.u)) <= {-240.0, 0.0, 240.0}


def test_a_shared_switch_has_fewer_switches_and_longer_tails() -> None:
    """The same orders on both converters: the current past turn-off lasts longer where another
    phase holds the upper switch on."""
    shared = rl.load(EXAMPLES / "shared_switch.toml")
    own = shared.with_values({"converter.bridge": "asymmetric"})
    tails = []
    for drive in (own, shared):
        result = rl.simulate(drive, record=20e-6)
        theta_e = np.degrees(drive.machine.N_r * result.theta_m) % 360
        tails.append(result.i[0][(theta_e > 112) & (theta_e < 128)].mean())
    assert tails[1] > 1.3 * tails[0] > 0


def test_drops_of_a_shared_switch_carry_the_sum_of_the_currents() -> None:
    """Device losses from the waveforms: the shared switch or diode at the sum of the currents."""
    drive = rl.load(
        EXAMPLES / "shared_switch.toml",
        ["converter.v_switch_V=2", "converter.R_switch_ohm=0.01", "converter.v_diode_V=1"],
    )
    result = rl.simulate(drive, until=0.1)
    i, total = result.i, result.i.sum(axis=0)
    upper = (result.leg == 1).any(axis=0)
    own_switch = (result.leg == 1) | ((result.leg == 0) & ~upper)
    loss = np.where(upper, (2 + 0.01 * total) * total, 1.0 * total)
    loss = loss + np.where(own_switch, (2 + 0.01 * i) * i, 1.0 * i).sum(axis=0)
    energy = np.trapezoid(loss, result.t)
    rise = result.periods.rise
    assert rise("E_dc") - rise("E_winding") == pytest.approx(energy, rel=5e-3)


@pytest.mark.parametrize(
    ("override", "says"),
    [
        ("source.kind=battery", "kind = 'battery' needs R_ohm"),
        ("source.R_ohm=1.0", "R_ohm has no effect with kind = 'stiff'; remove it"),
        ("source.values=[1.0]", "t_s has 0 points, values 1"),
        ("load.k_fan_Nms2=1.0", "k_fan_Nms2 has no effect with kind = 'locked'; remove it"),
        ("converter.bridge=full", "need 'asymmetric' or 'shared_switch'"),
    ],
)
def test_a_part_that_cannot_be_meant_is_refused(override: str, says: str) -> None:
    with pytest.raises(rl.ParameterError, match=says):
        rl.load(EXAMPLES / "sharing_cubic.toml", [override])


def test_what_does_not_cover_a_shared_switch_says_so(tmp_path: Path) -> None:
    drive = rl.load(EXAMPLES / "shared_switch.toml")
    with pytest.raises(rl.ParameterError, match="bridge = 'shared_switch' cannot be exported"):
        firmware(drive, tmp_path / "package")
    with pytest.raises(rl.ParameterError, match="need bridge = 'asymmetric'"):
        operating_point(drive)
