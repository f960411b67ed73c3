"""Geometry files: what is refused with which line, and what comes out of a good one."""

import json
import re
import warnings
from copy import deepcopy
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from command import command, refused
from ends import SIZES, fault_of, numbers
from matplotlib.figure import Figure
from scipy.constants import mu_0

import reluctance as rl
from reluctance import _core
from reluctance.base.files import read_toml
from reluctance.base.resources import resources
from reluctance.base.schema import checked, inner_sections
from reluctance.explore.sweeps.fingerprint import fingerprint
from reluctance.machine.copper import COPPER_RESISTIVITY
from reluctance.machine.geometry import convergence, draw, from_geometry, geometry_machine
from reluctance.machine.geometry import solved as solved_module
from reluctance.machine.geometry.file import Coils, Geometry, Lamination, MapGrid
from reluctance.machine.geometry.force import stress
from reluctance.machine.geometry.geometry_machine import geometry_of
from reluctance.machine.geometry.mesh import Grid
from reluctance.machine.geometry.position import at_angle
from reluctance.machine.geometry.proportions import questions
from reluctance.machine.geometry.samples import rotor_angle
from reluctance.machine.geometry.solve import solve
from reluctance.machine.geometry.solved import by_products_of, solved, system_of
from reluctance.machine.geometry.steel_file import grade
from reluctance.machine.library import flattened, machine_from, machine_table
from reluctance.machine.maps import check_map, fit_surface
from reluctance.machine.maps.pole_force import read_pole_force

PLACE = "reluctance.machine.geometry"
MACHINES = Path(__file__).parents[2] / "machines" / "geometry"
COARSE = Grid(cell=3.0, growth=1.5, yoke=2)
GOOD = {
    "machine": {"stator_poles": 6, "rotor_poles": 4, "phases": 3},
    "lamination": {"stack_length_mm": 50.0, "steel": "M400-50A"},
    "stator": {
        "outer_diameter_mm": 110.0,
        "bore_diameter_mm": 56.0,
        "pole_arc_deg": 30.0,
        "pole_height_mm": 16.0,
    },
    "rotor": {"pole_arc_deg": 32.0, "pole_height_mm": 9.0, "shaft_diameter_mm": 14.0},
    "air_gap": {"length_mm": 0.3},
    "winding": {"turns_per_pole": 90},
    "map": {"current_max_A": 15.0, "angles": 17, "currents": 10},
}


def changed(**changes):
    """The good file with section__key = value; None takes the key out."""
    data = deepcopy(GOOD)
    for name, value in changes.items():
        section, key = name.split("__")
        data[section].pop(key, None)
        if value is not None:
            data[section][key] = value
    return data


def write(path, data):
    lines = []
    for section, values in data.items():
        lines += [f"[{section}]", *(f"{k} = {json.dumps(v)}" for k, v in values.items())]
    path.write_text("\n".join(lines) + "\n")
    return path


def geometry(**changes):
    table = flattened(changed(**changes))
    del table["model"]
    return checked(Geometry, table, "[machine]")


REFUSED = [
    ({"air_gap__length_mm": 0}, "[air_gap] length_mm = 0, need > 0"),
    ({"air_gap__length_mm": 20.0}, "check the units of both (millimetres)"),
    ({"stator__pole_arc_deg": 61.0}, "[stator] pole_arc_deg = 61: neighbouring poles overlap"),
    ({"rotor__pole_arc_deg": 60.0}, "[rotor] pole_arc_deg = 60: neighbouring poles overlap"),
    ({"stator__pole_height_mm": 27.0}, "leaves no yoke: need less than 27"),
    ({"rotor__pole_height_mm": 21.0}, "[rotor] pole_height_mm = 21 leaves no yoke"),
    ({"stator__bore_diameter_mm": 14.0}, "leaves no rotor within"),
    ({"machine__phases": 4}, "6/4 poles make 3; set phases or the poles"),
    ({"machine__stator_pole": 6}, "did you mean `stator_poles`?"),
    ({"stator__pole_arcs_deg": 30}, "`pole_arcs_deg` in [stator]; did you mean `pole_arc_deg`?"),
    ({"winding__turns_per_pole": None}, "missing key `turns_per_pole` in [winding]"),
    ({"winding__polarity": "NNSS"}, "has 4 letters, need 6"),
    ({"winding__polarity": "NNNNNS"}, "is no winding of this machine"),
    (
        {"machine__rotor_poles": 5, "machine__phases": 6},
        "leave 1 to a phase, need an even number, half of them N and half S, or the flux has no "
        "way back; the next poles that do are 6/4",
    ),
    (
        {"machine__stator_poles": 9, "machine__rotor_poles": 6},
        "leave 3 to a phase, need an even number, half of them N and half S, or the flux has no "
        "way back; the next poles that do are 8/6",
    ),
    # Metres where millimetres are needed, one dimension at a time.
    ({"lamination__stack_length_mm": 0.05}, "stack_length_mm = 0.05, need at least 1.12, 1/50 of"),
    ({"stator__pole_height_mm": 0.016}, "[stator] pole_height_mm = 0.016, need at least the air"),
    ({"rotor__pole_height_mm": 0.009}, "[rotor] pole_height_mm = 0.009, need at least the air gap"),
    ({"stator__outer_diameter_mm": 0.11}, "outer_diameter_mm = 0.11, need more than bore_diameter"),
    ({"winding__polarity": "ABCABC"}, "[winding] polarity = 'ABCABC'"),
    ({"winding__parallel_paths": 3}, "need a divisor of the 2 poles of a phase"),
    ({"winding__slot_fill": 0.9}, "[winding] slot_fill = 0.9, need <= 0.8"),
    ({"winding__coil_width_mm": 5.0}, "set both or none"),
    ({"winding__coil_to_pole_mm": 1.0}, "set coil_width_mm and coil_height_mm too"),
    (
        {"winding__coil_width_mm": 12.0, "winding__coil_height_mm": 10.0},
        "coil_width_mm = 12 does not fit the slot",
    ),
    (
        {"winding__coil_width_mm": 5.0, "winding__coil_height_mm": 17.0},
        "coil_height_mm = 17 does not fit the slot",
    ),
    ({"map__current_max_A": 1500.0}, "far beyond saturation with 90 turns: need at most 24"),
    ({"map__pair_rank": 4}, "[map] pair_rank has no effect with coupling = 'none'"),
    ({"map__coupling": "all"}, "need 'none' or 'pairs'"),
    ({"lamination__steel": "M530"}, "no such grade; did you mean `M530-50A`?"),
    ({"lamination__steel": "nowhere.csv"}, "no such file"),
    ({"lamination__stacking_factor": 97}, "need <= 1"),
    ({"stator__pole_arc_deg": 0.56}, "need at least 6 for 6 poles; check its unit (0.56 rad are"),
    ({"rotor__pole_arc_deg": 0.56}, "[rotor] pole_arc_deg = 0.56, need at least 9"),
    ({"air_gap__length_mm": 0.0003}, "need at least 0.028, 1/2000 of the bore; check its unit"),
    ({"lamination__saturation_polarisation_T": 2.0}, "has no effect with the grade M400-50A"),
]


LENGTHS = [
    *("lamination__stack_length_mm", "air_gap__length_mm", "stator__bore_diameter_mm"),
    *("stator__pole_height_mm", "rotor__pole_height_mm", "rotor__shaft_diameter_mm"),
]


@pytest.mark.parametrize(("unit", "size"), [("cm", 10), ("inches", 25.4), ("m", 1000)])
@pytest.mark.parametrize("name", LENGTHS)
def test_a_length_in_another_unit_is_asked_for_or_refused(name, unit, size):
    """A length of a machine is at least a tenth of its fellows: what is asked is the right length,
    unless another unit fits, too."""
    section, key = name.split("__")
    right = GOOD[section][key]
    wrong = changed(**{name: right / size})
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        try:
            geometry_of(flattened(wrong), "[machine]")
        except rl.ParameterError as fault:
            assert key in str(fault) or "bore_diameter_mm" in str(fault)
            return
    (line,) = (str(each.message) for each in told)
    assert f"{section}.{key} = {right / size:g} is" in line
    assert "is it in" in line
    if unit == "cm":
        assert line.endswith(f"is it in cm? Then write {right:g}")


def test_lengths_that_machines_have_are_not_asked_for():
    for data in (GOOD, *map(read_toml, sorted(MACHINES.glob("*.toml")))):
        assert questions(geometry_of(flattened(data), "[machine]")) == []
    small = {name: 0.1 for name in LENGTHS} | {"stator__outer_diameter_mm": 0.1}
    tenth = {n: f * GOOD[n.split("__")[0]][n.split("__")[1]] for n, f in small.items()}
    (line,) = questions(geometry(**tenth))
    assert line.endswith("are all lengths in millimetres?")


@pytest.mark.parametrize(("side", "height"), [("stator", 27.0), ("rotor", 21.0)])
def test_the_remedy_for_a_missing_yoke_leaves_one_that_takes_the_flux(side, height):
    key = f"{side}__pole_height_mm"
    with pytest.raises(rl.ParameterError, match="leaves no yoke") as fault:
        geometry_of(flattened(changed(**{key: height})), "[machine]")
    right = float(re.search(r"; at ([\d.]+) the yoke", str(fault.value))[1])
    s = geometry(**{key: right}).cross_section
    yoke, half = {
        "stator": (s.r_out - s.r_slot_s, s.half_width_s),
        "rotor": (s.r_slot_r - s.r_shaft, s.half_width_r),
    }[side]
    assert half <= yoke < 1.1 * half


def test_an_end_winding_in_henries_is_told_as_such(tmp_path, monkeypatch):
    monkeypatch.setattr("reluctance.machine.geometry.solved.Grid", lambda: COARSE)
    own = 1e3 * by_products_of(geometry()).L_end_H
    for value in (1e3 * own, -1.0):
        path = write(tmp_path / "g.toml", changed(winding__end_winding=value))
        line = refused("machine", "from-geometry", path, "--out", tmp_path / "m.toml")
        assert f"[winding] end_winding = {value:g} mH, need 0 to" in line and "coarse" not in line
    most = float(re.search(r"need 0 to ([\d.e+-]+)", line)[1])
    by_products_of(geometry(winding__end_winding=0.999 * most))


@pytest.mark.parametrize(("changes", "text"), REFUSED, ids=[text for _, text in REFUSED])
def test_an_impossible_geometry_gets_one_line(tmp_path, changes, text):
    path = write(tmp_path / "g.toml", changed(**changes))
    out = tmp_path / "m.toml"
    assert text in refused("machine", "from-geometry", path, "--out", out)
    assert not out.exists()


@pytest.mark.parametrize("key", ["winding__coil_width_mm", "winding__coil_height_mm"])
def test_the_largest_coil_that_a_refusal_names_is_the_largest_that_fits(key):
    size = {"winding__coil_width_mm": 5.0, "winding__coil_height_mm": 10.0}
    with pytest.raises(rl.ParameterError, match="does not fit the slot: need at most") as fault:
        geometry(**{**size, key: 30.0})
    most = float(str(fault.value).partition("need at most ")[2].split(";")[0].split()[0])
    geometry(**{**size, key: 0.999 * most})
    with pytest.raises(rl.ParameterError, match="does not fit the slot"):
        geometry(**{**size, key: 1.001 * most})


H, B = (x[::6] for x in grade("M400-50A"))
CURVES = [
    ([(h, b) for h, b in zip(B, H, strict=True)], "the columns are swapped"),
    ([(h, 1e4 * b) for h, b in zip(H, B, strict=True)], "divide gauss by 10 000"),
    ([(h, 1e3 * b) for h, b in zip(H, B, strict=True)], "divide millitesla by 1000"),
    ([(h, 10 * b) for h, b in zip(H, B, strict=True)], "divide kilogauss by 10"),
    ([(h / 1000, b) for h, b in zip(H, B, strict=True)], "multiply kA/m by 1000"),
    ([(h, b) for h, b in zip(H, B, strict=True) if b < 1.75], "set [lamination] saturation_pol"),
    ([(H[0], B[0]), (H[3], B[3]), (H[2], B[2]), *zip(H[4:], B[4:], strict=True)], "need to rise"),
    ([(H[0], B[0]), (H[1], B[1])], "two columns of at least 6 numbers"),
    ([("a", "b")] * 8, "column 1: `a` is not a number"),
]


@pytest.mark.parametrize(("points", "text"), CURVES, ids=[text for _, text in CURVES])
def test_a_curve_that_is_none_gets_one_line(tmp_path, points, text):
    (tmp_path / "bh.csv").write_text("\n".join(f"{h},{b}" for h, b in points) + "\n")
    path = write(tmp_path / "g.toml", changed(lamination__steel="bh.csv"))
    assert text in refused("machine", "from-geometry", path, "--out", tmp_path / "m.toml")


def test_a_saturation_below_the_curve_gets_one_line(tmp_path):
    (tmp_path / "bh.csv").write_text("\n".join(f"{h},{b}" for h, b in zip(H, B, strict=True)))
    keys = {"lamination__steel": "bh.csv", "lamination__saturation_polarisation_T": 1.5}
    path = write(tmp_path / "g.toml", changed(**keys))
    assert "need more than the" in refused("machine", "from-geometry", path)


def test_a_geometry_that_is_run_is_told_where_it_belongs(tmp_path):
    path = write(tmp_path / "lam.toml", GOOD)
    line = refused("run", path)
    assert "is a geometry, not a drive file" in line and 'machine = "lam.toml"' in line
    assert "is a machine file, not a drive" in refused(
        "run", resources("machines") / "paper_6_4.toml"
    )


def test_a_table_that_is_missing_is_named(tmp_path):
    data = changed()
    del data["map"]
    path = write(tmp_path / "lam.toml", data)
    assert "missing table [map]" in refused("machine", "from-geometry", path)
    cubic = resources("examples") / "sharing_cubic.toml"
    line = refused("run", cubic, "--set", f"machine={path}")
    assert f"{path}: missing table [map]" in line


def test_a_file_without_geometry_gets_one_line(tmp_path):
    path = tmp_path / "g.toml"
    path.write_text('[machine]\nname = "x"\n')
    assert "is no geometry file" in refused("machine", "from-geometry", path)


def test_named_columns_may_stand_in_either_order(tmp_path):
    rows = [f"{b!r},{h!r}" for h, b in zip(H.tolist(), B.tolist(), strict=True)]
    (tmp_path / "bh.csv").write_text("\n".join(["B_T,H_A_per_m", *rows]) + "\n")
    from reluctance.machine.geometry.steel_file import read_curve

    read_H, read_B = read_curve(tmp_path / "bh.csv")
    np.testing.assert_array_equal(read_H, H)
    np.testing.assert_array_equal(read_B, B)


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A geometry file, the machine file that the command makes of it, and what it prints."""
    folder = tmp_path_factory.mktemp("geometry")
    path, out = write(folder / "g.toml", GOOD), folder / "m.toml"
    figure = folder / "m.png"
    done = command("machine", "from-geometry", path, "--out", out, "--plot", figure, "--json")
    assert done.code == 0, done.error
    assert figure.stat().st_size > 20_000
    return path, out, json.loads(done.out)


def test_a_given_resistance_holds_at_20_degrees_and_is_what_the_command_prints(
    tmp_path, monkeypatch
):
    """With given inertia; a value far from the computed one is asked about."""
    monkeypatch.setattr("reluctance.machine.geometry.solved.Grid", lambda: COARSE)
    path, out = tmp_path / "g.toml", tmp_path / "m.toml"
    warm = {"winding__temperature_degC": 90.0}
    own = by_products_of(geometry(**warm))
    for R, J, far in ((0.25, 4e-4, []), (25.0, 2.0, ["R_ohm = 25", "J_kgm2 = 2"])):
        write(path, changed(machine__R_ohm=R, machine__J_kgm2=J, **warm))
        with warnings.catch_warnings(record=True) as told:
            warnings.simplefilter("always")
            done = command("machine", "from-geometry", path, "--out", out)
        assert done.code == 0, done.error
        assert f"R = {R:g} ohm as given" in done.out and f"J = {J:g} kg m2 as given" in done.out
        assert [note for note in far if note in str([w.message for w in told])] == far
        assert len(told) == len(far)
        machine = read_toml(out)["machine"]
        assert "temp_R_degC" not in machine and machine["temp_w_degC"] == 90
        assert (machine["R_ohm"], machine["J_kgm2"]) == (R, J)
        assert machine_from(machine_table(str(out), tmp_path)).R == pytest.approx(R * 1.2751)
    write(path, changed(**warm))
    done = command("machine", "from-geometry", path, "--out", out)
    assert f"R = {own.R_ohm:.4g} ohm at 90 degC" in done.out
    assert read_toml(out)["machine"]["temp_R_degC"] == 90


def drive(machine, law="angles", **control):
    """Tables of a drive at a held speed."""
    return {
        "machine": machine,
        "converter": {"u_dc_V": 150},
        "load": {"kind": "locked", "speed_rpm": 700},
        "reference": {"kind": "torque", "tau_Nm": 1.5},
        "control": {"law": law, "T_s_us": 25, **control},
        "simulation": {"until_s": 0.06},
    }


@pytest.mark.long
def test_machine_file_and_geometry_file_give_the_same_drive(made, tmp_path):
    """Resistance and inertia of the file are rounded to four digits."""
    geometry_path, machine_path, _ = made
    kpis = []
    for name in (geometry_path, machine_path):
        path = write(tmp_path / "d.toml", drive({}))
        tables = path.read_text().replace("[machine]\n", "")
        path.write_text(f'machine = "{name}"\n' + tables)
        kpis.append(rl.simulate(rl.load(path)).kpis)
    assert kpis[0].tau_mean == pytest.approx(1.5, rel=0.05)
    assert kpis[0].tau_mean == pytest.approx(kpis[1].tau_mean, rel=2e-3)
    assert kpis[0].i_rms == pytest.approx(kpis[1].i_rms, rel=2e-3)
    assert max(abs(k.energy_residual) for k in kpis) < 1e-6


@pytest.mark.long
def test_keys_of_the_geometry_are_keys_of_the_drive(made, tmp_path):
    path = write(tmp_path / "d.toml", drive({}))
    path.write_text(f'machine = "{made[0]}"\n' + path.read_text().replace("[machine]\n", ""))
    first = rl.load(path)
    shorter = first.with_values({"machine.lamination.stack_length_mm": 25.0})
    assert shorter.machine.J_kgm2 == pytest.approx(first.machine.J_kgm2 / 2, rel=1e-6)
    torque = [d.machine.tau(10.0, 1.8) for d in (first, shorter)]
    assert torque[1] == pytest.approx(torque[0] / 2, rel=1e-6)
    warm = first.with_values({"machine.temp_w_degC": 120.0})
    assert warm.machine.R == pytest.approx(first.machine.R * 1.393, rel=1e-6)
    with pytest.raises(rl.ParameterError, match="neighbouring poles overlap"):
        first.with_values({"machine.stator.pole_arc_deg": 70.0})


@pytest.mark.long
def test_a_control_may_know_the_geometry_wrong(made, tmp_path):
    """[mismatch] scales what the control knows of flux linkage and resistance."""
    path = write(tmp_path / "d.toml", drive({}))
    path.write_text(f'machine = "{made[0]}"\n' + path.read_text().replace("[machine]\n", ""))
    one, other = (rl.load(path, [f"mismatch.flux_factor={x}"]).known() for x in (1.0, 1.2))
    for figure in ("psi", "tau"):
        known, scaled = (float(getattr(x.machine, figure)(9.0, 2.0)) for x in (one, other))
        assert scaled == pytest.approx(1.2 * known, rel=1e-6)


@pytest.mark.long
def test_the_map_is_energy_consistent_and_judged_good(made):
    solution = solved(geometry())
    report = check_map(solution.table(4))
    assert report.verdict == "good"
    assert report.area_error < 2e-3
    work = np.trapezoid(solution.tau[-1], solution.theta_e) / 4
    gain = solution.coenergy[-1, -1] - solution.coenergy[-1, 0]
    assert work == pytest.approx(gain, rel=0.02)
    assert made[2]["R_ohm"] == pytest.approx(solution.R_ohm)
    assert made[2]["tau_peak_Nm"] == pytest.approx(solution.tau.max())


def test_a_convergence_that_fails_is_an_error(tmp_path, monkeypatch):
    coarsest = Grid(cell=30.0, growth=30.0, yoke=1)
    monkeypatch.setattr("reluctance.machine.geometry.solved.Grid", lambda: coarsest)
    path = write(tmp_path / "g.toml", changed(map__angles=13, map__currents=6))
    out = tmp_path / "m.toml"
    line = refused("machine", "from-geometry", path, "--out", out, "--convergence")
    assert "need at most 5 %: this map is not to be used" in line
    assert not out.exists()


def test_a_machine_file_that_was_edited_is_not_overwritten(tmp_path, monkeypatch):
    monkeypatch.setattr("reluctance.machine.geometry.solved.Grid", lambda: COARSE)
    path = write(tmp_path / "g.toml", changed())
    order = ("machine", "from-geometry", path, "--out", tmp_path / "m.toml")
    for _ in range(2):  # the second time over its own files
        assert command(*order).code == 0
    out = tmp_path / "m.toml"
    out.write_text(out.read_text().replace("R_ohm = ", "R_ohm = 1"))
    mine = out.read_text()
    line = refused(*order)
    assert "m.toml has been edited; remove m.toml, m.csv, m_force.csv, or choose another" in line
    assert out.read_text() == mine
    for name in ("m.toml", "m.csv", "m_force.csv"):
        (tmp_path / name).unlink()
    assert command(*order).code == 0
    assert "g.toml exists, and may have been" in refused(*order[:-1], path)


@pytest.mark.parametrize(("width", "height"), [(8.0, 12.0), (6.0, 10.0), (5.0, 14.0)])
def test_a_stated_coil_has_its_width_times_its_height(width, height):
    """R, wire and copper follow from the area w h, whatever the mesh."""
    case = geometry(
        winding__coil_width_mm=width, winding__coil_height_mm=height, winding__slot_fill=0.5
    )
    for grid in (COARSE, None):
        position = at_angle(system_of(case, grid), 0.1)
        assert position.coil_area == pytest.approx(width * height * 1e-6, rel=1e-12)
    turn = 2 * (50e-3 + 2 * case.cross_section.half_width_s + np.pi / 2 * width * 1e-3)
    R = COPPER_RESISTIVITY * 2 * 90 * turn / (0.5 * width * height * 1e-6 / 90)
    assert by_products_of(case).R_ohm == pytest.approx(R, rel=1e-6)


@pytest.mark.long
def test_a_machine_of_a_geometry_is_copied_and_its_file_fits_the_schema(made, tmp_path):
    import jsonschema

    path = write(tmp_path / "d.toml", drive({}))
    path.write_text(f'machine = "{made[0]}"\n' + path.read_text().replace("[machine]\n", ""))
    first = rl.load(path)
    machine = first.machine.model_copy(update={"R_ohm": 1.0})
    assert machine.R == pytest.approx(1.0) and machine.J_kgm2 == first.machine.J_kgm2
    first.save(tmp_path / "saved.toml")
    judge = jsonschema.Draft202012Validator(json.loads(command("schema").out))
    saved = read_toml(tmp_path / "saved.toml")
    assert judge.is_valid(saved), list(judge.iter_errors(saved))[:1]
    saved["machine"]["stator"]["pole_arcs_deg"] = 3.0
    assert not judge.is_valid(saved)


@pytest.mark.long
def test_a_saved_machine_of_a_geometry_keeps_its_steel_and_is_one_of_a_kind(tmp_path, monkeypatch):
    """The B-H file is found from another folder, and a store of sweeps has all of the geometry: a
    coarser map changes no other key of the machine."""
    (tmp_path / "given").mkdir()
    (tmp_path / "saved").mkdir()
    monkeypatch.chdir(tmp_path / "given")
    points = [f"{h},{b}" for h, b in zip(H, B, strict=True)]
    Path("bh.csv").write_text("\n".join(points))
    coarse = {"map__angles": 13, "map__currents": 6}
    write(Path("lam.toml"), changed(lamination__steel="bh.csv", **coarse))
    write(Path("d.toml"), drive({}))
    path = Path("d.toml")
    path.write_text('machine = "lam.toml"\n' + path.read_text().replace("[machine]\n", ""))
    first = rl.load("d.toml")
    first.save("../saved/d.toml")
    monkeypatch.chdir(tmp_path)
    assert rl.load("saved/d.toml").machine.R == first.machine.R
    assert [file.name for file in first.machine.files] == ["bh.csv"]
    monkeypatch.chdir(tmp_path / "given")
    finer = rl.load("d.toml", ["machine.map.angles=14"])
    assert finer.machine.R == first.machine.R
    assert fingerprint(finer, 0.1) != fingerprint(first, 0.1)


@pytest.mark.long
def test_torque_between_the_nodes_is_the_field_s():
    """0.2 % rms of the peak at points of no node, on the default grid of the map."""
    seed = int(np.random.SeedSequence().generate_state(1)[0])
    print(f"seed {seed}")
    random = np.random.default_rng(seed)
    case = geometry(map__angles=None, map__currents=None)
    solution, system = solved(case), system_of(case)
    machine = fit_surface(solution.table(4)).machine
    theta_e, i = random.uniform(0, np.pi, 40), random.uniform(0.3, 15, 40)
    found = _core.magnetics(machine, i, theta_e)
    exact = []
    for angle, current in zip(theta_e, i, strict=True):
        field = solve(at_angle(system, rotor_angle(system, angle)), current * np.eye(3)[0])
        exact.append((field.psi[0] + solution.L_end_H * current, field.tau))
    psi, tau = np.array(exact).T
    assert np.sqrt(np.mean((found[:, 2] - tau) ** 2)) < 2e-3 * solution.tau.max()
    assert np.abs(found[:, 0] - psi).max() < 2e-3 * solution.psi.max()


@pytest.mark.long
def test_end_windings_turns_and_paths_scale_as_they_must():
    few = {"map__angles": 13, "map__currents": 6}
    base = geometry(**few)
    more = geometry(**few, winding__turns_per_pole=180, map__current_max_A=7.5)
    one, two = solved(base), solved(more)
    np.testing.assert_allclose(two.tau, one.tau, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(two.psi, 2 * one.psi, rtol=1e-6, atol=1e-9)
    assert two.R_ohm == pytest.approx(4 * one.R_ohm)
    assert two.L_end_H == pytest.approx(4 * one.L_end_H)
    fixed = solved(geometry(**few, winding__end_winding=2.0))
    extra = (2e-3 - one.L_end_H) * one.i[:, None]
    np.testing.assert_allclose(fixed.psi, one.psi + extra, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(fixed.tau, one.tau, rtol=1e-9, atol=1e-12)


@pytest.mark.long
def test_the_radial_force_is_that_of_the_flux_of_the_pole():
    """Aligned and unsaturated, the stress on the pole is B^2/(2 mu_0), B its flux over its area."""
    solution, case = solved(geometry()), geometry()
    flux = (solution.psi[1, -1] - solution.L_end_H * solution.i[1]) / (2 * 90)
    width = 28e-3 * np.radians(30)
    B = flux / (width * 50e-3)
    force = B**2 / (2 * mu_0) * width * 50e-3
    assert case.air_gap.length_mm == 0.3
    assert solution.pole_force[1, -1] == pytest.approx(force, rel=0.15)
    assert list(solution.orders[:3]) == [0, 2, 4]
    # Two opposite poles pull: order 0 and 2 are the largest, and no order is odd.
    amplitude = solution.stress_orders[:, -1, -1]
    assert amplitude[1] > amplitude[3:].max()


@pytest.mark.long
def test_the_convergence_report_has_five_points():
    points = convergence(geometry())
    assert [p["theta_e_deg"] for p in points] == pytest.approx([0, 45, 90, 135, 180])
    assert max(abs(p["psi_change"]) for p in points) < 5e-4
    assert max(abs(p["tau_change"]) for p in points) < 2e-3
    assert max(abs(p["tau_rough"]) for p in points) < 5e-3


def test_a_polarity_that_does_not_reverse_is_solved_whole():
    """A, A, -A, -A around the stator: other paths of the flux than A, -A, A, -A."""
    twelve = dict(
        machine__stator_poles=12,
        machine__rotor_poles=8,
        stator__pole_arc_deg=14.0,
        rotor__pole_arc_deg=15.0,
        map__angles=13,
        map__currents=6,
    )
    usual = geometry(**twelve)
    assert usual.polarity == "NNNSSSNNNSSS"
    other = geometry(**twelve, winding__polarity="NNNNNNSSSSSS")
    assert usual.coils.reverses(4) and not other.coils.reverses(4)
    fields = []
    for case in (usual, other):
        system = system_of(case, COARSE)
        fields.append(solve(at_angle(system, 0.0), np.array([15.0, 0, 0])))
    small, whole = (f.position.system.n for f in fields)
    assert whole > 3.9 * small
    less = 1 - fields[1].psi[0] / fields[0].psi[0]
    assert 1e-4 < less < 0.05  # longer paths through the yokes


GEOMETRIES = sorted((resources("machines") / "geometry").glob("*.toml"))


@pytest.mark.parametrize("path", GEOMETRIES, ids=lambda path: path.stem)
def test_a_stored_map_is_that_of_its_geometry(path):
    """At two nodes; the whole map takes a while."""
    table = flattened(read_toml(path))
    del table["model"]
    case = checked(Geometry, table, path.name)
    stored = np.loadtxt(path.parents[1] / f"{path.stem}.csv", delimiter=",", skiprows=1)
    system = system_of(case)
    force = read_pole_force(path.parents[1] / f"{path.stem}_force.csv")
    machine = read_toml(path.parents[1] / f"{path.stem}.toml")["machine"]
    assert machine["source"].endswith(f"map computed from {path.name} (2-D field)")
    for theta_deg in (90.0, 180.0):
        near = np.abs(stored[:, 1] - theta_deg) < 1e-9
        i, _, psi, tau = stored[near][10]
        unit = np.eye(case.phases)[0]
        field = solve(at_angle(system, rotor_angle(system, np.radians(theta_deg))), i * unit)
        own = field.psi[0] + by_products_of(case).L_end_H * i
        assert own == pytest.approx(psi, rel=1e-5)
        assert field.tau == pytest.approx(tau, abs=1e-4 * stored[:, 3].max())
        pull = stress(field).pole_force(0, case.stator_poles)
        assert force.at(i, np.radians(theta_deg)) == pytest.approx(pull, rel=1e-3)


def test_there_is_a_geometry_of_each_kind():
    poles = set()
    for path in GEOMETRIES:
        head = read_toml(path)["machine"]
        poles.add((head["stator_poles"], head["rotor_poles"]))
        assert head["source"] and head["licence"] and head["assumed"]
    assert poles >= {(6, 4), (8, 6), (10, 8), (12, 8), (18, 12)}


@pytest.mark.parametrize("kind", [Geometry, *inner_sections(Geometry).values()])
def test_no_length_of_a_geometry_is_negative_and_a_small_one_passes(kind):
    """Nor a resistance, an inertia or a friction; what is counted begins at one."""
    for key, whole in numbers(kind):
        unit = key.rpartition("_")[2]
        if unit in (*SIZES, "A"):
            assert fault_of(kind, key, -1e-9), key
            assert fault_of(kind, key, 1e-3) is None, key
        if key in ("turns_per_pole", "parallel_paths"):
            assert whole and fault_of(kind, key, 0) and not fault_of(kind, key, 1), key
        default = kind.model_fields[key].default
        if isinstance(default, int | float):
            assert fault_of(kind, key, default) is None, key


@pytest.mark.parametrize(
    ("kind", "key", "within", "beyond"),
    [
        (Lamination, "stacking_factor", 1.0, 1.001),  # all of it is steel
        (Coils, "slot_fill", 0.785, 0.801),  # round wires on a square grid: pi/4
        (Geometry, "phases", 2, 1),
        (MapGrid, "pair_rank", 1, 0),
        (MapGrid, "pair_rank", 8, 9),  # the page
        (Coils, "temperature_degC", -199.0, -201.0),  # copper's law of 0.393 % per kelvin
        (Lamination, "saturation_polarisation_T", 1.01, 0.99),
    ],
)
def test_values_of_a_geometry_end_where_they_must(kind, key, within, beyond):
    assert fault_of(kind, key, within) is None and fault_of(kind, key, beyond)


@pytest.mark.parametrize(("coupling", "first"), [("none", 1.0), ("pairs", 0.25)])
def test_progress_of_a_geometry_rises_to_one_and_pairs_take_the_greater_part(
    tmp_path, monkeypatch, coupling, first
):
    told = []
    kept = SimpleNamespace(table=lambda N_r: N_r, i=np.array([0.0, 15.0]), psi=np.eye(2))

    def field(geometry, *, progress):
        progress(0.5), progress(1.0)
        return kept

    def coupled(geometry, machine, i_last, *, told):
        assert (machine, i_last) == (("surface", 4), 15.0)
        told(0.5), told(1.0)
        return "coupled"

    monkeypatch.setattr(from_geometry, "solved", field)
    monkeypatch.setattr(from_geometry, "coupling_of", coupled)
    monkeypatch.setattr(from_geometry, "surface", lambda table: ("surface", table))
    path = write(tmp_path / "g.toml", changed(map__coupling=coupling))
    found = from_geometry.machine_from_geometry(path, progress=told.append)
    rest = [first + (1 - first) / 2, 1.0] if first < 1 else []
    assert told == pytest.approx([first / 2, first, *rest])
    assert (found.solution, found.name) == (kept, "g.toml")
    assert found.coupling == ("coupled" if first < 1 else None)
    assert from_geometry.machine_from_geometry(path).solution is kept


def test_a_field_is_drawn_with_half_of_the_largest_current_or_the_given_one(monkeypatch):
    solved_with = []
    monkeypatch.setattr(from_geometry, "at_angle", lambda system, alpha: alpha)
    monkeypatch.setattr(from_geometry, "solve", lambda at, i: solved_with.append((at, i)))
    monkeypatch.setattr(draw, "draw_field", lambda field, axes: axes)
    monkeypatch.setattr(draw, "draw", lambda system, axes, *, alpha: solved_with.append(alpha))
    found = from_geometry.FromGeometry(geometry(), None, "mine")
    system = solved_module.system_of(geometry())
    axes = Figure().subplots()
    found.draw_field(axes)
    assert axes.get_title() == "7.5 A, 120 deg el."
    found.draw_field(axes, theta_e_deg=90, i_A=4.0)
    assert axes.get_title() == "4 A, 90 deg el."
    found.draw(axes, theta_e_deg=60)
    found.draw(axes)
    assert axes.get_title() == "mine"
    (a, first), (b, second), *c = solved_with
    assert [*first] == [7.5, 0, 0] and [*second] == [4, 0, 0]
    angles = [rotor_angle(system, np.radians(degrees)) for degrees in (120, 90, 60, 120)]
    assert [a, b, *c] == pytest.approx(angles)


def test_how_far_a_mesh_is_off_is_told_in_parts_of_the_greatest(monkeypatch):
    """On fields that are formulae: the finer mesh has 2 % more flux linkage and 4 % more torque,
    and the co-energy rises by 3 % more than the coarse torque says."""

    def solve(at, i):
        fine, theta = at
        assert [*i] == [7.5, 0, 0]
        return SimpleNamespace(
            psi=[(1.02 if fine else 1.0) * (2 - np.cos(theta))],
            tau=(1.04 if fine else 1.0) * np.sin(theta),
            coenergy=-1.03 * np.cos(theta),
        )

    section = SimpleNamespace(beta_s=0.5, beta_r=0.55)
    usual = Grid()

    def system_of(geometry, grid):
        return SimpleNamespace(section=section, fine=grid != usual)

    monkeypatch.setattr(solved_module, "system_of", system_of)
    monkeypatch.setattr(f"{PLACE}.samples.rotor_angle", lambda system, theta: theta)
    monkeypatch.setattr(f"{PLACE}.position.at_angle", lambda system, at: (system.fine, at))
    monkeypatch.setattr(f"{PLACE}.solve.solve", solve)
    rows = solved_module.convergence(geometry())
    theta = np.radians([row["theta_e_deg"] for row in rows])
    assert theta[0] == 0 and theta[-1] == pytest.approx(np.pi)
    psi, tau = 2 - np.cos(theta), np.sin(theta)
    assert [row["psi_Wb"] for row in rows] == pytest.approx(1.02 * psi)
    assert [row["tau_Nm"] for row in rows] == pytest.approx(1.04 * tau)
    parts = {
        "psi_change": -0.02 * psi / (1.02 * psi.max()),
        "tau_change": -0.04 * tau / (1.04 * tau.max()),
        "tau_rough": -0.03 * tau / (1.04 * tau.max()),
    }
    for name, expected in parts.items():
        assert [row[name] for row in rows] == pytest.approx(expected, abs=1e-4), name


@pytest.mark.parametrize(
    ("key", "wrong", "given"),
    [
        ("map__current_max_A", 1500.0, {}),
        ("map__current_max_A", 1500.0, {"winding__turns_per_pole": 6007}),
        ("air_gap__length_mm", 0.01, {}),
        ("air_gap__length_mm", 0.01, {"stator__bore_diameter_mm": 57.3}),
        ("lamination__stack_length_mm", 0.1, {"stator__bore_diameter_mm": 57.31}),
    ],
)
def test_the_limit_that_a_message_names_is_allowed(key, wrong, given):
    with pytest.raises(rl.ParameterError, match=r"need at (most|least) [0-9]") as fault:
        geometry(**given | {key: wrong})
    limit = float(re.search(r"need at (?:most|least) ([\d.]+)", str(fault.value))[1])
    section, name = key.split("__")
    assert getattr(getattr(geometry(**given | {key: limit}), section), name) == limit


def test_an_air_gap_is_asked_about_below_a_tenth_of_a_millimetre():
    assert questions(geometry(air_gap__length_mm=0.1)) == []
    (question,) = questions(geometry(air_gap__length_mm=0.0999))
    assert "air_gap.length_mm = 0.0999, while gaps that are built begin at 0.1" in question


@pytest.mark.parametrize(("given", "asked"), [(0.399, 1), (0.4, 0), (2.0, 0), (10.0, 0), (10.1, 1)])
def test_a_given_value_is_asked_about_beyond_five_times_the_computed_one(given, asked):
    found = [*from_geometry._far("J_kgm2", given, 2.0, "kg m2")]
    assert len(found) == asked
    if asked:
        told = f"J_kgm2 = {given:g} is given, while 2 kg m2 follow from the dimensions: check its"
        assert found[0].startswith(told)


def test_a_machine_whose_iron_has_no_room_behind_the_poles_is_refused():
    thin = SimpleNamespace(i=np.array([0.0, 25.0]), psi=np.array([[0.0, 0.0], [0.0632, 0.0439]]))
    with pytest.raises(rl.ParameterError, match=r"has 0\.0439 Wb aligned and 0\.0632 Wb"):
        from_geometry._check_rises(thin)
    thin.psi[-1] = [0.0439, 0.0632]
    from_geometry._check_rises(thin)


def test_pairs_of_a_geometry_are_scaled_by_what_a_control_believes(monkeypatch):
    """By the factor on all flux linkage and by the one on pairs; the field is not solved for it."""
    monkeypatch.setattr(
        geometry_machine, "_solution", lambda *_: SimpleNamespace(R_ohm=1.0, J_kgm2=1e-3)
    )
    monkeypatch.setattr(
        geometry_machine, "_coupling", lambda *_: SimpleNamespace(times=lambda x: x)
    )
    table = flattened(changed(map__coupling="pairs"))
    machine = geometry_machine.GeometryMachine.from_table(table, "[machine]")
    assert machine.coupled and machine.coupling == 1
    assert machine.computed(psi_factor=0.5, pair_factor=0.8).coupling == pytest.approx(0.4)
    monkeypatch.setattr(geometry_machine, "_coupling", lambda *_: None)
    assert machine.coupling is None
