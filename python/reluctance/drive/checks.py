"""What no table of a drive can know alone: whether its tables fit together."""

import numpy as np

from reluctance import _core
from reluctance.base.errors import ParameterError
from reluctance.base.phases import LETTERS
from reluctance.base.units import from_si
from reluctance.drive.all_tables import Tables
from reluctance.drive.tables.faults import OF_THE_POWER_STAGE


def check_together(drive: Tables) -> None:
    """What no table can know alone."""
    if drive.reference.kind in ("speed", "pv") and drive.load.kind == "locked":
        raise ParameterError(
            f"[reference] kind = {drive.reference.kind!r} with [load] kind = 'locked': the shaft "
            "cannot follow; use another load or a torque reference"
        )
    _check_array(drive)
    if drive.control.T_s >= drive.simulation.until_s:
        raise ParameterError(
            f"[control] T_s_us = {drive.control.T_s_us:g} is not below [simulation] until_s = "
            f"{drive.simulation.until_s:g}; the controller would run once"
        )
    if drive.converter.t_dead >= drive.control.T_s:
        raise ParameterError(
            f"[converter] dead_time_us = {drive.converter.dead_time_us:g}, need less than "
            f"[control] T_s_us = {drive.control.T_s_us:g}, or nothing turns on"
        )
    _check_edges(drive)
    if drive.sensing.adc_bits > 0 and drive.sensing.i_range_A < drive.machine.i_max_A:
        raise ParameterError(
            f"[sensing] i_range_A = {drive.sensing.i_range_A:g}, need at least [machine] i_max_A = "
            f"{drive.machine.i_max_A:g}: above its range the sensor shows the range"
        )
    _check_sensors(drive)
    _check_supervision(drive)
    _check_faults(drive)
    drive.control.check(drive.known())
    if drive.control.follows_torque != (drive.reference.kind != "none"):
        raise ParameterError(
            "[control] fixes its current: it takes [reference] kind = 'none'"
            if drive.reference.kind != "none"
            else "[reference] kind = 'none': the control law needs a torque or speed to follow"
        )
    if drive.reference.kind in ("speed", "pv") and drive.control.tau_max_Nm is None:
        raise ParameterError("[control] missing key `tau_max_Nm`: the speed loop needs its limit")


def _check_edges(drive: Tables) -> None:
    """Whether minimum pulse and blanking leave half of the control period to the edges."""
    for key, taken_us in (
        (
            "[converter] min_pulse_us, the dead time added,",
            from_si(drive.converter.t_min, "us"),
        ),
        ("[sensing] blank_us", drive.sensing.blank_us),
    ):
        if taken_us > drive.control.T_s_us / 2:
            raise ParameterError(
                f"{key} = {taken_us:g}, need at most half of [control] T_s_us = "
                f"{drive.control.T_s_us:g}"
            )


def _check_sensors(drive: Tables) -> None:
    """One value a phase, or none; an observer within what its samples show."""
    n_phases = drive.machine.n_phases
    for key in ("i_offset_A", "i_gain"):
        values = getattr(drive.sensing, key)
        if len(values) not in (0, n_phases):
            raise ParameterError(
                f"[sensing] {key} = {values} has {len(values)} values, need {n_phases}: one a phase"
            )
    given, most = drive.sensing.tracker_bandwidth_Hz, 0.5 / drive.control.T_s
    if given is not None and given > most:
        raise ParameterError(
            f"[sensing] tracker_bandwidth_Hz = {given:g}, need at most {most:.5g}: half of the "
            "samples per second; lower it or [control] T_s_us"
        )


def _check_supervision(drive: Tables) -> None:
    """Whether the states of the drive can stand around its control."""
    table = drive.supervision
    if LETTERS.index(table.fault_phase) >= drive.machine.n_phases:
        raise ParameterError(
            f"[supervision] fault_phase = {table.fault_phase!r}, need one of the "
            f"{drive.machine.n_phases} phases of the machine"
        )
    if table.precharge_ms > 0 and (drive.source.kind == "pv" or drive.source.values):
        raise ParameterError(
            f"[supervision] precharge_ms = {table.precharge_ms:g} needs a [source] of constant "
            "voltage; remove it, or t_s and values of the source"
            if drive.source.kind != "pv"
            else f"[supervision] precharge_ms = {table.precharge_ms:g} has no effect with [source] "
            "kind = 'pv': the array charges the dc link; remove it"
        )


def _check_faults(drive: Tables) -> None:
    """Whether this drive can have its faults."""
    faults = drive.faults.each
    if len(faults) > _core.most_faults:
        raise ParameterError(f"[[faults]] {len(faults)} tables, need at most {_core.most_faults}")
    for n, fault in enumerate(faults):
        for key, letter in (("phase", fault.phase), ("other", fault.other)):
            if letter is not None and LETTERS.index(letter) >= drive.machine.n_phases:
                raise ParameterError(
                    f"[faults.{n}] {key} = {letter!r}, need one of the {drive.machine.n_phases} "
                    "phases of the machine"
                )
        if fault.kind in OF_THE_POWER_STAGE and drive.converter.bridge != "asymmetric":
            raise ParameterError(
                f"[faults.{n}] kind = {fault.kind!r} needs [converter] bridge = 'asymmetric'"
            )
        if fault.kind == "dc_sag" and drive.source.kind == "pv":
            raise ParameterError(
                f"[faults.{n}] kind = 'dc_sag' with [source] kind = 'pv': the dc link follows from "
                "the sun; set poa_global_Wpm2"
            )


def check_torque_in_reach(drive: Tables) -> None:
    """Whether the machine and the controller's own limit let the torque reference be held."""
    asked = float(np.max(np.abs(drive.reference.course[1])))
    if drive.reference.kind == "torque" and asked > drive.tau_max:
        raise ParameterError(
            f"[reference] torque {asked:g} N m is above [control] tau_max_Nm = {drive.tau_max:g}; "
            "raise it, or ask for less torque (with a pump or a fan, for less speed)"
        )
    if drive.tau_max == 0:
        raise ParameterError("[reference] torque is 0 throughout; set [control] tau_max_Nm")
    most = drive.machine.greatest_torque
    if drive.tau_max > most:
        names = "[control] tau_max_Nm"
        if drive.reference.kind == "torque" and asked > most:
            names = "[reference] torque, and tau_max_Nm where it is given,"
        raise ParameterError(
            f"torque {drive.tau_max:g} N m is out of reach: more than {most:.4g} N m is impossible "
            f"at any angle with i_max_A = {drive.machine.i_max_A:g}; lower {names} or raise "
            "i_max_A"
        )


def _check_array(drive: Tables) -> None:
    """What an array asks of switches and controller."""
    if drive.source.kind == "pv":
        u_cold, rating = drive.source.cold_voltage, drive.converter.u_rating_V
        if rating is not None and u_cold > rating:
            raise ParameterError(
                f"[source] n_series = {drive.source.n_series}: {u_cold:.4g} V without load in full "
                f"sun at {drive.source.temp_cold_degC:g} degC, need at most [converter] u_rating_V "
                f"= {rating:g}; take fewer modules in series or other switches"
            )
    if drive.reference.kind != "pv":
        if drive.pv_control.model_fields_set:
            raise ParameterError(
                f"[pv_control] has no effect with [reference] kind = {drive.reference.kind!r}; "
                "remove it, or set kind = 'pv' with the greatest speed_rpm"
            )
        return
    if drive.source.kind != "pv":
        raise ParameterError(
            f"[reference] kind = 'pv' with [source] kind = {drive.source.kind!r}: no array to "
            "follow; set [source] kind = 'pv'"
        )
    if drive.pv_control.current == "legs" and drive.sensing.comparators == "analog":
        if drive.control.uses_comparators:
            raise ParameterError(
                "[pv_control] current = 'legs' with analog comparators: the controller does not "
                "know when they switch; set [sensing] comparators = 'sampled' or current = 'sensor'"
            )
    drive.pv_control.check(drive.converter.u_dc_V)
