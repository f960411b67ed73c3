"""The C interface as a library: compiled for a test, and called through ctypes."""

import ctypes
import os
import subprocess
from pathlib import Path

import numpy as np

from reluctance.base import toolchain

ROOT = Path(__file__).parents[2]
WASM = (
    "--target=wasm32-wasi -O2 -fno-exceptions -fno-rtti "
    "-fno-threadsafe-statics -fno-math-errno -fno-trapping-math -mbulk-memory -msign-ext "
    "-mnontrapping-fptoint -mexec-model=reactor -Wl,--strip-all -Wl,--export-dynamic "
    "-Wl,--export=malloc -Wl,--export=free"
).split()
WASM += [*toolchain.EXACT, *toolchain.STANDARD[".cpp"]]
SOURCE = "web/reluctance.cpp"
PARTS = {"drive": 0, "stage": 1, "controller": 2}
TABLES = (
    *("parameter", "input", "waveform", "period", "last_period", "measurement", "order", "leg"),
    "states",
)
MORE = 1

# Sensors with steps, a sample of delay and dead time: what a drive on a board has.
SENSORS = {
    "sensing.adc_bits": 12,
    "sensing.i_range_A": 200,
    "sensing.encoder_counts": 4096,
    "sensing.delay_samples": 1,
    "converter.dead_time_us": 1.5,
}


def compiled(out: Path, command=(), **kinds) -> Path:
    """The library of some kinds: laws="Ditc", machines="LeHuy", phases="3", precisions="double"."""
    flags = ["-O1", "-fvisibility=hidden", "-Iinclude", *chosen(kinds)]
    return toolchain.build([SOURCE], out, flags, folder=ROOT, what="the library", command=command)


def compiled_wasm(out: Path, clang: str, flags=(), **kinds) -> Path:
    """The same for a page."""
    command = [clang, *WASM, *flags, *chosen(kinds), "-Iinclude", SOURCE, "-o", str(out)]
    subprocess.run(command, check=True, cwd=ROOT)
    return out


def chosen(kinds) -> list[str]:
    return [f"-DSRM_{name.upper()}={value}" for name, value in kinds.items()]


def library(path: Path) -> ctypes.CDLL:
    """With the types of its functions."""
    lib = ctypes.CDLL(os.fspath(path))
    unit, size, table = ctypes.c_uint32, ctypes.c_size_t, ctypes.c_int32
    double, index, pointer = ctypes.c_double, ctypes.c_int32, ctypes.c_void_p
    for name, arguments in {
        "version": [],
        "create": [pointer, size, ctypes.c_int32, pointer],
        "free": [unit],
        "start": [unit],
        "reset": [unit],
        "sample": [unit],
        "count": [unit, table, pointer],
        "name": [unit, table, index, pointer],
        "find": [unit, table, ctypes.c_char_p, pointer],
        "get": [unit, table, index, pointer],
        "set": [unit, table, index, double],
        "read": [unit, table, pointer, size],
        "write": [unit, table, pointer, size],
        "advance": [unit, double, pointer],
        "take": [unit, table, pointer, size, pointer],
        "state_size": [unit, pointer],
        "save": [unit, pointer, size],
        "restore": [unit, pointer, size],
    }.items():
        getattr(lib, f"srm_{name}").argtypes = arguments
        getattr(lib, f"srm_{name}").restype = ctypes.c_int32
    lib.srm_last_error.restype = ctypes.c_char_p
    for name in ("text", "mode_text", "fault_text"):
        getattr(lib, f"srm_{name}").argtypes = [ctypes.c_int32]
        getattr(lib, f"srm_{name}").restype = ctypes.c_char_p
    return lib


class Unit:
    """A unit of the library; a status below zero is an error."""

    def __init__(self, lib: ctypes.CDLL, blob: bytes, part="drive"):
        self.lib = lib
        handle = ctypes.c_uint32()
        self.check(lib.srm_create(blob, len(blob), PARTS[part], ctypes.byref(handle)))
        self.handle = handle.value
        self.known: dict[str, list[str]] = {}

    def check(self, status: int) -> int:
        if status < 0:
            raise RuntimeError(f"{status}: {self.lib.srm_last_error().decode()}")
        return status

    def free(self):
        self.check(self.lib.srm_free(self.handle))

    def start(self):
        self.check(self.lib.srm_start(self.handle))
        return self

    def reset(self):
        self.check(self.lib.srm_reset(self.handle))

    def sample(self):
        self.check(self.lib.srm_sample(self.handle))

    def names(self, table) -> list[str]:
        if table not in self.known:
            count, name, of = ctypes.c_int32(), ctypes.c_char_p(), TABLES.index(table)
            self.check(self.lib.srm_count(self.handle, of, ctypes.byref(count)))
            found = []
            for j in range(count.value):
                self.check(self.lib.srm_name(self.handle, of, j, ctypes.byref(name)))
                found.append(name.value.decode())
            self.known[table] = found
        return self.known[table]

    def read(self, table):
        values = np.zeros(len(self.names(table)))
        of = TABLES.index(table)
        self.check(self.lib.srm_read(self.handle, of, values.ctypes.data, len(values)))
        return values

    def write(self, table, values):
        given = np.ascontiguousarray(values, float)
        of = TABLES.index(table)
        self.check(self.lib.srm_write(self.handle, of, given.ctypes.data, len(given)))

    def get(self, table, name):
        return self.read(table)[self.names(table).index(name)]

    def set(self, table, name, value):
        of, index = TABLES.index(table), self.names(table).index(name)
        self.check(self.lib.srm_set(self.handle, of, index, value))

    def take(self, table):
        rows = np.zeros((20000 if table == "waveform" else 1000, len(self.names(table))))
        count, of = ctypes.c_size_t(), TABLES.index(table)
        self.check(
            self.lib.srm_take(self.handle, of, rows.ctypes.data, len(rows), ctypes.byref(count))
        )
        return rows[: count.value].copy()

    def advance(self, t):
        """To time t; rows of the waveforms and periods that came up."""
        reached, waveforms, periods, status = ctypes.c_double(), [], [], MORE
        while status == MORE:
            status = self.check(self.lib.srm_advance(self.handle, t, ctypes.byref(reached)))
            waveforms.append(self.take("waveform"))
            periods.append(self.take("period"))
        assert reached.value == t
        return np.vstack(waveforms), np.vstack(periods)

    def save(self) -> bytes:
        size = ctypes.c_size_t()
        self.check(self.lib.srm_state_size(self.handle, ctypes.byref(size)))
        state = ctypes.create_string_buffer(size.value)
        self.check(self.lib.srm_save(self.handle, state, size.value))
        return state.raw

    def restore(self, state: bytes):
        self.check(self.lib.srm_restore(self.handle, state, len(state)))
