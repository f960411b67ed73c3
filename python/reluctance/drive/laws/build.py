"""Compiles a law from outside the tree: `reluctance law build my_law.hpp MyLaw` makes my_law.so.

The file is an extension module that shares the types of `reluctance._core`. It holds the text of
the header, so that the firmware is exported from what was compiled.
"""

from __future__ import annotations

import json
import posixpath
import re
import warnings
from pathlib import Path

from reluctance.base.errors import Note, ParameterError
from reluctance.base.extension import compile_extension, core_fingerprint
from reluctance.base.files import check_ending, is_file, write_whole
from reluctance.base.resources import resources
from reluctance.drive.laws.own_code import COMPILED, below

# The firmware's warnings, as errors: what builds here builds for the target.
WARNINGS = ("-Wall -Wextra -Wconversion -Wno-sign-conversion -Wdouble-promotion -Werror").split()
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
    beside = out.with_suffix(".py")
    if is_file(beside):
        warnings.warn(
            f"`import {out.stem}` of Python takes {out.name} now, not {beside.name} beside it; "
            "where code imports that, give --out another name",
            Note,
            stacklevel=2,
        )
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


def _compile(header: Path, name: str, texts: dict[str, str], out: Path) -> None:
    text = _source(header.absolute(), name, texts)
    compile_extension(text, out, what=header.name, flags=WARNINGS, files=texts)


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
