"""Files as they should not be: each is refused on one line that names it, whichever reader it
meets. Most inputs of tests/fuzz were found by coverage-guided fuzzing and made small."""

import json
import struct
import warnings
import zipfile
import zlib
from pathlib import Path

import numpy as np
import pytest
import scipy.io
from command import refused
from file_formats import FORMATS, format_of, read_quietly

import reluctance as rl
from reluctance.base.errors import Note
from reluctance.base.reading import read_rows, reading
from reluctance.machine.maps.importers import read_map
from reluctance.machine.maps.mat_file import read_arrays
from reluctance.plant.hydraulics.curve_file import curve_from

ROOT = Path(__file__).parents[2]
FOUND = sorted(path for path in (ROOT / "tests" / "fuzz").glob("*/*"))
RATED = ROOT / "examples" / "paper_rated.toml"
DAY = ROOT / "examples" / "sun_day.toml"


@pytest.mark.parametrize("path", FOUND, ids=lambda path: f"{path.parent.name}/{path.name}")
def test_a_damaged_file_is_refused_on_one_line(path: Path) -> None:
    with pytest.raises(rl.ParameterError) as told:
        read_quietly(format_of(path.parent.name), path)
    assert str(path) in str(told.value)
    assert "\n" not in str(told.value)


@pytest.mark.parametrize(
    "fault",
    [RecursionError("deep"), MemoryError(), KeyError("x"), StopIteration(), OSError(5, "broken")],
)
def test_whatever_a_reader_raises_is_an_error_of_the_file(fault: Exception) -> None:
    path = Path("x.csv")
    with pytest.raises(rl.ParameterError, match=r"x\.csv") as told, reading(path, "a map"):
        raise fault
    with pytest.raises(rl.ParameterError) as helped, reading(path, "a map", "export it as CSV"):
        raise fault
    assert str(helped.value) == f"{told.value}; export it as CSV" and "\n" not in str(told.value)


@pytest.mark.parametrize("text", ["nan", "inf", "-inf", "1e999", "1e300", "9" * 5000])
@pytest.mark.parametrize("kind", ["map_csv", "steel", "pump", "course", "cycle"])
def test_a_column_takes_finite_numbers_only(tmp_path: Path, kind: str, text: str) -> None:
    H = [0, 100, 500, 1000, 5000, 9000]
    rows = {
        "map_csv": ["i_A,theta_deg,psi_Wb", *(f"{i},{a},{i * (1 + a)}" for i in H for a in H)],
        "steel": ["H_A_per_m,B_T", *(f"{h},{h / 5000}" for h in H)],
        "pump": ["Q_m3ph,H_m,eta", "0,30,0", "10,29,0.3", "20,28,0.5"],
        "course": ["t_s,tau_Nm", "0,1", "1,1"],
        "cycle": ["t_s,speed_rpm,tau_Nm", "0,1,1", "1,1,1"],
    }[kind]
    path = tmp_path / "x.csv"
    for place in range(rows[0].count(",") + 1):
        cells = rows[-1].split(",")
        cells[place] = text
        path.write_text("\n".join([*rows[:-1], ",".join(cells)]))
        with pytest.raises(rl.ParameterError, match="is not a finite number below 1e"):
            FORMATS[kind].read(path)


def test_a_text_may_be_in_any_usual_encoding(tmp_path: Path) -> None:
    path, text = tmp_path / "p.csv", "# 20 °C\nflow [m³/h],H_m,eta\n0,30,0\n10,29,0.3\n20,28,0.5\n"
    for encoding in ("utf-8", "utf-8-sig", "utf-16"):
        path.write_bytes(text.encode(encoding))
        assert curve_from(path, 150.0).H_0 == 30.0
    path.write_bytes(text.encode("latin-1"))
    with pytest.warns(Note, match="p.csv is not in UTF-8; it was read as Latin-1"):
        assert read_rows(path)[0][0] == "flow [m³/h]"
    with warnings.catch_warnings(), pytest.raises(Note, match="was read as Latin-1"):
        warnings.simplefilter("error")  # as a user may have it: the note is no damage of the file
        curve_from(path, 150.0)


# ---------------------------------------------------------------------------- what is unpacked


def spreadsheet(path: Path, sheet: list[bytes]) -> None:
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    book.active["A1"] = 1
    plain = path.with_name("plain.xlsx")
    book.save(plain)
    with (
        zipfile.ZipFile(plain) as given,
        zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as made,
    ):
        for name in given.namelist():
            if name != "xl/worksheets/sheet1.xml":
                made.writestr(name, given.read(name))
        with made.open("xl/worksheets/sheet1.xml", "w") as file:
            file.write(b'<?xml version="1.0"?><worksheet xmlns="http://schemas.openxmlformats.org/')
            file.write(b'spreadsheetml/2006/main"><sheetData>')
            for part in sheet:
                file.write(part)
            file.write(b"</sheetData></worksheet>")


def test_a_spreadsheet_is_bounded_by_what_it_unpacks_to(tmp_path: Path) -> None:
    path = tmp_path / "m.xlsx"
    spreadsheet(path, [b'<row><c t="str"><v>', *[b"1" * 1_000_000] * 60, b"</v></c></row>"])
    assert path.stat().st_size < 100_000
    with pytest.raises(rl.ParameterError, match="MB unpacked, need at most 50 MB"):
        read_map(path, N_r=4)
    far = [b'<row r="%d"><c r="XFD%d"><v>1</v></c></row>' % (k, k) for k in range(1, 1000)]
    spreadsheet(path, far)
    with pytest.raises(rl.ParameterError, match="beyond 200000 rows or 1000 columns"):
        read_map(path, N_r=4)


def element(kind: int, data: bytes) -> bytes:
    return struct.pack("<II", kind, len(data)) + data + bytes(-len(data) % 8)


def test_a_mat_file_is_bounded_by_what_it_unpacks_to(tmp_path: Path) -> None:
    path = tmp_path / "m.mat"
    packed = zlib.compress(struct.pack("<II", 14, 60_000_000) + bytes(60_000_000), 9)
    head = b"MATLAB 5.0 MAT-file".ljust(124) + struct.pack("<HH", 0x0100, 0x4D49)
    path.write_bytes(head + struct.pack("<II", 15, len(packed)) + packed)
    with pytest.raises(rl.ParameterError, match="more than 50 MB unpacked"):
        read_map(path, N_r=4)


@pytest.mark.parametrize("compressed", [False, True])
def test_the_arrays_of_a_mat_file_are_those_that_scipy_reads(
    tmp_path: Path, compressed: bool
) -> None:
    """SciPy as an independent reader: every kind of number, shapes, order, texts; the rest is
    passed over."""
    rng = np.random.default_rng(1)
    kinds = ("f8", "f4", "i1", "u1", "i2", "u2", "i4", "u4", "i8", "u8")
    given: dict[str, object] = {k: rng.integers(0, 100, (3, 4)).astype(k) for k in kinds}
    given |= {"deep": rng.normal(size=(2, 3, 4)), "one": 6.0, "empty": np.zeros((0, 3))}
    given |= {"text": "four", "yes": np.array([True, False])}
    given |= {"cell": np.array([1, "a"], object), "struct": {"a": 1}, "complex": np.array([1j, 2])}
    path = tmp_path / "m.mat"
    scipy.io.savemat(path, given, do_compression=compressed)
    found, theirs = read_arrays(path), scipy.io.loadmat(path)
    assert set(found) == set(given) - {"cell", "struct", "complex"}
    assert found.pop("text").item() == "four"
    for name, values in found.items():
        assert values.dtype == np.float64
        assert np.array_equal(values, theirs[name]), name


def test_a_damaged_mat_file_never_ends_the_process(tmp_path: Path) -> None:
    path, rng = tmp_path / "m.mat", np.random.default_rng(2)
    grid = rng.random((5, 6))
    for compressed in (False, True):
        scipy.io.savemat(path, {"psi": grid, "N_r": 4, "s": {"a": 1}}, do_compression=compressed)
        whole = path.read_bytes()
        for _ in range(500):
            data = bytearray(whole)
            for at in rng.integers(0, len(data), rng.integers(1, 5)):
                data[at] = rng.integers(0, 256)
            path.write_bytes(data[: rng.integers(1, len(data) + 1)])
            try:
                with reading(path, "a .mat file"):
                    read_arrays(path)
            except rl.ParameterError:
                pass


@pytest.mark.parametrize(
    "text",
    [
        json.dumps({"i_A": [0, 1]})[:-1],
        '{"i_A": ' + "[" * 100_000,
        '{"N_r": ' + "9" * 5000 + "}",
        '{"N_r": 1e999, "i_A": [0, 1, 2, 3], "theta_deg": [0, 15, 30, 45], "psi_Wb": '
        "[[0, 0, 0, 0], [1, 1, 1, 1], [2, 2, 2, 2], [3, 3, 3, 3]]}",
    ],
)
def test_a_damaged_json_map_is_one_line(tmp_path: Path, text: str) -> None:
    (tmp_path / "m.json").write_text(text)
    assert "m.json" in refused("map", "check", tmp_path / "m.json")


@pytest.mark.parametrize("quoted", ["a", '"a"'])
def test_a_key_of_a_toml_file_has_few_parts(tmp_path: Path, quoted: str) -> None:
    (tmp_path / "d.toml").write_text(".".join([quoted] * 200_000) + " = 1\n")
    assert "a key of 200000 parts, need at most 100" in refused("run", tmp_path / "d.toml")
    (tmp_path / "d.toml").write_text("# " + "." * 500 + "\nx = " + "[" * 100_000)
    assert "is not valid TOML" in refused("run", tmp_path / "d.toml")


# ------------------------------------------------------------------------------ and all the rest


@pytest.mark.parametrize("name", ["Europe", "x" * 300, "../../etc/passwd"])
def test_a_time_zone_that_is_none_is_one_line(name: str) -> None:
    assert "is unknown" in refused("pump", DAY, "--set", f"site.timezone={name}")


def test_a_name_of_a_file_that_no_terminal_shows_is_replaced(tmp_path: Path) -> None:
    for name in (b"dr\xffive.toml", b"dr\x1b[31mive.toml"):
        path = Path((bytes(tmp_path) + b"/" + name).decode("utf-8", "surrogateescape"))
        path.write_text((ROOT / "examples" / "single_pulse.toml").read_text())
        assert rl.load(path).name == ("dr?ive" if b"\xff" in name else "dr?[31mive")
