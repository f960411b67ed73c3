"""What the parts must stand over a whole run, held against what the drive file says they stand."""

from __future__ import annotations

from reluctance.base.key_figures import Kpis
from reluctance.base.units import from_si
from reluctance.drive.drive import Drive
from reluctance.drive.guard.trip_levels import OVER_CURRENT

COUNTS_PER_STROKE = 4  # fewer leave the phase in doubt that makes the torque
ABOVE = 0.1  # of i_max_A: half way to the trip level. A comparator's band and delay take a part


def exceeded(drive: Drive, kpis: Kpis) -> list[str]:
    """The limits of the drive file that a run did not keep, each on one line."""
    found, levels = [], drive.protection
    i_max, i, trip = drive.machine.i_max_A, kpis.i_peak_run, levels.i_trip_A
    trip = OVER_CURRENT * drive.machine.i_max_A if trip is None else trip
    if i > (1 + ABOVE) * i_max:
        also = f", and above the trip level of {trip:g} A" if i > trip else ""
        found.append(
            f"the peak current of the run, {i:.4g} A, is above [machine] i_max_A = {i_max:g}"
            f"{also}: a shorter control period or analog comparators keep it lower"
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


def never_planted(drive: Drive, end: float) -> list[str]:
    """The faults of a drive that come after the end of a run [s], each on one line."""
    return [
        f"[faults.{n}] t_s = {fault.t_s:g} is not before the end of the run at {end:g} s: "
        f"{fault} does not come; run longer (--until), or set it earlier"
        for n, fault in enumerate(drive.faults.each)
        if fault.t_s >= end
    ]
