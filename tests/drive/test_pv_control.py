"""A drive on a photovoltaic array: link stable, maximum power found, pump kept."""

from pathlib import Path

import numpy as np
import pytest

import reluctance as rl
from reluctance.drive.guard.trip_levels import protection

EXAMPLE = Path(__file__).parents[2] / "examples" / "sun_cloud.toml"
STEADY = ["source.t_s=[0]", "source.poa_global_Wpm2=[1000]", "source.temp_cell_degC=[50]"]
RUNNING = ["load.speed_rpm=1000", "pv_control.wake_s=0"]


def drive(*overrides: str) -> rl.Drive:
    return rl.load(EXAMPLE, list(overrides))


def taken(result: rl.Result, since: float) -> float:
    """Energy taken over the energy at the maximum power point [1]."""
    t, energy = result.periods["t"], result.periods["E_source"]
    fine = np.linspace(since, t[-1], 1001)
    offered = np.trapezoid(result.drive.source.available(fine), fine)
    return float((energy[-1] - np.interp(since, t, energy)) / offered)


@pytest.mark.parametrize(
    "overrides",
    [
        [],
        ["pv_control.actuator=speed"],
        ["pv_control.tracking=incremental_conductance"],
        ["pv_control.current=legs", "sensing.comparators=sampled", "sensing.delay_samples=1"],
    ],
    ids=["torque", "speed", "incremental conductance", "no sensor"],
)
def test_a_cloud_is_ridden_through_at_the_maximum_power_point(overrides: list[str]) -> None:
    """1000 to 300 W/m2 in a second, 10 s after start-up: 99.5 %; measured 99.89 to 99.91 %."""
    result = rl.simulate(drive(*overrides), record=1e-3)
    assert taken(result, since=3.0) > 0.995
    assert result.u_dc[result.t > 3].min() > 200
    assert result.tau_ref.min() >= 0


@pytest.mark.parametrize("actuator", ["torque", "speed"])
@pytest.mark.parametrize("C_uF", [470.0, 4700.0])
@pytest.mark.parametrize("u_ref_V", [170.0, 215.0, 260.0])
@pytest.mark.parametrize(("notch", "charge"), [(0.02, 25e-3), (0.0, 9.4e-3)])
def test_the_same_controller_holds_every_voltage_on_every_capacitor(
    notch: float, charge: float, u_ref_V: float, C_uF: float, actuator: str
) -> None:
    """On both sides of the maximum power point, at 227 V; to 1 V on average. The ripple is the
    charge of a stroke over the capacitance [C] and does not grow; measured 9 to 21 mC. Without the
    notch the controller itself smooths a small capacitor, to below 20 V at 0.47 mF."""
    held = drive(
        *(*STEADY, *RUNNING, f"source.C_uF={C_uF}", f"pv_control.u_ref_V={u_ref_V}"),
        *("pv_control.tracking=constant", f"pv_control.actuator={actuator}"),
        *("pv_control.u_ref_min_V=160", "pv_control.acceleration_rpmps=5000"),
        f"pv_control.notch_damping={notch}",
    )
    result = rl.simulate(held, until=1.5, record=2e-4)
    early = result.u_dc[(result.t > 0.9) & (result.t < 1.2)]
    late = result.u_dc[result.t > 1.2]
    assert late.mean() == pytest.approx(u_ref_V, abs=1.0)
    most = max(charge, 20e-3 if C_uF > 1000 else 0) / (C_uF * 1e-6)
    assert np.ptp(late) < most
    assert np.ptp(late) < 1.1 * np.ptp(early)


def test_the_notch_takes_the_ripple_of_the_link_out_of_the_torque_reference() -> None:
    """To the harmonics above the first."""
    swing = {}
    for notch in (0.02, 0.0):
        held = drive(
            *(*STEADY, *RUNNING, "pv_control.tracking=constant"),
            *("pv_control.acceleration_rpmps=5000", f"pv_control.notch_damping={notch}"),
        )
        result = rl.simulate(held, until=1.0, record=1e-4)
        late = result.t > 0.7
        assert np.ptp(result.u_dc[late]) > 6.5
        swing[notch] = np.ptp(result.tau_ref[late])
    assert swing[0.02] < 0.5 * swing[0.0]


def test_constant_power_left_of_the_maximum_collapses() -> None:
    """The same drive with a speed reference that asks for more than the array has."""
    keys = ("tracking", "u_ref_V", "wake_s", "p_sleep_W", "k_dry_Nms2")
    speed = drive(
        *(*STEADY, "load.speed_rpm=1200", "reference.kind=speed", "reference.speed_rpm=1420"),
        *(f"pv_control.{key}=" for key in keys),
    )
    result = rl.simulate(speed, until=1.5, record=1e-3)
    late = result.t > 1.2
    assert result.u_dc[late].max() < 130  # of 227 at the maximum power point
    assert result.tau_ref[late].min() == 55  # the speed loop latches at its limit


def test_the_start_is_a_ramp_up_to_the_greatest_speed() -> None:
    slow = drive(
        *STEADY,
        *("reference.speed_rpm=", "reference.t_s=[0, 1.6, 1.6, 2.2, 2.2]"),
        *("reference.values=[1100, 1100, 900, 900, 0]", "pv_control.acceleration_rpmps=1000"),
    )
    result = rl.simulate(slow, until=3.0, record=1e-3)
    rpm = result.omega_m * 30 / np.pi
    ramp = 1000 * np.maximum(result.t - 0.1, 0)
    assert (rpm < ramp + 20).all()
    assert rpm[np.searchsorted(result.t, 1.0)] > 850
    assert rpm[np.searchsorted(result.t, 1.55)] == pytest.approx(1100, rel=5e-3)
    assert rpm[np.searchsorted(result.t, 2.15)] == pytest.approx(900, rel=5e-3)
    assert result.tau_ref[result.t > 2.25].max() == 0


def test_the_drive_sleeps_after_sunset_and_wakes_in_the_morning() -> None:
    night = drive(
        *("source.t_s=[0, 1, 1.2, 3, 3.2]", "source.poa_global_Wpm2=[800, 800, 0, 0, 800]"),
        *("source.temp_cell_degC=[50, 50, 50, 50, 50]", "load.speed_rpm=1000"),
        *("pv_control.sleep_s=0.3", "pv_control.u_wake_V=240"),
    )
    result = rl.simulate(night, until=4.5, record=1e-3)
    asleep = (result.t > 2.0) & (result.t < 3.0)
    assert result.tau_ref[asleep].max() == 0
    assert np.ptp(result.u_dc[asleep]) < 1e-6  # the blocking diode: nothing drains the link
    assert result.tau_ref[result.t > 4.0].min() > 0


def test_a_pump_that_runs_dry_is_stopped_and_rests() -> None:
    dry = drive(
        *STEADY,
        *("load.H_static_m=", "load.t_s=[0, 1.5, 1.5]", "load.values=[15, 15, 17]"),
        *("load.H_dry_m=16", "load.speed_rpm=1000", "pv_control.dry_s=0.5"),
        *("pv_control.rest_s=0.5", "reference.speed_rpm=1600"),
    )
    result = rl.simulate(dry, until=3.6, record=1e-3)
    rpm = result.omega_m * 30 / np.pi
    assert rpm.max() < 1.02 * 1600  # nothing runs away
    stopped = (result.t > 1.5) & (result.tau_ref == 0)
    first = result.t[stopped & (result.t > 1.6)][0]
    assert 1.9 < first < 2.6
    assert result.tau_ref[(result.t > first) & (result.t < first + 0.45)].max() == 0
    assert result.tau_ref[result.t > first + 0.7].max() > 0  # the next try


def test_a_cold_morning_does_not_trip_the_protection() -> None:
    cloudy = drive()
    levels = protection(cloudy).levels
    assert levels.u_dc_min == 0
    assert cloudy.source.cold_voltage < levels.u_dc_max == 450
    unrated = protection(drive("converter.u_rating_V=")).levels
    assert unrated.u_dc_max == pytest.approx(1.05 * cloudy.source.cold_voltage)
    with pytest.raises(rl.ParameterError, match="cold bright morning, or it trips before work"):
        protection(drive("protection.u_dc_max_V=300"))
