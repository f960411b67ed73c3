"""Profiles for less switching ripple; docs/control/least_ripple.csv is compared with runs."""

import csv
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import reluctance as rl
from reluctance.machine import optimum

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "studies"))
import least_ripple as study  # noqa: E402

FILES = {"LeHuy": "edge_mpc_fpga", "map": "map_mpc", "five phases": "five_phases_losses"}


def table(name: str, speed: float = 1.0) -> tuple[optimum.OperatingPoint, optimum.Table]:
    drive = rl.load(ROOT / "examples" / f"{FILES[name]}.toml")
    known = drive.known()
    point = known.at(speed * known.omega_m)
    n = 72 * point.n_phases
    return point, optimum.profile_table(point, known.tau_max, n_levels=4, n_points=n)


def shown() -> dict[str, dict[str, str]]:
    with (ROOT / "docs/control/least_ripple.csv").open(encoding="utf-8") as file:
        return {row["case"]: row for row in csv.DictReader(file)}


@pytest.mark.parametrize("name", FILES)
def test_the_torque_stays_and_the_voltage_is_there(name: str) -> None:
    from reluctance import _core

    point, least_copper = table(name)
    found = optimum.least_ripple_table(point, least_copper)
    assert not np.array_equal(found.psi, least_copper.psi)
    h = found.theta_e[1] / (point.N_r * found.omega_m)
    for i, psi, tau_ref in zip(found.i[1:], found.psi[1:], found.tau_ref[1:], strict=True):
        at = _core.magnetics(point.magnetics, i, found.theta_e)
        assert at[:, 0] == pytest.approx(psi, abs=1e-4 * psi.max())
        tau = at[:, 2].reshape(point.n_phases, -1).sum(axis=0)
        assert tau == pytest.approx(tau_ref, rel=1e-4)
        u = np.diff(psi) / h + point.R * (i[1:] + i[:-1]) / 2
        lacks = np.maximum(np.abs(u) - found.u_dc, 0.0).sum() * h
        assert lacks <= 0.02 * psi.max() and i.min() >= 0


def test_at_standstill_and_with_ripple_of_its_own_a_profile_stays() -> None:
    point, given = table("LeHuy")
    still = replace(given, omega_m=0.0)
    assert np.array_equal(optimum.least_ripple_table(point, still).psi, given.psi)
    rippled = replace(given, tau_error_max=0.01 * given.tau_ref)
    assert np.array_equal(optimum.least_ripple_table(point, rippled).psi, given.psi)


def test_the_law_is_within_1_20_of_the_bound_from_5_to_40_kHz() -> None:
    rows = shown()
    for torque in study.TORQUES:
        for about in study.ASKED:
            row, other = (rows[f"{g} {torque} {about}"] for g in ("least_ripple", "least_copper"))
            assert float(row["to_bound"]) <= 1.20
            assert float(row["i_rms_A"]) <= 1.03 * float(other["i_rms_A"])


@pytest.mark.long
@pytest.mark.parametrize("case", [("least_ripple", "rated", 20), ("least_copper", "half", 10)])
def test_the_file_is_what_the_study_writes(case: tuple[str, str, int]) -> None:
    found, given = study.row(*case), shown()[f"{case[0]} {case[1]} {case[2]}"]
    for name in ("f_switch_Hz", "error_rms", "i_rms_A", "to_bound", "to_returning"):
        assert float(found[name]) == pytest.approx(float(given[name]), rel=2e-3)


def test_the_microcontroller_has_less_ripple_too() -> None:
    """20 us, one sample late, 12 bits: at the frequency that each has."""
    products = []
    for guide in study.GUIDES:
        drive = rl.load(ROOT / "examples/edge_mpc_mcu.toml", [f"control.guide={guide}"])
        k = rl.simulate(drive, until=0.1, record=None).kpis
        assert k.tau_mean == pytest.approx(41.339, rel=2e-3)
        products.append(k.torque_error_rms * k.f_switch)
    assert products[1] < 0.98 * products[0]
