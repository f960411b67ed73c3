"""Efficiency maps against the runs that they stand for, and the energy of a drive cycle."""

import json
from pathlib import Path

import numpy as np
import pytest
from command import command, refused

import reluctance as rl
from reluctance.explore.efficiency_map import Cycle, driven, efficiency, read_cycle
from reluctance.explore.efficiency_map.cycle import Driven
from reluctance.explore.efficiency_map.locked import at, length
from reluctance.explore.efficiency_map.text import rows

EXAMPLES = Path(__file__).parents[2] / "examples"
CUBIC = EXAMPLES / "sharing_cubic.toml"
RPM = np.pi / 30
SPEEDS = np.array([400, 1200, 2000, 2400, 2800, 3100, 3400]) * RPM
TORQUES = [3.0, 12, 25, 45, 57, 70]
pytestmark = pytest.mark.together
CYCLE = "t_s,speed_rpm,tau_Nm\n0,1000,20\n10,1000,20\n"


@pytest.fixture(scope="module")
def lossy():  # type: ignore[no-untyped-def]
    """A map with all kinds of losses."""
    drive = rl.load(EXAMPLES / "five_phases_losses.toml")
    return efficiency(drive, omega=np.array([300, 900, 1500]) * RPM, tau=[1.0, 3, 6])


@pytest.fixture(scope="module")
def cubic():  # type: ignore[no-untyped-def]
    return efficiency(rl.load(CUBIC), omega=SPEEDS, tau=TORQUES)


def run(drive: rl.Drive, omega: float, tau: float, tau_max: float) -> rl.Kpis:
    point = at(drive, u_dc=drive.converter.u_dc_V, omega=omega, tau=tau, tau_max=tau_max)
    return rl.simulate(point, until=length(point, omega), record=None).kpis


@pytest.mark.long
def test_runs_at_random_points_agree_with_the_map(cubic) -> None:  # type: ignore[no-untyped-def]
    chance = np.random.default_rng(5)
    off = []
    for _ in range(15):
        omega = chance.uniform(SPEEDS[0], SPEEDS[-1])
        most = float(np.interp(omega, cubic.omega, cubic.tau_max))
        k = run(cubic.drive, omega, chance.uniform(5.0, 0.9 * most), max(TORQUES))
        off.append(cubic.p_in(omega, k.tau_mean) / k.p_in - 1)
    # Near the greatest torque the current rises steeply between two nodes: one is off by 2.6 %.
    assert np.sqrt(np.mean(np.square(off))) < 0.012
    assert np.abs(off).max() < 0.04
    assert np.median(np.abs(off)) < 0.003


@pytest.mark.long
def test_grid_points_are_the_runs_themselves(cubic) -> None:  # type: ignore[no-untyped-def]
    k = run(cubic.drive, float(SPEEDS[1]), 25.0, max(TORQUES))
    assert cubic.loss(SPEEDS[1], k.tau_mean) == pytest.approx(k.p_cu, rel=2e-3)
    assert cubic.efficiency(SPEEDS[1], k.tau_mean) == pytest.approx(k.efficiency, rel=1e-3)
    assert cubic.figure("i_rms_A", SPEEDS[1], k.tau_mean) == pytest.approx(k.i_rms, rel=1e-3)


@pytest.mark.long
def test_kinds_of_losses_are_what_the_power_drawn_leaves(lossy) -> None:  # type: ignore[no-untyped-def]
    """But for the field energy, which need not return to its value within a run's window."""
    assert set(lossy.kinds_per_torque) == {"p_cu_W", "p_dev_W", "p_sw_W", "p_fe_W"}
    for rpm, most in ((300, 0.01), (1500, 0.005)):
        k = run(lossy.drive, rpm * RPM, 3.0, 6.0)
        parts = [lossy.loss(rpm * RPM, k.tau_mean, kind) for kind in lossy.kinds_per_torque]
        assert all(part > 0 for part in parts)
        whole = lossy.loss(rpm * RPM, k.tau_mean)
        assert sum(parts) == pytest.approx(whole, rel=1e-12)
        assert whole == pytest.approx(k.p_in - k.p_mech, rel=most)


@pytest.mark.long
def test_what_the_drive_cannot_hold_is_no_point_of_the_map(cubic) -> None:  # type: ignore[no-untyped-def]
    table = cubic.columns()
    assert cubic.tau_max[0] == 70 > cubic.tau_max[-1] > 25
    beyond = (table["speed_rpm"] > 3300) & (table["tau_Nm"] > cubic.tau_max[-1])
    assert beyond.any() and np.isnan(table["efficiency"][beyond]).all()
    k = run(cubic.drive, float(SPEEDS[-1]), 70.0, 70.0)
    assert k.tau_mean == pytest.approx(cubic.tau_max[-1], rel=0.1)
    assert not cubic.holds(SPEEDS[-1], 68) and not cubic.holds(2 * SPEEDS[-1], 5)
    assert not cubic.holds(SPEEDS[0], -5)


@pytest.mark.long
def test_another_dc_voltage_is_another_map(cubic) -> None:  # type: ignore[no-untyped-def]
    low = efficiency(cubic.drive, omega=SPEEDS, tau=TORQUES, u_dc=150)
    assert low.u_dc == 150 and np.all(low.tau_max <= cubic.tau_max)
    assert low.tau_max[-1] < 0.7 * cubic.tau_max[-1]


@pytest.mark.long
def test_a_constant_cycle_takes_power_times_time(cubic) -> None:  # type: ignore[no-untyped-def]
    t = np.array([0.0, 1.0, 3.5, 10.0])
    omega, tau = 1000 * RPM, 20.0
    found = driven(Cycle(t, np.full(4, omega), np.full(4, tau)), cubic)
    assert found.E_in == pytest.approx(10 * cubic.p_in(omega, tau), rel=1e-12)
    assert found.E_mech == pytest.approx(10 * omega * tau, rel=1e-12)
    assert found.loss["loss"] == pytest.approx(found.E_in - found.E_mech, rel=1e-12)
    assert (found.E_returned, found.E_braked, found.held, found.below) == (0, 0, 1, 0)
    assert found.efficiency == pytest.approx(cubic.efficiency(omega, tau), rel=1e-12)


@pytest.mark.long
def test_braking_returns_what_its_losses_leave(cubic) -> None:  # type: ignore[no-untyped-def]
    braking = efficiency(cubic.drive, omega=SPEEDS, tau=[-3, -12, -25])
    omega, tau = 2000 * RPM, -10.0
    k = run(cubic.drive, omega, tau, 25.0)
    assert braking.p_in(omega, k.tau_mean) == pytest.approx(k.p_in, rel=0.02)
    assert k.p_in < 0
    cycle = Cycle(np.array([0.0, 2.0]), np.full(2, omega), np.full(2, tau))
    found = driven(cycle, cubic, braking)
    assert found.E_returned == pytest.approx(-2 * float(braking.p_in(omega, tau)), rel=1e-9)
    assert found.E_braked == pytest.approx(20 * omega, rel=1e-9)
    assert driven(cycle, cubic).held == 0


@pytest.mark.parametrize(
    ("energies", "expected"),
    [
        ((10, 0, 20, 0), 0.5),
        ((10, 4, 20, 8), 0.5),
        ((4, 10, 20, 8), None),  # both sides feed the losses
        ((4, 10, 8, 20), None),
        ((4, 3, 8, 8), None),  # all that was drawn came back
    ],
)
def test_a_cycle_has_an_efficiency_where_the_link_gives_and_the_shaft_gets(
    energies: tuple[float, ...], expected: float | None
) -> None:
    names = ("E_mech", "E_braked", "E_in", "E_returned")
    cycle = Driven(**dict(zip(names, energies, strict=True)), loss={}, held=1.0, below=0.0)
    assert cycle.efficiency == expected


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("t_s,speed_rpm\n0,1\n1,1\n", "no column `tau_Nm`"),
        ("t_s,speed_rpm,tau_Nm\n0,1,x\n1,1,1\n", "data row 1, tau_Nm: `x` is not a number"),
        ("t_s,speed_rpm,tau_Nm\n0,1,1\n0,1,1\n", "rising t_s"),
        ("t_s,speed_rpm,tau_Nm\n0,1,1\n1,-1,1\n", "need >= 0"),
        ("t_s,speed_rpm,tau_Nm\n0,1,nan\n1,1,1\n", "finite"),
        ("", "no rows"),
    ],
)
def test_a_cycle_that_cannot_be_meant_is_one_line(text: str, told: str, tmp_path: Path) -> None:
    path = tmp_path / "cycle.csv"
    path.write_text(text)
    with pytest.raises(rl.ParameterError, match=told):
        read_cycle(path)
    assert told in refused("efficiency", CUBIC, "--cycle", path)


def test_a_point_does_not_depend_on_the_others_of_the_grid(tmp_path: Path) -> None:
    """The angles of this law follow the greatest torque: the drive's own or the point's."""
    drive = rl.load(CUBIC, ["control.law=angles", "reference.tau_Nm=20"])
    speed, torque = 50 * np.pi, 20.0
    run = rl.simulate(drive, record=None).kpis
    for omega, tau in (([100.0, speed], [10.0, torque]), ([speed, 200.0], [torque, 40.0])):
        found = efficiency(drive, omega=omega, tau=tau, out=tmp_path / "s.db")
        assert float(found.efficiency(speed, torque)) == pytest.approx(run.efficiency, rel=1e-3)
        for name, own in (("i_rms_A", run.i_rms), ("torque_ripple_rms", run.torque_ripple_rms)):
            assert float(found.figure(name, speed, torque)) == pytest.approx(own, rel=2e-3)


def test_axes_that_cannot_be_meant_are_one_line() -> None:
    drive = rl.load(CUBIC)
    for axes in ({"tau": [0.0, 5.0]}, {"tau": [-5.0, 5.0]}, {"tau": [5.0]}):
        with pytest.raises(rl.ParameterError, match="at least two different ones, of one sign"):
            efficiency(drive, **axes)  # type: ignore[arg-type]
    for omega in ([9.0], [-9.0, 9.0], [-9.0, -5.0], [0.0, 9.0]):
        with pytest.raises(rl.ParameterError, match="at least two different ones, all > 0") as told:
            efficiency(drive, omega=omega)
        assert ("turns backwards" in str(told.value)) == (min(omega) < 0)
    line = refused("efficiency", CUBIC, "--speed", "0:1000:3")
    assert "speeds 0, 500, 1000 rpm, need" in line and "at standstill" in line
    assert "torques 0, 20 N m, need" in refused("efficiency", CUBIC, "--torque", "0,20")
    with pytest.raises(rl.ParameterError, match="fixes its current"):
        efficiency(rl.load(EXAMPLES / "single_pulse.toml"))


def test_a_map_without_a_point_that_is_held_is_one_line_whose_remedy_works() -> None:
    line = ("efficiency", CUBIC, "--speed", "6000:9000:2", "--no-envelope")
    for more in ((), ("--json",)):
        told = refused(*line, "--torque", "60:70:2", *more)
        assert "holds no point of the map: of at least 60 N m asked for" in told
    most = float(told.partition("it gives at most ")[2].partition(",")[0])
    assert 5 < most < 60 and "at 6000 rpm" in told
    held = command(*line, "--torque", f"{most / 4},{most / 2}", "--json")
    assert json.loads(held.out)["tau_max_Nm"][0] == pytest.approx(most / 2)


@pytest.mark.long
def test_device_conduction_is_counted_only_with_its_data(cubic, lossy) -> None:  # type: ignore[no-untyped-def]
    counted = [dict(rows(found, None))["losses counted"] for found in (cubic, lossy)]
    assert "device" not in counted[0] and "device conduction" in counted[1]


def test_the_command_prints_map_and_cycle(tmp_path: Path) -> None:
    cycle = tmp_path / "cycle.csv"
    cycle.write_text(CYCLE)
    line = ("efficiency", CUBIC, "--speed", "600,1500", "--torque", "10,30", "--cycle", cycle)
    told = json.loads(command(*line, "--json").out)
    assert told["tau_max_Nm"] == [30, 30]
    assert told["cycle"]["held_part_of_time"] == 1
    assert told["cycle"]["below_map_part_of_time"] == 0
    assert told["cycle"]["E_mech_J"] == pytest.approx(10 * 20 * 1000 * RPM)
    assert 0.3 < told["best_efficiency"] < 1
    text = command(*line, "--out", tmp_path / "map.csv").out
    assert "cycle: efficiency" in text
    assert (tmp_path / "map.csv").read_text().startswith("speed_rpm,tau_Nm,efficiency,p_in_W")


def test_runs_of_braking_are_counted_too(tmp_path: Path) -> None:
    cycle = tmp_path / "cycle.csv"
    cycle.write_text("t_s,speed_rpm,tau_Nm\n0,800,20\n10,800,20\n10.1,800,-20\n20,800,-20\n")
    line = ("efficiency", CUBIC, "--speed", "600,1500", "--torque", "10,30", "--json", "--set")
    told = (f"converter.u_dc_V={u_dc}" for u_dc in (241.3, 241.7))  # of no other test
    motoring = json.loads(command(*line, next(told)).out)
    both = json.loads(command(*line, next(told), "--cycle", cycle).out)
    assert (motoring["ran"], both["ran"]) == (4, 8)
