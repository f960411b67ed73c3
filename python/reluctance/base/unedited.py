"""Files that people edit: written again where nobody has edited them, refused where somebody has.

The first of the files ends with comments: a digest of its content, and of each file beside it. A
digest leaves such lines out, and does not depend on the ends of lines.
"""

import hashlib
import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from reluctance.base.errors import ParameterError
from reluctance.base.files import is_file, write_together

MARK = b"# As written by reluctance, which does not overwrite what was edited since:\n"
DIGEST = re.compile(rb"^# ([0-9a-f]{16}) ([^\n]+)\n", re.MULTILINE)


def check_unedited(first: Path, beside: Sequence[Path] = ()) -> None:
    """Raises ParameterError where one of these files is there and is not as it was written."""
    noted = _noted(_content(first)) if is_file(first) else {}
    for path in filter(is_file, (first, *beside)):
        if noted.get(path.name) != _digest(_content(path)):
            why = "has been edited" if path.name in noted else "exists, and may have been edited"
            theirs = [path, *filter(is_file, (first.with_name(name) for name in noted))]
            all_of = [*theirs, *filter(is_file, beside)] if path == first else [path]
            names = ", ".join(dict.fromkeys(p.name for p in all_of))
            raise ParameterError(f"{path} {why}; remove {names}, or choose another name")


def write_unedited(
    first: Path, text: str, beside: Mapping[Path, Callable[[Path], object]] | None = None
) -> None:
    """Writes a text file and the files beside it, all or none.

    Raises
    ------
    ParameterError
        If one of them is there and has been edited, or the disk does not take it.
    """
    beside = beside or {}
    check_unedited(first, list(beside))
    digests = {first.name: _digest(text.encode())}

    def noting(name: str, write: Callable[[Path], object]) -> Callable[[Path], None]:
        def put(path: Path) -> None:
            write(path)
            digests[name] = _digest(_content(path))

        return put

    def put(path: Path) -> None:
        lines = "".join(f"# {digest} {name}\n" for name, digest in digests.items())
        path.write_text(text + MARK.decode() + lines, encoding="utf-8")

    write_together(
        {path: noting(path.name, write) for path, write in beside.items()} | {first: put}
    )


def _content(path: Path) -> bytes:
    try:
        return path.read_bytes().replace(b"\r\n", b"\n")
    except OSError as fault:
        raise ParameterError(f"cannot read {path}: {fault.strerror}; choose another name") from None


def _noted(content: bytes) -> dict[str, str]:
    """Digests by the names of their files."""
    end = content.partition(MARK)[2]
    return {m[2].decode("utf-8", "replace"): m[1].decode() for m in DIGEST.finditer(end)}


def _digest(content: bytes) -> str:
    text, _, end = content.partition(MARK)
    return hashlib.sha256(text + DIGEST.sub(b"", end)).hexdigest()[:16]
