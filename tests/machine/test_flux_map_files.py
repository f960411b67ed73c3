"""Map files: every orientation gives the same machine, every fault one line with a remedy."""

import json

import numpy as np
import pytest
import scipy.io
from test_flux_map import sampled

from reluctance.base.errors import ParameterError
from reluctance.machine.maps import FluxTable, read_map, surface, write_map
from reluctance.machine.maps.conventions import settled
from reluctance.machine.maps.importers import _read
from reluctance.machine.maps.raw import RawMap

I = np.linspace(0, 150, 16)  # noqa: E741
THETA_M = np.linspace(0, 45, 16)  # mechanical degrees from unaligned
TABLE = sampled(I, np.linspace(0, np.pi, 16))


def grid_csv(path, rows, columns, values):
    lines = [",".join(["", *map(repr, map(float, columns))])]
    for row, line in zip(rows, values, strict=True):
        lines.append(",".join(map(repr, map(float, [row, *line]))))
    path.write_text("\n".join(lines))
    return path


def long_csv(path, head, columns, order=None):
    rows = np.column_stack(columns)
    rows = rows if order is None else rows[order]
    body = "\n".join(",".join(map(repr, map(float, r))) for r in rows)
    path.write_text(f"{head}\n{body}\n")
    return path


def both(i, theta):
    return [x.ravel() for x in np.meshgrid(i, theta, indexing="ij")]


def written(tmp_path):
    """The table in ten forms, each with what the user must say."""
    i, theta = both(I, THETA_M)
    psi, tau = TABLE.psi, TABLE.tau
    shuffled = np.random.default_rng(1).permutation(i.size)
    yield grid_csv(tmp_path / "down.csv", I, THETA_M, psi), {}
    yield grid_csv(tmp_path / "across.csv", THETA_M, I, psi.T), {}
    yield grid_csv(tmp_path / "falling.csv", I, THETA_M[::-1], psi[:, ::-1]), {}
    yield grid_csv(tmp_path / "aligned.csv", I, THETA_M, psi[:, ::-1]), {"zero": "aligned"}
    yield grid_csv(tmp_path / "guess.csv", I, THETA_M, psi[:, ::-1]), {}
    yield grid_csv(tmp_path / "negative.csv", I, THETA_M - 45, psi), {"zero": "aligned"}
    yield grid_csv(tmp_path / "electrical.csv", I, THETA_M * 4, psi), {}
    yield grid_csv(tmp_path / "radians.csv", I, np.radians(THETA_M), psi), {"angle_unit": "rad"}
    head = "theta_m_deg, i_mA, tau_Nm, psi_mWb"
    columns = [theta, i * 1e3, tau.ravel(), psi.ravel() * 1e3]
    yield long_csv(tmp_path / "long.csv", head, columns, shuffled), {}
    whole = np.concatenate([THETA_M, 90 - THETA_M[-2::-1]])
    flux = np.hstack([psi, psi[:, -2::-1]])
    yield grid_csv(tmp_path / "whole.csv", I, whole, flux), {}
    yield grid_csv(tmp_path / "no_zero.csv", I[1:], THETA_M, psi[1:]), {}
    data = {"FTBL": psi[:, ::-1], "StatorCurrent": I, "RotorAngle": THETA_M}
    scipy.io.savemat(tmp_path / "simulink.mat", data)
    yield tmp_path / "simulink.mat", {}
    scipy.io.savemat(tmp_path / "named.mat", {"lam": psi.T, "amps": I, "pos": THETA_M})
    yield tmp_path / "named.mat", {"names": {"psi": "lam", "i": "amps", "theta": "pos"}}
    object_ = dict(N_r=4, i_A=list(I), theta_e_deg=list(THETA_M * 4), psi_Wb=psi.tolist())
    (tmp_path / "map.json").write_text(json.dumps(object_))
    yield tmp_path / "map.json", {"N_r": None}


def test_every_orientation_gives_the_identical_machine(tmp_path):
    reference = surface(TABLE)
    for path, said in written(tmp_path):
        machine = surface(read_map(path, **({"N_r": 4} | said)))
        assert np.array_equal(machine.knots, reference.knots) or np.allclose(
            machine.knots, reference.knots, rtol=1e-9
        ), path.name
        points = both(np.linspace(0, 200, 41), np.linspace(0, 2 * np.pi, 41)[:-1])
        ours, theirs = machine.magnetics(*points), reference.magnetics(*points)
        assert np.abs(ours - theirs).max(axis=0) == pytest.approx(
            0, abs=1e-8 * np.abs(theirs).max()
        ), path.name


@pytest.mark.parametrize("size", [1e-3, 1.0, 1e3])
def test_a_square_map_is_turned_by_its_line_without_flux(tmp_path, size):
    """As many currents as angles, written the other way round, with rounding at 0 A."""
    i, theta = np.linspace(0, 10, 11), np.linspace(0, 180, 11)
    psi = size * np.outer(np.tanh(i / 5), 1.1 - np.cos(np.radians(theta)))
    for low, turned in ((5e-7, True), (2e-6, False)):
        psi[0] = low * psi.max()
        content = dict(N_r=4, i_A=list(i), theta_e_deg=list(theta), psi_Wb=psi.T.tolist())
        (tmp_path / "m.json").write_text(json.dumps(content))
        raw = _read(tmp_path / "m.json", {})
        assert np.array_equal(raw.psi, psi if turned else psi.T)


def test_what_is_inferred_is_said(tmp_path):
    path = grid_csv(tmp_path / "m.csv", THETA_M, I[1:], TABLE.psi[1:, ::-1].T)
    notes = "; ".join(read_map(path, N_r=4).notes)
    for words in ("angles down", "deg mechanical", "zero read as aligned", "0 A added"):
        assert words in notes


def test_torque_counted_against_the_angle_is_turned_and_said(tmp_path):
    i, theta = both(I, THETA_M)
    head = "i_A,theta_m_deg,psi_Wb,tau_Nm"
    path = long_csv(tmp_path / "m.csv", head, [i, theta, TABLE.psi.ravel(), -TABLE.tau.ravel()])
    table = read_map(path, N_r=4)
    assert np.array_equal(table.tau, TABLE.tau)
    assert any("sign turned" in n for n in table.notes)


def test_torque_may_come_from_a_second_grid(tmp_path):
    flux = grid_csv(tmp_path / "psi.csv", I, THETA_M, TABLE.psi)
    torque = grid_csv(tmp_path / "tau.csv", I, THETA_M, TABLE.tau)
    assert np.array_equal(read_map(flux, N_r=4, torque=torque).tau, TABLE.tau)


def test_a_written_map_reads_back(tmp_path):
    write_map(TABLE, tmp_path / "m.csv")
    again = read_map(tmp_path / "m.csv", N_r=4)
    assert np.array_equal(again.psi, TABLE.psi)
    assert np.array_equal(again.tau, TABLE.tau)
    assert np.array_equal(again.theta_e, TABLE.theta_e)


def test_semicolons_with_decimal_commas_are_read(tmp_path):
    path = grid_csv(tmp_path / "m.csv", I, THETA_M, TABLE.psi)
    path.write_text(path.read_text().replace(",", ";").replace(".", ","))
    assert np.array_equal(read_map(path, N_r=4).psi, TABLE.psi)


def with_nan(psi):
    changed = psi.copy()
    changed[3, 4] = np.nan
    return changed


def doubled(axis):
    changed = axis.copy()
    changed[5] = changed[4]
    return changed


def unsorted(axis):
    changed = axis.copy()
    changed[[4, 5]] = changed[[5, 4]]
    return changed


BAD_GRIDS = {
    "degrees taken as radians": (I, THETA_M, TABLE.psi, {"angle_unit": "rad"}, "angle_unit=deg"),
    "radians taken as degrees": (
        I,
        np.radians(THETA_M),
        TABLE.psi,
        {"angle_unit": "deg"},
        "angle_unit=rad",
    ),
    "truncated half period": (I, THETA_M[:12], TABLE.psi[:, :12], {}, "132 deg el.*extend the map"),
    "wrong N_r": (I, THETA_M, TABLE.psi, {"N_r": 6}, "correct N_r"),
    "no N_r": (I, THETA_M, TABLE.psi, {"N_r": None}, "pass N_r"),
    "swapped layout": (
        I,
        THETA_M,
        TABLE.psi,
        {"layout": "angles_down"},
        "axes look swapped: flux vanishes along the first angle, not at 0 A",
    ),
    "swapped layout, angles down": (
        THETA_M,
        I,
        TABLE.psi.T,
        {"layout": "currents_down"},
        "axes look swapped: flux vanishes along the first angle, not at 0 A",
    ),
    "wrong zero": (I, THETA_M, TABLE.psi, {"zero": "aligned"}, "pass zero=unaligned"),
    "NaN": (
        I,
        THETA_M,
        with_nan(TABLE.psi),
        {},
        "data row 4, column 6: `nan` is not a finite number",
    ),
    "duplicated angle": (I, doubled(THETA_M), TABLE.psi, {}, "appears twice.*remove"),
    "duplicated current": (doubled(I), THETA_M, TABLE.psi, {}, "appears twice.*remove"),
    "unsorted angles": (I, unsorted(THETA_M), TABLE.psi, {}, "not sorted.*sort the map"),
    "unsorted currents": (unsorted(I), THETA_M, TABLE.psi, {}, "not sorted.*sort the map"),
    "negative current": (I - 10, THETA_M, TABLE.psi, {"layout": "currents_down"}, "need >= 0"),
    "one current": (I[[0, 9]], THETA_M, TABLE.psi[[0, 9]], {}, "2 currents.*more currents"),
    "three angles": (I, THETA_M[::5][:4:3], TABLE.psi[:, ::5][:, :4:3], {}, "angles"),
    "offset flux": (I, THETA_M, TABLE.psi + 0.1, {"layout": "currents_down"}, "0 A"),
    "unknown choice": (I, THETA_M, TABLE.psi, {"zero": "alinged"}, "need one of unaligned"),
}


@pytest.mark.parametrize("fault", BAD_GRIDS)
def test_a_faulty_grid_gives_one_line_with_the_remedy(fault, tmp_path):
    rows, columns, psi, said, words = BAD_GRIDS[fault]
    path = grid_csv(tmp_path / "m.csv", rows, columns, psi)
    refused(path, words, **({"N_r": 4} | said))


def test_swapped_names_are_seen(tmp_path):
    i, theta = both(I, THETA_M)
    path = long_csv(tmp_path / "m.csv", "theta_deg,i_A,psi_Wb", [i, theta, TABLE.psi.ravel()])
    refused(path, "axes look swapped", N_r=4)


def test_currents_that_would_be_a_period_of_a_wrong_number_of_poles_stay_currents(tmp_path):
    """30 A are a quarter of a turn with six poles, 30 deg; the flux linkage vanishes at 0 A."""
    i, theta = both(np.linspace(0, 30, len(I)), THETA_M / 2)
    path = long_csv(tmp_path / "m.csv", "i_A,theta_m_deg,psi_Wb", [i, theta, TABLE.psi.ravel()])
    refused(path, r"22.5 deg cover 135 deg el. with N_r = 6, .*correct N_r \(8 or 16\)", N_r=6)


BAD_FILES = {
    "empty.csv": (b"", "empty.*export"),
    "comments.csv": (b"# nothing\n", "no data"),
    "ragged.csv": (b",0,45\n0,0,0\n10,0.1\n", "row 3 of the table has 2 cells, need 3"),
    "words.csv": (
        b",0,20,45\n0,0,0,0\n10,x,0.2,0.3\n",
        "data row 2, column 2: `x` is not a number",
    ),
    "hole.csv": (b"i_A,theta_deg,psi_Wb\n0,0,0\n0,45,0\n9,0,1\n", "9 A, angle 45 is missing"),
    "twice.csv": (b"i_A,theta_deg,psi_Wb\n0,0,0\n0,0,0\n", "appears 2 times"),
    "unit.csv": (b"i_A,theta_deg,psi_lb\n0,0,0\n0,0,0\n", "unknown part `lb`"),
    "short.csv": (b"1,2\n3,4\n", "2 x 2, need a grid"),
    "narrow.csv": (b"0,45\n0,0\n10,0.1\n20,0.2\n", "4 x 2, need a grid"),
    "low.csv": (b",0,45,90\n0,0,0,0\n", "2 x 4, need a grid"),
    "binary.csv": (b"\xff\xfe\x00\x01\x80", "not text"),
    "zip.mat": (b"PK\x03\x04rest", "zip archive.*unpack"),
    "new.mat": (b"\x89HDF\r\n\x1a\n....", "v7.3.*-v7"),
    "broken.mat": (b"MATLAB 5.0 MAT-file" + b"\x00" * 40, "not a .mat"),
    "list.json": (b"[1, 2]", "JSON object"),
    "broken.json": (b'{"i_A": [1,', "as JSON .JSONDecodeError: Expecting value: line 1 column 12"),
    "ragged.json": (b'{"i_A": [0, 1], "theta_deg": [0, 45], "psi_Wb": [[0], [1, 2]]}', "ragged"),
    "shape.json": (b'{"i_A": [0, 1], "theta_deg": [0, 45], "psi_Wb": [[0, 1]]}', "mend the axes"),
    "map.xlsx": (b"x", "as an .xlsx file .BadZipFile"),
}


@pytest.mark.parametrize("name", BAD_FILES)
def test_a_faulty_file_gives_one_line_with_the_remedy(name, tmp_path):
    content, words = BAD_FILES[name]
    (tmp_path / name).write_bytes(content)
    refused(tmp_path / name, words, N_r=4)


def test_a_mat_without_the_variables_lists_what_it_has(tmp_path):
    scipy.io.savemat(tmp_path / "m.mat", {"speed": I, "volts": THETA_M})
    refused(tmp_path / "m.mat", "no psi and no i and no theta; it has `speed`, `volts`", N_r=4)


@pytest.mark.parametrize("poles", [1, 4, 4.0, 1000])
def test_rotor_poles_of_a_file_are_whole_numbers_up_to_a_thousand(poles, tmp_path):
    object_ = dict(N_r=poles, i_A=list(I), theta_e_deg=list(THETA_M * 4), psi_Wb=TABLE.psi.tolist())
    (tmp_path / "m.json").write_text(json.dumps(object_))
    assert read_map(tmp_path / "m.json").N_r == poles
    scipy.io.savemat(tmp_path / "m.mat", object_)
    assert read_map(tmp_path / "m.mat").N_r == poles
    for wrong in (0, 1001, 4.5, -4, "4"):
        (tmp_path / "m.json").write_text(json.dumps(object_ | {"N_r": wrong}))
        refused(tmp_path / "m.json", f"N_r = {wrong!r}, need a whole number of rotor poles, 1 to 1")


@pytest.mark.parametrize("name", ["i_A", "theta_e_deg", "psi_Wb"])
@pytest.mark.parametrize("value", ["NaN", "Infinity", "1e200"])
def test_a_number_that_is_none_is_told_with_the_array_that_has_it(name, value, tmp_path):
    object_ = dict(N_r=4, i_A=list(I), theta_e_deg=list(THETA_M * 4), psi_Wb=TABLE.psi.tolist())
    (object_[name][3] if name == "psi_Wb" else object_[name])[2] = float(value)
    (tmp_path / "m.json").write_text(json.dumps(object_))
    refused(tmp_path / "m.json", f"`{name}` has a value that is not a finite number below")


def test_a_hundred_megabytes_are_not_read(tmp_path):
    with (tmp_path / "m.csv").open("wb") as file:
        file.truncate(100_000_000)
    refused(tmp_path / "m.csv", "100 MB, need at most 20 MB", N_r=4)


def test_a_missing_file_is_named(tmp_path):
    refused(tmp_path / "absent.csv", "absent.csv: no such file", N_r=4)


def refused(path, words, **said):
    with pytest.raises(ParameterError, match=words) as fault:
        read_map(path, **said)
    assert "\n" not in str(fault.value)
    assert str(fault.value).removeprefix("cannot read ").startswith(str(path))


@pytest.mark.parametrize("name", ["ta_Nm", "tau_mN", "torqe"])
def test_a_mistyped_name_of_the_torque_does_not_leave_it_out(tmp_path, name):
    path = tmp_path / "m.csv"
    lines = [
        f"{i},{a},{i * (2 - np.cos(np.radians(a)))},{i * i}"
        for i in (0, 1, 2)
        for a in (0, 90, 180)
    ]
    path.write_text("\n".join([f"i_A,theta_e_deg,psi_Wb,{name}", *lines]))
    with pytest.raises(ParameterError, match=f"column '{name}' is not known; .* write `tau_Nm`"):
        read_map(path, N_r=4)


AXIS = np.linspace(0, 10, 6)
ANGLES = np.linspace(0, np.pi, 7)
FLUX = np.outer(AXIS, 0.1 - 0.06 * np.cos(ANGLES))


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"N_r": 0}, "N_r = 0, need the number of rotor poles"),
        ({"i": AXIS[:1], "psi": FLUX[:1]}, "1 currents with zero, need at least"),
        ({"theta_e": ANGLES[:2], "psi": FLUX[:, :2]}, "2 angles, need at least"),
        ({"psi": FLUX.T}, "flux table is 7 x 6, need 6 currents x 7 angles"),
        ({"tau": FLUX[1:]}, "torque table is 5 x 7, need 6 currents x 7 angles"),
        ({"psi": np.where(FLUX == FLUX[2, 3], np.nan, FLUX)}, "flux at 4 A, 90 deg el. is nan"),
        ({"i": 1e-6 + AXIS}, "currents need to rise from 0"),
        ({"i": np.sort(AXIS)[[0, 1, 2, 2, 4, 5]]}, "currents need to rise from 0"),
        ({"theta_e": ANGLES[::-1]}, "angles need to rise from 0"),
        ({"i": 1e9 * AXIS}, "current reaches 1e.10, need at most"),
        ({"psi": 1e9 * FLUX}, "flux reaches 1.6e.09, need at most"),
    ],
)
def test_a_table_that_is_no_map_says_what_is_wrong(change, told):
    whole = {"N_r": 4, "i": AXIS, "theta_e": ANGLES, "psi": FLUX}
    table = FluxTable(**whole)
    assert table.half and table.theta_m == pytest.approx(ANGLES / 4)
    doubled = table.times(2.0)
    assert np.array_equal(doubled.psi, 2 * FLUX) and doubled.tau is None
    with pytest.raises(ParameterError, match=told):
        FluxTable(**whole | change)


def blank(psi, k, n):
    psi = psi.copy()
    psi[k, n] = np.nan
    return psi


@pytest.mark.parametrize(
    ("make", "said", "told"),
    [
        (lambda i, a, psi: (i, a, psi), {"N_r": 0}, "N_r = 0, need the number of rotor poles"),
        (lambda i, a, psi: (i, a, psi), {"zero": "left"}, "zero = 'left', need one of"),
        (lambda i, a, psi: (i, a, psi), {"angle_unit": "gon"}, "angle_unit = 'gon', need one of"),
        (lambda i, a, psi: (i, a, psi), {"layout": "angles_down"}, "axes look swapped"),
        (lambda i, a, psi: (i, a, psi), {"zero": "aligned"}, "pass zero=unaligned"),
        (lambda i, a, psi: (-i, a, psi), {}, "need"),
        (lambda i, a, psi: (i, a + 10, psi), {}, "need 0 or 180"),
        (lambda i, a, psi: (i, a[:9], psi[:, :9]), {}, "need 180 or 360; extend the map"),
        (lambda i, a, psi: (i, 1.5 * a, psi), {}, "need 180 or 360; cut it there"),
        (lambda i, a, psi: (i[[0, 2, 1, *range(3, 16)]], a, psi), {}, "is not sorted"),
        (lambda i, a, psi: (i[[0, 1, 1, *range(3, 16)]], a, psi), {}, "appears twice"),
        (lambda i, a, psi: (i, a, psi + 0.05), {"layout": "currents_down"}, "need"),
    ],
)
def test_a_grid_that_fits_no_convention_says_what_is_needed(make, said, told, tmp_path):
    path = grid_csv(tmp_path / "m.csv", *make(I, THETA_M, TABLE.psi))
    given = {"N_r": 4} | said
    with pytest.raises(ParameterError, match=told) as fault:
        read_map(path, **given)
    assert "\n" not in str(fault.value)


@pytest.mark.parametrize("remedy", ["current", "angle"])
def test_the_remedy_for_an_empty_cell_of_a_list_is_enough(remedy, tmp_path):
    rows = [[i, a, psi] for i, line in zip(I, TABLE.psi, strict=True)
            for a, psi in zip(THETA_M, line, strict=True)]  # fmt: skip
    bad = rows[40]
    cells = [[f"{x:g}" for x in row] for row in rows]
    cells[40][2] = ""
    path = tmp_path / "m.csv"

    def put(lines):
        path.write_text("i_A,theta_deg,psi_Wb\n" + "\n".join(map(",".join, lines)))

    put(cells)
    with pytest.raises(ParameterError, match="data row 41, column 3: `` is not a number") as fault:
        read_map(path, N_r=4)
    assert "remove every row of its current or of its angle" in str(fault.value)
    place = ["current", "angle"].index(remedy)
    put(c for c, row in zip(cells, rows, strict=True) if row[place] != bad[place])
    assert read_map(path, N_r=4).psi.size == TABLE.psi.size - TABLE.psi.shape[1 - place]


WHOLE_M = np.concatenate([THETA_M, 90 - THETA_M[-2::-1]])
WHOLE_PSI = np.hstack([TABLE.psi, TABLE.psi[:, -2::-1]])


@pytest.mark.parametrize("zero", [None, "unaligned"])
@pytest.mark.parametrize(
    ("theta", "psi", "N_r", "told"),
    [
        (THETA_M, TABLE.psi, 8, r"a whole period with N_r = 8.* one way only.*correct N_r \(4\)"),
        (WHOLE_M, WHOLE_PSI, 2, r"half a period with N_r = 2.*up and down.*correct N_r \(4\)"),
        (THETA_M, TABLE.psi, 3, r"extend the map, or correct N_r \(4 or 8\)"),
        (THETA_M, TABLE.psi, 10, r"cut it there, or correct N_r \(4 or 8\)"),
        (WHOLE_M, WHOLE_PSI, 3, r"cut it there, or correct N_r \(2 or 4\)"),
    ],
)
def test_a_wrong_number_of_poles_is_told_as_such_and_its_remedy_works(
    theta, psi, N_r, told, zero, tmp_path
):
    path = grid_csv(tmp_path / "m.csv", I, theta, psi)
    with pytest.raises(ParameterError, match=told) as fault:
        read_map(path, N_r=N_r, zero=zero)
    assert "aligned_at" not in str(fault.value)
    assert read_map(path, N_r=4, zero=zero).psi.shape[0] == len(I)


def sweep(first="Angle [deg]", what="Flux [Wb]", last="3A"):
    """As Maxwell exports it: a column for each current."""
    head = ",".join(f"\"{what} - I='{i}'\"" for i in ("1A", "2A", last))
    rows = [",".join(str(n + k) for n in range(head.count(",") + 2)) for k in range(2)]
    return "\n".join([f"{first},{head}", *rows])


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("", "the file is empty"),
        ("% only a comment\n", "the file has no data"),
        ("i_A,theta_deg,psi_Wb,flux_Wb\n1,2,3,4\n", "`psi_Wb` and `flux_Wb` for psi"),
        (sweep("Speed [rpm]"), "the first column is `Speed .rpm.`, need a current or an angle"),
        (sweep(what="Power [W]"), "need a flux linkage or a torque"),
        (sweep(last="3Hz"), "value `3Hz` of the sweep, need a number with a unit"),
        (sweep(last="3A'\",\"Torque [Nm] - I='3A"), "need flux linkage for every value"),
    ],
)  # fmt: skip
def test_a_text_that_is_no_map_says_what_is_needed(text, told, tmp_path):
    (tmp_path / "m.csv").write_text(text)
    refused(tmp_path / "m.csv", told, N_r=4)


def test_a_name_that_is_stated_must_be_there_and_a_format_known(tmp_path):
    (tmp_path / "m.csv").write_text("i_A,theta_deg,psi_Wb\n1,2,3\n")
    refused(tmp_path / "m.csv", "no `lam` for psi; it has `i_A`", N_r=4, names={"psi": "lam"})
    (tmp_path / "m.doc").write_text("x")
    refused(tmp_path / "m.doc", "format `.doc` is unknown, need .csv", N_r=4)


RAW = {"rows": AXIS, "columns": ANGLES, "psi": FLUX, "angle_unit": "rad"}
RAW |= {"angle_kind": "electrical", "layout": "currents_down"}


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"rows": np.append(np.nan, AXIS[1:])}, "the current axis has a cell that is no number"),
        ({"columns": np.append(np.nan, ANGLES[1:])}, "the angle axis has a cell that is no number"),
        ({"psi": blank(FLUX, 2, 3)}, r"flux at 4 A, angle 1.5708 is nan, need a number"),
        (
            {"rows": AXIS[:1], "psi": FLUX[:1]},
            "has 1 rows and 7 columns of flux, need at least two",
        ),
        ({"columns": ANGLES[:1], "psi": FLUX[:, :1]}, "has 6 rows and 1 columns of flux"),
        ({"rows": AXIS - 1}, "current = -1 A, need >= 0"),
        ({"zero": "left"}, "zero = 'left', need one of"),
        ({"psi": FLUX + 0.021 * FLUX.max()}, r"flux at 0 A is .* Wb, need 0"),
    ],
)
def test_a_map_whose_axes_are_known_still_needs_its_numbers(change, told):
    good = settled(RawMap(**RAW), N_r=4)
    assert np.array_equal(good.psi, FLUX) and good.theta_e == pytest.approx(ANGLES)
    with pytest.raises(ParameterError, match=told):
        settled(RawMap(**RAW | change), N_r=4)


@pytest.mark.parametrize("sign", [-1, 1])
def test_an_offset_of_all_fluxes_is_taken_off_and_said(sign):
    offset = sign * 0.019 * FLUX.max() / 1.02
    table = settled(RawMap(**RAW | {"psi": FLUX + offset}), N_r=4)
    assert not table.psi[0].any() and table.psi == pytest.approx(FLUX, abs=1e-12)
    assert f"an offset of {offset:.2g} Wb, seen at 0 A, taken off all fluxes" in table.notes


def test_a_little_flux_at_no_current_alone_is_set_to_nothing_and_said():
    shifted = FLUX.copy()
    shifted[0] += 0.019 * FLUX.max()
    table = settled(RawMap(**RAW | {"psi": shifted}), N_r=4)
    assert not table.psi[0].any() and np.array_equal(table.psi[1:], FLUX[1:])
    assert any(note.endswith("at 0 A set to 0") for note in table.notes)


def test_a_table_of_currents_is_turned_to_flux_linkage_up_to_what_every_angle_reaches():
    """i = psi/L(theta): the same L, up to the current of the greatest inductance."""
    levels, L = np.linspace(0, 0.5, 11), 0.1 - 0.06 * np.cos(ANGLES)
    currents = levels[:, None] * (1 + levels[:, None]) / L
    raw = RawMap(**RAW | {"rows": levels, "psi": currents, "inverse": True})
    table = settled(raw, N_r=4)
    assert table.i[-1] == pytest.approx(currents[-1].min()) and table.i[0] == 0
    psi = (np.sqrt(1 + 4 * table.i[:, None] * L) - 1) / 2
    assert table.psi == pytest.approx(psi, abs=1e-3 * psi.max())
    assert any("an inverse table, current over flux linkage: turned" in n for n in table.notes)
    falls = currents.copy()
    falls[5] = falls[7]
    with pytest.raises(ParameterError, match="whose current does not rise from 0"):
        settled(RawMap(**RAW | {"rows": levels, "psi": falls, "inverse": True}), N_r=4)


@pytest.mark.parametrize("at", [180.0, 30.0, -40.0])
def test_a_map_is_counted_from_where_the_user_has_seen_alignment(at):
    """A whole period, shifted: where it is aligned the flux linkage is the greatest."""
    whole = np.linspace(0, 2 * np.pi, 25)
    shift = np.radians(at) - np.pi
    psi = np.outer(AXIS, 0.1 - 0.06 * np.cos(whole - shift))
    raw = RawMap(**RAW | {"columns": np.degrees(whole), "psi": psi, "angle_unit": "deg"})
    table = settled(raw, N_r=4, aligned_at=at)
    peak = table.theta_e[int(np.argmax(table.psi[-1]))]
    assert np.cos(peak) == pytest.approx(-1, abs=0.01)
    assert any(f"aligned at {at:g} deg of the file" in note for note in table.notes)
    with pytest.raises(ParameterError, match="zero"):
        settled(raw, N_r=4, aligned_at=at, zero="aligned")
