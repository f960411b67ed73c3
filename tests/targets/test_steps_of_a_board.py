"""The steps up to the first spin, on a board that does what each test says."""

from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from on_the_bench import ROOT, bench_drive

import reluctance as rl
from reluctance.drive.guard.sequence_levels import speed_limit
from reluctance.drive.guard.trip_levels import protection
from reluctance.targets.commission import Held, Wires, steps
from reluctance.targets.commission.bench import DONE, RUNNING
from reluctance.targets.commission.board import Emulated
from reluctance.targets.commission.wiring import Wiring

RPM = np.pi / 30
STATES = [(0.0, "precharge"), (0.1, "calibrate"), (0.2, "ready")]


class FakeBoard:
    """Walks through states that are given, one of them each time that it is watched."""

    T_s, period, i_peak, text, gates = 50e-6, 4000, 12.5, "found it", True

    def __init__(self, *course, finding=DONE):
        self.course, self.mode, self.fault, self.begun = list(course), "off", None, []
        self.modes, self.rows, self.t, self.omega_m = STATES, [[0.0] * len(steps.ROW)] * 2, 0.0, 0.0
        self.commands = self.enable = True
        self.tripped = self.clear = False
        self.spoil = self.reference = None
        self.last = {
            **{"progress": 0.25, "finding": finding, "sensor": [1, 0, 2], "sign": [1, -1, 1]},
            **{"R": [0.5, 0.6, 0.7], "place": [2, 0, 1], "direction": -1, "zero": np.pi / 6},
            **{"spread": np.pi / 180, "offset": [0.1, -0.2, 0.3]},
        }

    def begin(self, name, **given):
        self.begun.append((name, given))

    def run(self, until, watch=lambda board: False):
        self.ran = until
        while self.course:
            for name, value in self.course.pop(0).items():
                setattr(self, name, value)
            if watch(self):
                return True
        return False


@pytest.fixture
def board(monkeypatch):
    """Puts a board in place of the emulated one, and tells how it was powered."""

    def put(*boards, wiring=None):
        left, seen = list(boards), []

        @contextmanager
        def powered(on, **given):
            seen.append((on, given))
            yield left.pop(0) if len(left) > 1 else left[0]

        monkeypatch.setattr(steps, "powered", powered)
        found = wiring or Wiring((0, 1, 2), (0, 1, 2), (1, 1, 1))
        monkeypatch.setattr(steps, "read_wiring", lambda package: found)
        return seen

    return put


def emulated(drive=None, wires=None):
    drive = bench_drive("paper_6_4") if drive is None else drive
    return Emulated(Path("nowhere"), "cortex-m4", drive, wires or Wires())


def test_a_precharge_ends_ready_without_a_command(board):
    there = FakeBoard({"mode": "precharge"}, {"mode": "ready"}, {"mode": "never"})
    board(there)
    found = steps.precharge(emulated())
    assert found == steps.PowerUp(True, "done", STATES, (0.1, -0.2, 0.3))
    assert there.begun == [("none", {})] and not there.commands
    board(FakeBoard({"mode": "calibrate"}))
    found = steps.precharge(emulated())
    assert not found.done and found.text == "the board stays in the state `calibrate`"
    board(FakeBoard({"mode": "fault", "fault": (0.1, 3, "too much")}))
    assert steps.precharge(emulated()).text == "too much"


def test_a_routine_tells_what_the_board_has_found_and_after_how_long(board):
    parts = []
    seen = board(there := FakeBoard({"mode": "run"}))
    found = steps.routine(emulated(), "pulses", theta_e_deg=7, phase=1, progress=parts.append)
    assert found.done and found.text == "found it" and parts == [0.25]
    assert found.time_s == pytest.approx(4000 * 50e-6) and found.R == (0.5, 0.6, 0.7)
    assert (found.sensor, found.sign, found.place) == ((1, 0, 2), (1, -1, 1), (2, 0, 1))
    assert found.direction == -1 and found.zero_deg == pytest.approx(30)
    assert found.spread_deg == pytest.approx(1) and found.rows.shape == (2, len(steps.ROW))
    assert seen[0][1] == {"theta_e_deg": 7, "clamped": True}
    assert there.begun == [("pulses", {"phase": 1, "pulses": 8, "held": None})]
    for name, clamped in (("alignment", False), ("wiring", False)):
        seen = board(FakeBoard({"mode": "run"}))
        steps.routine(emulated(), name)
        assert seen[0][1] == {"theta_e_deg": 40, "clamped": clamped}, name
    board(FakeBoard({"mode": "fault", "fault": (0.1, 3, "too much")}, finding=RUNNING))
    found = steps.routine(emulated(), "pulses")
    assert not found.done and found.text == "too much"


@pytest.mark.parametrize(
    ("phase", "held", "whole", "shown"),
    [
        (0, None, False, [0, 45, 90, 135, 180]),  # of a reluctance: the other half mirrors it
        (1, None, False, [120, 165, 210, 255, 300]),
        (0, Held(1, 2.0), False, [0, 72, 144, 216, 288]),  # a period, its end left out
        (1, None, True, [120, 192, 264, 336, 408]),  # the zero is not known
    ],
)
@pytest.mark.parametrize("counts", [1, -1])
def test_pulses_are_recorded_at_angles_that_the_board_shows(
    board, monkeypatch, phase, held, whole, shown, counts
):
    """The rotor stands where wiring and wires turn the angle that is shown to."""
    asked, parts = [], []
    good = SimpleNamespace(done=True, text="")

    def routine(on, name, *, theta_e_deg, **given):
        asked.append((theta_e_deg, on.drive.sensing.noise_seed))
        assert (name, given) == ("pulses", {"phase": phase, "pulses": 3, "held": held})
        return good

    board(FakeBoard(), wiring=Wiring((0, 1, 2), (0, 1, 2), (1, 1, 1), counts, np.radians(10)))
    monkeypatch.setattr(steps, "routine", routine)
    on = emulated(wires=Wires(direction=-1, zero_deg=30))
    over = {"angles": 5, "pulses": 3, "phase": phase, "held": held, "whole_period": whole}
    found = steps.recordings(on, **over, progress=parts.append)
    assert found == [good] * 5 and parts == pytest.approx([0.2, 0.4, 0.6, 0.8, 1.0])
    assert [a for a, _ in asked] == pytest.approx([-(counts * (x + 10) - 30) for x in shown])
    first = on.drive.sensing.noise_seed
    assert [seed for _, seed in asked] == [first + n for n in range(5)]
    good.done, good.text = False, "no current"
    with pytest.raises(rl.ParameterError, match=f"^at {shown[0]:g} deg electrical: no current"):
        steps.recordings(on, **over)


def test_a_spin_is_a_tenth_of_the_torque_until_the_speed_limit(board):
    on = emulated()
    there = FakeBoard({"mode": "run", "omega_m": -20 * np.pi, "t": 1.0}, {"omega_m": 10 * np.pi})
    parts = []
    board(there)
    found = steps.spin(on, progress=parts.append)
    assert there.reference == pytest.approx(0.1 * on.drive.tau_max)
    assert found.done and found.speed_rpm == pytest.approx(300)
    assert found.fastest_rpm == pytest.approx(600) and found.i_peak == 12.5
    limit = speed_limit(on.drive, protection(on.drive))
    least = on.drive.machine.J_kgm2 * limit / there.reference  # without friction and load
    assert least < there.ran < 2 * least + 1 and parts[0] == pytest.approx(1 / there.ran)
    board(FakeBoard({"mode": "run", "omega_m": -10 * np.pi}))
    assert steps.spin(on).text == "it does not turn in the direction of the reference"
    board(FakeBoard({"mode": "run", "omega_m": -10 * np.pi}))
    turned = emulated(wires=Wires(direction=-1))
    assert steps.spin(turned).speed_rpm == pytest.approx(300)
    board(there := FakeBoard({"mode": "run", "omega_m": -1.0}))
    assert steps.spin(on, reference=-2.0, until=3.0).done
    assert (there.reference, there.ran) == (-2.0, 3.0)
    for given, told in (({"reference": np.inf}, "a finite number"), ({"until": 401.0}, "at most")):
        with pytest.raises(rl.ParameterError, match=told):
            steps.spin(on, **given)


def test_a_reference_of_speed_is_given_in_rpm(board):
    drive = rl.load(ROOT / "examples" / "paper_pump.toml")
    board(there := FakeBoard({"mode": "run", "omega_m": 1.0}))
    steps.spin(emulated(drive), reference=300.0)
    assert there.reference == pytest.approx(300 * RPM)
    board(there := FakeBoard({"mode": "run", "omega_m": 1.0}))
    steps.spin(emulated(drive))
    assert there.reference == pytest.approx(0.1 * drive.omega_nominal)


def test_what_must_stop_a_drive_is_told_with_its_delay(board):
    """Each from a power-up of its own: turning, a cause, a fault, cleared."""
    on = emulated()
    fast = 0.6 * on.drive.omega_nominal
    late = FakeBoard.period * FakeBoard.T_s + 150e-6

    def tripping():
        return FakeBoard(
            *({"mode": "start", "omega_m": fast}, {"mode": "run", "omega_m": 0.4 * fast}),
            *({"omega_m": fast}, {"mode": "fault", "fault": (late, 7, "gone"), "gates": False}),
        )

    class Clearing(FakeBoard):
        def run(self, until, watch=lambda board: False):
            if self.clear and not self.enable:
                self.mode = "off"
                return watch(self)
            return super().run(until, watch)

    boards = []
    for _ in steps.CAUSES:
        one = tripping()
        one.__class__ = Clearing
        boards.append(one)
    board(*boards)
    found = steps.trips(on)
    assert [trip.what for trip in found] == [*steps.CAUSES]
    for trip in found:
        assert trip.began and (trip.status, trip.text) == (7, "gone") and trip.off
        assert trip.late_us == pytest.approx(150) and trip.stays and trip.clears
    slow = FakeBoard({"mode": "run", "omega_m": 0.49 * on.drive.omega_nominal})
    board(slow)
    (none,) = steps.trips(on)
    assert not none.began and none.text.startswith("no test began: it does not reach")
    board(FakeBoard({"mode": "run", "omega_m": fast}))
    first, then = steps.trips(on, reference=3.0)
    assert first.began and first.text == "not found" and not then.began


def test_causes_act_on_what_their_name_says_and_end(board):
    there = FakeBoard()
    angle, current, trip, silence = steps.CAUSES.values()
    angle(there, True)
    assert there.spoil([1.0, 2.0], 0.3) == ([1.0, 2.0], 0.3)
    assert there.spoil([3.0, 4.0], 0.9) == ([3.0, 4.0], 0.3)
    current(there, True)
    assert there.spoil([3.0, 4.0], 0.9) == ([0.0, 4.0], 0.9)
    for cause in (angle, current):
        cause(there, False)
        assert there.spoil is None
    for name, cause, usual in (("tripped", trip, False), ("commands", silence, True)):
        cause(there, True)
        assert getattr(there, name) is not usual
        cause(there, False)
        assert getattr(there, name) is usual


@pytest.mark.parametrize("direction", [1, -1])
@pytest.mark.parametrize("turned", [1, -1])
@pytest.mark.parametrize(("zero", "found_deg"), [(0.3, 10.0), (0.1, -20.0), (6.2, 40.0), (5, -5)])
def test_an_alignment_of_corrected_angles_corrects_them_further(direction, turned, zero, found_deg):
    """What has been shown less the zero that was found, in the direction that was found."""
    before = Wiring((0, 1, 2), (0, 1, 2), (1, 1, 1), turned, zero)
    after = before.with_angle(direction, found_deg, (0, 1, 2))
    assert (after.leg, after.channel, after.sign) == (before.leg, before.channel, before.sign)
    assert 0 <= after.zero < 2 * np.pi
    counted = np.array([0.0, 1.0, 4.0])
    shown = before.direction * counted - before.zero
    right = direction * (shown - np.radians(found_deg))
    assert np.cos(after.direction * counted - after.zero - right) == pytest.approx(1.0)


def test_legs_in_another_order_take_their_sensors_along():
    before = Wiring((2, 0, 1), (1, 2, 0), (1, -1, 1), -1, 0.4)
    after = before.with_angle(0, 77.0, (1, 2, 0))  # phase 1 stands where phase 2 belongs, ...
    assert (after.leg, after.channel, after.sign) == ((1, 2, 0), (0, 1, 2), (1, 1, -1))
    assert (after.direction, after.zero) == (-1, 0.4)
    read = before.with_sensors((2, 0, 1), (-1, 1, 1))
    assert (read.channel, read.sign) == ((0, 1, 2), (-1, 1, -1))
    assert (read.leg, read.direction, read.zero) == (before.leg, before.direction, before.zero)
