"""Question: does this program agree with what somebody else measured or published?

    python studies/published/all.py [--out FILE]

Runs every case of this folder and writes docs/published.csv. docs/published.md says what each case
leaves open and why figures differ. Words: validation only against `measured` figures; against
`computed` ones it is a numerical verification.
"""

from __future__ import annotations

import argparse
from importlib import import_module
from pathlib import Path

from figure import rows, show, write

CASES = (
    *("guc", "closed_form_torque", "closed_form_current", "closed_form_speed", "micro_8_6"),
    *("emdlab_8_6", "tanala_12_8", "tanala_sharing", "tanala_coupled", "team_24"),
)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    default = Path(__file__).parents[2] / "docs" / "published.csv"
    parser.add_argument("--out", type=Path, default=default)
    lines = []
    for case in CASES:
        print(case)
        made = rows(case, import_module(case).figures())
        show(made)
        lines += made
    write(parser.parse_args().out, lines)


if __name__ == "__main__":
    main()
