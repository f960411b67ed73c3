"""What a package with a self-test holds: samples of a simulation, and the checksums that its tables
and the answers to these samples have."""

from __future__ import annotations

import zlib

import numpy as np
from numpy.typing import NDArray

from reluctance.drive.drive import Drive
from reluctance.targets.export.constants import Tables, literal
from reluctance.targets.export.recording import record
from reluctance.targets.export.target import PHASE

STEPS = 256  # stored samples, from the start of a simulation on
FILES = """
| `reluctance_self_test.h`, `self_test.cpp`, `self_test_data.hpp` | self-test at boot: tables and \
answers against those of the export |
| `emulated/self_test.cpp` | the self-test on the emulator |"""
TEXT = f"""
## Self-test

`reluctance_self_test` compares the CRC-32 of the tables with that of the export, runs the
controller on {STEPS} stored samples of a simulation, and compares the CRC-32 of its orders. Call it
before the control interrupt starts. `make` and CMake compile it; in another build, add
`self_test.cpp` and define `RELUCTANCE_SELF_TEST` for all files. `make self_test` also builds
`build/cortex-m7/self_test.elf`, which runs it on the emulator:

    qemu-system-arm -M mps2-an500 -nographic -monitor none -serial none \\
      -semihosting-config enable=on,target=native -icount shift=10,sleep=off \\
      -kernel build/cortex-m7/self_test.elf

The program prints nothing. Its exit code, which QEMU passes on, tells the result. Where QEMU
cannot start the program, it prints a line and ends with 1 as well.

| exit code | meaning |
|---:|---|
| 0 | tables and orders are those of the export |
| 1 | a table differs |
| 2 | the orders differ |
| 3 | both differ |
| 4 | the cycle counter stood still; tables and orders are not judged |
| 70 | the program crashed |
"""


def self_test_marks(self_test: bool) -> dict[str, str]:
    """The marks of the README of a package with a self-test; nothing for other packages."""
    files, text = (FILES, TEXT) if self_test else ("", "")
    return {"self_test_files": files, "self_test_text": text, "self_test_steps": str(STEPS)}


def stored_tables(tables: Tables) -> str:
    """The C++ of where the tables lie, and of their checksum."""
    rows = [f"{{{name}, {len(data)}}}" for name, data in tables.data.items()] or ["{nullptr, 0}"]
    crc = zlib.crc32(b"".join(data + bytes(-len(data) % 4) for data in tables.data.values()))
    return f"""#ifdef RELUCTANCE_SELF_TEST
struct StoredTable {{
  const void* at;
  std::uint32_t bytes;
}};
constexpr StoredTable stored_tables[] = {{{", ".join(rows)}}};
constexpr std::uint32_t tables_crc = 0x{crc:08X};
#endif
"""


def self_test_data(drive: Drive) -> str:
    """The text of self_test_data.hpp."""
    recording = record(drive, steps=STEPS)
    crc = zlib.crc32(_orders(recording.commands, drive.machine.n_phases).tobytes())
    rows = ",\n".join(
        f"    {{{', '.join(literal(float(x), 'sample') for x in row)}}}"
        for row in recording.samples
    )
    return f"""// Samples of a simulation, and the CRC-32 of its orders, from the export.
#pragma once

#include <cstdint>

#include "parameters.hpp"

namespace reluctance {{

/// Phase currents, angle, speed, dc-link voltage, current of the source, reference.
constexpr float self_test_samples[{len(recording.samples)}][{recording.samples.shape[1]}] = {{
{rows}}};
constexpr std::uint32_t self_test_orders_crc = 0x{crc:08X};

}}  // namespace reluctance
"""


def _orders(commands: NDArray[np.float32], n_phases: int) -> NDArray[np.void]:
    """Rows of _core.step as the words of the C structs, (n, n_phases)."""
    orders = np.zeros((len(commands), n_phases), PHASE)
    columns = iter(commands.T)
    for k in range(n_phases):
        for name in (name for name in PHASE.names or () if name != "padding"):
            of = orders[name][:, k]
            if of.ndim == 1:
                orders[name][:, k] = next(columns)
                continue
            for n in range(of.shape[1]):
                orders[name][:, k, n] = next(columns)
    return orders
