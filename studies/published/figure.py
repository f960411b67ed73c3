"""A published figure beside ours, and the table of them."""

from __future__ import annotations

import csv
import hashlib
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

HERE = Path(__file__).parent
COLUMNS = ("case", "figure", "unit", "kind", "published", "ours", "difference_pct", "inputs")


@dataclass(frozen=True)
class Figure:
    """One line of the table.

    Attributes
    ----------
    name, unit : str
    published, ours : float
    kind : str
        What `published` is: `measured` makes the comparison a validation; `computed` a numerical
        verification; `at least` and `at most` are requirements of the source.
    """

    name: str
    unit: str
    kind: str
    published: float
    ours: float

    def __post_init__(self) -> None:
        if self.kind not in ("measured", "computed", "at least", "at most"):
            raise ValueError(f"kind = {self.kind!r}")

    @property
    def difference_pct(self) -> float:
        """Of ours, over the published figure."""
        return 100 * (self.ours / self.published - 1)

    @property
    def met(self) -> bool:
        """Whether a requirement of the source is met."""
        if self.kind == "at least":
            return self.ours >= self.published
        return self.kind != "at most" or self.ours <= self.published


# What cases share, by the first word of their names.
SHARED = {"closed": ("closed_form_6_4",), "tanala": ("tanala_12_8", "tanala_sharing")}


def inputs(case: str) -> str:
    """A digest of what a case is computed from: its file, and the machine that some share."""
    shared = SHARED.get(case.split("_")[0], ())
    names = [f"{name}.py" for name in dict.fromkeys((case, *shared))]
    text = b"".join((HERE / name).read_bytes() for name in names)
    return hashlib.sha256(text).hexdigest()[:12]


def rows(case: str, figures: Iterable[Figure]) -> list[dict[str, str]]:
    """The lines of a case in the table."""
    return [
        {
            "case": case,
            "figure": figure.name,
            "unit": figure.unit,
            "kind": figure.kind,
            "published": f"{figure.published:.4g}",
            "ours": f"{figure.ours:.4g}",
            "difference_pct": f"{figure.difference_pct:.2f}",
            "inputs": inputs(case),
        }
        for figure in figures
    ]


def show(lines: Iterable[dict[str, str]]) -> None:
    """Prints a table."""
    for line in lines:
        print("  ".join(f"{line[name]:>14}" for name in COLUMNS[1:-1]))


def write(path: Path, lines: Iterable[dict[str, str]]) -> None:
    """Writes a table."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        writer.writeheader()
        writer.writerows(lines)
