"""A line that is no TOML is answered with the one that was meant."""

import pytest

from reluctance.base.errors import ParameterError
from reluctance.base.toml_file import read_toml

LINES = {
    "u_dc_V 240": "u_dc_V = 240",
    "u_dc_V: 240": "u_dc_V = 240",
    "u_dc_V := 240": "u_dc_V = 240",
    'law == "ditc"': 'law = "ditc"',
    'law = "ditc': 'law = "ditc"',
    'law = ditc"': 'law = "ditc"',
    "law = \u201cditc\u201d": 'law = "ditc"',
    "law = ditc  # a comment": 'law = "ditc"',
    "learn = True": "learn = true",
    "learn = no": "learn = false",
    "u_dc_V = 240 V": "u_dc_V = 240",
    "u_dc_V = 1 240.5": "u_dc_V = 1240.5",
    "u_dc_V = .5": "u_dc_V = 0.5",
    "u_dc_V = 5.": "u_dc_V = 5.0",
    "u_dc_V = 007": "u_dc_V = 7",
    "u_dc_V = 240;  # a comment": "u_dc_V = 240",
    "u_dc_V = 240 // V": "u_dc_V = 240",
}


def fault(path, text):
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ParameterError) as told:
        read_toml(path)
    return str(told.value)


@pytest.mark.parametrize("wrong", LINES)
def test_a_line_is_written_as_it_was_meant(wrong, tmp_path):
    line = fault(tmp_path / "a.toml", f"[converter]\n{wrong}\n[load]\n")
    assert "line 2" in line and line.endswith(f"; write `{LINES[wrong]}`")


@pytest.mark.parametrize("wrong", ["[load", "(load)"])
def test_the_head_of_a_table_is_too(wrong, tmp_path):
    assert fault(tmp_path / "a.toml", f"a = 1\n{wrong}\n").endswith("; write `[load]`")


@pytest.mark.parametrize("wrong", ["u_dc_V = 240 mV", "u_dc_V = 2O", "u_dc_V = 24 %", "u_dc_V ="])
def test_what_may_mean_another_number_is_not_guessed(wrong, tmp_path):
    assert "write" not in fault(tmp_path / "a.toml", f"{wrong}\n")


def test_what_has_no_end_is_found_by_its_line(tmp_path):
    line = fault(tmp_path / "a.toml", "a = 1\nlaw = 'ditc\"\nb = 2")
    assert line.endswith('; in line 2 write `law = "ditc"`')


@pytest.mark.parametrize("again", ["a = 2", "[b]\n[b]"])
def test_what_stands_there_twice_is_to_be_removed(again, tmp_path):
    assert fault(tmp_path / "a.toml", f"a = 1\n{again}\n").endswith("twice, remove one")
