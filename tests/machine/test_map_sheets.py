"""Flux tables as benches and programs leave them: lines above the names, rows of units, sheets,
structs, whole turns of the shaft."""

import numpy as np
import pytest
from test_map_forms import CURRENTS, HALF, HALF_DEG, is_the_machine, long_rows, sampled

from reluctance import ParameterError
from reluctance.base.errors import Note
from reluctance.machine.maps import check_map, read_map

ABOVE = "Bench 2, 3.4.2026;Room 7;;;\nMachine: SRM 8/6;;;;\n;;;;\n"
NAMES = ["Pos [deg]", "Strangstrom [A]", "verk. Fluss [mVs]", "Moment [Nm]", "Note"]


def rows(factor=1.0):
    return [(a, i, factor * p, t) for i, a, p, t in long_rows(*sampled(HALF))]


def test_lines_above_the_names_of_a_bench_are_no_data(tmp_path):
    path = tmp_path / "bench.csv"
    body = "".join(";".join(f"{v:.12g}" for v in row) + ";ok\n" for row in rows(1e3))
    path.write_text(ABOVE + ";".join(NAMES) + "\n" + body.replace(".", ","))
    is_the_machine(read_map(path, N_r=6))


@pytest.mark.parametrize(
    "units", ["deg,A,mWb,mNm", "(deg),(A),(mWb),(mN.m)", "[deg],[A],[mVs],[mNm]"]
)
def test_a_row_of_units_below_the_names_counts(units, tmp_path):
    path = tmp_path / "m.csv"
    body = "".join(f"{a:.12g},{i:.12g},{1e3 * p:.12g},{1e3 * t:.12g}\n" for a, i, p, t in rows())
    path.write_text(f"Angle,Ia,Flux,Torque\n{units}\n{body}")
    is_the_machine(read_map(path, N_r=6, names={"i": "Ia"}))


def test_two_units_make_a_row_of_units_and_one_does_not(tmp_path):
    """What has none there is in SI units."""
    path = tmp_path / "m.csv"
    body = "".join(f"{a:.12g},{i:.12g},{p:.12g},{t:.12g}\n" for a, i, p, t in rows())
    path.write_text(f"Angle,Current,Flux,Torque\ndeg,A,,\n{body}")
    is_the_machine(read_map(path, N_r=6))
    path.write_text(f"Angle,Current,Flux,Torque\ndeg,,,\n{body}")
    with pytest.raises(ParameterError):
        read_map(path, N_r=6)


def test_a_title_above_a_grid_and_a_cover_sheet_before_it_are_passed_over(tmp_path):
    openpyxl = pytest.importorskip("openpyxl")
    psi = sampled(HALF)[0]
    grid = [
        ["I (A) \\ pos (deg)", *HALF_DEG],
        *([i, *p] for i, p in zip(CURRENTS, psi, strict=True)),
    ]
    book = openpyxl.Workbook()
    book.active.append(["Flux linkage (Vs)"])
    for row in grid:
        book.active.append([v if isinstance(v, str) else float(v) for v in row])
    book.save(tmp_path / "titled.xlsx")
    is_the_machine(read_map(tmp_path / "titled.xlsx", N_r=6), torque=False)
    cover = book.create_sheet("Cover", 0)
    cover.append(["Project X"])
    book.save(tmp_path / "covered.xlsx")
    with pytest.warns(Note, match="sheet `Sheet` is read, the first one with a table"):
        is_the_machine(read_map(tmp_path / "covered.xlsx", N_r=6), torque=False)


def test_an_empty_corner_of_a_sheet_is_no_formula_without_its_value(tmp_path):
    """A cell with a formula whose value was never computed is named."""
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    book.active.append([None, *map(float, HALF_DEG)])
    for i, flux in zip(CURRENTS, sampled(HALF)[0], strict=True):
        book.active.append([float(i), *map(float, flux)])
    book.save(tmp_path / "m.xlsx")
    is_the_machine(read_map(tmp_path / "m.xlsx", N_r=6), torque=False)
    book.active["D5"] = "=D4*2"
    book.save(tmp_path / "m.xlsx")
    with pytest.raises(ParameterError, match="cell D5 of sheet `Sheet` is a formula without its"):
        read_map(tmp_path / "m.xlsx", N_r=6)


def test_a_struct_of_matlab_is_answered_with_the_command_that_saves_its_fields(tmp_path):
    from scipy.io import savemat

    fields = {"i": CURRENTS, "theta_deg": HALF_DEG, "psi": sampled(HALF)[0]}
    for beside in ({}, {"N_r": 6.0}):  # a single number is no array
        savemat(tmp_path / "m.mat", {"motor": fields} | beside)
        with pytest.raises(ParameterError, match=r"`motor`; of a struct, .*'-struct', 'motor'"):
            read_map(tmp_path / "m.mat", N_r=6)
    savemat(tmp_path / "m.mat", fields)  # what that command writes
    is_the_machine(read_map(tmp_path / "m.mat", N_r=6), torque=False)


@pytest.mark.parametrize("name", ["theta_m_deg", "theta_deg", "theta_m_rad"])
@pytest.mark.parametrize("step", [2.5, 3.5])
def test_a_whole_turn_of_the_shaft_is_read_as_its_first_period(name, step, tmp_path):
    path = tmp_path / "turn.csv"
    n = round(360 / step)
    turn = np.arange(n + 1) * 360 / n
    psi, tau = sampled(np.radians(6 * turn))
    written = np.radians(turn) if name.endswith("rad") else turn
    text = "".join(
        f"{i:.12g},{a:.12g},{psi[k, m]:.12g},{tau[k, m]:.12g}\n"
        for k, i in enumerate(CURRENTS)
        for m, a in enumerate(written)
    )
    path.write_text(f"i_A,{name},psi_Wb,tau_Nm\n{text}")
    table = read_map(path, N_r=6)
    assert "6 periods of" in table.notes[0]
    psi, tau = sampled(table.theta_e)
    assert np.abs(table.psi - psi).max() < 2e-3 * psi.max()
    assert np.abs(table.tau - tau).max() < 2e-2 * np.abs(tau).max()
    assert check_map(table).verdict == "good"


def test_a_whole_turn_with_other_poles_is_answered_with_the_poles_that_it_has(tmp_path):
    path = tmp_path / "turn.csv"
    turn = np.arange(0, 361, 3.0)
    psi, _ = sampled(np.radians(6 * turn))
    path.write_text(
        "i_A,theta_deg,psi_Wb\n"
        + "".join(
            f"{i},{a},{psi[k, m]:.12g}\n"
            for k, i in enumerate(CURRENTS)
            for m, a in enumerate(turn)
        )
    )
    with pytest.raises(ParameterError, match=r"rises and falls 6 times .*, N_r is 6: correct N_r"):
        read_map(path, N_r=8)
    assert check_map(read_map(path, N_r=6)).verdict == "good"


def test_samples_that_are_no_grid_say_what_to_do_with_them(tmp_path):
    path = tmp_path / "m.csv"
    good = [f"{a:.12g},{i:.12g},{p:.12g}\n" for a, i, p, _ in rows()]
    head = "theta_deg,i_A,psi_Wb\n"
    path.write_text(head + "".join([*good, good[3]]))
    with pytest.raises(ParameterError, match=r"2 times, .*; remove all but one of them"):
        read_map(path, N_r=6)
    path.write_text(head + "".join(good[:40] + good[41:]))
    with pytest.raises(ParameterError, match=r"is missing, .*; add it, or leave out its whole"):
        read_map(path, N_r=6)
    drawn = np.random.default_rng(1)
    loose = [f"{a:.12g},{i * drawn.normal(1, 1e-3):.12g},{p:.12g}\n" for a, i, p, _ in rows()]
    path.write_text(head + "".join(loose))
    with pytest.raises(ParameterError, match="scattered: interpolate them to the same currents"):
        read_map(path, N_r=6)


def test_a_flux_linkage_that_is_largest_before_alignment_is_taken_where_torque_shows_the_zero(
    tmp_path,
):
    """As of a yoke that saturates once the poles overlap: psi = L0 i (g + 1/5), with g' = 0 at both
    ends."""
    theta = np.linspace(0, np.pi, 31)
    x, dx = (1 - np.cos(theta)) / 2, np.sin(theta) / 2
    g = x * (1 + 0.6 * np.sin(theta) ** 2)
    dg = dx * (1 + 0.6 * np.sin(theta) ** 2) + 0.6 * x * np.sin(2 * theta)
    i = np.linspace(0, 5, 6)[:, None]
    psi, tau = 0.1 * i * (g + 0.2), 6 * 0.05 * i**2 * dg
    assert psi.max() > 1.05 * psi[-1, -1]
    path = tmp_path / "m.csv"

    def write(names, *tables):
        rows = [
            ",".join(
                f"{v:.12g}" for v in (i[k, 0], np.degrees(theta[n]), *(t[k, n] for t in tables))
            )
            for k in range(len(i))
            for n in range(len(theta))
        ]
        path.write_text("\n".join([f"i_A,theta_e_deg,{names}", *rows]))

    write("psi_Wb", psi)
    with pytest.raises(ParameterError, match=r"If it is right, .* give the torque too"):
        read_map(path, N_r=6, zero="unaligned")
    write("psi_Wb,tau_Nm", psi, tau)
    table = read_map(path, N_r=6, zero="unaligned")
    assert table.psi == pytest.approx(psi, rel=1e-9) and table.tau == pytest.approx(tau, rel=1e-9)
    assert check_map(table).verdict == "good"
