"""Voltage pulses at standstill, as an oscilloscope or the commissioning routine records them."""

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from reluctance.base.columns import refuse_parted
from reluctance.base.errors import ParameterError
from reluctance.base.reading import is_number, numbers, read_text, reading
from reluctance.machine.maps.cells import any_rows
from reluctance.machine.maps.raw import BRACKETED, Column, column, stated_column, stated_unit
from reluctance.machine.maps.table import Array

MAX_BYTES = 100_000_000  # 31 angles, 8 pulses of 2000 rows, are 20 MB
TIME = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "second": 1.0, "sec": 1.0, "": 1.0}
VOLTAGE = {"v": 1.0, "mv": 1e-3, "uv": 1e-6, "kv": 1e3, "volt": 1.0, "volts": 1.0, "": 1.0}
MOST_HEAD = 100  # lines of settings that an oscilloscope writes above its table
U_STEM = "u|v|u_mean|voltage|volt"
FEWEST_ROWS = 8  # of a pulse
REST_ROWS = 4  # before a pulse: the fewest whose mean is an offset
LEFT = 0.03  # of a pulse's top: below this current its end is not used
LEFT_NOISE = 4.0  # ... nor below so many times its noise
ROUNDING = 1e-9  # of the greatest reading: no current, but what an offset leaves of itself


@dataclass(frozen=True)
class Pulse:
    """One voltage pulse at one rotor angle.

    Attributes
    ----------
    angle : float
        As written in the file.
    t, u, i : ndarray
        Time [s], voltage of the winding [V], current [A]. They begin at rest.
    mean : bool
        True where a row's voltage is the mean since the row before; else it is that of the instant.
    """

    angle: float
    t: Array
    u: Array
    i: Array
    mean: bool


@dataclass(frozen=True)
class Recording:
    """The pulses of some files, and what these say of their angles."""

    pulses: tuple[Pulse, ...]
    unit: str | None
    kind: str | None


@dataclass(frozen=True)
class Trace:
    """What a pulse shows from its start until its current is nearly gone.

    `volt_seconds` is the integral of u, `charge` that of i: psi = volt_seconds - R charge.
    """

    i: Array  # [A]
    volt_seconds: Array  # [Wb]
    charge: Array  # [A s]
    noise: float  # of the current, rms [A]
    rested: bool = True  # long enough before it for the offsets of u and i


def read_pulses(
    paths: Sequence[str | Path],
    *,
    angles: Sequence[float] = (),
    names: Mapping[str, str] | None = None,
    probe: float | None = None,
) -> Recording:
    """The pulses in some CSV files.

    A file has the columns `t_s`, `u_V` or `u_mean_V`, `i_A`, and an angle such as `theta_m_deg`. A
    pulse ends where the time falls back or the angle changes. Lines of settings may stand above the
    names of the columns and a row of units below, as oscilloscopes write them; start and increment
    may stand in the place of the times.

    Parameters
    ----------
    paths : sequence of paths
    angles : sequence of float
        One for each file, where the files have no column with the angle.
    names : mapping
        Names in the files: keys "t", "u", "i", "theta".
    probe : float, optional
        Of the current probe, where its column holds volts [A/V]: 10 of one with 100 mV/A.

    Raises
    ------
    ParameterError
        One line: what is wrong with which file, and what to do.
    """
    if angles and len(angles) != len(paths):
        raise ParameterError(
            f"{len(angles)} angles for {len(paths)} files, need one --angle for each file, in order"
        )
    pulses: list[Pulse] = []
    turn: Column | None = None
    for place, path in enumerate(map(Path, paths)):
        with reading(path, "a record of pulses", "export it as CSV"):
            angle = angles[place] if angles else None
            found, turn = _read(path, angle, dict(names or {}), probe)
        pulses += found
    return Recording(tuple(pulses), turn.unit if turn else None, turn.kind if turn else None)


def trace(pulse: Pulse) -> Trace:
    """Integrals over a pulse, by the trapezoid rule; offsets are the means before it, where enough
    rows are at rest.

    Raises
    ------
    ParameterError
        If the pulse does not start from rest, or has no current.
    """
    if not pulse.u.max() > 0:
        raise ParameterError("a pulse has no positive voltage; check the columns and the polarity")
    first = int(np.argmax(pulse.u > pulse.u.max() / 2))
    if first == 0:
        raise ParameterError("a pulse begins with its voltage on; record some rows before it")
    rest = slice(0, first - 1)
    offsets = first - 1 >= REST_ROWS
    i = pulse.i - (pulse.i[rest].mean() if offsets else 0.0)
    u = pulse.u - (pulse.u[rest].mean() if offsets else 0.0)
    noise = float(i[rest].std()) if offsets else 0.0
    top = first + int(i[first:].argmax())
    if not i[top] > max(LEFT_NOISE * noise, ROUNDING * np.abs(pulse.i).max()):
        raise ParameterError(
            f"a pulse reaches {i[top]:.3g} A with {noise:.2g} A of noise; check the column of the "
            "current and its polarity, or raise the current"
        )
    after = np.flatnonzero(i[top:] < max(LEFT * i[top], LEFT_NOISE * noise))
    end = top + int(after[0]) if len(after) else len(i)
    part = slice(first - 1, end)
    t, u, i = pulse.t[part], u[part], i[part]
    dt = np.diff(t)
    middle = u[1:] if pulse.mean else (u[1:] + u[:-1]) / 2
    return Trace(
        i=i[1:],
        volt_seconds=np.cumsum(dt * middle),
        charge=np.cumsum(dt * (i[1:] + i[:-1]) / 2),
        noise=noise,
        rested=offsets,
    )


def _read(
    path: Path, angle: float | None, names: dict[str, str], probe: float | None
) -> tuple[list[Pulse], Column | None]:
    rows = any_rows(read_text(path, most_bytes=MAX_BYTES))
    even = _even_times(rows[:MOST_HEAD])
    needed = ("u", "i") if even else ("t", "u", "i")
    needed = needed if angle is not None else (*needed, "theta")
    first, head, found = _table(rows, {q: n for q, n in names.items() if q in needed}, needed)
    if first >= len(rows):
        raise ParameterError("the file has no rows below the names of its columns; record it again")
    begin = rows[first : first + MOST_HEAD]
    if not any("." in cell for row in begin for cell in row):  # a scope's settings stand beside
        refuse_parted([head, *begin])
    values = {q: numbers(rows[first:], c, head[c]) for q, (c, _) in found.items()}
    u = found["u"][1].factor * values["u"]
    i = _amperes(head[found["i"][0]], found["i"][1].factor, probe) * values["i"]
    if even is None:
        t = found["t"][1].factor * values["t"]
    else:
        t = even[0] + even[1] * np.arange(len(u), dtype=np.float64)
    theta = np.full(len(t), angle) if angle is not None else values["theta"]
    new = (np.diff(t) <= 0) | (np.diff(theta) != 0)
    mean = "mean" in head[found["u"][0]].lower()
    pulses = []
    for part in np.split(np.arange(len(t)), np.flatnonzero(new) + 1):
        if len(part) < FEWEST_ROWS:
            raise ParameterError(
                f"data row {part[0] + 1}: the pulse there has {len(part)} rows, need "
                f"{FEWEST_ROWS} with a time that rises and one angle"
            )
        pulses.append(Pulse(float(theta[part[0]]), t[part], u[part], i[part], mean))
    return pulses, found["theta"][1] if angle is None else None


def _amperes(name: str, factor: float, probe: float | None) -> float:
    """What makes amperes of a column of currents. factor: of its unit, unless that is of a voltage.

    Raises
    ------
    ParameterError
        If it is of a voltage and there is no factor of a probe.
    """
    unit = _unit_of_volts(name)
    if probe is None and unit:
        raise ParameterError(
            f"the current `{name}` is in volts: give the factor of its probe, --probe_A_per_V 10 "
            "for 100 mV/A"
        )
    return (VOLTAGE[unit] if unit else factor) * (probe or 1.0)


def _unit_of_volts(name: str) -> str:
    """A unit of VOLTAGE in brackets, or behind an underscore: `CH2 [mV]`, `i_mV`; else nothing. A
    single V behind an underscore may be the name of a phase."""
    bracketed = BRACKETED.match(name)
    unit = bracketed["unit"] if bracketed else name.rpartition("_")[2]
    unit = unit.strip().lower()
    return unit if unit in VOLTAGE and (bracketed or unit != "v") else ""


def _table(
    rows: list[list[str]], names: dict[str, str], needed: Sequence[str]
) -> tuple[int, list[str], dict[str, tuple[int, Column]]]:
    """The place of the first row of numbers, the names of the columns, and the quantities. A row of
    units below the names belongs to them."""
    heads = [k for k, row in enumerate(rows[:MOST_HEAD]) if not is_number(row[0])]
    fault, told = None, _names_row(rows, heads)
    for k in heads or [0]:
        units = k + 1 < len(rows) and not any(map(is_number, rows[k + 1][: len(needed)]))
        of = rows[k + 1] if units else []
        head = [f"{name} [{unit}]" for name, unit in zip(rows[k], of, strict=False)]
        for taken, first in ((head, k + 2), (rows[k], k + 1 + units)):
            known = {
                q: taken[rows[k].index(n)] for q, n in names.items() if n in rows[k][: len(taken)]
            }
            try:
                return first, taken, _columns(taken, {**names, **known}, needed)
            except ParameterError as one:
                fault = one if fault is None or k == told else fault
    assert fault is not None
    raise fault


def _names_row(rows: list[list[str]], heads: list[int]) -> int:
    """Of the rows without numbers the last one, or the one before it where that has the units."""
    if len(heads) < 2:
        return 0
    cells = [cell.strip("[]() ").lower() for cell in rows[heads[-1]]]
    units = all(cell in TIME or cell in VOLTAGE or stated_unit(cell) for cell in cells)
    return heads[-2] if units else heads[-1]


def _even_times(rows: list[list[str]]) -> tuple[float, float] | None:
    """Start and increment that stand below these names [s]; None where a file has its times."""
    for row, below in pairwise(rows):
        places = {name.strip().lower(): k for k, name in enumerate(row)}
        if {"start", "increment"} <= set(places):
            start, step = (
                float(below[places[key]]) if places[key] < len(below) else np.nan
                for key in ("start", "increment")
            )
            if not step > 0:
                raise ParameterError("no number below `Increment`; export the record again")
            return start, step
    return None


def _without_unit(name: str) -> str:
    """Of a column: `CH1` of `CH1 [V]`."""
    unit = BRACKETED.match(name)
    return name[: unit.start("unit") - 1].rstrip() if unit else name


def _columns(
    head: list[str], names: dict[str, str], needed: Iterable[str]
) -> dict[str, tuple[int, Column]]:
    """The place of each quantity, and its factor to SI."""
    asked, names = names, {}
    for quantity, name in asked.items():
        alike = [name] if name in head else [h for h in head if _without_unit(h) == name]
        if len(alike) != 1:
            raise ParameterError(
                f"no column `{name}` for {quantity}; the header has {', '.join(head[:8])}"
            )
        names[quantity] = alike[0]
    found = {}
    for quantity in needed:
        given = names.get(quantity)
        for place, name in enumerate(head):
            known = _known(quantity, name, given == name) if given in (None, name) else None
            if known is not None:
                found[quantity] = (place, known)
                break
        else:
            raise ParameterError(
                f"no column for {quantity}, need t_s, u_V, i_A and theta_m_deg or the like; the "
                f"header has {', '.join(head[:8])}; say --name {quantity}=NAME"
                + (" or --angle for each file" if quantity == "theta" else "")
            )
    places = [place for place, _ in found.values()]
    for quantity, (place, _) in found.items():
        if places.count(place) > 1:
            raise ParameterError(
                f"`{head[place]}` is the column of {quantity} and of another quantity; the header "
                f"has {', '.join(head[:8])}: say which is which, --name {quantity}=NAME"
            )
    return found


def _known(quantity: str, name: str, stated: bool) -> Column | None:
    """The column as this quantity, if its name says so or the user does."""
    if quantity in ("i", "theta"):
        if stated:
            return stated_column(quantity, name)
        unit = _unit_of_volts(name) if quantity == "i" else ""
        try:
            known = column(re.sub(rf"(?i)[\s_(\[]+{unit}\W*$", "", name) if unit else name)
        except ParameterError:
            return None
        return known if known is not None and known.quantity == quantity else None
    stem, units = ("t|time|second", TIME) if quantity == "t" else (U_STEM, VOLTAGE)
    words = [w for w in re.split(r"[\s_\[\]()./]+", name.strip().lower()) if w]
    unit = words[-1] if len(words) > 1 and words[-1] in units else ""
    base = "_".join(words[:-1] if unit else words)
    bracketed = bool(unit) and name.strip()[-1] in "])"
    if not stated and not bracketed and not re.fullmatch(stem, base):
        return None
    return Column(quantity, units[unit])
