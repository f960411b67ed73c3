"""Units of functional mock-up units: the powers of SI base units that their names stand for."""

import re
from collections import Counter

import pytest

from reluctance.targets.export.fmu_description import UNITS

DEFINED = {"N": "kg.m/s2", "J": "N.m", "W": "J/s", "V": "W/A", "Wb": "V.s"}
DEFINED |= {"H": "Wb/A", "Ohm": "V/A", "F": "A.s/V", "degC": "K"}


def powers(name: str) -> dict[str, int]:
    """Of base units, by the definitions of the SI."""
    found: Counter[str] = Counter()
    for sign, part in zip((1, -1), name.split("/"), strict=False):
        for symbol, power in re.findall(r"([A-Za-z]+)(\d*)", part):
            inner = powers(DEFINED[symbol]) if symbol in DEFINED else {symbol: 1}
            for base, n in inner.items():
                found[base] += sign * int(power or 1) * n
    return {base: n for base, n in found.items() if n}


@pytest.mark.parametrize("name", UNITS)
def test_a_unit_has_the_base_units_of_its_name(name):
    assert UNITS[name] == powers(name)
