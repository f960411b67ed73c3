"""Compiles a law from outside the tree: `reluctance law build my_law.hpp MyLaw` makes my_law.so.

The file is an extension module that shares the types of `reluctance._core`. It holds the text of
the header, so that the firmware is exported from what was compiled.
"""

from __future__ import annotations

import json
import os
import posixpath
import re
import shlex
import shutil
import sysconfig
import tempfile
from collections.abc import Collection
from pathlib import Path
from subprocess import PIPE, STDOUT, Popen, TimeoutExpired

from reluctance.base.errors import ParameterError
from reluctance.base.files import check_ending, is_file, write_whole
from reluctance.base.resources import resources
from reluctance.drive.laws.compiled_law import core_fingerprint
from reluctance.drive.laws.own_code import COMPILED, below

# The firmware's warnings, as errors: what builds here builds for the target.
FLAGS = (
    "-std=c++20 -O1 -fPIC -fvisibility=hidden -fno-strict-aliasing -ffp-contract=off -DNDEBUG "
    "-Wall -Wextra -Wconversion -Wno-sign-conversion -Wdouble-promotion -Werror"
).split()
LIMIT = 600  # of the compiler; 9 s are usual [s]
LOCAL = re.compile(r'^[ \t]*#[ \t]*include[ \t]*"([^"\n]+)"', re.MULTILINE)


def build_law(header: str | Path, name: str, out: str | Path | None = None) -> Path:
    """Compile a control law in C++ so that drive files can name it.

    Parameters
    ----------
    header : str or Path
        Defines `template <srm::Machine M, int N> struct NAME`, outside of any namespace.
    name : str
        Of the struct.
    out : str or Path, optional
        The file to make; by default the header's name with .so, beside it.

    Returns
    -------
    Path
        The file, for `law = "cpp:FILE:NAME"`.

    Raises
    ------
    ParameterError
        If a tool is missing, or with the compiler's first error.
    """
    header = Path(header)
    out = header.with_suffix(".so") if out is None else Path(out)
    if not header.is_file():
        raise ParameterError(f"{header}: no such file")
    if not name.isidentifier():
        raise ParameterError(f"law `{name}`, need the name of a struct outside of any namespace")
    check_ending(out, {".so"})
    texts = local_headers(header)
    if not re.search(rf"\bstruct {name}\b", "".join(texts.values())):
        raise ParameterError(f"{header} has no `struct {name}`")
    write_whole(out, lambda path: _compile(header, name, texts, path))
    return out


def local_headers(header: Path) -> dict[str, str]:
    """The header and those that it includes from its own folder, by their names there.

    Raises
    ------
    ParameterError
        If one lies outside of that folder, or is no text.
    """
    texts: dict[str, str] = {}
    left = [header.name]
    while left:
        file = left.pop()
        path = header.parent / file
        if file in texts or not is_file(path):
            continue
        try:
            texts[file] = path.read_text("utf-8")
        except (OSError, UnicodeDecodeError) as fault:
            raise ParameterError(f"cannot read {path}: {fault}; need text in UTF-8") from None
        for name in LOCAL.findall(texts[file]):
            place = below(posixpath.join(posixpath.dirname(file), name))
            if not name.startswith("srm/"):  # of the core
                left.append(place)
    return texts


def compiler() -> list[str]:
    """The command of the C++ compiler: CXX, as in `ccache g++`, else g++ or clang++.

    Raises
    ------
    ParameterError
        If there is none.
    """
    given = shlex.split(os.environ.get("CXX", ""))
    found = given or [p for p in map(shutil.which, ("g++", "clang++")) if p][:1]
    if not found or shutil.which(found[0]) is None:
        raise ParameterError("no C++ compiler; on Debian: apt install g++; or set CXX")
    return found


def _compile(header: Path, name: str, texts: dict[str, str], out: Path) -> None:
    compile_with = compiler()
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
    with tempfile.TemporaryDirectory() as scratch:
        unit = Path(scratch) / "own_law.cpp"
        unit.write_text(_source(header.absolute(), name, texts), "utf-8")
        units = {f"{scratch}/law.o": str(unit), f"{scratch}/nb.o": f"{source}/nb_combined.cpp"}
        flags = [*compile_with, *FLAGS, *include, "-c"]
        _run([[*flags, text, "-o", made] for made, text in units.items()], header, texts)
        _run([[*compile_with, "-shared", *units, "-o", str(out)]], header, texts)


def _run(commands: list[list[str]], header: Path, texts: Collection[str]) -> None:
    """Commands side by side, until all have ended."""
    try:
        running = [Popen(c, stdout=PIPE, stderr=STDOUT, text=True) for c in commands]
        told = [process.communicate(timeout=LIMIT)[0] for process in running]
    except (OSError, TimeoutExpired) as fault:
        raise ParameterError(f"{commands[0][0]}: {fault}") from None
    for process, text in zip(running, told, strict=True):
        if process.returncode != 0:
            raise ParameterError(f"{header.name} does not compile: {first_error(text, texts)}")


def first_error(text: str, files: Collection[str]) -> str:
    """The first error that a compiler has in one of these files, or at all, and how many more."""
    errors = re.findall(r"^(\S+?:\d+):\d+: (?:fatal )?error: (.*)", text, re.MULTILINE)
    if not errors:
        return " ".join(text.split())[:300]
    place, what = next((e for e in errors if Path(e[0]).name.partition(":")[0] in files), errors[0])
    more = f" (and {len(errors) - 1} more)" if len(errors) > 1 else ""
    return f"{Path(place).name}: {what}{more}"


def _source(header: Path, name: str, texts: dict[str, str]) -> str:
    """The extension module. Text in JSON's quotes is text in C++'s, but for its \\u escapes."""
    quoted = {json.dumps(k): json.dumps(v, ensure_ascii=False) for k, v in texts.items()}
    headers = "\n".join(f"  headers[{file}] = {text};" for file, text in quoted.items())
    return f'''#include "{resources("bindings")}/own_law.hpp"
#include "{header}"

NB_MODULE({COMPILED}, m) {{
  bound::own_law<{name}>(m, "{name}", "{core_fingerprint()}");
  nanobind::dict headers;
{headers}
  m.attr("HEADERS") = headers;
}}
'''
