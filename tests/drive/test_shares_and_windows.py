"""Shares of the torque and the window of DITC: angles by rule, the flux linkage that they take, and
where the voltage suffices for them."""

from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import reluctance as rl
from reluctance import _core
from reluctance.drive.laws.ditc_reach import Alone
from reluctance.drive.laws.shared_torque import feasible_shares
from reluctance.drive.tables.known import Known
from reluctance.targets.studio.controls import parameters

RATED = Path(__file__).parents[2] / "examples" / "paper_rated.toml"
DEG = np.pi / 180
TAU = 41.339  # of the example [N m]


def load(law: str, *given: str) -> rl.Drive:
    return rl.load(RATED, [f"control.law={law}", *given])


@cache
def known(**changed: float) -> Known:
    """The example, with a part of its machine or drive changed."""
    of = load("deadbeat").known()
    machine = {key: value for key, value in changed.items() if key in ("R_ohm", "i_max_A")}
    rest: Any = {key: value for key, value in changed.items() if key not in machine}
    return replace(of, machine=of.machine.model_copy(update=machine), **rest)


def law(name: str, *given: str) -> dict[str, float]:
    """Numbers of the law."""
    start = "control.law."
    found = parameters(load(name, *given), of_control=True)
    return {key.removeprefix(start): v for key, v in found.items() if key.startswith(start)}


def shape(on_deg: float, ov_deg: float, name: str = "cubic") -> _core.Sharing:
    of = getattr(_core.Shape, name)
    return _core.Sharing(shape=of, theta_on=on_deg * DEG, theta_ov=ov_deg * DEG, table=[0.0] * 33)


def test_shares_by_rule_overlap_in_two_thirds_of_the_free_angle() -> None:
    """And in all of it where a phase cannot give its share: docs/drive_file.md."""
    found = law("deadbeat")
    assert found["sharing.theta_on"] == pytest.approx(60 / 6 * DEG)
    assert found["sharing.theta_ov"] == pytest.approx(60 * 2 / 3 * DEG)
    control: Any = load("deadbeat").control
    for i_max, part in ((150.0, 2 / 3), (66.0, 1.0)):
        by_rule = control.shares(known(i_max_A=i_max))
        half = by_rule.share(3, 30 * DEG)
        whole = by_rule.share(3, (30 + 30 * part) * DEG)
        assert half == pytest.approx(0.5) and whole == pytest.approx(1)
        assert by_rule.share(3, (30 + 30 * part - 3) * DEG) < 1
        assert by_rule.share(3, (30 - 30 * part + 3) * DEG) > 0
        assert by_rule.share(3, (30 - 30 * part) * DEG) == pytest.approx(0, abs=1e-12)


def test_own_angles_of_a_share_are_radians() -> None:
    found = law("deadbeat", "control.theta_on_deg=5", "control.theta_ov_deg=50")
    assert found["sharing.theta_on"] == pytest.approx(5 * DEG)
    assert found["sharing.theta_ov"] == pytest.approx(50 * DEG)


@pytest.mark.parametrize(
    ("given", "told"),
    [
        (["theta_on_deg=10", "theta_ov_deg=50"], None),
        (["theta_on_deg=10", "theta_ov_deg=50.1"], "together at most 60"),
        (["theta_ov_deg=50"], "needs both theta_on_deg and theta_ov_deg"),
        (["sharing=optimal", "theta_on_deg=5", "theta_ov_deg=50"], "finds its angles itself"),
        (["sharing=table", f"share_table={[0.0] * 31 + [0.5, 1.0]}"], None),
        (["sharing=table", f"share_table={[0.0] * 31 + [1.0]}"], "need 33 shares"),
        (["sharing=table", f"share_table={[0.0] * 32 + [1.0, 1.0]}"], "need 33 shares"),
        (["sharing=table", f"share_table={[0.1] * 32 + [1.0]}"], "the first 0"),
        (["sharing=table", f"share_table={[0.0] * 32 + [0.9]}"], "the last 1"),
    ],
)
def test_angles_and_table_of_a_share_are_checked(given: list[str], told: str | None) -> None:
    keys = [f"control.{text}" for text in given]
    if told is None:
        load("deadbeat", *keys)
    else:
        with pytest.raises(rl.ParameterError, match=told):
            load("deadbeat", *keys)


def reach(of: Known, sharing: _core.Sharing, *, motors: bool = True) -> np.ndarray:
    ends = (0, np.pi) if motors else (np.pi, 0)
    return feasible_shares(of, sharing, np.linspace(*ends, 361))


def lost(of: Known, sharing: _core.Sharing, tau: float, reach: float) -> float:
    """Part of the mean torque that is missing where the flux linkage of a phase follows its share
    step by step, as fast as the voltage lets it."""
    theta = np.linspace(0, np.pi, 3601)
    i = np.linspace(0, of.i_max, 401)
    psi, given, asked, before = 0.0, 0.0, 0.0, 0.0
    for angle in theta[1:]:
        share = sharing.share(3, float(angle))
        at = _core.magnetics(of.magnetics, i, np.full(i.size, angle))
        i_ref, goal = (np.interp(share * tau, at[:, 2], of_i) for of_i in (i, at[:, 0]))
        left = 1 - of.R * (i_ref + before) / 2 / of.u_dc
        psi, before = min(goal, psi + left * (theta[1] - theta[0]) / reach), i_ref
        asked += share * tau
        given += float(np.interp(psi, at[:, 0], at[:, 2])) if share > 0 else 0.0
    return 1 - given / asked


@pytest.mark.parametrize(("R", "tau"), [(1e-9, 5.0), (0.72, TAU)])
def test_shares_are_feasible_up_to_where_half_a_percent_of_the_mean_torque_is_lost(
    R: float, tau: float
) -> None:
    """Speeds are tried in steps of 5 %, on grids of angle and current that are coarser."""
    of, sharing = known(R_ohm=R, tau_max=tau), shape(10, 40)
    found = reach(of, sharing)[-1]
    assert lost(of, sharing, tau, found) < 0.0051
    assert lost(of, sharing, tau, 1.05 * found) > 0.005


def test_less_torque_more_overlap_and_less_resistance_need_less_voltage() -> None:
    narrow, wide = (reach(known(), shape((60 - ov) / 2, ov)) for ov in (20, 50))
    for found in (narrow, wide):
        assert found.shape == (9,) and found[0] == found[1]
        assert (np.diff(found[1:]) < 0).all()
    assert (wide[1:] > narrow[1:]).all()
    assert (reach(known(R_ohm=0.1), shape(5, 50))[1:] > wide[1:]).all()


def test_torque_that_the_current_limit_does_not_give_has_no_speed() -> None:
    """Eighths of twice what a phase gives at 30 A at the worst angle of its whole share."""
    of, theta = known(i_max_A=30.0), np.linspace(50, 130, 81) * DEG
    most = _core.magnetics(of.magnetics, np.full(81, 30.0), theta)[:, 2].min()
    found = reach(replace(of, tau_max=2 * most), shape(10, 40))
    assert (found[:4] > 0).all() and (found[5:] == 0).all()


def test_boundary_of_own_angles_is_kept_when_braking_only() -> None:
    for given, kept in (
        ((), True),
        (("control.theta_on_deg=10", "control.theta_ov_deg=40"), False),
    ):
        control: Any = load("deadbeat", *given).control
        motoring, braking = control.boundary(known())
        assert braking == pytest.approx(reach(known(), control.shares(known()), motors=False))
        if kept:
            assert motoring == pytest.approx(reach(known(), control.shares(known())))
        else:
            assert (motoring == 1e9).all()


@pytest.mark.parametrize("sense", [1, -1])
def test_a_phase_alone_knows_the_flux_linkage_of_each_torque_and_back(sense: int) -> None:
    """Motoring before alignment, braking behind it, a stroke before turn-off."""
    off = (150 if sense > 0 else 335) * DEG
    alone = Alone(known(), off, sense)
    assert alone.stroke == pytest.approx(120 * DEG)
    assert alone.angles.size == 3 * 60 and alone.angles[0] == pytest.approx(off - 240 * DEG)
    assert np.diff(alone.angles) == pytest.approx(2 * DEG)
    assert alone.torques == pytest.approx(TAU * np.arange(9) / 8)
    for n in (60, 75, 90):
        tau = alone.torques[1:4]
        psi = alone.flux(n, tau)
        assert alone.torque(n, psi) == pytest.approx(tau, rel=1e-3)
        i = np.linspace(0, 150, 30001)
        at = _core.magnetics(known().magnetics, i, np.full(i.size, alone.angles[n]))
        assert psi == pytest.approx(np.interp(tau, sense * at[:, 2], at[:, 0]), rel=2e-3)


def test_flux_linkage_that_voltage_has_to_build_has_what_the_resistance_takes() -> None:
    """The mean current of the rise is half of the last one; half of the voltage is left at least"""
    free, usual, high = (Alone(known(R_ohm=R), 150 * DEG, 1) for R in (1e-9, 0.72, 50.0))
    needed, left = free.taken_over
    assert left == pytest.approx(1) and free.psi == pytest.approx(needed)
    psi, left = usual.taken_over
    assert psi == pytest.approx(needed)
    machine = known().machine
    i = np.linspace(0, 150, 30001)
    currents = np.interp(psi, machine.psi(i, 30 * DEG), i)
    assert left == pytest.approx(1 - 0.72 * currents / 2 / 240, rel=1e-3)
    assert usual.psi == pytest.approx(psi / left)
    assert high.taken_over[1].min() == 0.5 and high.taken_over[1][0] == 1


@pytest.mark.parametrize("sense", [1, -1])
def test_the_window_reaches_further_for_less_torque_and_more_that_may_be_missing(
    sense: int,
) -> None:
    """None at a torque beyond the current limit; without resistance the voltage is only a scale."""
    off = (150 if sense > 0 else 335) * DEG
    alone = Alone(known(tau_max=20.0), off, sense)
    tight, loose = alone.reach(0.01), alone.reach(0.1)
    assert tight[0] == tight[1] and (tight[2:] < 1.05 * tight[1:-1]).all()  # in steps of 5 %
    assert (loose >= tight).all() and (sense < 0 or loose[-1] > tight[-1])
    assert Alone(known(tau_max=2000.0), off, sense).reach(0.01)[-1] == 0
    once, twice = (Alone(known(R_ohm=1e-9, u_dc=u, tau_max=20.0), off, sense) for u in (240, 480))
    assert once.reach(0.01) == pytest.approx(twice.reach(0.01))


def test_at_its_reach_full_voltage_builds_the_flux_linkage_within_a_stroke() -> None:
    alone = Alone(known(tau_max=20.0), 150 * DEG, 1)
    lead = alone.reach(0.01)[1:] * alone.psi[1:]  # [rad]
    assert (lead > 0).all() and (lead <= 120 * DEG + 1e-9).all()


def test_ditc_is_turned_on_as_long_before_a_stroke_as_the_flux_takes() -> None:
    """The lead is proportional to the speed; the window ends at that of least copper."""
    flux = law("ditc")["turn_on.psi_8"]
    for rpm in (1500, 3000):
        found = law("ditc", f"load.speed_rpm={rpm}")
        lead = found["conduction.theta_off"] - 120 * DEG - found["conduction.theta_on"]
        alone = Alone(known(), found["conduction.theta_off"], 1)
        assert lead == pytest.approx(4 * rpm * np.pi / 30 * alone.psi[-1] / 240)
    assert flux == pytest.approx(Alone(known(), law("ditc")["conduction.theta_off"], 1).psi[-1])


def test_ditc_brakes_until_335_degrees_and_from_as_early_as_the_flux_takes() -> None:
    found, alone = law("ditc"), Alone(known(), 335 * DEG, -1)
    lead = 4 * 1500 * np.pi / 30 * alone.psi[-1] / 240
    assert found["conduction.brake_on"] == pytest.approx((360 - 335) * DEG)
    assert found["conduction.brake_off"] == pytest.approx((360 - 335 + 120) * DEG + lead)
    assert found["turn_on.psi_brake_8"] == pytest.approx(alone.psi[-1])


OWN = ("control.theta_on_deg=-10", "control.theta_off_deg=150")
OWN_BRAKE = ("control.brake_on_deg=190", "control.brake_off_deg=330")


@pytest.mark.parametrize(("given", "by_rule"), [((), True), (OWN, False), (OWN_BRAKE, False)])
def test_angles_of_ditc_follow_torque_and_voltage_where_none_is_given(
    given: tuple[str, ...], by_rule: bool
) -> None:
    control: Any = load("ditc", *given).control
    found = law("ditc", *given)
    assert control.free_angles == by_rule
    assert found["turn_on.tau_max"] == (pytest.approx(TAU) if by_rule else 0)
    motoring, braking = control.boundary(known(tau_max=20.0))
    if by_rule:
        assert 0 < motoring[-1] < 1e9 and 0 < braking[-1] < 1e9
    else:
        assert (motoring == 1e9).all() and (braking == 1e9).all()
    if given == OWN:
        assert found["conduction.theta_on"] == pytest.approx(-10 * DEG)
        assert found["conduction.theta_off"] == pytest.approx(150 * DEG)
    if given == OWN_BRAKE:
        assert found["conduction.brake_on"] == pytest.approx(30 * DEG)
        assert found["conduction.brake_off"] == pytest.approx(170 * DEG)


def test_bands_of_ditc_are_a_hundredth_of_the_torque_and_twice_that() -> None:
    """In the flux linkage that a phase alone takes for the torque, the same part."""
    found = law("ditc")
    assert found["bands.inner"] == pytest.approx(0.01 * TAU)
    assert found["bands.outer"] == pytest.approx(0.02 * TAU)
    assert found["psi_band"] == pytest.approx(0.01 * found["turn_on.psi_8"])
    own = law("ditc", "control.tau_band_Nm=2")
    assert (own["bands.inner"], own["bands.outer"]) == (2, 4)
    assert own["psi_band"] == pytest.approx(2 / TAU * found["turn_on.psi_8"])
    both = law("ditc", "control.tau_band_Nm=2", "control.tau_band_outer_Nm=3")
    assert (both["bands.inner"], both["bands.outer"]) == (2, 3)


@pytest.mark.parametrize(
    ("given", "told"),
    [
        (["tau_band_Nm=2", "tau_band_outer_Nm=2"], None),
        (["tau_band_Nm=2", "tau_band_outer_Nm=1.99"], "tau_band_outer_Nm = 1.99, need >="),
        (["tau_band_outer_Nm=2"], "given as well"),
        (["tau_band_Nm=41.33"], None),
        (["tau_band_Nm=41.339"], "need less than the greatest torque"),
        (["theta_on_deg=0", "theta_off_deg=120"], None),
        (["theta_on_deg=0", "theta_off_deg=119.9"], "theta_on_deg = 119.9, need >= 120"),
    ],
)
def test_bands_and_window_of_ditc_are_checked(given: list[str], told: str | None) -> None:
    keys = [f"control.{text}" for text in given]
    if told is None:
        load("ditc", *keys)
    else:
        with pytest.raises(rl.ParameterError, match=told):
            load("ditc", *keys)


def test_chopping_and_carriers_are_those_that_are_named() -> None:
    soft, hard = (
        law("torque_sharing", f"control.chop={chop}")["chop"] for chop in ("soft", "hard")
    )
    assert law("torque_sharing")["chop"] == soft != hard
    one, other = (
        law("deadbeat", f"control.carriers={of}")["carriers"] for of in ("in_phase", "interleaved")
    )
    assert law("deadbeat")["carriers"] == one != other
    pulses = (*OWN, "control.i_ref_A=60", "reference.kind=none", "reference.tau_Nm=")
    usual = law("angles", *pulses)
    for key, same, others in (
        ("chop", "soft", "hard"),
        ("watch", "compare", "sampled"),
    ):
        assert law("angles", *pulses, f"control.{key}={same}")[key] == usual[key]
        assert law("angles", *pulses, f"control.{key}={others}")[key] != usual[key]
