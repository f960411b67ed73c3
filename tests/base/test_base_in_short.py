"""Parts that all rooms stand on, at their edges: compilers, names of files, a cache, hints on a
mistyped value, sizes of a figure."""

import time

import matplotlib as mpl
import pytest

from reluctance.base import files, toolchain
from reluctance.base.errors import ParameterError
from reluctance.base.figures import look
from reluctance.base.picture import PANEL_WIDTH, Picture
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
    assert first_error("in/place/law.hpp:7:2: error: two\n", ["law.hpp"]) == "law.hpp:7: two"
    assert first_error("  ld:\n  " + "x" * 400, []) == ("ld: " + "x" * 400)[:300]


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
    start = time.monotonic()
    with pytest.raises(ParameterError, match=r"timed out after 0\.05"):
        run((*shell, "sleep 30"), folder=tmp_path)
    assert time.monotonic() - start < 20 and not files.unfinished_groups


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


def test_a_name_that_is_wider_than_the_figure_is_written_in_lines():
    made = Picture(3.0, 3.0)
    (line,) = made.subplots().plot([0, 1])
    made.legend_below([line], ["words " * 30])
    made._fit()
    made.draw_without_rendering()
    (legend,) = made.legends
    assert "\n" in legend.get_texts()[0].get_text()
    assert legend.get_window_extent().width <= made.get_window_extent().width
