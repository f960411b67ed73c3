"""Maps whose flux linkage has corners at the unaligned and aligned position: by closed form.

Without saturation and with an inductance that rises in a straight line over half a period,

    psi = (L_u + (L_a - L_u) theta_e/pi) i,    tau = N_r (L_a - L_u)/pi i^2/2,

and its mirror image with the negative torque over the other half. At the two positions in between
a table has the torque of one side.
"""

from dataclasses import replace

import numpy as np
import pytest

from reluctance.machine.maps import FluxTable, check_map
from reluctance.machine.maps.check import _inner_torque_error
from reluctance.machine.maps.surface import angle_cells, angle_coefficients
from reluctance.machine.maps.table import fold

N_R, L_U, L_A = 6, 0.01, 0.05
CURRENTS = np.linspace(0, 10, 11)
NOTE = "torque jumps at the unaligned and aligned position: one-sided values"


def straight(degrees, *, up=1.0, down=1.0, at_aligned=1.0, at_unaligned=1.0):
    """The torque of each half times a factor; that at alignment of the half before it or behind."""
    theta = np.radians(np.asarray(degrees, float))
    L = L_U + (L_A - L_U) * np.minimum(theta, 2 * np.pi - theta) / np.pi
    sign = np.where(theta < np.pi, up, -down)
    sign[np.isclose(theta, np.pi)], sign[np.isclose(theta, 0)] = at_aligned, at_unaligned
    tau = np.outer(N_R * (L_A - L_U) / np.pi * CURRENTS**2 / 2, sign)
    return FluxTable(N_R, CURRENTS, theta, np.outer(CURRENTS, L), tau)


HALF, WHOLE = np.arange(0, 181, 12), np.arange(0, 360, 12)
BETWEEN = np.arange(0, 181, 12) * 180 / 186  # no sample where the poles are aligned


@pytest.mark.parametrize("degrees", [HALF, WHOLE], ids=["half", "whole"])
@pytest.mark.parametrize("signs", [(1.0, 1.0), (-1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)])
def test_torque_of_either_side_at_a_corner_is_that_of_the_flux(degrees, signs):
    report = check_map(straight(degrees, at_aligned=signs[0], at_unaligned=signs[1]))
    assert report.torque_error_rms < 1e-9 and report.area_error < 1e-9
    assert report.notes == (NOTE,) and report.verdict == "good" and report.reasons == ()
    assert report.tau_max_Nm == pytest.approx(N_R * (L_A - L_U) / np.pi * 50)
    assert report.row_error < 1e-12 and report.noise < 1e-12


@pytest.mark.parametrize("degrees", [HALF, WHOLE], ids=["half", "whole"])
@pytest.mark.parametrize(("up", "down"), [(1.25, 1.25), (1.0, 1.25), (1.25, 1.0), (0.8, 1.0)])
def test_the_worse_half_of_a_map_with_corners_counts(degrees, up, down):
    """Torque a quarter too large: 0.25/1.25 of it is missing, and the area is a quarter off."""
    report = check_map(straight(degrees, up=up, down=down, at_aligned=up, at_unaligned=up))
    worst = up if len(degrees) == len(HALF) else max(up, down, key=lambda f: abs(np.log(f)))
    off = 0.0 if worst == 1 else abs(worst - 1)
    assert report.torque_error_rms == pytest.approx(off / worst, abs=1e-9)
    assert report.area_error == pytest.approx(off, rel=0.1, abs=1e-9)  # ends as of the first half
    assert (report.verdict == "good") == (off == 0)


@pytest.mark.parametrize("degrees", [HALF, WHOLE], ids=["half", "whole"])
@pytest.mark.parametrize(
    ("factor", "told"),
    [
        (1000.0, "torque is 1000 times too large for current and flux linkage: a unit error"),
        (0.001, "torque is 1000 times too small for current and flux linkage: a unit error"),
        (4.0, "flux linkage times current is 1/4 of what the torque belongs to"),
        (0.25, "flux linkage times current is 4 times what the torque belongs to"),
        (2.03, "flux linkage times current is 1/2 of"),
        (2.05, None),
        (1.9, None),
        (-4.0, None),
    ],
)
def test_a_whole_factor_between_torque_and_flux_is_named(degrees, factor, told):
    """Within 2 % of a whole number."""
    of_sides = {"up": factor, "down": factor, "at_aligned": factor, "at_unaligned": factor}
    report = check_map(straight(degrees, **of_sides))
    assert report.verdict == "refused"
    assert report.reasons[0].startswith(told or "torque differs from the co-energy derivative")


@pytest.mark.parametrize(("end", "jumps"), [(0.0499, False), (0.0501, True)])
def test_torque_jumps_where_its_end_is_above_a_twentieth_of_the_largest(end, jumps):
    smooth = straight(HALF)
    tau = np.outer(smooth.tau[:, 1], np.sin(smooth.theta_e))
    tau[:, 0] = end * tau[:, len(HALF) // 2] / np.sin(smooth.theta_e[len(HALF) // 2])
    tau *= 1 / np.abs(tau[-1]).max()
    tau[:, 0] = end * np.abs(tau).max(axis=1)
    assert (NOTE in check_map(replace(smooth, tau=tau)).notes) == jumps


@pytest.mark.parametrize("at", [0, 1, 7, 14, 15])
def test_torque_within_a_half_period_is_judged_without_its_ends(at):
    """Off at one angle alone, on a machine without saturation whose torque is a sine."""
    theta = np.radians(HALF)
    psi = np.outer(CURRENTS, 0.03 - 0.02 * np.cos(theta))
    exact = N_R * np.outer(CURRENTS**2 / 2, 0.02 * np.sin(theta))
    off = np.zeros_like(exact)
    off[:, at] = 3.0
    found = _inner_torque_error(FluxTable(N_R, CURRENTS, theta, psi, exact + off))
    inner = slice(1, 15)
    expected = (off[:, inner] ** 2).mean() / ((exact + off)[:, inner] ** 2).mean()
    assert found == pytest.approx(np.sqrt(expected), abs=5e-4)


def test_a_period_without_a_sample_at_alignment_is_judged_as_one():
    theta = np.append(np.radians(BETWEEN), np.radians(BETWEEN[1:] + 180))
    report = check_map(straight(np.degrees(theta)))
    assert report.notes == (NOTE,) and report.theta_span_deg == 360


def test_the_mean_of_a_period_and_its_mirror_image_is_its_half():
    """Even flux linkage, odd torque: what is not so falls out."""
    theta = 2 * np.pi * np.arange(24) / 24
    even, odd = 0.3 - 0.2 * np.cos(theta), 0.01 * np.sin(2 * theta)
    tau = 0.5 * np.sin(theta) + 0.04 * np.cos(3 * theta)
    table = FluxTable(
        N_R, CURRENTS, theta, np.outer(CURRENTS, even + odd), np.outer(CURRENTS**2, tau)
    )
    half = fold(table)
    assert half.theta_e == pytest.approx(theta[:13]) and half.half
    assert half.psi == pytest.approx(np.outer(CURRENTS, 0.3 - 0.2 * np.cos(half.theta_e)))
    assert half.tau == pytest.approx(np.outer(CURRENTS**2, 0.5 * np.sin(half.theta_e)), abs=1e-9)
    assert "folded" in half.notes[-1] and fold(half) is half
    assert fold(replace(table, tau=None)).tau is None


@pytest.mark.parametrize(
    ("n", "span", "cells"),
    [(13, 1, 24), (17, 1, 16), (16, 1, 30), (31, 1, 30), (101, 1, 96), (25, 2, 48), (201, 2, 192)],
)
def test_cells_are_whole_parts_of_the_steps_of_angle(n, span, cells):
    """16 to 96 of half a period, so that samples lie on their edges."""
    assert angle_cells(np.linspace(0, span * np.pi, n), span * np.pi) == cells


@pytest.mark.parametrize("half", [True, False])
def test_a_spline_of_angle_goes_through_its_values(half):
    """(c[m-1] + 4 c[m] + c[m+1])/6 = value[m], and its slope is none at both ends of a half."""
    values = np.random.default_rng(3).uniform(-1, 1, (2, 9))
    if not half:
        values[:, -1] = values[:, 0]
    c = angle_coefficients(values, half)
    assert c.shape == (2, 11)
    assert (c[:, :-2] + 4 * c[:, 1:-1] + c[:, 2:]) / 6 == pytest.approx(values)
    if half:
        assert c[:, [0, -1]] == pytest.approx(c[:, [2, -3]])
    else:
        assert c[:, :3] == pytest.approx(c[:, -3:])
