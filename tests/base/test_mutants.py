"""The tool that plants small faults: what it says of a file without a fault, and of one with."""

import random
import re

import mutants
import pytest
from mutants import HEADERS, PACKAGE, ROOT, TESTS, Court, Mutant

PUMP = TESTS / "plant" / "test_pumping_pump.py"
DRAWS = [(kind, only) for kind, only in (("python", "explore/tuning"), ("cpp", "control/law"))]


def planted(file, before="", after=""):
    """A file with a fault, or as it is."""
    text = file.read_text()
    assert before in text
    return Mutant(file, 1, before, after, text.replace(before, after, 1), (file.stem,))


@pytest.mark.long
def test_an_unchanged_file_survives_and_a_planted_fault_dies(tmp_path, monkeypatch):
    monkeypatch.setattr(mutants, "judges", lambda mutant: [PUMP])
    court, pump = Court(tmp_path, 1), PACKAGE / "plant" / "hydraulics" / "pump.py"
    assert court.killer(planted(pump)) is None
    assert "test_pumping_pump.py::" in court.killer(
        planted(pump, "RHO * GRAVITY * head", "1.05 * RHO * GRAVITY * head")
    )
    assert court.killer(planted(pump)) is None  # it was put right


@pytest.mark.long
def test_the_same_holds_for_headers(tmp_path, monkeypatch):
    """Judged by a test of the law through the core built with the header."""
    monkeypatch.setattr(mutants, "judges", lambda mutant: [TESTS / "drive" / "test_laws.py"])
    court, law = Court(tmp_path, 1), HEADERS / "srm" / "control" / "law" / "deadbeat.hpp"
    assert court.killer(planted(law)) is None
    assert court.killer(planted(law, "T begin =", "begin =")) == ""  # does not compile
    assert "::" in court.killer(planted(law, "(psi_ref - begin)", "(psi_ref + begin)"))


@pytest.mark.long
def test_a_test_that_fails_without_a_fault_is_left_out(tmp_path, monkeypatch, capfd):
    monkeypatch.setattr(mutants, "judges", lambda mutant: [PUMP])
    court, pump = Court(tmp_path, 1), PACKAGE / "plant" / "hydraulics" / "pump.py"
    for place in (court.unchanged.place, tmp_path / "0"):
        with (place / PUMP.relative_to(ROOT)).open("a") as file:
            file.write("\n\ndef test_never():\n    assert False\n")
    assert court.killer(planted(pump)) is None
    assert "test_never fails without a fault" in capfd.readouterr().out


@pytest.mark.parametrize(("kind", "only"), DRAWS)
def test_a_seed_draws_the_same_faults_each_in_one_line(kind, only):
    drawn = [mutants.drawn(kind, 20, only, random.Random(3)) for _ in range(2)]
    assert drawn[0] == drawn[1]
    for mutant in drawn[0]:
        was, now = mutant.file.read_text().split("\n"), mutant.text.split("\n")
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
        ("f(size=(12, 8.5))\n", "f(size=(n, 8.5))\n"),
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


def test_every_header_and_module_has_its_judges():
    for file in [*HEADERS.rglob("srm/*/*.hpp"), *PACKAGE.rglob("*/*.py")]:
        names = mutants.folders(file)
        assert names and all((TESTS / name).is_dir() for name in names), file


@pytest.mark.parametrize("seed", range(5))
def test_a_test_of_another_folder_that_names_what_a_module_offers_judges_it(seed):
    """Tables of angles are tested in tests/drive alone; four of other folders are added."""
    file = PACKAGE / "explore" / "tuning" / "angles.py"
    judges = mutants.judges(mutants.python_mutant(file, random.Random(seed)))
    own = [test for test in judges if TESTS / "explore" in test.parents]
    others = judges[len(own) :]
    assert own and len(others) == mutants.NEAREST
    assert TESTS / "drive" / "test_angle_table.py" in others
