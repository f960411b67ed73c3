"""The flux tables that people have, in every form, are one and the same machine."""

import re
import shlex

import numpy as np
import pytest
from command import command, refused

from reluctance import ParameterError, _core
from reluctance.machine.library import machines
from reluctance.machine.maps import FluxTable, check_map, read_map
from reluctance.machine.maps.units import question_of_flux
from reluctance.machine.maps.variations import _value

MACHINE = _core.LeHuy(N_r=6, L_u=8.7e-3, L_a=0.25, L_sat=0.5e-3, i_m=5, psi_m=0.3)
CURRENTS = np.linspace(0, 5, 11)
N = 24  # angles of a whole period


def sampled(theta_e):
    """psi and tau (n_i, n_theta) at electrical angles [rad]."""
    i, theta = np.broadcast_arrays(CURRENTS[:, None], np.mod(theta_e, 2 * np.pi)[None, :])
    found = _core.magnetics(MACHINE, i.ravel().copy(), theta.ravel().copy())
    return found[:, 0].reshape(i.shape), found[:, 2].reshape(i.shape)


HALF = np.linspace(0, np.pi, 16)
HALF_DEG = np.degrees(HALF) / 6


def long_rows(psi, tau, angles=HALF_DEG):
    for k, i in enumerate(CURRENTS):
        for n, angle in enumerate(angles):
            yield i, angle, psi[k, n], tau[k, n]


def long_text(head, separator=",", comment="", angles=HALF_DEG, theta=HALF):
    rows = [separator.join(f"{v:.12g}" for v in row) for row in long_rows(*sampled(theta), angles)]
    return "\n".join([comment + separator.join(head), *rows])


def is_the_machine(table, *, torque=True):
    psi, tau = sampled(table.theta_e)
    assert table.i == pytest.approx(CURRENTS)
    assert np.abs(table.psi - psi).max() < 1e-6 * psi.max()
    assert (table.tau is not None) == torque
    if torque:
        assert np.abs(table.tau - tau).max() < 1e-6 * np.abs(tau).max()


@pytest.mark.parametrize(
    "head",
    [
        ["StatorCurrents", "RotorAngles_deg", "Fluxes_Wb", "Torques_Nm"],
        ["currents [A]", "angles [deg]", "flux_linkages [Wb]", "torques [N.m]"],
        ["I [A]", "theta [degrees]", "psi [Weber]", "Torque [NewtonMeter]"],
        ["i_rms_of_nothing", "theta_deg", "psi_Wb", "tau_Nm"],  # one name that says nothing
    ],
    ids=["plural", "plural with units", "spelled out", "unknown part"],
)
def test_names_that_people_give(head, tmp_path):
    path = tmp_path / "m.csv"
    path.write_text(long_text(head))
    names = {"i": head[0]} if "nothing" in head[0] else None
    is_the_machine(read_map(path, N_r=6, names=names))


def test_a_stated_name_may_have_any_form_and_gives_its_unit(tmp_path):
    path = tmp_path / "m.csv"
    psi, tau = sampled(HALF)
    rows = [f"{1e3 * i:.12g},{a:.12g},{p:.12g},{t:.12g}" for i, a, p, t in long_rows(psi, tau)]
    path.write_text("\n".join(["I_aa[mA],rotor (mech. deg),lam_aa[Wb],Tq[Nm]", *rows]))
    names = {"i": "I_aa[mA]", "theta": "rotor (mech. deg)", "psi": "lam_aa[Wb]", "tau": "Tq[Nm]"}
    is_the_machine(read_map(path, N_r=6, names=names))
    given = [word for q, name in names.items() for word in ("--name", f"{q}={name}")]
    assert command("map", "check", path, "--N_r", 6, *given).code == 0


@pytest.mark.parametrize("separator", [" ", "\t", ",", ";"])
def test_text_as_femm_scripts_write_it(separator, tmp_path):
    """Numbers in columns, named by a comment above them, or not at all."""
    path = tmp_path / "femm.txt"
    head = ["i_A", "theta_deg", "psi_Wb", "tau_Nm"]
    path.write_text(long_text(head, separator, comment="% "))
    is_the_machine(read_map(path, N_r=6))
    path.write_text("\n".join(long_text(head, separator).splitlines()[1:]))
    numbers = {"i": "1", "theta": "2", "psi": "3", "tau": "4"}
    is_the_machine(read_map(path, N_r=6, names=numbers, angle_unit="deg"))


@pytest.mark.parametrize(
    ("unit", "factor"),
    [("A", 1), ("mA", 1e3), ("deg", 1), ("degrees", 1), ("rad", np.pi / 180)],
)
def test_a_sweep_as_maxwell_exports_it(unit, factor, tmp_path):
    psi, tau = sampled(HALF)
    if unit.endswith("A"):
        head = ["Moving1.Position [deg]"]
        head += [f"FluxLinkage(PhaseA) [mWb] - I_peak='{factor * i:g}{unit}'" for i in CURRENTS]
        head += [f"Moving1.Torque [NewtonMeter] - I_peak='{factor * i:g}{unit}'" for i in CURRENTS]
        rows = [[a, *1e3 * psi[:, n], *tau[:, n]] for n, a in enumerate(HALF_DEG)]
    else:
        head = ["Current(A) [A]"]
        head += [f"FluxLinkage(PhaseA) [mWb] - pos='{factor * a:.12g}{unit}'" for a in HALF_DEG]
        head += [f"Moving1.Torque [NewtonMeter] - pos='{factor * a:.12g}{unit}'" for a in HALF_DEG]
        rows = [[i, *1e3 * psi[k], *tau[k]] for k, i in enumerate(CURRENTS)]
    lines = [",".join(f'"{cell}"' for cell in head)]
    path = tmp_path / "maxwell.csv"
    path.write_text("\n".join(lines + [",".join(f"{v:.12g}" for v in row) for row in rows]))
    is_the_machine(read_map(path, N_r=6))


@pytest.mark.parametrize(
    ("text", "quantity", "value", "unit"),
    [
        ("5A", "i", 5.0, "a"), ("-2.5e3 mA", "i", -2.5, "ma"), ("1.5", "i", 1.5, None),
        ("30deg", "theta", 30.0, "deg"), ("30 degrees", "theta", 30.0, "deg"),
        ("0.5 rad", "theta", 0.5, "rad"), ("7", "theta", 7.0, None),
    ],
)  # fmt: skip
def test_a_value_of_a_sweep_has_its_unit(text, quantity, value, unit):
    assert _value(text, quantity) == (pytest.approx(value), unit)


@pytest.mark.parametrize("text", ["5deg", "5 Hz", "A", "five A", "1.2.3A", "5A 6A"])
def test_a_value_of_a_sweep_that_is_no_current_is_refused(text):
    with pytest.raises(ParameterError, match=f"value `{text}` of the sweep, need a number with a"):
        _value(text, "i")


@pytest.mark.parametrize("form", ["long", "grid"])
def test_a_spreadsheet(form, tmp_path):
    import openpyxl

    book = openpyxl.Workbook()
    psi, tau = sampled(HALF)
    if form == "long":
        book.active.append(["i_A", "theta_deg", "psi_Wb", "tau_Nm"])
        for row in long_rows(psi, tau):
            book.active.append([float(v) for v in row])
    else:
        book.active.append([0, *map(float, HALF_DEG)])
        for i, row in zip(CURRENTS, psi, strict=True):
            book.active.append([float(i), *map(float, row)])
    book.save(tmp_path / "m.xlsx")
    is_the_machine(read_map(tmp_path / "m.xlsx", N_r=6), torque=form == "long")


@pytest.mark.parametrize("rows", [[], ["1,0,0.1"], ["1,0,0.1", "2,0,0.2"]])
def test_a_file_without_a_grid_is_one_line(tmp_path, rows):
    path = tmp_path / "map.csv"
    path.write_text("\n".join(["i_A,theta_e_deg,psi_Wb", *rows]) + "\n")
    with pytest.raises(ParameterError, match="need") as fault:
        read_map(path, N_r=4)
    assert "\n" not in str(fault.value)


def test_a_file_that_only_is_called_a_spreadsheet_is_one_line(tmp_path):
    (tmp_path / "m.xlsx").write_bytes(b"PK\x03\x04 no")
    assert "cannot be read as an .xlsx file" in refused(
        "map", "check", tmp_path / "m.xlsx", "--N_r", 6
    )


@pytest.mark.parametrize("form", ["long", "grid", "transposed grid"])
def test_torque_in_a_file_of_its_own(form, tmp_path):
    psi, tau = sampled(HALF)
    grid = "\n".join(
        [
            ",".join(["0", *(f"{a:.12g}" for a in HALF_DEG)]),
            *(
                ",".join(f"{v:.12g}" for v in [i, *row])
                for i, row in zip(CURRENTS, psi, strict=True)
            ),
        ]
    )
    (tmp_path / "psi.csv").write_text(grid)
    if form == "long":
        rows = [f"{i:.12g},{a:.12g},{t:.12g}" for i, a, _, t in long_rows(psi, tau)]
        text = "\n".join(["i_A,theta_deg,tau_Nm", *rows[::-1]])
    else:
        cells = np.block([[np.zeros((1, 1)), HALF_DEG[None]], [CURRENTS[:, None], tau]])
        cells = cells.T if form == "transposed grid" else cells
        text = "\n".join(",".join(f"{v:.12g}" for v in row) for row in cells)
    (tmp_path / "tau.csv").write_text(text)
    is_the_machine(read_map(tmp_path / "psi.csv", N_r=6, torque=tmp_path / "tau.csv"))


@pytest.mark.parametrize("shift", [4.0, 13.7, 25.0])
def test_any_angle_zero_reaches_a_machine(shift, tmp_path):
    """A whole period whose zero is neither aligned nor unaligned, and has no sample at either."""
    degrees = np.arange(N) * 60 / N  # of the file: a period is 60 deg of a rotor with six poles
    theta_e = np.radians(6 * (degrees - shift)) + np.pi  # aligned at `shift`
    path = tmp_path / "m.csv"
    head = ["i_A", "theta_deg", "psi_Wb", "tau_Nm"]
    path.write_text(long_text(head, angles=degrees, theta=theta_e))
    with pytest.raises(ParameterError, match="aligned_at") as fault:
        read_map(path, N_r=6)
    told = float(str(fault.value).split("aligned_at=")[1].split()[0])
    assert (told - shift + 30) % 60 - 30 == pytest.approx(0, abs=0.05)
    table = read_map(path, N_r=6, aligned_at=shift)
    psi, _ = sampled(table.theta_e)
    assert np.abs(table.psi - psi).max() < 5e-3 * psi.max()  # the spline through 24 angles
    assert check_map(table).verdict == "good"
    out = tmp_path / "motor.toml"
    winding = ("--N_s", 8, "--R_ohm", 2.15, "--J_kgm2", 0.004)
    done = command("map", "import", path, "--N_r", 6, *winding, "--aligned_at", shift, "--out", out)
    assert done.code == 0, done.error


def test_zero_and_aligned_at_exclude_each_other(tmp_path):
    path = tmp_path / "m.csv"
    path.write_text(long_text(["i_A", "theta_deg", "psi_Wb", "tau_Nm"]))
    arguments = ("--N_r", 6, "--zero", "unaligned", "--aligned_at", 30)
    assert "give one of them" in refused("map", "check", path, *arguments)


@pytest.mark.parametrize("factor", [0.5, 2, 3])
def test_another_number_of_turns_is_recognised_and_said(factor, tmp_path):
    """Flux of one coil, torque of the phase; the remedy that is told makes the map good."""
    psi, tau = sampled(HALF)
    rows = [",".join(f"{v:.12g}" for v in row) for row in long_rows(factor * psi, tau)]
    path = tmp_path / "m.csv"
    path.write_text("\n".join(["i_A,theta_deg,psi_Wb,tau_Nm", *rows]))
    done = command("map", "check", path, "--N_r", 6)
    assert done.code == 1
    assert "if the flux linkage is of" in done.out
    remedy = done.out.split("--turns_factor ")[1].split()[0].strip(";")
    assert float(remedy) == pytest.approx(1 / factor, rel=1e-4)
    assert command("map", "check", path, "--N_r", 6, "--turns_factor", remedy).code == 0


@pytest.mark.parametrize("factor", [0, -1, "nan", "inf"])
def test_a_factor_of_turns_is_a_number_above_zero(factor, tmp_path):
    psi, tau = sampled(HALF)
    rows = [",".join(f"{v:.12g}" for v in row) for row in long_rows(psi, tau)]
    path = tmp_path / "m.csv"
    path.write_text("\n".join(["i_A,theta_deg,psi_Wb,tau_Nm", *rows]))
    line = refused("map", "check", path, "--N_r", 6, "--turns_factor", factor)
    assert f"--turns_factor {factor}, need > 0" in line


def test_the_number_of_turns_that_is_told_is_whole_where_the_map_is_a_little_off(tmp_path):
    psi, tau = sampled(HALF)
    rows = [",".join(f"{v:.12g}" for v in row) for row in long_rows(0.499995 * psi, tau)]
    path = tmp_path / "m.csv"
    path.write_text("\n".join(["i_A,theta_deg,psi_Wb,tau_Nm", *rows]))
    assert "pass --turns_factor 2;" in " ".join(
        command("map", "check", path, "--N_r", 6).out.split()
    )


@pytest.mark.parametrize(
    ("cell", "right"),
    [
        ("1.200,0", "1200.0"),
        ("-12.345.678", "-12345678"),
        ("1'200.5", "1200.5"),
        ("1 200,25", "1200.25"),
    ],
)
def test_a_number_whose_thousands_are_parted_is_told_as_such(cell, right, tmp_path):
    path = tmp_path / "m.csv"
    text = long_text(["i_A", "theta_deg", "psi_Wb", "tau_Nm"], ";").splitlines()
    text[5] = f"{cell};" + text[5].partition(";")[2]
    path.write_text("\n".join(text))
    said = refused("map", "check", path, "--N_r", 6)
    assert f"`{cell}` is not a number" in said and said.strip().endswith(
        f"parts thousands: write {right}"
    )


def test_a_map_error_names_the_whole_path_and_the_option(tmp_path):
    path = tmp_path / "sub" / "m.csv"
    path.parent.mkdir()
    path.write_text(long_text(["i_A", "theta_deg", "psi_Wb", "tau_Nm"]))
    line = refused("map", "check", path)
    assert str(path) in line and "--N_r" in line
    assert "/dev/null" in refused("map", "check", "/dev/null")


def test_an_electrical_map_without_torque_says_that_it_cannot_tell_the_poles(tmp_path):
    psi, _ = sampled(HALF)
    rows = [f"{i:.12g},{6 * a:.12g},{p:.12g}" for i, a, p, _ in long_rows(psi, psi)]
    path = tmp_path / "m.csv"
    path.write_text("\n".join(["i_A,theta_e_deg,psi_Wb", *rows]))
    assert (
        "electrical angles without torque cannot tell"
        in command("map", "check", path, "--N_r", 10).out
    )


NAMES = {"i": "i_A", "theta": "theta_deg", "psi": "psi_Wb", "tau": "tau_Nm"}
UNIT = {"i": ("i_A", "i_mA"), "psi": ("psi_Wb", "psi_mWb"), "tau": ("tau_Nm", "tau_mNm")}
SUSPECT = {"i": "the currents are", "psi": "the flux linkage is", "tau": "the torque is"}


def stated(path, **names):
    """A map whose columns have other names, the numbers of UNIT[...][1] in milli-units."""
    head = NAMES | names
    milli = {q: 1e3 if name in [UNIT[q][1]] else 1.0 for q, name in names.items()}
    rows = []
    for i, a, p, t in long_rows(*sampled(HALF)):
        values = dict(i=i, theta=a, psi=p, tau=t)
        rows.append(",".join(f"{milli.get(q, 1.0) * v:.12g}" for q, v in values.items()))
    path.write_text("\n".join([",".join(head.values()), *rows]))
    return path


def renamed(path, old, new):
    head, rest = path.read_text().split("\n", 1)
    assert old in head
    path.write_text("\n".join([head.replace(old, new), rest]))


@pytest.mark.parametrize("quantity", list(UNIT))
@pytest.mark.parametrize("milli", [True, False])
def test_the_advice_on_a_unit_error_leads_to_the_right_machine(quantity, milli, tmp_path):
    """Each of the three quantities a thousand times too large or small; every proposal followed."""
    base, small = UNIT[quantity]
    path = stated(tmp_path / "m.csv", **{quantity: small if milli else base})
    renamed(path, *((small, base) if milli else (base, small)))
    done = command("map", "check", path, "--N_r", 6)
    text = " ".join(done.out.split())
    assert done.code == 1 and "unit error" in text and "turns" not in text
    assert "are the currents in" not in text  # beside the error no question
    named = [q for q, words in SUSPECT.items() if words in text]
    assert named == [quantity], text
    assert f"{1000 if not milli else '1/1000'}" in text
    renamed(path, *((base, small) if milli else (small, base)))
    is_the_machine(read_map(path, N_r=6))
    assert command("map", "check", path, "--N_r", 6).code == 0


def test_units_that_leave_no_machine_are_no_good_map(tmp_path):
    """Currents and flux linkage wrong together: the energy is right, the machine is none."""
    path = stated(tmp_path / "m.csv", i="i_mA")
    renamed(path, "i_mA", "i_A")
    renamed(path, "psi_Wb", "psi_mWb")
    done = command("map", "check", path, "--N_r", 6)
    assert done.code == 1 and "check the units of current and flux linkage" in " ".join(
        done.out.split()
    )


def test_a_matrix_in_another_unit_is_told_which_it_is_read_in(tmp_path):
    """Its numbers have no name that could say it; those of a title are not read."""
    theta, i = np.linspace(0, 60, 13), np.linspace(0, 20, 9)
    psi = np.outer(i, 20 - 15 * np.cos(6 * np.radians(theta)))  # [mWb]
    path = tmp_path / "m.txt"
    rows = [[0, *theta], *([current, *row] for current, row in zip(i, psi, strict=True))]
    lines = [" ".join(f"{value:.6g}" for value in row) for row in rows]
    path.write_text("\n".join(["% flux linkage [mWb]", *lines]))
    told = " ".join(command("map", "check", path, "--N_r", 6).out.split())
    assert "a matrix is read in A and Wb, so multiply its numbers" in told


def test_a_torque_of_an_unknown_unit_is_not_left_out(tmp_path):
    path = stated(tmp_path / "m.csv", tau="tau_turns")
    assert "for the torque write `tau_Nm`" in refused("map", "check", path, "--N_r", 6)


FACTOR = {"mA": 1e3, "kA": 1e-3}


@pytest.mark.parametrize("with_torque", [False, True], ids=["flux alone", "torque"])
@pytest.mark.parametrize("unit", FACTOR)
def test_a_machine_that_another_unit_of_the_currents_makes_usual_is_asked_about(
    unit, with_torque, tmp_path
):
    """A fifth of an ampere in kA, 5000 A in mA: the flux linkage fits both, so that it is a
    question. The advice, followed, leads to the right machine, which is not asked about."""
    largest = {"mA": 5.0, "kA": 200.0}[unit]
    ratio = FACTOR[unit] * largest / CURRENTS[-1]
    rows = [(ratio * i, a, p, ratio * t) for i, a, p, t in long_rows(*sampled(HALF))]
    names = list(NAMES.values())[: 4 if with_torque else 3]
    path = tmp_path / "m.csv"
    lines = [",".join(f"{v:.12g}" for v in row[: len(names)]) for row in rows]
    path.write_text("\n".join([",".join(names), *lines]))
    done = command("map", "check", path, "--N_r", 6)
    text = " ".join(done.out.split())
    assert done.code == 0
    said = f"a machine of {FACTOR[unit] * largest:.4g} A"
    assert said in text and f"are the currents in {unit}? Then it has {largest:.4g} A" in text
    new = re.search(r"name the columns? (\w+)(?: and (\w+))?", text)
    out = tmp_path / "motor.toml"
    winding = ("--N_r", 6, "--N_s", 8, "--R_ohm", 1.0, "--J_kgm2", 1.0, "--out", out)
    assert said in " ".join(command("map", "import", path, *winding).out.split())
    renamed(path, "i_A", new[1])
    if with_torque:
        renamed(path, "tau_Nm", new[2])
    assert read_map(path, N_r=6).i[-1] == pytest.approx(largest)
    done = command("map", "check", path, "--N_r", 6)
    assert done.code == 0 and "are the currents in" not in done.out


@pytest.mark.parametrize(("factor", "unit", "most"), [(1e-3, "Wb", 0.6), (1e3, "mWb", 0.04)])
def test_flux_linkages_that_another_unit_makes_usual_are_asked_about(factor, unit, most):
    """No torque tells; the advice, followed, leads to the right machine."""
    i, theta = np.linspace(0, 12, 21), np.linspace(0, np.pi, 25)
    grid = [x.ravel() for x in np.meshgrid(i, theta, indexing="ij")]
    small = next(e.machine for e in machines() if e.key == "onelab_6_4").magnetics
    psi = _core.magnetics(small, *grid)[:, 0].reshape(21, 25)
    psi *= most / psi.max()
    slip = check_map(FluxTable(4, i, theta, factor * psi)).notes
    (note,) = (note for note in slip if "are the flux linkages" in note)
    assert f"in {unit}? " in note
    by = float(re.search(r"multiply the column psi by ([\d.e+-]+),", note)[1])
    assert by * factor == pytest.approx(1)
    assert not [n for n in check_map(FluxTable(4, i, theta, psi)).notes if "are the flux" in n]


@pytest.mark.parametrize(("i", "psi"), [(200, 0.02), (10, 0.01), (5, 0.005), (450, 0.5), (20, 5)])
def test_small_and_large_machines_are_not_asked_about(i, psi):
    assert question_of_flux(i, psi, 1.0) is None


def test_no_machine_of_the_library_is_asked_about():
    for entry in machines():
        machine = entry.machine
        i, theta = np.linspace(0, machine.i_max_A, 21), np.linspace(0, np.pi, 25)
        grid = [x.ravel() for x in np.meshgrid(i, theta, indexing="ij")]
        psi = _core.magnetics(machine.magnetics, *grid)[:, 0].reshape(21, 25)
        notes = check_map(FluxTable(machine.N_r, i, theta, psi)).notes
        asked = ("are the currents", "are the flux linkages")
        assert not [note for note in notes if any(text in note for text in asked)], entry.key


def test_decimal_commas_beside_a_header_with_points(tmp_path):
    """`Strom [A]` and `[mV.s]` are no numbers; only the numbers are looked at."""
    psi, tau = sampled(HALF)
    rows = [";".join(f"{v:.12f}" for v in row) for row in long_rows(1e3 * psi, tau)]
    head = "Strom i [A];Winkel [deg];Fluss psi [mWb];Drehm. tau [Nm]"
    path = tmp_path / "m.csv"
    path.write_text("\n".join([head, *(row.replace(".", ",") for row in rows)]))
    is_the_machine(read_map(path, N_r=6))
    mixed = ["1.5;0,5;0;0", *rows[1:]]
    path.write_text("\n".join(["i_A;theta_deg;psi_Wb;tau_Nm", *mixed]))
    assert "write a decimal point, as in 0.5" in refused("map", "check", path, "--N_r", 6)


def test_a_factor_of_ten_is_no_number_of_turns(tmp_path):
    """With `--turns_factor` the verdict would be good for a machine wrong by that power."""
    psi, tau = sampled(HALF)
    rows = [",".join(f"{v:.12g}" for v in row) for row in long_rows(psi, 0.1 * tau)]
    path = tmp_path / "m.csv"
    path.write_text("\n".join(["i_A,theta_deg,psi_Wb,tau_Nm", *rows]))
    done = command("map", "check", path, "--N_r", 6)
    assert done.code == 1
    assert "unit error" in done.out and "turns" not in done.out


ROUGH = ["Pos_mech [°]", "I_ph A (rms?no:DC) [A]", "FluxLinkage_PhaseA [mWb]", "Torque_avg [Nm]"]


def rough(path, head=ROUGH):
    """A table in the order of columns and with the units of ROUGH."""
    rows = [
        f"{a:.12g},{i:.12g},{1e3 * p:.12g},{t:.12g}" for i, a, p, t in long_rows(*sampled(HALF))
    ]
    path.write_text("\n".join([",".join(head), *rows]), encoding="utf-8")
    return path


def test_units_in_brackets_say_what_a_column_is(tmp_path):
    path = rough(tmp_path / "m.csv")
    is_the_machine(read_map(path, N_r=6))
    assert command("map", "check", path, "--N_r", 6).code == 0


def test_one_line_lists_all_columns_and_the_options_that_mend_it(tmp_path):
    head = ["where [turn]", "one [x]", "FluxLinkage_PhaseA [mWb]", "Torque_avg [Nm]"]
    path = rough(tmp_path / "m.csv", head)
    line = refused("map", "check", path, "--N_r", 6)
    assert all(f"`{name}`" in line for name in head)
    ready = [word for word in shlex.split(line.split("name the columns: ")[1]) if "=" in word]
    assert ready == ["psi=FluxLinkage_PhaseA [mWb]", "i=NAME", "theta=NAME"]
    names = ["--name", "i=one [x]", "--name", "theta=where [turn]", "--name", ready[0]]
    assert command("map", "check", path, "--N_r", 6, *names, "--angle_unit", "deg").code == 0


def test_import_overwrites_no_machine_file_and_notes_the_names(tmp_path):
    path = rough(tmp_path / "m.csv", ["a", "b", "FluxLinkage_PhaseA [mWb]", "Torque_avg [Nm]"])
    motor = tmp_path / "motor.toml"
    arguments = ["map", "import", path, "--N_r", 6, "--N_s", 8, "--R_ohm", 2, "--J_kgm2", 0.004]
    arguments += ["--name", "theta=a", "--name", "i=b", "--angle_unit", "deg", "--out", motor]
    assert command(*arguments).code == 0
    assert "# column named: theta=a" in motor.read_text()
    motor.write_text(edited := motor.read_text().replace("R_ohm = 2.0", "R_ohm = 1.9"))
    assert "motor.toml has been edited" in refused(*arguments)
    assert motor.read_text() == edited
