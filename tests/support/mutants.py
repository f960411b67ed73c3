"""Question: which small faults of the code does no test see?

    python tests/support/mutants.py [--seed N] [--python N] [--cpp N] [--shard K/N] [--only PART]

Draws places in python/reluctance and include/srm from a seed (new and printed without one) and
changes one operator, number, condition or statement there in a copy of the repository. A comparison
moves by its bound. One of reals turns round: two of them are equal only by chance, so that a moved
bound has no effect. What is compared decides which of both, in Python as it runs.

The short tests run once without a fault, to note which functions of the package each calls. Those
that call the changed function judge a module, the cheapest first; the checks in C++ judge a header,
then the tests of its folders with the core built with it (tests/support/court.py). A test that
fails counts where it passes without the fault. A change that no test fails is printed as a
survivor.

Why no kept library: mutmut and cosmic-ray make and run every mutant of a package against one test
command. Here a draw of a hundred must end in half an hour, each against the tests that reach it,
and headers need a core of their own.
"""

from __future__ import annotations

import argparse
import ast
import csv
import os
import random
import re
import resource
import secrets
import tempfile
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path

from court import HEADERS, PACKAGE, ROOT, Court, Mutant, recorded

SWAPS: dict[type, type] = {
    **{ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult},
    **{ast.Lt: ast.LtE, ast.LtE: ast.Lt, ast.Gt: ast.GtE, ast.GtE: ast.Gt},
    **{ast.Eq: ast.NotEq, ast.NotEq: ast.Eq, ast.And: ast.Or, ast.Or: ast.And},
    **{ast.Pow: ast.Mult, ast.Is: ast.IsNot, ast.IsNot: ast.Is, ast.In: ast.NotIn},
}
SLACK = 1e-6  # numbers of this size and less
SYMBOLS: dict[type, str] = {ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">="}
COMPARED = {  # with its bound moved, and turned round
    **{"<": ("<=", ">="), ">": (">=", "<="), "<=": ("<", ">"), ">=": (">", "<")},
}
# A comparison whose operands tell whether it moves or turns round.
SWAPPED = (
    "(lambda a, b: a {turned} b if 'f' in "
    "[__import__('numpy').asarray(x).dtype.kind for x in (a, b)] else a {moved} b)"
)
# Keywords: looks of a figure and of text, the place of a warning, the version of a result that is
# kept, and what zip asserts of its callers.
NO_FAULT = "lw ms fontsize alpha size frameon flush indent stacklevel algorithm strict".split()
CPP_SWAPS = {
    **{" + ": " - ", " - ": " + ", " * ": " / ", " / ": " * "},
    **{" && ": " || ", " || ": " && ", " == ": " != "},
}
# `a <mutant::swapped> b` binds as `a < b` does, and finds out which of the two is meant.
CPP_SWAPPED = """
#include <concepts>
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wconversion"
#pragma GCC diagnostic ignored "-Wsign-compare"
namespace mutant {{
struct Swapped {{}};
inline constexpr Swapped swapped{{}};
template <class A>
struct Left {{
  A a;
}};
template <class A>
constexpr Left<A> operator<(A a, Swapped) {{
  return {{a}};
}}
template <class A, class B>
constexpr auto operator>(Left<A> left, B b) {{
  if constexpr (std::integral<A> && std::integral<B>) {{
    return left.a {moved} b;
  }} else {{
    return left.a {turned} b;
  }}
}}
}}
#pragma GCC diagnostic pop
#pragma GCC diagnostic ignored "-Wmissing-template-keyword"
"""


def changed(node: ast.AST) -> ast.AST | None:
    """The node with its fault, or None where it has none."""
    if isinstance(node, ast.BinOp | ast.BoolOp) and type(node.op) in SWAPS:
        return _with(node, op=SWAPS[type(node.op)]())
    if isinstance(node, ast.Compare) and type(node.ops[0]) in SWAPS:
        symbol = SYMBOLS.get(type(node.ops[0]))
        if symbol is not None and len(node.ops) == 1:
            moved, turned = COMPARED[symbol]
            compare = ast.parse(SWAPPED.format(moved=moved, turned=turned), mode="eval").body
            return ast.Call(compare, [node.left, *node.comparators], [])
        return _with(node, ops=[SWAPS[type(node.ops[0])](), *node.ops[1:]])
    if isinstance(node, ast.Constant) and type(node.value) in (int, float):
        return ast.Constant(_moved(node.value))
    if isinstance(node, ast.Constant) and isinstance(node.value, bool):
        return ast.Constant(not node.value)
    if isinstance(node, ast.If | ast.IfExp):
        return _with(node, test=ast.UnaryOp(ast.Not(), node.test))
    if isinstance(node, ast.Raise):
        return ast.Pass()
    return None


def _moved(value: float) -> float:
    """A number of the code with a fault: 5 % more. A slack grows a thousandfold, as 5 % of one is
    no fault."""
    if isinstance(value, int):
        return value + 1
    return value * (1e3 if abs(value) <= SLACK else 1.05) or 1.0


def no_fault(node: ast.AST) -> bool:
    """Whether this gives constants to a keyword of NO_FAULT, a figure its size, or ALGORITHM its
    version."""
    if isinstance(node, ast.Call) and ast.unparse(node.func) == "Picture":
        return all(isinstance(part, ast.Constant) for part in node.args)
    if isinstance(node, ast.keyword):
        parts = node.value.elts if isinstance(node.value, ast.Tuple) else [node.value]
        return node.arg in NO_FAULT and all(isinstance(part, ast.Constant) for part in parts)
    if not isinstance(node, ast.Assign) or not isinstance(node.value, ast.Constant):
        return False
    return ast.unparse(node.targets[0]) == "ALGORITHM"


def _with(node: ast.AST, **fields: object) -> ast.AST:
    values = {name: getattr(node, name, None) for name in node._fields} | fields
    return ast.copy_location(type(node)(**values), node)


def python_mutant(file: Path, draw: random.Random) -> Mutant | None:
    """A fault somewhere in a module, but in its text, its annotations, what is imported for them,
    and where there is `no_fault`."""
    source = file.read_text(encoding="utf-8")
    lines = source.splitlines(keepends=True)
    tree = ast.parse(source)
    found: list[tuple[ast.AST, ast.AST, tuple[str, ...]]] = []

    def visit(node: ast.AST, names: tuple[str, ...]) -> None:
        for name, value in ast.iter_fields(node):
            if name in ("annotation", "returns", "decorator_list", "type_params"):
                continue
            for child in value if isinstance(value, list) else [value]:
                if isinstance(child, ast.JoinedStr) or not isinstance(child, ast.AST):
                    continue
                if no_fault(child):
                    continue
                if isinstance(child, ast.If) and ast.unparse(child.test) == "TYPE_CHECKING":
                    continue
                inner = names
                if isinstance(child, ast.FunctionDef | ast.ClassDef):
                    inner = (*names, child.name)
                other = changed(child)
                if other is not None:
                    found.append((child, other, inner))
                visit(child, inner)

    visit(tree, ())
    if not found:
        return None
    node, other, names = draw.choice(found)
    assert isinstance(node, ast.expr | ast.stmt)
    before = ast.get_source_segment(source, node) or ""
    after = ast.unparse(ast.fix_missing_locations(other))
    if isinstance(node, ast.expr):
        after = f"({after})"
    else:
        after = after.replace("\n", "\n" + " " * node.col_offset)
    first, last = node.lineno - 1, (node.end_lineno or node.lineno) - 1
    head = lines[first].encode()[: node.col_offset].decode()
    tail = lines[last].encode()[node.end_col_offset :].decode()
    text = "".join([*lines[:first], head, after, tail, *lines[last + 1 :]])
    at = file.relative_to(PACKAGE).with_suffix("")
    where = (*(name.strip("_") for name in names), at.name, ".".join(at.parts), *offered(tree))
    shown = (before, re.sub(r"\(lambda a, b: a .*? for x in .*? b\)\(", "swapped(", after))
    short = [" ".join(part.split())[:70] for part in shown]
    return Mutant(file, node.lineno, short[0], short[1], text, where)


def offered(tree: ast.Module) -> list[str]:
    """The functions and classes of a module that others import: tests often reach its inner ones
    through them."""
    those = (part.name for part in tree.body if isinstance(part, ast.FunctionDef | ast.ClassDef))
    return [name for name in those if not name.startswith("_")]


def cpp_mutant(file: Path, draw: random.Random) -> Mutant | None:
    """A swapped operator in a header's code."""
    operators = [*CPP_SWAPS, *(f" {operator} " for operator in COMPARED)]
    lines = file.read_text(encoding="utf-8").split("\n")
    found = [
        (n, place.start(), place.group())
        for n, line in enumerate(lines)
        if not line.lstrip().startswith(("//", "#", "template", "static_assert"))
        for place in re.finditer("|".join(map(re.escape, operators)), line.split("//")[0])
    ]
    if not found:
        return None
    n, at, operator = draw.choice(found)
    swapped = CPP_SWAPS.get(operator, " <mutant::swapped> ")
    other = [*lines]
    other[n] = lines[n][:at] + swapped + lines[n][at + len(operator) :]
    shown = [line.strip()[:80] for line in (lines[n], other[n])]
    text = "\n".join(other)
    if operator.strip() in COMPARED:
        moved, turned = COMPARED[operator.strip()]
        begin = "#pragma once\n"
        text = text.replace(begin, begin + CPP_SWAPPED.format(moved=moved, turned=turned), 1)
    return Mutant(file, n + 1, shown[0], shown[1], text, (file.stem, file.name))


def drawn(kind: str, count: int, only: str, draw: random.Random) -> list[Mutant]:
    """Mutants of files drawn by their length."""
    folder, pattern = (PACKAGE, "*.py") if kind == "python" else (HEADERS / "srm", "*.hpp")
    files = [file for file in sorted(folder.rglob(pattern)) if only in str(file.relative_to(ROOT))]
    sizes = [file.stat().st_size for file in files]
    make = python_mutant if kind == "python" else cpp_mutant
    made: list[Mutant] = []
    while files and len(made) < count:
        mutant = make(draw.choices(files, sizes)[0], draw)
        if mutant is not None:
            made.append(mutant)
    return made


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--seed", type=int, default=secrets.randbelow(10**6))
    parser.add_argument("--python", type=int, default=75)
    parser.add_argument("--cpp", type=int, default=25)
    parser.add_argument("--shard", default="1/1", help="K/N: every N-th mutant from the K-th on")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--only", default="", help="part of a path, as limit")
    parser.add_argument("--out", type=Path, help="each mutant and the test that saw it, as CSV")
    parser.add_argument("--reached", type=Path, help="what tests call, of an earlier run: a folder")
    arguments = parser.parse_args()
    shard, shards = (int(part) for part in arguments.shard.split("/"))
    print(f"seed {arguments.seed}", flush=True)
    draw = random.Random(arguments.seed)
    out = (arguments.out or Path(os.devnull)).open("w", newline="", buffering=1)
    table = csv.writer(out, lineterminator="\n")
    table.writerow(("seed", "mutant", "seen_by"))
    with (
        out,
        tempfile.TemporaryDirectory() as folder,
        ThreadPoolExecutor(arguments.jobs) as pool,
    ):
        court = Court(Path(folder), arguments.jobs)
        reached = arguments.reached or Path(folder) / "reached"
        if not reached.exists():
            court.unchanged.record(reached, arguments.jobs)
        tests = recorded(reached)
        print(f"{len(tests)} tests of {sum(test.cost for test in tests):.0f} s", flush=True)
        killer_of = partial(court.killer, tests=tests)
        mutants = {
            kind: drawn(kind, getattr(arguments, kind), arguments.only, draw)[shard - 1 :: shards]
            for kind in ("python", "cpp")
        }
        # Those that take longest begin first, so that no processor waits at the end.
        killers = {kind: pool.map(killer_of, mutants[kind]) for kind in ("cpp", "python")}
        for kind, judged in killers.items():
            killed: Counter[str] = Counter()
            count: Counter[str] = Counter()
            for mutant, killer in zip(mutants[kind], judged, strict=True):
                room = mutant.file.relative_to(ROOT).parent.as_posix()
                seen_by = "none" if killer is None else killer
                table.writerow((arguments.seed, str(mutant), seen_by))
                if killer == "":
                    print(f"does not compile {mutant}", flush=True)
                    continue
                count[room] += 1
                killed[room] += killer is not None
                what = f"survives {mutant}" if killer is None else f"killed {mutant} by {killer}"
                print(what, flush=True)
            rooms = ", ".join(f"{room} {killed[room]}/{count[room]}" for room in sorted(count))
            print(f"{kind}: {killed.total()} of {count.total()} killed: {rooms}", flush=True)
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    print(f"{used.ru_utime + used.ru_stime:.0f} s of processor time")


if __name__ == "__main__":
    main()
