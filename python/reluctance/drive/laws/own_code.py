"""Code that a drive file names: `law = "python:my_law.py:MyLaw"` or `law = "cpp:my_law.so:MyLaw"`.

Such a law runs only with the user's word for it (`--trust`, `load(..., trust=True)`).
"""

from __future__ import annotations

import posixpath
import sys
import warnings
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from math import isfinite
from pathlib import Path
from types import ModuleType
from typing import Annotated

from reluctance.base.errors import Note, ParameterError
from reluctance.base.extension import load_extension
from reluctance.base.files import is_file
from reluctance.base.schema import NamesFile, did_you_mean, number_hint
from reluctance.base.units import name_and_unit

PYTHON, CPP = "python:", "cpp:"
# Code, by its path.
NOT_OF_THE_USER = ("<frozen", "site-packages", "dist-packages", str(Path(__file__).parents[2]))
COMPILED = "own_law"  # the module name of a compiled law, whatever its file is called

_loaded: dict[Path, tuple[int, ModuleType]] = {}  # what has been loaded, and its age


@dataclass(frozen=True)
class OwnCode:
    """A class or struct in a file."""

    kind: str  # PYTHON or CPP
    file: Path
    name: str

    def __str__(self) -> str:
        return f"{self.kind}{self.file}:{self.name}"


class NamesCode(NamesFile):
    """Marks the name of a law that is code in a file."""

    def renamed(self, text: str, rename: Callable[[Path], Path]) -> str:
        code = own_code(text)
        return str(replace(code, file=rename(code.file)))

    def files(self, text: str) -> list[Path]:
        return [own_code(text).file]


CodeName = Annotated[str, NamesCode()]


def names_code(law: object) -> bool:
    """True where the name of a law is a file with code in it."""
    return isinstance(law, str) and law.startswith((PYTHON, CPP))


def own_code(law: str, folder: Path = Path()) -> OwnCode:
    """What `python:FILE:CLASS` or `cpp:FILE:STRUCT` names; the file relative to a folder.

    Raises
    ------
    ParameterError
        If the text has another form.
    """
    kind, _, rest = law.partition(":")
    file, _, name = rest.rpartition(":")
    if not file or not name.isidentifier():
        form = "python:FILE.py:CLASS" if kind + ":" == PYTHON else "cpp:FILE.so:STRUCT"
        raise ParameterError(f'[control] law = {law!r}, need "{form}"')
    return OwnCode(f"{kind}:", folder / file, name)


def same_code(law: str, other: str) -> bool:
    """True where two names mean the same class in the same file."""
    a, b = own_code(law), own_code(other)
    return (a.kind, a.name, a.file.resolve()) == (b.kind, b.name, b.file.resolve())


def refuse_untrusted(laws: Iterable[object], trust: bool) -> None:
    """Raises ParameterError where one of the laws is code and the user has not said that it may
    run."""
    for law in laws:
        if names_code(law) and not trust:
            raise ParameterError(
                f"[control] law = {law!r} is code that would run; if you trust it, say so with "
                "--trust or load(..., trust=True)"
            )


def module_of(code: OwnCode) -> ModuleType:
    """The module in the file of a law.

    Raises
    ------
    ParameterError
        If the file is not there or fails, with the kind of the fault.
    """
    if not is_file(code.file):
        raise ParameterError(f"[control] law = '{code}': no such file {code.file}")
    path, age = code.file.resolve(), code.file.stat().st_mtime_ns
    if path not in _loaded or _loaded[path][0] != age:
        if code.kind == CPP and path in _loaded:  # the interpreter would give the old one again
            raise ParameterError(f"{code.file} is newer than when it was loaded; restart Python")
        _loaded[path] = age, _python(path) if code.kind == PYTHON else _compiled(path)
    return _loaded[path][1]


def _python(path: Path) -> ModuleType:
    module = ModuleType(f"reluctance own law {path}")  # one a file; dataclasses look it up
    module.__file__ = str(path)
    sys.modules[module.__name__] = module
    try:
        exec(compile(path.read_bytes(), path, "exec"), vars(module))
    except (Exception, SystemExit) as fault:
        raise ParameterError(f"{path} failed with {of_the_user(fault)}") from fault
    return module


def _compiled(path: Path) -> ModuleType:
    try:
        module = load_extension(COMPILED, path)
    except ImportError as fault:
        raise ParameterError(
            f"{path} is not a compiled law ({of_the_user(fault)}); make it with "
            "`reluctance law build`"
        ) from fault
    _tell_edited(path, module)
    return module


def _tell_edited(path: Path, module: ModuleType) -> None:
    """A Note where a header beside a compiled law is no longer what was compiled."""
    headers: Mapping[str, str] = getattr(module, "HEADERS", {})
    for name, text in headers.items():
        header = path.parent / name
        with suppress(OSError, ValueError):
            if is_file(header) and header.read_text("utf-8") != text:
                first = next(iter(headers))
                warnings.warn(
                    f"{header.name} has been edited since {path.name} was built, which runs as it "
                    f"was; `reluctance law build {first} {module.NAME}` builds it again",
                    Note,
                    stacklevel=2,
                )


def check_numbers(given: Mapping[str, object], *, texts: bool) -> None:
    """Raises ParameterError for a number of [control] that is not finite, is a text, or is true or
    false with a unit. texts: the law may have keys that are."""
    for key, value in given.items():
        if isinstance(value, bool) and (unit := name_and_unit(key)[1]):
            raise ParameterError(f"[control] {key} = {str(value).lower()}, need a number in {unit}")
        if isinstance(value, str) and ((hint := number_hint(value, key)) or not texts):
            raise ParameterError(f"[control] {key} = {value!r}, need a number{hint}")
        numbers = value if isinstance(value, list | tuple) else [value]
        if any(isinstance(x, float) and not isfinite(x) for x in numbers):
            raise ParameterError(f"[control] {key} = {value}, need finite numbers")


def meant(key: str, name: str, wanted: Iterable[str], what: str) -> str:
    """The ending of an error about a key of [control] that a law does not take.

    Parameters
    ----------
    name : that the key is without its unit.
    wanted, what : names that the law takes, and what they are names of.
    """
    names = list(wanted)
    own, _, suffix = name.rpartition("_")
    if key in names:
        return f", which `{key}` becomes, in SI; name the {what} `{name}`"
    if own in names:
        return f", and `{suffix}` is no known unit (docs/extending.md); give `{own}`, in SI"
    return did_you_mean(name, names)


def below(header: str) -> str:
    """The path of a header that belongs to a law, from the folder of the law, without `..`.

    Raises
    ------
    ParameterError
        If it leaves that folder: an export would write it outside of its own.
    """
    path = posixpath.normpath(header)
    if path.startswith(("/", "../")) or "\\" in path or ":" in path:
        raise ParameterError(
            f'header "{header}" is outside of the folder of the law, need it there or in a folder '
            "below; copy it there and include it from there"
        )
    return path


def of_the_user(fault: BaseException) -> str:
    """The kind and text of an exception, and the line of the user's code that it came from."""
    where, trace = "", fault.__traceback__
    while trace is not None:
        file = trace.tb_frame.f_code.co_filename
        if not any(part in file for part in NOT_OF_THE_USER):
            where = f" at {Path(file).name}:{trace.tb_lineno}"
        trace = trace.tb_next
    return f"{type(fault).__name__}: {' '.join(str(fault).split())}{where}"
