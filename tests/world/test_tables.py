"""Tables of magnetics in the forms that others hold: current over flux linkage, axes as matrices,
torque of one side at the corners of a textbook inductance."""

import csv
from pathlib import Path

import numpy as np
import pytest
from command import command, refused
from scipy.io import savemat
from scipy.optimize import brentq

from reluctance import ParameterError, _core
from reluctance.machine.maps import FluxTable, check_map, read_map, write_map

ROOT = Path(__file__).parents[2]
SHARING = (ROOT / "examples" / "sharing_cubic.toml", "--until", 0.01, "--set", "reference.tau_Nm=9")
L_U, L_A, L_S, I_0 = 13.2e-3, 120e-3, 8e-3, 3.0


def psi(i: float, theta_e: float) -> float:
    L = L_U + (L_A - L_U) * (1 - np.cos(theta_e)) / 2
    return float(L_S * i + (L - L_S) * I_0 * (1 - np.exp(-i / I_0)))


def inverse() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Flux linkages, angles in degrees from alignment, and the currents of each."""
    levels, angles = np.linspace(0, 0.10, 21), np.linspace(0, 180, 19)
    of = [
        [brentq(lambda x, p=p, a=a: psi(x, np.pi - np.radians(a)) - p, 0, 500) for p in levels]
        for a in angles
    ]
    return levels, angles, np.array(of)


@pytest.mark.parametrize("form", ["long", "grid"])
def test_current_over_flux_linkage_is_turned(tmp_path: Path, form: str) -> None:
    """Up to the current that every angle reaches; never a machine of 0.1 A and 10 Wb."""
    levels, angles, currents = inverse()
    if form == "long":
        lines = ["theta_e_deg,psi_Wb,i_A"] + [
            f"{a},{p},{currents[n, k]}" for n, a in enumerate(angles) for k, p in enumerate(levels)
        ]
    else:
        lines = [",".join(["", *map(str, levels)])]
        lines += [",".join(map(str, [a, *row])) for a, row in zip(angles, currents, strict=True)]
    (tmp_path / "m.csv").write_text("\n".join(lines))
    for zero in (None, "aligned"):
        table = read_map(tmp_path / "m.csv", N_r=4, zero=zero)
        assert table.i[-1] == pytest.approx(currents[:, -1].min())
        true = [[psi(i, theta) for theta in table.theta_e] for i in table.i]
        assert table.psi == pytest.approx(np.array(true), abs=2e-5)
        assert any("inverse table" in note for note in table.notes)
        assert check_map(table).verdict == "good"


def test_tables_of_machines_that_do_not_saturate_or_have_no_straight_part_are_not_turned(
    tmp_path: Path,
) -> None:
    i, theta = np.linspace(0, 10, 13), np.linspace(0, np.pi, 13)
    s = (1 - np.cos(theta)) / 2
    knee = np.outer(i / (1 + 0.2 * i), 0.02 + 0.1 * s)
    foot = np.outer(i - 0.5 * (1 - np.exp(-i / 0.5)), 0.01 + 0.05 * s) / (1 + 0.1 * i[:, None])
    for table in (np.outer(i, 0.01 + 0.05 * s), knee, foot):
        lines = [",".join(["", *map(str, np.degrees(theta))])]
        lines += [",".join(map(str, [a, *row])) for a, row in zip(i, table, strict=True)]
        (tmp_path / "m.csv").write_text("\n".join(lines))
        found = read_map(tmp_path / "m.csv", N_r=6, angle_kind="electrical")
        assert found.psi == pytest.approx(table) and "inverse" not in " ".join(found.notes)


@pytest.mark.parametrize("turned", [False, True])
def test_axes_may_be_matrices(tmp_path: Path, turned: bool) -> None:
    i, deg = np.linspace(0, 20, 11), np.arange(0, 46, 4.5)
    flux = np.array([[psi(x, np.radians(8 * d)) for d in deg] for x in i])
    at, deg_at = np.meshgrid(i, deg, indexing="ij")
    arrays = {"psi": flux, "i": at, "theta": deg_at}
    savemat(tmp_path / "m.mat", {k: v.T if turned else v for k, v in arrays.items()})
    table = read_map(tmp_path / "m.mat", N_r=8)
    assert table.i == pytest.approx(i) and table.psi[:, :-1] == pytest.approx(flux[:, :-2])


def test_a_current_that_differs_between_the_angles_is_no_axis(tmp_path: Path) -> None:
    i, deg = np.linspace(0, 20, 11), np.arange(0, 46, 5.0)
    at, _ = np.meshgrid(i, deg, indexing="ij")
    at[3, 2] += 0.1
    savemat(tmp_path / "m.mat", {"psi": at * 0.01, "i": at, "theta": deg})
    with pytest.raises(ParameterError, match="110 currents and 10 angles; mend the axes"):
        read_map(tmp_path / "m.mat", N_r=8)


@pytest.mark.parametrize("whole", [False, True])
def test_the_textbook_machine_of_a_triangular_inductance_is_good(whole: bool) -> None:
    """L rises on straight lines from 23 to 154 mH: torque i^2/2 N_r (L_a - L_u)/pi, one-sided."""
    i = np.linspace(0, 10, 6)
    theta = np.linspace(0, 2 * np.pi, 62 + 1)[:-1] if whole else np.linspace(0, np.pi, 31)
    rising = np.where(theta <= np.pi + 1e-9, theta, 2 * np.pi - theta) / np.pi
    sign = np.where(theta <= np.pi + 1e-9, 1.0, -1.0)
    tau = np.outer(i**2 / 2, sign * 8 * 0.131 / np.pi)
    table = FluxTable(8, i, theta, np.outer(i, 0.023 + 0.131 * rising), tau)
    report = check_map(table)
    assert report.verdict == "good", report.reasons
    assert report.torque_error_rms is not None and report.torque_error_rms < 1e-4
    assert any("one-sided" in note for note in report.notes)
    wrong = check_map(FluxTable(8, i, theta, table.psi, 1.3 * tau))
    assert wrong.verdict == "refused" and "torque differs" in wrong.reasons[0]


def saturating(zero: str) -> list[list[float]]:
    """Current [A], angle [deg], flux linkage [Wb] and torque [N m] of an 8/6 machine of 20 A."""
    machine = _core.LeHuy(N_r=6, L_u=8.7e-3, L_a=0.15, L_sat=2e-3, i_m=20, psi_m=0.6)
    i, degrees = np.meshgrid(np.linspace(0, 20, 11), np.linspace(0, 30, 13), indexing="ij")
    i, degrees = i.ravel(), degrees.ravel()
    theta_e = np.radians(6 * degrees) + (np.pi if zero == "aligned" else 0.0)
    found = _core.magnetics(machine, i, np.mod(theta_e, 2 * np.pi))
    return np.stack([i, degrees, found[:, 0], found[:, 2]], axis=1).tolist()


@pytest.mark.parametrize("zero", ["unaligned", "aligned"])
@pytest.mark.parametrize("torque", [False, True])
@pytest.mark.parametrize(
    ("right", "milli"),
    [
        (["I_ph [A]", "Pos [deg]", "Lambda [mWb]"], 1e3),
        (["I_ph [A]", "Pos [deg]", "Lambda [Wb]"], 1.0),
        (["i_A", "theta_deg", "psi_Wb"], 1.0),
    ],
)
def test_exchanged_columns_of_current_and_flux_linkage_are_refused_and_the_remedy_works(
    tmp_path: Path, zero: str, torque: bool, right: list[str], milli: float
) -> None:
    """Never a machine of 20 mWb at 60 A."""
    rows = [[i, a, milli * p, *([t] if torque else [])] for i, a, p, t in saturating(zero)]
    right = [*right, *(["Torque [Nm]"] if torque else [])]
    wrong = [right[2], right[1], right[0], *right[3:]]
    path, own = tmp_path / "m.csv", tmp_path / "own.toml"
    read = (path, "--N_r", 6, "--zero", zero)
    write_rows(path, [wrong, *rows])
    line = refused("map", "check", *read).strip()
    assert line.endswith("exchange their two names, each with its unit")
    assert "columns of current and flux linkage look exchanged" in line
    winding = ("--N_s", 8, "--R_ohm", 0.3, "--J_kgm2", 0.01)
    imported = ("map", "import", *read, *winding, "--out", own)
    assert refused(*imported).strip() == line and not own.exists()
    write_rows(path, [right, *rows])
    assert read_map(path, N_r=6, zero=zero).psi.max() == pytest.approx(
        max(p for *_, p, _ in saturating(zero))
    )
    assert command("map", "check", *read).code == 0 and command(*imported).code == 0
    assert command("run", *SHARING, "--set", f"machine={own}").code == 0


def test_names_exchanged_over_an_inverse_table_are_refused_and_the_remedy_works(
    tmp_path: Path,
) -> None:
    levels, angles, currents = inverse()
    rows = [[a, p, currents[n, k]] for n, a in enumerate(angles) for k, p in enumerate(levels)]
    write_rows(tmp_path / "m.csv", [["theta_e_deg", "i_A", "psi_Wb"], *rows])
    with pytest.raises(ParameterError, match="look exchanged"):
        read_map(tmp_path / "m.csv", N_r=4)
    write_rows(tmp_path / "m.csv", [["theta_e_deg", "psi_Wb", "i_A"], *rows])
    table = read_map(tmp_path / "m.csv", N_r=4)
    assert check_map(table).verdict == "good"
    write_map(table, tmp_path / "own.csv")
    again = read_map(tmp_path / "own.csv", N_r=4)
    assert again.i == pytest.approx(table.i) and again.psi == pytest.approx(table.psi)


def write_rows(path: Path, rows: list[list[object]]) -> None:
    with path.open("w", newline="") as file:
        csv.writer(file).writerows(rows)
