"""What the controller of a run has learned of its machine."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from reluctance import _core
from reluctance.base.arrays import FloatArray

QUIET = 0.2  # without a stroke that counts: it does not learn [s]
SMALL = 0.01  # of a parameter: a smaller change is none


@dataclass(frozen=True)
class Learned:
    """Resistance and flux map over time, over what the control believes."""

    t: FloatArray  # [s]
    R: FloatArray  # phase resistance [ohm]
    unaligned: FloatArray  # factors: of the unaligned inductance,
    aligned: FloatArray  # of the unsaturated inductance beyond it,
    saturated: FloatArray  # and of the flux linkage that saturates [1]
    strokes: FloatArray  # that counted so far
    asked: FloatArray  # greatest change that the last stroke asked for [1]
    t_since: FloatArray  # since that stroke, or since the start [s]

    @property
    def state(self) -> str:
        """At the end: `waits` where no stroke has ended for a while, `moves`, or `settled`."""
        if self.strokes[-1] == 0 or self.t_since[-1] > QUIET:
            return "waits"
        return "settled" if self.asked[-1] < SMALL else "moves"

    def figures(self) -> dict[str, Any]:
        """At the end, for `run --json`."""
        return {
            "R_ohm": float(self.R[-1]),
            **{n: float(getattr(self, n)[-1]) for n in ("unaligned", "aligned", "saturated")},
            "strokes": int(self.strokes[-1]),
            "state": self.state,
        }

    def text(self) -> str:
        """At the end, in one line."""
        f = self.figures()
        factors = ", ".join(f"{n} {f[n]:.3f}" for n in ("unaligned", "aligned", "saturated"))
        said = {
            "waits": "no current returns to zero: nothing is learned now",
            "moves": "still moving",
            "settled": "settled",
        }[self.state]
        return f"R {f['R_ohm']:.4g} ohm; map: {factors}; {f['strokes']} strokes; {said}"


def learned(rows: Sequence[Sequence[float]], R: float) -> Learned:
    """From rows of the time and the core's columns; R as believed [ohm]."""
    values = np.array(rows, dtype=float)
    column = {name: values[:, j] for j, name in enumerate(["t", *_core.learned_columns])}
    column["R"] = R * column["R"]
    return Learned(**column)
