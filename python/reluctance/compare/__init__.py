"""Control laws side by side: equal switching frequency, equal conditions, one table, one figure."""

from reluctance.compare.comparison import Comparison, compare
from reluctance.compare.contenders import CONTENDERS, Contender
from reluctance.compare.contest import Entry, FrontPoint
from reluctance.compare.write import save_figure, write

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
