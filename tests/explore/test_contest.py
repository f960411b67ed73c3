"""Parts of a comparison on runs and trials that are given: notes, samples, conditions, ranges."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import reluctance as rl
from reluctance.drive.tables.variants import CARRIER, CURRENT_BAND
from reluctance.explore.comparison import contest
from reluctance.explore.comparison.conditions import conditions, operating_point, period
from reluctance.explore.comparison.contenders import CONTENDERS, chosen, contender
from reluctance.explore.comparison.contest import (
    FrontPoint,
    _last_period,
    _or_none,
    _samples,
    _searched,
    _with_less,
)
from reluctance.explore.comparison.tuning import Tuner, definite_error
from reluctance.explore.tuning import Trial

RATED = Path(__file__).parents[2] / "examples" / "paper_rated.toml"


@pytest.fixture(scope="module")
def point():
    return operating_point(rl.load(RATED))


def trial(error=0.05, f=10e3, i_rms=50.0, values=None):
    figures = {"torque_error_rms": error, "f_switch_Hz": f, "i_rms_A": i_rms}
    return Trial(values or {}, figures, error, (), "")


@pytest.mark.parametrize(
    ("f", "error", "told"),
    [
        (5e3, 0.04, True),
        (9.1e3, 0.01, False),  # within a tenth it is the same frequency
        (9e3, 0.01, True),
        (8.9e3, 0.01, True),
        (5e3, 0.0476, False),  # within a twentieth it is as smooth
        (5e3, 0.95 * 0.05, True),
        (5e3, 0.0474, True),
    ],
)
def test_a_law_that_is_clearly_smoother_at_a_lower_frequency_is_told(f, error, told):
    front = (FrontPoint(f, error, 0.25, 50.0), FrontPoint(10e3, 0.05, 0.3, 51.0))
    note = _with_less(front, trial())
    assert bool(note) == told
    if told:
        assert note == (
            f"smoother with less: error {error:.2%} rms, ripple 25.00% p-p at {f / 1e3:.3g} kHz"
        )
    none = _with_less((FrontPoint(1e3, 0.001, None, 1.0),), trial())
    assert none.endswith("ripple - p-p at 1 kHz")


def test_figures_without_meaning_are_no_numbers():
    assert _or_none({"torque_ripple_pp": float("nan")}) is None
    assert _or_none({"torque_ripple_pp": 0.5}) == 0.5
    assert definite_error(trial(0.3)) == 0.3
    with pytest.raises(RuntimeError, match="without meaning"):
        definite_error(trial(float("nan")))


def test_what_was_searched_is_all_but_the_free_parameter():
    of = CONTENDERS["sharing_cubic"]
    values = {"theta_on_deg": 30.0, of.free.key: 1.0}
    assert _searched(of, trial(values=values)) == {"theta_on_deg": 30.0}


def test_a_front_has_the_law_at_other_frequencies_in_their_order(point, monkeypatch):
    """A band that begins where the frequency would go as its inverse; one that is not met and one
    that cannot work are absent."""
    of, begun = CONTENDERS["sharing_cubic"], []

    class Other:
        contender, f_target = of, 8e3

        def __init__(self, point, contender, f_target, budget):
            self.f, self.budget = f_target, budget
            self.target = SimpleNamespace(met=lambda figures: figures["f_switch_Hz"] != 2e3)

        def match(self, rest, start):
            begun.append((self.f, rest, start, self.budget))
            if self.f == 32e3:
                raise rl.ParameterError("too fast")
            figures = {"torque_ripple_pp": self.f / 1e5, "f_switch_Hz": self.f}
            return Trial({}, figures | {"torque_error_rms": 0.01, "i_rms_A": 7.0}, 0.0, (), "")

    Other.point = point
    monkeypatch.setattr(contest, "Tuner", Other)
    final = trial(0.05, 8e3, values={"theta_on_deg": 30.0, "i_band_A": 2.0})
    final.figures["torque_ripple_pp"] = float("nan")
    found = contest._front(Other(point, of, 8e3, 0), final, (1.0, -1.0, -2.0, 2.0))
    assert begun == [
        (f, {"theta_on_deg": 30.0}, band, 0)
        for f, band in ((16e3, 1.0), (4e3, 4.0), (2e3, 8.0), (32e3, 0.5))
    ]
    assert found == (
        FrontPoint(4e3, 0.01, 0.04, 7.0),
        FrontPoint(8e3, 0.05, None, 50.0),
        FrontPoint(16e3, 0.01, 0.16, 7.0),
    )


def test_the_last_period_and_the_samples_of_a_run_are_those_of_its_waveforms(point):
    result = rl.simulate(point, until=0.03, record=0)
    theta, tau = _last_period(result)
    assert theta[0] == 0 and theta[-1] == pytest.approx(2 * np.pi, abs=1e-2)
    assert tau[-1] == result.tau[-1] and len(tau) < len(result.tau) / 2
    rows = _samples(result)
    t = np.arange(0.75 * 0.03, 0.03, point.control.T_s)
    assert rows.shape == (len(t), 3 + 5) and rows.flags["C_CONTIGUOUS"]
    for k in range(3):
        assert rows[:, k] == pytest.approx(np.interp(t, result.t, result.i[k]))
    angle = np.mod(4 * np.interp(t, result.t, result.theta_m), 2 * np.pi)
    assert rows[:, 3] == pytest.approx(angle, abs=1e-6)
    for column, value in ((4, 50 * np.pi), (5, 240.0), (6, 0.0), (7, 41.339)):
        assert rows[:, column] == pytest.approx(value, rel=1e-6)


def test_the_point_of_a_comparison_is_one_torque_at_one_speed(point):
    assert period(point) == pytest.approx(0.01)  # four rotor poles at 1500 rpm
    told = conditions(point)
    for key, value in {
        "u_dc_V": 240.0,
        "speed_rpm": 1500.0,
        "tau_ref_Nm": 41.339,
        "T_s_us": 20.0,
        "precision": "double",
        "R_factor": 1.0,
        "delay_samples": 0,
    }.items():
        assert told[key] == value, key
    assert told["J_kgm2"] == pytest.approx(point.J)
    for given, why in (
        (["reference.kind=none", "reference.tau_Nm="], "compared at one torque"),
        (
            ["reference.tau_Nm=", "reference.t_s=[0,1]", "reference.values=[1,2]"],
            "changes over time",
        ),
        (["reference.tau_Nm=0", "control.tau_max_Nm=9"], "need > 0 to compare"),
    ):
        law = ["control.law=angles", "control.theta_on_deg=0", "control.theta_off_deg=150"]
        fixed = [*law, "control.i_ref_A=50"] if "none" in given[0] else []
        with pytest.raises(rl.ParameterError, match=why):
            operating_point(rl.load(RATED, [*fixed, *given]))


def test_a_torque_of_less_than_a_newton_metre_is_compared_too():
    given = ["reference.tau_Nm=0.5", "control.tau_max_Nm=40"]
    found = operating_point(rl.load(RATED, given))
    assert found.reference.tau_Nm == 0.5 and found.load.speed_rpm == 1500


def test_each_law_takes_the_period_the_precision_and_the_greatest_torque_of_the_drive(point):
    of = CONTENDERS["sharing_cubic"]
    given = point.with_values({"control.tau_max_Nm": 60.0, "control.precision": "float"})
    made = of.drive(given, {"i_band_A": 2.5})
    assert (made.control.tau_max_Nm, made.control.precision) == (60, "float")
    assert made.control.i_band_A == 2.5 and made.control.T_s_us == 20
    assert of.drive(point, {}).control.tau_max_Nm is None


@pytest.mark.parametrize("name", CONTENDERS)
def test_a_free_parameter_ranges_over_parts_of_what_its_unit_says(name, point):
    of = CONTENDERS[name]
    low, high = of.range(point, 12e3)
    unit = {"i_max": 150.0, "tau": point.tau_max, "target": 12.0, "period": 20.0}[of.free.unit]
    assert 0 < low < high
    assert (low / unit, high / unit) == pytest.approx((of.free.lowest, of.free.highest))
    assert of.label == name


def test_contenders_are_named_once_and_all_where_none_is():
    assert [c.name for c in chosen(None)] == [*CONTENDERS]
    assert [c.name for c in chosen(["ditc", "deadbeat"])] == ["ditc", "deadbeat"]
    with pytest.raises(rl.ParameterError, match="`ditc` is given twice"):
        chosen(["ditc", "deadbeat", "ditc"])
    with pytest.raises(rl.ParameterError, match="`dits` is unknown; did you mean `ditc`"):
        chosen(["dits"])
    own = contender(f"python:{RATED.parent / 'own_law' / 'own_law.py'}:RestOfTorque")
    assert own.label == "own_law.py:RestOfTorque" and own.free in (CARRIER, CURRENT_BAND)


def tuner(point, tried=(), budget=0):
    made = Tuner(point, CONTENDERS["sharing_cubic"], 10e3, budget)
    made.tried = [*tried]
    return made


def test_a_miss_of_the_frequency_from_above_counts_and_one_from_below_promises_what_it_can(point):
    of = tuner(point)
    assert of._figure(trial(0.05, 10e3)) == pytest.approx(0.05)
    assert of._figure(trial(0.05, 10.1e3)) == pytest.approx(0.05)  # within the tolerance
    off = np.log(1.5) - 0.02
    assert of._figure(trial(0.05, 15e3)) == pytest.approx(0.05 * (1 + 10 * off))
    assert of._figure(trial(0.05, 5e3)) == pytest.approx(0.05)
    best = trial(0.05, 10e3)
    assert of._promises(trial(0.049, 20e3), best)  # its error is less, whatever its frequency
    assert of._promises(trial(0.09, 5e3), best)  # 0.045 if it fell with the frequency
    assert not of._promises(trial(0.11, 5e3), best) and not of._promises(trial(0.051, 20e3), best)
    assert of.target.tolerance == 0.02 and of.n_periods == 8
    kept = tuner(point)
    for f in (10.1e3, 10.3e3):
        kept._keep(trial(0.07, f))
    assert [t.figures["f_switch_Hz"] for t in kept.tried] == [10.1e3]
    kept._keep(trial(0.06, 9.9e3))
    assert kept._least() == 0.06


def test_errors_within_a_twentieth_are_equal_and_the_least_current_decides(point, monkeypatch):
    of = tuner(
        point, [trial(0.0525, i_rms=40.0), trial(0.0526, i_rms=10.0), trial(0.05, i_rms=50.0)]
    )
    monkeypatch.setattr(Tuner, "_first", lambda self: trial(0.2, 30e3))  # which meets nothing
    assert of.best().figures["i_rms_A"] == 40
    nothing = tuner(point)
    assert nothing.best().figures["f_switch_Hz"] == 30e3  # then the nearest
    fixed = replace(CONTENDERS["sharing_cubic"], place=None)
    alone = Tuner(point, fixed, 10e3, 0)
    assert alone.best().figures["f_switch_Hz"] == 30e3


def test_trials_of_a_contender_count_and_carry_its_values(point, monkeypatch):
    of = tuner(point)
    given = []

    def run(rows):
        given.extend(rows)
        return [trial(values=rows[0])]

    monkeypatch.setattr(Tuner, "trials", SimpleNamespace(run=run))
    assert of.run({"i_band_A": 1.5}).values == {"i_band_A": 1.5} and of.runs == 1
    assert given == [{"control.i_band_A": 1.5}]
    bad = SimpleNamespace(run=lambda rows: [replace(trial(), why="no such angle")])
    monkeypatch.setattr(Tuner, "trials", bad)
    with pytest.raises(rl.ParameterError, match="no such angle"):
        of.run({})
    assert of.runs == 2
