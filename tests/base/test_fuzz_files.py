"""The fuzzer of files finds a fault, makes it small and names it; twenty seconds of each format
(`make fuzz` takes two minutes of each, from a new seed)."""

from pathlib import Path

import fuzz_files
import pytest
from file_formats import FORMATS, Format, beside, finite
from fuzz_files import BORDERS, fuzzed, judged, smaller

from reluctance.base.errors import ParameterError


def broken(path: Path) -> object:
    """A reader with three faults."""
    data = path.read_bytes()
    if b"key" in data:
        return {}["none"]
    if b"blank" in data:
        raise ParameterError("")
    if b"nan" in data:
        return [1.0, float("nan")]
    raise ParameterError(f"{path} is refused")


FORM = Format(".txt", broken, lambda: [b"x"])


def test_a_fault_is_named_by_its_kind_and_place_and_made_small(tmp_path: Path) -> None:
    path = tmp_path / "x.txt"
    assert judged(FORM, b"x", path) == ("", False)
    assert judged(FORM, b"blank", path) == ("not_one_line", False)
    assert judged(FORM, b"nan", path) == ("accepted_not_finite", True)
    wrong, _ = judged(FORM, b"before key after", path)
    assert wrong.startswith("KeyError_test_fuzz_files_")
    assert smaller(FORM, b"before key after" * 50, wrong, tmp_path) == b"key"


@pytest.mark.parametrize("name", [name for name, form in FORMATS.items() if form.taken])
def test_every_format_begins_with_files_that_are_taken(name: str, tmp_path: Path) -> None:
    form = FORMATS[name]
    beside(tmp_path)
    for data in form.seeds():
        path = tmp_path / f"x{form.suffix}"
        path.write_bytes(form.wrap(data))
        found = form.read(path)
        assert not form.finite or finite(found)


@pytest.mark.long
@pytest.mark.parametrize("name", FORMATS)
def test_twenty_seconds_of_a_format_find_nothing(name: str) -> None:
    inputs, _, memory, finds = fuzzed(name, 20.0, 1)
    assert finds == {}
    assert inputs > 50
    assert memory < fuzz_files.MEMORY


@pytest.mark.long
@pytest.mark.parametrize("name", BORDERS)
def test_a_minute_of_a_border_of_c_finds_nothing(name: str) -> None:
    assert BORDERS[name](60.0, 1) > 10_000
