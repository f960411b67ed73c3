"""One claim of the paper: what it says, what the corrected model gives, what physics allows."""

from dataclasses import asdict, dataclass
from typing import Literal

Verdict = Literal["confirmed", "not confirmed", "cannot be checked"]
Value = float | str | None


@dataclass(frozen=True)
class Claim:
    """A row of the report. Numbers are in `unit`; None where there is none."""

    claim: str
    paper_says: Value
    model_gives: Value
    unit: str
    physical_limit: Value
    verdict: Verdict
    why: str

    def as_json(self) -> dict[str, Value]:
        """The row with six significant digits, fewer than any platform differs in."""
        return {key: _six_digits(value) for key, value in asdict(self).items()}


def verdict(holds: object) -> Verdict:
    """Of a claim that can be decided."""
    return "confirmed" if holds else "not confirmed"


def text(value: Value) -> str:
    """A value as people read it."""
    if value is None:
        return "–"
    if isinstance(value, str):
        return value
    return f"{value:.0f}" if abs(value) >= 1e5 else f"{value:.5g}"


def line(row: Claim) -> str:
    """A row without its reason, for a terminal."""
    paper, model, limit = map(text, (row.paper_says, row.model_gives, row.physical_limit))
    return _columns(row.verdict, paper, model, limit, row.unit, row.claim)


def _columns(verdict: str, paper: str, model: str, limit: str, unit: str, claim: str) -> str:
    return f"{verdict:<17} {paper:>11} {model:>9} {limit:>8} {unit:<10} {claim}"


HEADING = _columns("verdict", "paper", "model", "limit", "unit", "claim")


def _six_digits(value: Value) -> Value:
    if not isinstance(value, float):
        return value
    return 0.0 if abs(value) < 1e-6 else float(f"{value:.6g}")
