"""Question: which law gives the smoothest torque for its copper and switching?

    python studies/laws_table.py [--page FILE]

Makes the tables of docs/control/laws.md again, and the figures beside it. The source paper's
machine at 240 V, at its rated and its half point, for four classes of hardware, and with every
combination of signs of a wrong model; every table is what `reluctance compare` makes.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from itertools import product
from pathlib import Path

import reluctance as rl
from reluctance.base.files import write_whole
from reluctance.explore.comparison import CONTENDERS, Comparison, compare
from reluctance.explore.comparison.conditions import in_words
from reluctance.explore.comparison.figure import figure
from reluctance.explore.comparison.table import limit_line, markdown, records, star

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "control" / "laws.md"


@dataclass(frozen=True)
class Class:
    """Hardware: how fast and how well it sees, who compares currents; and what it may switch."""

    name: str
    short: str  # head of a column
    title: str
    f_switch: float  # [Hz]
    settings: tuple[str, ...]


SAMPLED = "sensing.comparators=sampled"
LATE = (
    "control.T_s_us=20",
    "sensing.delay_samples=1",
    "sensing.adc_bits=12",
    "sensing.i_range_A=200",
    "sensing.encoder_counts=4096",
)
FPGA = Class(
    "fpga",
    "5 µs",
    "FPGA: every decision every 5 µs, ideal sensing, no delay",
    20e3,
    ("control.T_s_us=5", SAMPLED),
)
CLASSES = (
    FPGA,
    Class(
        "analog",
        "2 µs, analog",
        "Analog comparators, the control every 2 µs, ideal sensing, no delay",
        20e3,
        ("control.T_s_us=2",),
    ),
    Class(
        "mcu",
        "20 µs, late",
        "Microcontroller: every decision every 20 µs, one sample late, 12-bit current, 4096 counts",
        10e3,
        (*LATE, SAMPLED),
    ),
    Class(
        "mcu_analog",
        "20 µs, late, analog",
        "The same microcontroller with analog comparators that see the true current",
        10e3,
        LATE,
    ),
)
POINTS = ("paper_rated", "paper_half")
WRONG = tuple(
    (f"mismatch.flux_factor={flux}", f"mismatch.R_factor={R}", f"mismatch.angle_offset_deg={angle}")
    for flux, R, angle in product((0.9, 1.1), (0.8, 1.2), (-1, 1))
)
COARSE = ("angles", "pwm_current", "finite_set_short")  # far from the limit with any model
FOLLOWERS = [name for name in CONTENDERS if name not in COARSE]

MARK = "<!-- From here on made by `python studies/laws_table.py`. -->\n"


def laws() -> str:
    """The laws in words."""
    head = "| control | law | what it is | use it when | needs | tuned by |\n"
    return (
        head
        + "|---|---|---|---|---|---|\n"
        + "".join(
            f"| `{c.name}` | `{c.law}` | {c.what} | {c.when} | {c.needs} | `{c.free.key}` |\n"
            for c in CONTENDERS.values()
        )
    )


def cell(record: dict[str, object] | None, key: str, best: float) -> str:
    """A ratio in percent; starred where the frequency is missed, bold where it is the least."""
    if record is None or key not in record:
        return ""
    value = float(str(record[key]))
    text = f"{100 * value:.2f}"
    return (f"**{text}**" if value == best else text) + star(record)


def grid(columns: list[tuple[str, Comparison]], key: str) -> str:
    """One figure of the laws over several comparisons, the least of each column in bold."""
    found = [{str(r["control"]): r for r in records(c)} for _, c in columns]
    least = [min(float(r[key]) for r in rows.values() if key in r) for rows in found]
    lines = [
        "| control | " + " | ".join(head for head, _ in columns) + " |",
        "|---|" + "---:|" * len(columns),
    ]
    for name in found[0]:
        cells = [cell(rows.get(name), key, best) for rows, best in zip(found, least, strict=True)]
        lines.append(f"| `{name}` | " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def glance(found: dict[tuple[str, str], Comparison]) -> str:
    """The rms torque error of every law under every condition."""
    columns = [
        (f"{c.short}: {found[c.name, name].point.load.speed_rpm:g} rpm", found[c.name, name])
        for c in CLASSES
        for name in POINTS
    ]
    return f"""
## At a glance

*Rms torque error in percent of the reference, at equal switching frequency:
{CLASSES[0].f_switch / 1e3:g} kHz per switch at 2 and 5 µs, {CLASSES[2].f_switch / 1e3:g} kHz at
20 µs. Comparators are sampled with all other decisions, except under "analog". Bold: the least of
the column; \\*: the law cannot reach the frequency. The tables below have the current and the
losses that belong to each figure.*

{grid(columns, "torque_error_rms")}"""


def wrong_model() -> str:
    """The laws with every combination of signs of a wrong model."""
    columns = []
    for settings in WRONG:
        flux, R, angle = (s.partition("=")[2] for s in settings)
        drive = rl.load(ROOT / "examples" / f"{POINTS[0]}.toml", [*FPGA.settings, *settings])
        found = compare(drive, FOLLOWERS, f_switch=FPGA.f_switch, octaves=())
        columns.append((f"ψ × {flux}, R × {R}, {int(angle):+d}°", found))
    command = called(POINTS[0], FPGA, WRONG[0])
    return f"""
## With a wrong model

*Rms torque ripple in percent of the mean torque, at {found.point.load.speed_rpm:g} rpm and
{found.bound.tau_ref:g} N m; every decision every 5 µs, sampled comparators, tuned to
{FPGA.f_switch / 1e3:g} kHz per switch. The controller's flux map is 10 % off, its resistance 20 %,
its angle 1° electrical. Bold: the least of the column; \\*: the law cannot reach the frequency.*

The mean torque is about 10 % off with every law, since all laws compute it from the map. `angles`,
`pwm_current` and `finite_set_short` are left out: their torque error or their current is large even
with an exact model.

`{command}`, and with the other signs.

{grid(columns, "torque_ripple_rms")}"""


def called(name: str, hardware: Class, more: tuple[str, ...] = ()) -> str:
    """The command of a comparison."""
    settings = " ".join(f"--set {s}" for s in (*hardware.settings, *more))
    kHz = f"{hardware.f_switch / 1e3:g}kHz"
    return f"reluctance compare examples/{name}.toml --at-switching-frequency {kHz} {settings}"


def section(hardware: Class, found: Comparison, picture: Path | None) -> str:
    """One comparison on the page."""
    point = found.point
    shown = (
        f"\n![error over frequency, price in current, torque]({picture.name})\n" if picture else ""
    )
    lines = "\n".join(f"- {line}" for line in in_words(point, found.f_target))
    return f"""
### {point.load.speed_rpm:g} rpm, {found.bound.tau_ref:g} N m, {found.f_target / 1e3:g} kHz

`{called(point.name, hardware)}`

{lines}
- {limit_line(found)}

{markdown(found)}{shown}"""


def draw(found: Comparison, picture: Path) -> None:
    """The figure of a comparison, small enough for a page."""
    made = figure(found)
    write_whole(picture, lambda path: made.savefig(path, dpi=80, metadata={"Software": None}))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--page", type=Path, default=PAGE)
    page: Path = parser.parse_args().page
    if PAGE.read_text(encoding="utf-8").count(MARK) != 1:
        raise SystemExit(f"error: {PAGE} has lost its line {MARK.strip()}")
    found: dict[tuple[str, str], Comparison] = {}
    tables = ""
    for hardware in CLASSES:
        tables += f"\n## {hardware.title}\n"
        for name in POINTS:
            drive = rl.load(ROOT / "examples" / f"{name}.toml", list(hardware.settings))
            found[hardware.name, name] = compare(drive, f_switch=hardware.f_switch)
            picture = None
            if name == POINTS[0]:
                picture = page.parent / f"laws_{hardware.name}.png"
                draw(found[hardware.name, name], picture)
            tables += section(hardware, found[hardware.name, name], picture)
    text = PAGE.read_text(encoding="utf-8").partition(MARK)[0] + MARK
    text += "\n## What each law is, and when to use it\n\n" + laws()
    text += glance(found) + wrong_model() + tables
    write_whole(page, lambda path: save_text(path, text))


def save_text(path: Path, text: str) -> None:
    path.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
