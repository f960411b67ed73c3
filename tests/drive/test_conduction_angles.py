"""Conduction angles: what may be given, what follows by rule, and where searches place them."""

import re
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
from reluctance.base.errors import Note
from reluctance.drive.laws import LAWS, least_copper, table_of
from reluctance.drive.laws.angle_table import read_angle_table
from reluctance.drive.laws.ditc import overlapping_angles
from reluctance.drive.laws.finite_set_mpc import copper_and_horizon
from reluctance.drive.laws.least_copper import least_copper_angles
from reluctance.drive.laws.paper_mpc import tracking_weights
from reluctance.drive.laws.pulse_current import pulse_angles
from reluctance.drive.laws.pulses import chopped, full_flux_speed, pulses
from reluctance.drive.laws.shared_torque import sharing_angles
from reluctance.drive.tables.known import Known
from reluctance.targets.studio.controls import parameters

RATED = Path(__file__).parents[2] / "examples" / "paper_rated.toml"
DEG = np.pi / 180
FIXED = {"i_ref_A": 60, "i_band_A": 1}  # a current that no torque reference asks for
UNASKED = ["reference.kind=none", "reference.tau_Nm="]


def load(*given: str, law: str = "angles") -> rl.Drive:
    return rl.load(RATED, [f"control.law={law}", *given])


def fixed(**keys: float) -> rl.Drive:
    """A drive with a fixed current, in which no window is searched for."""
    return load(*UNASKED, *(f"control.{key}={value}" for key, value in (FIXED | keys).items()))


def conduction(drive: rl.Drive) -> dict[str, float]:
    start = "control.law.conduction."
    numbers = parameters(drive, of_control=True)
    return {key.removeprefix(start): v for key, v in numbers.items() if key.startswith(start)}


@cache
def known() -> Known:
    return load().known()


def at(part: float, tau_max: float = 41.339) -> Known:
    """At a part of the speed at which the greatest flux linkage takes half a period."""
    return replace(known(), omega_m=part * full_flux_speed(known()), tau_max=tau_max)


def test_tables_are_not_computed_again_where_only_the_limits_of_edges_change() -> None:
    edges = _core.EdgeLimits(t_min=2e-6, t_blank=1e-6, T_s=known().T_s)
    other = replace(known(), edges=edges)
    assert other == known() and hash(other) == hash(known()) and other.edges is edges
    assert replace(known(), omega_m=1.0) != known()


WINDOWS = [  # docs/drive_file.md, and what keeps a turn-off above its turn-on by less than 360
    ("theta_on_deg", {"theta_off_deg": 170}, [-180, 0, 169.9], [-180.1, 170, 180]),
    ("theta_off_deg", {"theta_on_deg": 10}, [10.1, 360], [10, 360.1, 370]),
    ("theta_off_deg", {"theta_on_deg": -180}, [-179.5, 179.9], [-180, 180]),
    ("brake_on_deg", {"brake_off_deg": 300}, [0, 299.9], [-0.1, 300, 360]),
    ("brake_off_deg", {"brake_on_deg": 181}, [181.1, 540], [180, 181, 540.1]),
    ("brake_off_deg", {"brake_on_deg": 0}, [180.1, 359.9], [180, 360]),
    ("start_speed_rpm", {}, [0, 1e4], [-1]),
]


@pytest.mark.parametrize(("key", "beside", "allowed", "refused"), WINDOWS)
def test_angles_are_a_window_of_less_than_a_period_within_their_limits(
    key: str, beside: dict[str, float], allowed: list[float], refused: list[float]
) -> None:
    whole = {"theta_on_deg": 20.0, "theta_off_deg": 150.0} | beside
    for value in allowed:
        assert getattr(fixed(**whole | {key: value}).control, key) == value
    for value in refused:
        with pytest.raises(rl.ParameterError, match=key):
            fixed(**whole | {key: value})


@pytest.mark.parametrize("law", ["angles", "torque_sharing"])
def test_angles_in_radians_are_asked_about_and_the_answer_is_the_window_that_was_meant(
    law: str,
) -> None:
    second = "theta_off_deg" if law == "angles" else "theta_ov_deg"
    draw = np.random.default_rng(331)
    for on, last in zip(draw.uniform(0, 20, 5), draw.uniform(21, 40, 5), strict=True):

        def drive(on: float, last: float) -> rl.Drive:
            return load(f"control.theta_on_deg={on}", f"control.{second}={last}", law=law)

        with pytest.warns(Note, match="if these are radians") as told:
            drive(on * DEG, last * DEG)
        _, _, remedy = str(told[0].message).partition(" set ")
        meant = [float(number) for number in re.findall(r"_deg = ([\d.]+)", remedy)]
        assert meant == pytest.approx([on, last], rel=1e-3)
        drive(*meant)  # is not asked about


def test_a_control_period_in_milliseconds_is_asked_about() -> None:
    for T_s_us in (1, 20, 100):
        with pytest.warns(Note, match=f"if these are milliseconds, set {T_s_us}$"):
            load(f"control.T_s_us={T_s_us / 1000}", "simulation.until_s=0.001")
    for T_s_us in (0.00099, 0.11):
        load(f"control.T_s_us={T_s_us}", "simulation.until_s=0.0001")


def test_own_angles_are_radians_and_braking_is_seen_in_the_frame_of_positive_torque() -> None:
    """Passed backwards, the window of braking begins where it ends, a turn less."""
    own = {"theta_on_deg": -10, "theta_off_deg": 150, "brake_on_deg": 190, "brake_off_deg": 330}
    found = conduction(fixed(**own, start_speed_rpm=300))
    assert found["theta_on"] == pytest.approx(-10 * DEG)
    assert found["theta_off"] == pytest.approx(150 * DEG)
    assert found["brake_on"] == pytest.approx((360 - 330) * DEG)
    assert found["brake_off"] == pytest.approx((360 - 190) * DEG)
    assert found["omega_start"] == pytest.approx(10 * np.pi)


def test_fixed_current_brakes_half_a_period_later_than_it_motors() -> None:
    found = conduction(fixed(theta_on_deg=-10, theta_off_deg=150))
    assert found["brake_on"] == pytest.approx((360 - (150 + 180)) * DEG)
    assert found["brake_off"] == pytest.approx((360 - (-10 + 180)) * DEG)


def test_at_standstill_windows_are_those_of_a_speed_at_which_the_flux_rises_within_4_deg() -> None:
    """Below it a period takes ever longer, and its pulses stay the same."""
    control: Any = load().control
    still, slow = (control.offline(at(part)) for part in (0.0, 0.01))
    assert still == slow and still.omega_m > 0
    psi = _core.magnetics(known().magnetics, np.array([known().i_max]), np.array([np.pi]))[0, 0]
    takes = psi / known().u_dc * known().N_r * still.omega_m / DEG
    assert takes == pytest.approx(0.02 * 180)  # of half a period
    assert control.offline(at(0.5)) == at(0.5)


def test_window_of_least_copper_is_turned_on_earlier_the_faster_the_motor_turns() -> None:
    """A seventh of the speed of full flux and below, windows are the same."""
    low, same, fast = (least_copper_angles(at(part), 41.339) for part in (0.01, 0.14, 0.6))
    assert low == same
    assert fast[0] < low[0]
    for on, off in (low, fast):
        steps = np.array([on, off]) / DEG / 5
        assert steps == pytest.approx(np.round(steps))
        assert 120 <= (off - on) / DEG <= 180 + 1e-9  # every angle is covered


def greatest(window: tuple[float, float], of: Known) -> float:
    """The mean torque of the current limit."""
    law = chopped(of, 0.02 * of.i_max, brakes=False, hard=False)
    return float(pulses(law, *window, of.i_max).tau)


def test_torque_that_no_window_gives_gets_the_one_of_the_greatest_torque() -> None:
    """And a window has room above the torque that it is made for."""
    of = at(0.5)
    most = least_copper_angles(of, 1e6)
    steps = np.array(most) / DEG / 5
    assert steps == pytest.approx(np.round(steps)) and most[1] - most[0] > np.pi
    top = greatest(most, of)
    for on, off in ((5, 0), (-5, 0), (0, 5), (0, -5)):
        assert greatest((most[0] + on * DEG, most[1] + off * DEG), of) < 1.005 * top
    for room in (1.1, 1.5):
        window = least_copper_angles(of, 0.6 * top, room)
        assert greatest(window, of) > 0.98 * room * 0.6 * top


@pytest.mark.parametrize(
    ("tau", "room", "chosen", "has_room"),
    [
        (1.0, 1.0, 0, True),  # less than the least that was tried: the least current there
        (5.0, 1.0, 0, True),
        (5.15, 1.0, 1, True),  # both take 2.0 A at 5.08 N m, and at 5.4 along straight lines
        (9.0, 1.0, 1, True),
        (10.0, 1.1, 1, True),
        (-9.0, 1.0, 1, True),
        (10.0, 1.3, 2, True),  # the others do not reach 13 N m
        (20.0, 1.1, 2, False),  # none does: the greatest torque
    ],
)
def test_of_the_windows_with_room_the_one_of_least_current_is_taken(
    monkeypatch: pytest.MonkeyPatch, tau: float, room: float, chosen: int, has_room: bool
) -> None:
    """The current goes as the square root of the torque between those that were tried."""
    taus = np.array([[4.0, 12.0], [4.0, 11.0], [4.0, 16.0]])
    i_rms = np.array([[1.0, 9.0], [2.0, 4.0], [3.0, 8.0]])
    tried = SimpleNamespace(
        on=np.array([10.0, 20.0, 30.0]),
        off=np.array([130.0, 140.0, 150.0]),
        pulses=SimpleNamespace(tau=taus, i_rms=i_rms),
    )
    monkeypatch.setattr(least_copper, "_windows", lambda *_: tried)
    found = least_copper._best_window(known(), tau, room, np.zeros(1), np.zeros(1), 180.0)
    assert found == (10.0 * (chosen + 1), 120.0 + 10 * (chosen + 1), has_room)


@pytest.mark.parametrize("brakes", [False, True])
def test_windows_are_of_a_stroke_to_the_widest_dwell_about_the_angle_of_most_torque(
    monkeypatch: pytest.MonkeyPatch, brakes: bool
) -> None:
    """Three phases: 120 deg at least. Braking, all of it is half a period later."""
    monkeypatch.setattr(least_copper, "pulses", lambda law, on, off, i: (law.brakes, on, off, i))
    aside = 180.0 if brakes else 0.0
    on, off = (
        tuple(angle + aside for angle in ends)
        for ends in ((-30.0, 0.0, 90.0, 105.0), (75.0, 90.0, 120.0, 180.0, 210.0, 225.0))
    )
    of: Any = least_copper._windows
    found = of.__wrapped__(known(), on, off, 180.0, brakes)  # none of these is kept
    valid = [(-30, 90), (-30, 120), (0, 120), (0, 180), (90, 210), (90, 225)]
    assert sorted(zip(found.on - aside, found.off - aside, strict=True)) == valid
    of_braking, theta_on, theta_off, i = found.pulses
    assert of_braking == brakes
    assert theta_on.ravel() / DEG == pytest.approx(found.on)
    assert theta_off.ravel() / DEG == pytest.approx(found.off)
    assert i.ravel() == pytest.approx(150 * (np.arange(1, 6) / 5) ** 1.5)


def corners(place: Callable[[int, float, float], dict[str, float]], n: int) -> list[list[float]]:
    """Numbers at (0, 0) and at (1, 1) of the unit square."""
    return [list(place(n, x, x).values()) for x in (0.0, 1.0)]


def test_searches_place_angles_and_weights_between_the_ends_that_they_name() -> None:
    for n in (3, 4, 6):
        assert corners(pulse_angles, n) == [[-90, 90], [60, 175]]
        low, high = corners(overlapping_angles, n)
        stroke = 360 / n
        assert low == pytest.approx([-90, max(90, -90 + stroke)], abs=0.02)
        assert high == pytest.approx([60, max(175, 60 + stroke)], abs=0.02)
        free = 180 - 360 / n
        (on, least), (late, _) = corners(sharing_angles, n)
        assert on == 0 and least == pytest.approx(0.1 * free, abs=0.02)
        assert late == pytest.approx(free / 2, abs=0.01)
    assert corners(tracking_weights, 3) == [[1e-3, 1e-3], [10, 10]]
    assert corners(copper_and_horizon, 3) == [[1e-7, 1], [1e-2, 2]]
    assert [copper_and_horizon(3, 0, y)["horizon"] for y in (0.49, 0.5)] == [1, 2]


@pytest.mark.parametrize("n", [3, 4, 5, 6])
def test_every_place_of_a_search_is_one_that_the_law_takes(n: int) -> None:
    for x in np.linspace(0, 1, 21):
        for y in np.linspace(0, 1, 21):
            window = overlapping_angles(n, x, y)
            dwell = window["theta_off_deg"] - window["theta_on_deg"]
            assert 360 / n <= dwell < 360 and 90 <= window["theta_off_deg"] <= 180.01
            shared = sharing_angles(n, x, y)
            on, ov = shared["theta_on_deg"] * DEG, shared["theta_ov_deg"] * DEG
            line = {"shape": _core.Shape.linear, "table": [0.0] * 33}
            assert _core.Sharing(theta_on=on, theta_ov=ov, **line).is_feasible(n)
        together = sum(sharing_angles(n, x, 1.0).values())
        assert together == pytest.approx(180 - 360 / n, abs=0.02)  # all that two phases share


@pytest.mark.parametrize("name", LAWS)
def test_frequency_goes_as_the_inverse_of_a_band_or_period_and_as_the_wanted_one(
    name: str,
) -> None:
    for variant in table_of(name).variants:
        slope = 1 if variant.free.key == "f_switch_kHz" else -1
        assert variant.free.slope == slope and variant.free.lowest < variant.free.highest


@pytest.mark.parametrize("name", LAWS)
def test_a_law_uses_comparators_where_its_variants_need_them(name: str) -> None:
    table = table_of(name)
    needs = ["comparator" in variant.needs for variant in table.variants]
    assert {*needs} == {table.model_construct(law=name, T_s_us=20.0).uses_comparators}


def test_searches_end_at_the_narrowest_band_of_their_range() -> None:
    """As the page of the laws has it, at 150 A and 20.669 N m; no tuned number lies beyond."""
    page = (RATED.parents[1] / "docs" / "control" / "laws.md").read_text(encoding="utf-8")
    for name, unit in (("torque_sharing", 150.0), ("ditc", 20.669)):
        free = table_of(name).variants[0].free
        tuned = [float(v) for v in re.findall(rf"{free.key} = ([\d.]+) \|", page)]
        assert min(tuned) == pytest.approx(free.lowest * unit, rel=1e-4)
        assert max(tuned) < free.highest * unit


def test_half_a_band_is_crossed_about_twice_as_often() -> None:
    own = {"theta_on_deg": 20, "theta_off_deg": 150}
    wide, narrow = (
        rl.simulate(fixed(**own, i_band_A=band), until=0.03, record=None).kpis.f_switch
        for band in (4.0, 2.0)
    )
    assert 1.5 < narrow / wide < 2.5


HEAD = "speed_rpm,torque_Nm,theta_on_deg,theta_off_deg\n"


def table(tmp_path: Path, on: float, off: float, speed: float = 500, torque: float = 5) -> Path:
    rows = [(speed, torque, on, off), *((s, t, 0, 120) for s, t in ((500, 9), (900, 5), (900, 9)))]
    file = tmp_path / "a.csv"
    file.write_text(HEAD + "".join(f"{','.join(f'{v:.9g}' for v in row)}\n" for row in rows))
    return file


@pytest.mark.parametrize(
    ("on", "off", "told"),
    [
        (-180, 179.9, None),
        (-180, 180, None),
        (-180, 180.1, "theta_off_deg = 180.1, need above theta_on_deg = -180"),
        (179.9, 180, None),
        (180, 200, "theta_on_deg = 180, need from -180 to below 180"),
        (10, 10, "theta_off_deg = 10, need above"),
        (10, 360, None),
        (10, 360.1, "need above theta_on_deg = 10 and at most 360"),
    ],
)
def test_angles_of_a_table_are_windows(
    tmp_path: Path, on: float, off: float, told: str | None
) -> None:
    file = table(tmp_path, on, off)
    if told is None:
        assert read_angle_table(file).at(1.0, 1.0) == pytest.approx((on * DEG, off * DEG))
    else:
        with pytest.raises(rl.ParameterError, match=r"row 2: .*" + told.replace(".", r"\.")):
            read_angle_table(file)


@pytest.mark.parametrize(("speed", "torque"), [(0, 5), (500, 0)])
def test_a_table_begins_above_standstill_and_above_no_torque(
    tmp_path: Path, speed: float, torque: float
) -> None:
    key = "torque_Nm" if speed else "speed_rpm"
    with pytest.raises(rl.ParameterError, match=f"row 2: {key} = 0, need > 0"):
        read_angle_table(table(tmp_path, 0, 120, speed, torque))


def test_a_table_is_interpolated_in_rad_per_second_and_newton_metres(tmp_path: Path) -> None:
    """A quarter of the way in speed, half of it in torque, from one node that differs."""
    angles = read_angle_table(table(tmp_path, 80, 160))
    assert angles.omega == pytest.approx(np.array([500, 900]) * np.pi / 30)
    assert angles.tau.tolist() == [5, 9]
    on, off = angles.at(600 * np.pi / 30, 7)
    assert on == pytest.approx(0.75 * 0.5 * 80 * DEG)
    assert off == pytest.approx((120 + 0.75 * 0.5 * 40) * DEG)
