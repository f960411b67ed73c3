"""What the parts must stand over a whole run, held against what the drive file says they stand."""

from __future__ import annotations

from reluctance.base.errors import ParameterError
from reluctance.base.key_figures import NOT_HELD, Kpis
from reluctance.base.units import from_si
from reluctance.drive.drive import Drive
from reluctance.drive.guard.sequence_levels import sequence
from reluctance.drive.guard.trip_levels import OVER_CURRENT, protection
from reluctance.drive.laws.angle_table import read_angle_table
from reluctance.drive.laws.own_code import names_code
from reluctance.drive.run.columns import Rows
from reluctance.drive.run.kpis import evaluated

COUNTS_PER_STROKE = 4  # fewer leave the phase in doubt that makes the torque
COARSE = 0.03  # of i_max_A: six bits for the working range
SETTLED = 0.05  # of the energy from the dc link: so much of it may be its capacitor's
ABOVE = 0.1  # of i_max_A: half way to the trip level. A comparator's band and delay take a part


def _lower(drive: Drive) -> str:
    """What keeps the currents of a drive lower."""
    if names_code(drive.control.law):
        return "keep the currents that your law asks for below i_max_A"
    if getattr(drive.control, "regulate", "current") == "none":
        return "a pulse ends at theta_off_deg alone; turn off earlier, or regulate the current"
    remedies = ["a shorter control period"]
    if drive.control.uses_comparators and drive.sensing.comparators != "analog":
        remedies.append("analog comparators")
    return f"{' or '.join(remedies)} keep{'s' * (len(remedies) == 1)} it lower"


def exceeded(drive: Drive, kpis: Kpis) -> list[str]:
    """The limits of the drive file that a run did not keep, each on one line."""
    found, levels = [], drive.protection
    i_max, i, trip = drive.machine.i_max_A, kpis.i_peak_run, levels.i_trip_A
    trip = OVER_CURRENT * drive.machine.i_max_A if trip is None else trip
    if i > (1 + ABOVE) * i_max:
        also = f", and above the trip level of {trip:g} A" if i > trip else ""
        found.append(
            f"the peak current of the run, {i:.4g} A, is above [machine] i_max_A = {i_max:g}"
            f"{also}: {_lower(drive)}"
        )
    elif i > trip:
        found.append(
            f"the peak current of the run, {i:.4g} A, is above [protection] i_trip_A = {trip:g}: a "
            "supervised drive and firmware would trip; raise it, or ask for less"
        )
    u = kpis.u_dc_peak_run
    for key, limit in (
        ("[converter] u_rating_V", drive.converter.u_rating_V),
        ("[protection] u_dc_max_V", levels.u_dc_max_V),
    ):
        if limit is not None and u > limit:
            found.append(
                f"the dc link reaches {u:.4g} V in the run, above {key} = {limit:g}: braking "
                "charges it, or the source is too high; raise [source] C_uF, brake less, or allow "
                "energy back"
            )
    speed = from_si(kpis.speed_peak_run, "rpm")
    if levels.speed_max_rpm is not None and speed > levels.speed_max_rpm:
        found.append(
            f"the speed reaches {speed:.4g} rpm in the run, above [protection] speed_max_rpm = "
            f"{levels.speed_max_rpm:g}"
        )
    return found


def drained(drive: Drive, kpis: Kpis, periods: Rows) -> list[str]:
    """On one line, where the figures are of a dc link whose capacitor is emptied or filled."""
    window = evaluated(periods, drive.machine.N_r)[0]
    taken, stored = window.rise("E_dc"), window.rise("W_dc")
    part = abs(stored) / max(abs(taken), 1e-12)
    if part <= SETTLED:
        return []
    how = "gives" if stored < 0 else "takes"
    return [
        f"the capacitor of the dc link {how} {part:.0%} of the drive's power, its voltage has not "
        f"settled ({kpis.u_dc_min:.4g} to {kpis.u_dc_max:.4g} V): run longer (--until), or the "
        "source cannot give or take so much (check the units of [source])"
    ]


def folded_back(drive: Drive, kpis: Kpis) -> list[str]:
    """On one line, where braking charges the dc link so far that the control takes its torque
    back."""
    asked, (full, none) = drive.reference.tau_Nm, drive.u_brake
    motors = asked is not None and asked * kpis.speed_mean >= 0
    if motors or kpis.u_dc_max <= full:
        return []
    return [
        f"braking charges the dc link to {kpis.u_dc_max:.4g} V, since the source does not take its "
        f"energy, and the control takes the braking torque back from {full:.4g} V on, all of it at "
        f"{none:.4g} V (docs/firmware.md, States): ask for less braking, or give it a source that "
        "takes energy"
    ]


def handed_over(drive: Drive, kpis: Kpis) -> list[str]:
    """On one line, what of the control law does not act at the mean of the figures."""
    tau, omega_m = kpis.tau_ref_mean, kpis.speed_mean
    if tau is None:
        return []
    unused = drive.unused(tau=tau, omega_m=omega_m, u_dc=(kpis.u_dc_min + kpis.u_dc_max) / 2)
    if not unused:
        return []
    return [
        f"at {tau:.4g} N m and {from_si(omega_m, 'rpm'):.5g} rpm the law does not use [control] "
        f"{unused}. It follows the profile of the limit there (docs/control/voltage.md)"
    ]


def beyond_angles(drive: Drive, kpis: Kpis) -> list[str]:
    """On one line, where the mean speed is outside the speeds of a table of angles."""
    path = getattr(drive.control, "angle_table", None)
    if path is None:
        return []
    omega = read_angle_table(path).omega
    speed = abs(kpis.speed_mean)
    if (1 - NOT_HELD) * omega[0] <= speed <= (1 + NOT_HELD) * omega[-1]:
        return []
    least, most = from_si(omega[[0, -1]], "rpm")
    return [
        f"{path} has angles from {least:.5g} to {most:.5g} rpm, and the drive turns at "
        f"{from_si(speed, 'rpm'):.5g}: it keeps those of the nearest speed; add rows for this one"
    ]


def refused_by_firmware(drive: Drive) -> list[str]:
    """On one line, where [protection] has a level that a run without states does not look at, and
    that firmware and a supervised drive refuse."""
    if drive.supervision.on or not drive.protection.model_fields_set:
        return []
    try:
        sequence(drive, protection(drive))
    except ParameterError as fault:
        return [f"not looked at in this run, refused with states and as firmware: {fault}"]
    return []


def coarse_angle(drive: Drive) -> list[str]:
    """On one line, where a step of the encoder is wider than a stroke."""
    counts, strokes = drive.sensing.encoder_counts, drive.machine.n_phases * drive.machine.N_r
    if not 0 < counts < strokes or drive.sensing.hall:
        return []
    return [
        f"a step of [sensing] encoder_counts = {counts} is {360 / counts:.3g} deg of the shaft, "
        f"wider than a stroke, {360 / strokes:.3g} deg: which phase makes torque is not known in "
        f"between; take at least {COUNTS_PER_STROKE * strokes} counts"
    ]


def compared_truly(drive: Drive) -> list[str]:
    """Where comparators do not see the errors of the current sensors."""
    unseen = drive.control.uses_comparators and drive.sensing.comparators != "sampled"
    if not (unseen and drive.sensing.has_errors):
        return []
    return [
        "the comparators see the true currents: offset and gain of [sensing] are in the readings "
        'alone. comparators = "sampled" compares readings; [[faults]] sensor_offset and '
        "sensor_gain reach comparators, too"
    ]


def coarse_current(drive: Drive) -> list[str]:
    """Where a step of the current converter, or its noise, is a part of the greatest current that
    a law cannot work with, each on one line."""
    step, i_max = drive.sensing.i_step, drive.machine.i_max_A
    noise = drive.sensing.i_noise
    told = []
    if noise > COARSE * i_max:
        told = [
            f"the noise of the current sensors is {noise:.3g} A rms, {noise / i_max:.0%} of "
            f"i_max_A = {i_max:g}: check the unit of [sensing] i_noise_LSB = "
            f"{drive.sensing.i_noise_LSB:g}, in steps of {step:.3g} A"
        ]
    if step <= COARSE * i_max:
        return told
    return [
        *told,
        f"a step of the current converter is {step:.3g} A, {step / i_max:.0%} of i_max_A = "
        f"{i_max:g}: check the unit of [sensing] i_range_A = {drive.sensing.i_range_A:g}, or take "
        "more adc_bits",
    ]


def never_planted(drive: Drive, end: float) -> list[str]:
    """The faults, the events of its states and the courses of a drive that come after the end of a
    run [s], each on one line."""
    late = f"is not before the end of the run at {end:g} s"
    remedy = "run longer (--until), or set it earlier"
    faults = [
        f"[faults.{n}] t_s = {fault.t_s:g} {late}: {fault} does not come; {remedy}"
        for n, fault in enumerate(drive.faults.each)
        if fault.t_s >= end
    ]
    events = [
        f"[supervision] {key} = {at:g} {late}: it does not come; {remedy}"
        for key in ("enable_s", "fault_s", "gone_s", "clear_s", "restart_s")
        if (at := getattr(drive.supervision, key)) is not None and at >= end
    ]
    courses = [
        f"the course of [{name}] goes on to {course.t_s[-1]:g} s, the run ends at {end:g} s: run "
        "longer (--until), or check the unit of t_s: it is in seconds"
        for name, course in (("reference", drive.reference), ("load", drive.load))
        if len(course.t_s) > 1 and course.t_s[1] > end
    ]
    return faults + events + courses
