"""A row at an end of a flux table that is of another run or scale, or all against that at 0 A."""

from dataclasses import replace

import numpy as np
import pytest

from reluctance.machine.maps.check import check_map
from reluctance.machine.maps.table import FluxTable

I = np.linspace(0, 5, 26)  # noqa: E741
THETA = np.linspace(0, np.pi, 31)


def table(rise: np.ndarray | None = None, *, sharp: float = 3.0) -> FluxTable:
    """A machine that saturates at 2 A, by the part of its aligned inductance at each angle."""
    rise = (1 - np.cos(THETA)) / 2 if rise is None else rise
    g = I / (1 + (I / 2) ** sharp) ** (1 / sharp)
    return FluxTable(6, I, THETA, 8e-3 * I[:, None] + 0.13 * g[:, None] * rise, None, 0.0, ())


def spoilt(*places: slice | int | np.ndarray, factor: float) -> FluxTable:
    psi = table().psi.copy()
    psi[places] *= factor
    return replace(table(), psi=psi)


def offset(part: float) -> FluxTable:
    good = table()
    return replace(good, psi=good.psi + part * good.psi.max() * (good.i > 0)[:, None])


EVERY = slice(None)
OFF = {
    "the last current is too large": (spoilt(-1, factor=1.03), "row at 5 A", 0.03),
    "by half as much again": (spoilt(-1, factor=1.5), "row at 5 A", 0.5),
    "the first current is too small": (spoilt(1, factor=0.8), "row at 0.2 A", 0.2),
    "unaligned is too small": (spoilt(EVERY, 0, factor=0.5), "row at 0 deg el.", 0.5),
    "unaligned is too large": (spoilt(EVERY, 0, factor=1.04), "row at 0 deg el.", 0.04),
    "aligned is too large": (spoilt(EVERY, -1, factor=1.05), "row at 180 deg el.", 0.05),
    "an offset": (offset(0.03), "every row but 0 A", 0.03),
    "an offset below zero": (offset(-0.03), "row at 0.2 A", 0.4),
}


@pytest.mark.parametrize("name", OFF)
def test_rows_at_the_ends_are_told_with_their_error(name):
    wrong, row, error = OFF[name]
    report = check_map(wrong)
    assert report.verdict == "refused"
    assert any(line.startswith(f"{row} is off by") for line in report.reasons)
    assert report.row_error == pytest.approx(error, rel=0.2)


def test_what_to_do_with_an_offset_and_with_a_row_of_another_run():
    subtract = "every row but 0 A is off by 2.9 %, need at most 1 %; subtract 0.0088 Wb from them"
    assert subtract in check_map(offset(0.03)).reasons
    (again,) = check_map(OFF["aligned is too large"][0]).reasons
    assert "compute it again: it is of another run or scale" in again


@pytest.mark.parametrize("angle", [0, 180])
def test_a_whole_period_is_judged_at_both_positions(angle):
    half, theta = table(), np.linspace(0, 2 * np.pi, 61)
    psi = np.hstack([half.psi, half.psi[:, -2::-1]])
    good = replace(half, theta_e=theta, psi=psi)
    assert check_map(good).row_error < 0.01
    wrong = psi.copy()
    wrong[:, np.isclose(np.degrees(theta) % 360, angle)] *= 1.06
    report = check_map(replace(good, psi=wrong))
    assert report.row_error == pytest.approx(0.06, rel=0.25)
    assert any(line.startswith(f"row at {angle} deg el. is off by") for line in report.reasons)


@pytest.mark.parametrize("begins", [0.0, 0.2, 0.31])
@pytest.mark.parametrize("ends", [0.7, 0.93, 1.0])
@pytest.mark.parametrize("sharp", [1.0, 3.0, 9.0])
def test_corners_of_the_profile_and_knees_of_iron_are_no_error(begins, ends, sharp):
    rise = np.clip((THETA / np.pi - begins) / (ends - begins), 0, 1)
    assert check_map(table(rise, sharp=sharp)).row_error < 0.01


@pytest.mark.parametrize("seed", range(8))
def test_noise_at_the_ends_is_none(seed):
    random = np.random.default_rng(seed)
    good = table()
    psi = good.psi + 0.0015 * good.psi.max() * random.normal(size=good.psi.shape)
    psi[0] = 0
    report = check_map(replace(good, psi=psi))
    assert report.row_error < 0.01


@pytest.mark.parametrize("place", [(EVERY, 0), (1, EVERY)])
def test_a_row_without_flux_linkage_is_judged(place):
    """No ratio to nothing is taken."""
    psi = table().psi.copy()
    psi[place] = 0.0
    report = check_map(replace(table(), psi=psi))
    assert report.verdict == "refused" and np.isfinite(report.row_error)


def test_what_is_less_than_noise_may_be_is_none():
    """3 % of the row at 0.2 A are 0.1 % of the largest flux linkage."""
    assert check_map(spoilt(1, factor=0.97)).row_error < 0.01
    assert check_map(offset(0.019)).row_error < 0.01
