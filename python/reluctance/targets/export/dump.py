"""A dump of the firmware's recorder, read and checked. firmware/package/recorder.cpp writes it."""

from __future__ import annotations

import zlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from reluctance.base.errors import ParameterError
from reluctance.base.reading import reading
from reluctance.targets.export.target import PHASE

MAGIC, VERSION = 0x444C4552, 1
API = 3  # of reluctance_controller.h
NO_SAMPLE = 0xFFFFFFFF
MOST_PHASES = 6
HEADER = np.dtype(
    [
        *((name, "<u4") for name in ("magic", "version", "api", "fingerprint", "phases")),
        *((name, "<u4") for name in ("state_words", "record_words", "segments", "trigger")),
        *(("status", "<i4"), ("phase", "<i4"), ("value", "<f4"), ("limit", "<f4"), ("T_s", "<f4")),
    ]
)


def record_type(n_phases: int) -> np.dtype[np.void]:
    """One sample: what reluctance_run was given, what it ordered, and its status."""
    return np.dtype(
        [
            ("i", "<f4", (n_phases,)),
            *((name, "<f4") for name in ("theta_e", "omega_m", "u_dc", "i_source")),
            *((name, "<u4") for name in ("enable", "clear", "tripped", "sequence")),
            ("reference", "<f4"),
            ("order", PHASE, (n_phases,)),
            *((name, "<i4") for name in ("mode", "gate_enable", "precharged", "chopper")),
            ("status", "<i4"),
        ]
    )


@dataclass(frozen=True)
class Segment:
    """Samples in a row, and the state of the controller before the first of them."""

    first: int  # number of the first sample
    state: NDArray[np.uint32]
    records: NDArray[np.void]  # of record_type


@dataclass(frozen=True)
class Dump:
    """What a recorder held."""

    fingerprint: int
    n_phases: int
    state_words: int
    T_s: float  # [s]
    trigger: int | None  # number of its sample
    status: int  # of the fault that was the trigger; 0 where none was
    phase: int
    value: float
    limit: float
    segments: list[Segment]

    @property
    def samples(self) -> int:
        """How many there are."""
        return sum(len(s.records) for s in self.segments)


def read_dump(path: Path) -> Dump:
    """A dump from a file.

    Raises
    ------
    ParameterError
        If it cannot be read, is damaged, or of another version.
    """
    with reading(path, "a dump of the recorder"):
        return _dump(path, path.read_bytes())


def _dump(path: Path, data: bytes) -> Dump:
    if len(data) < HEADER.itemsize + 4 or len(data) % 4:
        raise ParameterError(f"{path}: {len(data)} bytes are no dump of the recorder")
    head = np.frombuffer(data, HEADER, 1)[0]
    if head["magic"] != MAGIC:
        raise ParameterError(f"{path} is no dump of the recorder: it does not begin with `RELD`")
    if zlib.crc32(data[:-4]) != int.from_bytes(data[-4:], "little"):
        raise ParameterError(f"{path} is damaged: its CRC-32 is wrong; take the dump again")
    for name, need in (("version", VERSION), ("api", API)):
        if head[name] != need:
            raise ParameterError(
                f"{path}: {name} {head[name]} of the dump, need {need}; read it with the release "
                "that exported the firmware"
            )
    n_phases, state_words = int(head["phases"]), int(head["state_words"])
    if not 1 <= n_phases <= MOST_PHASES:
        raise ParameterError(f"{path}: phases = {n_phases}, need 1 to {MOST_PHASES}")
    if not -1 <= head["phase"] < n_phases:
        raise ParameterError(f"{path}: phase = {head['phase']}, need -1 to {n_phases - 1}")
    record = record_type(n_phases)
    if head["record_words"] * 4 != record.itemsize:
        raise ParameterError(f"{path}: samples of {head['record_words']} words are unknown")
    return Dump(
        fingerprint=int(head["fingerprint"]),
        n_phases=n_phases,
        state_words=state_words,
        T_s=float(head["T_s"]),
        trigger=None if head["trigger"] == NO_SAMPLE else int(head["trigger"]),
        status=int(head["status"]),
        phase=int(head["phase"]),
        value=float(head["value"]),
        limit=float(head["limit"]),
        segments=_segments(path, data, int(head["segments"]), state_words, record),
    )


def _segments(
    path: Path, data: bytes, count: int, state_words: int, record: np.dtype[np.void]
) -> list[Segment]:
    found, at, end = [], HEADER.itemsize, len(data) - 4
    for _ in range(count):
        start = at + 8 + 4 * state_words
        if start > end:
            break
        first, n = np.frombuffer(data, "<u4", 2, at).tolist()
        if start + n * record.itemsize > end:
            break
        state = np.frombuffer(data, "<u4", state_words, at + 8)
        found.append(Segment(first, state, np.frombuffer(data, record, n, start)))
        at = start + n * record.itemsize
    if len(found) != count or at != end:
        raise ParameterError(f"{path}: its segments do not fill it; take the dump again")
    return found
