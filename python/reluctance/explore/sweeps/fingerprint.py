"""The hash of all that the key figures of a run depend on: the resolved drive and the version."""

from __future__ import annotations

import hashlib
import json
from functools import cache
from pathlib import Path

import reluctance
from reluctance.base.extension import core_fingerprint
from reluctance.base.files import is_file
from reluctance.drive.drive import Drive
from reluctance.explore.sweeps.own_imports import own_imports

ALGORITHM = 2  # raised when the same drive gives other key figures
DIGITS = 16  # bytes of a key: two of 1e12 drives share one with a probability of 1e-15


def fingerprint(drive: Drive, end: float) -> bytes:
    """The key of a run to `end` [s]. Values left to their defaults, and the contents of the files
    that the drive names, are part of it; its name is not.

    Examples
    --------
    >>> import reluctance as rl
    >>> drive = rl.load("examples/paper_rated.toml")
    >>> same = drive.with_values({"sensing.adc_bits": 0})  # the default
    >>> fingerprint(drive, 0.1) == fingerprint(same, 0.1) != fingerprint(drive, 0.2)
    True
    """
    sha = hashlib.sha256(json.dumps([ALGORITHM, end]).encode() + _program())
    for name, section in drive.sections().items():
        sha.update(b"\0" + name.encode() + b"\0" + section.model_dump_json().encode())
    for content in _contents(drive):
        sha.update(b"\0" + content)
    return sha.digest()[:DIGITS]


@cache
def _program() -> bytes:
    """The version, and the sources of the package: they change between versions."""
    sha = hashlib.sha256(f"{reluctance.__version__} {core_fingerprint()}".encode())
    folder = Path(reluctance.__file__).parent
    for path in sorted(folder.rglob("*.py")):
        sha.update(str(path.relative_to(folder)).encode() + b"\0" + path.read_bytes())
    return sha.digest()


def _contents(drive: Drive) -> list[bytes]:
    """Of the files that the tables name, and of what an own law imports."""
    named = [file for section in drive.sections().values() for file in section.files]
    files = [file for file in named if is_file(file)]
    imported = [path for file in files if file.suffix == ".py" for path in own_imports(file)]
    return [file.read_bytes() for file in (*files, *imported)]
