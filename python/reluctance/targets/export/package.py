"""The firmware package of a drive: a folder that holds all that its controller needs.

The folder is a pure function of the drive file: no dates, no names of machines.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from reluctance import _core
from reluctance.base.errors import ParameterError
from reluctance.base.files import check_folder, make_folder, scratch, told
from reluctance.base.phases import LETTERS
from reluctance.base.resources import resources
from reluctance.base.units import from_si
from reluctance.drive.drive import Drive, check_drive
from reluctance.drive.guard.sequence_levels import sequence, speed_limit
from reluctance.drive.guard.trip_levels import TRIAL, diagnosis, flux_angle, protection
from reluctance.drive.laws.own_code import below
from reluctance.targets.export.array_text import array_marks
from reluctance.targets.export.blob import exportable
from reluctance.targets.export.commission_levels import commission
from reluctance.targets.export.constants import Node, Tables, constant, literal
from reluctance.targets.export.more_interface import more_marks
from reluctance.targets.export.pair_text import pair_marks
from reluctance.targets.export.port import port_marks
from reluctance.targets.export.recording import desk_controller
from reluctance.targets.export.run_time import marks, run_time_code, run_time_parameters
from reluctance.targets.export.self_test import self_test_data, self_test_marks, stored_tables

FLASH_LIMIT_KIB = 256  # default for the tables: half the flash of a small Cortex-M4F
PREFIX = "reluctance"
NAME = re.compile(r"[a-z][a-z0-9_]{0,30}")
PHASES = range(3, 6)
UNSAFE = re.compile(r"[^\w .,()/+%-]")  # of a name from a file, in Markdown and in C comments
MARK = re.compile(r"@(\w+)@")
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
INCLUDE = re.compile(r'#include "(srm/[^"]+)"')


@dataclass(frozen=True)
class Firmware:
    """What was exported."""

    folder: Path
    law: str  # C++ type of the control law
    fingerprint: int  # 32 bits of the SHA-256 of the printed parameters
    table_bytes: int  # tables in flash [B]


def firmware(
    drive: Drive,
    folder: str | Path,
    *,
    flash_limit_KiB: float = FLASH_LIMIT_KIB,
    prefix: str = PREFIX,
    port: str | None = None,
    self_test: bool = False,
) -> Firmware:
    """Write the firmware package of a drive.

    Parameters
    ----------
    drive : Drive
        Its controller is exported in single precision, whatever its `precision` says.
    folder : str or Path
        New or empty; appears when it is complete.
    flash_limit_KiB : float
        Most that the tables may take.
    prefix : str
        Of every symbol and file name of the interface: two packages with different ones link into
        one image.
    port : str, optional
        Reference port to put into the folder: stm32g474.
    self_test : bool
        Stored samples and checksums, and `reluctance_self_test` for the boot.

    Raises
    ------
    ParameterError
        If the law, the phase count or a number cannot be exported, the tables are too large, or
        the folder exists and is not empty.
    """
    check_drive(drive, "firmware")
    folder = Path(folder)
    if not NAME.fullmatch(prefix):
        raise ParameterError(
            f"prefix {prefix!r}, need a lower-case C name of at most 31 characters, as in `left`"
        )
    check_folder(folder)
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise ParameterError(f"{folder} exists and is not an empty folder; name another")
    tree = described(drive)
    own = drive.control.headers
    at_run_time = run_time_parameters(drive, tree)
    code = run_time_code(at_run_time)
    text, fingerprint, table_bytes = parameters(tree, own, code)
    if table_bytes > flash_limit_KiB * 1024:
        raise ParameterError(
            f"the tables take {table_bytes / 1024:.1f} KiB of flash, need <= {flash_limit_KiB:g} "
            "KiB (--flash-limit); use fewer table points"
        )
    law = tree["control"]["type"].removeprefix("srm::DriveControl<").removesuffix(">").rstrip()
    values = _values(drive, law, fingerprint) | marks(at_run_time)
    values |= self_test_marks(self_test)
    if port is not None:
        values |= port_marks(port, drive, gates_of(drive))
    make_folder(folder.parent)
    with told(folder), scratch(folder.parent) as place:
        made = place / "package"
        source = resources("firmware")
        templates = {source / "package": made}
        if port is not None:
            templates[source / "ports" / port] = made / port
        if self_test:
            templates[source / "self_test"] = made
        filled = {
            to / path.relative_to(source_of): MARK.sub(
                lambda m: values[m[1]], path.read_text("utf-8")
            )
            for source_of, to in templates.items()
            for path in sorted(p for p in source_of.rglob("*") if p.is_file())
        }
        _check_prefix(prefix, [*filled.values(), *(path.name for path in filled)])
        for path, code_of in filled.items():
            _put(made / renamed(str(path.relative_to(made)), prefix), renamed(code_of, prefix))
        _put(made / "parameters.hpp", renamed(text, prefix))
        _put(made / "commission_parameters.hpp", renamed(commission_parameters(drive), prefix))
        if self_test:
            _put(made / "self_test_data.hpp", renamed(self_test_data(drive), prefix))
        for header, code in own.items():
            _put(made / "include" / header, code)
        for header in headers(
            [text, *(p.read_text("utf-8") for p in made.glob("*.?pp")), *own.values()]
        ):
            _put(made / "include" / header, (resources("include") / header).read_text("utf-8"))
        if folder.exists():
            folder.rmdir()
        made.rename(folder)
    return Firmware(folder=folder, law=law, fingerprint=fingerprint, table_bytes=table_bytes)


def renamed(text: str, prefix: str) -> str:
    """The text with another prefix of all symbols, macros and file names. The namespace has it with
    an underscore: so it is no word of the language."""
    if prefix == PREFIX:
        return text
    text = re.sub(r"\bRELUCTANCE(?=_)", prefix.upper(), text)
    text = re.sub(r"\breluctance(?=_)", prefix, text)
    return re.sub(r"\breluctance(?=::)|(?<=namespace )reluctance\b", f"{prefix}_", text)


def _check_prefix(prefix: str, texts: Iterable[str]) -> None:
    """Refuses a prefix that makes of a name of the interface one that the package has already."""
    words = {word for text in texts for word in re.findall(r"\b[A-Za-z]\w*_\w*", text)}
    made = {renamed(word, prefix) for word in words if renamed(word, prefix) != word}
    if taken := sorted(made & words):
        raise ParameterError(
            f"prefix {prefix!r}, but the package has a name `{taken[0]}` of its own; need another"
        )


def described(drive: Drive) -> dict[str, Node]:
    """Trees of the drive's controller in single precision and of its protection.

    Raises
    ------
    ParameterError
        If the law or the phase count is not supported.
    """
    n_phases = drive.machine.n_phases
    if n_phases not in PHASES:
        raise ParameterError(f"n_phases = {n_phases}, need {PHASES[0]} to {PHASES[-1]} for export")
    if drive.converter.bridge != "asymmetric":
        raise ParameterError(
            f"[converter] bridge = {drive.converter.bridge!r} cannot be exported: the firmware "
            "orders legs of two switches each; need bridge = 'asymmetric'"
        )
    nodes = _core.described(exportable(drive, desk_controller(drive)))
    if drive.reference.kind != "none":  # what a reference is cut to, at the latest
        limit = nodes["control"]["fields"]["frame"]["fields"]["limits"]["fields"]
        limit["tau"] = min(limit["tau"], drive.tau_max)
    guard = protection(drive)
    described = _core.described_guard(
        guard, sequence(drive, guard), diagnosis(drive), flux_angle(drive)
    )
    return {**nodes, **described}


def parameters(
    tree: dict[str, Node], own: Mapping[str, str] | None = None, more: str = ""
) -> tuple[str, int, int]:
    """The text of parameters.hpp, its fingerprint, and the bytes of its tables; `own` are headers
    from outside the package, `more` is code that follows the constants."""
    tables = Tables()
    constants = [
        f"constexpr {node['type']} {name} = {constant(node, tables, name)};\n"
        for name, node in tree.items()
    ]
    body = "\n".join([*tables.text, *constants, *([more] if more else [])])
    fingerprint = int.from_bytes(hashlib.sha256(body.encode()).digest()[:4], "big")
    names = {"DriveControl", "Protection", "Sequence", *re.findall(r"srm::(\w+)<", body)}
    includes = [*sorted({_header_of(name) for name in names}), *list(own or {})[:1]]
    text = "\n".join(
        [
            "// All parameters of the controller, as constants, from `reluctance export firmware`.",
            "#pragma once",
            "",
            *(f'#include "{header}"' for header in includes),
            "",
            "// What stands before a table, as an attribute that names its section.",
            "#ifndef RELUCTANCE_TABLE",
            "#define RELUCTANCE_TABLE",
            "#endif",
            "",
            "namespace reluctance {",
            "",
            body,
            f"constexpr std::uint32_t fingerprint = 0x{fingerprint:08X};",
            "",
            stored_tables(tables),
            "",
            "}  // namespace reluctance",
            "",
        ]
    )
    return text, fingerprint, tables.size


def commission_parameters(drive: Drive) -> str:
    """The text of commission_parameters.hpp: no part of the fingerprint, since no step reads it."""
    routines = _core.described_commission(commission(drive))
    value = constant(routines, Tables(), "commission")
    return f"""// Currents, voltages and times of commissioning, from `reluctance export firmware`.
#pragma once

#include "srm/control/commission/commission.hpp"

namespace reluctance {{

constexpr srm::Commission<float> commission = {value};

}}  // namespace reluctance
"""


def headers(texts: list[str]) -> list[str]:
    """The core's headers that these texts include, directly or not.

    Raises
    ------
    ParameterError
        If one would be written outside of the folder of the headers.
    """
    found: set[str] = set()
    while texts:
        for header in map(below, INCLUDE.findall(texts.pop())):
            if header not in found:
                found.add(header)
                texts.append((resources("include") / header).read_text("utf-8"))
    return sorted(found)


def _put(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, "utf-8")


def _header_of(name: str) -> str:
    """The header that defines struct `name`."""
    include = resources("include")
    for part in ("base", "machine", "control"):
        for path in sorted((include / "srm" / part).rglob("*.hpp")):
            if re.search(rf"^struct {name} {{", path.read_text("utf-8"), re.MULTILINE):
                return str(path.relative_to(include).as_posix())
    raise ParameterError(f"no header defines srm::{name}; the law cannot be exported")


def _guarded(drive: Drive) -> dict[str, str]:
    """What stands around the control."""
    if not drive.protection.diagnosis:
        return UNDIAGNOSED
    return FOLLOWED if drive.protection.flux_angle else DIAGNOSED


def _values(drive: Drive, law: str, fingerprint: int) -> dict[str, str]:
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
        **_guarded(drive),
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
