"""Parts of pumping at their edges: times and values of weather, light off the sun, a loss map from
torques achieved, names of clocks, samples of many rows."""

import re
from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace as Namespace

import numpy as np
import pandas as pd
import pytest

pytest.importorskip("pvlib")
from reluctance.base.errors import ParameterError
from reluctance.plant.hydraulics.curve import GRAVITY, RHO
from reluctance.pumping import figures, operate, weather, write
from reluctance.pumping import loss_map as maps
from reluctance.pumping import weather_quality as quality
from reluctance.pumping.figures import Chain
from reluctance.pumping.loss_map import LossMap, Row, _indexed_by_achieved
from reluctance.pumping.site import Site, Sun, _fixed
from reluctance.pumping.tank import Storage
from reluctance.pumping.weather import Weather, as_numbers, interval

SITE = Site(latitude_deg=10.0, longitude_deg=30.0, timezone="Etc/GMT-2")


# Times and values.


def times(*minutes: float) -> pd.DatetimeIndex:
    return pd.Timestamp("2026-03-21", tz="UTC") + pd.to_timedelta(minutes, unit="min")


def test_an_interval_is_the_usual_one_and_all_are_it_to_a_thousandth() -> None:
    assert interval(times(0, 5, 10, 15), "w") == 300
    assert interval(times(0, 5, 10.004, 15.004), "w") == pytest.approx(300, rel=1e-3)
    for given, told in (
        ((0, 5, 10.006, 15), "a gap from .* 00:05:00.* need a row every 300 s; fill the gaps"),
        ((0, 5, 9.99, 15), r"a shorter interval from .* \(2 such places\).* equal intervals"),
        ((0, 5, 10, 5, 20), r"times out of order from .* 00:10:00.* sort the rows"),
        ((0, 5, 10, 20, 25, 35), r"a gap from 2026-03-21 00:10:00.* \(2 such places\)"),
        ((0, 5, 5, 10, 15), "one time twice from .* 00:05:00.* to .* 00:05:00.* remove one row"),
        ((0,), "w: 1 samples, need at least 2"),
    ):
        with pytest.raises(ParameterError, match=told):
            interval(times(*given), "w")


@pytest.mark.parametrize(
    ("name", "low", "high"),
    [("temp_air", -90, 60), ("wind_speed", 0, 60), ("ghi", -20, 1800), ("dni", -20, 1800)],
)
def test_values_of_weather_end_where_the_earth_ends_them(
    name: str, low: float, high: float
) -> None:
    t = times(0, 5, 10)

    def check(*values: float) -> None:
        weather._whole(t, np.array(values), name, "w")

    check(low, (low + high) / 2, high)
    for value in (low - 0.1, high + 0.1):
        told = rf"w: {name} = {value:g} at 2026-03-21 00:05:00\+00:00 \(2 of 3 samples\), need "
        with pytest.raises(ParameterError, match=told + f"{low:g} to {high:g}; check the column"):
            check(low, value, value)
    for mark in (-9999.0, 9999.0, -999.0):
        with pytest.raises(ParameterError, match="it marks a missing value: fill these samples"):
            check(low, mark, low)
    for hole in (np.nan, np.inf):
        with pytest.raises(ParameterError, match=rf"{name} is missing, .* 00:10:00.* \(1 of 3"):
            check(low, low, hole)


def test_cells_that_are_no_numbers_are_missing() -> None:
    table = pd.DataFrame({"ghi": ["1", "x"], "temp_air": [2.0, 3.0], "note": ["a", "b"]})
    found = as_numbers(table)
    assert found["ghi"].tolist()[0] == 1 and np.isnan(found["ghi"][1])
    assert found["note"].tolist() == ["a", "b"] and "dni" not in found


def day(off_h: float, *, days: int = 1, height: float = 1.0) -> Weather:
    """Light and sun of cosines of the hour; the sun is `off_h` earlier."""
    t = pd.date_range("2026-03-21", periods=96 * days, freq="15min", tz="UTC")
    hour = weather._solar_clock(t, SITE)
    sun = np.maximum(np.cos((hour + off_h) * np.pi / 12), 0) * height
    light = 800 * np.maximum(np.cos(hour * np.pi / 12), 0)
    zenith = np.degrees(np.arccos(np.where(sun > 0, sun, -0.01)))
    none = 0 * light
    return Weather(
        t=t, step=900.0, ghi=light, dni=none, dhi=none, temp_air=none, wind_speed=none,
        sun=Sun(zenith, none), where="w",
    )  # fmt: skip


def test_the_clock_of_the_sun_counts_from_its_mean_noon() -> None:
    """At 30 degrees east two hours before that of Greenwich."""
    t = pd.DatetimeIndex(["2026-03-21 10:00", "2026-03-21 11:30:36", "2026-03-21 21:00"], tz="UTC")
    assert weather._solar_clock(t, SITE) == pytest.approx([0, 1.51, 11])


@pytest.mark.parametrize(
    ("days", "passes", "refused"), [(1, 2.3, 2.7), (29, 2.3, 2.7), (30, 0.9, 1.1), (60, 0.9, 1.1)]
)
def test_light_may_be_off_the_sun_by_an_hour_over_a_month_and_by_more_on_a_day(
    days: int, passes: float, refused: float
) -> None:
    """Without light at night, which the second half of the check would find."""
    for sign in (1, -1):
        for off, told in ((passes, False), (refused, True)):
            given = day(sign * off, days=days)
            given = replace(
                given, sun=replace(given.sun, zenith_deg=np.minimum(given.sun.zenith_deg, 90.5))
            )
            if not told:
                weather._check_light(given, SITE)
                continue
            with pytest.raises(
                ParameterError, match=rf"its light is \{'+' if sign > 0 else '-'}\d"
            ):
                weather._check_light(given, SITE)


def test_light_at_night_is_refused_from_a_hundredth_of_the_samples_on() -> None:
    """Above what an offset of a sensor is, and after the twilight."""
    given = day(0.0, days=2)
    deep = np.flatnonzero(given.sun.zenith_deg > 90)
    zenith = given.sun.zenith_deg.copy()
    zenith[deep] = 120.0
    night = replace(given, sun=replace(given.sun, zenith_deg=zenith))
    for count, light, refused in ((1, 60.0, False), (2, 60.0, True), (9, 49.0, False)):
        ghi = night.ghi.copy()
        ghi[deep[:count]] = light
        if refused:
            with pytest.raises(ParameterError, match="2 samples have sun at night"):
                weather._check_light(replace(night, ghi=ghi), SITE)
        else:
            weather._check_light(replace(night, ghi=ghi), SITE)
    with pytest.raises(ParameterError, match=r"its light is \+12.0 h off the sun at 10 N 30 E"):
        weather._check_light(day(0.0, height=0.0), SITE)  # the sun never rises
    for ghi, told in (
        (given.ghi / 1000, "but follows the days, up to 0.8: is its unit kW/m2.* 1000 times as"),
        (4.0 + 0 * given.ghi, "night only, ghi stays below 5 W/m2"),
    ):
        with pytest.raises(ParameterError, match=told):
            weather._check_light(replace(given, ghi=ghi), SITE)
    weather._check_light(replace(given, ghi=5.0 * given.ghi / given.ghi.max()), SITE)


# Doubts of a file.


def test_an_offset_of_twelve_minutes_is_told() -> None:
    assert not [*quality._of_the_offset(11.9, "x")] and not [*quality._of_the_offset(-11.9, "x")]
    (later,), (earlier,) = (quality._of_the_offset(off, "the closure") for off in (12.0, -12.4))
    assert later.startswith("the light is +12 min off the sun, by the closure: check what")
    assert earlier.startswith("the light is -12 min off the sun")


@pytest.mark.parametrize(("zenith", "allowed"), [(40.0, 0.08), (80.0, 0.15)])
def test_the_parts_of_the_light_close_to_8_percent_and_to_15_where_the_sun_is_low(
    zenith: float, allowed: float
) -> None:
    """In more than a twentieth of the samples with light."""
    sun = Sun(np.full(100, zenith), np.zeros(100))
    dni, dhi = np.full(100, 600.0), np.full(100, 100.0)
    total = dni * sun.height + dhi
    for off, count, told in (
        (0.99 * allowed, 100, False),
        (1.01 * allowed, 5, False),
        (1.01 * allowed, 6, True),
        (-1.01 * allowed, 6, True),
    ):
        ghi = total.copy()
        ghi[:count] *= 1 + off
        found = [*quality._of_the_closure(sun, ghi, dni, dhi, SITE, 0.0)]
        assert len(found) == told
        if told:
            over = 100 * count / 100 * off
            assert f"in 6% of the sunlit samples (over the file ghi is {over:+.1f}%)" in found[0]
    dim = 49.0 / total
    for scale in (dim, 1.04 * dim):  # less than 50 W/m2 is not compared
        parts = 2 * scale * total, scale * dni, scale * dhi
        wrong = quality._of_the_closure(sun, *parts, SITE, 0.0)
        assert len([*wrong]) == (scale is not dim)


def test_light_beyond_what_is_possible_is_told_with_its_worst_sample(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """QCRad: 1.5 E cos^1.2 + 100 of the global, E of the direct, 0.95 E cos^0.2 + 50 of the diffuse
    light; in more than 0.2 % of the samples."""
    monkeypatch.setattr(quality, "extra_radiation", lambda t: np.full(len(t), 1400.0))
    t = pd.date_range("2026-03-21", periods=1000, freq="h", tz="UTC")
    height, none = 0.5, np.zeros(1000)
    sun = Sun(np.full(1000, 60.0), none)
    most = {
        "ghi": 1.5 * 1400 * height**1.2 + 100,
        "dni": 1400.0,
        "dhi": 0.95 * 1400 * height**0.2 + 50,
    }
    for name, limit in most.items():
        for value, count, told in ((0.999, 3, 0), (1.001, 2, 0), (1.001, 3, 1)):
            values = none.copy()
            values[100 : 100 + count] = value * limit
            values[101] *= 1.01 if told else 1
            given = Namespace(**{"ghi": none, "dni": none, "dhi": none, name: values})
            given.t, given.stamps, given.sun = t, t, sun
            found = [*quality._of_the_limits(given, (name,))]  # type: ignore[arg-type]
            assert len(found) == told, (name, value, count)
            if told:
                assert f"{name} is above what is physically possible in 3 samples: " in found[0]
                assert f"{values[101]:.0f} W/m2 at {t[101]}, where at most {limit:.0f}" in found[0]
            assert not [*quality._of_the_limits(given, ())]  # type: ignore[arg-type]


# A loss map.


def test_losses_are_those_of_the_torque_achieved() -> None:
    """Loss over torque a + b tau, of runs that achieve nine tenths of what is asked; past 6 N m a
    drive is at its limit, and what it wastes there is left out."""
    u, omega, tau = np.array([200.0, 300.0]), np.array([50.0, 100.0]), np.linspace(1, 9, 5)
    asked = np.linspace(0.5, 10, 20)

    def row(most: float) -> Row:
        achieved = np.minimum(0.9 * asked, most)
        waste = 100.0 * np.append(False, achieved[1:] == achieved[:-1])
        return Row(asked, achieved, achieved * (2.0 + 0.5 * achieved) + waste)

    found = _indexed_by_achieved(u, omega, tau, [row(9), row(8.74), row(8.72), row(6)], 9.0)
    assert found.tau_max == pytest.approx(np.array([[9, 9], [8.72, 6]]))  # 97 % holds it
    assert found.loss_per_torque[0, 0] == pytest.approx(2 + 0.5 * tau)
    assert found.loss_per_torque[1, 1] == pytest.approx(2 + 0.5 * np.minimum(tau, 6))
    assert found.given == pytest.approx(np.array([[0.9, 0.874], [0.872, 0.6]]))  # of 10 N m


def test_power_is_that_of_the_shaft_and_of_the_losses_and_holds_at_the_edges() -> None:
    """Loss over torque u/100 + omega/10 + tau, which a linear map has exactly."""
    u, omega, tau = np.array([200.0, 300.0]), np.array([50.0, 75.0, 100.0]), np.array([1.0, 5.0])
    a, b, c = np.meshgrid(u, omega, tau, indexing="ij")
    most = u[:, None] / 50 + omega / 25
    losses = LossMap(u, omega, tau, a / 100 + b / 10 + c, most, 5.0, np.ones_like(most))
    x = np.array([3.0, 3.0, 8.0, 0.5])
    u_dc, w = np.array([250.0, 100.0, 400.0, 250.0]), np.array([60.0, 60.0, 20.0, 120.0])
    inside = np.clip(u_dc, 200, 300) / 100 + np.clip(w, 50, 100) / 10 + np.clip(x, 1, 5)
    assert losses.p_in(u_dc, w, x) == pytest.approx(x * (w + inside))
    reach = np.clip(u_dc, 200, 300) / 50 + np.clip(w, 50, 100) / 25
    assert losses.greatest_torque(u_dc, w) == pytest.approx(reach)
    assert replace(losses, given=most).given_at_limit(u_dc, w) == pytest.approx(reach)


def test_every_point_of_a_loss_map_is_run_at_the_torques_that_the_law_reaches(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """From a twentieth of the greatest on; the last is what the law is set up for."""
    ran, told = [], []

    class Able:
        tau_max = 7.0

        def run(self, *, u_dc: float, omega: float, tau: float) -> tuple[float, float]:
            ran.append((u_dc, omega, tau))
            return tau, 2 * tau

    monkeypatch.setattr(maps, "set_up", lambda drive, omega, tau: Able())
    monkeypatch.setattr(maps, "PROCESSES", 1)
    box = maps.Box((100.0, 200.0), (10.0, 30.0), 10.0)
    found = maps._from_runs(Namespace(), box, (2, 3, 5), told.append)  # type: ignore[arg-type]
    tau = np.linspace(0.5, 10, 5)
    assert found.tau == pytest.approx(tau) and found.tau_set_up == 7
    asked = [*tau[:3], 7.0]
    assert ran == [
        (u, w, pytest.approx(x)) for u in (100, 200) for w in (10, 20, 30) for x in asked
    ]
    assert told == pytest.approx(np.arange(1, 7) / 6)
    assert found.tau_max == pytest.approx(np.full((2, 3), 7.0))
    fixed = Namespace(control=Namespace(follows_torque=False))
    with pytest.raises(ParameterError, match="cannot follow a torque; take another law"):
        maps.loss_map(fixed, box)  # type: ignore[arg-type]


# Names and files.


@pytest.mark.parametrize(
    ("name", "told"),
    [
        ("GMT+1", "`Etc/GMT-1`"), ("UTC-05:00", "`Etc/GMT+5`"), ("+3", "`Etc/GMT-3`"),
        ("utc+0", "`Etc/UTC`"), ("GMT +10", "`Etc/GMT-10`"), ("+05:30", "`Asia/Kolkata`"),
        ("+0530", "`Asia/Kolkata`"), ("EAT", None), ("GMT", None),
    ],
)  # fmt: skip
def test_a_clock_by_its_hours_is_answered_with_the_zone_of_the_opposite_sign(
    name: str, told: str | None
) -> None:
    found = _fixed(name)
    assert (told in found) if told else found == ""


class Found:
    """A result with some samples."""

    def __init__(self, n: int) -> None:
        self.t = pd.date_range("2026-01-01", periods=n, freq="min", tz="Etc/GMT-1")


def test_samples_of_more_than_fifty_thousand_rows_are_arrays(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With their times in seconds of UTC."""
    monkeypatch.setattr(write, "columns", lambda found: {"Q_m3ph": np.arange(len(found.t))})
    assert [*write._samples(Found(50_000))] == ["samples.csv"]  # type: ignore[arg-type]
    ((name, put),) = write._samples(Found(50_001)).items()  # type: ignore[arg-type]
    put(tmp_path / name)
    with np.load(tmp_path / "samples.npz") as arrays:
        assert arrays["Q_m3ph"].tolist()[-1] == 50_000
        first = pd.Timestamp("2025-12-31 23:00", tz="UTC").timestamp()
        assert arrays["t_unix_s"][:2].tolist() == [first, first + 60]
    write.write_text_whole(tmp_path / "a.txt", "é\n")
    assert (tmp_path / "a.txt").read_bytes() == "é\n".encode()


def chain_of(found: object) -> Chain:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(figures, "nominal_power", lambda _: 7000.0)
        return figures.chain(found)  # type: ignore[arg-type]


def test_water_over_the_rim_was_lifted_for_nothing() -> None:
    """Its energy is a part of that of the lifted water: rho g H per cubic metre."""
    n = 4
    zero = np.zeros(n)
    names = "poa_global p_mp p_array p_link p_in omega tau p_shaft Q H limit".split()
    samples = Namespace(**dict.fromkeys(names, zero) | {"Q": np.full(n, 0.01), "H": zero + 25})
    samples.omega, samples.tau, samples.p_shaft = zero + 100, zero + 40, zero + 3500
    samples.p_mp, samples.p_array, samples.p_link, samples.p_in = (
        zero + p for p in (6000.0, 5800.0, 5500.0, 4700.0)
    )
    storage = Storage.__new__(Storage)
    object.__setattr__(storage, "overflow", np.full(n, 2.0))
    machine = Namespace(B_Nms=0.001)
    diode = Namespace(diode=lambda G, T: None)
    system = Namespace(
        pipe=Namespace(H_static_m=20.0), drive=Namespace(machine=machine), array=diode
    )
    found = Namespace(samples=samples, system=system, step=900.0, storage=storage)
    c = chain_of(found)
    t, water = 3600.0, RHO * GRAVITY
    assert c.overflow == pytest.approx(water * 20 * 8)
    assert c.e_lift == pytest.approx(water * 0.01 * 20 * t)
    assert c.pipe == pytest.approx(water * 0.01 * 5 * t)
    assert c.pump == pytest.approx((3500 - water * 0.01 * 25) * t)
    assert c.drive == pytest.approx(700 * t) and c.friction == pytest.approx(10 * t)
    assert (c.off_mpp, c.converter, c.above_limit) == pytest.approx((200 * t, 300 * t, 800 * t))
    assert (c.e_mp, c.e_in, c.below_threshold) == pytest.approx((6000 * t, 4700 * t, 0))
    samples.omega = zero
    idle = chain_of(found)
    assert idle.below_threshold == pytest.approx(5800 * t) and idle.converter == 0
    samples.limit = zero + 2
    stuck = chain_of(found)
    assert stuck.below_threshold == 0 and stuck.above_limit == pytest.approx(5800 * t)


@pytest.mark.parametrize(
    ("greatest", "step", "told"),
    [
        (0.8, 3600.0, [1000]),
        (3.53, 3600.0, [277.8]),
        (1.2, 3600.0, [1000, 277.8]),
        (0.9, 900.0, [1000, 1111]),
        (0.04, 3600.0, []),
    ],
)
def test_light_in_a_smaller_unit_is_asked_with_each_that_the_sun_may_have(greatest, step, told):
    given = day(0.0, days=2)
    light = Namespace(ghi=given.ghi * greatest / given.ghi.max(), step=step)
    text = weather._smaller_unit(light)
    assert [float(x) for x in re.findall(r"([\d.]+) times as much", text)] == told
    assert text == "check its unit" or text.startswith("is its unit ")


@pytest.mark.parametrize(("step", "made"), [(60.0, False), (61.0, True), (3600.0, True)])
def test_minutes_are_made_of_longer_means_where_they_are_asked_for(monkeypatch, step, made):
    class System(Namespace):
        check_voltage = staticmethod(lambda: None)

    given = {name: Namespace(curve=lambda: 0, omega_max=1) for name in ("pump", "pipe")}
    asked = Namespace(generate_minutes=True, seed=7)
    system = System(**given, weather=asked, site="here", folder="folder")
    monkeypatch.setattr(operate, "System", System)
    for name in ("hydraulics", "loss_map", "drive_at_nominal", "box_of"):
        monkeypatch.setattr(operate, name, lambda *_, **__: None)
    monkeypatch.setattr(operate, "read_weather", lambda *_: Namespace(step=step))
    monkeypatch.setattr(operate, "with_minutes", lambda *_, seed: Namespace(step=seed / 7))

    @dataclass
    class Found:
        water: float
        water_from_means: float | None = None

    monkeypatch.setattr(operate, "_over", lambda system, own, *_: Found(own.step))
    assert operate.pump(system) == (Found(1.0, step) if made else Found(step))
    system.weather.generate_minutes = False
    assert operate.pump(system) == Found(step)
    system.weather.generate_minutes = True
    assert operate.pump(system, weather=Namespace(step=900.0)) == Found(900.0)
