"""Units by their definitions in the SI, and columns and files that keep what they were given."""

import os
import signal
import threading
from pathlib import Path

import numpy as np
import pytest

from reluctance.base import files, table_file, toml_file
from reluctance.base.columns import Quantity, point_hint, recognised, with_points
from reluctance.base.errors import LONGEST_LINE, ParameterError, named, need, one_line
from reluctance.base.reading import is_number, numbers, read_rows
from reluctance.base.units import UNITS, from_si, in_unit_of, name_and_unit, si, to_si

RPM = 2 * np.pi / 60
DEFINED = {
    **{"rpm": RPM, "rpmps": RPM, "rpmpV": RPM, "rpmpVs": RPM, "deg": np.pi / 180},
    **{"us": 1e-6, "uF": 1e-6, "ms": 1e-3, "mm": 1e-3, "mJ": 1e-3, "kHz": 1e3, "KiB": 1024},
    **{"pct": 1e-2, "pctpK": 1e-2, "m3ph": 1 / 3600},
}


@pytest.mark.parametrize("unit", UNITS)
def test_a_unit_is_what_its_definition_says_and_goes_back_to_the_last_bit(unit):
    assert to_si(1.0, unit) == pytest.approx(DEFINED.get(unit, 1.0), rel=1e-15)
    for value in (1500.0, 20.0, 0.1, 7.3):
        assert from_si(to_si(value, unit), unit) == pytest.approx(value, rel=4e-16)
    assert to_si(np.array([2.0, 4.0]), unit) == pytest.approx(np.array([2, 4]) * to_si(1.0, unit))
    assert name_and_unit(f"x_{unit}") == ("x", unit)


def test_1500_rpm_there_and_back_are_1500_rpm():
    assert from_si(to_si(1500.0, "rpm"), "rpm") == 1500.0
    assert to_si(3.0, None) == from_si(3.0, None) == 3.0


@pytest.mark.parametrize(
    ("key", "parts"),
    [
        ("speed_rpm", ("speed", "rpm")), ("T_s_us", ("T_s", "us")), ("N_s", ("N_s", None)),
        ("law", ("law", None)), ("u_dc", ("u_dc", None)), ("_V", ("_V", None)),
        ("i_band_A", ("i_band", "A")), ("alpha", ("alpha", None)),
    ],
)  # fmt: skip
def test_a_key_ends_in_its_unit(key, parts):
    assert name_and_unit(key) == parts


def test_lists_are_converted_and_words_truths_and_nothing_stay():
    given = {"t_ms": [1, [2.0, 3]], "on": True, "flag_V": True, "word_mm": "x", "none_A": None}
    expected = {"t": [1e-3, [2e-3, 3e-3]], "on": True, "flag": True, "word": "x", "none": None}
    assert si(given) == expected


@pytest.mark.parametrize(
    ("written", "key", "factor"),
    [
        ("u_dc_kV", "u_dc_V", 1e3), ("i_max_mA", "i_max_A", 1e-3), ("T_s_s", "T_s_us", 1e6),
        ("D_cm", "D_mm", 10), ("L_m", "L_mm", 1e3), ("until_min", "until_s", 60),
        ("until_h", "until_s", 3600), ("speed_radps", "speed_rpm", 1 / RPM),
        ("theta_rad", "theta_deg", 180 / np.pi), ("C_F", "C_uF", 1e6), ("f_MHz", "f_kHz", 1e3),
        ("U_DC_KV", "u_dc_V", None), ("u_dc_V", "u_dc_V", None), ("u_dc_A", "u_dc_V", None),
        ("u_ac_kV", "u_dc_V", None), ("E_uJ", "E_mJ", 1e-3), ("L_nH", "L_uH", 1e-3),
    ],
)  # fmt: skip
def test_a_value_in_another_unit_of_the_same_quantity_has_its_factor(written, key, factor):
    found = in_unit_of(written, key)
    assert found == (None if factor is None else pytest.approx(factor))


FLOW = {
    "Q": Quantity(("flow", "q"), {"m3/h": 1.0, "l/s": 3.6}),
    "H": Quantity(("head",), {"m": 1.0}),
}


@pytest.mark.parametrize(
    ("names", "expected"),
    [
        (["Flow [l/s]", "HEAD (m)"], {"Q": ("Flow [l/s]", 3.6), "H": ("HEAD (m)", 1.0)}),
        (["q", "note"], {"Q": ("q", 1.0)}),
        (["Q [m³/h]"], {"Q": ("Q [m³/h]", 1.0)}),
        (["head_m", "flow_l/s"], {"H": ("head_m", 1.0), "Q": ("flow_l/s", 3.6)}),
        (["overhead"], {}),
    ],
)
def test_columns_are_known_by_stem_and_unit_in_any_case(names, expected):
    assert recognised(names, FLOW) == expected


def test_a_stated_column_is_taken_whatever_its_name_and_two_of_one_kind_are_refused():
    found = recognised(["a [l/s]", "flow"], FLOW, stated={"Q": "a [l/s]"})
    assert found == {"Q": ("a [l/s]", 3.6)}
    with pytest.raises(ParameterError, match="no column `b` for Q; there are a, c"):
        recognised(["a", "c"], FLOW, stated={"Q": "b"})
    with pytest.raises(ParameterError, match="no column `a` for X"):
        recognised(["a"], FLOW, stated={"X": "a"})
    with pytest.raises(ParameterError, match="`q` and `flow` are both Q; remove one"):
        recognised(["q", "flow"], FLOW)
    with pytest.raises(ParameterError, match="has the unit `psi`, need m3/h or l/s"):
        recognised(["flow [psi]"], FLOW)


@pytest.mark.parametrize(
    ("line", "separator", "expected"),
    [
        ("1,5;2,25", ";", "1.5;2.25"), ("1,5;2.25", ";", "1,5;2.25"), ("1,5,2", ",", "1,5,2"),
        ("-0,5\t1,2e3", "\t", "-0.5\t1.2e3"), ("a,b;1", ";", "a,b;1"), (",5;1", ";", ".5;1"),
    ],
)  # fmt: skip
def test_decimal_commas_are_points_where_no_other_number_has_one(line, separator, expected):
    assert with_points([line], separator) == [expected]


def test_a_number_with_a_decimal_comma_is_told_how_to_be_written():
    assert point_hint(" 1,5 ") == "write a decimal point, as in 1.5"
    assert point_hint("1,5,2") == point_hint("1.5") == point_hint("a") == ""


def test_rows_are_cells_without_blanks_comments_and_empty_lines(tmp_path):
    (tmp_path / "a.csv").write_text("# note\n\n a ; b\n1,5; 2\n")
    assert read_rows(tmp_path / "a.csv") == [["a", "b"], ["1.5", "2"]]
    (tmp_path / "a.csv").write_text("a\tb\n1\t2\n")
    assert read_rows(tmp_path / "a.csv") == [["a", "b"], ["1", "2"]]
    (tmp_path / "a.csv").write_text("# only\n")
    with pytest.raises(ParameterError, match="no rows"):
        read_rows(tmp_path / "a.csv")
    with pytest.raises(ParameterError, match="need at most 4e-06 MB"):
        read_rows(tmp_path / "a.csv", most_bytes=4)
    assert is_number("nan") and is_number(" 1e3 ") and not is_number("1,5") and not is_number("")


def test_commas_in_numbers_and_between_them_are_told_and_other_rows_are_not(tmp_path):
    path = tmp_path / "a.csv"
    for text in ("a,b\n1,5,2,5\n", "Station 1\na,b\n1,5,2,5\n", "a,b\n1,2\n1,5,2\n"):
        path.write_text(text)
        with pytest.raises(ParameterError, match="cells for 2 names: commas stand in its numbers"):
            read_rows(path)
    for text in ("1,5,2\n", "a,b\n1,2,\n", "a\n1,2\n", "a,b\n1.5,2,7\n", "a;b\n1,5;2,5\n"):
        path.write_text(text)
        read_rows(path)


def test_a_cell_that_is_no_number_is_named_by_its_row():
    assert [*numbers([["1", "2"], ["3", "4"]], 1, "x")] == [2, 4]
    for cell, told in (
        ("", "data row 2, x: `` is not a number; fill"),
        ("1,5", "as in 1.5"),
        *((huge, "is not a finite number") for huge in ("inf", "1e301")),
    ):
        with pytest.raises(ParameterError, match=told):
            numbers([["1"], [cell]], 0, "x")
    with pytest.raises(ParameterError, match="data row 8, x: `` is not"):
        numbers([["1", "2"], ["3"]], 1, "x", first=7)


@pytest.mark.parametrize("ending", [".csv", ".npz", ".mat", ".parquet"])
def test_a_table_is_read_back_from_every_form_as_it_was(ending, tmp_path):
    table = {"x": np.array([1 / 3, -2e-300, 7.0]), "y": np.array([0.1, np.nan, 1e300])}
    path = tmp_path / f"t{ending}"
    table_file.write_table(path, table)
    if ending == ".csv":
        found = np.genfromtxt(path, delimiter=",", names=True)
    elif ending == ".npz":
        found = np.load(path)
    elif ending == ".mat":
        from scipy.io import loadmat

        found = {k: v.ravel() for k, v in loadmat(path).items() if k in table}
    else:
        import pyarrow.parquet

        found = pyarrow.parquet.read_table(path).to_pydict()
    for name, values in table.items():
        assert np.array_equal(np.array(found[name]), values, equal_nan=True)
    assert [p.name for p in tmp_path.iterdir()] == [path.name]


def test_a_table_with_words_leaves_empty_what_is_no_number(tmp_path):
    table = {"x": np.array([1 / 3, np.nan]), "why": np.array(["", "a, b"])}
    table_file.write_table(tmp_path / "t.csv", table)
    assert (tmp_path / "t.csv").read_text() == 'x,why\n0.33333333333333331,\n,"a, b"\n'


def test_files_that_belong_together_appear_all_or_not_at_all(tmp_path):
    one, two = tmp_path / "one.txt", tmp_path / "two.txt"
    one.write_text("old")

    def full(path):
        raise OSError(28, "no space")

    with pytest.raises(ParameterError, match=r"cannot write .*two\.txt: No space left on device"):
        files.write_together({one: lambda p: p.write_text("new"), two: full})
    assert one.read_text() == "old" and [p.name for p in tmp_path.iterdir()] == ["one.txt"]
    files.write_together({p: lambda q: q.write_text("new") for p in (one, two)})
    assert one.read_text() == two.read_text() == "new"
    assert one.stat().st_mode & 0o777 == 0o666 & ~umask()


def umask():
    now = os.umask(0)
    os.umask(now)
    return now


@pytest.mark.parametrize("links", [True, False])
def test_what_another_process_has_put_there_stays(links, tmp_path, monkeypatch):
    if not links:
        monkeypatch.setattr(os, "link", lambda *_: (_ for _ in ()).throw(PermissionError("no")))
    path = tmp_path / "store"
    files.write_once(path, lambda p: p.write_text("first"))
    files.write_once(path, lambda p: p.write_text("second"))
    assert path.read_text() == "first" and len(list(tmp_path.iterdir())) == 1


def test_a_signal_waits_for_what_begins_and_comes_then():
    came = []
    before = signal.signal(signal.SIGUSR1, lambda *_: came.append(1))
    try:
        assert not files.puts_off(signal.SIGUSR1)
        with files.noted():
            assert files.puts_off(signal.SIGUSR1)
            with files.noted():
                pass
            assert not came  # the outer one has not ended
        assert threading.current_thread() is threading.main_thread() and came == [1]
    finally:
        files._put_off.clear()
        signal.signal(signal.SIGUSR1, before)


def test_what_is_unfinished_is_cleared_away_and_full_folders_stay(tmp_path, monkeypatch):
    monkeypatch.setattr(files, "_new_folders", [])
    monkeypatch.setattr(files, "_unfinished", set())
    files.make_folder(tmp_path / "a" / "b")
    (tmp_path / "full").mkdir()
    files.make_folder(tmp_path / "full" / "c")
    (tmp_path / "full" / "kept").write_text("x")
    left = files._temporary(tmp_path / "x.csv")
    assert left.exists() and left.suffix == ".csv" and left.parent == tmp_path
    files._temporary(tmp_path / "y.csv").unlink()  # one that has gone by now is no error
    files.remove_unfinished()
    assert not left.exists() and not (tmp_path / "a").exists()
    assert (tmp_path / "full" / "kept").exists() and not (tmp_path / "full" / "c").exists()


@pytest.mark.parametrize(
    ("text", "value"),
    [("3", 3), ("2.5", 2.5), ("true", True), ("word", "word"), ("[1, 2]", [1, 2]), ("'x'", "x")],
)
def test_a_bare_word_is_text(text, value):
    assert toml_file.toml_value(text) == value


def test_an_error_is_one_line_that_a_terminal_can_show():
    assert one_line("a\n  b\tc") == "a b c" and one_line("a\x1b[1m") == "a?[1m"
    assert len(one_line("x" * 9999)) == LONGEST_LINE and one_line("x" * 9999).endswith("x ...")
    assert one_line("x" * LONGEST_LINE) == "x" * LONGEST_LINE
    with pytest.raises(ParameterError, match=r"^a\.toml: wrong$"), named(Path("a.toml")):
        raise ParameterError("wrong")
    with pytest.raises(ParameterError, match=r"^in a\.toml wrong$"), named(Path("a.toml")):
        raise ParameterError("in a.toml wrong")
    need(True, "x", 1, "more")
    with pytest.raises(ParameterError, match="x = 1, need more"):
        need(False, "x", 1, "more")
