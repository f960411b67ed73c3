"""Commissioning in the exported package: the compiled routines against the plant, on the desk."""

import ctypes
import subprocess

import numpy as np
import pytest
from on_the_bench import bench_drive

from reluctance import _core
from reluctance.commission import commission
from reluctance.commission.bench import rotor
from reluctance.export import firmware
from reluctance.export.target import PHASE
from reluctance.run.plant import loop_parts

ROUTINES = {"wiring": 1, "resistance": 2, "alignment": 3, "pulses": 4}
MODES = ("off", "precharge", "calibrate", "ready", "run", "fault")


class Board:
    """An exported package as a shared library, in the interrupt of a board that a plant answers."""

    def __init__(self, drive, folder):
        package = firmware(drive, folder / "package").folder
        library = folder / "commission.so"
        flags = ("-std=c++20", "-O1", "-ffp-contract=off", "-fPIC", "-shared", "-Wall", "-Werror")
        subprocess.run(
            ["g++", *flags, "-I.", "-Iinclude", "commission.cpp", "-o", library],
            cwd=package,
            check=True,
        )
        self.drive, self.library = drive, ctypes.CDLL(str(library))
        self.library.reluctance_describe_finding.restype = ctypes.c_char_p
        n = drive.machine.n_phases
        self.commissioner = np.zeros(160, np.uint32)
        self.command = np.zeros(1, np.dtype([("phase", PHASE, (n,))]))
        names = ("theta_e", "omega_m", "u_dc", "i_source")
        self.sample = np.zeros(1, [("i", "<f4", (n,)), *((name, "<f4") for name in names)])
        request = ("enable", "clear", "tripped", "sequence")
        self.request = np.zeros(1, [*((name, "<u4") for name in request), ("reference", "<f4")])
        self.request["enable"] = 1
        outputs = ("mode", "gate_enable", "precharged", "chopper")
        self.outputs = np.zeros(1, [(name, "<i4") for name in outputs])
        self.found = np.zeros(
            1,
            [
                *(("finding", "<i4"), ("progress", "<f4"), ("sensor", "<i4", (n,))),
                *(("sign", "<i4", (n,)), ("R", "<f4", (n,)), ("place", "<i4", (n,))),
                *(("direction", "<i4"), ("zero", "<f4"), ("spread", "<f4")),
                *(("pulse", "<i4"), ("sample", "<i4"), ("u_mean", "<f4"), ("i", "<f4")),
                ("theta_e", "<f4"),
            ],
        )
        self.modes, self.samples, self.commands, self.trip_at = [], 0, True, None

    def _call(self, name, *arrays):
        function = getattr(self.library, f"reluctance_{name}")
        return function(*(ctypes.c_void_p(a.ctypes.data) for a in arrays))

    def step(self, i, theta_e, omega_m, u_dc, reference, i_source):
        self.sample[0] = (i, theta_e, omega_m, u_dc, i_source)
        self.samples += 1
        if self.commands:
            self.request["sequence"] += 1
        self.request["tripped"] = self.samples == self.trip_at
        arrays = (self.commissioner, self.sample, self.request, self.command, self.outputs)
        self._call("commission", *arrays)
        self._call("get_found", self.commissioner, self.found)
        mode = MODES[self.outputs["mode"][0]]
        if mode not in self.modes[-1:]:
            self.modes.append(mode)
        row = []
        for order in self.command["phase"][0]:
            for name in PHASE.names:
                if name != "padding":
                    row.extend(np.atleast_1d(order[name]).astype(float).tolist())
        return [*row, 0.0]

    def run(self, routine, *, theta_e_deg=40.0, until=20.0, phase=0, pulses=1, clamped=True):
        """One routine, until it ends."""
        start = self.library.reluctance_commission_start
        start(ctypes.c_void_p(self.commissioner.ctypes.data), ROUTINES[routine], phase, pulses)
        self.found[:] = np.zeros(1, self.found.dtype)
        n = self.drive.machine.n_phases
        parts = loop_parts(self.drive, -1.0)
        parts["theta_m"] = np.radians(theta_e_deg) / self.drive.machine.N_r
        parts["shaft"] = rotor(self.drive, clamped=clamped)
        controller = _core.controller_from(n, self.step)
        loop = _core.Simulation(n_phases=n, controller=controller, **parts)
        t = 0.0
        while t < until and self.found["finding"][0] <= 1 and self.modes[-1:] != ["fault"]:
            t = loop.advance(t + 0.01)
        return self.found[0]

    def all_off(self):
        phases = self.command["phase"][0]
        return bool((phases["leg"] == -1).all())


DRIVE = bench_drive("paper_6_4", "real", **{"control.T_s_us": 50})


@pytest.fixture(scope="module")
def compiled(tmp_path_factory):
    return Board(DRIVE, tmp_path_factory.mktemp("commission"))


@pytest.fixture
def board(compiled):
    compiled.modes, compiled.samples, compiled.commands, compiled.trip_at = [], 0, True, None
    compiled.request["enable"] = 1
    compiled.request["clear"] = 0
    return compiled


def test_wiring_goes_through_the_states_of_the_drive(board):
    found = board.run("wiring")
    assert board.modes == ["off", "precharge", "calibrate", "ready", "run"] or board.modes == [
        *("precharge", "calibrate", "ready", "run")
    ]
    assert found["finding"] == 2
    assert found["sensor"].tolist() == [0, 1, 2]
    assert found["sign"].tolist() == [1, 1, 1]
    assert found["progress"] == 1
    assert board.all_off()


@pytest.mark.long
def test_the_compiled_resistance_is_that_of_the_simulation(board):
    found = board.run("resistance", until=1.8)  # of leg 0
    simulated = commission(DRIVE, "resistance", clamped=True)
    assert found["R"][0] == pytest.approx(simulated.R[0], rel=2e-3)  # other samples of the noise
    assert found["R"][0] == pytest.approx(DRIVE.machine.R, rel=5e-3)


@pytest.mark.long
def test_the_compiled_alignment_finds_order_direction_and_zero(board):
    found = board.run("alignment", until=60.0, clamped=False)
    assert found["finding"] == 2
    assert found["place"].tolist() == [0, 1, 2]
    assert found["direction"] == 1
    count = 2 * np.pi * DRIVE.machine.N_r / DRIVE.sensing.encoder_counts
    assert abs((found["zero"] + np.pi) % (2 * np.pi) - np.pi) < count
    assert found["spread"] < count


def test_a_pulse_is_told_row_by_row(board):
    rows = []
    plain = board.step

    def step(*sample):
        orders = plain(*sample)
        if board.modes[-1] == "run" and board.found["finding"][0] == 1:
            rows.append(board.found[["pulse", "sample", "u_mean", "i"]][0].tolist())
        return orders

    board.step = step
    found = board.run("pulses", theta_e_deg=180.0, phase=0, pulses=2)
    board.step = plain
    assert found["finding"] == 2
    rows = np.array(rows)
    simulated = commission(DRIVE, "pulses", theta_e_deg=180.0, pulses=2).rows
    for pulse in (0, 1):
        ours, theirs = (r[r[:, 0] == pulse] for r in (rows, simulated))
        assert ours[:, 3].max() == pytest.approx(theirs[:, 3].max(), rel=0.05)
        volt_seconds = [r[: r[:, 3].argmax(), 2].sum() for r in (ours, theirs)]
        assert volt_seconds[0] == pytest.approx(volt_seconds[1], rel=0.05)


def test_without_commands_the_legs_go_off(board):
    board.run("resistance", until=0.2)
    assert board.modes[-1] == "run"
    board.commands = False
    timeout = DRIVE.protection.command_timeout_ms / 1e3
    for _ in range(int(timeout / DRIVE.control.T_s) + 2):
        board.step([0.0] * 3, 0.7, 0.0, 240.0, 0.0, 0.0)
    assert board.modes[-1] == "fault"
    assert board.all_off()


def test_a_trip_of_the_hardware_ends_the_routine(board):
    board.run("resistance", until=0.2)
    board.trip_at = board.samples + 1
    board.step([0.0] * 3, 0.7, 0.0, 240.0, 0.0, 0.0)
    assert board.modes[-1] == "fault"
    assert board.outputs["gate_enable"][0] == 0
    assert board.all_off()


@pytest.mark.parametrize(
    ("sample", "finding"),
    [
        (([200.0, 0, 0], 0.7, 240.0), b"above the trip level"),
        (([-200.0, 0, 0], 0.7, 240.0), b"above the trip level"),
        (([0, float("nan"), 0], 0.7, 240.0), b"not a finite number"),
        (([0.0, 0, 0], 0.7, 400.0), b"outside its limits"),
        (([0.0, 0, 0], float("nan"), 240.0), b"not a finite number"),
    ],
)
def test_a_sample_that_no_routine_goes_on_with_is_a_fault(board, sample, finding):
    board.run("resistance", until=0.2)
    i, theta_e, u_dc = sample
    board.step(i, theta_e, 0.0, u_dc, 0.0, 0.0)
    assert board.modes[-1] == "fault"
    assert board.all_off()
    told = board.library.reluctance_describe_finding(int(board.found["finding"][0]))
    assert finding in told
