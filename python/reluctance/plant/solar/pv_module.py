"""A photovoltaic module: by its numbers, or by its name in the CEC table that comes with pvlib."""

from __future__ import annotations

import re
from functools import lru_cache
from typing import Any

from pydantic import Field

from reluctance.base.cache import cached
from reluctance.base.errors import ParameterError
from reluctance.base.schema import Section
from reluctance.plant.solar.datasheet import Datasheet, cell_from
from reluctance.plant.solar.single_diode import Cell

MOST_NAMES = 6  # of modules in a message
POWER_UNITS = {"w", "wp", "watt", "watts"}
TYPICAL_W = 400.0


class CellNumbers(Section):
    """[source.cell], [array.cell]: a module by its numbers at 1000 W/m2 and 25 degC."""

    I_L_ref_A: float = Field(gt=0)
    I_o_ref_A: float = Field(gt=0)
    R_s_ohm: float = Field(gt=0)
    R_sh_ref_ohm: float = Field(gt=0)
    a_ref_V: float = Field(gt=0)
    alpha_sc_ApK: float = Field(0.0, ge=0)  # of the short-circuit current
    adjust_pct: float = 0.0


def check_one_module(
    module: str | None, sheet: Datasheet | None, numbers: CellNumbers | None, table: str
) -> None:
    """A ValueError unless a table names a module or gives its numbers, in one way alone."""
    ways: dict[str, object] = {f"`module` = {module!r}": module}
    ways |= {f"[{table}.datasheet]": sheet, f"[{table}.cell]": numbers}
    given = [name for name, value in ways.items() if value is not None]
    if len(given) > 1:
        raise ValueError(f"{' and '.join(given)} are the same, said twice; remove all but one")
    if not given:
        raise ValueError(
            f"need one of `module`, a CEC name, the table [{table}.datasheet] with what the maker "
            f"prints, or [{table}.cell] with the numbers of its diode"
        )


def cell_of(
    module: str | None, sheet: Datasheet | None, numbers: CellNumbers | None, table: str
) -> Cell:
    """The module of a table, such as `source`, that names it or gives its numbers.

    Raises
    ------
    ParameterError
        As `cec_module` and `cell_from`.
    """
    if sheet is not None:
        return cell_from(sheet, table)
    if numbers is None:
        return cec_module(module or "", table)
    return Cell(
        I_L_ref=numbers.I_L_ref_A,
        I_o_ref=numbers.I_o_ref_A,
        R_s=numbers.R_s_ohm,
        R_sh_ref=numbers.R_sh_ref_ohm,
        a_ref=numbers.a_ref_V,
        alpha_sc=numbers.alpha_sc_ApK,
        adjust=numbers.adjust_pct,
    )


@lru_cache
def cec_module(name: str, table: str) -> Cell:
    """A module of the CEC table that comes with pvlib, for a table of a TOML file.

    Raises
    ------
    ParameterError
        If pvlib is missing, the name is unknown, or the row has a short-circuit current that falls
        with temperature (223 of 21 535 rows): its hot modules would give too little current.
    """
    inputs = ["CEC module", name, _version(table)]
    cell = cached(Cell, inputs, lambda: _cec_row(name, table), algorithm=1)
    if cell.alpha_sc < 0:
        raise ParameterError(
            f"[{table}] module = {name!r}: its row of the CEC table has alpha_sc = "
            f"{cell.alpha_sc:g} A/K, need >= 0 (a wrong sign); take another module or give its "
            f"numbers in [{table}.cell]"
        )
    return cell


def _version(table: str) -> str:
    """Of pvlib, without its import, which takes a second."""
    from importlib.metadata import PackageNotFoundError, version  # a tenth of the start-up time

    try:
        return version("pvlib")
    except PackageNotFoundError:
        raise ParameterError(
            f"[{table}] module needs the CEC table of pvlib, which is not installed; "
            f"`pip install 'reluctance[sun]'`, or give the module's numbers in [{table}.cell]"
        ) from None


def _cec_row(name: str, table: str) -> Cell:
    modules = pvlib().pvsystem.retrieve_sam("CECMod")
    if name not in modules:
        near = ", ".join(f"`{other}`" for other in _nearest(name, modules))
        raise ParameterError(
            f"[{table}] module = {name!r} is not in the CEC table of {len(modules.columns)}; "
            f"nearest: {near}; names are maker and type with `_` for blanks and signs"
        )
    row = modules[name]
    return Cell(
        I_L_ref=float(row["I_L_ref"]),
        I_o_ref=float(row["I_o_ref"]),
        R_s=float(row["R_s"]),
        R_sh_ref=float(row["R_sh_ref"]),
        a_ref=float(row["a_ref"]),
        alpha_sc=float(row["alpha_sc"]),
        adjust=float(row["Adjust"]),
    )


def _nearest(name: str, modules: Any) -> list[str]:
    """Names that are spelt alike; else those with its words or numbers in them, or of its power."""
    from difflib import get_close_matches

    near = get_close_matches(name, modules.columns, n=3)
    if near:
        return near
    words = [word for word in re.findall(r"[a-z]+|\d+", name.lower()) if word not in POWER_UNITS]
    sound = [str(c) for c in modules.columns if float(modules[c]["alpha_sc"]) >= 0]
    named = [c for c in sound if words and all(word in c.lower() for word in words)]
    if named:
        return _spread(named)
    watts = [float(word) for word in words if word.isdigit() and 20 <= float(word) <= 1000]
    power = {c: float(modules[c]["STC"]) for c in sound}
    return sorted(sound, key=lambda c: abs(power[c] - (watts or [TYPICAL_W])[0]))[:MOST_NAMES]


def _spread(names: list[str]) -> list[str]:
    """At most MOST_NAMES of them, of as many makers as possible."""
    step = max(len(names) // MOST_NAMES, 1)
    return names[::step][:MOST_NAMES]


def pvlib() -> Any:
    """The pvlib package, imported when it is used.

    Its import takes a second, which the equations of one diode can do without.
    """
    import pvlib as found

    return found
