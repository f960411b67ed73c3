"""Results kept on disk under the hash of what they were computed from.

The folder is RELUCTANCE_CACHE, else XDG_CACHE_HOME/reluctance, else ~/.cache/reluctance. Deleting
it is always safe.
"""

import hashlib
import json
import os
from collections.abc import Callable, Mapping
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

Result = TypeVar("Result")
DIGEST = "sha256"  # the name of the digest among the arrays of a file


def folder() -> Path:
    """Where results are kept."""
    own, xdg = os.environ.get("RELUCTANCE_CACHE"), os.environ.get("XDG_CACHE_HOME")
    return Path(own) if own else (Path(xdg) if xdg else Path.home() / ".cache") / "reluctance"


def cached(
    kind: type[Result], inputs: list[Any], compute: Callable[[], Result], *, algorithm: int
) -> Result:
    """The result stored under the hash of its inputs; computed and stored where there is none.

    Parameters
    ----------
    kind : a dataclass of arrays and numbers.
    inputs : all that the result depends on: numbers, text, lists of them.
    compute : gives the result.
    algorithm : raised whenever the same inputs give other numbers.
    """
    content = json.dumps([algorithm, kind.__name__, *inputs], default=float)
    path = folder() / f"{kind.__name__}-{hashlib.sha256(content.encode()).hexdigest()}.npz"
    try:
        with path.open("rb") as file, np.load(file) as stored:
            arrays = {f.name: stored[f.name] for f in fields(kind)}  # type: ignore[arg-type]
            if str(stored[DIGEST]) != _digest(path, arrays):
                raise ValueError("changed since it was stored")
        values: dict[str, Any] = {k: v if v.ndim else float(v) for k, v in arrays.items()}
        return kind(**values)
    except Exception:  # absent, or damaged in any of the ways a zip file can be: compute again
        pass
    result = compute()  # here: a fault of it is none of the file
    _store(path, asdict(result))  # type: ignore[call-overload]
    return result


def _digest(path: Path, arrays: Mapping[str, np.ndarray[Any, Any]]) -> str:
    """Of what is stored, and of what it was computed from."""
    sha = hashlib.sha256(path.name.encode())
    for name in sorted(arrays):
        value = np.ascontiguousarray(arrays[name])
        sha.update(f"{name} {value.dtype.str} {arrays[name].shape} ".encode() + value.tobytes())
    return sha.hexdigest()


def _store(path: Path, values: Mapping[str, Any]) -> None:
    """Write whole or not at all. A cache that cannot be written is no reason to fail."""
    import tempfile

    temporary = ""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile(dir=path.parent, delete=False) as file:
            temporary = file.name
            arrays = {name: np.asarray(value) for name, value in values.items()}
            stored: dict[str, Any] = {**arrays, DIGEST: _digest(path, arrays)}
            np.savez(file, **stored)
        os.replace(temporary, path)
    except OSError:
        if temporary:
            Path(temporary).unlink(missing_ok=True)
