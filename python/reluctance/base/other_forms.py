"""Forms of the core that `make run` leaves out, compiled when they are first asked for: 2, 5 and 6
phases, single precision, laws that learn or compute with pairs, environments (docs/adr/0018).

The core calls `load` (bindings/other_forms.hpp). What is made is kept beside other results
(base/cache.py).
"""

from __future__ import annotations

import hashlib
import re
import sys
import sysconfig
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from reluctance.base.cache import folder
from reluctance.base.errors import ParameterError
from reluctance.base.extension import compile_extension, core_fingerprint, load_extension
from reluctance.base.files import scratch, write_whole
from reluctance.base.resources import resources

MODULE = "other_forms"
BINDS = re.compile(r"^void (bind_\w+(?:<[\w:]+>)?)\(nb::module_", re.MULTILINE)  # its last one
SHARED = "called_machine.cpp"  # what such a file needs of the core


def load(file: str) -> None:
    """Adds the other forms of a file of the bindings to those that the core knows.

    Parameters
    ----------
    file : str
        As `law_edge_mpc.cpp`; its folder does not matter.

    Raises
    ------
    ParameterError
        If a tool is missing.
    """
    name = Path(file).name
    files = [resources("bindings") / each for each in (name, SHARED)]
    content = [core_fingerprint(), sysconfig.get_config_var("SOABI"), *map(Path.read_text, files)]
    digest = hashlib.sha256(" ".join(content).encode()).hexdigest()[:16]
    kept = folder() / f"{Path(name).stem}-{digest}.so"
    with _alone(kept.parent):
        with suppress(ImportError):  # absent, or damaged
            load_extension(MODULE, kept)
            return
        part = Path(name).stem.removeprefix("law_")
        print(f"compiling other forms of {part}, once: about 20 s", file=sys.stderr, flush=True)
        with scratch() as place:
            made = place / kept.name
            try:
                compile_extension(source(files), made, what=name)
            except ParameterError as fault:
                raise ParameterError(
                    f"a form of {part} is compiled when it is first asked for, and {fault}"
                ) from None
            with suppress(OSError, ParameterError):  # a cache that cannot be written
                write_whole(kept, lambda path: path.write_bytes(made.read_bytes()))
            load_extension(MODULE, made)


@contextmanager
def _alone(place: Path) -> Iterator[None]:
    """One process compiles, and the others wait for what it makes."""
    import fcntl

    try:
        place.mkdir(parents=True, exist_ok=True)
        lock = (place / f"{MODULE}.lock").open("a")
    except OSError:  # a cache that cannot be written
        yield
        return
    with lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield


def source(files: list[Path]) -> str:
    """The extension module of a file of the bindings, with what it needs of the core."""
    included = "\n".join(f'#include "{file}"' for file in files)
    binds = BINDS.findall(files[0].read_text("utf-8"))[-1]
    return f"""#define RELUCTANCE_FORMS other
{included}

NB_MODULE({MODULE}, m) {{
  using namespace bound;
  share_other_forms(m, false);
  {binds}(m);
}}
"""
