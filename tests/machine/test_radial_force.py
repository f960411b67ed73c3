"""Radial force on the stator poles of a run: spatial orders, and the table it comes from."""

import json
import shutil
from pathlib import Path
from types import SimpleNamespace as Namespace

import numpy as np
import pytest
from command import command, refused
from geometries import changed, drive, geometry, write

import reluctance as rl
from reluctance.drive.run import radial_force
from reluctance.drive.run.radial_force import force_orders, pole_forces, spatial_orders
from reluctance.machine.geometry.force import N_POINTS, Stress, stress
from reluctance.machine.geometry.position import at_angle
from reluctance.machine.geometry.samples import rotor_angle
from reluctance.machine.geometry.solve import solve
from reluctance.machine.geometry.solved import solved, system_of
from reluctance.machine.maps.pole_force import read_pole_force, write_pole_force

MACHINES = Path(__file__).parents[2] / "machines"
FEW = {"map__angles": 13, "map__currents": 6}


def test_the_orders_of_a_wave_are_its_own():
    """f_k = 5 + 4 cos(2 pi k/12) + 3 cos(2 pi 2 k/12 - x) + 2 cos(2 pi 5 k/12) + (-1)^k cos x."""
    x = np.linspace(0, 6, 40)
    k = np.arange(12)[:, None]
    waves = spatial_orders(
        5
        + 4 * np.cos(2 * np.pi * k / 12)
        + 3 * np.cos(2 * np.pi * 2 * k / 12 - x)
        + 2 * np.cos(2 * np.pi * 5 * k / 12)
        + (-1.0) ** k * np.cos(x)
    )
    assert waves.shape == (7, 40)
    assert waves[0] == pytest.approx(np.full(40, 5.0))
    assert waves[1] == pytest.approx(np.full(40, 4.0))
    assert waves[2] == pytest.approx(3 * np.exp(-1j * x))
    assert waves[5] == pytest.approx(np.full(40, 2.0))
    assert waves[6] == pytest.approx(np.cos(x))
    assert np.abs(waves[[3, 4]]).max() < 1e-12


def test_the_orders_of_a_stress_over_a_sector_are_multiples_of_the_sectors():
    theta = (np.arange(N_POINTS) + 0.5) * (np.pi / 2) / N_POINTS
    radial = 5 + 3 * np.cos(4 * theta) + 2 * np.cos(8 * theta)
    of_a_quarter = Stress(
        theta=theta, radial=radial, tangential=0 * theta, r=0.05, length=0.1, n_sectors=4
    )
    orders, amplitudes = of_a_quarter.orders(4)
    assert orders.tolist() == [0, 4, 8, 12]
    assert amplitudes == pytest.approx([5, 3, 2, 0], abs=1e-9)


@pytest.mark.parametrize("sense", [1, -1])
def test_each_order_has_its_mean_its_greatest_and_its_largest_oscillation(monkeypatch, sense):
    """Over 20 ms: f_k = 100 + 8 cos(2 pi 600 t) + (20 + 5 cos(2 pi 50 t)) cos(2 pi 2 k/6 -+ 2 pi
    150 t). The wave of order 2 turns with the poles or against them."""
    t = np.linspace(0, 0.03, 3001)
    k = np.arange(6)[:, None]

    def forces(machine, i, theta_m):
        at = theta_m  # that the rotor turns by 1 rad/s tells the time
        wave = (20 + 5 * np.cos(2 * np.pi * 50 * at)) * np.cos(
            2 * np.pi * (2 * k / 6 - sense * 150 * at)
        )
        return 100 + 8 * np.cos(2 * np.pi * 600 * at) + wave

    window = {"t": np.array([0.01, 0.02, 0.03])}
    monkeypatch.setattr(radial_force, "pole_forces", forces)
    monkeypatch.setattr(radial_force, "evaluated", lambda *_: (window, None))
    machine = Namespace(N_r=4, N_s=6)
    run = Namespace(
        t=t, theta_m=t, i=np.zeros((3, t.size)), periods=None, drive=Namespace(machine=machine)
    )
    mean, turning = force_orders(run)
    assert (mean.order, turning.order) == (0, 2)
    assert mean.mean == pytest.approx(100) and mean.max == pytest.approx(108, rel=1e-4)
    assert abs(mean.f) == pytest.approx(600) and mean.amplitude == pytest.approx(8, rel=1e-3)
    assert turning.mean == pytest.approx(20) and turning.max == pytest.approx(25, rel=1e-3)
    assert turning.f == pytest.approx(sense * 150)
    assert turning.amplitude == pytest.approx(20, rel=1e-3)
    assert turning.with_units()["f_Hz"] == turning.f and "at 150 Hz" in str(turning)


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """Drive files on a geometry, and on the machine file that the command makes of it."""
    folder = tmp_path_factory.mktemp("force")
    path, out = write(folder / "g.toml", changed(**FEW)), folder / "m.toml"
    done = command("machine", "from-geometry", path, "--out", out)
    assert done.code == 0, done.error
    assert str(folder / "m_force.csv") in done.out
    return [on(machine, folder) for machine in (path, out)]


@pytest.fixture
def stored(tmp_path):
    """A drive file on a copy of the library's machine."""
    for file in MACHINES.glob("onelab_6_4[._]*"):
        shutil.copy(file, tmp_path)
    return on(tmp_path / "onelab_6_4.toml", tmp_path)


def on(machine, folder):
    tables = write(folder / f"d_{machine.stem}.toml", drive({}))
    text = tables.read_text().replace("[machine]\n", "")
    tables.write_text(f'machine = "{machine}"\n' + text)
    return tables


@pytest.mark.long
def test_the_force_on_each_pole_is_that_of_the_field(made):
    """One phase at a node of its table, by Maxwell's stress in the gap; poles of other phases have
    little."""
    machine = rl.load(made[0]).machine
    case = geometry(**FEW)
    system, solution = system_of(case), solved(case)
    i, theta_e = solution.i[3], solution.theta_e[9]
    alpha = rotor_angle(system, theta_e)
    field = stress(solve(at_angle(system, alpha), i * np.eye(3)[0]))
    exact = np.array([field.pole_force(k, 6) for k in range(6)])
    currents, theta_m = i * np.eye(3)[:, :1], np.array([theta_e / 4])
    found = pole_forces(machine, currents, theta_m)[:, 0]
    assert found[[0, 3]] == pytest.approx(exact[[0, 3]], rel=1e-3)
    assert np.abs(exact[[1, 2, 4, 5]]).max() < 0.1 * exact[0]


@pytest.mark.long
def test_each_phase_of_the_drive_acts_on_its_own_poles(made):
    """6/4: the phase after a on the drive's list stands two poles on, as b of the poles is c of the
    drive."""
    machine = rl.load(made[0]).machine
    for k, poles in ((0, (0, 3)), (1, (2, 5)), (2, (1, 4))):
        theta_m = np.array([(np.pi + 2 * np.pi * k / 3) / 4])  # phase k aligned
        forces = pole_forces(machine, 10 * np.eye(3)[:, k : k + 1], theta_m)[:, 0]
        assert forces[list(poles)] == pytest.approx([forces.max()] * 2)
        assert forces.sum() == pytest.approx(2 * forces.max())


@pytest.mark.long
def test_a_run_prints_the_force_of_each_order(made):
    done = command("run", made[1], "--json")
    found = json.loads(done.out)["radial_force"]
    assert [x["order"] for x in found] == [0, 2]  # two opposite poles a phase: even, and below 3
    electrical = 700 / 60 * 4
    assert found[0]["f_Hz"] == pytest.approx(3 * electrical, rel=0.02)  # a pulse of each phase
    assert abs(found[1]["f_Hz"]) == pytest.approx(electrical, rel=0.02)  # turns with the phases
    assert found[1]["max_N"] > found[0]["max_N"] > found[0]["mean_N"] > 0
    text = command("run", made[1]).out
    assert text.count("radial force on a stator pole, order") == 2


@pytest.mark.long
def test_geometry_and_machine_file_have_one_force(made):
    orders = [force_orders(rl.simulate(rl.load(path), record=25e-6)) for path in made]
    for one, other in zip(*orders, strict=True):
        assert one.order == other.order
        assert one.mean == pytest.approx(other.mean, rel=1e-3)
        assert one.amplitude == pytest.approx(other.amplitude, rel=1e-2)


def test_forces_need_waveforms_and_a_table(stored):
    with pytest.raises(rl.ParameterError, match="the run has no waveforms"):
        force_orders(rl.simulate(rl.load(stored), record=None))
    machine = rl.load("examples/paper_rated.toml").machine
    with pytest.raises(rl.ParameterError, match="this machine has no radial force"):
        pole_forces(machine, np.zeros((3, 1)), np.zeros(1))


def test_a_table_is_even_and_written_and_read_back(tmp_path):
    solution = solved(geometry(**FEW))
    write_pole_force(solution.force_table, tmp_path / "f.csv")
    again = read_pole_force(tmp_path / "f.csv")
    assert again.force == pytest.approx(solution.pole_force, rel=1e-5)
    assert again.at(9.0, -2.0) == pytest.approx(again.at(9.0, 2.0))
    assert again.at(9.0, 2.0 + 2 * np.pi) == pytest.approx(again.at(9.0, 2.0))
    assert again.at(99.0, np.pi) == pytest.approx(again.force[-1, -1])


WRONG = [
    (lambda text: text.replace("force_N", "F"), "need numbers in the columns i_A"),
    (lambda text: text.replace("\n12.0", "\nfifteen"), "i_A: `fifteen` is not a number"),
    (lambda text: "\n".join(text.splitlines()[:-1]), "rows are no grid"),
    (lambda text: text.replace(",180.0,", ",179.0,"), "rows are no grid"),
]


@pytest.mark.parametrize(("change", "text"), WRONG)
def test_a_force_table_that_is_none_gets_one_line(stored, change, text):
    file = stored.parent / "onelab_6_4_force.csv"
    file.write_text(change(file.read_text()))
    assert text in refused("run", stored)
    file.unlink()
    assert "no such file" in refused("run", stored)
