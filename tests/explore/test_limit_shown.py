"""A limit in words, tables and figures: what is shown of one whose numbers are given."""

import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import reluctance as rl
from reluctance.explore.limits import Limit, check_point, files, operating_point, text
from reluctance.explore.limits import report as reported
from reluctance.machine.optimum import Envelope, Profile, RippleFloor
from reluctance.machine.optimum.torque_step import TorqueStep

EXAMPLES = Path(__file__).parents[2] / "examples"
N = 12  # points of a period of three phases
SPEED = 157.0  # [rad/s]


@pytest.fixture(scope="module")
def drive():
    return rl.load(EXAMPLES / "paper_rated.toml")


@pytest.fixture(scope="module")
def limit(drive):
    theta = 2 * np.pi * np.arange(N) / N
    i = 40.0 * np.maximum(np.sin(theta), 0)
    best = Profile(
        theta,
        i,
        psi=0.01 * i,
        u=240.0 * np.cos(theta),
        tau_error_max=0.0,
        tau_error_rms=0.0,
        i_rms=20.123,
        i_peak=40.456,
        p_cu=875.25,
        tau_ref=20.0,
        omega_m=SPEED,
        u_dc=240.0,
    )
    floor = RippleFloor(20e3, 0.1, 0.5, 0.125, 0.15, 0.175, 0.0)
    step = TorqueStep(np.zeros(2), np.array([1e-3, 3e-3]), 0.95)
    return Limit(drive, best, 41.2345, floor, step)


def test_words_have_every_figure_in_its_unit(limit):
    assert dict(text.rows(limit)) == {
        "speed": "1499.24 rpm",
        "torque": "20.000 N m",
        "dc-link voltage": "240 V",
        "current limit": "150 A",
        "torque without ripple": "possible",
        "greatest ripple-free torque": "41.234 N m",
        "rms phase current": "20.12 A",
        "peak phase current": "40.46 A",
        "copper loss": "875.2 W",
        "least time from zero to 95% of the torque, mean over the angle": "2.000 ms",
        "at the worst angle": "3.000 ms",
        "at mean switching frequency per switch": "20 kHz",
        "torque error, rms, bound": "0.500%",
        "torque error, peak to peak, bound": "2.500%",
        "rms, bound with returning fluxes": "0.625%",
        "rms, bound with fluxes on the profile": "0.750%",
        "rms, independent pulse width": "0.875%",
    }
    assert text.basis(limit) == f"{text.PROFILE}\n{text.FLOOR}"
    alone = replace(limit, floor=None, step=None)
    assert len(text.rows(alone)) == 9 and text.basis(alone) == text.PROFILE


def test_braking_has_its_ripple_over_the_size_of_its_torque(limit):
    braking = replace(limit, least_copper=replace(limit.least_copper, tau_ref=-20.0))
    assert dict(text.rows(braking))["torque error, rms, bound"] == "0.500%"
    small = replace(limit, least_copper=replace(limit.least_copper, tau_ref=0.5))
    assert dict(text.rows(small))["torque error, rms, bound"] == "20.000%"
    still = replace(limit, least_copper=replace(limit.least_copper, tau_ref=0.0))
    assert "torque error, rms, bound" not in dict(text.rows(still))


@pytest.mark.parametrize(
    ("part", "free"), [(1e-6, True), (0.99e-5, True), (1.03e-5, False), (1e-4, False), (-1.0, True)]
)
def test_ripple_is_none_up_to_what_the_solver_leaves(limit, part, free):
    """A millionth of the torque is the tolerance of the grid points, and ten of them are none."""
    error = 20.0 * part
    found = replace(limit, least_copper=replace(limit.least_copper, tau_error_max=error))
    assert found.ripple_free == free
    rows = dict(text.rows(found))
    assert rows["torque without ripple"] == ("possible" if free else "impossible")
    assert ("its rms" in rows) != free
    if not free:
        assert rows["least torque error, greatest"] == f"{error:.3f} N m"


def test_names_with_units_hold_the_same_figures(limit):
    assert limit.with_units() == pytest.approx(
        {
            "speed_rpm": SPEED * 30 / np.pi,
            "tau_ref_Nm": 20.0,
            "u_dc_V": 240.0,
            "i_max_A": 150.0,
            "ripple_free": True,
            "tau_error_max_Nm": 0.0,
            "tau_error_rms_Nm": 0.0,
            "i_rms_A": 20.123,
            "i_peak_A": 40.456,
            "p_cu_W": 875.25,
            "tau_max_ripple_free_Nm": 41.2345,
            "torque_step_mean_ms": 2.0,
            "torque_step_longest_ms": 3.0,
            "switching_frequency_Hz": 20e3,
            "ripple_bound_rms_Nm": 0.1,
            "ripple_bound_pp_Nm": 0.5,
            "ripple_returning_flux_rms_Nm": 0.125,
            "ripple_on_profile_rms_Nm": 0.15,
            "ripple_pulse_width_rms_Nm": 0.175,
        }
    )
    shown = "20 N m at 1499.2 rpm, 20.12 A rms, at most 41.23 N m without ripple)"
    assert repr(limit).endswith(shown)


def test_a_step_longer_than_was_looked_at_has_no_time(limit):
    """Neither as JSON, which knows no infinity, nor in words."""
    never = replace(limit, step=replace(limit.step, time=np.array([0.001, np.inf])))
    figures = never.with_units()
    assert figures["torque_step_mean_ms"] is figures["torque_step_longest_ms"] is None
    assert dict(text.rows(never))["at the worst angle"] == "over 20 ms, or never"


@pytest.mark.parametrize(
    ("finer", "noted"), [(10.0, False), (9.81, False), (9.79, True), (10.21, True)]
)
def test_a_greatest_torque_that_depends_on_the_grid_is_noted(finer, noted, monkeypatch, limit):
    asked = []

    def envelope(point, speeds, *, n_points, direction, progress=None):
        asked.append((n_points, direction))
        return replace(ENVELOPE, tau_max=np.array([10.0 if len(asked) == 1 else finer]))

    monkeypatch.setattr(reported, "torque_speed_envelope", envelope)
    monkeypatch.setattr(reported, "best_profile", lambda *_, **__: limit.least_copper)
    monkeypatch.setattr(reported, "step_of", lambda *_, **__: None)
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        found = reported.limit(limit.drive, tau_ref=-5.0)
    assert found.tau_max == 10.0 and asked == [(180, -1), (360, -1)]
    assert bool(told) == noted
    if noted:
        assert f"10 N m at 180 angles, {finer:.4g} N m at 360" in str(told[0].message)


ENVELOPE = Envelope(
    np.array([0.0, 100.0, 300.0]), np.array([50.0, 48.0, 30.0]), *np.arange(9.0).reshape(3, 3)
)


def test_a_table_of_the_envelope_is_in_border_units(limit, tmp_path):
    files.save_envelope(ENVELOPE, tmp_path / "e.csv")
    table = np.genfromtxt(tmp_path / "e.csv", delimiter=",", names=True)
    assert table["speed_rpm"] == pytest.approx(np.array([0, 100, 300]) * 30 / np.pi)
    for name, values in (
        ("tau_max_Nm", ENVELOPE.tau_max),
        ("i_rms_A", ENVELOPE.i_rms),
        ("i_peak_A", ENVELOPE.i_peak),
        ("p_cu_W", ENVELOPE.p_cu),
    ):
        assert table[name] == pytest.approx(values)
    files.save_profile(limit, tmp_path / "p.csv")
    table = np.genfromtxt(tmp_path / "p.csv", delimiter=",", names=True)
    assert table["theta_e_deg"] == pytest.approx(30.0 * np.arange(N))
    best = limit.least_copper
    for name, values in (("i_A", best.i), ("psi_Wb", best.psi), ("u_V", best.u)):
        assert table[name] == pytest.approx(values)
    assert table["tau_ph_Nm"] == pytest.approx(limit.drive.machine.tau(best.i, best.theta_e))


def curves(ax):
    return {line.get_label(): line.get_data() for line in ax.lines}


def test_each_phase_does_the_same_a_third_of_a_period_later(limit):
    drawn = files.figure(limit, ENVELOPE)
    currents, torque, voltage, border = drawn.axes[:4]
    best, m = limit.least_copper, limit.drive.machine
    degrees = 30.0 * np.arange(N + 1)
    for quantity, ax in ((best.i, currents), (m.tau(best.i, best.theta_e), torque)):
        for k, line in enumerate(ax.lines[:3]):
            assert line.get_xdata() == pytest.approx(degrees)
            later = np.interp(np.mod(degrees - 120 * k, 360), degrees, np.append(quantity, 0.0))
            assert line.get_ydata() == pytest.approx(later, abs=1e-9)
    total = sum(line.get_ydata() for line in torque.lines[:3])
    assert curves(torque)["sum"][1] == pytest.approx(total, abs=1e-9)
    assert {*curves(torque)["reference"][1]} == {20.0} and torque.get_title() == "no ripple"
    assert currents.get_title() == "20.12 A rms, 40.46 A peak of 150 A allowed"
    assert voltage.get_ylim() == pytest.approx((-264, 264))
    assert voltage.lines[0].get_ydata() == pytest.approx(np.append(best.u, best.u[0]))
    (flux,) = drawn.axes[4:]
    assert flux.lines[0].get_ydata() == pytest.approx(np.append(best.psi, best.psi[0]))
    assert flux.get_ylim() == pytest.approx((-0.44, 0.44))  # both zeros at one height
    assert min(flux.get_yticks()) >= 0
    point = curves(border)["operating point"]
    assert (point[0][0], point[1][0]) == (pytest.approx(SPEED * 30 / np.pi), 20.0)
    most = curves(border)["greatest without ripple"]
    assert most[0][-1] == pytest.approx(300 * 30 / np.pi) and [*most[1]] == [50, 48, 30]
    assert border.get_ylim()[0] == 0 and "41.23 N m without ripple" in border.get_title()
    for ax in (currents, torque, voltage):
        assert ax.get_xlim() == (0, 360) and [*ax.get_xticks()] == [0, 60, 120, 180, 240, 300, 360]
    title = drawn.get_suptitle()
    assert "minimum copper loss without ripple, 20 N m at 1499.2 rpm, 240 V" in title


def test_a_figure_of_braking_and_of_ripple_says_so(limit):
    best = replace(limit.least_copper, tau_ref=-20.0, tau_error_max=1.5, tau_error_rms=0.75)
    drawn = files.figure(replace(limit, least_copper=best), ENVELOPE)
    assert "with least ripple, -20 N m" in drawn.get_suptitle()
    assert drawn.axes[1].get_title() == "error 1.5 N m at most, 0.75 rms"
    assert drawn.axes[3].get_ylim()[1] == 0


def test_an_envelope_reaches_twice_the_speed_or_twice_the_corner_at_standstill(limit, monkeypatch):
    asked = []
    monkeypatch.setattr(reported, "_envelope", lambda *given: asked.append(given[1]))
    reported.envelope_of(limit)
    still = replace(limit, least_copper=replace(limit.least_copper, omega_m=0.0))
    reported.envelope_of(still)
    reported.envelope_of(limit, omega_max=100.0)
    moving, standing, given = asked
    assert moving == pytest.approx(np.linspace(0, 2 * SPEED, 13)) and given[-1] == 100
    # The flux linkage of 150 A rises to its aligned value under 240 V: u pi/(N_r omega).
    psi = float(limit.drive.machine.psi(150.0, np.pi) - limit.drive.machine.psi(150.0, 0.0))
    assert standing[-1] == pytest.approx(2 * 240 * np.pi / (4 * psi), rel=1e-6)


@pytest.mark.parametrize(
    ("given", "torque", "speed"),
    [
        ([], 41.339, 50 * np.pi),
        (["reference.t_s=[0,1]", "reference.values=[5,-30]", "reference.tau_Nm="], -30, 50 * np.pi),
        (["load.speed_rpm=600"], 41.339, 20 * np.pi),
    ],
)
def test_what_is_asked_is_the_reference_of_greatest_size_at_the_speed_held(given, torque, speed):
    drive = rl.load(EXAMPLES / "paper_rated.toml", given)
    assert operating_point(drive) == pytest.approx((torque, speed), rel=1e-4)
    assert operating_point(drive, tau_ref=7.0) == pytest.approx((7.0, speed))
    assert operating_point(drive, omega_m=3.0) == pytest.approx((torque, 3.0), rel=1e-4)


def test_a_shared_switch_and_no_reference_have_no_operating_point():
    shared = rl.load(EXAMPLES / "paper_rated.toml", ["converter.bridge=shared_switch"])
    with pytest.raises(rl.ParameterError, match="share no switch"):
        operating_point(shared)
    free = rl.load(EXAMPLES / "single_pulse.toml")
    with pytest.raises(rl.ParameterError, match="asks for no torque; give one with --tau"):
        operating_point(free)


def test_what_is_searched_is_asked_for_at_the_point_of_the_drive(drive, monkeypatch):
    """60 points of each phase; the envelope of the torque's sign; a floor where a frequency is
    given, of a smooth profile; a step where there is a torque."""
    asked = []

    def search(name, answer):
        monkeypatch.setattr(
            reported, name, lambda *given, **more: asked.append((name, given, more)) or answer
        )

    search("best_profile", "profile")
    search("torque_speed_envelope", replace(ENVELOPE, tau_max=np.array([44.0])))
    search("ripple_floor", "floor")
    search("fastest_torque_step", "step")
    point = drive.at(SPEED)

    def of(**given):
        asked.clear()
        return reported.limit(drive, omega_m=SPEED, **given)

    found = of(tau_ref=20.0)
    assert (found.least_copper, found.tau_max) == ("profile", 44.0)
    assert (found.floor, found.step) == (None, "step")
    border, finer, best, step = asked
    assert best == ("best_profile", (point, 20.0), {"n_points": 180})
    assert border[1][0] == drive.at(0.0) and border[1][1].tolist() == [SPEED]
    assert border[2] == {"n_points": 180, "direction": 1, "progress": None}
    assert finer[2] == border[2] | {"n_points": 360}
    assert step == ("fastest_torque_step", (point, 20.0), {"start": None})
    found = of(tau_ref=-20.0, switching_frequency=20e3)
    assert found.floor == "floor" and asked[1][2]["direction"] == -1
    smooth, floor = asked[3:5]
    assert smooth[2] == {"n_points": 180, "norm": "rms", "smoothing": 1e-3}
    assert floor == ("ripple_floor", (point, "profile"), {"switching_frequency": 20e3})
    assert of(tau_ref=0.0).step is None
    coupled = rl.load(EXAMPLES / "coupled_phases.toml")
    monkeypatch.setattr(reported, "check_point", lambda *_, **__: None)  # it takes seconds there
    assert reported.limit(coupled, tau_ref=1.0, omega_m=SPEED).step is None


def test_a_switch_turns_on_once_in_an_electrical_period_at_least(drive):
    """100 Hz at 1500 rpm with four rotor poles, either way."""
    for speed in (50 * np.pi, -50 * np.pi):
        point = {"tau_ref": 1.0, "omega_m": speed}
        check_point(drive, **point, switching_frequency=100.0)
        check_point(drive, **point, switching_frequency=None)
        with pytest.raises(rl.ParameterError, match=r"99\.9 Hz, need at least .* 100 Hz here"):
            check_point(drive, **point, switching_frequency=99.9)
    most = drive.machine.greatest_torque
    check_point(drive, tau_ref=-most, omega_m=0.0, switching_frequency=1e-3)


@pytest.fixture(scope="module")
def coupled(limit):
    """Of phases with pairs, which have profiles of their own."""
    drive = rl.load(EXAMPLES / "coupled_phases.toml")
    n = drive.machine.n_phases
    theta = 2 * np.pi * np.arange(4 * n) / (4 * n)
    i = np.stack([(k + 1.0) * np.maximum(np.sin(theta), 0) for k in range(n)])
    best = replace(limit.least_copper, theta_e=theta, i=i, psi=0.01 * i, u=10 * i, tau_ref=1.0)
    return replace(limit, drive=drive, least_copper=best, step=None, floor=None)


def test_pairs_of_phases_have_a_curve_and_a_part_of_the_sum(coupled):
    best, m = coupled.least_copper, coupled.drive.machine
    n = m.n_phases
    ax = files.plot_torque(files.Picture(4, 3).subplots(), coupled)
    at_once = [np.roll(best.i[k], 4 * k) for k in range(n)]
    angles = [best.theta_e - 2 * np.pi * k / n for k in range(n)]
    alone = sum(m.tau(i, angle) for i, angle in zip(at_once, angles, strict=True))
    pairs = m.coupling.tau(np.stack(at_once, axis=-1), best.theta_e)
    shown = curves(ax)
    assert np.abs(pairs).max() > 0
    assert shown["pairs"][1][:-1] == pytest.approx(pairs)
    assert shown["sum"][1][:-1] == pytest.approx(alone + pairs, abs=1e-9)
    assert shown["sum"][1][-1] == shown["sum"][1][0]
    words = text.basis(coupled).split("\n")
    assert words[0] == text.PROFILE and words[-1] == text.PAIRS


def test_a_table_has_the_profile_of_each_phase_where_they_differ(coupled, tmp_path):
    files.save_profile(coupled, tmp_path / "p.csv")
    table = np.genfromtxt(tmp_path / "p.csv", delimiter=",", names=True)
    best, m = coupled.least_copper, coupled.drive.machine
    for k in range(m.n_phases):
        letter = "abcdef"[k]
        assert table[f"i_{letter}_A"] == pytest.approx(best.i[k])
        assert table[f"psi_{letter}_Wb"] == pytest.approx(best.psi[k])
        assert table[f"u_{letter}_V"] == pytest.approx(best.u[k])
        tau = m.tau(best.i[k], best.theta_e)
        assert table[f"tau_ph_{letter}_Nm"] == pytest.approx(tau, abs=1e-9)
