"""Voltage pulses become a flux table: as an oscilloscope gives them, as the firmware does."""

import json
from importlib import import_module
from types import SimpleNamespace

import numpy as np
import pytest
from command import command
from on_the_bench import bench_drive
from test_map_cli import MACHINE, reluctance

import reluctance as rl
from reluctance import ParameterError, _core
from reluctance.machine.maps import identify, read_pulses, surface
from reluctance.machine.maps.conventions import settled
from reluctance.machine.maps.identify import _closed, _positions
from reluctance.machine.maps.raw import RawMap
from reluctance.targets.commission import Wires, commission, write_pulses

identifying = import_module("reluctance.machine.maps.identify")  # the package has the function
R = 2.15
U = 60.0  # of the bench supply [V]
I_TOP = 5.0


def captured(theta_e, *, dt=5e-6, offset=0.0, noise=0.0, seed=0):
    """Time, voltage and current of one pulse, as an oscilloscope shows them: rest, rise, fall."""
    random = np.random.default_rng(seed)
    rows, psi, up = [], 0.0, True
    at = np.array([theta_e])
    for n in range(100_000):
        i = float(_core.FluxMap.current(TABLE, np.array([psi]), at, 20.0)[0]) if psi > 0 else 0.0
        u = 0.0 if n < 40 else (U if up else -U)
        rows.append((n * dt, u + offset, i + offset + noise * random.normal()))
        if n >= 40:
            psi += dt * ((U if up else -U) - R * i)
            up = up and i < I_TOP
            if not up and psi <= 0:
                break
    return np.array(rows)


def _table():
    i = np.linspace(0, 12, 61)
    theta_e = np.linspace(0, np.pi, 31)
    grid = np.meshgrid(i, theta_e, indexing="ij")
    psi = _core.magnetics(MACHINE, grid[0].ravel(), grid[1].ravel())[:, 0].reshape(grid[0].shape)
    return surface(rl.maps.FluxTable(N_r=6, i=i, theta_e=theta_e, psi=psi))


TABLE = _table()
ANGLES = np.linspace(0, 180, 16)


def torque_error(table):
    i, theta_e = np.meshgrid(np.linspace(0.1, I_TOP, 25), np.linspace(0, np.pi, 61))
    ours, true = (
        _core.magnetics(m, i.ravel(), theta_e.ravel())[:, 2] for m in (surface(table), TABLE)
    )
    return float(np.sqrt(np.mean((ours - true) ** 2) / np.mean(true**2)))


def write(path, rows, head="t_s,u_V,i_A"):
    lines = [head, *(",".join(f"{x:.9g}" for x in row) for row in rows)]
    path.write_text("\n".join(lines) + "\n")
    return path


@pytest.fixture(scope="module")
def captures():
    return [
        captured(np.radians(angle), offset=0.05, noise=0.02, seed=n)
        for n, angle in enumerate(ANGLES)
    ]


def test_captures_of_an_oscilloscope_with_offsets_and_noise(captures, tmp_path):
    """One file an angle, without a column for it; unaligned to aligned."""
    files = [write(tmp_path / f"{n}.csv", rows) for n, rows in enumerate(captures)]
    recording = read_pulses(files, angles=list(ANGLES))
    found = identify(recording, N_r=6, R=R, angle_unit="deg", angle_kind="electrical")
    assert torque_error(found.table) < 0.02
    assert found.R_closing == pytest.approx(R, rel=0.05)
    assert found.i_noise == pytest.approx(0.02, rel=0.2)


def test_units_and_names_of_columns_do_not_matter(captures, tmp_path):
    rows = [
        (1e3 * t, u, 1e3 * i, angle / 6)
        for angle, pulse in zip(ANGLES, captures, strict=True)
        for t, u, i in pulse
    ]
    named = write(tmp_path / "a.csv", rows, "TIME,CH1,CH2,pos")
    plain = write(tmp_path / "b.csv", rows, "t_ms,voltage (V),current_mA,theta_m_deg")
    names = {"t": "TIME", "u": "CH1", "i": "CH2", "theta": "pos"}
    psi = identify(read_pulses([plain]), N_r=6, R=R).table.psi
    with pytest.raises(ParameterError):  # milliseconds read as seconds
        identify(read_pulses([named], names=names), N_r=6, R=R)
    scaled = [(t / 1e3, u, i / 1e3, angle) for t, u, i, angle in rows]
    named = write(tmp_path / "a.csv", scaled, "TIME,CH1,CH2,pos")
    again = identify(read_pulses([named], names=names), N_r=6, R=R).table.psi
    np.testing.assert_allclose(again, psi, rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize(("off", "positions"), [(0.44, [90.11, 135]), (0.46, [90, 90.46, 135])])
def test_pulses_of_one_clamped_position_are_told_by_the_range_of_angles(off, positions):
    """Within a hundredth of it, wherever it begins: here 45 deg, with one pulse in four off."""
    at = {90.0: ["a", "b", "c"], 90.0 + off: ["d"], 135.0: ["e"]}
    angles, groups = _positions(at)
    assert angles == pytest.approx(positions)
    assert [pulse for group in groups for pulse in group] == ["a", "b", "c", "d", "e"]


def test_three_commands_from_pulses_to_a_simulated_drive(tmp_path):
    drive = bench_drive("npf_vector_6_4")
    found = [
        commission(drive, "pulses", pulses=2, theta_e_deg=float(angle))
        for angle in np.linspace(0, 180, 19)
    ]
    pulses, table, motor = (tmp_path / name for name in ("p.csv", "map.csv", "motor.toml"))
    write_pulses(pulses, found, drive)
    told = reluctance("map", "identify", pulses, "--R_ohm", 3, "--N_r", 4, "--out", table)
    assert "38 pulses at 19 angles" in told
    assert "rising and falling currents agree with" in told and "ohm; given 3\n" in told
    assert "next: reluctance map import" in told
    winding = ("--N_s", 6, "--R_ohm", 3, "--J_kgm2", 0.031, "--angle_kind", "electrical")
    reluctance("map", "import", table, "--N_r", 4, *winding, "--out", motor)
    set_ = ["--set", "load.speed_rpm=300", "--set", "reference.tau_Nm=5"]
    torque = [
        json.loads(
            reluctance(
                "run",
                "examples/sharing_cubic.toml",
                "--set",
                f"machine={name}",
                *set_,
                "--set",
                "sensing.comparators=sampled",
                "--until",
                0.1,
                "--json",
            ).splitlines()[0]
        )["tau_mean_Nm"]
        for name in (motor, "npf_vector_6_4")
    ]
    assert torque[0] == pytest.approx(torque[1], rel=0.02)


@pytest.mark.parametrize(
    ("head", "rows", "options", "said"),
    [
        ("t_s,u_V,i_A", [(0, 0, 0)] * 9, {}, "no column for theta"),
        ("t_s,u_V,i_A,theta_m_deg", [(0, 0, 0, 0)] * 9, {}, "need 8 with a time that rises"),
        ("t_s,u_V,amps,theta_m_deg", [(0, 0, 0, 0)] * 9, {}, "no column for i"),
        ("t_s,u_V,i_A", [(n, n > 4, n, 0) for n in range(9)], {"angles": [1, 2]}, "2 angles for 1"),
        ("t_s,u_V,i_A,theta_m_deg", [(n, "x", 0, 0) for n in range(9)], {}, "`x` is not a number"),
        ("t_s,u_V,i_A,theta_m_deg", [(0, "0001,5,0,0,2,30", 0)] * 9, {}, "commas stand in its num"),
        ("t_s,u_V,i_A,theta_m_deg", [(n, "nan", 0, 0) for n in range(9)], {}, "not a finite"),
    ],
)
def test_a_bad_recording_is_refused_in_one_line(head, rows, options, said, tmp_path):
    lines = [head, *(",".join(str(x) for x in row) for row in rows)]
    path = tmp_path / "p.csv"
    path.write_text("\n".join(lines) + "\n")
    with pytest.raises(ParameterError, match=said) as fault:
        read_pulses([path], **options)
    assert "\n" not in str(fault.value)


@pytest.mark.parametrize(
    ("change", "options", "said"),
    [
        (lambda rows: rows * (1, -1, 1), {}, "check the column of the current"),
        (lambda rows: rows * (1, 1, -1), {}, "check the column of the current"),
        (lambda rows: rows[60:], {}, "begins with its voltage on"),
        (lambda rows: rows, {"R": -1.0}, "need the resistance"),
        (lambda rows: rows, {"R": 9.0}, "not with R_ohm = 9"),
        (lambda rows: rows * (1, 1, 1e3), {}, "check the units of current, voltage and resist"),
        (lambda rows: rows * (1, 1e-3, 1), {}, "check the units of current, voltage and resist"),
        (lambda rows: rows, {"R": 1e3 * R}, "check the units of current, voltage and resist"),
        (lambda rows: rows, {"i_max": 50.0}, "not every angle reached"),
        (lambda rows: rows * (1e3, 1, 1), {}, "Wb, need 0.0001 to 50 .* units of time"),
    ],
)
def test_pulses_that_cannot_be_meant_are_refused(captures, change, options, said, tmp_path):
    rows = [
        (*row, angle)
        for angle, pulse in zip(ANGLES, captures, strict=True)
        for row in change(pulse)
    ]
    path = write(tmp_path / "p.csv", rows, "t_s,u_V,i_A,theta_e_deg")
    with pytest.raises(ParameterError, match=said):
        identify(read_pulses([path]), N_r=6, **{"R": R, **options})


def test_pulses_at_one_angle_are_refused(captures, tmp_path):
    path = write(tmp_path / "p.csv", [(*row, 90) for row in captures[8]], "t_s,u_V,i_A,theta_e_deg")
    with pytest.raises(ParameterError, match="angles"):
        identify(read_pulses([path]), N_r=6, R=R)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--R_ohm", 1, "--out", "m.csv"], "pass --N_r"),
        (["--R_ohm", 1, "--N_r", 6, "--out", "m.toml"], ".csv"),
        (["--R_ohm", 1, "--N_r", 6, "--out", "m.csv"], "no such file"),
        (["--R_ohm", 1, "--N_r", 6, "--out", "m.csv", "--name", "psi=a"], "need t=NAME"),
    ],
)
def test_the_command_refuses_in_one_line(arguments, said):
    assert said in reluctance("map", "identify", "missing.csv", *arguments, fails="line")


@pytest.mark.long
def test_a_whole_period_shows_the_encoders_zero_and_halves_the_error(tmp_path):
    """Clamped positions over a whole period, an encoder whose zero nobody knows."""
    drive = bench_drive("paper_6_4", "real")
    found = [
        commission(
            drive.with_values({"sensing.noise_seed": n}),
            "pulses",
            pulses=4,
            theta_e_deg=360 / 48 * n,
            wires=Wires(zero_deg=33.0),
        )
        for n in range(48)
    ]
    write_pulses(tmp_path / "p.csv", found, drive)
    recording = read_pulses([tmp_path / "p.csv"])
    with pytest.raises(ParameterError, match="--aligned_at") as fault:
        identify(recording, N_r=4, R=drive.machine.R)
    aligned = float(str(fault.value).rpartition("--aligned_at ")[2].rstrip(")"))
    count = 360 / 4096
    assert aligned == pytest.approx((180 + 33) / 4 - 90, abs=count)
    table = identify(recording, N_r=4, R=drive.machine.R, aligned_at=aligned).table
    i, theta_e = np.meshgrid(np.linspace(3, 150, 40), np.linspace(0, np.pi, 121))
    ours, true = (
        _core.magnetics(machine, i.ravel(), theta_e.ravel())[:, 2]
        for machine in (surface(table), drive.machine.magnetics)
    )
    assert np.sqrt(np.mean((ours - true) ** 2) / np.mean(true**2)) < 0.005


def test_rising_currents_alone_are_enough(captures, tmp_path):
    rows = [
        (*row, angle)
        for angle, pulse in zip(ANGLES, captures, strict=True)
        for row in pulse[: pulse[:, 2].argmax() + 1]
    ]
    path = write(tmp_path / "p.csv", rows, "t_s,u_V,i_A,theta_e_deg")
    found = identify(read_pulses([path]), N_r=6, R=R)
    assert found.R_closing is None
    assert torque_error(found.table) < 0.03


@pytest.mark.parametrize("wrong_deg", [-50, -25, 25, 50, 90])
def test_pulses_from_before_the_alignment_are_refused(wrong_deg):
    """The board did not know its zero: it showed 0 to 180 deg, the rotor was elsewhere."""
    shown = np.linspace(0, 180, 31)
    i = np.linspace(0, 12, 13)
    for shift in (0, wrong_deg):
        grid = np.meshgrid(i, np.radians(shown + shift), indexing="ij")
        psi = _core.magnetics(TABLE, *(g.ravel() for g in grid))[:, 0].reshape(grid[0].shape)
        raw = RawMap(i, shown, psi, None, "currents_down", 6, "deg", "electrical")
        if shift == 0:
            assert settled(raw).psi.shape == psi.shape
        else:
            with pytest.raises(ParameterError, match="the zero of the angle is wrong"):
                settled(raw)


@pytest.mark.parametrize(("steps", "is_closed"), [(0.45, 0), (0.55, 1), (1.45, 1), (1.55, 0)])
def test_a_period_is_closed_where_what_is_left_of_it_is_nearest_to_one_step(steps, is_closed):
    angles = np.arange(10) * 360 / (9 + steps)
    psi = np.ones((3, 10))
    for N_r, kind, unit, own in (
        (6, "electrical", "deg", angles),
        (6, "mechanical", "rad", np.radians(angles) / 6),
    ):
        ends, closed = _closed(own, psi, N_r, unit, kind)
        assert (len(ends), closed.shape) == (10 + is_closed, (3, 10 + is_closed))
        if is_closed:
            assert ends[-1] == pytest.approx(own[-1] + steps * (own[1] - own[0]))


def test_the_spline_over_both_signs_is_odd_and_its_curvature_is_kept_even(monkeypatch):
    """A straight line is as smooth as any, and found again. Coefficients that rise as the cube of
    their place have a constant third difference."""
    kept, own = [], identifying._smoothed

    def smoothed(basis, penalty, row):
        kept.append(penalty)
        return own(basis, penalty, row)

    monkeypatch.setattr(identifying, "_smoothed", smoothed)
    s, x = np.linspace(0.01, 1.99, 150), np.linspace(0, 1.9, 60)
    straight, wave = 0.3 * s, 0.1 + 0.05 * np.sin(9 * s)
    for d in (straight, wave):
        found = identifying._odd_spline(s, d, np.ones(len(s)))
        assert found(-x) == pytest.approx(-found(x), abs=1e-12)
        if d is straight:
            assert found(s) == pytest.approx(d, abs=1e-6)
    cube = np.arange(1.0, kept[0].shape[1] + 1) ** 3
    assert kept[0] @ cube == pytest.approx(np.full(len(kept[0]), 6.0))


def test_a_table_that_the_check_refuses_is_written_and_told(captures, tmp_path, monkeypatch):
    files = [write(tmp_path / f"{n}.csv", rows) for n, rows in enumerate(captures)]
    angles = [text for angle in ANGLES for text in ("--angle", f"{angle:g}")]
    line = ("map", "identify", *files, *angles, "--R_ohm", R, "--N_r", 6)
    line += ("--angle_kind", "electrical", "--out", tmp_path / "map.csv")
    assert "next: " in command(*line).out
    (tmp_path / "map.csv").unlink()
    asked = []

    def refusal(table):
        asked.append(table)
        return SimpleNamespace(reasons=("the last row is off",))

    monkeypatch.setattr(rl.maps, "check_map", refusal)
    told = command(*line)
    assert told.code == 1 and told.out.endswith("refused: the last row is off\n")
    assert (tmp_path / "map.csv").exists() and len(asked) == 1
