"""The text of a machine file with a flux map: written new, or with a reason put into it."""

import re
import tomllib
from math import gcd
from pathlib import Path

from reluctance.base.errors import ParameterError
from reluctance.base.files import edit_input, write_text
from reluctance.machine.library import machine_from, placed_machine


def machine_text(
    *,
    name: str,
    source: str,
    map_name: str,
    N_s: int,
    N_r: int,
    R_ohm: float,
    i_max_A: float,
    J_kgm2: float,
    accepted_because: str | None,
    pairs: tuple[str, float] | None = None,
    notes: tuple[str, ...],
) -> str:
    """A machine file around a map that is stored beside it; `pairs` are the file of a pair table
    beside it, and the factor on that.

    Raises
    ------
    ParameterError
        If a number is out of range.
    """
    n_phases = phases_of(N_s, N_r)
    for key, value in (("R_ohm", R_ohm), ("J_kgm2", J_kgm2), ("i_max_A", i_max_A)):
        if not 0 < value < float("inf"):
            raise ParameterError(f"{key} = {value:g}, need > 0; pass --{key}")
    lines = [f"# Read from {source}.", *(f"# {note}" for note in notes), "[machine]"]
    lines += [
        f"name = {quoted(f'{N_s}/{N_r}, {n_phases} phases, {name}')}",
        f"source = {quoted(f'imported from {source}')}",
        'licence = "not stated"',
        f"N_s = {N_s}",
        f"N_r = {N_r}",
        f"n_phases = {n_phases}",
        f"R_ohm = {R_ohm!r}",
        f"i_max_A = {i_max_A!r}",
        f"J_kgm2 = {J_kgm2!r}",
        'model = "map"',
        f"map = {quoted(map_name)}",
        'angle_kind = "electrical"',
        'zero = "unaligned"',
    ]
    if pairs is not None:
        lines += [f"pairs = {quoted(pairs[0])}", f"pair_factor = {pairs[1]!r}"]
    if accepted_because:
        lines.append(f"accepted_because = {quoted(accepted_because)}")
    return "\n".join(lines) + "\n"


def phases_of(N_s: int, N_r: int) -> int:
    """The number of phases of a machine with these poles.

    Raises
    ------
    ParameterError
        If there is no such machine.
    """
    if N_s < 1:
        raise ParameterError(f"N_s = {N_s}, need the number of stator poles; pass --N_s")
    n_phases = N_s // gcd(N_s, N_r)
    if not 2 <= n_phases <= 6:
        raise ParameterError(
            f"{N_s}/{N_r} poles make {n_phases} phases, need 2 to 6; check --N_s and --N_r"
        )
    return n_phases


def accept_in(path: Path, reason: str) -> None:
    """Puts `accepted_because` into a machine file, in place of an earlier one; the rest of its text
    stays as it is.

    Raises
    ------
    ParameterError
        If the file could not be used with it either; then it stays as it was.
    """
    lines = path.read_text(encoding="utf-8").splitlines()
    keys = [line.partition("=")[0].strip() for line in lines]
    if "accepted_because" not in keys:
        place = keys.index("map") + 1
        lines.insert(place, "")
        keys.insert(place, "accepted_because")
    lines[keys.index("accepted_because")] = f"accepted_because = {quoted(reason)}"
    text = "\n".join(lines) + "\n"
    table = tomllib.loads(text)["machine"]
    machine_from(placed_machine(table, path.parent))
    edit_input(path)
    write_text(path, text)


def quoted(text: str) -> str:
    """A TOML string."""
    escaped = text.replace("\\", "\\\\").replace('"', '\\"')
    return '"' + re.sub(r"[\x00-\x1f\x7f]", " ", escaped) + '"'
