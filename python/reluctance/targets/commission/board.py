"""The emulated board: an exported package on the emulated microcontroller, wired to a simulated
power stage, sensors and rotor. Every control period exchanges one sample and one answer."""

from __future__ import annotations

import re
import struct
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from math import prod
from pathlib import Path

import numpy as np

from reluctance import _core
from reluctance.base.errors import ParameterError
from reluctance.drive.drive import Drive
from reluctance.drive.run.events import MODES, evidence
from reluctance.drive.run.plant import loop_parts, precharged
from reluctance.drive.tables.supervision import Supervision
from reluctance.targets.commission.bench import ROUTINES, RUNNING, Held, Wires, rotor
from reluctance.targets.export.target import PHASE, Cpu, answering, build

NUMBERS = {name: n for n, name in enumerate(("none", *ROUTINES))}  # in reluctance_commission.h
PRECHARGE = Supervision.model_validate({"enable_s": 0.0, "precharge_ms": 100.0})
SLICE = 2e-3  # of simulated time between two looks [s]
WORDS = "".join(f"{prod(of.shape)}{of.base.char}" for of, *_ in (PHASE.fields or {}).values())
ORDER = struct.Struct("<" + WORDS.replace("V", "x"))  # of one leg: the columns of an order
NOTHING = (-1, 0, 0, -1, 0.0)  # begins: routine, phase, pulses, held phase and its current
ROW = ("pulse", "sample", "u_mean", "i", "theta_e", "u_held", "i_held")  # of a recording
OFF = [0.0] * len(_core.ORDER_COLUMNS)


@dataclass(frozen=True)
class Emulated:
    """A package, the processor to emulate, and what the board is connected to.

    `drive` is the machine, converter and sensors as they are; the package knows what was exported.
    """

    package: Path
    cpu: Cpu
    drive: Drive
    wires: Wires

    @cached_property
    def program(self) -> Path:
        """Built when it is first needed: values are judged before.

        Raises
        ------
        ParameterError
            If the package does not compile, or a tool is missing.
        """
        return build(self.package, self.cpu, "bench")


def emulated(package: str | Path, drive: Drive, wires: Wires, cpu: Cpu = "cortex-m7") -> Emulated:
    """The emulated board of a package.

    Raises
    ------
    ParameterError
        If the package has another number of phases or control period than the drive.
    """
    package = Path(package)
    header = next(package.glob("*_controller.h"), None)
    if header is None:
        raise ParameterError(f"{package} is no package of `reluctance export firmware`")
    text = header.read_text("utf-8")

    def number(name: str) -> float:
        found = re.search(rf"_{name} ([0-9.e+-]+)", text)
        if found is None:
            raise ParameterError(f"{header} does not define {name}; export the package again")
        return float(found[1])

    n, T_s = number("PHASES"), number("PERIOD_S")
    if int(n) != drive.machine.n_phases:
        raise ParameterError(
            f"{package} is for {n:g} phases, the drive has {drive.machine.n_phases}"
        )
    if not np.isclose(T_s, drive.control.T_s, rtol=1e-6):
        raise ParameterError(
            f"{package} has a control period of {T_s:g} s, the drive {drive.control.T_s:g} s; "
            "export it again"
        )
    return Emulated(package, cpu, drive, wires.checked(int(n)))


class Board:
    """One power cycle of the emulated board: what was asked for, shown, ordered and told.

    Attributes
    ----------
    enable, clear, tripped, commands : bool
        What the board is asked for; `commands`: new ones keep coming.
    reference : float
        With every command.
    spoil : callable, optional
        Changes what the sensors show, from then on: (currents, angle) to the same.
    modes : list of (float, str)
        The states that were entered, and when [s].
    fault : (float, int, str), optional
        When the board tripped [s], the status, and its text with the evidence.
    """

    def __init__(
        self,
        on: Emulated,
        answer: Callable[[bytes, int], bytes],
        *,
        theta_e_deg: float,
        clamped: bool,
    ) -> None:
        n = on.drive.machine.n_phases
        self._answer, self._wires, self._n = answer, on.wires, n
        self._tracked = on.drive.sensing.counted_angle  # the controller finds its speed itself
        self._record = struct.Struct(f"<4i{n + 5}f3iIf")
        self._told = _answer_type(n)
        self._leg_of = [on.wires.phase.index(k) for k in range(n)]
        self._start = NOTHING
        self._sequence = 0
        self.enable, self.clear, self.tripped, self.commands = True, False, False, True
        self.reference = 0.0
        self.spoil: Callable[[list[float], float], tuple[list[float], float]] | None = None
        self.modes: list[tuple[float, str]] = []
        self.fault: tuple[float, int, str] | None = None
        self.rows: list[tuple[float, ...]] = []  # of a recording
        self._records = False
        self.period, self.T_s = 0, on.drive.control.T_s
        self.gates = True  # the drivers may switch
        self.i_peak = 0.0  # greatest true current at a sample so far [A]
        self.last = np.zeros(1, self._told)[0]
        sensing = on.drive.sensing.model_copy(update={"delay_samples": 0})  # the board delays
        parts = loop_parts(on.drive.computed(sensing=sensing), -1.0)
        if on.drive.source.kind == "stiff":
            parts["source"] = precharged(on.drive, PRECHARGE)
        parts["theta_m"] = np.radians(theta_e_deg) / on.drive.machine.N_r
        parts["shaft"] = rotor(on.drive, clamped=clamped)
        controller = _core.controller_from(n, self._step)
        self._loop = _core.Simulation(controller, _core.SimulationParts(**parts))
        self.t = 0.0

    @property
    def mode(self) -> str:
        """The state of the drive."""
        return MODES[int(self.last["mode"])]

    @property
    def omega_m(self) -> float:
        """True speed [rad/s]."""
        return self._loop.state()[1]

    @property
    def text(self) -> str:
        """What the routine says."""
        return _text(self.last)

    def begin(
        self, routine: str, *, phase: int = 0, pulses: int = 1, held: Held | None = None
    ) -> None:
        """A commissioning routine begins in the next period."""
        beside = (-1, 0.0) if held is None else (held.phase, held.i_A)
        self._start = (NUMBERS[routine], phase, pulses, *beside)
        self._records = routine == "pulses"

    def run(self, most: float, until: Callable[[Board], bool] = lambda board: False) -> bool:
        """Runs for `most` seconds, or until something is true; false where it never was."""
        end = self.t + most
        while self.t < end:
            stop = min(end, self.t + SLICE)
            while self.t < stop:
                self.t = self._loop.advance(stop)
                self._loop.take_periods()  # a full table stops the loop
            if until(self):
                return True
        return False

    def _step(self, y: _core.Measurement, reference: float) -> list[float]:
        wires = self._wires
        self.i_peak = max(self.i_peak, *y.i)
        shown = [s * y.i[k] for s, k in zip(wires.sign, wires.sensor, strict=True)]
        angle = _core.wrap_float(wires.direction * y.theta_e + np.radians(wires.zero_deg))
        if self.spoil is not None:
            shown, angle = self.spoil(shown, angle)
        self._sequence += self.commands
        record = self._record.pack(
            *self._start,
            *shown,
            angle,
            0.0 if self._tracked else wires.direction * y.omega_m,
            y.u_dc,
            y.i_source,
            self.enable,
            self.clear,
            self.tripped,
            self._sequence,
            self.reference,
        )
        self._start = NOTHING
        told = self._answer(record, self._told.itemsize)
        self._take(told)
        if not self.gates:
            return [*OFF * self._n, 0.0]
        return [
            *(x for leg in self._leg_of for x in ORDER.unpack_from(told, leg * ORDER.size)),
            0.0,
        ]

    def _take(self, told: bytes) -> None:
        """Keeps what the board has done."""
        last = self.last = np.frombuffer(told, self._told)[0]
        t = self.period * self.T_s
        if not self.modes or self.modes[-1][1] != self.mode:
            self.modes.append((t, self.mode))
        if self.fault is None and last["status"] != 0:
            self.fault = (t, int(last["status"]), _evidence(last))
        if self._records and last["rows"] and last["finding"] == RUNNING and last["pulse"] >= 0:
            row = (last[name] for name in ROW)
            self.rows.append(tuple(float(value) for value in row))
        self.gates = bool(last["gate_enable"]) and last["status"] == 0 and not self.tripped
        self.period += 1


@contextmanager
def powered(
    on: Emulated,
    *,
    theta_e_deg: float = 40.0,
    clamped: bool = False,
) -> Iterator[Board]:
    """The board from power-up on: enabled, with commands that keep coming."""
    with answering(on.program, on.cpu) as answer:
        yield Board(on, answer, theta_e_deg=theta_e_deg, clamped=clamped)


def _evidence(last: np.void) -> str:
    """The fault in words, with its numbers."""
    told = (last[name] for name in ("status", "phase", "value", "limit"))
    return evidence(_text(last), *told)


def _text(last: np.void) -> str:
    return bytes(last["text"]).split(b"\0")[0].decode()


def _answer_type(n: int) -> np.dtype[np.void]:
    """bench_answer of emulated/bench.h."""
    each = (n,)
    return np.dtype(
        [
            ("order", PHASE, each),
            *((name, "<i4") for name in ("mode", "gate_enable", "precharged", "chopper")),
            *(("status", "<i4"), ("phase", "<i4"), ("value", "<f4"), ("limit", "<f4")),
            *(("age", "<u4"), ("rows", "<i4"), ("finding", "<i4"), ("progress", "<f4")),
            *(("sensor", "<i4", each), ("sign", "<i4", each), ("R", "<f4", each)),
            *(("place", "<i4", each), ("direction", "<i4"), ("zero", "<f4"), ("spread", "<f4")),
            *(("pulse", "<i4"), ("sample", "<i4"), ("u_mean", "<f4"), ("i", "<f4")),
            *(("theta_e", "<f4"), ("u_held", "<f4"), ("i_held", "<f4")),
            *(("offset", "<f4", each), ("text", "S128")),
        ]
    )
