"""Water over the sizes of a system: any values of its file, in all combinations."""

from collections.abc import Callable, Sequence
from functools import partial
from itertools import product
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from reluctance.base.errors import ParameterError
from reluctance.base.figures import drawn
from reluctance.base.files import write_together
from reluctance.base.picture import Picture
from reluctance.pumping.figures import REMEDIES, at_limits, of_the_light, with_units
from reluctance.pumping.matching import Limit
from reluctance.pumping.operate import pump
from reluctance.pumping.system import System
from reluctance.pumping.text import number
from reluctance.pumping.write import made, put_bytes, put_text

FIGURES = (
    "array_kWp water_m3 water_m3_per_kWp pumping_h used_of_mp eta loss_of_load_probability "
    "demand_m3"
).split()
FEWEST = 4  # strings in parallel: a smaller array is varied from 1 to these
A_YEAR = 360  # fewer days of weather lack a season [d]
Values = dict[str, Sequence[float]]


def sizes(
    system: System, values: Values, *, progress: Callable[[float], None] | None = None
) -> pd.DataFrame:
    """A row for each combination; where a system cannot work at all, water is 0 and `why` says it.
    The attribute `notes` of the table has what a reader must know of the weather, and the size with
    the most hours at each limit.

    Examples
    --------
    >>> from reluctance.pumping import load_system, sizes
    >>> day = load_system("examples/sun_day.toml")
    >>> sizes(day, {"array.n_series": [6, 7]})["array_kWp"].round(1).tolist()
    [10.8, 12.6]
    """
    for name, several in values.items():  # a name that is wrong is wrong in every row
        system.table_of(name)
        if not len(several):
            raise ParameterError(f"{name}: need at least one value")
    rows, days = [], 0.0
    light: list[str] = []
    longest: dict[Limit, tuple[float, str]] = {}
    combinations = list(product(*values.values()))
    for done, combination in enumerate(combinations):

        def told(part: float, done: int = done) -> None:
            if progress is not None:
                progress((done + part) / len(combinations))

        row: dict[str, object] = dict(zip(values, combination, strict=True))
        try:
            found = pump(system.with_values(row), progress=told)
            light += of_the_light(found)
            size = ", ".join(f"{name} = {value:g}" for name, value in row.items())
            for limit, hours in at_limits(found).items():
                longest[limit] = max(longest.get(limit, (0.0, "")), (hours, size))
            figures = with_units(found)
            days = figures["days"] or 0.0
            row |= {name: figures[name] for name in FIGURES} | {"why": ""}
        except ParameterError as fault:
            row |= {name: np.nan for name in FIGURES} | {"water_m3": 0.0, "why": str(fault)}
        rows.append(row)
        told(1.0)
    if all(row["why"] for row in rows):
        raise ParameterError(f"none of the {len(rows)} sizes works: {rows[0]['why']}")
    table = pd.DataFrame(rows).dropna(axis="columns", how="all")  # no demand: no loss of load
    table.attrs["days"] = days
    table.attrs["notes"] = [
        *dict.fromkeys(light),
        *(f"{h:.1f} h with {size} at {REMEDIES[limit]}" for limit, (h, size) in longest.items()),
    ]
    return table


def meets(table: pd.DataFrame, llp: float, system: System) -> int | None:
    """The row of the smallest array that meets the demand: with a loss of load of at most `llp`,
    the least nominal power, then the least tank, then the most water. None if no row does.

    Where a value of the site is varied, such as the head, the system's own counts; nothing is
    chosen where it is not among them.
    """
    if "loss_of_load_probability" not in table or without_own(table, system):
        return None
    good = table[(table["loss_of_load_probability"] <= llp) & (table["why"] == "")]
    for name in set(table) - set(FIGURES) - {"why"}:
        if not is_size(name):
            good = good[good[name] == _own(name, system)]
    if good.empty:
        return None
    order = {"array_kWp": True, "tank.volume_m3": True, "water_m3": False}
    order = {name: up for name, up in order.items() if name in table}
    return int(good.sort_values(list(order), ascending=list(order.values())).index[0])


def is_size(name: str) -> bool:
    """Whether a value of a system is one that a buyer chooses, and not one of the site."""
    return name.partition(".")[0] in ("array", "tank")


def _own(name: str, system: System) -> object:
    section, _, key = name.partition(".")
    return getattr(getattr(system, section), key)


def without_own(table: pd.DataFrame, system: System) -> list[str]:
    """The values of the site that are varied without the system's own among them."""
    names = [name for name in table if name not in (*FIGURES, "why") and not is_size(name)]
    return [name for name in names if not (table[name] == _own(name, system)).any()]


def smallest(table: pd.DataFrame, row: int | None, llp: float, system: System) -> list[str]:
    """What `meets` found, as a sentence; and what a clear sky or a part of a year leaves open."""
    if strange := without_own(table, system):
        return [
            f"no size is chosen: {name} is a value of the site, and the system's own "
            f"{_own(name, system)} is not among those varied"
            for name in strange
        ]
    if not any(is_size(name) for name in table):
        return []
    if row is None:
        return [f"no size of these loses at most {llp:.1%} of the demand; vary larger arrays"]
    chosen = table.loc[row]
    varied = [name for name in table if name not in (*FIGURES, "why")]
    what = ", ".join(f"{name} = {chosen[name]:g}" for name in varied)
    told = (
        f"* smallest array that loses at most {llp:.1%} of the demand: {what}, "
        f"{number(chosen['array_kWp'])} kWp, {number(chosen['water_m3'])} m3"
    )
    days = table.attrs["days"]
    if system.weather.kind != "clear" and days >= A_YEAR:
        return [told]
    light = "under a clear sky" if system.weather.kind == "clear" else f"in {days:.3g} days"
    return [
        told,
        f"{light}: it has no margin for cloudy days; take a larger one, and check it with "
        "a typical year ([weather] file)",
    ]


def usual(system: System) -> list[Values]:
    """What is varied where nothing is said: array size over head, and modules in series."""
    parallel, series, head = (
        system.array.n_parallel,
        system.array.n_series,
        system.pipe.H_static_m,
    )
    some = sorted({max(round(parallel * part), 1) for part in (0.5, 0.67, 0.83, 1, 1.17, 1.33)})
    some = sorted({*some, *range(1, FEWEST + 1)}) if parallel < FEWEST else some
    heads = [round(head * part, 3) for part in (0.5, 0.75, 1.0, 1.25, 1.5)]
    return [
        {"pipe.H_static_m": heads, "array.n_parallel": some}
        if head
        else {"array.n_parallel": some},
        {"array.n_series": [n for n in range(series - 3, series + 3) if n > 0]},
    ]


def parsed(text: str, system: System) -> tuple[str, list[float]]:
    """`section.key=FROM:TO:COUNT`, or FROM:TO for whole numbers, or numbers with commas.

    Raises
    ------
    ParameterError
        If it is none of these, or no value of the system.
    """
    name, _, span = text.partition("=")
    parts = span.split(":")
    try:
        numbers = [float(part) for part in parts] if len(parts) > 1 else []
        if len(numbers) == 3:
            found = np.linspace(numbers[0], numbers[1], int(parts[2])).tolist()
        elif len(numbers) == 2:
            found = np.arange(numbers[0], numbers[1] + 1e-9).tolist()
        else:
            found = [float(part) for part in span.split(",")]
    except ValueError:
        found = []
    if not found:
        raise ParameterError(
            f"--vary {text}: need section.key=FROM:TO:COUNT, FROM:TO in ones, or A,B,C"
        )
    table, _, key = name.strip().partition(".")
    field = type(getattr(system, table, None)).__dict__.get("__pydantic_fields__", {}).get(key)
    if field is not None and field.annotation is int:
        listed = [value for value in found if len(parts) == 1 and value != round(value)]
        if listed:
            raise ParameterError(f"--vary {text}: {listed[0]:g} is not whole; need whole numbers")
        found = sorted({round(value) for value in found})
    return name.strip(), found


def figure(table: pd.DataFrame, values: Values, demand: float | None = None) -> Figure:
    """Water over the last value, a line for each combination of the others; with a demand also the
    part of it that is not met."""
    table = table[table["why"] == ""] if "why" in table else table  # a refused size has no water
    *others, last = values
    panels = {"water_m3": (1.0, "water (m³)")}
    if demand is not None:
        panels["loss_of_load_probability"] = (100.0, "demand not met (%)")
    chart = Picture(8, 5 if demand is None else 8)
    for ax, (key, (factor, label)) in zip(
        chart.subplots(len(panels), 1, squeeze=False)[:, 0], panels.items(), strict=True
    ):
        for at, part in table.groupby(others) if others else [((), table)]:
            name = ", ".join(f"{o} = {v:g}" for o, v in zip(others, at, strict=True))
            ax.plot(part[last], factor * part[key], "o-", label=name or None)
        if demand is not None and key == "water_m3":
            ax.axhline(demand, color="k", ls="--", lw=1, label="demand")
        if ax.get_legend_handles_labels()[0]:
            ax.legend(fontsize=8)
        if all(float(value).is_integer() for value in values[last]):
            ax.xaxis.set_major_locator(MaxNLocator(integer=True))
        ax.set(xlabel=last, ylabel=label, ylim=(0, None))
        ax.grid(alpha=0.25)
    return chart


def write_sizes(
    tables: Sequence[pd.DataFrame],
    chosen: Sequence[Values],
    folder: str | Path,
    demand: float | None = None,
) -> list[Path]:
    """Writes sizes_NAME.csv and .png for each table, named by what is varied; all or none."""
    folder = made(folder)
    files: dict[Path, Callable[[Path], None]] = {}
    for table, values in zip(tables, chosen, strict=True):
        stem = folder / ("sizes_" + "_".join(name.partition(".")[2] for name in values))
        text = table.to_csv(index=False, float_format="%.8g", lineterminator="\n")
        files[stem.with_suffix(".csv")] = partial(put_text, text)
        files[stem.with_suffix(".png")] = partial(
            put_bytes, drawn(figure(table, values, demand), ".png")
        )
    write_together(files)
    return list(files)
