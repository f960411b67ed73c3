"""Water over the sizes of a system: any values of its file, in all combinations."""

from collections.abc import Callable, Sequence
from functools import partial
from itertools import product
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from reluctance.errors import ParameterError
from reluctance.figures import drawn
from reluctance.files import write_together
from reluctance.pumping.figures import with_units
from reluctance.pumping.operate import operate
from reluctance.pumping.system import System
from reluctance.pumping.write import made, put_bytes, put_text

FIGURES = (
    "array_kWp water_m3 water_m3_per_kWp pumping_h used_of_mp eta loss_of_load_probability"
).split()
Values = dict[str, Sequence[float]]


def sizes(
    system: System, values: Values, *, progress: Callable[[float], None] | None = None
) -> pd.DataFrame:
    """A row for each combination; where a system cannot work at all, water is 0 and `why` says it.

    Examples
    --------
    >>> from reluctance.pumping import load_system, sizes
    >>> day = load_system("examples/sun_day.toml")
    >>> sizes(day, {"array.n_series": [6, 7]})["array_kWp"].round(1).tolist()
    [10.8, 12.6]
    """
    rows = []
    combinations = list(product(*values.values()))
    for combination in combinations:
        row: dict[str, object] = dict(zip(values, combination, strict=True))
        changed = system.with_values(row)
        try:
            found = with_units(operate(changed))
            row |= {name: found[name] for name in FIGURES} | {"why": ""}
        except ParameterError as fault:
            row |= {name: np.nan for name in FIGURES} | {"water_m3": 0.0, "why": str(fault)}
        rows.append(row)
        if progress is not None:
            progress(len(rows) / len(combinations))
    if all(row["why"] for row in rows):
        raise ParameterError(f"none of the {len(rows)} sizes works: {rows[0]['why']}")
    return pd.DataFrame(rows).dropna(axis="columns", how="all")  # no demand: no loss of load


def usual(system: System) -> list[Values]:
    """What is varied where nothing is said: array size over head, and modules in series."""
    parallel, series, head = (
        system.array.n_parallel,
        system.array.n_series,
        system.pipe.H_static_m,
    )
    some = sorted({max(round(parallel * part), 1) for part in (0.5, 0.67, 0.83, 1, 1.17, 1.33)})
    heads = [round(head * part, 3) for part in (0.5, 0.75, 1.0, 1.25, 1.5)]
    return [
        {"pipe.H_static_m": heads, "array.n_parallel": some}
        if head
        else {"array.n_parallel": some},
        {"array.n_series": [n for n in range(series - 3, series + 3) if n > 0]},
    ]


def parsed(text: str, system: System) -> tuple[str, list[float]]:
    """`section.key=FROM:TO:COUNT`, or FROM:TO for whole numbers, or one number.

    Raises
    ------
    ParameterError
        If it is none of these, or no value of the system.
    """
    name, _, span = text.partition("=")
    parts = span.split(":")
    try:
        numbers = [float(part) for part in parts]
        if len(numbers) == 3:
            found = np.linspace(numbers[0], numbers[1], int(numbers[2])).tolist()
        elif len(numbers) == 2:
            found = np.arange(numbers[0], numbers[1] + 1e-9).tolist()
        else:
            (only,) = numbers
            found = [only]
    except ValueError:
        found = []
    if not found:
        raise ParameterError(f"--vary {text}: need section.key=FROM:TO:COUNT, or FROM:TO in ones")
    table, _, key = name.strip().partition(".")
    field = type(getattr(system, table, None)).__dict__.get("__pydantic_fields__", {}).get(key)
    if field is not None and field.annotation is int:
        found = sorted({round(value) for value in found})
    return name.strip(), found


def figure(table: pd.DataFrame, values: Values) -> Figure:
    """Water over the last value, a line for each combination of the others."""
    chart = Figure(figsize=(8, 5), layout="constrained")
    FigureCanvasAgg(chart)
    ax = chart.subplots()
    *others, last = values
    if others:
        for key, part in table.groupby(others):
            name = ", ".join(f"{o} = {v:g}" for o, v in zip(others, key, strict=True))
            ax.plot(part[last], part["water_m3"], "o-", label=name)
        ax.legend(fontsize=8)
    else:
        ax.plot(table[last], table["water_m3"], "o-")
    ax.set(xlabel=last, ylabel="water (m³)", ylim=(0, None))
    ax.grid(alpha=0.25)
    return chart


def write_sizes(
    tables: Sequence[pd.DataFrame], chosen: Sequence[Values], folder: str | Path
) -> list[Path]:
    """Writes sizes_NAME.csv and .png for each table, named by what is varied; all or none."""
    folder = made(folder)
    files: dict[Path, Callable[[Path], None]] = {}
    for table, values in zip(tables, chosen, strict=True):
        stem = folder / ("sizes_" + "_".join(name.partition(".")[2] for name in values))
        text = table.to_csv(index=False, float_format="%.8g", lineterminator="\n")
        files[stem.with_suffix(".csv")] = partial(put_text, text)
        files[stem.with_suffix(".png")] = partial(put_bytes, drawn(figure(table, values), ".png"))
    write_together(files)
    return list(files)
