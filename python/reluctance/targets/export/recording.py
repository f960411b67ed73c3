"""What a controller saw and answered in a simulation, in single precision."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from reluctance import _core
from reluctance.drive.drive import Drive
from reluctance.drive.run.simulate import simulate
from reluctance.targets.export.target import target_samples

STEPS = 20_000  # of a replay, by default


@dataclass(frozen=True)
class Recording:
    """The samples that a controller saw in a simulation, and its answers in single precision."""

    samples: NDArray[np.float32]  # (n, n_phases + 5): Measurement.columns, reference
    commands: NDArray[np.float32]  # columns as _core.step


def desk_controller(drive: Drive) -> _core.Controller:
    """The controller that the target will run, on the desk: in single precision."""
    control = drive.control.model_copy(update={"precision": "float"})
    return drive.computed(control=control).controller()


def record(drive: Drive, *, steps: int = STEPS) -> Recording:
    """Simulate a drive with its controller in single precision, for a number of control periods."""
    controller = desk_controller(drive)
    samples: list[list[float]] = []
    commands: list[list[float]] = []

    def step(y: _core.Measurement, reference: float) -> list[float]:
        answer = _core.step(controller, y, reference)
        samples.append([*y.columns, reference])
        commands.append(answer)
        return answer

    simulate(
        drive,
        until=(steps - 0.5) * drive.control.T_s,
        record=None,
        controller=_core.controller_from(drive.machine.n_phases, step),
    )
    seen, answers = target_samples(np.array(samples)), np.array(commands, np.float32)
    return Recording(samples=seen, commands=answers)
