"""Control laws of one's own, in Python: the same place as the laws of the core, in one file."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

import reluctance as rl

ROOT = Path(__file__).parents[2]
RATED = ROOT / "examples" / "paper_rated.toml"
HOLD = "return [rl.Order.hold(rl.Leg.freewheel)] * 3"


class Watch(rl.Law):
    """Keeps what it sees, and regulates a current."""

    def reset(self, known: rl.Known) -> None:
        super().reset(known)
        self.seen: list[rl.Measurement] = []
        self.asked: list[float] = []

    def step(self, y: rl.Measurement, tau_ref: float) -> Sequence[rl.Order]:
        self.seen.append(y)
        self.asked.append(tau_ref)
        return [rl.Order.regulate(10.0 * (y.angle(k) < 2), 0.5) for k in range(y.n_phases)]


def watched(*overrides: str, until: float = 0.005) -> tuple[Watch, rl.Result]:
    law = Watch()
    drive = rl.load(RATED, list(overrides))
    return law, rl.simulate(drive, until=until, law=law)


def test_law_sees_the_sensors() -> None:
    """With ideal sensors: the state of the plant at each sample."""
    law, result = watched()
    n = len(law.seen)
    t = 20e-6 * np.arange(n)
    assert n == pytest.approx(0.005 / 20e-6, abs=1.5)
    i = [np.interp(t, result.t, phase) for phase in result.i]
    np.testing.assert_allclose([y.i for y in law.seen], np.transpose(i), atol=1e-6)
    theta = 4 * np.interp(t, result.t, result.theta_m)
    np.testing.assert_allclose(
        np.exp(1j * theta), np.exp(1j * np.array([y.theta_e for y in law.seen])), atol=1e-9
    )
    assert {y.u_dc for y in law.seen} == {240.0}
    assert {y.n_phases for y in law.seen} == {3}
    assert law.asked == pytest.approx([41.339] * n)


def test_angles_of_the_phases_are_a_stroke_apart() -> None:
    law, _ = watched(until=1e-3)
    for y in law.seen:
        for k in range(3):
            turn = (y.angle(k) - y.theta_e + k * 2 * np.pi / 3) / (2 * np.pi)
            assert turn == pytest.approx(round(turn), abs=1e-12)
            assert 0 <= y.angle(k) < 2 * np.pi


def test_law_sees_currents_through_the_converter_of_the_sensor() -> None:
    law, _ = watched("sensing.adc_bits=8", "sensing.i_range_A=256")
    steps = np.array([y.i for y in law.seen]) / (256 / 2**8)
    assert np.ptp(steps) > 5
    np.testing.assert_allclose(steps, np.round(steps), atol=1e-9)


def test_law_sees_the_tracked_speed_of_a_counted_angle() -> None:
    """An encoder has no speed: the observer settles on it, and starts off it."""
    law, _ = watched("sensing.encoder_counts=1024", until=0.05)
    speed = np.array([y.omega_m for y in law.seen])
    true = 1500 * np.pi / 30
    assert abs(speed[1] - true) > 0.01 * true
    assert np.abs(speed[-500:] - true).max() < 0.02 * true
    angle = np.array([y.theta_e for y in law.seen]) / (2 * np.pi * 4 / 1024)
    assert np.abs(angle - np.round(angle)).max() > 0.1  # tracked between the counts


def test_law_sees_the_wrong_angle_of_a_misaligned_sensor() -> None:
    right, _ = watched(until=1e-3)
    wrong, _ = watched("mismatch.angle_offset_deg=5", until=1e-3)
    turned = np.array([y.theta_e for y in wrong.seen]) - [y.theta_e for y in right.seen]
    np.testing.assert_allclose(
        np.exp(1j * turned), np.exp(1j * np.radians(5)) * np.ones(len(turned)), atol=1e-6
    )


def test_law_knows_the_machine_as_the_controller_believes_it() -> None:
    law, _ = watched("mismatch.R_factor=0.5", until=1e-3)
    assert law.known.R == pytest.approx(0.5 * rl.load(RATED).machine.R)
    assert law.known.T_s == pytest.approx(20e-6)


def test_speed_reference_reaches_the_law_as_a_torque() -> None:
    """The speed loop asks for its limit at standstill, as it does of every law."""
    law = Watch()
    drive = rl.load(ROOT / "examples" / "paper_pump.toml")
    rl.simulate(drive, until=0.005, law=law)
    assert np.abs(law.asked).max() <= drive.tau_max * (1 + 1e-9)
    assert law.asked[-1] == pytest.approx(drive.tau_max)


def test_delay_lets_orders_act_one_sample_later() -> None:
    _, now = watched()
    _, late = watched("sensing.delay_samples=1")
    first = [r.t[np.argmax(r.i_ref.max(axis=0) > 0)] for r in (now, late)]
    assert first[1] - first[0] == pytest.approx(20e-6)


def test_sampled_comparators_turn_a_regulated_current_into_held_legs() -> None:
    """The current leaves its band by what it moves in a sample; legs change at samples only."""
    analog, sampled = (watched(f"sensing.comparators={kind}")[1] for kind in ("analog", "sampled"))
    T_s = 20e-6

    def off_grid(result: rl.Result) -> int:
        changes = result.t[1:][(np.diff(result.leg, axis=1) != 0).any(axis=0)]
        part = np.abs(changes / T_s - np.round(changes / T_s))
        return int((part > 1e-6).sum())

    assert off_grid(analog) > 10
    assert off_grid(sampled) == 0
    assert sampled.i.max() > analog.i.max() + 0.5


def test_dead_time_is_compensated_for_an_own_law() -> None:
    """A pulse keeps its width: its turn-on is ordered earlier by the dead time."""

    class Pulse(rl.Law):
        def step(self, y: rl.Measurement, tau_ref: float) -> Sequence[rl.Order]:
            pulse = rl.Order.pulse(rl.Leg.freewheel, rl.Leg.magnetize, 8e-6, 12e-6)
            return [pulse] * y.n_phases

    ideal, dead = (
        rl.simulate(rl.load(RATED, [f"converter.dead_time_us={t}"]), until=200e-6, law=Pulse())
        for t in (0, 2)
    )
    for k in range(3):
        assert np.interp(19e-6, dead.t, dead.psi[k]) == pytest.approx(
            np.interp(19e-6, ideal.t, ideal.psi[k]), rel=1e-3
        )


@pytest.mark.parametrize(
    ("answer", "text"),
    [
        ("None", r"^Wrong\.step at test_own_law\.py:\d+ returned None, need a list of 3 Order"),
        (
            "[rl.Order()]",
            r"^Wrong\.step at test_own_law\.py:\d+ returned 1 orders, need a list of 3 Order",
        ),
        (
            "[1, 2, 3]",
            r"^Wrong\.step at test_own_law\.py:\d+ returned 1 for a phase, need a list of 3 Order",
        ),
        (
            "[rl.Order.regulate(float('nan'), 1.0)] * 3",
            r"^Wrong\.step at test_own_law\.py:\d+ returned .*need finite numbers",
        ),
        ("[rl.Order.regulate(1.0, -1.0)] * 3", "i_band >= 0"),
        (
            "[rl.Order.pulse(rl.Leg.freewheel, rl.Leg.magnetize, 5e-6, 1e-6)] * 3",
            "with t_edge = 1e-06, need edges that do not fall$",
        ),
        ("[rl.Order.hold('magnetize')] * 3", "step failed with TypeError: hold.*: incompatible"),
        ("__import__('sys').exit(3)", "step failed with SystemExit: 3"),
        ("1 / 0", "step failed with ZeroDivisionError: division by zero at <string>:1"),
        ("y.i[7]", "step failed with IndexError"),
        ("rl.Law().step(y, tau_ref)", "needs a method step"),
    ],
)
def test_a_wrong_answer_is_one_line(answer: str, text: str) -> None:
    class Wrong(rl.Law):
        def step(self, y: rl.Measurement, tau_ref: float) -> Sequence[rl.Order]:
            return eval(answer, {"rl": rl, "y": y, "tau_ref": tau_ref})

    with pytest.raises(rl.ParameterError, match=text) as fault:
        rl.simulate(rl.load(RATED), until=1e-3, law=Wrong())
    assert "\n" not in str(fault.value)


def test_what_is_no_law_is_told() -> None:
    for law in (Watch, "Watch", lambda y, tau_ref: []):
        with pytest.raises(rl.ParameterError, match=r"need an object of a subclass of .*Law"):
            rl.simulate(rl.load(RATED), law=law)


def test_each_run_starts_anew() -> None:
    """`reset` is called before the first sample; what it sets is as in the first run."""

    class Counts(Watch):
        def step(self, y: rl.Measurement, tau_ref: float) -> Sequence[rl.Order]:
            super().step(y, tau_ref)
            return [rl.Order.regulate(float(len(self.seen) % 7), 0.5)] * y.n_phases

    law, drive = Counts(), rl.load(RATED)
    first, again = (rl.simulate(drive, until=2e-3, law=law) for _ in range(2))
    np.testing.assert_array_equal(first.i, again.i)
    np.testing.assert_array_equal(first.t, again.t)


def test_a_failing_reset_is_one_line() -> None:
    class Fails(Watch):
        def reset(self, known: rl.Known) -> None:
            raise KeyError("table")

    with pytest.raises(rl.ParameterError, match=r"Fails\.reset failed with KeyError"):
        rl.simulate(rl.load(RATED), law=Fails())


def test_sharing_written_in_python_is_the_core_s_sharing() -> None:
    """The same law twice, at the same place: equal waveforms to the accuracy of its table."""

    class Sharing(rl.Law):
        def reset(self, known: rl.Known) -> None:
            self.i = np.linspace(0, known.i_max, 3001)
            self.known = known

        def step(self, y: rl.Measurement, tau_ref: float) -> Sequence[rl.Order]:
            k = self.known
            ahead = k.N_r * y.omega_m * k.T_s * 0.5
            orders = []
            for phase in range(y.n_phases):
                theta = (y.angle(phase) + ahead) % (2 * np.pi)
                late = (theta - np.radians(10), theta - np.radians(130))
                rise = [min(max(v / np.radians(40), 0), 1) for v in late]
                tau = tau_ref * (rise[0] - rise[1])
                i = np.interp(tau, k.machine.tau(self.i, theta), self.i) if tau > 0 else 0.0
                orders.append(rl.Order.regulate(float(i), 1.0))
            return orders

    drive = rl.load(
        RATED,
        [
            *("control.law=torque_sharing", "control.sharing=linear", "control.i_band_A=1.0"),
            *("control.theta_on_deg=10", "control.theta_ov_deg=40"),
        ],
    )
    core, own = rl.simulate(drive, until=0.02), rl.simulate(drive, until=0.02, law=Sharing())
    assert own.kpis.tau_mean == pytest.approx(core.kpis.tau_mean, rel=1e-3)
    assert own.kpis.f_switch == pytest.approx(core.kpis.f_switch, rel=0.02)
    assert own.kpis.torque_error_rms == pytest.approx(core.kpis.torque_error_rms, rel=0.05)


@pytest.mark.parametrize(
    ("duty", "T_s", "centre", "need"),
    [
        (np.nan, 2e-5, 0.5, "duty = nan, need a number"),
        (0.5, 0.0, 0.5, "T_s = 0.0, need the control period in seconds"),
        (0.5, np.nan, 0.5, "T_s = nan, need the control period"),
        (0.5, 1.0, 0.5, "T_s = 1.0, need the control period in seconds"),
        (0.5, 2e-5, 5.0, "centre = 5.0, need a fraction of the sample, 0 to 1"),
        (0.5, 2e-5, -0.1, "centre = -0.1, need a fraction"),
    ],
)
def test_a_pulse_that_cannot_be_meant_is_refused(
    duty: float, T_s: float, centre: float, need: str
) -> None:
    with pytest.raises(ValueError, match=need):
        rl.Order.pwm(duty, T_s, centre)
    assert repr(rl.Order.pwm(2.0, 2e-5)) == repr(rl.Order.pwm(1.0, 2e-5))  # held there
    rl.Order.pwm(0.5, 0.99)


@pytest.mark.parametrize(("start", "end", "name"), [(1.0, 0.1, "start"), (0.1, 1.0, "end")])
def test_an_edge_in_microseconds_is_refused(start: float, end: float, name: str) -> None:
    legs = rl.Leg.freewheel, rl.Leg.magnetize
    with pytest.raises(ValueError, match=f"{name} = 1.0, need an instant of the sample in seconds"):
        rl.Order.pulse(*legs, start, end)
    rl.Order.pulse(*legs, 0.98, 0.99)


def test_a_measurement_has_the_phases_that_it_has() -> None:
    y = rl.Measurement(i=[0.0] * 4, theta_e=1.0, omega_m=0.0, u_dc=240.0)
    turn = 2 * np.pi
    assert [y.angle(k) for k in range(4)] == pytest.approx(
        [(1 - k * turn / 4) % turn for k in range(4)]
    )
    for k in (4, -1, 100):
        with pytest.raises(IndexError, match=f"phase {k}, need 0 to 3"):
            y.angle(k)
