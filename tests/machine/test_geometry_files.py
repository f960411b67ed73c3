"""Geometry files: what is refused or asked about, and with which line."""

import re
import warnings
from types import SimpleNamespace

import numpy as np
import pytest
from command import refused
from ends import SIZES, fault_of, numbers
from geometries import COARSE, GEOMETRIES, GOOD, changed, geometry, write
from scipy.constants import mu_0

import reluctance as rl
from reluctance.base.resources import resources
from reluctance.base.schema import inner_sections
from reluctance.base.toml_file import read_toml
from reluctance.machine.geometry import from_geometry
from reluctance.machine.geometry.file import Coils, Geometry, Lamination, MapGrid
from reluctance.machine.geometry.geometry_machine import geometry_of
from reluctance.machine.geometry.proportions import questions
from reluctance.machine.geometry.solved import by_products_of
from reluctance.machine.geometry.steel_file import grade, read_curve
from reluctance.machine.library import flattened

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
    (
        {"machine__stator_poles": 4, "machine__rotor_poles": 3, "machine__phases": 4},
        "leave 1 to a phase, need an even number, half of them N and half S, or the flux has no "
        "way back; the next poles that do are 4/2",
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
    for data in (GOOD, *map(read_toml, GEOMETRIES)):
        assert questions(geometry_of(flattened(data), "[machine]")) == []
    (line,) = questions(geometry(**all_lengths(0.1)))
    assert line.endswith("are all lengths in millimetres?")


def test_lengths_of_no_machine_are_refused_before_what_follows_from_them():
    """As in metres, whose first consequence would be a current."""
    with pytest.raises(rl.ParameterError, match="need at least 5; check the units of all lengths"):
        geometry(**all_lengths(1e-3))
    assert geometry(**all_lengths(5.001 / GOOD["stator"]["outer_diameter_mm"])) is not None


def all_lengths(factor):
    names = [*LENGTHS, "stator__outer_diameter_mm"]
    parts = [name.split("__") for name in names]
    sizes = [factor * GOOD[section][key] for section, key in parts]
    return dict(zip(names, sizes, strict=True)) | {"map__current_max_A": 1e-3}


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
    assert by_products_of(geometry(winding__end_winding=0.0)).L_end_H == 0.0


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


@pytest.mark.parametrize(
    ("head", "columns"),
    [
        ("H [A/m],B [T]", (H, B)),
        ("B_T,H_A_per_m", (B, H)),
        ("No,H [kA/m],mu_r,B [mT]", (range(len(H)), H / 1e3, 0 * H, 1e3 * B)),
        ("H (A/cm),B (kG)", (H / 100, 10 * B)),
        ("B [G],H [Oe]", (1e4 * B, H * 4 * np.pi / 1000)),
        ("H [A/m],J [T]", (H, B - mu_0 * H)),
        ("J [T],B [T],H [A/m]", (B - mu_0 * H, B, H)),
    ],
)
def test_a_curve_is_read_in_the_units_that_its_columns_name(tmp_path, head, columns):
    rows = [",".join(f"{x:.12g}" for x in row) for row in zip(*columns, strict=True)]
    (tmp_path / "bh.csv").write_text("\n".join([head, *rows]) + "\n")
    for found, right in zip(read_curve(tmp_path / "bh.csv"), (H, B), strict=True):
        assert found == pytest.approx(right, rel=1e-9, abs=1e-9)


@pytest.mark.parametrize(
    ("head", "told"),
    [
        ("H [A/m],B [T],H [A/m],B [T]", "`H [A/m]` and `H [A/m]` are both H; remove one"),
        ("H [mOe],B [T],a,b", "has the unit `moe`, need a/m or ka/m"),
    ],
)
def test_columns_of_a_curve_that_cannot_be_told_apart_are_refused(tmp_path, head, told):
    rows = [f"{h},{b},{h},{b}" for h, b in zip(H, B, strict=True)]
    (tmp_path / "bh.csv").write_text("\n".join([head, *rows]) + "\n")
    with pytest.raises(rl.ParameterError) as fault:
        read_curve(tmp_path / "bh.csv")
    assert told in str(fault.value)


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


@pytest.mark.parametrize(("part", "asked"), [(0.999, 0), (1.001, 1)])
def test_a_given_resistance_is_held_against_the_computed_one_at_20_degrees(part, asked):
    """The computed one is that of the winding's temperature."""
    warm = SimpleNamespace(
        winding=SimpleNamespace(temperature_degC=120.0), R_ohm=5 * 2.0 * part, J_kgm2=None
    )
    found = [*from_geometry._far_from_computed(warm, SimpleNamespace(R_ohm=2.0 * 1.393))]
    assert len(found) == asked and all("2 ohm at 20 degC" in line for line in found)


def test_a_machine_whose_iron_has_no_room_behind_the_poles_is_refused():
    thin = SimpleNamespace(i=np.array([0.0, 25.0]), psi=np.array([[0.0, 0.0], [0.0632, 0.0439]]))
    with pytest.raises(rl.ParameterError, match=r"has 0\.0439 Wb aligned and 0\.0632 Wb"):
        from_geometry._check_rises(thin)
    thin.psi[-1] = [0.0439, 0.0632]
    from_geometry._check_rises(thin)
