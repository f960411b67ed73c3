"""Question: which law gives the smoothest torque for its copper and switching?

    python studies/laws_table.py [--page FILE]

Makes the tables of docs/control/laws.md again, and the figures beside it. The source paper's
machine at 240 V, at its rated and its half point, at 10 and 20 kHz per switch, for two classes of
hardware; every table is what `reluctance compare` makes.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path

import reluctance as rl
from reluctance.compare import CONTENDERS, Comparison, compare
from reluctance.compare.conditions import in_words
from reluctance.compare.figure import figure
from reluctance.compare.table import limit_line, markdown
from reluctance.save import write_whole

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "control" / "laws.md"


@dataclass(frozen=True)
class Class:
    """Hardware: how fast and how well it sees."""

    name: str
    title: str
    settings: tuple[str, ...]


CLASSES = (
    Class("fpga", "FPGA: every 2 µs, ideal sensing, no delay", ("control.T_s_us=2",)),
    Class(
        "mcu",
        "Microcontroller: every 20 µs, one sample late, 12-bit current, 4096 counts",
        (
            "control.T_s_us=20",
            "sensing.delay_samples=1",
            "sensing.adc_bits=12",
            "sensing.i_range_A=200",
            "sensing.encoder_counts=4096",
        ),
    ),
)
POINTS = ("paper_rated", "paper_half")
FREQUENCIES = (10e3, 20e3)  # [Hz]
PICTURED = ("paper_rated", 20e3)

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


def section(hardware: Class, found: Comparison, picture: Path | None) -> str:
    """One comparison on the page."""
    point = found.point
    kHz = f"{found.f_target / 1e3:g}kHz"
    settings = " ".join(f"--set {s}" for s in hardware.settings)
    shown = (
        f"\n![error over frequency, price in current, torque]({picture.name})\n" if picture else ""
    )
    lines = "\n".join(f"- {line}" for line in in_words(point, found.f_target))
    return f"""
### {point.load.speed_rpm:g} rpm, {found.bound.tau_ref:g} N m, {found.f_target / 1e3:g} kHz

`reluctance compare examples/{point.name}.toml --at-switching-frequency {kHz} {settings}`

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
    text = PAGE.read_text(encoding="utf-8").partition(MARK)[0] + MARK
    text += "\n## What each law is, and when to use it\n\n" + laws()
    for hardware in CLASSES:
        text += f"\n## {hardware.title}\n"
        for name in POINTS:
            drive = rl.load(ROOT / "examples" / f"{name}.toml", list(hardware.settings))
            for f_switch in FREQUENCIES:
                found = compare(drive, f_switch=f_switch)
                picture = None
                if (name, f_switch) == PICTURED:
                    picture = page.parent / f"laws_{hardware.name}.png"
                    draw(found, picture)
                text += section(hardware, found, picture)
    write_whole(page, lambda path: save_text(path, text))


def save_text(path: Path, text: str) -> None:
    path.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
