"""A drive on a simulated bench: one commissioning routine on the plant, wired as somebody did."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from reluctance import _core
from reluctance.base.errors import ParameterError
from reluctance.base.units import to_si
from reluctance.drive.drive import Drive
from reluctance.drive.run.plant import loop_parts
from reluctance.machine.coupling import LETTERS
from reluctance.targets.export.commission_levels import Levels
from reluctance.targets.export.commission_levels import commission as routines_of

ROUTINES = ("wiring", "resistance", "alignment", "pulses")
CLAMPED = ("resistance", "pulses")  # those with a clamped rotor
DONE = 2  # Finding::done
RUNNING = 1
SLICE = 0.05  # of simulated time between two looks [s]
STUCK = 1e-9  # of simulated time in thousands of steps: these have become too short [s]
CREEP = 0.02  # rad/s: speed from which dry friction is all there


@dataclass(frozen=True)
class Wires:
    """How somebody has wired a drive. Left out: as the drive file means it.

    Attributes
    ----------
    phase : tuple of int
        The machine's phase that leg k drives.
    sensor : tuple of int
        The machine's phase whose current channel k shows.
    sign : tuple of int
        -1 where channel k shows it negative.
    direction : int
        -1 where the encoder counts against the rotation.
    zero_deg : float
        Electrical angle that the encoder shows at angle zero.
    """

    phase: tuple[int, ...] = ()
    sensor: tuple[int, ...] = ()
    sign: tuple[int, ...] = ()
    direction: int = 1
    zero_deg: float = 0.0

    def checked(self, n_phases: int) -> Wires:
        """The same with nothing left out.

        Raises
        ------
        ParameterError
            If it cannot be meant.
        """
        straight = tuple(range(n_phases))
        filled = replace(
            self,
            phase=self.phase or straight,
            sensor=self.sensor or straight,
            sign=self.sign or (1,) * n_phases,
        )
        for name in ("phase", "sensor"):
            given = getattr(filled, name)
            if sorted(given) != list(straight):
                raise ParameterError(f"wires.{name} = {given}, need each of {straight} once")
        if len(filled.sign) != n_phases or not {*filled.sign, self.direction} <= {1, -1}:
            raise ParameterError(
                f"wires.sign = {filled.sign}, direction = {self.direction}: need 1 or -1, a sign "
                "for each phase"
            )
        return filled


@dataclass(frozen=True)
class Held:
    """A phase that is held at a current while another is pulsed."""

    phase: int  # leg
    i_A: float


@dataclass(frozen=True)
class Found:
    """What a routine found.

    Attributes
    ----------
    done : bool
    text : str
        "done", or why not and what to do.
    time_s : float
        Simulated time.
    sensor, sign : tuple of int
        Of `wiring`: the channel that shows the current of leg k, and its sign.
    R : tuple of float
        Of `resistance` [ohm].
    place : tuple of int
        Of `alignment`: place of leg k among the phases as the angle rises.
    direction : int
        1 where the angle rises as legs 0, 1, ... follow each other, -1 where it falls, 0 where the
        legs are in another order.
    zero_deg, spread_deg : float
        Electrical angle that is shown where leg 0 is unaligned; greatest distance of a rest from
        its place.
    rows : ndarray, shape (n, 7)
        Of `pulses`: pulse, sample, mean voltage since the row before [V], current [A], electrical
        angle as shown [rad]; mean voltage and current of the held phase, or zeros.
    pair : str
        Of `pulses` beside a held phase: the pulsed and the held phase, as `ab`.
    """

    done: bool
    text: str
    time_s: float
    sensor: tuple[int, ...]
    sign: tuple[int, ...]
    R: tuple[float, ...]
    place: tuple[int, ...]
    direction: int
    zero_deg: float
    spread_deg: float
    rows: NDArray[np.float64]
    pair: str = ""


def commission(
    drive: Drive,
    routine: str,
    *,
    wires: Wires | None = None,
    levels: Levels | None = None,
    phase: int = 0,
    pulses: int = 8,
    held: Held | None = None,
    theta_e_deg: float = 40.0,
    clamped: bool | None = None,
    friction_Nm: float = 0.0,
) -> Found:
    """Run one commissioning routine on the drive's plant, with the sensors of its `[sensing]`.

    Parameters
    ----------
    drive : Drive
    routine : {"wiring", "resistance", "alignment", "pulses"}
    wires : Wires, optional
        How the drive is wired.
    levels : Levels, optional
        By default those of `export.commission_levels.levels`.
    phase, pulses : int
        Leg and number of the pulses.
    held : Held, optional
        Another phase, and the current that it has during the pulses.
    theta_e_deg : float
        Electrical angle of the rotor at the start, and where it is clamped.
    clamped : bool, optional
        By default for `resistance` and `pulses`.
    friction_Nm : float
        Dry friction of a free rotor, besides that of the machine file.

    Raises
    ------
    ParameterError
        If the routine or a wire cannot be meant, or the plant cannot be simulated.
    """
    if routine not in ROUTINES:
        raise ParameterError(f"routine {routine!r}, need one of {', '.join(ROUTINES)}")
    n = drive.machine.n_phases
    wires = (wires or Wires()).checked(n)
    if not 0 <= phase < n or pulses < 1:
        raise ParameterError(f"phase = {phase}, pulses = {pulses}: need a phase and >= 1 pulse")
    pair = pair_of(phase, held, n)
    bench = _core.Bench(
        routines=routines_of(drive, levels),
        phase=wires.phase,
        sensor=wires.sensor,
        sign=wires.sign,
        direction=wires.direction,
        zero=to_si(wires.zero_deg, "deg"),
        routine=getattr(_core.Routine, routine),
        pulsed=phase,
        count=pulses,
        held=-1 if held is None else held.phase,
        i_held=0.0 if held is None else held.i_A,
    )
    parts = loop_parts(drive, -1.0)
    stands = routine in CLAMPED if clamped is None else clamped
    parts["shaft"] = rotor(drive, clamped=stands, friction=friction_Nm)
    parts["theta_m"] = to_si(theta_e_deg, "deg") / drive.machine.N_r
    loop = _core.Simulation(bench.controller, _core.SimulationParts(**parts))
    t = 0.0
    while bench.finding == RUNNING:
        before, t = t, loop.advance(t + SLICE)
        if t - before < STUCK:
            raise ParameterError(
                f"the simulation does not get past {t:.6g} s, where currents are "
                f"{', '.join(f'{i:.4g}' for i in loop.state()[0])} A: past the end of its tables "
                "the machine may be none; lower the currents of the routine"
            )
        loop.take_periods()  # a full table stops the loop
    found = bench.found()
    return Found(
        done=bench.finding == DONE,
        text=bench.text,
        time_s=found["samples"] * drive.control.T_s,
        sensor=tuple(found["sensor"]),
        sign=tuple(found["sign"]),
        R=tuple(found["R"]),
        place=tuple(found["place"]),
        direction=found["direction"],
        zero_deg=float(np.degrees(found["zero"])),
        spread_deg=float(np.degrees(found["spread"])),
        rows=bench.rows(),
        pair=pair,
    )


def pair_of(phase: int, held: Held | None, n_phases: int) -> str:
    """The letters of a pulsed and a held phase; empty where none is held.

    Raises
    ------
    ParameterError
        If they cannot be meant.
    """
    if held is None:
        return ""
    if not 0 <= held.phase < n_phases or held.phase == phase or not 0 < held.i_A < np.inf:
        raise ParameterError(
            f"held phase {held.phase} at {held.i_A:g} A, need another phase than {phase} and a "
            "current above 0"
        )
    return LETTERS[phase] + LETTERS[held.phase]


def write_pulses(path: str | Path, recordings: Sequence[Found], drive: Drive) -> None:
    """Write the recordings of `pulses` as `reluctance map identify` reads them.

    Raises
    ------
    ParameterError
        If one was not completed, or only some have a held phase.
    """
    for found in recordings:
        if not found.done:
            raise ParameterError(f"a recording was not completed: {found.text}")
    pairs = [found.pair for found in recordings]
    if not all(pairs) and any(pairs):
        raise ParameterError("recordings with and without a held phase, need files of their own")
    with Path(path).open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        beside = ("u_held_mean_V", "i_held_A", "pair") if any(pairs) else ()
        writer.writerow(["t_s", "u_mean_V", "i_A", "theta_m_deg", *beside])
        for found in recordings:
            for _, sample, u, i, theta_e, u_held, i_held in found.rows:
                t = sample * drive.control.T_s
                # The angle about zero, so that a clamp at zero does not show as a turn.
                turned = (theta_e + 1) % (2 * np.pi) - 1
                theta_m = np.degrees(turned) / drive.machine.N_r
                row = [f"{t:.9g}", f"{u:.7g}", f"{i:.7g}", f"{theta_m:.7g}"]
                if found.pair:
                    row += [f"{u_held:.7g}", f"{i_held:.7g}", found.pair]
                writer.writerow(row)


def rotor(drive: Drive, *, clamped: bool, friction: float = 0.0) -> _core.Shaft:
    """The rotor alone: clamped, or free with the friction of the machine file and a dry one."""
    return _core.Shaft(
        rotation=_core.Rotation.locked if clamped else _core.Rotation.turning,
        J=drive.machine.J_kgm2,
        B=drive.machine.B_Nms,
        load=(lambda omega: float(friction * np.tanh(omega / CREEP))) if friction else None,
    )
