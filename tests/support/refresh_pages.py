"""Writes the numbers of README and docs anew where they differ from the files that they cite.

    python tests/support/refresh_pages.py [PAGE ...]

A number keeps its digits after the point. Sentences around a number are for the author to read
again: each change is printed.
"""

import re
import shlex
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "docs"))
from test_docs import (
    COMMENT,
    NUMBER,
    PAGES,
    SINGLE,
    TABLE,
    agrees,
    cells,
    keys_of,
    value,
)


def rounded(shown: str, exact: float) -> str:
    """The exact number as the shown one is written."""
    decimals = len(shown.partition(".")[2])
    text = f"{exact:.{decimals}f}"
    if " " in shown:
        text = f"{float(text):,.{decimals}f}".replace(",", " ")
    return text.replace("-", "−") if "−" in shown or "-" not in shown else text


def row(line: str, source: str, key: str, where: str | None, columns: str) -> str:
    """A line of a table with its numbers anew."""
    first, *_ = cells(line)
    parts = line.split("|")
    for place, spec in enumerate(columns.split(";"), 2):
        what, _, only = spec.strip().partition(" @ ")
        if what == "-" or not NUMBER.search(cells(line)[place - 1]):
            continue
        keys = {key: first} | keys_of((where or "").split(",")) | keys_of(only.split(","))
        wanted = iter(what.split("&"))

        def anew(found: re.Match[str], wanted=wanted, keys=keys) -> str:
            column, _, other = next(wanted).strip().partition(" in ")
            exact = value(other or source, keys, column)
            return found[0] if agrees(found[0], exact) else rounded(found[0], exact)

        parts[place] = NUMBER.sub(anew, parts[place])
    return "|".join(parts)


def refreshed(page: str) -> str:
    lines = page.splitlines()
    for n, line in enumerate(lines):
        if citation := TABLE.search(line):
            m = next(m for m in range(n + 1, n + 4) if lines[m].startswith("|")) + 2
            while m < len(lines) and lines[m].startswith("|"):
                lines[m] = row(lines[m], *citation.groups())
                m += 1
    page = "\n".join(lines) + "\n"
    for citation in [*SINGLE.finditer(page)][::-1]:
        if not TABLE.match(citation[0]):
            *keys, column = shlex.split(citation[2])
            exact = value(citation[1], keys_of(keys), column)
            hidden = COMMENT.sub(lambda c: "\0" * len(c[0]), page[: citation.start()])
            shown = [*NUMBER.finditer(hidden)][-1]
            if not agrees(shown[0], exact):
                page = page[: shown.start()] + rounded(shown[0], exact) + page[shown.end() :]
    return page


def main() -> None:
    for page in [Path(name).resolve() for name in sys.argv[1:]] or PAGES:
        old = page.read_text(encoding="utf-8")
        new = refreshed(old)
        for before, after in zip(old.splitlines(), new.splitlines(), strict=True):
            if before != after:
                print(f"{page.name}\n- {before}\n+ {after}")
        if new != old:
            page.write_text(new, encoding="utf-8")


if __name__ == "__main__":
    main()
