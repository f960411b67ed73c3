"""Parts that all rooms stand on, at their edges: compilers, names of files, a cache, hints on a
mistyped value, sizes of a figure."""

import ctypes
import os
import signal
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest
from pydantic import Field

from reluctance.base import cache, files, table_file, toml_file, toolchain, unedited
from reluctance.base.columns import refuse_parted
from reluctance.base.errors import ParameterError
from reluctance.base.extension import compile_extension
from reluctance.base.figures import look
from reluctance.base.key_figures import definite
from reluctance.base.picture import PANEL_WIDTH, Picture
from reluctance.base.reading import read_rows
from reluctance.base.schema import (
    FileName,
    Section,
    check_places,
    checked,
    field_of,
    number_hint,
    placed,
)
from reluctance.base.toolchain import compiler, first_error

# A compiler.


def with_programs(monkeypatch, *names, cxx=None):
    monkeypatch.setattr(
        toolchain.shutil, "which", lambda name: f"/bin/{name}" if name in names else None
    )
    monkeypatch.delenv("CXX", raising=False)
    if cxx is not None:
        monkeypatch.setenv("CXX", cxx)


@pytest.mark.parametrize(
    ("names", "cxx", "command"),
    [
        (["g++", "clang++"], None, ["g++"]),
        (["clang++"], None, ["clang++"]),
        (["g++", "ccache"], None, ["ccache", "g++"]),
        (["g++", "ccache", "distcc"], "distcc g++", ["distcc", "g++"]),
        (["my c++"], "'my c++' -m64", ["my c++", "-m64"]),
    ],
)
def test_the_compiler_is_the_users_or_the_first_there_is_behind_a_cache(
    monkeypatch, names, cxx, command
):
    with_programs(monkeypatch, *names, cxx=cxx)
    assert compiler() == command


@pytest.mark.parametrize(("names", "cxx"), [(["ccache"], None), (["g++"], "icpx")])
def test_without_a_compiler_one_line_says_what_to_install(monkeypatch, names, cxx):
    with_programs(monkeypatch, *names, cxx=cxx)
    with pytest.raises(ParameterError, match=r"no C\+\+ compiler; on Debian: apt install g\+\+"):
        compiler()


def test_the_first_error_is_that_of_a_named_file_with_the_count_of_the_others():
    text = "a.hpp:3:1: error: one\nlaw.hpp:7:2: fatal error: two\nb.cpp:9:9: error: three\n"
    assert first_error(text, ["law.hpp"]) == "law.hpp:7: two (and 2 more)"
    assert first_error(text, ["x.hpp"]) == "a.hpp:3: one (and 2 more)"
    assert first_error(text.rpartition("b.cpp")[0], ["law.hpp"]) == "law.hpp:7: two (and 1 more)"
    assert first_error("in/place/law.hpp:7:2: error: two\n", ["law.hpp"]) == "law.hpp:7: two"
    assert first_error("  ld:\n  " + "x" * 400, []) == ("ld: " + "x" * 400)[:300]


def test_a_library_is_made_in_its_folder_of_files_there_and_no_object_is_left(tmp_path):
    """C and C++ side by side; with the first error of a file of its own where one has a fault."""
    (tmp_path / "out").mkdir()
    (tmp_path / "a.c").write_text("int two(void) { return 2; }\n")
    (tmp_path / "b.cpp").write_text(
        'extern "C" int two(); extern "C" int four() { return 2 * two(); }\n'
    )
    made = toolchain.build(["a.c", "b.cpp"], "out/it.so", ["-O0"], folder=tmp_path, what="it")
    assert made == tmp_path / "out" / "it.so" and ctypes.CDLL(str(made)).four() == 4
    assert [*(tmp_path / "out").iterdir()] == [made]
    (tmp_path / "b.cpp").write_text("\nint four() { return two; }\n")
    with pytest.raises(ParameterError, match=r"^it does not compile: b\.cpp:2: .*two"):
        toolchain.build(["a.c", "b.cpp"], "out/it.so", ["-O0"], folder=tmp_path, what="it")
    assert [*(tmp_path / "out").iterdir()] == [made]


def run(*commands, folder):
    toolchain._run([list(c) for c in commands], folder, folder, "it", ["a.cpp"])


def test_commands_run_side_by_side_and_the_first_that_fails_is_told(tmp_path, monkeypatch):
    """Their temporary files go beside the result, and none is left to be ended."""
    shell = ("sh", "-c")
    run((*shell, "echo $TMPDIR > one"), (*shell, "pwd > two"), folder=tmp_path)
    assert (tmp_path / "one").read_text().strip() == (tmp_path / "two").read_text().strip()
    with pytest.raises(ParameterError, match=r"^it does not compile: a\.cpp:3: bad$"):
        run((*shell, "true"), (*shell, "echo a.cpp:3:1: error: bad; exit 1"), folder=tmp_path)
    with pytest.raises(ParameterError, match=r"^no-such-program: .*No such file"):
        run(("no-such-program",), folder=tmp_path)
    monkeypatch.setattr(toolchain, "LIMIT", 0.05)
    ended, end_group = [], toolchain.end_group
    monkeypatch.setattr(toolchain, "end_group", lambda pid: (ended.append(pid), end_group(pid)))
    with pytest.raises(ParameterError, match=r"timed out after 0\.05"):
        run((*shell, "sleep 30"), folder=tmp_path)
    (pid,) = ended
    with pytest.raises(ProcessLookupError):  # it has been waited for
        os.kill(pid, 0)
    assert not files.unfinished_groups


def test_an_extension_needs_the_headers_of_python(tmp_path, monkeypatch):
    pytest.importorskip("nanobind")
    monkeypatch.setattr("sysconfig.get_path", lambda name: str(tmp_path))
    with pytest.raises(ParameterError, match=r"no Python\.h in .*; on Debian: apt install python3"):
        compile_extension("", tmp_path / "a.so", what="it")
    monkeypatch.setitem(sys.modules, "nanobind", None)
    with pytest.raises(ParameterError, match="nanobind is not installed: pip install"):
        compile_extension("", tmp_path / "a.so", what="it")


# Names of files, and what is left of a process that is ended.

NO_NAME = [Path("x" * 5000), Path("a\0b")]


@pytest.mark.parametrize("path", NO_NAME, ids=["long", "zero"])
def test_a_name_that_no_file_can_have_names_none(path):
    assert not files.is_file(path) and not files._is_dir(path) and not files.exists(path)
    with pytest.raises(ParameterError, match="cannot read "):
        toml_file.read_toml(path)
    files.begin_command()
    try:
        files.note_input(path)
    finally:
        files.end_command()


def test_a_result_replaces_no_file_that_was_read_but_one_that_is_edited(tmp_path):
    """Within a command; outside of one, nothing is remembered."""
    path = tmp_path / "a.toml"
    path.write_text("")
    files.edit_input(path)
    files.note_input(path)
    files.check_place(path)
    files.begin_command()
    try:
        files.check_place(path)
        files.note_input(path)
        with pytest.raises(ParameterError, match=r"a\.toml"):
            files.check_place(path)
        files.edit_input(path)
        files.check_place(path)
    finally:
        files.end_command()


def test_a_place_without_the_right_to_write_is_told(tmp_path, monkeypatch):
    monkeypatch.setattr(os, "access", lambda *_: False)
    with pytest.raises(ParameterError, match=r"no right to write in .*; choose another folder"):
        files.check_place(tmp_path / "a.csv")
    with pytest.raises(ParameterError, match=f"no right to write in {tmp_path}; take another"):
        files.check_folder(tmp_path / "a" / "b", "take another")


def test_what_stands_in_the_place_of_a_result_is_told(tmp_path):
    (tmp_path / "f").write_text("")
    for path, said in (
        (tmp_path, "is a folder, need a file; choose another name"),
        (tmp_path / "none" / "a.csv", "does not exist; make it first"),
        (tmp_path / "f" / "a.csv", "does not exist; make it first"),
    ):
        with pytest.raises(ParameterError, match=said):
            files.check_place(path)
    with pytest.raises(ParameterError, match="f is a file, need a folder; choose another --out"):
        files.check_folder(tmp_path / "f" / "a" / "b")
    for name, said in (("a.xyz", "ending `.xyz`, need one of .csv, .npz"), ("a", "no ending, ")):
        with pytest.raises(ParameterError, match=said):
            files.check_ending(tmp_path / name, {".npz", ".csv"})
    assert files.check_ending(tmp_path / "A.CSV", {".npz", ".csv"}) == ".csv"


def test_compilers_and_folders_of_a_process_that_is_ended_are_cleared_away(tmp_path, monkeypatch):
    for name in ("_unfinished", "unfinished_groups"):
        monkeypatch.setattr(files, name, set())
    sleeper = subprocess.Popen(["sleep", "60"], process_group=0)
    files.unfinished_groups.add(sleeper.pid)
    with files.scratch(tmp_path) as place:
        (place / "inner").mkdir()
        (place / "inner" / "a").write_text("x")
        assert files._unfinished == {place}
        files.remove_unfinished()
        assert not place.exists()
        place.mkdir()  # for what removes it at the end
    assert sleeper.wait(10) == -signal.SIGKILL and not files._unfinished
    files.end_group(sleeper.pid)  # that has ended


@pytest.mark.parametrize(("dots", "refused"), [(100, False), (101, True)])
def test_a_key_has_a_hundred_points_at_most(tmp_path, dots, refused):
    path = tmp_path / "a.toml"
    path.write_text("a" + ".b" * dots + " = 1\n# " + "." * 500 + "\n")
    if not refused:
        toml_file.read_toml(path)
        return
    with pytest.raises(ParameterError, match="a key of 102 parts, need at most 100; check"):
        toml_file.read_toml(path)


def test_a_toml_file_has_a_megabyte_at_most(tmp_path):
    path = tmp_path / "a.toml"
    path.write_text("a = 1\n" + "#" * (toml_file.MAX_TOML_BYTES - 6))
    assert toml_file.read_toml(path) == {"a": 1}
    path.write_text("a = 1\n" + "#" * (toml_file.MAX_TOML_BYTES - 5))
    with pytest.raises(ParameterError, match="has more than 1 MB, need a TOML file of some"):
        toml_file.read_toml(path)


def test_without_parquet_support_one_line_says_what_to_install(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(ParameterError, match="parquet needs pyarrow; `pip install"):
        table_file.write_table(tmp_path / "a.parquet", {"x": np.zeros(2)})
    assert not [*tmp_path.iterdir()]


def test_a_file_that_is_not_there_is_answered_with_the_one_that_was_meant(tmp_path):
    (tmp_path / "mine.toml").write_text("a = 1\n")
    (tmp_path / "ditc.toml").mkdir()  # is there, and no file

    def told(name: str) -> str:
        with pytest.raises(ParameterError) as fault:
            toml_file.read_toml(tmp_path / name)
        return str(fault.value)

    assert told("mine").endswith(f"; did you mean {tmp_path}/mine.toml?")
    assert "`reluctance examples deadbeat --copy .` copies" in told("deadbeat.toml")
    assert ";" not in told("nothing.toml") and ";" not in told("ditc.toml")


def test_the_remedy_of_an_edited_file_needs_its_content(tmp_path):
    with pytest.raises(
        ParameterError, match=r"cannot read .*none: No such file .*; choose another"
    ):
        unedited._content(tmp_path / "none")
    unedited.write_unedited(tmp_path / "a.toml", "x = 1\n")
    unedited.write_unedited(tmp_path / "a.toml", "x = 2\n")
    assert (tmp_path / "a.toml").read_text().startswith("x = 2\n# As written by reluctance")


# A cache.


@dataclass
class Kept:
    a: np.ndarray
    b: float


def test_a_result_is_kept_under_all_that_it_depends_on(tmp_path, monkeypatch):
    monkeypatch.setenv("RELUCTANCE_CACHE", str(tmp_path / "c"))
    made = []

    def of(inputs, algorithm):
        def compute():
            made.append(1)
            return Kept(np.arange(3.0), 2.5)

        return cache.cached(Kept, inputs, compute, algorithm=algorithm)

    for inputs, algorithm, count in (
        *(([1, "a"], 1, 1), ([1, "a"], 1, 1), ([1, "b"], 1, 2), ([1, "a"], 2, 3)),
        *(([np.float64(1), "a"], 1, 4), ([1, "a"], 1, 4)),
    ):
        found = of(inputs, algorithm)
        assert len(made) == count and found.a.tolist() == [0, 1, 2] and found.b == 2.5
        assert type(found.b) is float
    assert {p.suffix for p in (tmp_path / "c").iterdir()} == {".npz"}


def test_a_fault_of_the_computation_says_nothing_of_a_file_that_is_not_kept_yet():
    def compute():
        raise ParameterError("no such thing")

    with pytest.raises(ParameterError) as told:
        cache.cached(Kept, ["fault"], compute, algorithm=1)
    assert told.value.__context__ is None


def test_the_cache_is_where_the_user_or_the_system_keeps_such(monkeypatch):
    monkeypatch.delenv("RELUCTANCE_CACHE")
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    assert cache.folder() == Path.home() / ".cache" / "reluctance"
    monkeypatch.setenv("XDG_CACHE_HOME", "/x")
    assert cache.folder() == Path("/x/reluctance")
    monkeypatch.setenv("RELUCTANCE_CACHE", "/own")
    assert cache.folder() == Path("/own")


def test_a_result_that_cannot_be_kept_leaves_nothing_behind(tmp_path, monkeypatch):
    def full(*_):
        raise OSError(28, "no space")

    monkeypatch.setattr(os, "replace", full)
    cache._store(tmp_path / "a.npz", {"x": 1.0})
    assert not [*tmp_path.iterdir()]


# Cells and values.


@pytest.mark.parametrize(
    ("text", "rows"),
    [
        ("a;b\n1;2\nx,y\n", [["a", "b"], ["1", "2"], ["x,y"]]),  # two of three lines
        ("a;b\nc,d\n", [["a;b"], ["c", "d"]]),  # half of them
        ("a\tb\n1\t2\n", [["a", "b"], ["1", "2"]]),
        ("a,b\n1,2\n", [["a", "b"], ["1", "2"]]),
        ("a b\n1  2\n", [["a", "b"], ["1", "2"]]),  # blanks, where each row has as many cells
        ("a b c\n1 2\n3 4 5\n", [["a b c"], ["1 2"], ["3 4 5"]]),
        ("a b\nc d\n", [["a b"], ["c d"]]),  # between numbers alone
        ("a\tb\tc\n1\t\t3\n4\t5\t6\n", [["a", "b", "c"], ["1", "", "3"], ["4", "5", "6"]]),
    ],
)
def test_cells_part_at_what_stands_in_most_lines(tmp_path, text, rows):
    (tmp_path / "a.csv").write_text(text)
    assert read_rows(tmp_path / "a.csv") == rows


def test_empty_cells_at_the_end_are_none():
    refuse_parted([["a", "b", ""], ["1", "2", "", ""]])
    refuse_parted([["a"], ["1", "2"]])
    refuse_parted([["a", "b"], ["1", "2.5", "3"]])
    with pytest.raises(ParameterError, match="the row `1,2,3` has 3 cells for 2 names"):
        refuse_parted([["a", "b", ""], ["1", "2", "3"]])


@pytest.mark.parametrize(
    ("text", "key", "told"),
    [
        ("5 kV", "u_dc_V", "; write the number alone, as in 5000"),
        ("5 V", "u_dc_V", "; write the number alone, as in 5"),
        ("5 apples", "u_dc_V", "; write the number alone, in V"),
        ("5 apples", "gain", "; write the number alone, without a unit"),
        ("1-5", "u_dc_V", "; a range is FROM:TO:COUNT, as in 1:5:5"),
        ("1,5", "u_dc_V", "; write a decimal point, as in 1.5"),
        ("none", "u_dc_V", "; to give none, leave the key out (--set TABLE.u_dc_V= removes it)"),
        ("much", "u_dc_V", ""),
    ],
)
def test_a_text_that_is_no_number_is_told_how_to_be_written(text, key, told):
    assert number_hint(text, key) == told


# Sizes of a figure.


def test_a_figure_has_the_width_that_is_asked_for_and_its_own_shape():
    assert tuple(Picture(8, 4).get_size_inches()) == (8, 4)
    with look(None, "4in"):
        assert tuple(Picture(8, 4).get_size_inches()) == (4, 2)
    with mpl.rc_context({"figure.figsize": (5, 6)}):
        assert tuple(Picture(8, 4).get_size_inches()) == (5, 6)
        with look(None, "4in"):
            assert tuple(Picture(8, 4).get_size_inches()) == (4, 2)
    for width, one in ((2 * PANEL_WIDTH - 0.01, True), (2 * PANEL_WIDTH, False)):
        assert Picture(width, 3).one_column == one


@pytest.mark.parametrize(("rows", "height"), [(1, 1.2), (2, 3.4)])
def test_panels_below_each_other_have_a_height_and_one_alone_what_is_asked_for(
    tmp_path, rows, height
):
    made = Picture(6, 1.2)
    made.subplots(rows, 1)
    made._stack_narrow_panels()
    assert tuple(made.get_size_inches()) == pytest.approx((6, height))


def test_a_name_that_is_wider_than_the_figure_is_written_in_lines():
    made = Picture(3.0, 3.0)
    (line,) = made.subplots().plot([0, 1])
    made.legend_below([line], ["words " * 30])
    made._fit()
    made.draw_without_rendering()
    (legend,) = made.legends
    assert "\n" in legend.get_texts()[0].get_text()
    assert legend.get_window_extent().width <= made.get_window_extent().width


# Tables within tables.


class Inner(Section):
    R_ohm: float = 1.0
    counts: list[int] = Field(default_factory=list)


class Outer(Section):
    inner: Inner
    speed_rpm: float = 1.0


class Other(Section):
    called = "named"
    tau_Nm: float = 1.0
    speed_rpm: float = 1.0


class Loose(Section, extra="allow"):
    pass


@pytest.mark.parametrize(
    ("given", "told"),
    [
        ({}, "missing table [outer.inner]"),
        ({"inner": {"R_ohm": "x"}}, "[outer.inner] R_ohm = 'x', need a number"),
        (
            {"inner": {"R_ohms": 2.0}},
            "unknown key `R_ohms` in [outer.inner]; did you mean `R_ohm`?",
        ),
        (
            {"inner": {"R_mohm": 2.0}},
            "unknown key `R_mohm` in [outer.inner]; did you mean `R_ohm = 0.002`?",
        ),
        ({"inner": 3}, "[outer] inner = 3, need a table"),
        ({"inner": {"counts": [1, 2.5]}}, "[outer.inner] counts.1 = 2.5, need a whole number"),
        ({"inner": {}, "speed_radps": 2}, "did you mean `speed_rpm = 19.09859317`?"),
        ({"inner": {}, "speed_radps": True}, "unknown key `speed_radps` in [outer]; did you mean"),
        (
            {"inner": {}, "a": 1, "b": 2},
            "unknown key `a` in [outer]; known: `inner`, `speed_rpm` (and 1 more)",
        ),
        ([1], "[outer] = [1], need a table"),
    ],
)
def test_a_fault_is_named_by_its_place_within_the_tables(given, told):
    with pytest.raises(ParameterError) as fault:
        checked(Outer, given, "[outer]")
    assert told in str(fault.value) and "(and 0 more)" not in str(fault.value)
    if "True" in repr(given):
        assert "= " not in str(fault.value)


class WithFiles(Section):
    map: FileName | None = None
    name: str = ""
    counts: dict[str, str] = Field(default_factory=dict)


class Around(Section):
    map: FileName = "a.csv"
    inner: WithFiles = Field(default_factory=WithFiles)


def test_names_of_files_are_those_of_the_folder_in_every_table_and_no_other_text_is():
    inner = {"map": "b.csv", "name": "c.csv", "counts": {"map": "d.csv"}}
    given = {"map": "a.csv", "inner": inner, "unknown": {"map": "e.csv"}, "other": "f.csv"}
    inner_placed = {**inner, "map": "x/b.csv"}
    assert placed(Around, given, Path("x")) == {**given, "map": "x/a.csv", "inner": inner_placed}
    assert given["inner"] == inner
    table = checked(Around, {"inner": {"map": "b.csv", "name": "c.csv"}}, "[around]")
    assert table.files == [Path("a.csv"), Path("b.csv")]
    assert table.given == {"inner": {"map": "b.csv", "name": "c.csv"}}


def test_a_key_is_found_in_the_tables_within_a_table():
    assert field_of(Outer, ["inner", "R_ohm"]) is Inner.model_fields["R_ohm"]
    assert field_of(Outer, ["speed_rpm"]) is Outer.model_fields["speed_rpm"]
    for path in (["inner", "none"], ["speed_rpm", "R_ohm"], ["none", "R_ohm"], ["none"]):
        assert field_of(Outer, path) is None


@pytest.mark.parametrize(
    ("data", "told"),
    [
        ({"inner": {"tau_Nm": 1}}, "unknown key `tau_Nm` in [a.inner]; it belongs in [a.other]"),
        ({"inner": {"speed_rpm": 1}}, "it belongs in [a.other] or [a.outer]"),
        ({"inner": {"speed_rpm": 1}, "other": {}}, "it belongs in [a.other]"),
        (
            {"inner": {"speed_rpm": 1}, "other": {"speed_rpm": 2}},
            "it belongs in [a.outer]",
        ),
        (
            {"inner": {"tau_Nm": 1}, "other": {"tau_Nm": 2}},
            "unknown key `tau_Nm` in [a.inner]; remove it, [a.other] has it",
        ),
        ({"inner": {"nobody": 1, "R_ohm": 1}}, None),
        ({"loose": {"tau_Nm": 1}, "unknown": {"tau_Nm": 1}, "other": 3}, None),
    ],
)
def test_a_key_in_another_table_than_its_own_is_told_where_it_belongs(data, told):
    kinds = {"inner": Inner, "other": Other, "outer": Outer, "loose": Loose}
    if told is None:
        check_places(data, kinds, "a.")
        return
    with pytest.raises(ParameterError) as fault:
        check_places(data, kinds, "a.")
    assert str(fault.value).endswith(told)


def test_a_key_figure_without_a_meaning_is_none_to_compute_with():
    assert definite(0.0) == 0.0
    with pytest.raises(RuntimeError, match="a key figure without meaning here"):
        definite(None)
