"""The report on disk: figures, claims.json and one self-contained page."""

import io
import json
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from reluctance.base.files import check_folder, make_folder, write_together
from reluctance.paper.claim import Claim
from reluctance.paper.claims import claims
from reluctance.paper.figures import PICTURES
from reluctance.paper.page import page
from reluctance.paper.study import Grid, Study, study

DPI = 110


@dataclass(frozen=True)
class Report:
    """What was written where."""

    files: list[Path]
    claims: list[Claim]


def write(
    folder: Path,
    *,
    grid: Grid | None = None,
    progress: Callable[[float], None] = lambda share: None,
) -> Report:
    """Simulates, checks every claim and writes the report.

    All is computed before the first file is written, and each file appears when it is whole.

    Parameters
    ----------
    folder : Path
        Is made if it does not exist; other files in it stay.
    grid : Grid, optional
        How fine the sweeps are.
    progress : callable
        Is told the share that is done, 0 to 1.

    Raises
    ------
    ParameterError
        If the folder cannot be written to.
    """
    check_folder(folder)
    found = study(grid, progress=progress)
    rows = claims(found)
    contents = _contents(found, rows, progress)
    make_folder(folder)
    write_together({folder / name: partial(_put, content) for name, content in contents.items()})
    return Report(files=[folder / name for name in contents], claims=rows)


def _contents(
    found: Study, rows: list[Claim], progress: Callable[[float], None]
) -> dict[str, bytes]:
    """Every file of the report by its name."""
    images = {}
    for n, picture in enumerate(PICTURES):
        buffer = io.BytesIO()
        picture.draw(found).savefig(buffer, format="png", dpi=DPI, metadata={"Software": None})
        images[picture.name] = buffer.getvalue()
        progress(0.75 + 0.25 * (n + 1) / len(PICTURES))
    table = json.dumps([row.as_json() for row in rows], indent=2, allow_nan=False)
    return {
        **{f"{name}.png": image for name, image in images.items()},
        "claims.json": (table + "\n").encode(),
        "report.html": page(found, rows, images).encode(),
    }


def _put(content: bytes, path: Path) -> None:
    path.write_bytes(content)
