"""`reluctance limit`: the limit at the operating point of a drive file."""

import json
from pathlib import Path

import numpy as np
import pytest
from command import command, refused

from reluctance import load
from reluctance.base.errors import ParameterError
from reluctance.explore import limits
from reluctance.explore.limits import (
    Limit,
    check_point,
    envelope_of,
    files,
    operating_point,
    text,
)
from reluctance.machine.optimum import Envelope, best_profile, ripple_floor

EXAMPLES = sorted(
    p
    for p in (Path(__file__).parents[2] / "examples").glob("*.toml")
    if not any(word in p.read_text() for word in ("[site]", "shared_switch"))  # none, or no limit
)
RATED = next(path for path in EXAMPLES if path.name == "paper_rated.toml")
PUMP = RATED.with_name("paper_pump.toml")


@pytest.fixture(autouse=True)
def cache_dir(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("RELUCTANCE_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.stem)
def test_every_example_has_a_limit(example: Path) -> None:
    drive = load(example)
    tau_ref = None
    if drive.reference.kind == "none":
        tau_ref = 5.0
        with pytest.raises(ParameterError, match="--tau"):
            limits.limit(drive)
    found = limits.limit(drive, tau_ref=tau_ref)
    figures = found.with_units()
    assert figures["i_rms_A"] > 0
    assert figures["ripple_free"] == (figures["tau_ref_Nm"] <= figures["tau_max_ripple_free_Nm"])
    assert len(text.rows(found)) >= 9


def test_speed_reference_takes_the_torque_of_the_load_at_that_speed() -> None:
    drive = load(PUMP)
    tau_ref, omega_m = operating_point(drive)
    assert omega_m == pytest.approx(50 * np.pi)
    assert tau_ref == pytest.approx(0.0015 * omega_m**2 + drive.machine.B_Nms * omega_m)
    assert tau_ref == pytest.approx(40.15, abs=0.01)  # published: 37.01 + 3.14 N m


@pytest.fixture(scope="module")
def found() -> tuple[Limit, Envelope]:
    limit = limits.limit(load(RATED))
    return limit, envelope_of(limit, omega_max=350.0)


def test_files_hold_the_profile_and_the_envelope(
    found: tuple[Limit, Envelope], tmp_path: Path
) -> None:
    limit, envelope = found
    files.save_profile(limit, tmp_path / "profile.csv")
    files.save_envelope(envelope, tmp_path / "envelope.csv")
    files.save_figure(limit, envelope, tmp_path / "figure.png")
    profile = np.genfromtxt(tmp_path / "profile.csv", delimiter=",", names=True)
    np.testing.assert_allclose(profile["i_A"], limit.least_copper.i)
    torque = profile["tau_ph_Nm"].reshape(3, -1).sum(axis=0)
    np.testing.assert_allclose(torque, 41.339, rtol=1e-6)
    border = np.genfromtxt(tmp_path / "envelope.csv", delimiter=",", names=True)
    assert border["speed_rpm"][-1] == pytest.approx(350 * 30 / np.pi)
    assert np.all(np.diff(border["tau_max_Nm"]) < 1e-6)
    assert (tmp_path / "figure.png").read_bytes()[:4] == b"\x89PNG"


def test_braking_at_no_resistance_reaches_what_driving_does() -> None:
    """Without copper loss, time reversed: the same currents, torque against the speed."""
    drive = load(RATED, ["machine.R_ohm=0.0"])
    driving, braking = (limits.limit(drive, tau_ref=t, omega_m=250.0) for t in (20.0, -20.0))
    assert braking.tau_max == pytest.approx(-driving.tau_max, rel=1e-6)
    assert braking.least_copper.i_rms == pytest.approx(driving.least_copper.i_rms, rel=1e-6)


def test_ripple_floor_of_no_torque_is_zero() -> None:
    point = load(RATED).at(100.0)
    floor = ripple_floor(point, best_profile(point, 0.0), switching_frequency=20e3)
    assert floor.bound_rms == floor.bound_pp == floor.pulse_width_rms == 0


def test_command_prints_json_and_words(cache_dir: Path) -> None:
    ran = command("limit", RATED, "--json", "--at-switching-frequency", "20kHz")
    assert ran.code == 0, ran.error
    figures = json.loads(ran.out)
    assert figures["i_rms_A"] == pytest.approx(48.9, rel=0.01)  # published
    assert figures["p_cu_W"] == pytest.approx(5171, rel=0.01)
    assert 0 < figures["ripple_bound_rms_Nm"] < figures["ripple_pulse_width_rms_Nm"] < 0.41339
    words = command("limit", RATED)
    assert "best known" in words.out
    assert "48.93 A" in words.out


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--at-switching-frequency", "much"], "frequency `much`"),
        (["--out", "profile.txt"], "ending `.txt`"),
        (["--set", "converter.u_dc_V=0"], "u_dc_V"),
    ],
)
def test_command_says_what_is_wrong_on_one_line(arguments: list[str], message: str) -> None:
    assert message in refused("limit", RATED, *arguments)


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["--tau", 5000], "torque 5000 N m, need at most"),
        (["--tau", "nan"], "torque nan N m, need at most"),
        (["--at-switching-frequency", 20], "need at least the electrical frequency, 100 Hz"),
    ],
)
def test_what_cannot_be_meant_is_refused_in_one_line(arguments: list[object], says: str) -> None:
    assert says in refused("limit", RATED, *arguments)


def test_the_greatest_torque_of_the_check_is_that_of_all_phases() -> None:
    """The machine can hold somewhat less without ripple than it can give at its best angle."""
    drive = load(RATED)
    check_point(drive, tau_ref=limits.limit(drive).tau_max, omega_m=0.0)
    theta_e = np.linspace(0, 2 * np.pi, 3600)
    phases = [drive.machine.tau(150.0, theta_e - k * 2 * np.pi / 3) for k in range(3)]
    most = np.maximum(phases, 0).sum(axis=0).max()
    check_point(drive, tau_ref=-0.999 * most, omega_m=0.0)
    with pytest.raises(ParameterError, match="impossible at any angle"):
        check_point(drive, tau_ref=1.001 * most, omega_m=0.0)
