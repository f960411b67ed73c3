"""Each claim has the study's quantity in the unit that it names, and a verdict by its own words."""

import csv
import re
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from brief_study import brief

from reluctance import paper
from reluctance.paper import claims_results as results
from reluctance.paper.claim import Claim
from reluctance.paper.claims import claims
from reluctance.paper.claims_equations import pump_equilibrium, table_1
from reluctance.paper.points import HALF, RATED, Runs
from reluctance.paper.study import Study

RPM = np.pi / 30
IN_SI = {"ms": 1e-3, "%": 0.01, "rpm": RPM, "mH": 1e-3, "kHz": 1e3, "kW": 1e3, "A rms": 1.0}


@cache
def rows() -> list[Claim]:
    return claims(brief().found)


def row(start: str) -> Claim:
    (found,) = [claim for claim in rows() if claim.claim.startswith(start)]
    return found


def si(value: object, unit: str) -> float:
    assert isinstance(value, float | int)
    return float(value) * IN_SI.get(unit, 1.0)


def numbers(text: str) -> list[float]:
    return [float(number) for number in re.findall(r"-?\d+(?:\.\d+)?", text)]


def said(claim: Claim, before: str, unit: str) -> float:
    """The number that a reason gives after some words, in SI."""
    found = re.search(rf"{before} (-?\d+(?:\.\d+)?) {unit}(?!\w)", claim.why)
    assert found, (before, claim.why)
    return si(float(found[1]), unit)


def test_every_claim_is_there_once_and_has_a_reason() -> None:
    assert len({claim.claim for claim in rows()}) == len(rows()) == 38
    assert all(claim.why.endswith(".") for claim in rows())


@pytest.mark.parametrize("name", ["rated", "half"])
def test_response_is_that_of_the_best_angle_at_the_drives_own_voltage(name: str) -> None:
    r = getattr(brief().found, f"{name}_response")
    claim = row(f"Section 4: the torque response time at {name}")
    assert si(claim.paper_says, claim.unit) == r.point.response
    assert claim.unit == "ms" and f" {r.point.response * 1e3:g} ms " in claim.claim
    assert si(claim.model_gives, "ms") == r.reached[1].min()
    assert si(claim.physical_limit, "ms") == r.bound[1].min()
    assert said(claim, "in less than", "ms") == pytest.approx(r.bound[1].min(), abs=1e-6)
    assert said(claim, "rotor angle,", "ms") == pytest.approx(r.bound[1].max(), abs=1e-5)
    assert said(claim, "ours takes", "ms") == pytest.approx(r.reached[1].min(), abs=1e-6)
    assert said(claim, "from", "deg") == r.theta_deg[r.reached[1].argmin()]
    voltage = row(f"Section 4: the dc-link voltage that {r.point.response * 1e3:g} ms at {name}")
    assert (voltage.model_gives, voltage.physical_limit) == (r.u_reached, r.u_least)
    assert voltage.unit == "V" and voltage.paper_says is None
    assert said(voltage, "V from the worst angle,", "V") == round(r.u_least_standstill)
    assert said(voltage, "every phase that helps on full voltage\\),", "V") == round(r.u_least_any)


def test_ratio_of_half_torque_to_rated_is_below_one_for_the_paper_and_for_ours() -> None:
    claim = row("Section 4: the response is faster at half torque")
    rated, half = brief().found.rated_response, brief().found.half_response
    assert claim.paper_says == pytest.approx(0.28 / 0.35)
    assert claim.model_gives == half.reached[1].min() / rated.reached[1].min()
    assert claim.physical_limit == half.bound[1].min() / rated.bound[1].min()
    assert claim.verdict == "confirmed"
    slower, of = sum(half.reached[1] > rated.reached[1]), half.theta_deg.size
    assert f"at {slower} of {of} angles it is slower" in claim.why and 0 < slower < of


def test_settings_are_judged_by_the_fastest_and_horizons_by_the_torque_error() -> None:
    found = brief().found
    claim = row("Section 4: a good setting")
    assert si(claim.model_gives, claim.unit) == min(s.response for s in found.settings)
    assert si(claim.physical_limit, claim.unit) == found.rated_response.bound[1].min()
    claim = row("Section 4: the result hangs on the choice")
    errors = [s.kpis.torque_error_rms for s in found.settings if s.name != "r_w"]
    low, high = min(errors), max(errors)
    assert claim.model_gives == pytest.approx(high / low) and claim.unit == "1"
    assert f"within {100 * low:.2f} and {100 * high:.2f} %" in claim.why
    worst = max(s.kpis.torque_error_rms for s in found.settings if s.name == "r_w")
    assert f"{100 * worst:.1f} % at the greatest r_w" in claim.why


def test_transient_is_the_greatest_torque_of_the_first_5_ms() -> None:
    run = brief().found.rated_response.start
    claim = row("Section 4: the drive develops a high torque")
    assert claim.model_gives == run.tau[run.t < 5e-3].max() and claim.unit == "N m"
    assert said(claim, "by", "%") == pytest.approx(run.tau.max() / 41.339 - 1, abs=2e-3)


def swing(values: Any) -> float:
    return float(np.ptp(values) / np.mean(values))


@pytest.mark.parametrize("name", ["rated", "half"])
def test_steady_state_is_read_off_the_waveforms(name: str) -> None:
    runs: Runs = getattr(brief().found, name)
    held, pumping, rpm = runs.locked, runs.pump, f"{runs.point.speed_rpm:g}"
    end = held.t > held.t[-1] / 2
    claim = row(f"Section 4: in steady state at {name}")
    assert si(claim.model_gives, claim.unit) == pytest.approx(swing(held.tau[end]), rel=0.02)
    fine = np.linspace(held.t[-1] / 2, held.t[-1], 100_000)  # straight lines between the points
    error = np.std(np.interp(fine, held.t, held.tau)) / runs.point.tau_ref
    assert said(claim, "rms error", "%") == pytest.approx(error, rel=0.02)
    turned_on = np.sum(np.diff(held.leg[:, end]) > 0) / np.ptp(held.t[end])  # of 6 switches
    assert said(claim, "At", "kHz") == pytest.approx(turned_on / 6, rel=0.1)
    claim = row(f"Section 4: in steady state at {rpm} rpm")
    assert si(claim.model_gives, claim.unit) == pumping.kpis.speed_ripple_pp
    assert claim.paper_says == claim.physical_limit == 0
    last = pumping.omega_m[pumping.t > pumping.t[-1] - 0.02]
    assert numbers(claim.why)[0] * RPM == pytest.approx(np.ptp(last), rel=0.1)
    claim = row(f"Fig. 8: from standstill the drive reaches and holds {rpm} rpm")
    assert si(claim.model_gives, claim.unit) == pytest.approx(last.mean(), rel=1e-4)
    assert si(claim.paper_says, claim.unit) == pytest.approx(runs.point.speed_rpm * RPM)
    assert "at most 45 N m" in claim.why


@pytest.mark.parametrize("name", ["rated", "half"])
def test_losses_and_efficiency_follow_from_current_and_torque(name: str) -> None:
    """Three phases heat 0.72 ohm, in a drive without other losses."""
    runs: Runs = getattr(brief().found, name)
    current = row(f"Abstract: the MPC minimises the stator currents ({name}")
    loss = row(f"Table 1: R_s = 0.72 ohm in a 6 kW machine (copper loss at {name}")
    efficiency = row(f"Introduction: the SRM has a good efficiency (this one at {name}")
    work = runs.point.tau_ref * runs.point.speed_rpm * RPM
    for i, heat, eta in (
        (current.model_gives, loss.model_gives, efficiency.model_gives),
        (current.physical_limit, loss.physical_limit, efficiency.physical_limit),
    ):
        lost = si(heat, loss.unit)
        assert lost == pytest.approx(3 * 0.72 * si(i, current.unit) ** 2, rel=1e-3)
        assert si(eta, efficiency.unit) == pytest.approx(work / (work + lost), rel=1e-3)
    above = si(current.model_gives, "A rms") / si(current.physical_limit, "A rms") - 1
    assert numbers(current.why)[0] == pytest.approx(100 * above, abs=0.06)
    assert numbers(loss.why)[0] == pytest.approx(si(loss.model_gives, "W") / 1e3, abs=6e-3)
    assert numbers(loss.why)[1] == pytest.approx(work / 1e3, rel=2e-3)


def fake(**kpis: float) -> Runs:
    """Runs with some key figures changed, held and with the pump."""
    runs = brief().found.rated
    held = SimpleNamespace(drive=runs.locked.drive, kpis=replace(runs.locked.kpis, **kpis))
    pumping = SimpleNamespace(drive=runs.pump.drive, kpis=replace(runs.pump.kpis, **kpis))
    return replace(runs, locked=held, pump=pumping)


@pytest.mark.parametrize(
    ("claim", "key", "holds", "fails"),
    [
        (results.torque_ripple, "torque_ripple_pp", [0.0, 0.99e-3], [1.01e-3]),  # "under 0.1 %"
        (results.speed_ripple, "speed_ripple_pp", [0.0, 0.99e-3], [1.01e-3]),  # "under 0.1 %"
        (results.speed_held, "speed_mean", [1498.6 * RPM, 1501.4 * RPM], [1498 * RPM, 1502 * RPM]),
        (results.least_current, "i_rms", [1.0, 1.08], [1.081]),  # "up to 8 %"
        (results.efficiency, "efficiency", [0.8, 0.9], [0.799]),  # "80 % or more"
    ],
)
def test_verdict_of_a_steady_state_changes_at_the_limit_that_the_reason_states(
    claim: Callable[[Runs], Claim], key: str, holds: list[float], fails: list[float]
) -> None:
    of = brief().found.rated.best.i_rms if key == "i_rms" else 1.0
    for values, verdict in ((holds, "confirmed"), (fails, "not confirmed")):
        for value in values:
            assert claim(fake(**{key: value * of})).verdict == verdict


def with_responses(rated: float, half: float) -> Study:
    """The study with these response times, of the best angle and the drive's voltage [s]."""
    found = brief().found
    those = [
        replace(r, reached=np.array([[1.0, 1.0, 1.0], [2 * t, t, 3 * t]]))
        for r, t in ((found.rated_response, rated), (found.half_response, half))
    ]
    return replace(found, rated_response=those[0], half_response=those[1])


def test_verdicts_of_the_response_compare_times() -> None:
    for rated, verdict in ((0.349e-3, "confirmed"), (0.351e-3, "not confirmed")):
        assert results.response_time(with_responses(rated, 1).rated_response).verdict == verdict
    for half, verdict in ((0.99e-3, "confirmed"), (1.01e-3, "not confirmed")):
        assert results.half_is_faster(with_responses(1e-3, half)).verdict == verdict
    fastest = min(s.response for s in brief().found.settings)
    for times, verdict in ((1.001, "not confirmed"), (1.1, "confirmed")):
        claim = results.better_setting(with_responses(times * fastest, 1))
        assert claim.verdict == verdict
        assert claim.unit == "ms" and claim.model_gives == pytest.approx(1e3 * fastest)
        r = brief().found.rated_response
        assert claim.physical_limit == pytest.approx(1e3 * r.bound[r.own].min())


def test_horizons_matter_where_they_double_the_error_and_weights_are_not_counted() -> None:
    found = brief().found

    def errors(**of: list[float]) -> Claim:
        some = found.settings[0]
        made = [
            replace(some, name=name, kpis=replace(some.kpis, torque_error_rms=value))
            for name, values in of.items()
            for value in values
        ]
        return results.horizons(replace(found, settings=made))

    assert errors(N_p=[0.01, 0.019], N_c=[0.015], r_w=[0.5]).verdict == "not confirmed"
    assert errors(N_p=[0.01, 0.012], N_c=[0.021], r_w=[0.01]).verdict == "confirmed"
    assert errors(N_p=[0.02], N_c=[0.01], r_w=[0.01]).model_gives == pytest.approx(2)


def test_water_with_and_without_a_converter_is_that_of_the_table() -> None:
    with (Path(paper.__file__).parent / "dc_dc.csv").open(encoding="utf-8") as file:
        water = list(csv.DictReader(file))
    direct, real, ideal = (
        {(w["weather"], int(w["n_series"])): float(w[of]) for w in water}
        for of in ("direct_m3", "converter_97_m3", "converter_ideal_m3")
    )
    claim = row("Section 5: no dc-dc converter is needed")
    year = ("year", 7)
    assert (claim.unit, claim.verdict) == ("%", "confirmed") and "7 modules" in claim.claim
    assert si(claim.model_gives, "%") == pytest.approx(real[year] / direct[year] - 1)
    assert si(claim.physical_limit, "%") == pytest.approx(ideal[year] / direct[year] - 1)
    series = sorted({n for _, n in direct})
    better = [n for n in series if all(real[w, m] < direct[w, m] for w, m in direct if m == n)]
    assert f"for {better[0]} to {better[-1]} modules in series" in claim.why
    most, worst = max((real[key] / direct[key] - 1, key) for key in direct)
    assert f"With {worst[1]} in series" in claim.why and f"up to {100 * most:.0f} %" in claim.why


def flux(i: float, theta_e: float) -> float:
    return float(RATED.drive().machine.psi(i, theta_e))


def test_equations_are_compared_with_difference_quotients_of_the_flux() -> None:
    """At 22.5 deg and 50 A, in a machine whose electrical angle is 4 times the mechanical one."""
    step, omega_m, i, u = 1e-5, 1500 * RPM, 50.0, 240.0
    L_inc = (flux(i + step, np.pi / 2) - flux(i - step, np.pi / 2)) / (2 * step)
    slope = 4 * (flux(i, np.pi / 2 + step) - flux(i, np.pi / 2 - step)) / (2 * step)
    emf = omega_m * slope
    claim = row("Eq. 2.1: the motional voltage")
    assert claim.unit == "V" and claim.model_gives == pytest.approx(emf, rel=1e-6)
    assert claim.paper_says == pytest.approx(omega_m * L_inc, rel=1e-6)
    claim = row("Eq. 2.4: di/dt")
    assert claim.unit == "A/s"
    assert claim.model_gives == pytest.approx((u - 0.72 * i - emf) / L_inc, rel=1e-6)
    assert claim.paper_says == pytest.approx(u / L_inc - 0.72 * i - emf, rel=1e-6)


def test_speed_equation_as_printed_rests_at_a_million_rpm() -> None:
    claim = row("Eq. 2.4: domega/dt")
    printed = si(claim.paper_says, claim.unit)
    assert 41.339 / 0.008 - 0.02 * printed == pytest.approx(0, abs=1e-9)
    rest = si(claim.model_gives, claim.unit)
    assert 41.339 - 0.0015 * rest**2 - 0.02 * rest == pytest.approx(0, abs=1e-9)


@pytest.mark.parametrize(
    ("start", "says", "gives", "limit", "verdict"),  # the table of errata, docs/paper.md
    [
        ("Table 1: 6 kW", 41.339, 38.20, None, "not confirmed"),
        ("Section 4: with 41.339 N m the pump", 1500, 1522.9, None, "not confirmed"),
        ("Section 4: with 20.669 N m the pump", 1060.7, 1059.1, None, "not confirmed"),
        ("Section 3: the position function", 6, 0, 0, "not confirmed"),
        ("Section 3: the torque equation", 19.375, 0, 0, "not confirmed"),
        ("Section 3: flux is linear", "linear", 1, 1, "confirmed"),
        ("Section 3: the flux at the maximum point", 0.468, 0.486, None, "not confirmed"),
        ("Section 3: the maximum point lies", 0.468, 0.438, None, "not confirmed"),
        ("Eq. 3.1: with the printed A, B, C", "acts", 0, None, "not confirmed"),
        ("Eq. 3.1: the printed pair", 6, 3, 6, "not confirmed"),
        ("Eq. 3.1, A row 6", 41.339, "no state", None, "not confirmed"),
        ("Eq. 3.1, A row 4", 4629, -61.4, None, "not confirmed"),
    ],
)
def test_errata_are_those_of_the_page(
    start: str, says: object, gives: object, limit: object, verdict: str
) -> None:
    claim = row(start)
    for value, expected in ((claim.paper_says, says), (claim.model_gives, gives)):
        near = expected if isinstance(expected, str) else pytest.approx(expected, 2e-3, 1e-9)
        assert value == near
    assert (claim.physical_limit, claim.verdict) == (limit, verdict)


def test_generic_flux_lowers_the_least_current_as_the_page_says() -> None:
    assert "from 48.9 to 47.6 A" in row("Section 3: the flux at the maximum point").why
    assert "has 0.438 Wb" in row("Section 3: the maximum point lies").why
    assert "Delta u = 0:" in row("Eq. 3.1: with the printed A, B, C").why


def test_the_circuit_equation_is_judged_by_the_derivatives_of_the_flux_linkage() -> None:
    """At 50 A, half way to alignment, 1500 rpm and 240 V."""
    i, theta_e, di, dtheta = 50.0, np.pi / 2, 1e-3, 1e-5
    L_inc = (flux(i + di, theta_e) - flux(i - di, theta_e)) / (2 * di)
    slope = 4 * (flux(i, theta_e + dtheta) - flux(i, theta_e - dtheta)) / (2 * dtheta)
    omega_m = 1500 * RPM
    emf = row("Eq. 2.1: the motional voltage")
    assert emf.paper_says == pytest.approx(omega_m * L_inc, rel=1e-5)
    assert emf.model_gives == pytest.approx(omega_m * slope, rel=1e-5)
    rise = row("Eq. 2.4: di/dt")
    left = 240 - 0.72 * i - omega_m * slope
    assert rise.paper_says == pytest.approx(240 / L_inc - 0.72 * i - omega_m * slope, rel=1e-5)
    assert rise.model_gives == pytest.approx(left / L_inc, rel=1e-4)


def test_current_that_decays_keeps_the_part_of_a_sample_and_the_printed_one_a_rate() -> None:
    """At 450 A and 15 deg from alignment the pole is -R/L_inc, and the sample 20 us."""
    step, theta_e = 1e-3, np.pi - 4 * np.radians(15)
    L_inc = (flux(450 + step, theta_e) - flux(450 - step, theta_e)) / (2 * step)
    claim = row("Eq. 3.1: x(k+1)")
    assert claim.paper_says == pytest.approx(-0.72 / L_inc, rel=1e-5)
    assert claim.model_gives == pytest.approx(np.exp(-0.72 * 20e-6 / L_inc), rel=1e-7)
    assert f"a = {L_inc * 1e3:.2f} mH" in claim.why and "T_s = 20 us" in claim.why


def test_torque_of_the_name_plate_is_power_over_speed() -> None:
    claim = table_1()
    assert claim.model_gives == pytest.approx(6000 / (1500 * RPM))
    assert claim.why.startswith("P/omega = 38.20 N m; 41.339 N m at 1500 rpm is 6.49 kW")


def test_pump_takes_the_rest_of_the_torque_from_friction_and_names_the_cause() -> None:
    rated, half = (
        pump_equilibrium(point, runs.free)
        for point, runs in ((RATED, brief().found.rated), (HALF, brief().found.half))
    )
    omega_m = 1500 * RPM
    asked = f"{0.0015 * omega_m**2:.2f} N m of pump and {0.02 * omega_m:.2f} N m of friction"
    assert asked in rated.why and "1500/sqrt(2) is 1060.7" in half.why
    for claim, free in ((rated, brief().found.rated.free), (half, brief().found.half.free)):
        comes_to_rest = said(claim, "comes to rest at", "rpm")
        assert comes_to_rest == pytest.approx(free.speed_mean, abs=0.06 * RPM)
        assert said(claim, "its mean torque being", "N m") == pytest.approx(free.tau_mean, abs=6e-3)
