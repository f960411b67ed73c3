"""Readers of map files on content that is given byte by byte or cell by cell."""

import struct
import zlib
from types import SimpleNamespace

import numpy as np
import pytest
import scipy.io

from reluctance import ParameterError
from reluctance.machine.geometry.from_geometry import FromGeometry
from reluctance.machine.library import flattened, machine_table
from reluctance.machine.maps import FluxTable
from reluctance.machine.maps.cells import any_rows, cells, text_rows
from reluctance.machine.maps.mat_file import read_arrays
from reluctance.machine.maps.units import suspects

WHOLE = np.arange(6).reshape(2, 3)


@pytest.mark.parametrize("compressed", [False, True])
@pytest.mark.parametrize("kind", "i1 u1 i2 u2 i4 u4 i8 u8 f4 f8".split())
def test_arrays_of_every_kind_of_number_are_read(tmp_path, kind, compressed):
    path = tmp_path / "a.mat"
    what = {"map": (7 * WHOLE).astype(kind), "n": np.array(4.5), "said": "linkage, µWb"}
    what |= {"z": np.array([1 + 2j]), "cell": np.array([1, "b"], object), "last": WHOLE[:, :1] / 3}
    scipy.io.savemat(path, what, do_compression=compressed)
    found = read_arrays(path)
    assert {*found} == {"map", "n", "said", "last"}  # all else is passed over
    assert np.array_equal(found["map"], 7.0 * WHOLE) and found["map"].dtype == float
    assert found["n"].tolist() == [[4.5]] and str(found["said"]) == "linkage, µWb"
    assert np.array_equal(found["last"], WHOLE[:, :1] / 3)


def element(order, kind, data):
    return struct.pack(f"{order}II", kind, len(data)) + data + b"\0" * (-len(data) % 8)


def variable(order, *, shape=(3, 2), flags=6, name=b"map", values=None):
    numbers = np.arange(6.0) if values is None else values
    return (
        element(order, 6, struct.pack(f"{order}II", flags, 0))
        + element(order, 5, struct.pack(f"{order}{len(shape)}i", *shape))
        + (struct.pack(f"{order}I", len(name) << 16 | 1) if order == "<" else b"")
        + (name.ljust(4, b"\0") if order == "<" else element(order, 1, name))
        + element(order, 9, np.asarray(numbers, f"{order}f8").tobytes())
    )


def mat(path, order, *parts, version=b"\0\1"):
    marks = {"<": (version, b"IM"), ">": (version[::-1] if version == b"\0\1" else version, b"MI")}
    head = b"MATLAB 5.0".ljust(124) + b"".join(marks[order])
    path.write_bytes(head + b"".join(parts))
    return path


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("packed", [False, True])
def test_both_orders_of_bytes_are_read_column_by_column(tmp_path, order, packed):
    part = element(order, 14, variable(order))
    if packed:
        part = zlib.compress(part)
        part = struct.pack(f"{order}II", 15, len(part)) + part
    found = read_arrays(mat(tmp_path / "a.mat", order, part))
    assert found["map"].tolist() == [[0, 3], [1, 4], [2, 5]]


@pytest.mark.parametrize(
    ("part", "told"),
    [
        (variable("<", shape=(3, 3)), "`map` has 6 values for the sizes 3 x 3"),
        (variable("<", shape=(-3, -2)), "`map` has 6 values for the sizes -3 x -2"),
        (variable("<")[:40], "a variable lacks a part"),
        (element("<", 99, b"12345678") + variable("<"), "a variable lacks a part"),
    ],
)
def test_a_damaged_variable_is_told(tmp_path, part, told):
    with pytest.raises(ParameterError, match=told):
        read_arrays(mat(tmp_path / "a.mat", "<", element("<", 14, part)))


def test_an_element_that_is_longer_than_its_file_and_another_format_are_told(tmp_path):
    whole = element("<", 14, variable("<"))
    with pytest.raises(ParameterError, match="an element is longer than the file"):
        read_arrays(mat(tmp_path / "a.mat", "<", whole[:-1]))
    assert read_arrays(mat(tmp_path / "a.mat", "<", whole))
    for path in (
        mat(tmp_path / "b.mat", "<", whole, version=b"\0\2"),  # v7.3 is HDF5
        tmp_path / "c.mat",
    ):
        if not path.exists():
            path.write_bytes(b"x" * 200)
        with pytest.raises(ParameterError, match=r"not a \.mat file of v5 to v7"):
            read_arrays(path)


def test_a_variable_that_unpacks_to_more_than_fifty_megabytes_is_not_unpacked(tmp_path):
    part = zlib.compress(b"\0" * 50_000_001)
    with pytest.raises(ParameterError, match="more than 50 MB unpacked"):
        read_arrays(mat(tmp_path / "a.mat", "<", struct.pack("<II", 15, len(part)) + part))


@pytest.mark.parametrize(
    ("line", "separator", "expected"),
    [
        ("1  2\t3", None, ["1", "2", "3"]),
        ('"phase a" 2', None, ["phase a", "2"]),
        ('1, "a, b" ,3', ",", ["1", "a, b", "3"]),
        ("1; 2,5 ;3", ";", ["1", "2,5", "3"]),
    ],
)
def test_a_line_is_cut_at_its_separators_outside_of_quotes(line, separator, expected):
    assert cells(line, separator) == expected


def test_rows_of_text_are_those_below_comments_with_the_names_of_the_last_comment():
    text = "# by me\n# i_A theta_deg psi_Wb\n\n! more\n0 1 2\n3 4 5\n"
    assert text_rows(text) == [["i_A", "theta_deg", "psi_Wb"], ["0", "1", "2"], ["3", "4", "5"]]
    assert text_rows("% i_A;theta_deg;x\n0;1;2\n")[0] == ["0", "1", "2"]  # two names only
    assert text_rows("# i_A theta_deg psi_Wb\na b c\n0 1 2\n")[0] == ["a", "b", "c"]
    assert any_rows("// x\nset;1\n1,5;2\n") == [["set", "1"], ["1.5", "2"]]
    for fault, told in (
        ("1 2\n3\n", "row 2 of the table has 1 cells, need 2"),
        ("# x\n\n", "no data"),
    ):
        with pytest.raises(ParameterError, match=told):
            text_rows(fault)
    with pytest.raises(ParameterError, match="no data; export it again"):
        any_rows("# x\n \n")


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("machine = 3\n", "machine = 3, need the table .machine."),
        ("[machine]\nmodel = 'x'\n[load]\n", "need the table .machine. and nothing else"),
        ("x = 1\n", "need the table .machine. and nothing else"),
        ("[machine]\n[stator]\n[rotr]\n", "unknown table `rotr`; did you mean `rotor`"),
    ],
)
def test_a_file_that_is_no_machine_is_told(tmp_path, text, told):
    (tmp_path / "m.toml").write_text(text)
    with pytest.raises(ParameterError, match=told):
        machine_table("m.toml", tmp_path)


def test_the_tables_of_a_geometry_become_one():
    given = {"machine": {"name": "x", "phases": 3}, "stator": {"pole_arc_deg": 30}}
    assert flattened(given) == {
        "name": "x",
        "phases": 3,
        "stator": given["stator"],
        "model": "geometry",
    }
    assert flattened({"stator": {}}) == {"stator": {}, "model": "geometry"}


@pytest.mark.parametrize(
    ("scale", "ten", "too_large", "words"),
    [
        ({"i": 1e3}, 1000.0, False, "the currents are 1/1000 of what"),
        ({"psi": 1e3}, 1000.0, False, "the flux linkage is 1/1000 of what the column says, as in"),
        ({"tau": 1e3}, 1000.0, True, "the torque is 1/1000 of what the column says, as in mNm"),
        ({"i": 1e9, "psi": 1e9}, 1000.0, False, "check the units of all three columns"),
    ],
)
def test_the_column_whose_unit_may_be_wrong_is_named_with_what_it_would_be(
    scale, ten, too_large, words
):
    """A machine of 10 A, 0.5 Wb and 8 N m, with one column a thousand times too large."""
    i, theta = np.linspace(0, 10, 6), np.linspace(0, np.pi, 7)
    psi = np.outer(i, 0.03 - 0.02 * np.cos(theta))
    tau = np.outer(i**2, 0.04 * np.sin(theta))
    given = {"i": i, "psi": psi, "tau": tau}
    given = {key: value * scale.get(key, 1.0) for key, value in given.items()}
    if max(given["i"][-1], given["psi"].max()) > 1e5:
        table = SimpleNamespace(**given)
    else:
        table = FluxTable(N_r=4, theta_e=theta, **given)
    assert words in suspects(table, ten, too_large=too_large)


class Wave:
    """What two phases add to each other's torque: a sine of their angle."""

    rank, numbers = 2, 50

    def at(self, phi, *i):
        assert i == (12.0, 12.0)
        return SimpleNamespace(tau=1.5 * np.sin(phi))


def test_a_solved_geometry_is_told_by_its_figures():
    """The mean torque of a phase is the energy of a stroke over the angle that it takes."""
    psi = np.array([[0, 0], [0.05, 0.3]])
    solution = SimpleNamespace(
        unknowns=1234, steps=5, psi=psi, tau=np.array([[0, 0], [7.5, -7.5]]), R_ohm=0.5,
        coenergy=np.array([[0.0, 0.0], [1.0, 4.0]]), pole_force=np.array([[0, 2000.0]]),
        L_end_H=2e-3, J_kgm2=3e-3, copper_kg=1.5, stator_iron_kg=4.0, rotor_iron_kg=1.0,
        wire_area_m2=1.5e-6,
    )  # fmt: skip
    geometry = SimpleNamespace(
        winding=SimpleNamespace(turns_per_pole=90, temperature_degC=20.0), stator_poles=6,
        rotor_poles=4, phases=3, R_ohm=None, J_kgm2=None,
        map=SimpleNamespace(current_max_A=12.0, angles=31, currents=20),
    )  # fmt: skip
    found = FromGeometry(geometry, solution, "mine")
    f = found.figures
    assert f["tau_mean_Nm"] == pytest.approx(3.0 * 4 / np.pi) and f["tau_peak_Nm"] == 7.5
    assert (f["psi_aligned_Wb"], f["psi_unaligned_Wb"]) == (0.3, 0.05)
    assert f["iron_kg"] == 5.0 and f["wire_area_mm2"] == pytest.approx(1.5)
    assert found.lines() == [
        "6/4, 3 phases: 1234 unknowns, 31 angles x 20 currents",
        "at 12 A: flux linkage 0.3 Wb aligned, 0.05 Wb unaligned; torque 7.5 N m peak, "
        "3.82 N m mean of one phase; radial force on a pole up to 2e+03 N",
        "R = 0.5 ohm at 20 degC, end windings 2 mH, wire 1.5 mm2 (estimates)",
        "J = 0.003 kg m2, copper 1.5 kg, iron 5 kg",
        'one phase at a time; [map] coupling = "pairs" solves two',
    ]
    wave = Wave()
    pairs = [SimpleNamespace(letters=letters, table=wave) for letters in ("ab", "bc")]
    coupled = FromGeometry(geometry, solution, "mine", SimpleNamespace(pairs=pairs))
    assert coupled.pair_lines() == [
        "pairs ab bc: at 12 A in both the torque differs from the sum of each alone by "
        "14.1 % rms and up to 20 % of the peak (rank 2, 50 numbers)"
    ]
