"""A file that somebody has edited is never overwritten; one that nobody has edited is."""

import tomllib
from pathlib import Path

import pytest
from command import command, refused

import reluctance as rl
from reluctance.base.errors import ParameterError
from reluctance.base.unedited import check_unedited, write_unedited

ROOT = Path(__file__).parents[2]
RATED = ROOT / "examples" / "paper_rated.toml"
CUBIC = ROOT / "examples" / "sharing_cubic.toml"
TUNED = ("tune", CUBIC, "--vary", "control.i_band_A=1:2", "--minimise", "i_rms", "--budget", "4")
DAY = ROOT / "examples" / "sun_day.toml"
MAP = ROOT / "machines" / "guc_linear_6_4.csv"
IMPORT = ("map", "import", MAP, "--N_r", "4", "--angle_kind", "electrical", "--N_s", "6")
IMPORT = (*IMPORT, "--R_ohm", "1", "--J_kgm2", "0.01")


def written(folder, text="a = 1\n", table="x\n1\n"):
    first = folder / "m.toml"
    write_unedited(first, text, {folder / "m.csv": lambda path: path.write_text(table)})
    return first


def test_what_nobody_edited_is_written_again(tmp_path):
    first = written(tmp_path)
    once = first.read_text()
    assert once.startswith("a = 1\n# ") and tomllib.loads(once) == {"a": 1}
    assert written(tmp_path).read_text() == once
    assert written(tmp_path, "a = 2\n", "x\n2\n").read_text() != once
    assert (tmp_path / "m.csv").read_text() == "x\n2\n"
    for path in (first, tmp_path / "m.csv"):  # as a checkout on another system
        path.write_bytes(path.read_bytes().replace(b"\n", b"\r\n"))
    written(tmp_path)


@pytest.mark.parametrize("name", ["m.toml", "m.csv"])
@pytest.mark.parametrize(
    "edit",
    [
        lambda text: text.replace("1", "3", 1),
        lambda text: text + "b = 3\n",
        lambda text: "# mine\n" + text,
    ],
)
def test_an_edited_file_stays_and_the_remedies_work(tmp_path, name, edit):
    first, path = written(tmp_path), tmp_path / name
    path.write_text(edit(path.read_text()))
    mine = path.read_text()
    removed = {"m.toml": "m.toml, m.csv", "m.csv": "m.csv"}[name]
    with pytest.raises(
        ParameterError, match=f"{name} has been edited; remove {removed}, or choose an"
    ):
        written(tmp_path)
    assert path.read_text() == mine
    write_unedited(tmp_path / "other.toml", "a = 1\n")
    path.unlink()
    if name == "m.toml":  # nothing says then whose the table is
        with pytest.raises(ParameterError, match=r"m\.csv exists, and may have been edited"):
            written(tmp_path)
        (tmp_path / "m.csv").unlink()
    assert written(tmp_path) == first


def test_a_file_of_somebody_else_stays(tmp_path):
    (tmp_path / "m.toml").write_bytes(b"\xff\x00 mine\n")
    with pytest.raises(ParameterError, match=r"m\.toml exists, and may have been edited"):
        check_unedited(tmp_path / "m.toml")
    check_unedited(tmp_path / "none.toml", [tmp_path / "none.csv"])


@pytest.mark.parametrize(
    "arguments",
    [
        (*IMPORT, "--out"),
        (*TUNED, "--until", "0.02", "--out"),
        ("pump", DAY, "--write-drive"),
    ],
    ids=["map import", "tune", "pump"],
)
def test_commands_that_write_a_file_to_edit_treat_it_alike(tmp_path, arguments):
    out = tmp_path / "mine.toml"
    for _ in range(2):
        assert command(*arguments, out).code == 0
    out.write_text(out.read_text().replace("# As", "# mine\n# As"))
    mine = out.read_bytes()
    line = refused(*arguments, out)
    assert "mine.toml has been edited; remove mine.toml" in line
    assert out.read_bytes() == mine
    for name in line.partition("; remove ")[2].partition(", or choose")[0].split(", "):
        (tmp_path / name).unlink()
    assert command(*arguments, out).code == 0


def test_a_drive_that_a_search_starts_from_is_not_overwritten(tmp_path):
    own = tmp_path / "own.toml"
    own.write_text(CUBIC.read_text())
    line = refused(TUNED[0], own, *TUNED[2:], "--out", own)
    assert "own.toml exists, and may have been edited" in line
    assert own.read_text() == CUBIC.read_text()
    with pytest.raises(ParameterError, match="may have been edited"):
        rl.load(own).save(own)


def test_no_result_replaces_what_its_command_reads(tmp_path):
    table = tmp_path / "t.csv"
    table.write_bytes(MAP.read_bytes())
    poles = ("--N_r", "4", "--angle_kind", "electrical")
    line = refused("map", "check", table, *poles, "--repair", table)
    assert "t.csv is read by this command; name another file for its result" in line
    assert table.read_bytes() == MAP.read_bytes()
    assert command("map", "check", table, *poles, "--repair", tmp_path / "u.csv").code == 0
    theirs = tmp_path / "bench.csv"
    theirs.write_text("current,angle,flux\n1,2,3\n")
    line = refused("map", "check", table, *poles, "--repair", theirs)
    assert "bench.csv exists, and is no table with the columns that this command writes" in line
    assert theirs.read_text() == "current,angle,flux\n1,2,3\n"
    assert command("map", "check", table, *poles, "--repair", tmp_path / "u.csv").code == 0
    drive = tmp_path / "d.toml"
    drive.write_text(RATED.read_text())
    assert "is read by this command" in refused("export", "blob", drive, "--out", drive)
    assert drive.read_text() == RATED.read_text()
    cycle = tmp_path / "cycle.csv"
    cycle.write_text("t_s,speed_rpm,tau_Nm\n0,500,10\n1,900,10\n")
    line = refused("efficiency", CUBIC, "--cycle", cycle, "--out", cycle)
    assert "is read by this command" in line and "speed_rpm" in cycle.read_text()
