"""Profiles that laws follow: for which torques and speeds they are made, when, and what they weigh.

Tables of profiles are made up here, so that what a law makes of them is known."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import reluctance as rl
from reluctance import _core
from reluctance.drive.laws import hand_over
from reluctance.drive.laws.flux_guide import FluxGuide, no_guide, packed, resistive_drop
from reluctance.drive.laws.guided import with_room
from reluctance.drive.laws.short_voltage import NEVER, short_from
from reluctance.drive.tables.known import Known
from reluctance.machine.operating_point import OperatingPoint
from reluctance.machine.optimum import Table
from reluctance.targets.export.package import described
from reluctance.targets.studio.controls import parameters

RATED = Path(__file__).parents[2] / "examples" / "paper_rated.toml"
MACHINE = _core.LeHuy(N_r=4, L_u=0.67e-3, L_a=23.62e-3, L_sat=0.15e-3, i_m=450.0, psi_m=0.468)
POINT = OperatingPoint(MACHINE, n_phases=3, R=0.0, i_max=200.0, u_dc=240.0, omega_m=100.0)
TAU = 41.339  # of the example [N m]


def control(law: str, *given: str) -> Any:
    return rl.load(RATED, [f"control.law={law}", *given]).control


@cache
def known() -> Known:
    return rl.load(RATED).known()


@cache
def numbers(*given: str) -> dict[str, float]:
    """Of the law of the example with these keys."""
    return parameters(rl.load(RATED, list(given)), of_control=True)


def number(name: str, *given: str) -> float:
    return numbers(*given)[f"control.law.{name}"]


def made_table(
    omega_m: float = 100.0, *, error: float = 0.0, i_rms: float = 50.0, u_dc: float = 240.0
) -> Table:
    """Flux linkage that rises over a quarter of a period, at 10 N m by 0.2 Wb, and falls so."""
    n = 100
    theta_e = 2 * np.pi * np.arange(n) / n
    top = np.minimum(np.arange(n), 50 - np.arange(n)).clip(0) / 25
    levels = np.array([0.0, 5.0, 10.0])
    on = (np.arange(n) < 50) * 1.0
    return Table(
        tau_ref=levels,
        theta_e=theta_e,
        i=levels[:, None] * 10 * on,
        psi=levels[:, None] / 10 * 0.2 * top,
        tau_error_max=levels * error,
        tau_error_rms=levels * error,
        i_rms=levels / 10 * i_rms,
        omega_m=omega_m,
        u_dc=u_dc,
    )


def test_what_is_made_has_room_above_the_torque_where_it_can_be_made() -> None:
    asked: list[float] = []

    def make(of: Known) -> float:
        asked.append(of.tau_max)
        if of.tau_max > 50:
            raise RuntimeError("no profile")
        return of.tau_max

    assert with_room(known(), make) == pytest.approx(1.1 * TAU)
    assert with_room(known(), make, 1.2) == pytest.approx(1.2 * TAU)
    assert with_room(known(), make, 1.4) == TAU
    assert asked == pytest.approx([1.1 * TAU, 1.2 * TAU, 1.4 * TAU, TAU])


@pytest.mark.parametrize("law", ["edge_mpc", "torque_sharing"])
@pytest.mark.parametrize("least", [1.05, 1.1, 1.4])
def test_with_pairs_a_level_of_the_guide_lies_at_the_greatest_reference(
    law: str, least: float
) -> None:
    """Levels are evenly spaced in the root of the torque; the room is the least that does."""
    law = control(law)
    assert law.room(known(), least) == least
    last = law.guide_levels - 1
    levels = last / np.sqrt(law.room(replace(known(), pairs=object()), least))
    assert levels == pytest.approx(round(levels))
    assert (last / round(levels)) ** 2 >= least > (last / (round(levels) + 1)) ** 2


@pytest.mark.parametrize(
    ("motors", "brakes", "serves"),
    [
        ({}, {}, True),
        ({"error": 0.9e-3}, {}, True),
        ({"error": 1.1e-3}, {}, False),  # more than a thousandth is ripple
        ({"i_rms": 57.0}, {}, True),
        ({"i_rms": 58.0}, {}, False),  # 15 % more current
        ({"error": 1.0}, {"error": 1.0}, False),
    ],
)
def test_profiles_of_motoring_serve_for_braking_unless_they_ripple_or_take_more_current(
    monkeypatch: pytest.MonkeyPatch,
    motors: dict[str, float],
    brakes: dict[str, float],
    serves: bool,
) -> None:
    law = control("edge_mpc")
    those = {1: [made_table(**motors)], -1: [made_table(**brakes)]}
    monkeypatch.setattr(type(law), "made", lambda self, known, sense, n: those[sense])
    braking = replace(known(), brakes=True, tau_max=10.0, tau_working=10.0)
    assert law.tables(braking) is those[1 if serves else -1]
    assert law.tables(replace(braking, brakes=False)) is those[1]


def test_where_motoring_has_no_profile_braking_has_its_own(monkeypatch: pytest.MonkeyPatch) -> None:
    law, own = control("edge_mpc"), [made_table()]

    def made(_: object, known: Known, sense: int, n_points: int) -> list[Table]:
        if sense > 0:
            raise RuntimeError("no profile")
        return own

    monkeypatch.setattr(type(law), "made", made)
    assert law.tables(replace(known(), brakes=True)) is own
    with pytest.raises(RuntimeError):
        law.tables(known())


def test_a_law_that_hands_over_mirrors_the_profiles_of_the_direction_it_works_in(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    law = control("torque_sharing")
    monkeypatch.setattr(type(law), "made", lambda self, known, sense, n: (sense, n))
    assert law.tables(known()) == (1, 180)
    assert law.tables(replace(known(), brakes=True), 90) == (-1, 90)


def test_profiles_are_of_the_working_speed_or_of_those_that_are_given() -> None:
    given = control("edge_mpc", "control.guide_speed_rpm=[0, 1500, 3000]")
    assert given.guide_speeds(known()) == pytest.approx([0, 50 * np.pi, 100 * np.pi])
    usual, learns = control("edge_mpc"), control("edge_mpc", "control.learn=true")
    assert usual.guide_speeds(known()) == [known().omega_m]
    assert learns.guide_speeds(known()) == pytest.approx([known().omega_m, 1.2 * known().omega_m])
    assert learns.guide_speeds(replace(known(), omega_m=0.0)) == [0]
    one = control("edge_mpc", "control.guide_speed_rpm=1500")
    assert one.guide_speed_rpm == [1500] and usual.guide_speed_rpm is None


def test_made_profiles_have_the_torques_the_points_and_the_sense_that_are_asked_for() -> None:
    law = control("deadbeat", "control.guide_speed_rpm=[600]")
    (table,) = law.made(replace(known(), tau_max=10.0), -1, 60)
    assert table.omega_m == pytest.approx(-20 * np.pi) and table.u_dc == 240
    assert table.i.shape == (11, 60)
    assert table.tau_ref == pytest.approx(10 * (np.arange(11) / 10) ** 2)


BOUNDARY = 2.0  # omega_e/u_dc [rad/Wb]


def beyond(part: float, **of: object) -> tuple[list[float], Any]:
    """The room of the profiles that a law asks for at a part of its boundary, and what it is made
    with; no profile is found."""
    asked: list[float] = []

    def none_is_found(of: Known, make: Callable[[Known], Any], more: float) -> Any:
        asked.append(more)
        raise RuntimeError("no optimum")

    omega_m = part * BOUNDARY * known().u_dc / known().N_r
    law = control("torque_sharing")
    reach = np.full(hand_over.TORQUES, BOUNDARY), np.full(hand_over.TORQUES, BOUNDARY / 2)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(hand_over, "with_room", none_is_found)
        patch.setattr(type(law), "boundary", lambda self, known: reach)
        made = law.hand_over(replace(known(), omega_m=omega_m, **of), "i")
    return asked, made


MOTORS, BRAKES, EITHER = (
    {"motors": m, "brakes": b} for m, b in ((True, False), (False, True), (False, False))
)


@pytest.mark.parametrize(
    ("part", "direction", "asks"),
    [
        (0.79, MOTORS, False),
        (0.81, MOTORS, True),  # at 80 % of the voltage it may work beyond
        (0.99, MOTORS, True),
        (0.39, BRAKES, False),
        (0.41, BRAKES, True),
        (0.39, EITHER, False),
        (0.41, EITHER, True),
    ],
)
def test_profiles_are_asked_for_from_80_percent_of_the_boundary_of_the_direction(
    part: float, direction: dict[str, bool], asks: bool
) -> None:
    asked, made = beyond(part, **direction)
    assert asked == ([1.4] if asks else [])
    assert made["guide"].at(TAU, 1.0, omega_m=100.0, u_dc=240.0) == 0


def test_without_a_profile_a_drive_beyond_the_boundary_is_refused() -> None:
    for part, direction in ((1.01, MOTORS), (0.51, BRAKES), (0.51, EITHER)):
        rpm = part * BOUNDARY * known().u_dc / known().N_r * 30 / np.pi
        told = rf"more than the 240 V of the dc link at {rpm:.5g} rpm and 41\.339 N m.*no optimum"
        with pytest.raises(rl.ParameterError, match=told):
            beyond(part, **direction)


@pytest.mark.parametrize(("part", "R"), [(0.5, 0.1), (0.9, 0.1), (0.9, 3.0), (1.03, 3.0)])
def test_profiles_whose_current_the_voltage_does_not_drive_are_left_out_within_the_boundary(
    monkeypatch: pytest.MonkeyPatch, part: float, R: float
) -> None:
    """100 A take 300 V of 3 ohm. Beyond the boundary there is nothing else to follow."""
    law, omega_m = control("torque_sharing"), part * BOUNDARY * known().u_dc / known().N_r
    reach = (np.full(hand_over.TORQUES, BOUNDARY),) * 2
    monkeypatch.setattr(type(law), "boundary", lambda self, known: reach)
    monkeypatch.setattr(type(law), "tables", lambda self, known: [made_table(omega_m)])
    machine = known().machine.model_copy(update={"R_ohm": R})
    of = replace(known(), omega_m=omega_m, machine=machine, motors=True)
    if part > 1:
        with pytest.raises(rl.ParameterError, match="drops 300 V at the greatest current"):
            law.hand_over(of, "i")
        return
    made = law.hand_over(of, "i")["guide"].at(10.0, 1.0, omega_m=omega_m, u_dc=240.0)
    follows = part > 0.8 and R < 1
    assert made == pytest.approx(100.0 if follows else 0.0)


def test_voltage_is_short_from_where_three_tenths_of_the_period_take_all_of_it() -> None:
    """Half of the period has flanks; above this speed they take 98 % of the voltage."""
    full = 0.98 * 240 / (0.2 / (np.pi / 2) * 4)
    below, above = made_table(0.9 * full), made_table(1.1 * full)
    of: Any = SimpleNamespace(at=lambda omega_m: POINT, tau_working=10.0, u_dc=240.0)
    assert short_from([below], of) == NEVER
    between = 0.9 * full + 0.2 * full * 0.3 / 0.48  # where a line between them is at 0.3
    for tables in ([below, above], [below, above, made_table(9 * full)]):
        assert short_from(tables, of) == pytest.approx(between / 240, rel=5e-3)
    assert short_from([above], of) == pytest.approx(1.1 * full * 0.3 / 0.48 / 240, rel=5e-3)
    backwards = replace(above, omega_m=-1.1 * full)
    assert short_from([backwards], of) == short_from([above], of)


@pytest.mark.parametrize(("short", "room"), [(False, 1.0), (True, 1.4)])
def test_predictive_currents_have_more_torque_where_the_voltage_is_short(
    monkeypatch: pytest.MonkeyPatch, short: bool, room: float
) -> None:
    law = control("paper_mpc")
    asked = []

    def made(_: object, of: Known, sense: int, n_points: int) -> list[Table]:
        asked.append((of.tau_max, n_points))
        return [made_table(1000.0 if short else 100.0)]

    monkeypatch.setattr(type(law), "made", made)
    law.tables(replace(known(), tau_working=10.0), 90)
    assert asked[-1] == (pytest.approx(room * TAU), 90)
    assert len(asked) == (2 if short else 1)


def test_guide_of_nothing_is_zero_for_every_torque_angle_and_speed() -> None:
    nothing = no_guide(5.0)
    for tau, theta_e, omega_m in ((0, 0, 0), (5, 1, 100), (-3, 4, -100)):
        assert nothing.at(tau, theta_e, omega_m=omega_m, u_dc=240.0) == 0


@pytest.mark.parametrize(("part", "idle"), [(0.9e-4, True), (1.1e-4, False)])
def test_a_current_below_a_ten_thousandth_of_the_greatest_is_none(part: float, idle: bool) -> None:
    """And the flux linkage of the phase is none with it."""
    table = made_table()
    rest = np.where(table.i > 0, table.i, part * table.i.max())
    table = replace(table, i=rest, psi=table.psi + 1e-3)
    theta_e = 1.5 * np.pi
    i, psi = (packed([table], quantity, POINT) for quantity in ("i", "psi"))
    found = [of.at(10.0, theta_e, omega_m=100.0, u_dc=240.0) for of in (i, psi)]
    assert found == pytest.approx([0, 0] if idle else [part * 100, 1e-3], abs=1e-12)
    assert i.at(10.0, 0.1, omega_m=100.0, u_dc=240.0) == pytest.approx(100)
    assert psi.at(10.0, np.pi / 2, omega_m=100.0, u_dc=240.0) == pytest.approx(0.201)


def test_the_resistance_drops_its_voltage_at_the_greatest_current_of_the_lowest_speed() -> None:
    low, high = made_table(100.0), made_table(200.0)
    low = replace(low, i=low.i / low.i.max() * 80)
    assert resistive_drop([low, high], 0.25) == pytest.approx(0.25 * 80)
    packed([low], "i", replace(POINT, R=0.99 * 240 / 80))
    with pytest.raises(rl.ParameterError, match="drops 240 V at the greatest current"):
        packed([low], "i", replace(POINT, R=240 / 80))


def test_powers_of_the_weight_are_those_that_it_grows_with(monkeypatch: pytest.MonkeyPatch) -> None:
    guide = FluxGuide((made_table(),), POINT, tau_ref=10.0, f_switch=1e4)
    monkeypatch.setattr(FluxGuide, "_weight", lambda self, tau, u: 3 * tau**1.7 * u**-0.4)
    assert guide.w_sw == 3 and guide.w_sw_powers == pytest.approx((1.7, -0.4))
    monkeypatch.setattr(FluxGuide, "_weight", lambda self, tau, u: 0.0 if tau < 1 else 1.0)
    assert guide.w_sw_powers == (0, 0)  # nothing switches


def test_a_guide_that_hardly_ends_is_followed_closer_when_motoring() -> None:
    law = control("finite_set_mpc")
    guide: Any = SimpleNamespace(w_psi=[10.0, 20.0, 30.0], conducts=[0.5, 0.9, 0.91])
    assert law.w_psi(guide, known()) == [10, 20, 4 * 30]
    assert law.w_psi(guide, replace(known(), brakes=True)) == [10, 20, 30]


def test_the_last_sample_weighs_by_the_pulses_that_are_wanted() -> None:
    """Its time goes as the square of a pulse, over the samples of the horizon."""
    of = "finite_set_mpc"
    base = number("t_end", f"control.law={of}")
    for given, factor in (
        ("control.f_switch_kHz=8", 4.0),
        ("control.horizon=2", 0.5),
        ("control.T_s_us=10", 2.0),
    ):
        assert number("t_end", f"control.law={of}", given) == pytest.approx(factor * base)


def test_without_its_guide_a_finite_set_follows_none() -> None:
    given = ("control.law=finite_set_mpc", "control.guided=false")
    assert number("w_psi_0", *given) == number("feedback_0", *given) == 0
    assert number("guide.first.level_max", *given) == pytest.approx(TAU)
    assert number("guide.omega_0", *given) == 0
    assert number("w_psi_0", "control.law=finite_set_mpc") > 0
    assert number("w_sw", *given) == number("w_sw", "control.law=finite_set_mpc") > 0


@pytest.mark.parametrize(
    ("given", "room"),
    [
        (["control.law=edge_mpc"], 1.1),
        (["control.law=edge_mpc", "control.guide=least_ripple", "control.f_switch_kHz=10"], 1.0),
        (["control.law=finite_set_mpc"], 1.0),
        (["control.law=paper_mpc"], 1.0),
    ],
)
def test_guides_reach_as_far_above_the_reference_as_feedback_may_ask(
    given: list[str], room: float
) -> None:
    assert number("guide.first.level_max", *given) == pytest.approx(room * TAU)


def test_least_ripple_asks_for_deviations_itself_and_leaves_less_to_the_law() -> None:
    """Four fifths of the flux linkage of a switching period, at 240 V and 10 kHz."""
    given = ("control.law=edge_mpc", "control.f_switch_kHz=10", "control.guide=least_ripple")
    plain = number("psi_slack_0", *given[:2])
    assert plain <= 240 / 10e3
    slack = number("psi_slack_0", *given)
    assert slack <= 0.8 * 240 / 10e3 and slack != pytest.approx(plain)


def test_what_a_law_learns_from_is_told_by_its_sensors_and_its_machine() -> None:
    """A step of the converter and four times the rms noise are no current."""
    given = ("adc_bits=10", "i_range_A=400", "i_noise_LSB=0.2")
    learns = ["control.law=deadbeat", "control.learn=true"]
    drive = rl.load(RATED, [*learns, *(f"sensing.{key}" for key in given)])
    machine, step = drive.machine, drive.known().i_step
    assert step == pytest.approx(400 / 2**10, rel=2e-3)
    found = leaves(described(drive)["control"]["fields"])
    assert found["L_u"] == pytest.approx(machine.psi(1e-6, 0.0) / 1e-6)
    assert found["psi_least"] == pytest.approx(0.05 * machine.psi(machine.i_max_A, np.pi))
    assert found["i_missing"] == pytest.approx(step / 2)
    assert found["i_least"] == pytest.approx(step + 4 * 0.2 * step)
    ideal = leaves(described(rl.load(RATED, learns))["control"]["fields"])
    assert ideal["i_least"] == pytest.approx(1e-4 * machine.i_max_A)


def leaves(fields: dict[str, Any]) -> dict[str, float]:
    """Numbers of the fit by their names, however deep they lie."""
    found: dict[str, float] = {}
    for name, value in fields.items():
        if isinstance(value, dict) and "fields" in value:
            found |= leaves(value["fields"])
        elif isinstance(value, dict) and len(value.get("values", [])) == 1:
            found[name] = value["values"][0]
        elif isinstance(value, float | int):
            found[name] = value
    return found
