"""Functional mock-up units, in importers that others wrote: FMPy, and libcosim for FMI 2.0."""

import ctypes
import functools
import os
import resource
import subprocess
import sys
import zipfile
from pathlib import Path

import fmpy
import numpy as np
import pytest
from command import refused
from coupled import SENSED, WORKING
from firmware_tools import coupled_machine
from fmpy.build import build_platform_binary
from fmpy.fmi2 import FMU2Slave
from fmpy.fmi3 import FMU3Slave
from fmpy.validation import validate_fmu

import reluctance as rl
from reluctance import _core
from reluctance.drive.guard.trip_levels import protection
from reluctance.drive.run.columns import Rows
from reluctance.drive.run.events import MODES
from reluctance.drive.run.kpis import kpis
from reluctance.targets import export

pytestmark = [pytest.mark.long, pytest.mark.together]

ROOT = Path(__file__).parents[2]
DRIVE = rl.load(ROOT / "examples" / "sharing_cubic.toml")
UNTIL = 0.05
EXAMPLES = ROOT / "examples"
OTHERS = {
    "sensors": DRIVE.with_values(
        {
            "sensing.adc_bits": 12,
            "sensing.i_range_A": 200,
            "sensing.encoder_counts": 4096,
            "sensing.delay_samples": 1,
            "converter.dead_time_us": 1.5,
        }
    ),
    "map": rl.load(EXAMPLES / "map_mpc.toml"),
    "array": rl.load(EXAMPLES / "sun_cloud.toml"),
    "load step": rl.load(EXAMPLES / "load_step.toml").with_values(
        {"load.t_s": [0.02, 0.02, 0.035, 0.035]}
    ),
    "pairs": rl.load(
        EXAMPLES / "edge_mpc_mcu.toml", [f"machine={coupled_machine()}", *WORKING, *SENSED]
    ),
}
PARTS = ("drive", "stage", "controller")
each_version = pytest.mark.parametrize("version", [2, 3])


@pytest.fixture(scope="module")
def units(tmp_path_factory):
    """The files of all units, by version and part."""
    place = tmp_path_factory.mktemp("units")
    found = {}
    for version in (2, 3):
        for part in PARTS:
            found[version, part] = place / f"{part}_{version}.fmu"
            export.fmu(DRIVE, found[version, part], version=version, part=part)
    return found


@functools.cache
def description(file):
    return fmpy.read_model_description(str(file))


def mean_torque(until):
    """Of a run from its start [N m]."""
    return rl.simulate(DRIVE, until=until, record=None).periods["tau"][-1] / until


class Slave:
    """One instance, stepped by hand; the same for both versions."""

    def __init__(self, file, folder, **start):
        self.about = description(file)
        self.version = int(self.about.fmiVersion[0])
        if not (folder / "modelDescription.xml").exists():
            fmpy.extract(str(file), str(folder))
        make = FMU2Slave if self.version == 2 else FMU3Slave
        self.fmu = make(
            guid=self.about.guid,
            unzipDirectory=str(folder),
            modelIdentifier=self.about.coSimulation.modelIdentifier,
        )
        self.of = {v.name: v for v in self.about.modelVariables}
        self.fmu.instantiate()
        self.set(**start)
        if self.version == 2:
            self.fmu.setupExperiment(startTime=0.0)
        self.fmu.enterInitializationMode()
        self.fmu.exitInitializationMode()

    def _split(self, names):
        integer = [n for n in names if self.of[n].type in ("Integer", "Int32")]
        return [n for n in names if n not in integer], integer

    def set(self, **values):
        real, integer = self._split(values)
        kinds = (("Real", "Integer"), ("Float64", "Int32"))[self.version - 2]
        for kind, names, cast in zip(kinds, (real, integer), (float, int), strict=True):
            if names:
                refs = [self.of[n].valueReference for n in names]
                getattr(self.fmu, f"set{kind}")(refs, [cast(values[n]) for n in names])

    def get(self, names):
        real, integer = self._split(names)
        kinds = (("Real", "Integer"), ("Float64", "Int32"))[self.version - 2]
        found = {}
        for kind, some in zip(kinds, (real, integer), strict=True):
            if some:
                refs = [self.of[n].valueReference for n in some]
                found.update(zip(some, getattr(self.fmu, f"get{kind}")(refs), strict=True))
        return np.array([found[n] for n in names], float)

    def step(self, t, h):
        return self.fmu.doStep(t, h)

    def close(self):
        self.fmu.terminate()
        self.fmu.freeInstance()


@each_version
@pytest.mark.parametrize("part", PARTS)
def test_the_validator_finds_nothing(units, version, part):
    assert validate_fmu(str(units[version, part])) == []


@each_version
def test_variables_have_units_meanings_and_starts(units, version):
    about = fmpy.read_model_description(str(units[version, "drive"]))
    of = {v.name: v for v in about.modelVariables}
    assert of["tau"].unit == "N.m" and of["tau"].causality == "output"
    assert of["i_0"].description == "phase current"
    assert (of["leg_1"].type, of["leg_1"].variability) == (
        ("Integer", "Int32")[version - 2],
        "discrete",
    )
    assert (of["plant.R"].causality, of["plant.R"].variability) == ("parameter", "fixed")
    assert float(of["plant.R"].start) == pytest.approx(DRIVE.machine.R)
    reference, v_switch = of["reference"], of["plant.bridge.device.v_switch"]
    assert (reference.causality, float(reference.start)) == ("input", 41.339)
    assert (reference.unit, v_switch.unit) == ("N.m", "V")
    assert all(
        v.unit
        for v in of.values()
        if v.causality == "output"
        and v.type != "Int32"
        and v.name.split(".")[-1] != "turn_ons"
        and v.type != "Integer"
    )


@each_version
@pytest.mark.parametrize("step_us", [1, 10, 100])
def test_key_figures_are_those_of_a_run(units, version, step_us, tmp_path):
    """From the integrals at the ends of electrical periods, at each macro step."""
    assert_as_run(DRIVE, units[version, "drive"], step_us, tmp_path)


@pytest.mark.parametrize("name", OTHERS)
def test_key_figures_of_other_drives_are_those_of_a_run(name, tmp_path):
    """Sensors, a machine from a flux map, a photovoltaic array, a load step."""
    drive = OTHERS[name]
    for version in (2, 3):
        file = tmp_path / f"{version}.fmu"
        export.fmu(drive, file, version=version)
        assert_as_run(drive, file, 50, tmp_path / str(version))


def assert_as_run(drive, file, step_us, folder):
    expected = rl.simulate(drive, until=UNTIL, record=None).kpis
    slave = Slave(file, folder)
    columns = _core.period_columns(drive.machine.n_phases)
    ends = [f"last_period.{c}" for c in columns]
    rows, h = [slave.get([f"period.{c}" for c in columns])], step_us * 1e-6
    for n in range(round(UNTIL / h)):
        slave.step(n * h, h)
        if n % max(1000 // step_us, 1) == 0:  # no period is shorter than 1 ms
            row = slave.get(ends)
            if row[0] > rows[-1][0]:
                rows.append(row)
    row = slave.get(ends)
    rows += [row] if row[0] > rows[-1][0] else []
    rows.append(slave.get([f"period.{c}" for c in columns]))
    slave.close()
    found = kpis(Rows(np.array(rows), columns), drive, p_fe=None, wall_s_per_sim_s=0.0)
    for name, value in found.with_units().items():
        if name != "wall_s_per_sim_s":
            want = expected.with_units()[name]
            least = 1e-11 if name == "energy_residual" else 1e-12  # a difference
            exact = value == want if want is None else value == pytest.approx(want, 1e-9, least)
            assert exact, (name, value, want)


@each_version
def test_stage_and_controller_make_the_drive(units, version, tmp_path):
    stage_and_controller({part: units[version, part] for part in PARTS}, DRIVE, tmp_path)


@each_version
def test_so_do_those_whose_orders_are_for_timers(version, tmp_path):
    """Edges are set one after the other: on the way some fall."""
    timers = rl.load(EXAMPLES / "deadbeat.toml")
    files = {part: tmp_path / f"{part}.fmu" for part in PARTS}
    for part, file in files.items():
        export.fmu(timers, file, version=version, part=part)
    stage_and_controller(files, timers, tmp_path)


def stage_and_controller(files, of, tmp_path):
    """The pair against the drive, for 500 samples."""
    slaves = {part: Slave(file, tmp_path / part) for part, file in files.items()}
    stage, controller, drive = (slaves[p] for p in ("stage", "controller", "drive"))
    measured = [n for n in stage.of if n.startswith("measured.")]
    orders = [
        n
        for n, v in stage.of.items()
        if v.causality == "input" and n in controller.of and controller.of[n].causality == "output"
    ]
    assert len(orders) == 3 * len(_core.ORDER_COLUMNS)
    T_s = of.control.T_s
    for n in range(500):
        controller.set(**dict(zip(measured, stage.get(measured), strict=True)))
        controller.step(n * T_s, T_s)
        stage.set(**dict(zip(orders, controller.get(orders), strict=True)))
        stage.step(n * T_s, T_s)
        drive.step(n * T_s, T_s)
    names = ["i_0", "i_1", "i_2", "tau", "theta_m", "period.E_dc", "period.turn_ons"]
    assert stage.get(names) == pytest.approx(drive.get(names), rel=1e-9)
    assert drive.get(["period.turn_ons"])[0] > 20
    for slave in slaves.values():
        slave.close()


@each_version
def test_a_drive_with_states_is_enabled_trips_and_is_cleared_from_outside(version, tmp_path):
    """A voltage beyond its limit is a fault; it is cleared once the voltage is back."""
    file = tmp_path / "states.fmu"
    export.fmu(DRIVE.with_values({"supervision.enable_s": 0.0}), file, version=version)
    assert validate_fmu(str(file)) == []
    slave, t = Slave(file, tmp_path / "unit", enable=0), 0.0

    def after(seconds, **values):
        nonlocal t
        slave.set(**values)
        slave.step(t, seconds)
        t += seconds
        return slave.get(["states.mode", "states.status", "states.gate_enable"]).tolist()

    assert after(0.01) == [0, 0, 0]
    assert after(0.1, enable=1) == [4, 0, 1]
    turns = slave.get(["period.turn_ons"])
    assert turns[0] > 50
    assert after(0.01, u_source=400.0) == [5, 3, 0]
    assert after(0.01, enable=0, clear=1) == [5, 3, 0]  # its cause is still there
    assert after(0.01, u_source=240.0) == [0, 0, 0]
    assert after(0.1, enable=1, clear=0) == [4, 0, 1]
    slave.close()


@pytest.mark.parametrize(("version", "diagnosis"), [(2, False), (3, False), (3, True)])
def test_states_and_faults_are_those_of_the_desk(version, diagnosis, tmp_path):
    """A drive that starts, meets a fault, and stops: every state at its sample, the fault with its
    evidence, and the currents at the end, in every bit."""
    drive = DRIVE.with_values(
        {
            "supervision.enable_s": 0.0,
            "supervision.precharge_ms": 1.0,
            "supervision.fault": "over_current",
            "supervision.fault_phase": "b",
            "supervision.fault_s": 0.08,
            "simulation.until_s": 0.0802,
            "protection.diagnosis": diagnosis,
        }
    )
    expected = rl.simulate(drive, record=0.0)
    told = [(e.t, MODES.index(e.mode), e.status) for e in expected.events]
    file = tmp_path / "states.fmu"
    export.fmu(drive, file, version=version)
    slave, T_s = Slave(file, tmp_path / "unit"), drive.control.T_s
    names = [f"states.{name}" for name in ("mode", "status", "phase", "value", "limit")]
    entered, t = [], 0.0
    for n in range(round(0.0802 / T_s)):
        slave.step(t, (n + 0.5) * T_s - t)  # past a sample and no other
        t = (n + 0.5) * T_s
        mode, status, *evidence = slave.get(names).tolist()
        if not entered or entered[-1][1] != mode:
            entered.append((n * T_s, mode, status))
    assert entered == told and [mode for _, mode, _ in told] == [1, 2, 3, 4, 5]
    i_trip = protection(drive).levels.i_trip
    assert evidence[0] == 1 and evidence[1:] == pytest.approx([1.1 * i_trip, i_trip])
    slave.step(t, 0.0802 - t)
    at_the_end = slave.get(["i_0", "i_1", "i_2", "tau", "theta_m", "states.gate_enable"])
    last = [*expected.i[:, -1], expected.tau[-1], expected.theta_m[-1], 0.0]
    assert max(last[:3]) > 1 and at_the_end.tolist() == last
    slave.close()


@each_version
def test_states_are_restored_and_resets_begin_anew(units, version, tmp_path):
    slave = Slave(units[version, "drive"], tmp_path)
    names = ["i_0", "tau", "period.tau"]

    def run(start, count):
        for n in range(start, start + count):
            slave.step(n * 1e-4, 1e-4)
        return slave.get(names).tobytes()

    first = run(0, 30)
    state = slave.fmu.getFMUstate() if version == 2 else slave.fmu.getFMUState()
    after = run(30, 30)
    slave.set(reference=10.0)
    (slave.fmu.setFMUstate if version == 2 else slave.fmu.setFMUState)(state)
    assert run(30, 30) == after  # the input too is as it was
    (slave.fmu.freeFMUstate if version == 2 else slave.fmu.freeFMUState)(state)
    slave.fmu.reset()
    if version == 2:
        slave.fmu.setupExperiment(startTime=0.0)
    slave.fmu.enterInitializationMode()
    slave.fmu.exitInitializationMode()
    assert run(0, 30) == first
    slave.close()


@each_version
def test_instances_are_independent_and_parameters_act(units, version, tmp_path):
    a = Slave(units[version, "drive"], tmp_path)
    b = Slave(units[version, "drive"], tmp_path, **{"plant.R": 1.5, "reference": 20.0})
    for n in range(100):
        for slave in (a, b):
            slave.step(n * 1e-4, 1e-4)
    means = [s.get(["period.tau"])[0] / 0.01 for s in (a, b)]
    assert means[0] == pytest.approx(mean_torque(0.01), rel=1e-9)
    assert means[1] == pytest.approx(20, rel=0.15) and means[1] < 0.6 * means[0]
    with pytest.raises(Exception, match="fmi"):
        a.set(**{"plant.R": 2.0})  # fixed, and the run has begun
    for slave in (a, b):
        slave.close()


@each_version
def test_a_diverged_unit_asks_for_the_end(units, version, tmp_path):
    slave = Slave(units[version, "drive"], tmp_path, u_source=1e12)
    with pytest.raises(Exception, match=r"fmi|status"):
        for n in range(100):
            done = slave.step(n * 1e-4, 1e-4)
            if version == 3 and done is not None and done[1]:
                raise RuntimeError("status: terminate")
    slave.fmu.freeInstance()


@each_version
def test_fmpy_simulates_all_of_it(units, version):
    result = fmpy.simulate_fmu(
        str(units[version, "drive"]), stop_time=0.02, step_size=1e-4, output=["period.tau"]
    )
    assert result["period.tau"][-1] / 0.02 == pytest.approx(mean_torque(0.02), rel=1e-9)


@each_version
def test_a_thousand_instances_leave_no_memory(units, version, tmp_path):
    def cycle(count):
        for _ in range(count):
            slave = Slave(units[version, "drive"], tmp_path)
            slave.step(0.0, 1e-4)
            slave.fmu.terminate()
            slave.fmu.fmi2FreeInstance(slave.fmu.component) if version == 2 else (
                slave.fmu.fmi3FreeInstance(slave.fmu.component)
            )
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss

    before = cycle(100)
    assert cycle(1000) - before < 30_000  # [KiB]; a unit has 400


def test_libcosim_runs_the_unit(units):
    """A second importer, with the FMI library of Modelon inside."""
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimManipulator import CosimManipulator
    from libcosimpy.CosimObserver import CosimObserver
    from libcosimpy.CosimSlave import CosimLocalSlave

    assert CosimManipulator
    execution = CosimExecution.from_step_size(step_size=1e5)  # [ns]
    slave = CosimLocalSlave(fmu_path=str(units[2, "drive"]), instance_name="drive")
    index = execution.add_local_slave(slave)
    observer = CosimObserver.create_last_value()
    execution.add_observer(observer)
    assert execution.simulate_until(target_time=2e7)
    about = fmpy.read_model_description(str(units[2, "drive"]))
    reference = next(v.valueReference for v in about.modelVariables if v.name == "period.tau")
    (work,) = observer.last_real_values(index, [reference])
    assert work / 0.02 == pytest.approx(mean_torque(0.02), rel=1e-9)


@each_version
def test_binaries_need_the_c_library_alone(units, version, tmp_path):
    with zipfile.ZipFile(units[version, "drive"]) as archive:
        archive.extractall(tmp_path)
    (binary,) = (tmp_path / "binaries").rglob("*.so")
    dynamic = subprocess.check_output(["readelf", "-d", binary], text=True)
    needed = {line.split("[")[1].rstrip("]") for line in dynamic.splitlines() if "NEEDED" in line}
    assert needed <= {"libc.so.6", "libm.so.6", "ld-linux-x86-64.so.2"}
    ctypes.CDLL(str(binary))


def test_the_source_of_a_unit_compiles_by_itself(units, tmp_path):
    with zipfile.ZipFile(units[3, "controller"]) as archive:
        archive.extractall(tmp_path)
        names = archive.namelist()
    assert "sources/buildDescription.xml" in names
    (source,) = (tmp_path / "sources").glob("*.cpp")
    command = ["g++", "-std=c++20", "-fsyntax-only", "-Wall", "-Wextra", "-I.", source.name]
    subprocess.run(command, cwd=source.parent, check=True)


@each_version
def test_an_importer_compiles_the_source(units, version, tmp_path, monkeypatch):
    """By the build description of FMI 3.0. FMI 2.0 has none: there the standard is told."""
    tools = os.path.dirname(sys.executable)  # cmake, where the environment brings it
    monkeypatch.setenv("PATH", f"{tools}{os.pathsep}{os.environ['PATH']}")
    unit, work = tmp_path / "unit", tmp_path / "work"
    work.mkdir()
    fmpy.extract(str(units[version, "drive"]), str(unit))
    (binary,) = (unit / "binaries").rglob("*.so")
    binary.unlink()
    told = {"CMAKE_CXX_STANDARD": "20"} if version == 2 else None
    build_platform_binary(unit, work, cmake_options=told)
    assert binary.exists()
    result = fmpy.simulate_fmu(str(unit), stop_time=0.02, step_size=1e-4, output=["period.tau"])
    assert result["period.tau"][-1] / 0.02 == pytest.approx(mean_torque(0.02), rel=1e-9)


def test_bad_requests_are_one_line(tmp_path):
    file = ROOT / "examples" / "sharing_cubic.toml"
    given = ("export", "fmu", file, "--out")
    assert "need 2 or 3" in refused(*given, tmp_path / "a.fmu", "--version", "1")
    assert "need one of drive" in refused(*given, tmp_path / "a.fmu", "--part", "motor")
    assert ".fmu" in refused(*given, tmp_path / "a.zip")
    assert list(tmp_path.iterdir()) == []
