"""Code that a drive file names: `law = "python:my_law.py:MyLaw"` or `law = "cpp:my_law.so:MyLaw"`.

Such a law runs only with the user's word for it (`--trust`, `load(..., trust=True)`).
"""

from __future__ import annotations

import importlib.util
import sys
from dataclasses import dataclass
from importlib.machinery import ExtensionFileLoader, SourceFileLoader
from pathlib import Path
from types import ModuleType

from reluctance.errors import ParameterError

PYTHON, CPP = "python:", "cpp:"
COMPILED = "own_law"  # the module name of a compiled law, whatever its file is called

_loaded: dict[Path, tuple[int, ModuleType]] = {}  # compiled laws and their age: they load once


@dataclass(frozen=True)
class OwnCode:
    """A class or struct in a file."""

    kind: str  # PYTHON or CPP
    file: Path
    name: str

    def __str__(self) -> str:
        return f"{self.kind}{self.file}:{self.name}"


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


def trusted(law: str, folder: Path, trust: bool) -> str:
    """The same law with the file relative to a folder.

    Raises
    ------
    ParameterError
        If the user has not said that its code may run.
    """
    code = own_code(law, folder)
    if not trust:
        raise ParameterError(
            f"[control] law = {law!r} is code that would run; if you trust it, say so with "
            "--trust or load(..., trust=True)"
        )
    return str(code)


def module_of(code: OwnCode) -> ModuleType:
    """The module in the file of a law.

    Raises
    ------
    ParameterError
        If the file is not there or fails, with the kind of the fault.
    """
    if not code.file.is_file():
        raise ParameterError(f"[control] law = '{code}': no such file {code.file}")
    return _python(code.file) if code.kind == PYTHON else _compiled(code.file)


def _python(path: Path) -> ModuleType:
    name = f"reluctance own law {path.resolve()}"  # one module a file; dataclasses look it up
    spec = importlib.util.spec_from_loader(name, SourceFileLoader(name, str(path)))
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    try:
        spec.loader.exec_module(module)
    except Exception as fault:
        raise ParameterError(f"{path} failed with {one_line(fault)}") from fault
    return module


def _compiled(path: Path) -> ModuleType:
    path, age = path.resolve(), path.stat().st_mtime_ns
    if path in _loaded:
        if _loaded[path][0] != age:
            raise ParameterError(f"{path} was built anew after it was loaded; start Python again")
        return _loaded[path][1]
    spec = importlib.util.spec_from_loader(COMPILED, ExtensionFileLoader(COMPILED, str(path)))
    assert spec is not None and spec.loader is not None
    try:
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
    except ImportError as fault:
        raise ParameterError(
            f"{path} is not a compiled law ({one_line(fault)}); make it with `reluctance law build`"
        ) from fault
    _loaded[path] = (age, module)
    return module


def one_line(fault: BaseException) -> str:
    """The kind and text of an exception, on one line, with the place in the file that raised it."""
    trace = fault.__traceback__
    while trace is not None and trace.tb_next is not None:
        trace = trace.tb_next
    code = trace.tb_frame.f_code if trace is not None else None
    foreign = code is not None and code.co_filename.startswith(("<", __file__))
    where = f" at {Path(code.co_filename).name}:{trace.tb_lineno}" if code and trace else ""
    text = " ".join(str(fault).split())
    return f"{type(fault).__name__}: {text}{'' if foreign else where}"
