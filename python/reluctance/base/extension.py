"""Extension modules that share the types of `reluctance._core`, compiled on this computer."""

from __future__ import annotations

import hashlib
from collections.abc import Collection, Sequence
from functools import cache
from importlib.machinery import ExtensionFileLoader
from importlib.util import module_from_spec, spec_from_loader
from pathlib import Path
from types import ModuleType

from reluctance.base.errors import ParameterError
from reluctance.base.files import scratch
from reluctance.base.resources import resources

# Those of the core where nobody waits for the result (CMakeLists.txt).
FLAGS = "-O1 -fvisibility=hidden -fno-strict-aliasing -DNDEBUG".split()


def compile_extension(
    text: str, out: Path, *, what: str, flags: Sequence[str] = (), files: Collection[str] = ()
) -> None:
    """Compile an extension module in C++.

    Parameters
    ----------
    text : str
        Of its one file.
    out : Path
        The file to make.
    what : str
        That is compiled, for messages.
    flags : sequence of str
        Besides `FLAGS`.
    files : collection of str
        Names whose errors come first in a message.

    Raises
    ------
    ParameterError
        If a tool is missing, or with the compiler's first error.
    """
    import shutil  # here, as what it compiles with: for those who do
    import sysconfig

    from reluctance.base.toolchain import build

    try:
        import nanobind
    except ImportError:
        raise ParameterError(
            "nanobind is not installed: pip install 'reluctance[own-law]'"
        ) from None
    python = sysconfig.get_path("include")
    if not (Path(python) / "Python.h").is_file():
        raise ParameterError(f"no Python.h in {python}; on Debian: apt install python3-dev")
    source, library = nanobind.source_dir(), nanobind.include_dir()
    folders = (resources("include"), library, f"{library}/../ext/robin_map/include", python)
    include = [f"-isystem{folder}" for folder in folders]
    with scratch() as place:
        unit = "unit.cpp"
        (place / unit).write_text(text, "utf-8")
        made = build(
            [unit, f"{source}/nb_combined.cpp"],
            "unit.so",  # its objects lie beside it, not beside what is asked for
            [*FLAGS, *flags, *include],
            folder=place,
            what=what,
            files=files,
        )
        shutil.copyfile(made, out)


def load_extension(name: str, path: Path) -> ModuleType:
    """The module of this name in a file, whatever the file is called.

    Raises
    ------
    ImportError
        If it is none.
    """
    spec = spec_from_loader(name, ExtensionFileLoader(name, str(path)))
    assert spec is not None and spec.loader is not None
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@cache
def core_fingerprint() -> str:
    """Of the headers that such a module is compiled against: types must agree to the byte."""
    sha = hashlib.sha256()
    for folder in ("include", "bindings"):
        for path in sorted(resources(folder).rglob("*.hpp")):
            sha.update(path.name.encode() + b"\0" + path.read_bytes())
    return sha.hexdigest()[:16]
