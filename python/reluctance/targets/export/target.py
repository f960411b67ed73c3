"""The emulated microcontroller: build an exported package for it, and let it answer samples.

Needs gcc-arm-none-eabi (with its C++ headers) and qemu-system-arm on the path.
"""

from __future__ import annotations

import errno
import os
import shutil
import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO, Literal

import numpy as np
from numpy.typing import NDArray

from reluctance import _core
from reluctance.base.errors import ParameterError
from reluctance.base.files import scratch

Cpu = Literal["cortex-m4", "cortex-m7"]
MACHINES: dict[str, str] = {"cortex-m4": "mps2-an386", "cortex-m7": "mps2-an500"}
PACKAGES = (
    "gcc-arm-none-eabi libnewlib-arm-none-eabi libstdc++-arm-none-eabi-newlib qemu-system-arm"
)
COMPILER, EMULATOR = "arm-none-eabi-g++", "qemu-system-arm"
TIMEOUT = 300.0  # of a replay [s]
LAST = 2.0  # from the last sample until it must have ended by itself [s]
STOPPED = "the emulated target stopped before the simulation did"

# Words of the C structs (reluctance_controller.h), as the desk numbers the same columns.
PHASE = np.dtype(
    [
        ("leg", "i1", (5,)),
        ("gate", "i1"),
        ("chop", "i1"),
        ("padding", "V1"),
        ("t_edge", "<f4", (4,)),
        ("i_ref", "<f4"),
        ("i_band", "<f4"),
        ("theta_on", "<f4"),
        ("theta_off", "<f4"),
        ("i_lower", "<f4"),
        ("i_centre", "<f4"),
        ("i_upper", "<f4"),
        ("i_runaway", "<f4"),
    ]
)


@dataclass(frozen=True)
class Answers:
    """What the target returned."""

    status: NDArray[np.uint32]  # (n,)
    step: NDArray[np.uint32]  # (n,) instructions of reluctance_step, call included
    run: NDArray[np.uint32]  # (n,) of reluctance_run, in `run` until a fault
    commands: NDArray[np.float32]  # columns as _core.step
    fingerprint: int
    stack: int  # deepest, from the call of reluctance_run [B]


def known_cpu(name: str) -> Cpu:
    """The emulated processor of this name.

    Raises
    ------
    ParameterError
        If there is none.
    """
    for cpu in ("cortex-m4", "cortex-m7"):
        if name == cpu:
            return cpu
    raise ParameterError(f"--cpu {name}, need one of: {', '.join(MACHINES)}")


def build(folder: Path, cpu: Cpu, goal: Literal["replay", "bench"] = "replay") -> Path:
    """Compile the controller of a package and a program around it; warnings are errors.

    Raises
    ------
    ParameterError
        If a tool is missing or the compiler refuses.
    """
    _need(COMPILER, "make")
    done = subprocess.run(
        ["make", "--no-print-directory", "-s", "all", goal, f"CPU={cpu}"],
        cwd=folder,
        capture_output=True,
        text=True,
    )
    if done.returncode != 0:
        raise ParameterError(f"{folder} does not compile for {cpu}: {done.stderr.strip()}")
    return folder / "build" / cpu / f"{goal}.elf"


def replay(program: Path, cpu: Cpu, samples: NDArray[np.float32]) -> Answers:
    """Answers of the emulated target to recorded samples.

    Parameters
    ----------
    samples : ndarray, shape (n, n_phases + 5)
        Phase currents [A], angle [rad], speed [rad/s], dc-link voltage [V], current of the source
        [A], reference.
    """
    folder = program.parent
    (folder / "samples").write_bytes(np.ascontiguousarray(samples, "<f4").tobytes())
    run_program(program, cpu)
    return _answers((folder / "orders").read_bytes(), samples.shape[1] - 5)


def run_program(program: Path, cpu: Cpu) -> None:
    """Run a program of a package on the emulated target, in the folder that it lies in.

    Raises
    ------
    ParameterError
        If it ends with an error.
    """
    done = subprocess.run(
        _emulator(program.name, cpu),
        cwd=program.parent,
        capture_output=True,
        text=True,
        timeout=TIMEOUT,
    )
    if done.returncode != 0:
        raise ParameterError(f"the emulated {cpu} stopped: {(done.stdout + done.stderr).strip()}")


@contextmanager
def answering(program: Path, cpu: Cpu) -> Iterator[Callable[[bytes, int], bytes]]:
    """A program on the emulated target that answers records, over two pipes: called with a record
    and the size of its answer [B].

    Raises
    ------
    ParameterError
        If the target stops.
    """
    _need(EMULATOR)
    command = _emulator(str(program.resolve()), cpu)
    with scratch() as folder:
        for name in ("samples", "orders"):
            os.mkfifo(folder / name)
        emulator = subprocess.Popen(command, cwd=folder, stdout=subprocess.DEVNULL)
        try:
            with (
                open(_writing_end(folder / "samples", emulator), "wb", buffering=0) as samples,
                open(folder / "orders", "rb", buffering=0) as orders,
            ):

                def answer(record: bytes, size: int) -> bytes:
                    try:
                        samples.write(record)
                    except BrokenPipeError:
                        raise ParameterError(STOPPED) from None
                    return _read(orders, size)

                yield answer
        finally:
            try:
                emulator.wait(LAST)  # its samples have ended
            except subprocess.TimeoutExpired:
                emulator.terminate()
                emulator.wait()


@contextmanager
def processor_in_the_loop(program: Path, cpu: Cpu, *, n_phases: int) -> Iterator[_core.Controller]:
    """A controller of which every step runs on the emulated target, over two pipes.

    Raises
    ------
    ParameterError
        If the target stops before the simulation does.
    """
    order = order_type(n_phases)
    with answering(program, cpu) as answer:

        def step(y: _core.Measurement, reference: float) -> list[float]:
            sample = np.array([[*y.columns, reference]])
            told = np.frombuffer(answer(target_samples(sample).tobytes(), order.itemsize), order)
            row: list[float] = _columns(told, n_phases)[0].tolist()
            return row

        yield _core.controller_from(n_phases, step)


def target_samples(samples: NDArray[np.float64]) -> NDArray[np.float32]:
    """Samples as the target's sensors deliver them: single precision, angle within a turn."""
    single = samples.astype("<f4")
    angle = single.shape[1] - 5
    single[:, angle] = [_core.wrap_float(float(theta)) for theta in single[:, angle]]
    return single


def order_type(n_phases: int) -> np.dtype[np.void]:
    """One record of the file `orders`."""
    return np.dtype(
        [
            ("status", "<u4"),
            *(("step", "<u4"), ("run", "<u4")),
            ("phase", PHASE, (n_phases,)),
            ("tau_ref", "<f4"),
        ]
    )


def _answers(data: bytes, n_phases: int) -> Answers:
    orders = np.frombuffer(data[:-8], order_type(n_phases))
    fingerprint, stack = np.frombuffer(data[-8:], "<u4")
    return Answers(
        status=orders["status"].copy(),
        step=orders["step"].copy(),
        run=orders["run"].copy(),
        commands=_columns(orders, n_phases),
        fingerprint=int(fingerprint),
        stack=int(stack),
    )


def _columns(orders: NDArray[np.void], n_phases: int) -> NDArray[np.float32]:
    """Commands and torque reference as the rows of _core.step."""
    parts = []
    for k in range(n_phases):
        phase = orders["phase"][:, k]
        for name in (n for n in PHASE.names or () if n != "padding"):
            parts.append(phase[name].reshape(len(orders), -1).astype("<f4"))
    parts.append(orders["tau_ref"][:, None])
    return np.hstack(parts)


def _emulator(program: str, cpu: Cpu) -> list[str]:
    _need(EMULATOR)
    return [
        *(EMULATOR, "-M", MACHINES[cpu], "-nographic", "-monitor", "none", "-serial", "none"),
        *("-semihosting-config", "enable=on,target=native", "-icount", "shift=10,sleep=off"),
        *("-kernel", program),
    ]


def _writing_end(pipe: Path, emulator: subprocess.Popen[bytes]) -> int:
    """The pipe opened for writing once the target reads it; never waits for a dead emulator."""
    while emulator.poll() is None:
        try:
            file = os.open(pipe, os.O_WRONLY | os.O_NONBLOCK)
        except OSError as fault:
            if fault.errno != errno.ENXIO:
                raise
            time.sleep(0.002)
            continue
        os.set_blocking(file, True)
        return file
    raise ParameterError(STOPPED)


def _read(file: BinaryIO, size: int) -> bytes:
    data = b""
    while len(data) < size:
        part = file.read(size - len(data))
        if not part:
            raise ParameterError(STOPPED)
        data += part
    return data


def _need(*tools: str) -> None:
    for tool in tools:
        if shutil.which(tool) is None:
            raise ParameterError(f"`{tool}` is not installed; on Debian: apt install {PACKAGES}")
