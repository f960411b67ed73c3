"""The arrays of numbers and texts in a .mat file of v5 to v7; all else in it is passed over.

A file is a head of 128 bytes and elements. An element is a type and a size of four bytes each, then
its data, up to a multiple of eight bytes; a small one has both in four bytes and its data in the
next four. A variable is an element of type 14 that holds elements: flags with the class, sizes,
name, data. Type 15 is a variable, compressed (MathWorks, MAT-File Format, 2019). Our own reader,
because the one of SciPy ends the process on some damaged files.
"""

import zlib
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from reluctance.base.errors import ParameterError

MOST_UNPACKED = 50_000_000  # bytes of a variable
HEAD = 128
MATRIX, COMPRESSED = 14, 15
TYPES = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
TEXTS = {4: "utf-16", 16: "utf-8", 17: "utf-16", 18: "utf-32"}
TEXT_CLASS, NUMBER_CLASSES = 4, range(6, 16)
COMPLEX = 0x0800  # among the flags


def read_arrays(path: Path) -> dict[str, NDArray[np.generic]]:
    """Arrays of float64 in their shapes, and texts in arrays without a dimension, by their names.

    Raises
    ------
    ParameterError
        If it is no such file, or has more than MOST_UNPACKED bytes in a variable.
    """
    return {name: array for name, array in _variables(path) if array is not None}


def passed_over(path: Path) -> list[str]:
    """Names of what is neither an array of numbers nor a text: structs, cells, objects."""
    return [name for name, array in _variables(path) if array is None and name]


def _variables(path: Path) -> Iterator[tuple[str, NDArray[np.generic] | None]]:
    data = path.read_bytes()
    order = {b"IM": "<", b"MI": ">"}.get(data[HEAD - 2 : HEAD])
    if order is None or data[HEAD - 4 : HEAD - 2] not in (b"\0\1", b"\1\0"):
        raise ParameterError("not a .mat file of v5 to v7; save with `save(name, '-v7')`")
    for kind, part in _elements(data[HEAD:], order):
        if kind == COMPRESSED:
            part = _unpacked(part)
            kind, part = next(_elements(part, order), (0, b""))
        if kind == MATRIX:
            yield _variable(part, order)


def _unpacked(data: bytes) -> bytes:
    unpack = zlib.decompressobj()
    found = unpack.decompress(data, MOST_UNPACKED + 1)
    if len(found) > MOST_UNPACKED:
        raise ParameterError(
            f"a variable has more than {MOST_UNPACKED / 1e6:g} MB unpacked; save the map alone"
        )
    return found


def _elements(data: bytes, order: str) -> Iterator[tuple[int, bytes]]:
    """Types and data, one after the other."""
    at = 0
    while at + 8 <= len(data):
        kind, size = (int(n) for n in np.frombuffer(data, f"{order}u4", 2, at))
        if kind >> 16:  # a small one
            kind, size, start, end = kind & 0xFFFF, kind >> 16, at + 4, at + 8
        else:
            start, end = at + 8, at + 8 + size
        if size > end - start or end > len(data):
            raise ParameterError(
                "the .mat file is damaged: an element is longer than the file; save it again"
            )
        yield kind, data[start : start + size]
        at = end if kind == COMPRESSED else (end + 7) & ~7


def _variable(data: bytes, order: str) -> tuple[str, NDArray[np.generic] | None]:
    """The name of a variable, and its array where it is one of numbers or a text."""
    parts = _elements(data, order)
    try:
        flags = int(_array(*next(parts), order)[0])
        shape = [int(n) for n in _array(*next(parts), order)]
        name = next(parts)[1].decode("ascii", "replace")
        kind = flags & 0xFF
        if kind == TEXT_CLASS:
            of, text = next(parts, (16, b""))
            coding = TEXTS[of].replace("16", "16-be" if order == ">" else "16-le")
            return name, np.array(text.decode(coding, "replace"))
        if kind not in NUMBER_CLASSES or flags & COMPLEX:
            return name, None
        values = _array(*next(parts), order)
    except (StopIteration, KeyError, IndexError):
        raise ParameterError(
            "the .mat file is damaged: a variable lacks a part; save it again"
        ) from None
    if min(shape, default=0) < 0 or np.prod(shape, dtype=object) != len(values):
        raise ParameterError(
            f"the .mat file is damaged: `{name}` has {len(values)} values for the sizes "
            f"{' x '.join(map(str, shape))}; save it again"
        )
    return name, values.astype(np.float64).reshape(shape, order="F")


def _array(kind: int, data: bytes, order: str) -> NDArray[np.generic]:
    """The numbers of an element."""
    of = np.dtype(order + TYPES[kind])
    return np.frombuffer(data, of, len(data) // of.itemsize)
