"""The tool that plants small faults: what it says of a file without a fault, and of one with."""

import ast
import inspect
import os
import random
import re
import subprocess
import sys
from dataclasses import replace

import court
import mutants
import numpy as np
import pytest
from court import (
    HEADERS,
    PACKAGE,
    ROOT,
    TESTS,
    Court,
    Mutant,
    folders,
    function_at,
    judges,
    portions,
    recorded,
)
from court import Test as Judge

from reluctance.base import units

PUMP = TESTS / "plant" / "test_pumping_pump.py"
DRAWS = [(kind, only) for kind, only in (("python", "explore/tuning"), ("cpp", "control/law"))]


def planted(file, before="", after=""):
    """A file with a fault, or as it is."""
    text = file.read_text()
    assert before in text
    return Mutant(file, 1, before, after, text.replace(before, after, 1), (file.stem, file.name))


def noted(name, cost, *called):
    return Judge(f"tests/{name}", cost, frozenset(called))


def shown(mutant):
    """Its text without the definition of a swapped comparison."""
    text = mutant.text
    for moved, turned in mutants.COMPARED.values():
        text = text.replace(mutants.CPP_SWAPPED.format(moved=moved, turned=turned), "")
    return text


def checks_of_headers():
    name = "core/test_core.py::test_core_check_holds[{}-g++]"
    return [noted(name.format(file.stem), 1.0) for file in sorted(TESTS.glob("core/*_check.cpp"))]


@pytest.fixture(scope="module")
def tests(tmp_path_factory):
    """What two files of tests call."""
    folder = tmp_path_factory.mktemp("reached")
    order = [sys.executable, "-m", "pytest", "-q", "-p", "reached", f"--reached={folder}"]
    place = {"cwd": ROOT, "env": os.environ | {"PYTHONPATH": str(TESTS / "support")}}
    laws = [f"{TESTS / 'drive' / 'test_laws.py'}"]
    subprocess.run([*order, "-m", "not long", PUMP, *laws], check=True, **place)
    return recorded(folder)


@pytest.mark.long
def test_an_unchanged_file_survives_and_a_planted_fault_dies(tmp_path, tests):
    court, pump = Court(tmp_path, 1), PACKAGE / "plant" / "hydraulics" / "pump.py"
    assert court.killer(planted(pump), tests) is None
    fault = ("RHO * GRAVITY * head", "1.05 * RHO * GRAVITY * head")
    assert "test_pumping_pump.py::" in court.killer(planted(pump, *fault), tests)
    assert court.killer(planted(pump), tests) is None  # it was put right


@pytest.mark.long
def test_the_same_holds_for_headers(tmp_path, tests):
    """Judged by a check, and by tests of the law through the core built with the header."""
    law = HEADERS / "srm" / "control" / "law" / "deadbeat.hpp"
    fault = planted(law, "(psi_ref - begin)", "(psi_ref + begin)")
    one, all_of_them = Court(tmp_path, 1), [*checks_of_headers(), *tests]
    wrong = planted(law, "T begin =", "begin =")
    assert one.killer(wrong, all_of_them) == one.killer(wrong, tests) == ""  # does not compile
    assert "_check" in one.killer(fault, all_of_them)
    assert one.killer(planted(law), tests) is None
    assert "test_laws.py::" in one.killer(fault, tests)
    of_the_law = planted(PACKAGE / "drive" / "laws" / "deadbeat.py")
    assert one.killer(of_the_law, tests) is None  # the core is the installed one again


@pytest.mark.long
def test_a_header_of_the_c_interface_is_judged_by_what_compiles_it(tmp_path):
    """Without a core built with it, where that tells; one that does not compile is none."""
    calls_of = HEADERS / "srm" / "c_api" / "implementation.hpp"
    calls = [noted("targets/test_c_calls_in_short.py::test_every_status_has_words_of_its_own", 1.0)]
    one = Court(tmp_path, 1)
    assert one.killer(planted(calls_of, "case SRM_WRONG_PART:", "case 77:"), calls) == calls[0].name
    assert one.killer(planted(calls_of, "case SRM_WRONG_PART:", "case :"), calls) == ""
    assert not (tmp_path / "0" / "build").exists()


@pytest.mark.long
def test_a_fault_that_no_import_survives_is_seen_by_every_test(tmp_path, tests):
    court, package = Court(tmp_path, 1), PACKAGE / "__init__.py"
    fault = planted(package, 'name.startswith("reluctance.") and', "True or")
    assert court.killer(fault, tests[:1]) == "what every test imports"
    nowhere = replace(tests[0], name="tests/plant/test_nowhere.py::test_a")
    with pytest.raises(RuntimeError, match="file or directory not found"):
        court.killer(planted(package), [nowhere])


@pytest.mark.parametrize(("kind", "only"), DRAWS)
def test_a_seed_draws_the_same_faults_each_in_one_line(kind, only):
    drawn = [mutants.drawn(kind, 20, only, random.Random(3)) for _ in range(2)]
    assert drawn[0] == drawn[1]
    for mutant in drawn[0]:
        was, now = mutant.file.read_text().split("\n"), shown(mutant).split("\n")
        assert was != now
        assert was[: mutant.line - 1] == now[: mutant.line - 1]


def test_the_looks_of_a_figure_are_no_fault():
    look = re.compile(r"\b(?:lw|ms|fontsize|alpha)=[\d.]+")
    for mutant in mutants.drawn("python", 100, "limits/files.py", random.Random(5)):
        assert look.findall(mutant.text) == look.findall(mutant.file.read_text())


@pytest.mark.parametrize(
    ("harmless", "fault"),
    [
        ("if TYPE_CHECKING:\n    import b\n", "if c:\n    import b\n"),
        ("ALGORITHM = 3\n", "ALGORITHMS = 3\n"),
        ("f(algorithm=1)\n", "f(algorithms=1)\n"),
        ("f(alpha=1)\n", "alpha = 1\n"),  # a figure's, and a number of the model
        ("zip(a, b, strict=True)\n", "json(a, b, strictly=True)\n"),
        ("f(size=(12, 8.5))\n", "f(size=(n, 8.5))\n"),
        ("Picture(12, 8.5)\n", "Pictures(12, 8.5)\n"),
    ],
)
def test_imports_for_annotations_and_versions_of_results_are_no_fault(
    harmless, fault, tmp_path, monkeypatch
):
    file = tmp_path / "a.py"
    monkeypatch.setattr(mutants, "PACKAGE", tmp_path)
    file.write_text(harmless)
    assert mutants.python_mutant(file, random.Random(1)) is None
    file.write_text(fault)
    assert mutants.python_mutant(file, random.Random(1)) is not None


@pytest.mark.parametrize(
    ("was", "a", "b", "now"),
    [
        *(("a < b", 2, 2, True), ("a < b", 3, 2, False), ("a > b", 2, 2, True)),
        *(("a <= b", 2, 2, False), ("a >= b", 2, 2, False), ("a < b < 5", 2, 2, True)),
        *(("a < b", 3.0, 2, True), ("a < b", 1, 2.0, False), ("a >= b", 2.0, 1.0, False)),
        *(("a > b", np.array([1.0]), 2, True), ("a > b", np.array([2]), 2, True)),
        *(("a <= b", {1}, {1, 2}, True), ("a <= b", {1}, {1}, False), ("a < b", "a", "a", True)),
    ],
)
def test_a_comparison_moves_and_one_of_reals_turns_round(was, a, b, now):
    node = ast.parse(was, mode="eval").body
    fault = ast.unparse(ast.fix_missing_locations(mutants.changed(node)))
    assert eval(fault, {"a": a, "b": b}) == now


def test_so_does_one_in_a_header_by_the_types_that_meet_there(tmp_path):
    """In a template, too, and beside other operators."""
    file = tmp_path / "a.hpp"
    code = "constexpr bool less(auto a, auto b) {\n  return a + b < b + b;\n}\n"
    file.write_text("#pragma once\n" + code)
    mutant = next(
        found
        for found in (mutants.cpp_mutant(file, random.Random(n)) for n in range(99))
        if "swapped" in found.after
    )
    file.write_text(mutant.text)
    claims = (
        *("less(1, 1)", "!less(2, 1)", "less(0, 1)"),
        *("less(1.0, 1.0)", "!less(0.0, 1.0)", "less(2.0, 1.0)", "!less(1, 2.0)"),
    )
    main = tmp_path / "a.cpp"
    asserts = "".join(f"static_assert({claim});\n" for claim in claims)
    main.write_text(f'#include "a.hpp"\n{asserts}')
    command = ["g++", "-std=c++20", "-fsyntax-only", "-Wall", "-Wextra", "-Wconversion", "-Werror"]
    subprocess.run([*command, main], check=True)


def test_every_header_and_module_has_its_judges():
    for file in [*HEADERS.rglob("srm/*/*.hpp"), *PACKAGE.rglob("*/*.py")]:
        names = folders(file)
        assert names and all((TESTS / name).is_dir() for name in names), file


NOW = (
    "test_the_looks_of_a_figure_are_no_fault",
    "test_a_line_belongs_to_the_innermost_function_around_it[1-None]",
)
CODE = """\
X = 1

@f
def a():
    def b():
        return 2
    return b
"""


@pytest.mark.parametrize(("line", "first"), [(1, None), (2, None), (3, 3), (4, 3), (6, 5), (7, 3)])
def test_a_line_belongs_to_the_innermost_function_around_it(line, first, tmp_path):
    (tmp_path / "a.py").write_text(CODE)
    assert function_at(tmp_path / "a.py", line) == first


def test_those_judge_that_call_what_was_changed_and_those_that_name_it(monkeypatch):
    """Of all folders the first, of its own the second, for which little time is left."""
    file = PACKAGE / "plant" / "hydraulics" / "pump.py"
    names = ("names_it", "calls_it", "costs_more", "long")
    at = {name: ROOT / "tests" / "plant" / f"test_{name}.py" for name in names}
    monkeypatch.setattr(court, "function_at", lambda file, line: 7)
    monkeypatch.setattr(court, "nearest", lambda names: [at["names_it"]])
    here, elsewhere = ("plant/hydraulics/pump.py", 7), ("plant/hydraulics/pump.py", 8)
    tests = [
        noted("plant/test_long.py::a", 61.0, here),
        noted("plant/test_costs_more.py::a", 20.0, here),
        noted("plant/test_calls_it.py::b", 8.0, here),
        noted("plant/test_names_it.py::a", 0.75, elsewhere),
        noted("plant/test_names_it.py::b", 2.0, elsewhere),
        noted("drive/test_x.py::a[1]", 1.0, here),
        noted("drive/test_x.py::a[2]", 1.5, here),  # once more of the same
        noted("drive/test_x.py::c", 0.0, elsewhere),
    ]
    told = [name.removeprefix("tests/") for name in judges(planted(file), tests)]
    assert told == [
        *("plant/test_names_it.py::a", "drive/test_x.py::a[1]"),
        *("plant/test_calls_it.py::b", "plant/test_costs_more.py::a"),
    ]
    monkeypatch.setattr(court, "function_at", lambda file, line: None)  # a constant of the module
    assert "tests/drive/test_x.py::c" in judges(planted(file), tests[2:])
    declared = noted("cli/test_surface.py::a", 1.0)
    assert declared.name in judges(planted(file), [*tests, declared])


def test_the_checks_of_a_header_begin_with_those_that_name_it():
    law = planted(HEADERS / "srm" / "control" / "law" / "deadbeat.hpp")
    files = sorted((TESTS / "core").glob("*_check.cpp"))
    tests = checks_of_headers()
    found = court.checks(law, [*tests, noted("drive/test_x.py::a", 1.0)])
    assert sorted(found) == sorted(test.name for test in tests)
    named = [file for file in files if "deadbeat" in file.read_text()]
    assert 0 < len(named) < len(files)
    first = {each.partition("[")[2].removesuffix("-g++]") for each in found[: len(named)]}
    assert first == {file.stem for file in named}


def test_the_nearest_files_judge_before_the_others():
    """Each test once, in the order that it has; a file's tests stay together."""
    names = [f"tests/base/test_{file}.py::test_{n}" for n in range(2) for file in "abcdefg"]
    first, then = portions(names)
    assert first == [name for name in names if name.partition("::")[0][-4] in "abcde"]
    assert then == [name for name in names if name.partition("::")[0][-4] in "fg"]
    assert portions(names[:3]) == (names[:3], [])


@pytest.mark.parametrize(
    "name", ["plant/test_pumping_pump.py::test_gone[1]", "base/test_gone.py::test_a"]
)
def test_a_record_of_tests_that_are_gone_judges_nothing(name, tmp_path):
    rows = [f'["tests/base/test_mutants.py::{each}", 1.0, true, []]' for each in NOW]
    (tmp_path / "1.jsonl").write_text("\n".join(rows))
    assert len(recorded(tmp_path)) == len(NOW)
    (tmp_path / "2.jsonl").write_text(f'["tests/{name}", 1.0, true, []]')
    with pytest.raises(ValueError, match="is gone; remove the folder"):
        recorded(tmp_path)


def test_what_a_test_calls_is_noted_with_what_its_file_s_fixtures_call(tmp_path, capsys):
    """One that fails without a fault judges none."""
    test = """\
import pytest
from reluctance.base import arrays, units

@pytest.fixture(scope="module")
def made():
    return units.to_si(1.0, "ms")

def test_one(made):
    assert made == 1e-3

def test_two(made):
    assert units.from_si(made, "ms") == 1.0

def test_three():
    assert False
"""
    (tmp_path / "test_a.py").write_text(test)
    order = [sys.executable, "-m", "pytest", "-q", "-p", "reached", "--reached=r"]
    environment = os.environ | {"PYTHONPATH": str(TESTS / "support")}
    assert subprocess.run([*order, "test_a.py"], cwd=tmp_path, env=environment).returncode == 1
    one, two = recorded(tmp_path / "r")
    assert "test_a.py::test_three fails without a fault" in capsys.readouterr().out
    to_si, from_si = (
        ("base/units.py", inspect.unwrap(f).__code__.co_firstlineno)
        for f in (units.to_si, units.from_si)
    )
    assert to_si in one.called and to_si in two.called
    assert from_si in two.called and from_si not in one.called
