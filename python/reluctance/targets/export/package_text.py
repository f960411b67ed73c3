"""What the text of a firmware package says of its drive: the values of the @marks@."""

from __future__ import annotations

import re

import numpy as np

from reluctance import _core
from reluctance.base.phases import LETTERS
from reluctance.base.units import from_si
from reluctance.drive.drive import Drive
from reluctance.drive.guard.sequence_levels import sequence, speed_limit
from reluctance.drive.guard.trip_levels import TRIAL, protection
from reluctance.targets.export.array_text import array_marks
from reluctance.targets.export.constants import literal
from reluctance.targets.export.more_interface import more_marks
from reluctance.targets.export.pair_text import pair_marks
from reluctance.targets.export.recording import desk_controller

UNSAFE = re.compile(r"[^\w .,()/+%-]")  # of a name from a file, in Markdown and in C comments
UNDIAGNOSED = {
    "guarded": "Undiagnosed",
    "guarded_values": "{machine, protection, control}",
    "guarded_header": "guarded",
}
DIAGNOSED = {
    "guarded": "srm::Diagnosed<Undiagnosed, srm::NoFluxAngle>",
    "guarded_values": "{{machine, protection, control}, diagnosis, {}}",
    "guarded_header": "diagnosed",
}
FOLLOWED = {
    "guarded": "srm::Diagnosed<Undiagnosed>",
    "guarded_values": "{{machine, protection, control}, diagnosis, flux_angle}",
    "guarded_header": "diagnosed",
}
DELAY = {
    0: "The simulation lets the orders act at the instant of the sample: computing takes no time "
    "there. On a board they are late by the step's run time; keep that below a tenth of the "
    "period, or set `[sensing] delay_samples = 1` and export again.",
    1: "Orders act at the next sample: hold them, and load them into timers and comparators at the "
    "start of the next period.",
}
DEAD_TIME = (
    "the converter was given as {:g} us late at turn-on. Turn-ons inside a period are ordered that "
    "much earlier already: do not compensate again."
)
CURRENTS = (
    "| `RELUCTANCE_CURRENT_TOO_LOW`, `_TOO_HIGH` | the flux linkage of a reading, +-{:.3g} % and "
    "+-{:.3g} A, is outside what the ordered voltage allows |"
)
CURRENTS_NAMED = (  # by the diagnosis, which takes the place of that check
    "| `RELUCTANCE_CURRENT_TOO_LOW`, `_TOO_HIGH`, `_ANGLE_OFF`, `_ANGLE_REVERSED`, "
    "`_PHASES_EXCHANGED`, `_ANGLE_LOST`, `_PHASE_UNLIKE` | the flux linkages of the readings are "
    "outside what the ordered voltage allows: the status is the fault that explains them |"
)
WITHOUT_MOTOR = """\
With a reference above zero `run` ends after some samples with `RELUCTANCE_DEAD_CURRENT_SENSOR`, as
   it must: the phases are magnetized and show no current."""
WITHOUT_MOTOR_NAMED = """\
`run` begins with a trial of the diagnosis: each phase alone is magnetized up to {:.3g} A, whatever
   the reference. Without a motor it ends `run` after some samples, as it must: the phases show no
   current. It may name a dead current sensor or exchanged phases."""
GATES = {
    1: "- `RELUCTANCE_TIMER`: five leg states and four instants a period, of which most laws use "
    "two or none. Needs a timer with as many compare events per leg, loaded at the start of the "
    "period. No comparator.",
    2: "- `RELUCTANCE_COMPARATOR`: hardware compares the current with the thresholds of the order "
    "between two steps. {levels}",
    3: "- `RELUCTANCE_WINDOW`: between two rotor angles hardware compares the current with the "
    "thresholds of the order, outside them the leg demagnetizes. {levels} It also needs a position "
    "compare (a timer in encoder mode with compare events) or an angle interpolated from the "
    "speed.",
}

LEVELS = {
    "analog": "Simulated with all four thresholds: magnetize below `i_lower_A`, chop above "
    "`i_upper_A`, demagnetize above `i_runaway_A` until the current is back at `i_centre_A`. Each "
    "phase needs three comparators with DACs, and a state machine of one bit for the last. A "
    "board with one comparator and hysteresis per phase has the first two only: set `[sensing] "
    'comparators = "two_level"` and simulate before you build it; a reference that falls faster '
    "than a freewheeling current is not followed there.",
    "two_level": "Simulated with two thresholds: magnetize below `i_lower_A`, chop above "
    "`i_upper_A`. One comparator per phase with hysteresis, or with two DACs.",
    "sampled": "",
}
FAST_LOOP = (
    "Without analog comparators, call `fast_loop` of `main.c` from a second timer: every call "
    "reads the currents and sets the legs by the same rule. A current then leaves its band by up "
    "to di/dt times the loop's period. At the unaligned angle di/dt is u_dc/L_u; simulate "
    'with `[sensing] comparators = "sampled"` at that period before you trust it.'
)
NO_FAST_LOOP = "So `fast_loop` of `main.c` is not needed."


def guarded(drive: Drive) -> dict[str, str]:
    """What stands around the control."""
    if not drive.protection.diagnosis:
        return UNDIAGNOSED
    return FOLLOWED if drive.protection.flux_angle else DIAGNOSED


def values(drive: Drive, law: str, fingerprint: int) -> dict[str, str]:
    """What the templates name in @marks@."""
    guard = protection(drive)
    levels = guard.levels
    meaning = {
        "torque": "torque [N m]",
        "speed": "speed [rad/s]",
        "none": "1 to motor with the law's own current, -1 to brake, 0 off",
        "pv": "greatest speed [rad/s], 0 stops the pump",
    }
    gates = gates_of(drive)
    return {
        **more_marks(drive.control.learns, drive.protection),
        **array_marks(drive),
        **pair_marks(drive),
        **guarded(drive),
        "phases": str(drive.machine.n_phases),
        "straight": ", ".join(map(str, range(drive.machine.n_phases))),
        "positive": ", ".join(["1"] * drive.machine.n_phases),
        "swapped": ", ".join(map(str, [0, 2, 1, *range(3, drive.machine.n_phases)])),
        "exchanged": ", ".join(map(str, [1, 0, *range(2, drive.machine.n_phases)])),
        "turned": ", ".join(["1", "-1", *["1"] * (drive.machine.n_phases - 2)]),
        "N_s": str(drive.machine.N_s),
        "R_ohm": f"{drive.machine.R:g}",
        "J_kgm2": f"{drive.machine.J_kgm2:g}",
        "letters": ", ".join(LETTERS[: drive.machine.n_phases]),
        "T_s": literal(drive.control.T_s, "T_s"),
        "T_s_us": f"{drive.control.T_s_us:g}",
        "delay": str(drive.sensing.delay_samples),
        "delay_text": DELAY[drive.sensing.delay_samples],
        "reference": meaning[drive.reference.kind],
        "i_source": "of the array"
        if drive.reference.kind == "pv" and drive.pv_control.current == "sensor"
        else "not used, give 0",
        "machine": UNSAFE.sub("?", drive.machine.name),
        "N_r": str(drive.machine.N_r),
        "law": law,
        "fingerprint": f"0x{fingerprint:08X}",
        "i_max_A": f"{drive.machine.i_max_A:g}",
        "i_trip_A": f"{levels.i_trip:g}",
        "i_zero_A": f"{guard.i_zero:g}",
        "u_dc_V": f"{drive.converter.u_dc_V:g}",
        "u_dc_min_V": f"{levels.u_dc_min:g}",
        "u_dc_max_V": f"{levels.u_dc_max:g}",
        "speed": "ignored: the controller tracks it on the angle"
        if drive.sensing.counted_angle
        else "from more than the last two angles",
        "speed_max_rpm": f"{from_si(levels.omega_max, 'rpm'):.6g}",
        "speed_limit_rpm": f"{from_si(speed_limit(drive, guard), 'rpm'):.6g}",
        "current_check": CURRENTS_NAMED
        if drive.protection.diagnosis
        else CURRENTS.format(100 * guard.flux.model_error, guard.flux.i_error),
        "without_motor": WITHOUT_MOTOR_NAMED.format(TRIAL * drive.machine.i_max_A)
        if drive.protection.diagnosis
        else WITHOUT_MOTOR,
        "frozen": f"{guard.frozen} equal codes in a row"
        if guard.frozen
        else "not checked: it needs noise in `[sensing]`",
        "u_ready_V": f"{sequence(drive, guard).u_ready:g}",
        "command_timeout_ms": f"{drive.protection.command_timeout_ms:g}",
        "stuck_angle": _stuck_angle(guard),
        "adc": f"{drive.sensing.adc_bits} bits over {drive.sensing.i_range_A:g} A"
        if drive.sensing.adc_bits
        else "ideal",
        "encoder": f"{drive.sensing.encoder_counts} counts per revolution"
        if drive.sensing.encoder_counts
        else "ideal",
        "dead_time": DEAD_TIME.format(drive.converter.dead_time_us)
        if drive.converter.t_dead > 0
        else "none is needed, and none was simulated.",
        "gates": "\n".join(
            GATES[g].format(levels=LEVELS[drive.sensing.comparators]) for g in sorted(gates)
        ),
        "without_comparators": FAST_LOOP if gates & {2, 3} else NO_FAST_LOOP,
    }


def _stuck_angle(guard: _core.Protection) -> str:
    """When the protection says so."""
    slack, advance = guard.levels.angle_slack, guard.advance
    if advance.block == 0:
        most = np.degrees(slack)
        return f"the angle differs from the integral of the speed by {most:.4g} deg electrical"
    most = np.degrees(2 * slack + advance.bend)
    if most >= 180:
        return "not checked: the steps of the angle are too wide"
    ms = 1e3 * advance.parts * advance.block * guard.flux.T_s
    return (
        f"the angle turns by {most:.4g} deg electrical more or less than in the {ms:.3g} ms before"
    )


def gates_of(drive: Drive) -> set[int]:
    """Which gates the law uses, over one electrical period at the drive's speed, and the timer of a
    diagnosis, which magnetizes each phase before the law runs."""
    controller = desk_controller(drive)
    reference = float(np.max(drive.reference.course[1]))
    columns = _core.ORDER_COLUMNS
    used: set[int] = {1} if drive.protection.diagnosis else set()
    for theta_e in np.linspace(0, 2 * np.pi, 36, endpoint=False):
        y = _core.Measurement(
            i=[0.0] * drive.machine.n_phases,
            theta_e=float(theta_e),
            omega_m=drive.omega_nominal,
            u_dc=drive.converter.u_dc_V,
        )
        rows = _core.step(controller, y, reference)
        used |= {int(gate) for gate in rows[columns.index("gate") : -1 : len(columns)]}
    return used
