"""Parameters of a firmware package that may change at run time.

Each is a field of the described controller, protection or states, and takes its default from there.
This module says which fields they are, and between which values they may move.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import reduce

from reluctance.base.units import to_si
from reluctance.drive.drive import Drive
from reluctance.drive.guard.sequence_levels import LEAST_SAMPLES
from reluctance.drive.guard.trip_levels import MOST_SLACK_DEG, angle_step
from reluctance.targets.export.constants import Node, literal

GAIN_RANGE = 10.0  # of a gain of the speed loop: from none to so many times the built one
LONGEST = 60.0  # command time-out and wait for the dc link [s]
LEAST_RATE = 1.0  # of the speed reference [rad/s^2]


@dataclass(frozen=True)
class RunTime:
    """A parameter that may change at run time."""

    name: str
    unit: str
    path: str  # of the field, from the name of a tree
    least: float
    most: float
    built: float


@dataclass(frozen=True)
class _Entry:
    """Name, unit and field of a parameter, its range, and the drives that have it."""

    name: str
    unit: str
    path: str
    range: Callable[[Drive, float], tuple[float, float]]  # of the drive and the built value
    serves: Callable[[Drive], bool] = lambda drive: True


def _kind(*kinds: str) -> Callable[[Drive], bool]:
    return lambda drive: drive.reference.kind in kinds


def _up_to_built(drive: Drive, built: float) -> tuple[float, float]:
    return 0.0, built


def _gain(drive: Drive, built: float) -> tuple[float, float]:
    return 0.0, GAIN_RANGE * built


def _time(drive: Drive, built: float) -> tuple[float, float]:
    return LEAST_SAMPLES * drive.control.T_s, max(LONGEST, built)


def _nominal(drive: Drive) -> float:
    return float(drive.converter.u_dc_V)


ENTRIES = (
    _Entry(
        "torque_limit",
        "N m",
        "control.frame.limits.tau",
        _up_to_built,
        _kind("torque", "speed", "pv"),
    ),
    _Entry(
        "current_limit",
        "A",
        "control.frame.limits.i",
        _up_to_built,
        lambda drive: not drive.control.learns,  # which takes its orders as given
    ),
    _Entry("speed_limit", "rad/s", "sequence.omega_none", _up_to_built, _kind("torque", "none")),
    _Entry("speed_limit", "rad/s", "sequence.reference_max", _up_to_built, _kind("speed", "pv")),
    _Entry("speed_gain", "N m s/rad", "control.frame.speed.K_p", _gain, _kind("speed", "pv")),
    _Entry(
        "speed_integral_gain", "N m/rad", "control.frame.speed.K_i", _gain, _kind("speed", "pv")
    ),
    _Entry(
        "speed_rate",
        "rad/s^2",
        "control.frame.ramp.rate",
        lambda drive, built: (min(LEAST_RATE, built), built),
        _kind("speed"),
    ),
    _Entry("command_timeout", "s", "sequence.t_command", _time),
    _Entry("precharge_time", "s", "sequence.t_precharge", _time),
    _Entry(
        "ready_voltage",
        "V",
        "sequence.u_ready",
        lambda drive, built: (min(0.05 * _nominal(drive), built), max(_nominal(drive), built)),
    ),
    _Entry("current_trip", "A", "protection.levels.i_trip", _up_to_built),
    _Entry(
        "under_voltage",
        "V",
        "protection.levels.u_dc_min",
        lambda drive, built: (0.0, max(_nominal(drive), built)),
    ),
    _Entry(
        "over_voltage",
        "V",
        "protection.levels.u_dc_max",
        lambda drive, built: (_nominal(drive), built),
    ),
    _Entry("over_speed", "rad/s", "protection.levels.omega_max", _up_to_built),
    _Entry(
        "angle_slack",
        "rad",
        "protection.levels.angle_slack",
        lambda drive, built: (
            min(to_si(angle_step(drive), "deg"), built),
            max(to_si(MOST_SLACK_DEG, "deg"), built),
        ),
    ),
)


def run_time_parameters(drive: Drive, tree: dict[str, Node]) -> list[RunTime]:
    """Those of a drive, in the order of their numbers."""
    found = []
    for entry in ENTRIES:
        if entry.serves(drive):
            first, *fields = entry.path.split(".")
            built = float(reduce(lambda node, name: node["fields"][name], fields, tree[first]))
            least, most = entry.range(drive, built)
            if most > least:  # otherwise there is nothing to choose
                found.append(RunTime(entry.name, entry.unit, entry.path, least, most, built))
    return found


def run_time_code(entries: list[RunTime]) -> str:
    """The C++ of the parameters: the list, and where each value acts."""
    rows = "".join(
        f'    {{"{e.name}", "{e.unit}", {literal(e.least, e.name)}, {literal(e.most, e.name)}, '
        f"{e.path}}},\n"
        for e in entries
    )
    return f"""/// What may change at run time.
struct RunTimeParameter {{
  const char *name, *unit;
  float least, most, built;
}};
constexpr RunTimeParameter run_time[] = {{
{rows}}};

{_setter("control_of", "control.frame.tuning()", "control.frame.", entries)}
{_setter("trip_levels_of", "protection.levels", "protection.levels.", entries)}
{_setter("sequence_of", "sequence", "sequence.", entries)}"""


def marks(entries: list[RunTime]) -> dict[str, str]:
    """What the templates of the package name."""
    numbers = [f"  RELUCTANCE_PARAMETER_{e.name.upper()} = {n}" for n, e in enumerate(entries)]
    table = [
        f"| `{e.name}` | {e.unit} | {e.least:.6g} | {shown(e.most)} | {shown(e.built)} |"
        for e in entries
    ]
    return {
        "n_run_time": str(len(entries)),
        "run_time_numbers": ",\n".join(numbers),
        "run_time_table": "\n".join(table),
    }


def shown(value: float) -> str:
    """A limit, or that there is none."""
    return "none" if value >= 1e30 else f"{value:.6g}"


def _setter(name: str, start: str, prefix: str, entries: list[RunTime]) -> str:
    lines = "".join(
        f"  to.{e.path.removeprefix(prefix)} = value[{n}];\n"
        for n, e in enumerate(entries)
        if e.path.startswith(prefix)
    )
    return (
        f"constexpr auto {name}(const auto& value) {{\n"
        f"  auto to = {start};\n{lines}  return to;\n}}\n"
    )
