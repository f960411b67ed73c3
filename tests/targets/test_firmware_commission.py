"""Commissioning in the exported package: the compiled routines against the plant, on the desk."""

import csv
import ctypes

import numpy as np
import pytest
from on_the_bench import bench_drive

from reluctance import _core
from reluctance.base.toolchain import build
from reluctance.drive.guard.trip_levels import protection
from reluctance.drive.run.plant import loop_parts
from reluctance.machine.maps import identify, read_pulses
from reluctance.targets.commission import commission
from reluctance.targets.commission.bench import rotor
from reluctance.targets.export import firmware
from reluctance.targets.export.target import PHASE

ROUTINES = {"wiring": 1, "resistance": 2, "alignment": 3, "pulses": 4}
MODES = ("off", "precharge", "calibrate", "ready", "run", "fault")
RUNNING, DONE = 1, 2
PROBE = """
#include "commission.cpp"
extern "C" void probe_fault(const reluctance_commissioner* x, srm::Fault<float>* fault) {
  *fault = state_of(x).states.fault;
}
"""
BOARD = """
#include "board.h"
int32_t board_interrupt(const reluctance_measurement*, const reluctance_request*,
                        reluctance_command*, reluctance_outputs*, reluctance_found*);
static const reluctance_measurement* y;
static const reluctance_request* ask;
static reluctance_command* orders;
static reluctance_outputs* out;
static reluctance_found* found;
static int32_t written;
void board_read_currents(float i_A[RELUCTANCE_PHASES]) {
  for (int k = 0; k < RELUCTANCE_PHASES; ++k) i_A[k] = y->i_A[k];
}
float board_read_angle(void) { return y->theta_e_rad; }
float board_read_speed(void) { return y->omega_m_rad_s; }
float board_read_dc_link(void) { return y->u_dc_V; }
float board_read_source_current(void) { return y->i_source_A; }
void board_init(void) {}
void board_write_leg(int k, int8_t leg) { (void)k, (void)leg; }
void board_read_request(reluctance_request* request) { *request = *ask; }
void board_write_orders(const reluctance_command* command) { *orders = *command; }
void board_write_outputs(const reluctance_outputs* outputs) { *out = *outputs; }
void board_trip(const reluctance_fault* fault) { (void)fault; }
void board_write_found(const reluctance_found* told) { *found = *told, ++written; }
/* The interrupt, and how many times it has told what it found. */
int32_t board_interrupt(const reluctance_measurement* sample, const reluctance_request* request,
                        reluctance_command* command, reluctance_outputs* outputs,
                        reluctance_found* told) {
  y = sample, ask = request, orders = command, out = outputs, found = told, written = 0;
  control_interrupt();
  return written;
}
"""


class Board:
    """An exported package as a shared library, in the interrupt of a board that a plant answers."""

    def __init__(self, drive, folder):
        package = firmware(drive, folder / "package").folder
        (package / "probe.cpp").write_text(PROBE)
        (package / "board.c").write_text(BOARD)
        flags = ("-O1", "-Wall", "-Werror", "-I.", "-Iinclude")
        sources = ["main.c", "board.c", "probe.cpp", "controller.cpp"]
        library = build(sources, "commission.so", flags, folder=package, what="the package")
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
                *(("theta_e", "<f4"), ("u_held", "<f4"), ("i_held", "<f4")),
                ("offset", "<f4", (n,)),
            ],
        )
        self.modes, self.samples, self.commands, self.trip_at = [], 0, True, None

    def _call(self, name, *arrays):
        function = getattr(self.library, f"reluctance_{name}")
        return function(*(ctypes.c_void_p(a.ctypes.data) for a in arrays))

    def step(self, y, reference):
        self.sample[0] = (y.i, y.theta_e, y.omega_m, y.u_dc, y.i_source)
        self.samples += 1
        if self.commands:
            self.request["sequence"] += 1
        self.request["tripped"] = self.samples == self.trip_at
        self.control()
        mode = MODES[self.outputs["mode"][0]]
        if mode not in self.modes[-1:]:
            self.modes.append(mode)
        row = []
        for order in self.command["phase"][0]:
            for name in PHASE.names:
                if name != "padding":
                    row.extend(np.atleast_1d(order[name]).astype(float).tolist())
        return [*row, 0.0]

    def control(self):
        arrays = (self.commissioner, self.sample, self.request, self.command, self.outputs)
        self._call("commission", *arrays)
        self._call("get_found", self.commissioner, self.found)

    def start(self, routine, phase, pulses, held):
        start = self.library.reluctance_commission_start
        commissioner = ctypes.c_void_p(self.commissioner.ctypes.data)
        start(commissioner, ROUTINES[routine], phase, pulses, *held)

    def fault(self):
        """Status, value and limit of the fault that ended `run`."""
        fault = np.zeros(1, np.dtype("i1,i1,f4,f4,u4", align=True))
        probe = self.library.probe_fault
        probe(*(ctypes.c_void_p(a.ctypes.data) for a in (self.commissioner, fault)))
        return [fault[0][n] for n in (0, 2, 3)]

    def run(
        self,
        routine,
        *,
        theta_e_deg=40.0,
        until=20.0,
        phase=0,
        pulses=1,
        held=(-1, 0.0),
        clamped=True,
    ):
        """One routine, until it ends."""
        self.start(routine, phase, pulses, (held[0], ctypes.c_float(held[1])))
        self.found[:] = np.zeros(1, self.found.dtype)
        n = self.drive.machine.n_phases
        parts = loop_parts(self.drive, -1.0)
        parts["theta_m"] = np.radians(theta_e_deg) / self.drive.machine.N_r
        parts["shaft"] = rotor(self.drive, clamped=clamped)
        controller = _core.controller_from(n, self.step)
        loop = _core.Simulation(controller, _core.SimulationParts(**parts))
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


def test_a_phase_that_is_held_meanwhile_is_told_with_the_voltage_that_holds_it(board):
    told = []
    plain = board.step

    def step(*sample):
        orders = plain(*sample)
        if board.modes[-1] == "run" and board.found["finding"][0] == RUNNING:
            told.append(board.found[["pulse", "sample", "u_held", "i_held"]][0].tolist())
        return orders

    board.step = step
    found = board.run("pulses", theta_e_deg=180.0, pulses=2, held=(2, 20.0))
    board.step = plain
    assert found["finding"] == DONE and board.all_off()
    rows = np.array(told)
    settles = rows[:, 0] < 0
    assert settles.sum() * DRIVE.control.T_s == pytest.approx(0.3, rel=0.02)
    assert not settles[settles.argmin() :].any()
    assert rows[settles.argmin(), 1] == 0
    u, i = rows[~settles, 2:].mean(axis=0)
    assert i == pytest.approx(20.0, rel=0.01)
    assert u == pytest.approx(DRIVE.machine.R * i, rel=0.02)


class Encoder:
    """The board's interrupt in C, with an encoder that toggles between two counts; its rows."""

    def __init__(self, board, drive):
        self.board, self.drive, self.rows = board, drive, []
        self.count = 2 * np.pi * drive.machine.N_r / drive.sensing.encoder_counts

    def start(self, routine, phase, pulses, held):
        self.board.library.control_commission(ROUTINES[routine], phase, pulses, *held)

    def control(self):
        board = self.board
        shown = board.sample["theta_e"] - self.count * (board.samples % 3 == 0)
        board.sample["theta_e"] = np.float32(shown % np.float32(2 * np.pi))
        arrays = (board.sample, board.request, board.command, board.outputs, board.found)
        pointers = (ctypes.c_void_p(a.ctypes.data) for a in arrays)
        if board.library.board_interrupt(*pointers) and board.found["finding"][0] == RUNNING:
            self.rows.append(self.row(board.found[0]))

    def row(self, found):
        """As the README of the package says."""
        theta_e = float(found["theta_e"])
        turned = theta_e - 2 * np.pi if theta_e > 6 else theta_e
        theta_m = turned * 180 / (np.pi * self.drive.machine.N_r)
        t = found["sample"] * self.drive.control.T_s
        return [t, found["u_mean"], found["i"], f"{theta_m:.5f}"]


def test_what_the_interrupt_tells_is_a_recording_for_map_identify(board, monkeypatch, tmp_path):
    encoder = Encoder(board, DRIVE)
    for name in ("start", "control"):
        monkeypatch.setattr(board, name, getattr(encoder, name))
    # The interrupt loads the orders a period later: the plant must not delay them again.
    monkeypatch.setattr(board, "drive", DRIVE.with_values({"sensing.delay_samples": 0}))
    angles = np.linspace(0, 180, 7)
    for theta_e_deg in angles:
        found = board.run("pulses", theta_e_deg=float(theta_e_deg), pulses=2)
        assert found["finding"] == DONE
    with (tmp_path / "p.csv").open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["t_s", "u_mean_V", "i_A", "theta_m_deg"])
        writer.writerows(encoder.rows)
    machine = DRIVE.machine
    identified = identify(read_pulses([tmp_path / "p.csv"]), N_r=machine.N_r, R=machine.R)
    assert (identified.n_pulses, identified.n_angles) == (2 * len(angles), len(angles))
    table = identified.table
    i, theta_e = np.meshgrid(table.i, table.theta_e, indexing="ij")
    psi = _core.magnetics(machine.magnetics, i.ravel(), theta_e.ravel())[:, 0]
    assert table.psi.ravel() == pytest.approx(psi, abs=0.02 * psi.max())


def test_no_pulses_are_one(board):
    found = board.run("pulses", theta_e_deg=180.0, pulses=0, until=1.0)
    assert (found["finding"], found["pulse"], found["progress"]) == (DONE, 1, 1)


def at_rest(u_dc):
    return _core.Measurement(i=[0.0] * 3, theta_e=0.7, omega_m=0.0, u_dc=u_dc)


@pytest.mark.parametrize(
    ("u_dc", "status", "limit"), [(400.0, 3, "u_dc_max"), (20.0, 4, "u_dc_min")]
)
def test_a_wrong_voltage_is_a_fault_with_its_evidence(board, u_dc, status, limit):
    board.run("resistance", until=0.2)
    board.step(at_rest(u_dc), 0.0)
    assert board.modes[-1] == "fault"
    assert board.fault() == pytest.approx([status, u_dc, getattr(protection(DRIVE).levels, limit)])


def test_without_commands_the_legs_go_off(board):
    board.run("resistance", until=0.2)
    assert board.modes[-1] == "run"
    board.commands = False
    timeout = DRIVE.protection.command_timeout_ms / 1e3
    for _ in range(int(timeout / DRIVE.control.T_s) + 2):
        board.step(at_rest(240.0), 0.0)
    assert board.modes[-1] == "fault"
    assert board.all_off()


def test_a_trip_of_the_hardware_ends_the_routine(board):
    board.run("resistance", until=0.2)
    board.trip_at = board.samples + 1
    board.step(at_rest(240.0), 0.0)
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
        (([0.0, 0, 0], float("inf"), 240.0), b"not a finite number"),
        (([float("-inf"), 0, 0], 0.7, 240.0), b"not a finite number"),
    ],
)
def test_a_sample_that_no_routine_goes_on_with_is_a_fault(board, sample, finding):
    board.run("resistance", until=0.2)
    i, theta_e, u_dc = sample
    board.step(_core.Measurement(i=i, theta_e=theta_e, omega_m=0.0, u_dc=u_dc), 0.0)
    assert board.modes[-1] == "fault"
    assert board.all_off()
    told = board.library.reluctance_describe_finding(int(board.found["finding"][0]))
    assert finding in told
