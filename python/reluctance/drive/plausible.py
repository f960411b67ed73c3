"""Can these numbers be meant? Each is held against a scale of the machine itself.

A number far outside is a slip of a unit, and what a run makes of it means nothing.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from reluctance import _core
from reluctance.base.errors import ParameterError
from reluctance.base.units import from_si
from reluctance.drive.all_tables import Tables
from reluctance.machine.machine_file import MachineFile
from reluctance.machine.models import Magnetics

MOST_STEPS = 1e9  # of a run; more takes a quarter of an hour at least
MOST_SPEED = 50.0  # of a shaft, over the corner speed; at 50 times it a phase draws 2 % of i_max
MOST_CURRENT = 100.0  # of a phase, over i_max_A; u_dc/R of usual machines is 10 to 30
SHORTEST_RISE = 1e-6  # [s] to i_max_A at the unaligned position; converters need 10 to 1000 times
FEWEST_SAMPLES = 1.0  # of the controller in an electrical period
MOST_TORQUE = 1e4  # on the shaft, over the greatest torque of the machine


# Iron loss of the full flux at the corner speed, over the greatest mechanical power there: about a
# hundredth of, and a hundred times, that of examples/five_phases_losses.toml. The flux of a pole in
# place of the flux linkage, or kHz in place of Hz, makes it a thousand times too large.
LEAST_IRON, MOST_IRON = 1e-4, 1.0


def corner_speed(machine: MachineFile, u_dc: float) -> float:
    """Speed at which u_dc moves the flux linkage of i_max to alignment in half a period [rad/s]."""
    unaligned, aligned = _fluxes(machine.magnetics, machine.i_max_A)
    if aligned <= unaligned:
        raise ParameterError(
            f"[machine] i_max_A = {machine.i_max_A:g}: the aligned flux linkage, {aligned:.3g} Wb, "
            f"is not above the unaligned one, {unaligned:.3g} Wb, as far beyond the last current "
            "of a map; lower i_max_A, or extend the map"
        )
    return float(np.pi * u_dc / (machine.N_r * (aligned - unaligned)))


@lru_cache(maxsize=64)
def _fluxes(magnetics: Magnetics, i: float) -> tuple[float, float]:
    """Flux linkage of a current, unaligned and aligned [Wb]."""
    unaligned, aligned = _core.magnetics(magnetics, np.full(2, i), np.array([0.0, np.pi]))[:, 0]
    return float(unaligned), float(aligned)


def most_speed(drive: Tables) -> float:
    """The greatest speed that a run of this drive can mean [rad/s]."""
    u_dc = max(drive.source.points(drive.converter.u_dc_V)[1])
    return MOST_SPEED * corner_speed(drive.machine, u_dc)


# Resistive drop at i_max over the dc-link voltage. The examples have up to 0.45 (the machine of the
# source paper), commissioning at a tenth of the voltage ten times that; a unit error a thousand.
MOST_DROP = 10.0


def check_plausible(drive: Tables) -> None:
    """Raises ParameterError for the first number that cannot be meant."""
    check_steps(drive, drive.simulation.until_s)
    _voltages(drive)
    _speeds(drive)
    _iron(drive)
    most = MOST_TORQUE * drive.machine.greatest_torque
    for tau in drive.load.tau_0[1]:
        if abs(tau) > most:
            raise ParameterError(
                f"[load] torque {tau:g} N m, need at most {most:.3g}: {MOST_TORQUE:g} times the "
                "greatest torque of the machine"
            )


def check_steps(drive: Tables, until: float) -> None:
    """Raises ParameterError where a run to `until` [s] takes too many steps."""
    for name, step_us in (
        ("[control] T_s_us", drive.control.T_s_us),
        ("[simulation] dt_max_us", drive.simulation.dt_max_us),
    ):
        if until > MOST_STEPS * step_us * 1e-6:
            raise ParameterError(
                f"a run to {until:g} s takes {until / step_us * 1e6:.1e} steps of {name} = "
                f"{step_us:g}, need at most {MOST_STEPS:.0e}; shorten it (until_s, --until), or "
                "check the step: it is in microseconds"
            )


def _voltages(drive: Tables) -> None:
    machine = drive.machine
    u_dc, drop = drive.converter.u_dc_V, machine.R * machine.i_max_A
    if drop > MOST_DROP * u_dc:
        raise ParameterError(
            f"[machine] R_ohm = {machine.R_ohm:g} drops {drop:.4g} V at i_max_A = "
            f"{machine.i_max_A:g}, need at most {MOST_DROP:g} times [converter] u_dc_V = {u_dc:g}; "
            "check the units: kilovolt in u_dc_V is a number a thousand times too small, milliohm "
            "in R_ohm, or milliampere in the currents of a map, one a thousand times too large"
        )
    _devices(drive)
    rating = drive.converter.u_rating_V
    if rating is not None and rating < u_dc:
        raise ParameterError(
            f"[converter] u_rating_V = {rating:g}, need at least u_dc_V = {u_dc:g}: what the "
            "switches stand, margin included; raise it, or lower u_dc_V"
        )
    most = _fluxes(machine.magnetics, machine.i_max_A)[0] / SHORTEST_RISE
    given = [("[converter] u_dc_V", drive.converter.u_dc_V)]
    for name, u in given + [("[source] values", u) for u in drive.source.values]:
        if u > most:
            raise ParameterError(
                f"{name} = {u:g}, need at most {most:.3g}: it would take a phase to i_max_A = "
                f"{machine.i_max_A:g} within {SHORTEST_RISE * 1e6:g} us; check its unit, and those "
                "of the flux linkages of the machine"
            )


def _devices(drive: Tables) -> None:
    """Two switches or diodes are in series with a phase: they drop less than the dc link has."""
    converter, i_max = drive.converter, drive.machine.i_max_A
    for key, drop, times in (
        ("v_switch_V", converter.v_switch_V, ""),
        ("v_diode_V", converter.v_diode_V, ""),
        ("R_switch_ohm", converter.R_switch_ohm * i_max, f" at i_max_A = {i_max:g}"),
        ("R_diode_ohm", converter.R_diode_ohm * i_max, f" at i_max_A = {i_max:g}"),
    ):
        if 2 * drop >= converter.u_dc_V:
            raise ParameterError(
                f"[converter] {key} = {getattr(converter, key):g}: two devices in series drop "
                f"{2 * drop:.4g} V{times}, need less than the dc link's {converter.u_dc_V:g} V; "
                "check the unit: millivolt and milliohm are numbers a thousand times too large"
            )


def _speeds(drive: Tables) -> None:
    most = most_speed(drive)
    asked = drive.reference.course[1] if drive.reference.kind in ("speed", "pv") else []
    for where, speeds in (("[load]", drive.load.omega[1]), ("[reference]", asked)):
        for omega in speeds:
            if abs(omega) > most:
                raise ParameterError(
                    f"{where} speed {from_si(omega, 'rpm'):g} rpm, need at most "
                    f"{from_si(most, 'rpm'):.3g}: {MOST_SPEED:g} times the speed at which the dc "
                    "link moves the flux of i_max_A to alignment in half a period"
                )
    f_e = drive.machine.N_r * drive.omega_nominal / (2 * np.pi)
    if drive.control.T_s * f_e > 1 / FEWEST_SAMPLES:
        raise ParameterError(
            f"[control] T_s_us = {drive.control.T_s_us:g}, need at most {1e6 / f_e:.4g}: an "
            f"electrical period at {from_si(drive.omega_nominal, 'rpm'):g} rpm"
        )


def _iron(drive: Tables) -> None:
    machine, iron = drive.machine, drive.machine.iron
    if iron is None:
        return
    omega = corner_speed(machine, drive.converter.u_dc_V)
    unaligned, aligned = _fluxes(machine.magnetics, machine.i_max_A)
    flux, f = (aligned - unaligned) / 2, machine.N_r * omega / (2 * np.pi)
    loss = iron.p_ref_W * (f / iron.f_ref_Hz) ** iron.alpha * (flux / iron.psi_ref_Wb) ** iron.beta
    power = machine.greatest_torque * omega
    if not LEAST_IRON * power <= loss <= MOST_IRON * power:
        raise ParameterError(
            f"[machine.iron] p_ref_W = {iron.p_ref_W:g} at psi_ref_Wb = {iron.psi_ref_Wb:g}, "
            f"f_ref_Hz = {iron.f_ref_Hz:g} makes {loss:.3g} W of the full flux, {flux:.3g} Wb, at "
            f"{from_si(omega, 'rpm'):.4g} rpm, where the shaft has {power:.4g} W, need "
            f"{LEAST_IRON:.2%} to {MOST_IRON:.0%} of it; check the units: W of the whole machine, "
            "Hz, and psi_ref_Wb of a phase = B_ref x turns in series x pole area"
        )
