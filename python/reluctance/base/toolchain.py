"""C and C++ for this computer: which compiler, the flags that every result depends on, and a cache
of compiled files by their content where ccache is installed."""

from __future__ import annotations

import os
import re
import shlex
import shutil
from collections.abc import Collection, Sequence
from pathlib import Path
from subprocess import PIPE, STDOUT, Popen, TimeoutExpired

from reluctance.base.errors import ParameterError
from reluctance.base.files import end_group, noted, unfinished_groups

EXACT = ("-ffp-contract=off",)  # the same bits on every processor (decision 0003)
STANDARD = {".c": ("-std=gnu99",), ".cpp": ("-std=c++20",)}
SHARED = ("-shared", "-fPIC")
LIMIT = 900  # of a compiler; 15 s are usual [s]


def compiler() -> list[str]:
    """The command of the C++ compiler: CXX, as in `distcc g++`, else g++ or clang++, behind ccache
    where there is one.

    Raises
    ------
    ParameterError
        If there is none.
    """
    given = shlex.split(os.environ.get("CXX", ""))
    cache = ["ccache"] if shutil.which("ccache") else []
    found = given or [p for p in ("g++", "clang++") if shutil.which(p)][:1]
    if not found or shutil.which(found[0]) is None:
        raise ParameterError("no C++ compiler; on Debian: apt install g++; or set CXX")
    return found if given else [*cache, *found]


def build(
    sources: Sequence[str],
    out: str | Path,
    flags: Sequence[str] = (),
    *,
    folder: str | Path,
    what: str,
    link: Sequence[str] = SHARED,
    files: Collection[str] = (),
    command: Sequence[str] = (),
) -> Path:
    """Compile C and C++ side by side, and link a shared library.

    Parameters
    ----------
    sources : sequence of str
        Files, from the folder on. Their objects are made beside `out`.
    out : str or Path
        The library, from the folder on.
    flags : sequence of str
        Of the compiler, besides the standard of the language and `EXACT`.
    folder : str or Path
        In which the compiler runs. A path from there is the same in every copy of the folder, so
        that the cache knows the file again.
    what : str
        That is compiled, for messages.
    link : sequence of str
        Flags of the linker; () for a program.
    files : collection of str
        Names whose errors come first in a message; by default those of the sources.
    command : sequence of str
        The compiler; by default that of `compiler`.

    Raises
    ------
    ParameterError
        If there is no compiler, or with its first error.
    """
    objects = [f"{out}.{n}.o" for n in range(len(sources))]
    position = [flag for flag in link if flag == "-fPIC"]
    compile_with = command or compiler()
    commands = [
        [*compile_with, *_language(source), *EXACT, *position, *flags, "-c", source, "-o", made]
        for source, made in zip(sources, objects, strict=True)
    ]
    made_in = (Path(folder) / out).parent
    named = files or [Path(source).name for source in sources]
    try:
        _run(commands, folder, made_in, what, named)
        _run([[*compile_with, *link, *objects, "-o", str(out)]], folder, made_in, what, named)
    finally:
        for made in objects:
            (Path(folder) / made).unlink(missing_ok=True)
    return Path(folder) / out


def _language(source: str) -> Sequence[str]:
    suffix = Path(source).suffix
    return ("-x", "c", *STANDARD[suffix]) if suffix == ".c" else STANDARD[suffix]


def _run(
    commands: list[list[str]], folder: str | Path, made_in: Path, what: str, files: Collection[str]
) -> None:
    """Commands side by side, until all have ended. Their temporary files go where the result does,
    and they end with this process."""
    environment = {**os.environ, "TMPDIR": str(made_in.absolute())}
    running: list[Popen[str]] = []
    try:
        for c in commands:
            with noted():
                running.append(
                    Popen(
                        c,
                        stdout=PIPE,
                        stderr=STDOUT,
                        text=True,
                        cwd=folder,
                        env=environment,
                        process_group=0,
                    )
                )
                unfinished_groups.add(running[-1].pid)
        said = [process.communicate(timeout=LIMIT)[0] for process in running]
    except (OSError, TimeoutExpired) as fault:
        raise ParameterError(f"{commands[0][0]}: {fault}") from None
    finally:
        for process in running:
            if process.poll() is None:
                end_group(process.pid)
                process.wait()
            if process.stdout is not None:
                process.stdout.close()
            unfinished_groups.discard(process.pid)
    for process, text in zip(running, said, strict=True):
        if process.returncode != 0:
            raise ParameterError(f"{what} does not compile: {first_error(text, files)}")


def first_error(text: str, files: Collection[str]) -> str:
    """The first error that a compiler has in one of these files, or at all, and how many more."""
    errors = re.findall(r"^(\S+?:\d+):\d+: (?:fatal )?error: (.*)", text, re.MULTILINE)
    if not errors:
        return " ".join(text.split())[:300]
    place, what = next((e for e in errors if Path(e[0]).name.partition(":")[0] in files), errors[0])
    more = f" (and {len(errors) - 1} more)" if len(errors) > 1 else ""
    return f"{Path(place).name}: {what}{more}"
