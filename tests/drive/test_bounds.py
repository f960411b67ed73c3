"""A run ends by itself whatever its numbers, and says what it left and how to mend it. It takes
no more memory than it said; numbers that cannot be meant are refused before it."""

import resource

import numpy as np
import pytest
from command import command, refused

import reluctance as rl
from reluctance import ParameterError
from reluctance.base.resources import resources
from reluctance.base.toml_file import MAX_TOML_BYTES
from reluctance.drive.plausible import MOST_CURRENT, MOST_SPEED, corner_speed
from reluctance.drive.run.bounds import MOST_BYTES, Bounds, waveform_bytes, waveform_rows

RATED = resources("examples") / "paper_rated.toml"


def overridden(*values):
    return [word for value in values for word in ("--set", value)]


DRIVEN = ("load.kind=torque", "load.speed_rpm=1500")


def test_a_shaft_that_runs_away_ends_the_run_in_one_line():
    line = refused("run", RATED, *overridden(*DRIVEN, "load.tau_Nm=1e6"))
    for text in ("the speed is", "rpm after", "need at most", "check [load]"):
        assert text in line


def test_a_shaft_that_is_driven_backwards_without_end_too():
    assert "the speed is" in refused("run", RATED, *overridden(*DRIVEN, "load.tau_Nm=-1e5"))


def test_a_current_without_end_is_one_line():
    """One window that never closes, at standstill, without resistance."""
    drive = rl.load(
        resources("examples") / "single_pulse.toml",
        ["load.speed_rpm=0", "converter.u_dc_V=50000", "simulation.until_s=10"],
    )
    nothing = drive.machine.computed(R_ohm=0.0)
    from dataclasses import replace

    with pytest.raises(ParameterError, match=r"a phase current is .* A after .* need at most"):
        rl.simulate(replace(drive, machine=nothing), record=None)


def test_chattering_that_would_take_for_ever_ends():
    line = refused("run", RATED, "--set", "control.i_band_A=1e-9")
    assert "switches too often" in line and "widen i_band_A" in line


@pytest.mark.parametrize(
    ("value", "says"),
    [
        ("converter.u_dc_V=1e9", "u_dc"),
        ("load.speed_rpm=1e6", "speed 1e+06 rpm, need at most"),
        ("control.T_s_us=50000", "T_s_us = 50000, need at most"),
        ("simulation.dt_max_us=1e9", "dt_max_us = 1000000000.0, need <= 1000"),
        ("simulation.until_s=1e9", "5.0e+13 steps"),
        ("source.values=[1e9]", "[source] values = 1e+09, need at most"),
    ],
)
def test_a_number_that_cannot_be_meant_is_refused(value, says):
    more = ["--set", "source.t_s=[0]"] if value.startswith("source") else []
    line = refused("run", RATED, *more, "--set", value)
    assert says.replace("u_dc", "dc-link voltage") in line or says in line


def test_the_end_on_the_command_line_is_judged_as_that_of_the_file():
    on_the_line = refused("run", RATED, "--until", "1e9")
    in_the_file = refused("run", RATED, "--set", "simulation.until_s=1e9")
    assert "5.0e+13 steps" in on_the_line and "5.0e+13 steps" in in_the_file


def test_scales_are_those_of_the_machine():
    """At 50 times the corner speed a single pulse at full voltage draws less than 1 % of i_max."""
    drive = rl.load(resources("examples") / "single_pulse.toml")
    omega = MOST_SPEED * corner_speed(drive.machine, drive.converter.u_dc_V)
    fast = drive.with_values({"load.speed_rpm": omega * 30 / np.pi * 0.99, "control.T_s_us": 10.0})
    peak = rl.simulate(fast, until=1e-3, record=None).kpis.i_peak
    assert 0.001 < peak / drive.machine.i_max_A < 0.1


def test_waveforms_that_do_not_fit_are_refused_with_a_remedy_that_works(tmp_path):
    line = refused("run", RATED, "--until", "1000", "--json", "--out", tmp_path / "never.csv")
    assert "GB" in line and "--record-us" in line
    drive = rl.load(RATED)
    grid = float(line.split("--record-us ")[1].split()[0])
    assert waveform_bytes(drive, 1000, grid * 1e-6) < MOST_BYTES
    with pytest.raises(ParameterError, match="need at most"):
        rl.simulate(drive, until=1000)


def test_a_large_recording_says_its_size_beforehand(tmp_path, monkeypatch):
    from reluctance.cli import run

    monkeypatch.setattr(__import__("sys").modules["reluctance.cli.run"], "TOLD_BYTES", 1e5)
    done = command("run", RATED, "--until", "0.02", "--out", tmp_path / "w.npz")
    assert done.code == 0
    assert done.error.startswith("note: the waveforms take about")
    assert run


def test_the_estimate_is_below_what_a_run_keeps_and_not_far():
    drive = rl.load(RATED)
    result = rl.simulate(drive, until=0.02)
    columns = 6 + 6 * drive.machine.n_phases
    assert 0.3 < waveform_bytes(drive, 0.02, 0.0) / (8 * columns * result.t.size) < 1.5
    grid = rl.simulate(drive, until=0.02, record=1e-5)
    assert waveform_bytes(drive, 0.02, 1e-5) == pytest.approx(8 * columns * grid.t.size, rel=0.01)


def test_a_grid_finer_than_memory_is_refused_also_where_iron_loss_keeps_every_point():
    drive = rl.load(RATED.with_name("five_phases_losses.toml"))
    assert drive.machine.iron is not None
    with pytest.raises(rl.ParameterError, match="GB"):
        rl.simulate(drive, until=0.01, record=1e-15)


def test_a_drive_file_without_end_is_one_line():
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    assert f"{MAX_TOML_BYTES / 1e6:g} MB" in refused("run", "/dev/zero")
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 100_000  # KiB


@pytest.mark.parametrize("name", ["[red]x[/]", "[/]", "a{b}", "$x$", "$\\frac$", "é &<b>"])
def test_a_name_is_shown_as_it_is(name, tmp_path):
    """No markup, no formula, no HTML, whatever a file is called."""
    path = tmp_path / f"{name.replace('/', '|')}.toml"
    path.write_text(RATED.read_text())
    page, image = tmp_path / "p.html", tmp_path / "p.png"
    for options in ((), ("--plot", page), ("--plot", image)):
        done = command("run", path, "--until", "0.01", *options)
        assert done.code == 0, done.error
        assert path.stem in done.out.replace("\n", "")
    shown = page.read_text()
    assert "<b>" not in shown.split("<h1>")[1].split("</h1>")[0]


HTML = '</table><script>alert("x")</script>'


def test_names_from_files_stay_escaped_in_every_page(tmp_path):
    """The machine's name and source go into pages, Markdown and C."""
    path = tmp_path / "drive.toml"
    machine = (resources("machines") / "paper_6_4.toml").read_text().split("[machine]", 1)[1]
    lines = [x for x in machine.splitlines() if not x.startswith(("name", "source", "#"))]
    text = RATED.read_text().replace('machine = "paper_6_4"\n', "")
    told = f"[machine]\nname = '{HTML} */ | x'\nsource = '{HTML} */'\n" + "\n".join(lines)
    path.write_text(f"{text}\n{told}\n")
    assert command("run", path, "--until", "0.01", "--plot", tmp_path / "p.html").code == 0
    assert command("limit", path, "--plot", tmp_path / "l.html").code == 0
    for page in tmp_path.glob("*.html"):
        assert "<script>alert" not in page.read_text()
    assert command("export", "firmware", path, "--out", tmp_path / "fw").code == 0
    for file in (tmp_path / "fw").rglob("*"):
        text = file.read_text(errors="replace") if file.is_file() else ""
        assert "*/ |" not in text and "<script>" not in text, file


def test_a_ratio_to_about_nothing_is_null():
    """Torque whose mean is zero has no ripple figure: it once was 66 753 %."""
    drive = rl.load(
        resources("examples") / "single_pulse.toml",
        ["control.theta_on_deg=90", "control.theta_off_deg=100", "load.speed_rpm=20000"],
    )
    k = rl.simulate(drive, until=0.01, record=None).kpis
    for ratio in (k.torque_ripple_pp, k.torque_ripple_rms, k.speed_ripple_pp):
        assert ratio is None or ratio < 100


@pytest.mark.parametrize("tau", [-20.0, -40.0])
def test_efficiency_when_braking_is_that_of_the_way_the_power_takes(tau):
    k = rl.simulate(rl.load(RATED, [f"reference.tau_Nm={tau}"]), until=0.05, record=None).kpis
    assert k.p_mech < 0 and k.p_in < 0
    assert k.efficiency == pytest.approx(k.p_in / k.p_mech)
    assert 0 < k.efficiency < 1


def test_efficiency_is_null_where_both_sides_feed_the_losses():
    """Slow braking: the shaft's power does not even cover the copper."""
    drive = rl.load(RATED, ["reference.tau_Nm=-20", "load.speed_rpm=30"])
    k = rl.simulate(drive, until=0.5, record=None).kpis
    assert k.p_mech < 0 < k.p_in
    assert k.efficiency is None


def test_limit_judges_the_torque_that_it_is_asked_for():
    """Not the file's own, which may be out of reach."""
    done = command("limit", RATED, "--set", "reference.tau_Nm=1000", "--tau", "20", "--json")
    assert done.code == 0, done.error
    assert "out of reach" in refused("limit", RATED, "--set", "reference.tau_Nm=1000")
    assert "need at most" in refused("limit", RATED, "--tau", "1000")


def test_a_law_without_reference_has_no_torque_error():
    drive = rl.load(resources("examples") / "single_pulse.toml")
    k = rl.simulate(drive, until=0.02, record=None).kpis
    assert k.torque_error_rms is None and k.tau_ref_mean is None


def test_a_reference_of_the_wrong_kind_is_named():
    line = refused("run", RATED, "--set", "reference.speed_rpm=100")
    assert "[reference] kind = 'torque' takes tau_Nm; remove speed_rpm" in line


class Loop:
    """The state of a run, as the core tells it."""

    def __init__(self, i=10.0, omega_m=100.0, u_dc=240.0, steps=1e3):
        self.now, self.steps = ([i, 0.0, 0.0], omega_m, 1.0, u_dc), steps

    def state(self):
        return self.now


def bounds(end=1.0, record=None):
    return Bounds(rl.load(RATED), end, record)


def test_a_run_may_come_up_to_its_bounds_and_not_beyond():
    """Ten times the voltage of the source; the speed and current of `plausible`."""
    of = bounds()
    speed = MOST_SPEED * corner_speed(rl.load(RATED).machine, 240.0)
    assert of.omega_m == pytest.approx(speed)
    for name, most, told in (
        ("omega_m", speed, "the speed is"),
        ("i", MOST_CURRENT * 150, "a phase current is"),
        ("u_dc", 2400.0, "the dc link is at"),
    ):
        of.check(Loop(**{name: 0.999 * most}), 0.5, 0)
        with pytest.raises(ParameterError, match=f"{told} .* after 0.5 s"):
            of.check(Loop(**{name: 1.001 * most}), 0.5, 0)
    of.check(Loop(omega_m=-0.999 * speed), 0.5, 0)
    with pytest.raises(ParameterError, match="the speed is"):
        of.check(Loop(omega_m=-1.001 * speed), 0.5, 0)
    for value in (np.nan, np.inf):
        with pytest.raises(ParameterError, match="no finite numbers after"):
            of.check(Loop(i=value), 0.5, 0)


def test_the_pace_of_a_run_is_judged_after_300_000_steps():
    """A billion steps at most: 3e5 in 0.25 ms of 1 s are 1.2e9."""
    of = bounds()
    of.check(Loop(steps=3e5), 0.25e-3, 0)
    of.check(Loop(steps=1e9 / 2048), 1 / 2048, 0)  # a billion, and no more
    of.check(Loop(steps=3.1e5), 0.32e-3, 0)
    with pytest.raises(ParameterError, match="the current switches too often"):
        of.check(Loop(steps=3.1e5), 0.30e-3, 0)


def test_rows_are_those_of_the_record_or_one_and_a_half_a_step():
    drive = rl.load(RATED)  # 20 us, both of the control and of the integration
    assert waveform_rows(drive, 0.2, None) == 0
    assert waveform_rows(drive, 0.2, 1e-4) == pytest.approx(2000)
    assert waveform_rows(drive, 0.2, 0.0) == pytest.approx(1.5 * 0.2 / 20e-6)
    finer = drive.with_values({"simulation.dt_max_us": 5.0})
    assert waveform_rows(finer, 0.2, 0.0) == pytest.approx(1.5 * 0.2 / 5e-6)
    columns = 6 + 6 * 3  # t, theta, omega, tau, its reference, u_dc; six of each phase
    assert waveform_bytes(drive, 0.2, 1e-4) == pytest.approx(8 * columns * 2000)


def test_waveforms_of_more_than_two_gigabytes_are_refused_with_a_grid_that_serves():
    of = bounds()
    assert of.row_bytes == 8 * (6 + 6 * 3)
    most = MOST_BYTES / of.row_bytes
    of.check(Loop(), 0.5, int(0.99 * most))
    with pytest.raises(ParameterError, match="waveforms of 1 s take about 4 GB"):  # at this pace
        of.check(Loop(), 0.5, int(1.01 * most))
    with pytest.raises(ParameterError) as fault:
        Bounds(rl.load(RATED), 300.0, 0.0)
    grid = float(str(fault.value).partition("--record-us ")[2].split()[0])
    assert 300.0 / (grid * 1e-6) * of.row_bytes < 0.6 * MOST_BYTES  # half of it
    Bounds(rl.load(RATED), 300.0, grid * 1e-6)


def test_an_iron_loss_needs_the_memory_of_every_point_whatever_is_kept():
    drive = rl.load(RATED.with_name("five_phases_losses.toml"))
    every = waveform_rows(drive, 0.1, 0.0)
    for record in (None, 1e-3):
        assert Bounds(drive, 0.1, record).rows == every > waveform_rows(drive, 0.1, record)
    most = MOST_BYTES / waveform_bytes(drive, 1.0, 0.0)  # [s]
    Bounds(drive, 0.99 * most, 1e-3)
    with pytest.raises(ParameterError, match="the iron loss needs every point: run shorter"):
        Bounds(drive, 1.01 * most, 1e-3)


def test_the_waveforms_that_a_run_keeps_are_counted(monkeypatch):
    """From none on: what is judged last is all but the row of the end."""
    kept = []
    monkeypatch.setattr(Bounds, "check", lambda self, loop, t, rows: kept.append(rows))
    result = rl.simulate(rl.load(RATED), until=2e-3, record=1e-5)
    assert kept[-1] == len(result.t) - 1 == 200
