"""Records of five makers' oscilloscopes, in their forms, and a current probe's factor."""

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from command import command, refused

from reluctance import ParameterError
from reluctance.machine.maps import identify, read_map, read_pulses

U, R, I_TOP, I_0 = 24.0, 3.0, 6.0, 4.0
ANGLES = np.linspace(0, 180, 10)
Pulse = tuple[np.ndarray, np.ndarray, np.ndarray]


def psi(i: np.ndarray, theta: float) -> np.ndarray:
    L = 8e-3 + 52e-3 * (1 - np.cos(theta)) / 2
    return np.asarray(6e-3 * i + (L - 6e-3) * I_0 * (1 - np.exp(-i / I_0)))


def pulse(theta: float, dt: float = 5e-5) -> Pulse:
    """Rest, voltage on until the current limit, then off; psi in fine steps."""
    i_of = np.linspace(0, 1.5 * I_TOP, 4001)
    curve, linked, on = psi(i_of, theta), 0.0, True
    t, u, i = [], [], []
    for n in range(5000):
        now = float(np.interp(linked, curve, i_of))
        on = on and now < I_TOP
        volts = 0.0 if n < 20 else U if on else -U if now > 0 else 0.0
        t.append(n * dt), u.append(volts), i.append(now)
        for _ in range(20):
            linked = max(0.0, linked + dt / 20 * (volts - R * np.interp(linked, curve, i_of)))
        if n > 20 and not on and linked == 0:
            break
    return np.array(t), np.array(u), np.array(i)


PULSES = [pulse(np.radians(a)) for a in ANGLES]


def keysight(p: Pulse) -> str:
    rows = [f"{t:+.9E},{u:+.6E},{i:+.6E}" for t, u, i in zip(*p, strict=True)]
    return "\n".join(["x-axis,1,2", "second,Volt,Ampere", *rows])


def digilent(p: Pulse) -> str:
    rows = [f"{t:.9f},{u:.6f},{i:.6f}" for t, u, i in zip(*p, strict=True)]
    head = ["#Digilent WaveForms", "", "Time (s),Channel 1 (V),Channel 2 (A)"]
    return "\n".join([*head, *rows])


def rigol(p: Pulse) -> str:
    t = p[0]
    head = ["X,CH1,CH2,Start,Increment,", f"Sequence,Volt,Ampere,{t[0]:.6e},{t[1] - t[0]:.6e}"]
    rows = [f"{k},{u:.4f},{i:.4f},," for k, (u, i) in enumerate(zip(*p[1:], strict=True))]
    return "\n".join([*head, *rows])


def tektronix(p: Pulse) -> str:
    head = ["Model,MSO44", "Firmware,1.2", "", "Waveform Type,ANALOG", "Sample Interval,5.0e-05"]
    rows = [f"{t:.9e},{u:.6f},{i:.6f}" for t, u, i in zip(*p, strict=True)]
    return "\n".join([*head, "", "TIME,CH1,CH2", *rows])


def siglent(p: Pulse) -> str:
    head = ["Record Length,Analog:745", "Vertical Units,V,A", "Second,Volt,Ampere"]
    return "\n".join([*head, *(f"{t:.9e},{u:.6f},{i:.6f}" for t, u, i in zip(*p, strict=True))])


def in_volts(p: Pulse) -> str:
    """A probe of 100 mV/A."""
    rows = [f"{t:.9f},{u:.6f},{i / 10:.7f}" for t, u, i in zip(*p, strict=True)]
    return "\n".join(["TIME,CH1,CH2", *rows])


CHANNELS = {"t": "TIME", "u": "CH1", "i": "CH2"}


@pytest.mark.parametrize(
    ("form", "names", "probe"),
    [
        (keysight, {}, None),
        (digilent, {}, None),
        (rigol, {}, None),
        (rigol, {"u": "CH1", "i": "CH2"}, None),
        (tektronix, CHANNELS, None),
        (siglent, {}, None),
        (in_volts, CHANNELS, 10.0),
    ],
)
def test_what_an_oscilloscope_saves_becomes_the_table_of_the_winding(
    tmp_path: Path, form: Callable[[Pulse], str], names: dict[str, str], probe: float | None
) -> None:
    files = [tmp_path / f"{n}.csv" for n in range(len(ANGLES))]
    for file, p in zip(files, PULSES, strict=True):
        file.write_text(form(p) + "\n")
    recording = read_pulses(files, angles=list(ANGLES), names=names, probe=probe)
    table = identify(recording, N_r=6, R=R, angle_unit="deg", angle_kind="electrical").table
    true = np.stack([psi(table.i, theta) for theta in table.theta_e], axis=1)
    assert table.i[-1] > 0.95 * I_TOP
    assert np.abs(table.psi - true).max() < 0.01 * true.max()


def test_the_command_takes_angles_names_and_probe_of_the_files(tmp_path: Path) -> None:
    files = [tmp_path / f"{n}.csv" for n in range(len(ANGLES))]
    for file, p in zip(files, PULSES, strict=True):
        file.write_text(in_volts(p) + "\n")
    recording = read_pulses(files, angles=list(ANGLES), names=CHANNELS, probe=10.0)
    table = identify(recording, N_r=6, R=R, angle_unit="deg", angle_kind="electrical").table
    given = [f"--angle={a}" for a in ANGLES] + [f"--name={q}={n}" for q, n in CHANNELS.items()]
    how = ("--angle_unit", "deg", "--angle_kind", "electrical", "--probe_A_per_V", 10)
    out = tmp_path / "m.csv"
    done = command(
        *("map", "identify", *files, *given, *how, "--R_ohm", R, "--N_r", 6, "--out", out)
    )
    assert done.code == 0, done.error
    assert read_map(out, N_r=6).psi == pytest.approx(table.psi, rel=1e-6, abs=1e-9)


def test_channels_without_units_are_asked_for_by_name(tmp_path: Path) -> None:
    (tmp_path / "t.csv").write_text(tektronix(PULSES[0]))
    said = refused(
        *("map", "identify", tmp_path / "t.csv", "--angle", 0, "--R_ohm", R, "--N_r", 6),
        *("--out", tmp_path / "m.csv"),
    )
    assert "no column for u" in said and "header has TIME, CH1, CH2" in said


def test_an_increment_without_a_number_is_one_line(tmp_path: Path) -> None:
    (tmp_path / "r.csv").write_text(
        "X,CH1,CH2,Start,Increment\nSequence,Volt,Ampere,0,0\n0,0,0,,\n"
    )
    with pytest.raises(ParameterError, match="no number below `Increment`"):
        read_pulses([tmp_path / "r.csv"], angles=[0.0])


@pytest.mark.parametrize("head", ["t_s,u_V,i_A,theta_e_deg", "x-axis,1,2\nsecond,Volt,Ampere"])
def test_a_record_without_rows_is_told_as_such(tmp_path: Path, head: str) -> None:
    path = tmp_path / "p.csv"
    path.write_text(head + "\n")
    with pytest.raises(ParameterError, match=r"p.csv: the file has no rows below the names"):
        read_pulses([path], angles=[] if "theta" in head else [0.0])


def with_units(p: Pulse) -> str:
    rows = [f"{t:.9f},{u:.6f},{i / 10:.7f}" for t, u, i in zip(*p, strict=True)]
    return "\n".join(["Time,CH1,CH2", "s,V,V", *rows])


def test_a_current_in_volts_asks_for_its_probe_and_one_column_is_not_two_quantities(
    tmp_path: Path,
) -> None:
    files = [tmp_path / f"{n}.csv" for n in range(len(ANGLES))]
    for file, p in zip(files, PULSES, strict=True):
        file.write_text(with_units(p) + "\n")
    given = [f"--angle={a}" for a in ANGLES]
    how = ("--angle_unit", "deg", "--angle_kind", "electrical", "--R_ohm", R, "--N_r", 6)
    line = ("map", "identify", *files, *given, *how, "--out", tmp_path / "m.csv")
    said = refused(*line)
    assert "no column for u" in said and "header has Time" in said
    assert "no column `s` for t" in refused(*line, "--name=t=s", "--name=u=V", "--name=i=V")
    assert "of another quantity" in refused(*line, "--name=u=CH1", "--name=i=CH1")
    names = ("--name=u=CH1", "--name=i=CH2")
    probe = re.search(r"(--probe_A_per_V) (10) for 100 mV/A", refused(*line, *names))
    assert probe and command(*line, *names, *probe.groups()).code == 0


@pytest.mark.parametrize(
    ("head", "named", "scale"),
    [
        ("Time,CH1,CH2\ns,V,mV", "CH2", 1e3),
        ("Time,CH1,CH2 [mV]", "CH2 [mV]", 1e3),
        ("Time,CH1,Channel 2 (uV)", "Channel 2 (uV)", 1e6),
        ("Time,CH1,i_mV", "i_mV", 1e3),
        ("Time,CH1,i_mV", "", 1e3),
        ("Time,CH1,current [kV]", "", 1e-3),
        ("Time,CH1,i_V", "i_V", 1.0),
    ],
)
def test_the_unit_of_a_probes_column_counts_before_its_factor(
    tmp_path: Path, head: str, named: str, scale: float
) -> None:
    p, path = PULSES[3], tmp_path / "p.csv"
    rows = [f"{t:.9f},{u:.6f},{scale * i / 10:.9g}" for t, u, i in zip(*p, strict=True)]
    path.write_text("\n".join([head, *rows]) + "\n")
    names = {"t": "Time", "u": "CH1"} | ({"i": named} if named else {})
    (found,) = read_pulses([path], angles=[0.0], names=names, probe=10.0).pulses
    assert found.i == pytest.approx(p[2], rel=1e-6, abs=1e-6)
    if scale != 1:
        with pytest.raises(ParameterError, match=r"is in volts: .* --probe_A_per_V"):
            read_pulses([path], angles=[0.0], names=names)


def test_a_resistance_that_is_ten_times_too_large_is_told_before_what_it_does(
    tmp_path: Path,
) -> None:
    files = [tmp_path / f"{n}.csv" for n in range(len(ANGLES))]
    for file, p in zip(files, PULSES, strict=True):
        file.write_text(keysight(p) + "\n")
    recording = read_pulses(files, angles=list(ANGLES))
    with pytest.raises(ParameterError, match=f"agree with .* ohm, not with R_ohm = {10 * R:g}"):
        identify(recording, N_r=6, R=10 * R, angle_unit="deg", angle_kind="electrical")
