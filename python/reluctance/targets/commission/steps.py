"""The steps from the first power-up to the first spin, on the emulated board: as the README of a
package asks for them, each from a power cycle of its own."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from reluctance.base.errors import ParameterError
from reluctance.base.units import from_si, to_si
from reluctance.drive.guard.sequence_levels import speed_limit
from reluctance.drive.guard.trip_levels import protection
from reluctance.targets.commission.bench import CLAMPED, DONE, RUNNING, Found, Held, pair_of
from reluctance.targets.commission.board import ROW, Board, Emulated, powered
from reluctance.targets.commission.wiring import read_wiring

MOST_TIME = 400.0  # of a routine [s]; it gives up before
SPEEDS = ("speed", "pv")  # kinds of references that are speeds
GENTLE = 0.1  # of the greatest torque, or of the speed: the first spin
TURNING = 0.7  # of the speed: the trip tests of a drive with a speed reference
SPIN_TIME, SPIN_ROOM = 0.5, 1.5  # of the first spin [s]; over the time to the speed limit [1]
BRISK = 0.5  # of the speed that the drive works at: then something is pulled
AFTER = 0.05  # until the board must have tripped [s]

Progress = Callable[[float], None]


@dataclass(frozen=True)
class PowerUp:
    """What happened up to the state `ready`: the states with their times [s], the offsets that the
    board subtracts from its current readings [A], and what stopped it."""

    done: bool
    text: str
    states: list[tuple[float, str]]
    offset: tuple[float, ...]


@dataclass(frozen=True)
class Spin:
    """The first spin: states with their times [s], speeds [rpm] and the greatest current [A]. The
    speed is positive in the direction in which the board's angle rises."""

    done: bool
    text: str
    states: list[tuple[float, str]]
    speed_rpm: float  # at the end
    fastest_rpm: float
    i_peak: float  # of the currents at the samples


@dataclass(frozen=True)
class Trip:
    """One trip test: what was done, what the board said, and after how long.

    `began`: the drive turned, so that there was something to stop. `stays`: the fault stays while
    the drive is enabled; `clears`: it goes once its cause has gone and the drive is not enabled.
    """

    what: str
    began: bool
    status: int
    text: str
    late_us: float
    off: bool  # the drivers are off
    stays: bool
    clears: bool


def precharge(on: Emulated) -> PowerUp:
    """Precharge and offsets: no leg switches."""
    with powered(on) as board:
        board.begin("none")
        board.commands = False
        board.run(6.0, lambda b: b.mode in ("ready", "fault"))
        return PowerUp(
            board.mode == "ready", _said(board, "ready"), board.modes, _floats(board, "offset")
        )


def routine(
    on: Emulated,
    name: str,
    *,
    theta_e_deg: float = 40.0,
    phase: int = 0,
    pulses: int = 8,
    held: Held | None = None,
    progress: Progress = lambda part: None,
) -> Found:
    """One commissioning routine, with the rotor clamped or free as the routine needs it."""
    clamped = name in CLAMPED
    with powered(on, theta_e_deg=theta_e_deg, clamped=clamped) as board:
        return _routine(board, name, phase, pulses, held, progress)


def recordings(
    on: Emulated,
    *,
    angles: int = 31,
    pulses: int = 8,
    phase: int = 0,
    held: Held | None = None,
    whole_period: bool = False,
    progress: Progress = lambda part: None,
) -> list[Found]:
    """Voltage pulses with the rotor turned to, and clamped at, angles that the board shows: from
    unaligned to aligned, if the board knows its zero; over a whole period beside a held phase, or
    where `whole_period` asks for it, since the zero is not known.

    Raises
    ------
    ParameterError
        If one was not completed.
    """
    wiring, wires, seed, found = read_wiring(on.package), on.wires, on.drive.sensing.noise_seed, []
    first = 360 * phase / on.drive.machine.n_phases
    span = 360 * (1 - 1 / angles) if whole_period or held is not None else 180.0
    for n, shown in enumerate(np.linspace(first, first + span, angles).tolist()):
        counted = wiring.direction * (shown + float(np.degrees(wiring.zero)))
        true = wires.direction * (counted - wires.zero_deg)
        other = replace(on, drive=on.drive.with_values({"sensing.noise_seed": seed + n}))
        one = routine(other, "pulses", theta_e_deg=true, phase=phase, pulses=pulses, held=held)
        found.append(one)
        if not one.done:
            raise ParameterError(f"at {shown:g} deg electrical: {one.text}")
        progress((n + 1) / angles)
    return found


def spin(
    on: Emulated,
    *,
    reference: float | None = None,
    until: float | None = None,
    progress: Progress = lambda part: None,
) -> Spin:
    """The first spin, rotor free: a tenth of the torque, or of the speed; by default until a rotor
    without friction is at the speed limit."""
    fastest = 0.0
    asked = _gentle(on) if reference is None else _asked(on, reference)
    end = _time_to_limit(on, asked) if until is None else until
    if not end <= MOST_TIME:
        raise ParameterError(
            f"spin for {end:g} s, need at most {MOST_TIME:g} s; give another --until or --reference"
        )

    def watch(board: Board) -> bool:
        nonlocal fastest
        fastest = max(fastest, abs(board.omega_m))
        progress(board.t / end)
        return board.mode == "fault"

    with powered(on) as board:
        board.reference = asked
        board.run(end, watch)
        counts = on.wires.direction * read_wiring(on.package).direction
        speed = from_si(counts * board.omega_m, "rpm")
        text = _said(board, "run")
        if text == "done" and speed * asked <= 0:
            text = "it does not turn in the direction of the reference"
        fastest_rpm = from_si(fastest, "rpm")
        return Spin(text == "done", text, board.modes, speed, fastest_rpm, board.i_peak)


def trips(on: Emulated, *, reference: float | None = None) -> list[Trip]:
    """What must stop a turning drive, one power cycle each; none after one that did not begin."""
    part = TURNING if on.drive.reference.kind in SPEEDS else GENTLE
    asked = _gentle(on, part) if reference is None else _asked(on, reference)
    done: list[Trip] = []
    for what, cause in CAUSES.items():
        done.append(_trip(on, what, cause, asked))
        if not done[-1].began:
            break
    return done


def _trip(on: Emulated, what: str, cause: Callable[[Board, bool], None], asked: float) -> Trip:
    brisk = BRISK * on.drive.omega_nominal
    with powered(on) as board:
        board.reference = asked
        if not board.run(3.0, lambda b: abs(b.omega_m) > brisk and b.mode == "run"):
            why = (
                f"it does not reach {from_si(brisk, 'rpm'):.0f} rpm"
                if board.fault is None
                else _said(board, "run")
            )
            text = f"no test began: {why}"
            return Trip(what, False, 0, text, 0.0, not board.gates, False, False)
        at = board.period * board.T_s
        cause(board, True)
        board.run(AFTER + on.drive.protection.si["command_timeout"], lambda b: b.mode == "fault")
        if board.fault is None:
            return Trip(what, True, 0, "not found", 0.0, not board.gates, False, False)
        late, status, text = board.fault[0] - at, board.fault[1], board.fault[2]
        off = not board.gates
        board.clear = True
        board.run(5e-3)
        stays = board.mode == "fault"
        cause(board, False)
        board.enable = False
        clears = board.run(20e-3, lambda b: b.mode == "off")
        return Trip(what, True, status, text, 1e6 * late, off, stays, clears)


def _angle_plug(board: Board, pulled: bool) -> None:
    """The counter stands still."""
    held: list[float] = []

    def stand(i: list[float], theta_e: float) -> tuple[list[float], float]:
        held.append(theta_e)
        return i, held[0]

    board.spoil = stand if pulled else None


def _current_plug(board: Board, pulled: bool) -> None:
    """Channel 0 shows nothing."""
    board.spoil = (lambda i, theta_e: ([0.0, *i[1:]], theta_e)) if pulled else None


def _comparator(board: Board, pulled: bool) -> None:
    """The hardware trip: drivers off, the software told."""
    board.tripped = pulled


def _silence(board: Board, pulled: bool) -> None:
    """No command comes."""
    board.commands = not pulled


CAUSES: dict[str, Callable[[Board, bool], None]] = {
    "plug of the angle sensor pulled": _angle_plug,
    "plug of current sensor 0 pulled": _current_plug,
    "hardware trip": _comparator,
    "no more commands": _silence,
}


def _routine(
    board: Board, name: str, phase: int, pulses: int, held: Held | None, progress: Progress
) -> Found:
    def ended(b: Board) -> bool:
        progress(float(b.last["progress"]))
        return b.mode == "fault" or b.last["finding"] > RUNNING

    pair = pair_of(phase, held, len(board.last["sensor"]))
    board.begin(name, phase=phase, pulses=pulses, held=held)
    board.run(MOST_TIME, ended)
    last = board.last
    return Found(
        done=int(last["finding"]) == DONE,
        text=board.text if last["finding"] > RUNNING else _said(board, ""),
        time_s=board.period * board.T_s,
        sensor=tuple(int(k) for k in last["sensor"]),
        sign=tuple(int(k) for k in last["sign"]),
        R=_floats(board, "R"),
        place=tuple(int(k) for k in last["place"]),
        direction=int(last["direction"]),
        zero_deg=float(np.degrees(last["zero"])),
        spread_deg=float(np.degrees(last["spread"])),
        rows=np.array(board.rows).reshape(-1, len(ROW)),
        pair=pair,
    )


def _gentle(on: Emulated, part: float = GENTLE) -> float:
    """Part of the greatest torque, or of the speed: in SI."""
    kind = on.drive.reference.kind
    if kind == "none":
        return 1.0
    most = on.drive.omega_nominal if kind in SPEEDS else on.drive.tau_max
    return part * most


def _asked(on: Emulated, reference: float) -> float:
    """A reference of the border: rpm, or N m."""
    if not np.isfinite(reference):
        raise ParameterError(f"--reference {reference:g}, need a finite number")
    return to_si(reference, "rpm") if on.drive.reference.kind in SPEEDS else reference


def _time_to_limit(on: Emulated, asked: float) -> float:
    """What a torque takes to the speed limit, with room; other references are there sooner [s]."""
    if on.drive.reference.kind != "torque" or asked == 0:
        return SPIN_TIME
    omega = speed_limit(on.drive, protection(on.drive))
    return SPIN_TIME + SPIN_ROOM * on.drive.machine.J_kgm2 * omega / abs(asked)


def _said(board: Board, wanted: str) -> str:
    """The fault that has ended it, or that it is where it has to be."""
    if board.fault is not None:
        return board.fault[2]
    return "done" if board.mode == wanted else f"the board stays in the state `{board.mode}`"


def _floats(board: Board, name: str) -> tuple[float, ...]:
    return tuple(float(value) for value in board.last[name])
