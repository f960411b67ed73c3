"""Read map files: text as a grid, in long form or as a sweep; .xlsx, .mat (v5 to v7), JSON."""

import csv
import json
from collections.abc import Mapping
from contextlib import AbstractContextManager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reluctance.base.errors import ParameterError
from reluctance.base.reading import MOST, is_number, numbers, read_text, reading
from reluctance.base.sheet import sheet_rows
from reluctance.machine.maps.cells import map_rows, text_rows, with_units
from reluctance.machine.maps.conventions import settled
from reluctance.machine.maps.inverse import EXCHANGED, is_inverse
from reluctance.machine.maps.mat_file import passed_over, read_arrays
from reluctance.machine.maps.raw import Column, RawMap, chosen
from reluctance.machine.maps.table import Array, FluxTable
from reluctance.machine.maps.variations import is_swept, swept

# Maps in the wild have 6 to 31 angles and 6 to 19 currents, some kilobytes.
MAX_BYTES = 20_000_000
MAP_COLUMNS = ("i_A", "theta_e_deg", "psi_Wb")  # of `write_map`
MOST_POLES = 1000
SCATTERED = 0.5  # of a grid without a sample: of scattered ones nearly all, of a grid few
KINDS = {
    ".mat": ("a .mat file of v5 to v7", "save with `save(name, '-v7')`"),
    ".xlsx": ("an .xlsx file", "save the sheet again, or as CSV"),
    ".json": ("JSON", "export it again"),
}


def read_map(
    path: str | Path,
    *,
    N_r: int | None = None,
    angle_unit: str | None = None,
    angle_kind: str | None = None,
    zero: str | None = None,
    layout: str | None = None,
    aligned_at: float | None = None,
    names: Mapping[str, str] | None = None,
    torque: str | Path | None = None,
) -> FluxTable:
    """The flux table in a file, brought into the project's convention.

    Parameters
    ----------
    path : path
        .csv, .txt, .tsv or .xlsx (grid: first row and column are the axes; long: a header like
        `i_A, theta_deg, psi_Wb, tau_Nm`; sweep: a column for each current), .mat (v5 to v7) or
        .json.
    N_r : int
        Rotor poles; needed unless the file has `N_r`.
    angle_unit : {"deg", "rad"}, optional
    angle_kind : {"mechanical", "electrical"}, optional
    zero : {"unaligned", "aligned"}, optional
        Where the file's angle zero is.
    layout : {"currents_down", "angles_down"}, optional
        What runs down the rows of the flux table.
    aligned_at : float, optional
        The file's angle, in its own unit, at which the poles are aligned; instead of `zero`.
    names : mapping, optional
        Names in the file: keys "psi", "i", "theta", "tau". Of a file without a header the numbers
        of its columns: "1", "2", ...
    torque : path, optional
        A second file with the torque, as a grid or in long form, on the same axes.

    Returns
    -------
    FluxTable
        Its notes say what was inferred where nothing was stated.

    Raises
    ------
    ParameterError
        One line: what is wrong with the file and what to do.
    """
    path = Path(path)
    with _reading(path):
        raw = _read(path, dict(names or {}))
    if torque is not None:
        with _reading(Path(torque)):
            raw = with_torque(raw, _read(Path(torque), {}, torque=True))
    with _reading(path):
        table = settled(
            raw,
            N_r=N_r,
            angle_unit=angle_unit,
            angle_kind=angle_kind,
            zero=zero,
            layout=layout,
            aligned_at=aligned_at,
        )
        if raw.layout is not None and is_inverse(table.i, table.psi):  # by the file's own names
            raise ParameterError(EXCHANGED)
        return table


def _reading(path: Path) -> AbstractContextManager[None]:
    """The border to a map file, by its ending."""
    return reading(path, *KINDS.get(path.suffix.lower(), ("a flux map", "export it as CSV")))


def write_map(table: FluxTable, path: str | Path) -> None:
    """Write a table as long CSV in the project's convention; `read_map` gives it back."""
    head = [*MAP_COLUMNS] if table.tau is None else [*MAP_COLUMNS, "tau_Nm"]
    with Path(path).open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(head)
        for k, i in enumerate(table.i):
            for n, theta in enumerate(np.round(np.degrees(table.theta_e), 10)):
                row = [i, theta, table.psi[k, n]]
                if table.tau is not None:
                    row.append(table.tau[k, n])
                writer.writerow([repr(float(v)) for v in row])


def with_torque(raw: RawMap, other: RawMap) -> RawMap:
    """A flux map with the torque of another file, whichever way round its table is."""
    axes, theirs = (raw.rows, raw.columns), (other.rows, other.columns)
    for found, table in ((theirs, other.psi), (theirs[::-1], other.psi.T)):
        if all(len(a) == len(b) and np.allclose(a, b) for a, b in zip(axes, found, strict=True)):
            return replace(raw, tau=table)
    raise ParameterError("axes differ from those of the flux; export both on one grid")


def _read(path: Path, names: dict[str, str], *, torque: bool = False) -> RawMap:
    """What a file says; of a file with the torque, that in the place of the flux."""
    size = path.stat().st_size
    if size == 0:
        raise ParameterError("the file is empty; export the map again")
    if size > MAX_BYTES:
        raise ParameterError(
            f"the file has {size / 1e6:.0f} MB, need at most {MAX_BYTES / 1e6:.0f} MB; a map has "
            "some hundred samples: export every n-th current and angle"
        )
    suffix = path.suffix.lower()
    if suffix == ".mat":
        return _read_mat(path, names)
    if suffix == ".xlsx":
        return _from_rows(sheet_rows(path, map_rows), names, torque=torque)
    text = read_text(path, most_bytes=MAX_BYTES)
    if suffix == ".json":
        return _read_json(text, names)
    if suffix in (".csv", ".txt", ".tsv", ".tab", ".dat", ".out", ".lis", ".ans"):
        return _from_rows(text_rows(text), names, torque=torque)
    raise ParameterError(
        f"format `{suffix}` is unknown, need .csv, .txt, .xlsx, .mat or .json; export it as one"
    )


def _from_rows(rows: list[list[str]], names: dict[str, str], *, torque: bool) -> RawMap:
    """The map in rows of cells: long, a sweep, or a grid."""
    rows, names = with_units(rows, names)
    head = rows[0]
    if is_swept(head):
        return swept(rows)
    if names and all(map(is_number, head)):  # no header: columns have numbers
        head = [str(n) for n in range(1, len(head) + 1)]
        rows = [head, *rows]
    if names or not any(map(is_number, head[1:])):  # a grid has its second axis there
        return _long(rows, names, torque=torque)
    if len(rows) < 3 or len(rows[0]) < 3:
        raise ParameterError(
            f"the table is {len(rows)} x {len(rows[0])}, need a grid with axes in the first row "
            "and column, or columns named like i_A, theta_deg, psi_Wb"
        )
    columns = numbers([[cell] for cell in head[1:]], 0, "the first row", first=2)
    body = np.stack([numbers(rows[1:], n, f"column {n + 1}") for n in range(len(rows[0]))], axis=1)
    return RawMap(rows=body[:, 0], columns=columns, psi=body[:, 1:])


def _long(rows: list[list[str]], names: dict[str, str], *, torque: bool) -> RawMap:
    """The grid behind rows of samples in any order."""
    head = rows[0]
    value = "tau" if torque else "psi"
    found = chosen(head, names, "the header", (value, "i", "theta"))
    if "tau" not in found:
        _check_torque_name(head, {name for name, _ in found.values()})
    whole = "every row of its current or of its angle"
    data = {
        q: numbers(rows[1:], n := head.index(name), f"column {n + 1}", part=whole) * c.factor
        for q, (name, c) in found.items()
    }
    i, row = np.unique(data["i"], return_inverse=True)
    theta, place = np.unique(data["theta"], return_inverse=True)
    count = _count(row, place)
    if (count != 1).any():
        levels, level = np.unique(data[value], return_inverse=True)
        if not torque and (_count(level, place) == 1).all():  # current over even flux linkages
            over = np.empty((len(levels), len(theta)))
            over[level, place] = data["i"]
            angle = found["theta"][1]
            return replace(
                RawMap(levels, theta, over, None, "currents_down", None, angle.unit, angle.kind),
                inverse=True,
            )
        raise ParameterError(_no_grid(i, theta, count))
    grids: dict[str, Array] = {}
    for quantity in ("psi", "tau"):
        if quantity in data:
            grids[quantity] = np.empty(count.shape)
            grids[quantity][row, place] = data[quantity]
    angle = found["theta"][1]
    tau = grids.get("tau")
    flux = grids[value]
    extra = None if torque else tau
    return RawMap(i, theta, flux, extra, "currents_down", None, angle.unit, angle.kind)


def _no_grid(i: Array, theta: Array, count: NDArray[np.intp]) -> str:
    """Why samples are none, and what to do."""
    need = f"need every current at every angle once ({len(i)} x {len(theta)})"
    if (count == 0).mean() > SCATTERED:
        return (
            f"{count.sum()} samples have {len(i)} currents and {len(theta)} angles, {need}; they "
            "are scattered: interpolate them to the same currents at each angle, in their unit, "
            "and round the angles to those that were meant"
        )
    k, n = np.argwhere(count != 1)[0]
    at = f"the sample at {i[k]:g} A, angle {theta[n]:g}"
    if count[k, n] > 1:
        return f"{at} appears {count[k, n]} times, {need}; remove all but one of them"
    return f"{at} is missing, {need}; add it, or leave out its whole current or angle"


def _check_torque_name(head: list[str], read: set[str]) -> None:
    """A mistyped name of the torque would leave it out without a word."""
    from difflib import get_close_matches  # for mistakes only

    for name in head:
        low = name.lower()
        near = low.startswith(("tau", "torque")) or get_close_matches(low, ("tau_nm", "torque_nm"))
        if name not in read and near:
            raise ParameterError(
                f"column {name!r} is not known; for the torque write `tau_Nm`, else remove it"
            )


def _count(row: NDArray[np.intp], place: NDArray[np.intp]) -> NDArray[np.intp]:
    """How often each pair is there."""
    count = np.zeros((row.max(initial=-1) + 1, place.max(initial=-1) + 1), dtype=np.intp)
    np.add.at(count, (row, place), 1)
    return count


def _read_json(text: str, names: dict[str, str]) -> RawMap:
    data = json.loads(text)
    if not isinstance(data, dict):
        raise ParameterError(
            'need a JSON object like {"N_r": 4, "i_A": [...], "theta_deg": [...], '
            '"psi_Wb": [[...]]}'
        )
    arrays = {k: v for k, v in data.items() if isinstance(v, list)}
    raw = _from_arrays(arrays, names, "the object")
    return replace(raw, N_r=_poles(data.get("N_r")), zero=data.get("zero"))


def _read_mat(path: Path, names: dict[str, str]) -> RawMap:
    with path.open("rb") as file:
        magic = file.read(8)
    if magic.startswith(b"PK"):
        raise ParameterError("this is a zip archive, not a .mat file; unpack it first")
    if magic == b"\x89HDF\r\n\x1a\n":
        raise ParameterError("this is .mat v7.3, need v5 to v7; save with `save(name, '-v7')`")
    arrays = read_arrays(path)
    numbers_of = {k: v for k, v in arrays.items() if v.dtype.kind == "f" and v.size > 1}
    if not numbers_of and (others := passed_over(path)):
        raise ParameterError(
            f"no array of numbers, but {', '.join(f'`{name}`' for name in others)}; of a struct, "
            f"save the fields with `save('map.mat', '-struct', '{others[0]}', '-v7')`"
        )
    raw = _from_arrays(numbers_of, names, "the .mat file")
    poles = arrays.get("N_r", arrays.get("Nr"))
    if poles is not None:
        poles = poles.item() if poles.size == 1 else poles.tolist()
    return replace(raw, N_r=_poles(poles))


def _from_arrays(arrays: Mapping[str, Any], names: dict[str, str], what: str) -> RawMap:
    found = chosen(arrays, names, what)
    values: dict[str, Array] = {}
    for quantity, (name, known) in found.items():
        try:
            found_values = np.asarray(arrays[name], dtype=np.float64)
        except (TypeError, ValueError):
            raise ParameterError(
                f"`{name}` has ragged rows or cells that are no numbers; need a full table"
            ) from None
        if not (np.abs(found_values) <= MOST).all():
            raise ParameterError(
                f"`{name}` has a value that is not a finite number below {MOST:g}; mend it"
            )
        values[quantity] = found_values * known.factor
    i, theta = (_axis(values[q], values["psi"]) for q in ("i", "theta"))
    tau = values.get("tau")
    if tau is not None and tau.shape != values["psi"].shape:
        raise ParameterError(
            f"torque is {_size(tau)}, flux is {_size(values['psi'])}; export both on one grid"
        )
    return _named(i, theta, values["psi"], tau, found["theta"][1])


def _axis(values: Array, psi: Array) -> Array:
    """An axis; also as a matrix like that of the flux, constant along its other axis (meshgrid)."""
    if values.shape == psi.shape and min(values.shape) > 1:
        for rows in (values, values.T):
            if np.allclose(rows, rows[0], rtol=1e-9, atol=0.0):
                return np.asarray(rows[0])
    return values.ravel()


def _named(i: Array, theta: Array, psi: Array, tau: Array | None, angle: Column) -> RawMap:
    """A raw map whose axes are known by name; turned where only that fits."""
    if psi.shape not in ((len(i), len(theta)), (len(theta), len(i))):
        raise ParameterError(
            f"flux is {_size(psi)}, but there are {len(i)} currents and {len(theta)} angles; "
            "mend the axes"
        )
    if psi.shape != (len(i), len(theta)):
        psi, tau = psi.T, None if tau is None else tau.T
    elif len(i) == len(theta) and _zero_line(psi.T, i) and not _zero_line(psi, i):
        psi, tau = psi.T, None if tau is None else tau.T
    return RawMap(i, theta, psi, tau, "currents_down", None, angle.unit, angle.kind)


def _zero_line(psi: Array, i: Array) -> bool:
    """Whether the row at zero current carries no flux."""
    at_zero = psi[i == 0]
    return at_zero.size > 0 and bool(np.abs(at_zero).max() < 1e-6 * np.nanmax(np.abs(psi)))


def _poles(value: Any) -> int | None:
    if value is None:
        return None
    if not isinstance(value, int | float) or not 1 <= value <= MOST_POLES or value % 1:
        raise ParameterError(
            f"N_r = {value!r}, need a whole number of rotor poles, 1 to {MOST_POLES}"
        )
    return int(value)


def _size(values: Array) -> str:
    return " x ".join(map(str, values.shape))
