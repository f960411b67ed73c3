"""A spreadsheet is read as a CSV file of the same cells is, wherever numbers are asked for."""

import csv
from pathlib import Path

import numpy as np
import pytest

import reluctance as rl
from reluctance.base.arrays import FloatArray
from reluctance.base.errors import ParameterError
from reluctance.base.reading import is_number, read_rows
from reluctance.base.sheet import sheet_rows
from reluctance.drive.course import read_course
from reluctance.drive.laws.angle_table import read_angle_table
from reluctance.explore.efficiency_map.cycle import read_cycle
from reluctance.machine.geometry.steel_file import read_curve

ROOT = Path(__file__).parents[2]
openpyxl = pytest.importorskip("openpyxl")


def as_sheet(source: Path, target: Path) -> Path:
    """A CSV file as a program for tables saves it, below a title."""
    book = openpyxl.Workbook()
    book.active.append(["Table 1"])
    for row in csv.reader(source.read_text().splitlines()):
        book.active.append([float(cell) if is_number(cell) else cell for cell in row])
    book.save(target)
    return target


def angles_of(path: Path) -> tuple[FloatArray, ...]:
    table = read_angle_table(path)
    return table.omega, table.tau, table.theta_on, table.theta_off


@pytest.mark.parametrize(
    "name",
    ["examples/cycle.csv", "examples/village_pump.csv", "machines/emdlab_8_6_force.csv"],
)
def test_a_sheet_has_the_rows_of_the_csv_file(tmp_path: Path, name: str) -> None:
    """But for the last of the 17 digits of a number."""
    plain, sheet = (
        [[f"{float(cell):.14g}" if is_number(cell) else cell for cell in row] for row in rows]
        for rows in map(read_rows, (ROOT / name, as_sheet(ROOT / name, tmp_path / "a.xlsx")))
    )
    assert plain == sheet


def test_a_course_a_steel_and_an_angle_table_may_be_sheets(tmp_path: Path) -> None:
    course = tmp_path / "course.csv"
    course.write_text("t_s,tau_Nm\n0,10\n0.01,20\n")
    rated = ROOT / "examples" / "paper_rated.toml"
    given = [f"reference.tau_Nm={as_sheet(course, tmp_path / 'course.xlsx')}"]
    assert rl.load(rated, given).reference.values == [10, 20]
    steel = tmp_path / "steel.csv"
    steel.write_text("H [A/m],B [T]\n" + "".join(f"{100 * n**2},{n / 5}\n" for n in range(10)))
    for read, path in (read_curve, steel), (angles_of, ROOT / "examples" / "angle_table.csv"):
        both = zip(read(path), read(as_sheet(path, tmp_path / "a.xlsx")), strict=True)
        assert all(np.allclose(plain, sheet, rtol=1e-14, atol=0) for plain, sheet in both)


def test_a_comment_on_a_sheet_is_no_row(tmp_path: Path) -> None:
    book = openpyxl.Workbook()
    for row in (["# made", "by hand"], ["a", "b"], ["#", 1], [1, 2], [3, 4]):
        book.active.append(row)
    book.save(tmp_path / "a.xlsx")
    assert read_rows(tmp_path / "a.xlsx") == [["a", "b"], ["1", "2"], ["3", "4"]]


def test_a_sheet_is_its_filled_rows_and_columns(tmp_path: Path) -> None:
    book = openpyxl.Workbook()
    sheet = book.active
    cells = ((5, 2, 1.5), (5, 4, 0), (6, 2, 2), (6, 4, 1))
    for row, column, value in ((2, 2, "i_A"), (2, 4, " psi_Wb "), *cells):
        sheet.cell(row, column, value)
    book.create_sheet("other").cell(1, 1, "not this")
    book.save(tmp_path / "a.xlsx")
    assert sheet_rows(tmp_path / "a.xlsx") == [["i_A", "psi_Wb"], ["1.5", "0"], ["2", "1"]]
    book = openpyxl.Workbook()
    for text in ("notes", "of three", "lines"):
        book.active.append([text])  # a column is no table
    book.save(tmp_path / "b.xlsx")
    with pytest.raises(ParameterError, match="no sheet has a table"):
        sheet_rows(tmp_path / "b.xlsx")
    book = openpyxl.Workbook()
    book.active.cell(1, 1001, 5)
    book.save(tmp_path / "c.xlsx")
    with pytest.raises(ParameterError, match="cells beyond 200000 rows or 1000 columns"):
        sheet_rows(tmp_path / "c.xlsx")


def test_a_formula_whose_value_the_file_lacks_is_told_with_its_cell(tmp_path: Path) -> None:
    """As a script writes it."""
    book = openpyxl.Workbook()
    book.active.title = "flux"
    for row in (["i_A", "theta_m_deg", "psi_Wb"], [1, 0, 0.1], [2, 0, "=0.1*A3"], [3, 0, None]):
        book.active.append(row)
    book.save(tmp_path / "a.xlsx")
    with pytest.raises(ParameterError, match="cell C3 of sheet `flux` is a formula without its"):
        sheet_rows(tmp_path / "a.xlsx")
    book.active["C3"] = 0.2
    book.save(tmp_path / "a.xlsx")
    assert sheet_rows(tmp_path / "a.xlsx")[-1] == ["3", "0", ""]


def test_a_hidden_sheet_is_none(tmp_path: Path) -> None:
    book = openpyxl.Workbook()
    book.active.sheet_state = "hidden"
    shown = book.create_sheet("shown")
    for sheet, value in ((book.active, 3), (shown, 8)):
        for row in (["t_s", "tau_Nm"], [0, value], [1, value]):
            sheet.append(row)
    book.save(tmp_path / "a.xlsx")
    assert read_rows(tmp_path / "a.xlsx")[1:] == [["0", "8"], ["1", "8"]]


@pytest.mark.parametrize(
    ("read", "head"),
    [
        (lambda path: read_course(path, "tau_Nm"), "t_s,tau_Nm,tau_Nm"),
        (read_cycle, "t_s,speed_rpm,speed_rpm,tau_Nm"),
        (read_angle_table, "speed_rpm,torque_Nm,theta_on_deg,theta_off_deg,theta_on_deg"),
    ],
)
def test_a_column_that_stands_there_twice_is_refused(tmp_path: Path, read, head) -> None:
    twice = max(head.split(","), key=head.split(",").count)
    (tmp_path / "a.csv").write_text(
        "\n".join([head, *["1,2,3,4,5"[: 2 * head.count(",") + 1]] * 4])
    )
    with pytest.raises(ParameterError, match=f"column `{twice}` stands there 2 times; keep one"):
        read(tmp_path / "a.csv")
