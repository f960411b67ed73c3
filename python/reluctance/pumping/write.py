"""Writes what a pumping system did: figures, tables, samples and the report, each file whole."""

import json
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd

from reluctance.base.figures import drawn as picture
from reluctance.base.files import make_folder, write_together, write_whole
from reluctance.pumping.figures import per, with_units
from reluctance.pumping.operate import Pumped, columns
from reluctance.pumping.report import figures, page

MOST_ROWS = 50_000  # of samples as text; more go to a .npz file
TABLES = {"days": "D", "months": "MS", "years": "YS"}


def write(found: Pumped, folder: str | Path) -> list[Path]:
    """Writes pump.json, days.csv, months.csv, years.csv, samples.csv (or .npz), the figures as
    PNG, and report.html.

    Returns
    -------
    list of Path
        The files, each complete.
    """
    folder = made(folder)
    drawn = figures(found)
    text = json.dumps(with_units(found), indent=1) + "\n"
    report = page(found, drawn)
    files: dict[str, Callable[[Path], None]] = {
        "report.html": partial(put_text, report),
        "pump.json": partial(put_text, text),
        **{f"{name}.csv": partial(_table, per(found, rule)) for name, rule in TABLES.items()},
        **_samples(found),
    }
    for name, figure in drawn.items():
        files[f"{name}.png"] = partial(put_bytes, picture(figure, ".png"))
    write_together({folder / name: put for name, put in files.items()})
    return [folder / name for name in files]


def made(folder: str | Path) -> Path:
    """The folder, made where it is missing.

    Raises
    ------
    ParameterError
        If it cannot be made.
    """
    return make_folder(Path(folder))


def write_text_whole(path: Path, text: str) -> None:
    """Writes a text file, whole or not at all."""
    write_whole(path, partial(put_text, text))


def put_bytes(content: bytes, path: Path) -> None:
    """As a file's writer: the bytes."""
    path.write_bytes(content)


def put_text(text: str, path: Path) -> None:
    """As a file's writer: the text."""
    path.write_text(text, encoding="utf-8")


def _table(table: pd.DataFrame, path: Path) -> None:
    table.to_csv(path, index_label="time", float_format="%.10g", lineterminator="\n")


def _samples(found: Pumped) -> dict[str, Callable[[Path], None]]:
    if len(found.t) <= MOST_ROWS:
        return {"samples.csv": partial(_table, pd.DataFrame(columns(found), index=found.t))}
    seconds = (found.t.tz_convert("UTC").tz_localize(None) - pd.Timestamp(0)).total_seconds()
    arrays = {"t_unix_s": np.asarray(seconds), **columns(found)}

    def put(path: Path) -> None:
        with path.open("wb") as file:
            np.savez_compressed(file, allow_pickle=False, **arrays)

    return {"samples.npz": put}
