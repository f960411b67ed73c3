"""An exported package as a library on the desk: the same C++, compiled for this computer."""

from __future__ import annotations

import ctypes
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from reluctance.base.toolchain import build
from reluctance.targets.export.dump import record_type

FLAGS = ("-O1", "-I.", "-Iinclude")
SOURCES = ("controller.cpp", "run_time.cpp", "recorder.cpp", "peripherals.cpp")


class DeskPackage:
    """A controller of an exported package that this computer runs."""

    def __init__(self, folder: Path, n_phases: int) -> None:
        """Compiles the package; it must have the prefix `reluctance`."""
        library = build(SOURCES, "package.so", FLAGS, folder=folder, what=folder.name)
        self._library = ctypes.CDLL(str(library))
        self.state_words = int(self._library.reluctance_state_words())
        self._controller = np.zeros(self.state_words, np.uint32)
        record = record_type(n_phases)
        self._answer = np.zeros(1, record)
        offset = {name: record.fields[name][1] for name in record.names or ()}  # type: ignore[index]
        self._given = [offset[name] for name in ("i", "enable")]
        base = self._answer.ctypes.data
        self._told = [ctypes.c_void_p(base + offset[name]) for name in ("order", "mode")]

    def restore(self, state: NDArray[np.uint32]) -> None:
        """Puts a recorded state into the controller."""
        words = np.ascontiguousarray(state, "<u4")
        self._library.reluctance_restore(
            ctypes.c_void_p(self._controller.ctypes.data), ctypes.c_void_p(words.ctypes.data)
        )

    def run(self, given: NDArray[np.void]) -> NDArray[np.void]:
        """One call of reluctance_run on a recorded sample, shape (1,): the sample with the answer
        of this computer in its place."""
        self._answer[:] = given
        controller = ctypes.c_void_p(self._controller.ctypes.data)
        base = self._answer.ctypes.data
        self._library.reluctance_run(
            controller, *(ctypes.c_void_p(base + at) for at in self._given), *self._told
        )
        self._answer["status"] = self._library.reluctance_get_status(controller)
        return self._answer

    def describe(self, status: int) -> str:
        """A status in words."""
        told = self._library.reluctance_describe
        told.restype = ctypes.c_char_p
        text: bytes = told(status)
        return text.decode()
