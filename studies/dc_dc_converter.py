"""Question: does a dc-dc converter between array and drive bring more water?

    python studies/dc_dc_converter.py [--csv FILE] [--figure FILE]

The source paper's last claim is that its controller makes the converter unnecessary. Here the same
array, machine, pump and pipe run without one (the link at the array's maximum power point) and
with one to a link of 300 V, ideal and with an efficiency of 97 %, for strings of 4 to 9 modules;
on the clear day of `examples/sun_day.toml`, on that day with clouds, and over the year of
`examples/sun_year.toml`. About 42 modules each; a difference is between the same modules.

The table of the default path is what `reluctance paper` reads its verdict from.
"""

import argparse
from collections.abc import Iterator
from pathlib import Path

from matplotlib.figure import Figure

from reluctance.base.figures import save_figure
from reluctance.base.phases import BLUE, GREEN, ORANGE
from reluctance.base.picture import Picture
from reluctance.pumping import System, load_system, pump
from reluctance.pumping.write import write_text_whole

ROOT = Path(__file__).parents[1]
SERIES = range(4, 10)
MODULES = 42
U_LINK = 300.0  # behind the converter [V]
EFFICIENCIES = {"converter_97": 0.97, "converter_ideal": 1.0}
COLOURS = {"clear": ORANGE, "cloudy": BLUE, "year": GREEN}
COLUMNS = ("weather", "n_series", "n_parallel", "direct_m3", *(f"{e}_m3" for e in EFFICIENCIES))
Row = dict[str, str | float]


def weathers() -> dict[str, System]:
    """The three that are asked."""
    day = load_system(ROOT / "examples" / "sun_day.toml")
    return {
        "clear": day,
        "cloudy": day.with_values({"weather.clouds": {"seed": 1}}),
        "year": load_system(ROOT / "examples" / "sun_year.toml"),
    }


def rows(systems: dict[str, System]) -> Iterator[Row]:
    """Water without and with a converter [m^3]."""
    for name, system in systems.items():
        for n_series in SERIES:
            n_parallel = round(MODULES / n_series)
            sized = system.with_values({"array.n_series": n_series, "array.n_parallel": n_parallel})
            row: Row = {"weather": name, "n_series": n_series, "n_parallel": n_parallel}
            row["direct_m3"] = pump(sized).water
            for label, efficiency in EFFICIENCIES.items():
                row[f"{label}_m3"] = pump(with_converter(sized, efficiency)).water
            yield row


def with_converter(system: System, efficiency: float) -> System:
    """The same behind a dc-dc converter."""
    values = {"kind": "dcdc", "u_V": U_LINK, "efficiency": efficiency}
    return system.with_table("operation", values)


def figure(table: list[Row]) -> Figure:
    """What a converter adds, over the modules in series."""
    drawn = Picture(8, 5)
    ax = drawn.subplots()
    for name, colour in COLOURS.items():
        part = [row for row in table if row["weather"] == name]
        for label, line in (("converter_97", "o-"), ("converter_ideal", "o:")):
            gain = [100 * (float(r[f"{label}_m3"]) / float(r["direct_m3"]) - 1) for r in part]
            shown = f"{name}, {'97 %' if label == 'converter_97' else 'ideal'}"
            ax.plot([float(r["n_series"]) for r in part], gain, line, color=colour, label=shown)
    ax.axhline(0, color="k", lw=0.8)
    ax.set(
        title="water that a dc-dc converter to 300 V adds",
        xlabel="modules in series",
        ylabel="change of the water pumped (%)",
    )
    ax.legend(fontsize=8)
    ax.grid(alpha=0.25)
    return drawn


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--csv", type=Path, default=ROOT / "python/reluctance/paper/dc_dc.csv")
    parser.add_argument("--figure", type=Path, default=ROOT / "docs/pumping/dc_dc.png")
    options = parser.parse_args()
    table = []
    for row in rows(weathers()):
        print(*(f"{v:.1f}" if isinstance(v, float) else v for v in row.values()), flush=True)
        table.append(row)
    lines = [",".join(COLUMNS)]
    for row in table:
        numbers = [f"{row[name]:.6g}" if name.endswith("_m3") else row[name] for name in COLUMNS]
        lines.append(",".join(map(str, numbers)))
    write_text_whole(options.csv, "\n".join(lines) + "\n")
    options.figure.parent.mkdir(parents=True, exist_ok=True)
    save_figure(figure(table), options.figure)


if __name__ == "__main__":
    main()
