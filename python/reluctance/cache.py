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
        values: dict[str, Any] = {k: v if v.ndim else float(v) for k, v in arrays.items()}
        return kind(**values)
    except Exception:  # absent, or damaged in any of the ways a zip file can be: compute again
        result = compute()
    _store(path, asdict(result))  # type: ignore[call-overload]
    return result


def _store(path: Path, values: Mapping[str, Any]) -> None:
    """Write whole or not at all. A cache that cannot be written is no reason to fail."""
    import tempfile

    temporary = ""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile(dir=path.parent, delete=False) as file:
            temporary = file.name
            np.savez(file, **values)
        os.replace(temporary, path)
    except OSError:
        if temporary:
            Path(temporary).unlink(missing_ok=True)
