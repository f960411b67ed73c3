"""From the axes of a file to the convention, by formula: which axis, which half, which end; fits
and periods whose figures are known beforehand."""

from dataclasses import replace

import numpy as np
import pytest

from reluctance import ParameterError
from reluctance.machine.maps import FluxTable, fit_lehuy, fit_two_term, identify
from reluctance.machine.maps.conventions import _is_current, settled
from reluctance.machine.maps.fit import TwoTermFit
from reluctance.machine.maps.no_current import is_noise, offset_of
from reluctance.machine.maps.periods import _repeats, check_rises_once
from reluctance.machine.maps.pulses import Pulse, Recording
from reluctance.machine.maps.raw import RawMap

CURRENTS = np.linspace(0, 10, 11)
FLUX = 1 - np.exp(-CURRENTS / 4)


def over(theta_e, aligned=np.pi):
    """psi (n_i, n_theta): even about alignment, and saturating."""
    return np.outer(FLUX, 0.5 + 0.3 * np.cos(np.asarray(theta_e) - aligned))


def raw(degrees, psi=None, tau=None, **said):
    degrees = np.asarray(degrees, float)
    usual = {"layout": "currents_down", "N_r": 6, "angle_unit": "deg", "angle_kind": "electrical"}
    psi = over(np.radians(degrees)) if psi is None else psi
    return RawMap(CURRENTS, degrees, psi, tau, **usual | said)


HALF, WHOLE = np.linspace(0, 180, 19), np.linspace(0, 360, 37)


def test_both_ends_of_a_whole_period_are_meant_and_their_difference_told():
    """Of the largest flux linkage; torque of the first end."""
    psi = over(np.radians(WHOLE))
    psi[:, 0] *= 0.96
    found = settled(raw(WHOLE, psi))
    assert found.theta_e == pytest.approx(np.radians(WHOLE[:-1]))
    assert found.psi[:, 0] == pytest.approx(0.98 * psi[:, -1])
    assert np.array_equal(found.psi[:, 1:], psi[:, 1:-1])
    assert found.period_error == pytest.approx(0.04 * psi[-1, -1] / psi.max())
    assert settled(raw(WHOLE[:-1])).period_error == 0


def test_a_half_period_that_is_nearly_one_is_stretched_to_it():
    """Up to a hundredth; beyond, it is none."""
    for end in (178.3, 181.7):
        found = settled(raw(HALF * end / 180, over(np.radians(HALF))))
        assert found.theta_e == pytest.approx(np.radians(HALF)) and found.theta_e[-1] == np.pi
    uneven = np.array([0, 10, 25, 60, 90, 120, 179.0])
    found = settled(raw(uneven))
    assert found.theta_e == pytest.approx(np.radians(uneven) * 180 / 179)
    for end in (178.1, 181.9):
        with pytest.raises(ParameterError, match=r"cover 18?1?7?8?\.[19] deg el\."):
            settled(raw(HALF * end / 180, over(np.radians(HALF))))


@pytest.mark.parametrize("n", [37, 100, 120, 181, 360, 721])
@pytest.mark.parametrize("zero", [0, 180, 7.3])
def test_the_last_of_many_angles_of_a_whole_period_is_no_second_first_one(n, zero):
    """However near: a file has as many angles as the period, or one more."""
    open_end = np.arange(n) * 360 / n + zero
    found = settled(raw(open_end))
    assert len(found.theta_e) == n and found.period_error == 0
    assert found.psi == pytest.approx(over(found.theta_e), abs=1e-6)
    closed = settled(raw(np.append(open_end, 360 + zero)))
    assert len(closed.theta_e) == n
    assert closed.psi == pytest.approx(found.psi, abs=1e-6)


@pytest.mark.parametrize("n", [101, 181, 361])
@pytest.mark.parametrize("past", [False, True])
@pytest.mark.parametrize("ends", [slice(0, -1), slice(1, None), slice(1, -1)])
def test_an_end_of_a_half_period_that_is_a_sample_away_follows_from_symmetry(n, past, ends):
    """A stretched table would have the torque of another angle."""
    degrees = np.linspace(0, 180, n)[ends] + 180 * past
    tau = np.outer(CURRENTS**2, np.sin(np.radians(degrees)))
    if 180 - np.ptp(degrees) > 1.8:
        with pytest.raises(ParameterError, match="deg el"):
            settled(raw(degrees, tau=tau))
        return
    found = settled(raw(degrees, tau=tau))
    assert found.theta_e == pytest.approx(np.linspace(0, np.pi, n))
    assert found.psi == pytest.approx(over(found.theta_e), abs=1e-7)
    assert found.tau == pytest.approx(np.outer(CURRENTS**2, np.sin(found.theta_e)), abs=1e-5)
    assert any("those at its ends by symmetry" in note for note in found.notes)


@pytest.mark.parametrize("turned", [False, True])
def test_what_lacks_at_an_end_is_held_against_the_finer_of_both_ends(turned):
    """1.5 deg are a sample of their own where such steps lead there, though others have 6 deg."""
    degrees = np.append(np.arange(0.0, 90, 6), np.arange(90, 179, 1.5))
    degrees = (180 - degrees)[::-1] if turned else degrees
    found = settled(raw(degrees))
    assert any("those at its ends by symmetry" in note for note in found.notes)
    assert found.psi == pytest.approx(over(found.theta_e), abs=1e-4)


@pytest.mark.parametrize(("off", "exact"), [(0.0, True), (0.99e-6, True), (1.03e-6, False)])
@pytest.mark.parametrize("degrees", [HALF, WHOLE, WHOLE[:-1]], ids=["half", "whole", "open"])
def test_angles_that_are_even_up_to_rounding_are_exactly_even(degrees, off, exact):
    """To a millionth of a radian: every unit of the file gives the same machine."""
    even = np.linspace(0, np.pi, 19) if degrees is HALF else np.linspace(0, 2 * np.pi, 37)[:-1]
    angle = np.radians(degrees)
    angle[5] += off
    found = settled(raw(angle, over(angle), angle_unit="rad"))
    assert np.array_equal(found.theta_e, even) == exact
    if exact and not off:
        assert np.array_equal(settled(raw(degrees)).theta_e, even)
    else:
        assert found.theta_e[5] - even[5] == pytest.approx(0 if exact else off, abs=1e-12)


def test_a_half_past_alignment_is_mirrored_and_one_between_is_refused():
    """Torque changes its sign as the angle turns round."""
    past = HALF + 180
    tau = np.outer(FLUX**2, -np.sin(np.radians(past - 180)))
    found = settled(raw(past, tau=tau, zero="unaligned"))
    assert found.psi == pytest.approx(over(np.radians(HALF)))
    assert found.tau == pytest.approx(np.outer(FLUX**2, np.sin(np.radians(HALF))), abs=1e-12)
    assert "half period past alignment mirrored" in found.notes
    with pytest.raises(
        ParameterError, match=r"the half period starts at 20 deg el\., need 0 or 180"
    ):
        settled(raw(HALF + 20, over(np.radians(HALF)), zero="unaligned"))


@pytest.mark.parametrize("first", [7.0, 3.3])
def test_a_period_without_a_sample_at_its_zero_gets_even_angles_by_a_spline(first):
    degrees = first + np.arange(0, 360, 10.0)
    tau = np.outer(FLUX**2, np.sin(np.radians(degrees)))
    found = settled(raw(degrees, tau=tau, zero="unaligned"))
    assert found.theta_e == pytest.approx(np.radians(np.arange(0, 360, 10.0)), abs=1e-12)
    assert found.psi == pytest.approx(over(found.theta_e), abs=1e-5)
    assert found.tau == pytest.approx(np.outer(FLUX**2, np.sin(found.theta_e)), abs=2e-5)
    assert "no sample at angle zero: 36 even angles by a periodic spline" in found.notes


@pytest.mark.parametrize("shift", [0.0, 180.0])
@pytest.mark.parametrize(
    "degrees",
    [HALF, WHOLE, WHOLE[:-1], np.linspace(0, 180, 7)],
    ids=["half", "whole", "open", "coarse"],
)
def test_the_zero_is_read_from_where_the_flux_is_largest(degrees, shift):
    aligned = np.pi + np.radians(shift)
    found = settled(raw(degrees, over(np.radians(degrees), aligned)))
    assert found.psi == pytest.approx(over(found.theta_e))
    name = "aligned" if shift else "unaligned"
    assert f"angle zero read as {name}, from where the flux is largest" in found.notes


@pytest.mark.parametrize(("off", "told"), [(9.9, False), (10.1, True), (-10.1, True)])
def test_a_zero_that_is_ten_degrees_off_is_asked_for(off, told):
    """With the angle of alignment in the file's unit: mechanical degrees here."""
    psi = over(np.radians(WHOLE), np.pi + np.radians(off))
    given = raw(WHOLE / 6, psi, angle_kind="mechanical")
    if not told:
        settled(given)
        return
    at = f"{(180 + off) / 6 - (60 if off > 0 else 0):.4g}"
    with pytest.raises(ParameterError, match=f"need 0 or 180; .*aligned_at={at} "):
        settled(given)
    assert settled(given, aligned_at=float(at)).psi.max() == pytest.approx(psi.max(), rel=1e-3)


def test_a_zero_at_the_wrong_end_is_told_with_the_right_one():
    for zero, other in (("aligned", "unaligned"), ("unaligned", "aligned")):
        psi = over(np.radians(HALF), np.pi if zero == "aligned" else 0.0)
        with pytest.raises(ParameterError, match=f"zero = {zero}, .* pass zero={other} "):
            settled(raw(HALF, psi), zero=zero)
        settled(raw(HALF, psi), zero=other)


@pytest.mark.parametrize(
    ("end", "kind", "told"),
    [
        (150, "electrical", "cover 150 .* 180 or 360; extend the map, or correct N_r or the unit"),
        (200, "electrical", "cover 200 .* 180 or 360; cut it there, or correct N_r or the unit"),
        (45, "mechanical", "cover 270 .*; cut it there, or correct N_r .4 or 8. or the unit"),
        (22.5, "mechanical", "cover 135 .*; extend the map, or correct N_r .8 or 16. or the"),
        (24, "mechanical", "cover 144 .*; extend the map, or correct N_r .15. or the unit"),
        (
            25.7,
            "mechanical",
            "cover 154.2 .*; extend the map, or correct N_r .7 or 14. or the unit",
        ),
        (26, "mechanical", "cover 156 .*; extend the map, or correct N_r or the unit"),
    ],
)
def test_angles_that_are_no_period_are_told_with_the_poles_that_make_them_one(end, kind, told):
    """Of mechanical angles: as many poles as make half a period, or a whole one, to a hundredth."""
    given = raw(np.linspace(0, end, 16), over(np.linspace(0, np.pi, 16)), angle_kind=kind)
    with pytest.raises(ParameterError, match=told):
        settled(given)


def test_an_axis_along_which_the_flux_starts_from_nothing_is_that_of_currents():
    psi = over(np.radians(HALF))
    assert _is_current(CURRENTS, psi) and not _is_current(HALF, psi.T)
    for part, yes in ((0.019, True), (0.021, False)):
        some = psi.copy()
        some[0, 3] = part * psi.max()
        assert _is_current(CURRENTS, some) == yes
    assert not _is_current(CURRENTS - 1, psi) and not _is_current(CURRENTS[:1], psi[:1])
    late = CURRENTS[3:]  # none at zero: flux per current does not grow, and flux rises
    assert _is_current(late, psi[3:]) and _is_current(late[::-1], psi[:2:-1])
    flat = np.ones((8, 10)) * np.linspace(1, 1.5, 8)[:, None]
    for falls, yes in ((6, True), (8, False)):  # of 70 steps, less than a tenth may fall
        some = flat.copy()
        some[4, :falls] = some[3, :falls] - 0.01
        assert _is_current(np.arange(5.0, 13.0), some) == yes
    for grows, yes in ((1.04, True), (1.06, False)):
        steep = np.array([1.0, 2 * grows])[:, None] * np.ones((2, 4))
        assert _is_current(np.array([1.0, 2.0]), steep) == yes


@pytest.mark.parametrize(("part", "refused"), [(0.019, False), (0.021, True)])
def test_flux_at_no_current_is_set_to_nothing_up_to_a_fiftieth(part, refused):
    psi = over(np.radians(HALF))
    psi[0] = part * psi.max()
    if refused:
        with pytest.raises(ParameterError, match=r"flux at 0 A is .* Wb, need 0"):
            settled(raw(HALF, psi))
        return
    found = settled(raw(HALF, psi))
    assert not found.psi[0].any() and np.array_equal(found.psi[1:], psi[1:])
    assert f"flux of {part * psi[1:].max():.2g} Wb at 0 A set to 0" in found.notes


def test_flux_at_no_current_is_noise_where_its_mean_and_its_neighbours_are_those_of_noise():
    """Of +a and -a: rms a, and 2/(n - 1) of the squares a change of sign makes of the ratio."""
    a = np.where(np.arange(36) % 2, 1.0, -1.0)
    assert is_noise(a[:8], 40.0) and not is_noise(a[:7], 40.0)
    assert is_noise(0.0299 * a, 1.0) and not is_noise(0.0301 * a, 1.0)
    # A mean of c: at most three times sqrt(1 + c^2)/6.
    assert is_noise(a + 0.57, 40.0) and not is_noise(a + 0.585, 40.0)
    assert is_noise(a - 0.57, 40.0) and not is_noise(a - 0.585, 40.0)
    for changes, noise in ((6, False), (7, True)):
        at = np.arange(25) // 4 if changes == 6 else np.arange(25) // 3
        slow = np.where(np.minimum(at, changes) % 2, 1.0, -1.0)
        assert np.count_nonzero(np.diff(slow)) == changes and is_noise(slow, 40.0) == noise
    a[3] = np.nan
    assert not is_noise(a, 40.0)


@pytest.mark.parametrize(("share", "shared"), [(0.49, False), (0.51, True), (1.49, True)])
def test_an_offset_is_shared_by_lines_through_the_next_two_rows(share, shared):
    """Of three currents at uneven steps, at the median of the angles: lines that meet no current
    within half of the offset, on either side."""
    i, slopes, at_zero = np.array([0.0, 2.0, 5.0]), np.array([0.03, 0.05, 0.09]), 0.004
    psi = share * at_zero + np.outer(i, slopes)
    psi[0] = at_zero - 0.001, at_zero, at_zero + 0.02
    assert offset_of(i, psi) == (at_zero if shared else 0.0)
    assert offset_of(i, -psi) == (-at_zero if shared else 0.0)
    assert offset_of(i[:2], psi[:2]) == 0.0


@pytest.mark.parametrize("seed", [8101, 8102, 8103])
def test_an_offset_is_found_between_coarse_currents_of_iron_that_saturates(seed):
    """Of all rows, or of the one at 0 A alone, from 0.2 % of the greatest flux linkage on."""
    random = np.random.default_rng(seed)
    for _ in range(50):
        i = np.linspace(0, 10 ** random.uniform(0, 2.5), random.integers(6, 40))
        most = 10 ** random.uniform(-2, 0.3)
        aligned = (1 - np.cos(np.linspace(0, np.pi, random.integers(10, 60)))) / 2
        unaligned = random.uniform(0.05, 0.35) * most * i / i[-1]
        iron = most * (1 - np.exp(-random.uniform(1, 8) / i[-1] * np.outer(i, aligned)))
        psi = unaligned[:, None] + iron
        offset = random.choice([-1, 1]) * 10 ** random.uniform(-2.7, -1.72) * psi.max()
        assert offset_of(i, psi + offset) == pytest.approx(offset, rel=1e-9)
        psi[0] = offset
        assert offset_of(i, psi) == 0.0


def test_a_flux_of_the_other_sense_is_told_with_what_makes_it_right():
    given = raw(HALF)
    settled(given)
    with pytest.raises(ParameterError, match="multiply the flux linkages by -1") as fault:
        settled(replace(given, psi=-given.psi))
    assert f"at {CURRENTS[-1]:g} A: the sense of the coil" in str(fault.value)
    for sign in (1, -1):
        with pytest.raises(ParameterError, match="multiply the currents by -1, and the flux"):
            settled(replace(given, rows=-np.array(CURRENTS), psi=sign * given.psi))


@pytest.mark.parametrize("angles", [HALF, [*HALF, *(360 - a for a in HALF[-2:0:-1])]])
def test_flux_and_torque_under_each_others_names_are_told(angles):
    given = raw(angles)
    tau = np.outer(FLUX**2, np.sin(np.radians(angles)))
    assert settled(replace(given, tau=tau)).psi.max() == pytest.approx(given.psi.max())
    with pytest.raises(ParameterError, match="flux linkage and torque look exchanged"):
        settled(replace(given, psi=tau, tau=given.psi))


@pytest.mark.parametrize("unit", [1.0, 0.1])
def test_currents_that_start_above_zero_get_a_row_without_flux(unit):
    given = raw(HALF)
    tau = np.outer(FLUX**2, np.sin(np.radians(HALF)))
    late = replace(given, rows=unit * CURRENTS[2:], psi=given.psi[2:], tau=tau[2:])
    found = settled(late)
    assert found.i.tolist() == [0, *(unit * CURRENTS[2:])]
    assert not found.psi[0].any() and not found.tau[0].any()
    assert np.array_equal(found.psi[1:], given.psi[2:])
    assert "row at 0 A added: no flux, no torque" in found.notes


@pytest.mark.parametrize("count", [2, 3])
@pytest.mark.parametrize("closed", [True, False])
def test_of_several_periods_the_first_is_taken(count, closed):
    degrees = np.arange(36 * count + closed) * 10.0
    tau = np.outer(FLUX**2, np.sin(np.radians(degrees)))
    found = settled(raw(degrees, tau=tau))
    assert found.theta_e == pytest.approx(np.radians(WHOLE[:-1]))
    assert found.psi == pytest.approx(over(found.theta_e))
    assert found.tau == pytest.approx(tau[:, :36]) and found.period_error < 1e-12
    assert f"{count} periods of 360 deg electrical: the first one is taken" in found.notes


@pytest.mark.parametrize("samples", [14, 16])
def test_periods_of_few_samples_without_the_last_are_told_from_parts_of_them(samples):
    """Of 45 deg each: 16 end a sample before two whole periods, 14 end three before."""
    degrees = np.arange(samples) * 45.0
    if samples == 16:
        assert settled(raw(degrees)).notes[0].startswith("2 periods of 360 deg electrical")
    else:
        with pytest.raises(ParameterError, match="cut it there"):
            settled(raw(degrees))


@pytest.mark.parametrize(("off", "same"), [(0.0402, True), (0.0414, False)])
def test_periods_are_the_same_to_a_fiftieth_of_the_rise(off, same):
    """Of 2 in a cosine, and what the second one is higher; three samples in common tell it."""
    angle = np.arange(73) * 10.0
    psi = np.cos(np.radians(angle)) + off * (angle >= 360)
    assert _repeats(angle, psi[None], 360.0) == same
    few = np.cos(np.radians(angle))[None, :39]
    assert _repeats(angle[:39], few, 360.0) and not _repeats(angle[:38], few[:, :38], 360.0)


@pytest.mark.parametrize(("waves", "said"), [(1, None), (2, "2 times"), (4, "N_r is 4")])
def test_a_period_in_which_the_flux_rises_more_than_once_is_several(waves, said):
    theta = np.radians(np.append(np.arange(0, 360, 7.0), 360))
    flux = 1 - 0.5 * np.cos(waves * theta) - 0.1 * np.cos(3 * waves * theta)
    if said is None:
        check_rises_once(theta, flux)
        return
    with pytest.raises(ParameterError, match=said):
        check_rises_once(theta, flux)


def two_terms(**values):
    usual = {
        "N_r": 6, "L_u_H": 2e-3, "L_0_H": 5e-3, "A_Wb": (0.3, 0.2), "B_per_A": (1 / 8, 1 / 40),
        "shapes": ((1.0, 0.5), (3.0, -1.0), (-1.0, 0.2)), "psi_error_rms": 0, "psi_error_max": 0,
    }  # fmt: skip
    return TwoTermFit(**usual | values)


def test_torque_of_two_terms_is_the_derivative_of_the_energy_of_their_flux():
    """Over a whole period: against differences of the co-energy, by the trapezoid rule."""
    i, theta = np.linspace(0, 60, 3001), np.radians(np.append(0, np.arange(5, 360, 50.0)))
    h = np.append(0, np.full(len(theta) - 1, 1e-4))
    found = two_terms().table(i, theta)
    energy = [
        np.cumsum((p[1:] + p[:-1]) / 2 * np.diff(i)[:, None], axis=0)
        for p in (two_terms().table(i, theta + x).psi for x in (h, -h))
    ]
    slope = 6 * (energy[0] - energy[1])[:, 1:] / 2e-4
    assert found.tau[1:, 1:] == pytest.approx(slope, rel=1e-4, abs=1e-4 * np.abs(slope).max())
    aligned = two_terms().table(np.arange(0, 40, 10.0), np.linspace(0, np.pi, 7)).psi[1, [0, -1]]
    rise = 0.3 * (1 - np.exp(-10 / 8)) + 0.2 * (1 - np.exp(-10 / 40))
    assert aligned == pytest.approx(np.array([0.02, 0.02 + 0.05 + rise]))


def test_two_terms_are_found_again_where_one_has_no_flux():
    """Le-Huy's machine is the case of one term: its residual is nothing, with two as with one."""
    i, theta = np.linspace(0, 60, 13), np.linspace(0, np.pi, 13)
    none = ((0.0, 0.0),) * 3
    table = two_terms(A_Wb=(0.4, 0.0), shapes=none, L_0_H=0.0).table(i, theta)
    assert fit_lehuy(table).psi_error_max < 1e-6
    assert fit_two_term(table).psi_error_max < 1e-4


@pytest.mark.parametrize("p", [-1.5, 1.0])
def test_two_terms_are_found_again_whichever_way_each_shape_leans(p):
    i, theta = np.linspace(0, 60, 13), np.linspace(0, np.pi, 13)
    shapes = ((p, 0.0), (0.5, 0.0), (-0.5, 0.0))
    found = fit_two_term(two_terms(shapes=shapes).table(i, theta))
    assert found.psi_error_max < 1e-6 and found.L_0_H == pytest.approx(5e-3, rel=1e-4)
    assert np.array(found.shapes) == pytest.approx(np.array(shapes), abs=1e-4)


def test_a_machine_without_flux_where_it_is_unaligned_is_found_again():
    """Searches for inductances start from those at the ends: here from nothing."""
    i, theta = np.linspace(0, 60, 13), np.linspace(0, np.pi, 13)
    x = theta / np.pi
    rise = 0.004 * i - 0.3 * np.expm1(-i / 15)
    table = FluxTable(6, i, theta, np.outer(rise, x**2 * (3 - 2 * x)))
    found = fit_lehuy(table)
    assert found.L_u_H == pytest.approx(0, abs=1e-9) and found.psi_error_max < 1e-6
    assert found.L_sat_H == pytest.approx(0.004, rel=1e-4)
    assert found.L_a_H == pytest.approx(0.004 + 0.3 / 15, rel=1e-4)
    assert found.psi_m_Wb - found.L_sat_H * found.i_m_A == pytest.approx(0.3, rel=1e-4)
    assert found.i_m_A == pytest.approx(15 * np.log(100), rel=1e-4)  # all but a hundredth


def recording(R):
    """Straight pulses at seven angles: a rise and a fall of the current in an inductance."""
    dt, U, pulses = 1e-5, 50.0, []
    for theta in np.linspace(0, np.pi, 7):
        L, i, u, up, rows = 0.03 - 0.02 * np.cos(theta), 0.0, 0.0, True, []
        for n in range(20000):  # the voltage of a row is that since the row before
            rows.append((n * dt, u, i))
            u = 0.0 if n < 30 else U if up else -U
            i = max((i - u / R) * np.exp(-R / L * dt) + u / R, 0.0)
            up = up and i < 5.0
            if not up and i == 0.0:
                break
        t, u, i = np.array(rows).T
        pulses.append(Pulse(float(np.degrees(theta)), t, u, i, True))
    return Recording(tuple(pulses), "deg", "electrical")


@pytest.fixture(scope="module")
def pulses():
    return recording(2.0)


@pytest.mark.parametrize(("R", "doubts"), [(2.0, False), (1.92, False), (2.12, True)])
def test_a_resistance_that_disagrees_with_the_pulses_by_a_twentieth_is_noted(pulses, R, doubts):
    """Rising and falling currents agree with that of the pulses, 2 ohm."""
    found = identify(pulses, N_r=6, R=R)
    assert found.R_closing == pytest.approx(2.0, rel=5e-3)
    assert (found.n_pulses, found.n_angles, found.i_noise) == (7, 7, 0.0)
    told = [note for note in found.table.notes if "rising and falling currents agree" in note]
    assert len(told) == doubts
    for note in told:
        assert "agree with 2 ohm, not with R_ohm = 2.12" in note
    if R == 2.0:
        L = 0.03 - 0.02 * np.cos(found.table.theta_e)
        assert found.table.psi == pytest.approx(np.outer(found.table.i, L), abs=2e-3)


def test_a_resistance_of_half_or_twice_that_of_the_pulses_is_refused(pulses):
    for R in (0.9, 4.2):
        with pytest.raises(ParameterError, match=f"not with R_ohm = {R:g}: check the resistance"):
            identify(pulses, N_r=6, R=R)
    for i_max in (0.0, 6.0):
        with pytest.raises(ParameterError, match=f"i_max_A = {i_max:g}, but not every angle"):
            identify(pulses, N_r=6, R=2.0, i_max=i_max)
    assert identify(pulses, N_r=6, R=2.0, i_max=3.0).table.i[-1] == 3.0
    for R in (-1.0, np.inf):
        with pytest.raises(ParameterError, match="need the resistance of the phase"):
            identify(pulses, N_r=6, R=R)
