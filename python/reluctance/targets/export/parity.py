"""Target against desk: a recorded simulation replayed, and a simulation with the target inside."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from reluctance.base.errors import ParameterError
from reluctance.base.files import scratch
from reluctance.base.key_figures import Kpis
from reluctance.drive.drive import Drive
from reluctance.drive.run.simulate import simulate
from reluctance.targets.export.package import firmware
from reluctance.targets.export.recording import STEPS, Recording, desk_controller, record
from reluctance.targets.export.target import (
    Answers,
    Cpu,
    build,
    processor_in_the_loop,
    replay,
)

BOTH = "a comparison of the target with the desk, which has no protection here"


@dataclass(frozen=True)
class Parity:
    """A replay held against the desk."""

    steps: int
    different: int  # steps of which a bit of the commands differs
    first: int | None  # the first of them
    answers: Answers

    @property
    def exact(self) -> bool:
        """True where every bit of every command agrees."""
        return self.different == 0


def parity(program: Path, cpu: Cpu, recording: Recording) -> Parity:
    """Replay a recording on the emulated target and compare the commands bit for bit."""
    answers = replay(program, cpu, recording.samples)
    target, desk = answers.commands.view(np.uint32), recording.commands.view(np.uint32)
    if target.shape != desk.shape:
        raise ParameterError(f"the target answered {len(target)} of {len(desk)} samples")
    wrong = np.flatnonzero((target != desk).any(axis=1))
    return Parity(
        steps=len(desk),
        different=len(wrong),
        first=int(wrong[0]) if len(wrong) else None,
        answers=answers,
    )


def check_parity(drive: Drive, *, cpu: Cpu = "cortex-m7", steps: int = STEPS) -> Parity:
    """Export a drive, build it for the emulated target, and replay a simulation on it.

    Raises
    ------
    ParameterError
        If the drive has faults: what trips by them is the target alone.
    """
    drive.check_sound(BOTH)
    with scratch() as place:
        program = build(firmware(drive, place / "package").folder, cpu)
        return parity(program, cpu, record(drive, steps=steps))


def in_the_loop(
    drive: Drive,
    *,
    cpu: Cpu = "cortex-m7",
    until: float | None = None,
    progress: Callable[[float], None] | None = None,
) -> tuple[Kpis, Kpis]:
    """Key figures of a simulation with every control step on the emulated target, and without.

    Returns
    -------
    target, desk : Kpis
        The desk's controller computes in single precision too.

    Raises
    ------
    ParameterError
        If the drive has faults: what trips by them is the target alone.
    """
    drive.check_sound(BOTH)
    with scratch() as place:
        program = build(firmware(drive, place / "package").folder, cpu)
        with processor_in_the_loop(
            program,
            cpu,
            n_phases=drive.machine.n_phases,
        ) as controller:
            target = simulate(
                drive, until=until, record=None, progress=progress, controller=controller
            )
    desk = simulate(drive, until=until, record=None, controller=desk_controller(drive))
    return target.kpis, desk.kpis
