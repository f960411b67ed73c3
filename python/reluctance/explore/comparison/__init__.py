"""Control laws side by side: equal switching frequency, equal conditions, one table, one figure."""

from reluctance.explore.comparison.comparison import Comparison, compare
from reluctance.explore.comparison.contenders import CONTENDERS, Contender
from reluctance.explore.comparison.contest import Entry, FrontPoint
from reluctance.explore.comparison.write import save_figure, write

__all__ = [
    "CONTENDERS",
    "Comparison",
    "Contender",
    "Entry",
    "FrontPoint",
    "compare",
    "save_figure",
    "write",
]
