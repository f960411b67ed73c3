"""Writes a comparison: table as CSV, JSON and Markdown, and the figure."""

import csv
import json
from pathlib import Path

from reluctance.base import figures
from reluctance.base.files import make_folder, write_together
from reluctance.explore.comparison.comparison import Comparison
from reluctance.explore.comparison.conditions import in_words
from reluctance.explore.comparison.table import as_json, flat, limit_line, markdown


def write(found: Comparison, folder: str | Path) -> list[Path]:
    """Writes compare.csv, compare.json, compare.md and compare.png.

    Returns
    -------
    list of Path
        The files, each complete.
    """
    from reluctance.explore.comparison.figure import (
        figure,  # Matplotlib takes half of the start-up time
    )

    folder = make_folder(Path(folder))
    text = "\n".join([*(f"- {line}" for line in in_words(found.point, found.f_target)), ""])
    text += f"- {limit_line(found)}\n\n{markdown(found)}"
    picture = figures.drawn(figure(found), ".png")
    files = {
        "compare.csv": lambda path: _csv(path, found),
        "compare.json": lambda path: path.write_text(json.dumps(as_json(found), indent=1) + "\n"),
        "compare.md": lambda path: path.write_text(text, encoding="utf-8"),
        "compare.png": lambda path: path.write_bytes(picture),
    }
    write_together({folder / name: put for name, put in files.items()})
    return [folder / name for name in files]


def save_figure(found: Comparison, path: Path) -> None:
    """Writes the figure alone; the ending chooses png, svg, pdf or html."""
    from reluctance.explore.comparison.figure import (
        figure,  # Matplotlib takes half of the start-up time
    )

    figures.save_figure(figure(found), path, title=f"{found.point.machine.name}: control laws")


def _csv(path: Path, found: Comparison) -> None:
    rows = flat(found)
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, fieldnames=list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
