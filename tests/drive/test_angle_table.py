"""Turn-on and turn-off angles over speed and torque: the table, the law that follows it, files."""

import csv
from pathlib import Path

import numpy as np
import pytest
from command import command, refused
from scipy.interpolate import RegularGridInterpolator

import reluctance as rl
from reluctance import _core
from reluctance.drive.laws.angle_table import read_angle_table
from reluctance.explore.sweeps.fingerprint import fingerprint
from reluctance.explore.tuning import tune_angles
from reluctance.targets.export.package import described

EXAMPLES = Path(__file__).parents[2] / "examples"
EXAMPLE = EXAMPLES / "angle_table.toml"
RATED = EXAMPLES / "paper_rated.toml"
ANGLES = ["control.law=angles", "control.i_band_A=1", "control.tau_max_Nm=45"]
HEAD = "speed_rpm,torque_Nm,theta_on_deg,theta_off_deg"
ORDER = list(_core.ORDER_COLUMNS)
WINDOW = [ORDER.index("theta_on"), ORDER.index("theta_off")]
FIXED = {"control.theta_on_deg": -10, "control.theta_off_deg": 150}


def write(path: Path, angles, *, head: str = HEAD) -> Path:
    """A file of 500, 1500 and 3000 rpm by 5, 20 and 45 N m."""
    nodes = [(speed, torque) for speed in (500, 1500, 3000) for torque in (5, 20, 45)]
    rows = [",".join(f"{v:.12g}" for v in (*node, *angles(*node))) for node in nodes]
    path.write_text("\n".join([head, *rows]) + "\n")
    return path


def sloped(speed: float, torque: float) -> tuple[float, float]:
    return 20 - speed / 60 - torque / 4, 150 - torque / 10 + speed / 300


def step(drive: rl.Drive, *, rpm: float, tau: float, theta_e: float = 0.3) -> np.ndarray:
    """The orders of one sample, a row for each phase."""
    y = _core.Measurement(i=[0.0] * 3, theta_e=theta_e, omega_m=rpm * np.pi / 30, u_dc=240.0)
    orders = _core.step(drive.controller(), y, tau)
    return np.reshape(orders[:-1], (3, -1))


@pytest.fixture
def tabled(tmp_path: Path) -> rl.Drive:
    file = write(tmp_path / "a.csv", sloped)
    return rl.load(RATED, [*ANGLES, f"control.angle_table={file}"])


def test_between_the_nodes_it_is_bilinear_and_outside_it_is_the_edge() -> None:
    random = np.random.default_rng(1)
    omega, tau = np.array([50.0, 90.0, 300.0]), np.array([0.0, 1.0, 7.0, 9.0])
    values = random.normal(size=(3, 3, 4))
    table = _core.PulseTable(
        omega=omega.tolist(),
        tau=tau.tolist(),
        **{
            name: v.ravel().tolist()
            for name, v in zip(("theta_on", "theta_off", "i_ref"), values, strict=True)
        },
    )
    scipy = [RegularGridInterpolator((omega, tau), v) for v in values]
    points = np.column_stack([random.uniform(0, 400, 500), random.uniform(-1, 12, 500)])
    for point in [*points, *np.array([[90.0, 7.0], [300.0, 9.0]])]:
        clipped = np.clip(point, [omega[0], tau[0]], [omega[-1], tau[-1]])
        wanted = [float(one(clipped)[0]) for one in scipy]
        assert np.allclose(table.at(*point), wanted, rtol=0, atol=1e-12)
    assert table.at(np.nan, np.nan) == table.at(0, 0)


@pytest.mark.parametrize("wrong", [{"tau": [0.0, 0.0]}, {"omega": [1.0]}, {"i_ref": [1.0]}])
def test_a_table_that_does_not_fit_is_refused(wrong: dict[str, list[float]]) -> None:
    good = {"omega": [1.0, 2.0], "tau": [0.0, 1.0]}
    good |= {name: [0.0] * 4 for name in ("theta_on", "theta_off", "i_ref")}
    _core.PulseTable(**good)
    with pytest.raises(ValueError, match="rising axes"):
        _core.PulseTable(**good | wrong)


@pytest.mark.long
def test_the_windows_of_the_law_are_those_of_the_table(tabled: rl.Drive) -> None:
    on, off = WINDOW
    for rpm, tau in ((500, 5), (1500, 20), (2000, 13), (2999, 45), (4000, 45), (1000, 2)):
        at = np.clip([rpm, tau], [500, 5], [3000, 45])
        file = read_angle_table(tabled.control.angle_table)  # type: ignore[attr-defined]
        wanted = file.at(at[0] * np.pi / 30, at[1])
        found = step(tabled, rpm=rpm, tau=tau)
        assert np.allclose(found[:, on], np.mod(wanted[0], 2 * np.pi), atol=1e-9)
        assert np.allclose(found[:, off], np.mod(wanted[1], 2 * np.pi), atol=1e-9)
        mirrored = step(tabled, rpm=-rpm, tau=-tau)
        assert np.allclose(mirrored[:, on], np.mod(-wanted[1], 2 * np.pi), atol=1e-9)
        assert np.allclose(mirrored[:, off], np.mod(-wanted[0], 2 * np.pi), atol=1e-9)


@pytest.mark.long
def test_a_table_of_the_same_angles_everywhere_is_the_law_with_these(tmp_path: Path) -> None:
    """At the working speed; the currents differ by what interpolation leaves."""
    file = write(tmp_path / "a.csv", lambda *_: tuple(FIXED.values()))
    base = rl.load(RATED, ANGLES)
    fixed = base.with_values(FIXED)
    table = base.with_values({"control.angle_table": str(file)})
    for tau in (3.0, 8.0, 20.0, 45.0):
        a, b = (step(drive, rpm=1500, tau=tau) for drive in (fixed, table))
        assert np.allclose(a[:, WINDOW], b[:, WINDOW], atol=1e-12)
        assert np.allclose(a, b, rtol=0.01)


@pytest.mark.long
def test_braking_standstill_and_the_start_window_stay_as_by_the_rule(tabled: rl.Drive) -> None:
    rule = tabled.with_values({"control.angle_table": None})
    for rpm, tau in ((1500, -20.0), (-1500, 20.0), (3000, -5.0)):
        assert np.array_equal(step(tabled, rpm=rpm, tau=tau), step(rule, rpm=rpm, tau=tau))
    for rpm in (0, 100, -100):
        a, b = (step(drive, rpm=rpm, tau=20.0) for drive in (tabled, rule))
        assert np.array_equal(a[:, WINDOW], b[:, WINDOW])
        assert np.all(a[:, ORDER.index("i_ref")] > 10)


def test_without_a_table_nothing_of_it_is_in_the_law() -> None:
    empty = described(rl.load(RATED, ANGLES))["control"]["fields"]["law"]["fields"]["table"]
    assert all(view["values"] == [] for view in empty["fields"].values())


@pytest.mark.parametrize("tau", [5.0, 12.0, 30.0, 45.0])
@pytest.mark.parametrize("rpm", [500, 1000, 1500, 2200, 3000])
def test_the_mean_torque_is_the_reference_at_and_between_the_speeds_of_the_table(
    tabled: rl.Drive, rpm: float, tau: float
) -> None:
    """Set up for 3000 rpm, run at another speed, which the set-up does not know of."""
    until = max(0.03, 8 * 15 / rpm)
    course = {"load.t_s": [0, 1, 1.1], "load.values": [rpm, rpm, 3000.0], "load.speed_rpm": None}
    drive = tabled.with_values(course | {"reference.tau_Nm": tau})
    assert drive.omega_nominal == pytest.approx(100 * np.pi)
    mean = rl.simulate(drive, until=until, record=None).kpis.tau_mean
    assert mean == pytest.approx(tau, rel=0.02)


REFUSED = {
    "no column `theta_off_deg`": lambda t: t.replace("theta_off_deg", "off_deg"),
    "unknown column `colour`; known: `note`": lambda t: t.replace("_deg\n", "_deg,colour\n"),
    "is there twice": lambda t: t + "500,5,0,120\n",
    "no row for 3000 rpm and 45 N m, need a full grid": lambda t: t[: t.rindex("3000,")],
    "speed_rpm = -500, need > 0": lambda t: t.replace("\n500,", "\n-500,"),
    "torque_Nm = -5, need > 0": lambda t: t.replace("500,5,", "500,-5,"),
    "theta_on_deg = -180.5, need from -180": lambda t: t.replace("500,5,-10,", "500,5,-180.5,"),
    "theta_on_deg = 180, need from -180": lambda t: t.replace("500,5,-10,150", "500,5,180,200"),
    "theta_off_deg = 181, need above": lambda t: t.replace("500,5,-10,150", "500,5,-180,181"),
    "theta_off_deg = 361, need above": lambda t: t.replace("500,5,-10,150", "500,5,10,361"),
    "theta_off_deg = -10, need above": lambda t: t.replace("500,5,-10,150", "500,5,-10,-10"),
    "theta_off_deg = -20, need above": lambda t: t.replace("500,5,-10,150", "500,5,-10,-20"),
    "data row 1, theta_on_deg: `early` is not a number": lambda t: t.replace(
        "500,5,-10,150", "500,5,early,150"
    ),
    "data row 1, theta_on_deg: `` is not a number": lambda t: t.replace("500,5,-10,150", "500,5"),
    "1 speeds and 3 torques, need at least two": lambda t: "\n".join(t.split("\n")[:4]),
    "has no rows": lambda t: HEAD,
    "torque_Nm begins at 500, and the greatest torque of the machine is": lambda t: t.replace(
        "speed_rpm,torque_Nm", "torque_Nm,speed_rpm"
    ),
}


@pytest.mark.parametrize("message", REFUSED)
def test_a_file_that_cannot_be_meant_is_one_line(message: str, tmp_path: Path) -> None:
    file = write(tmp_path / "a.csv", lambda *_: tuple(FIXED.values()))
    read_angle_table(file)
    file.write_text(REFUSED[message](file.read_text()))
    with pytest.raises(rl.ParameterError) as told:
        rl.load(RATED, [*ANGLES, f"control.angle_table={file}"])
    assert message in str(told.value) and "\n" not in str(told.value)


@pytest.mark.parametrize("angles", [(-180, 180), (179.9, 360), (0, 360), (-180, -179.9)])
def test_angles_at_the_ends_of_what_can_be_meant_are_taken(angles, tmp_path: Path) -> None:
    file = write(tmp_path / "a.csv", lambda *_: angles)
    table = read_angle_table(file)
    assert np.degrees([table.theta_on, table.theta_off]).reshape(2, -1).T == pytest.approx(
        np.array([angles] * 9)
    )


@pytest.mark.parametrize(
    "overrides, message",
    [
        (["control.theta_on_deg=0", "control.theta_off_deg=120"], "angle_table has the angles"),
        (["control.i_ref_A=20"], "angle_table needs a torque to follow"),
        (["control.angle_table=nowhere.csv"], "cannot read nowhere.csv"),
        (["control.law=pwm_current", "control.angle_table=a.csv"], "unknown key `angle_table`"),
    ],
)
def test_a_table_beside_what_it_replaces_is_refused(overrides: list[str], message: str) -> None:
    with pytest.raises(rl.ParameterError, match=message):
        rl.load(EXAMPLE, overrides)


def test_a_path_is_relative_to_the_drive_file_and_the_content_is_part_of_the_drive(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    command("examples", "angle_table", "--copy", tmp_path)
    monkeypatch.chdir(EXAMPLES.parent)
    drive = rl.load(tmp_path / "angle_table.toml")
    before = fingerprint(drive, 0.1)
    write(tmp_path / "angle_table.csv", sloped)
    assert fingerprint(drive, 0.1) != before
    drive.save(tmp_path / "again.toml")
    again = rl.load(tmp_path / "again.toml")
    assert np.array_equal(step(again, rpm=2000, tau=20), step(drive, rpm=2000, tau=20))


def test_the_drive_that_its_table_was_made_for_runs(tmp_path: Path) -> None:
    k = rl.simulate(rl.load(EXAMPLE), record=None).kpis
    assert k.speed_mean == pytest.approx(100 * np.pi, rel=0.01)


@pytest.mark.long
def test_the_command_writes_what_the_law_reads(tmp_path: Path) -> None:
    """80 N m at 3000 rpm is out of reach: its node says so, and has angles all the same."""
    out = tmp_path / "a.csv"
    line = ("tune", RATED, "--set", "control.law=angles", "--minimise", "p_cu", "--budget", 6)
    over = ("--over", "speed_rpm=1500,3000", "--over", "torque_Nm=20,80")
    told = command(*line, *over, "--out", out, "--plot", tmp_path / "a.png").out
    assert "out of reach" in told and (tmp_path / "a.png").stat().st_size > 10_000
    rows = out.read_text().splitlines()
    assert rows[0] == f"{HEAD},p_cu_W,tau_mean_Nm,note" and len(rows) == 5
    assert "out of reach: these angles give at most" in rows[4]
    assert all(row.endswith(",") for row in rows[1:3])
    drive = rl.load(RATED, [*ANGLES, f"control.angle_table={out}"])
    assert rl.simulate(drive, until=0.03, record=None).kpis.tau_mean > 40
    assert "22 trials, 0 runs made now" in command(*line, *over).out  # nothing is run twice


@pytest.mark.long
def test_a_node_that_holds_the_torque_says_what_it_misses_besides() -> None:
    """Less current would miss the impossible bound by less, and the torque."""
    drive = rl.load(RATED, [*ANGLES])
    over = {"speed_rpm": [1500, 2000], "torque_Nm": [10, 20]}
    for node in tune_angles(drive, over, "p_cu", keep=["i_rms_A<1"], budget=12).nodes:
        assert node.figures["tau_mean_Nm"] >= 0.98 * node.torque_Nm
        assert node.note == "misses i_rms_A < 1"


def test_what_cannot_be_meant_over_speed_and_torque_is_one_line(tmp_path: Path) -> None:
    line = ("tune", RATED, "--set", "control.law=angles", "--minimise", "p_cu")
    speed, torque = ("--over", "speed_rpm=500:1000:2"), ("--over", "torque_Nm=5,10")
    assert "need speed_rpm and torque_Nm" in refused(*line, *speed)
    assert "need numbers > 0" in refused(*line, *speed, "--over", "torque_Nm=-5,10")
    assert "at least two rising" in refused(*line, *speed, "--over", "torque_Nm=10,5")
    assert "no effect with --over" in refused(*line, *speed, *torque, "--until", "0.1")
    assert "need one of .csv" in refused(*line, *speed, *torque, "--out", tmp_path / "a.toml")
    assert "need ranges of" in refused(*line, *speed, *torque, "--vary", "control.i_band_A=1:2")
    other = ("tune", EXAMPLES / "ditc.toml", "--minimise", "p_cu", *speed, *torque)
    assert "law = 'angles'" in refused(*other)
    fixed = ("tune", EXAMPLES / "hysteresis_200A.toml", "--minimise", "p_cu", *speed, *torque)
    assert "remove [control] i_ref_A" in refused(*fixed)
    assert "or --over" in refused("tune", RATED, "--minimise", "p_cu")


@pytest.mark.long
def test_the_first_node_of_the_example_is_what_the_command_finds() -> None:
    """No neighbour is done before it, so that it comes out the same alone."""
    drive = rl.load(EXAMPLE, ["control.angle_table="])
    grid = {"speed_rpm": [500, 501], "torque_Nm": [5, 5.01]}
    node = tune_angles(drive, grid, "p_cu", keep=["torque_ripple_rms<0.15"]).nodes[0]
    with (EXAMPLES / "angle_table.csv").open() as file:
        row = next(csv.DictReader(file))
    found = {name: str(value) for name, value in node.row.items()}
    assert (found["speed_rpm"], found["torque_Nm"]) == (row["speed_rpm"], row["torque_Nm"])
    for name in ("theta_on_deg", "theta_off_deg"):
        assert float(found[name]) == pytest.approx(float(row[name]), abs=0.5)
    assert float(found["p_cu_W"]) == pytest.approx(float(row["p_cu_W"]), rel=2e-3)
