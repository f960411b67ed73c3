"""What a visitor of the studio can change: keys of a drive file, and the parameters behind them.

For each value of a key Python resolves the drive, and the parameters that differ become a table
over the values. The page sets them by name. So the defaults and formulae stay in one place, and a
drive on the page has the numbers of the same drive under `reluctance run`.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from reluctance import _core
from reluctance.base.errors import ParameterError
from reluctance.drive.drive import Drive
from reluctance.drive.run.plant import loop_parts
from reluctance.targets.export.blob import exported_controller

Value = float | int | str
Numbers = dict[str, float | tuple[float, ...]]
Tables = dict[str, dict[Value, float | tuple[float, ...]]]
Values = Callable[[Any], Sequence[Value]]


@dataclass(frozen=True)
class Control:
    """A key of a drive file that the page shows."""

    key: str
    label: str
    unit: str
    values: Values  # from the value in the drive file
    # The plant can be elsewhere than the law was designed for.
    off_design: bool = False


def around(low: float, high: float, digits: int = 2) -> Values:
    """Values between two multiples of the drive file's, rounded, and that one itself."""

    def values(given: Any) -> Sequence[Value]:
        grid = {float(f"{given * x:.{digits}g}") for x in np.linspace(low, high, 25)}
        return sorted(grid | {float(given)})

    return values


def between(low: float, high: float, step: float) -> Values:
    """An even grid, and the drive file's value where it lies elsewhere."""

    def values(given: Any) -> Sequence[Value]:
        grid = {round(float(x), 6) for x in np.arange(low, high + step / 2, step)}
        return sorted(grid | ({float(given)} if given is not None else set()))

    return values


def choice(*values: Any) -> Values:
    """These, and the drive file's."""
    return lambda given: sorted({*values, given})


def periods(given: Any) -> Sequence[Value]:
    """Control periods; far shorter ones than the law is meant for would take a page too long."""
    return sorted({v for v in (2, 5, 10, 20, 50, 100) if given <= 4 * v <= 20 * given} | {given})


# Faults whose reading does not depend on another control.
FAULTS = (
    *("over_current", "dead_current_sensor", "frozen_current_sensor"),
    *("lost_encoder", "no_command", "hardware_trip"),
)
SHORT, LONG = 8, 15  # most values that are set by name: of a table of the control, and of the plant
MANY = 50  # parameters that one control sets at most
CONTROLS = (
    Control("load.speed_rpm", "Speed", "rpm", around(0.1, 2.0), off_design=True),
    Control("reference.tau_Nm", "Torque reference", "N m", around(0.1, 1.5), off_design=True),
    Control("converter.u_dc_V", "Dc-link voltage", "V", around(0.4, 2.0), off_design=True),
    Control("control.theta_on_deg", "Turn-on angle", "° el.", between(-40, 60, 2)),
    Control("control.theta_off_deg", "Turn-off angle", "° el.", between(80, 180, 2)),
    Control("control.theta_ov_deg", "Overlap angle", "° el.", between(4, 60, 2)),
    Control("control.i_ref_A", "Current reference", "A", around(0.1, 1.5)),
    Control("control.i_band_A", "Current band, ±", "A", around(0.25, 4.0)),
    Control("control.f_switch_kHz", "Switching frequency", "kHz", around(0.25, 2.0)),
    Control("control.T_s_us", "Control period", "µs", periods),
    Control("sensing.adc_bits", "Current resolution", "bit", choice(0, 5, 6, 8, 10, 12)),
    Control("sensing.encoder_counts", "Encoder", "counts", choice(0, 256, 1024, 4096)),
    Control("converter.dead_time_us", "Dead time", "µs", choice(0, 1, 2, 4)),
    Control("mismatch.flux_factor", "Model error: flux", "×", between(0.8, 1.2, 0.02)),
    Control("mismatch.R_factor", "Model error: resistance", "×", between(0.5, 2.0, 0.1)),
    Control("mismatch.angle_offset_deg", "Angle error", "° el.", between(-10, 10, 1)),
    Control("supervision.fault", "Fault", "", choice(*FAULTS)),
    Control("supervision.fault_s", "Time of the fault", "s", between(0.1, 0.3, 0.01)),
)


def given_value(drive: Drive, key: str) -> Any:
    """The value of a key in a drive, its default included; a KeyError where it has none."""
    section, _, name = key.partition(".")
    table = drive.sections()[section]
    if name not in type(table).model_fields:
        raise KeyError(key)
    return getattr(table, name)


def offered(drive: Drive, control: Control) -> dict[str, Any] | None:
    """A control of this drive with its tables of parameters; None where it cannot be one."""
    try:
        given = given_value(drive, control.key)
        values = control.values(given)
    except (KeyError, TypeError, ValueError):
        return None
    drives = {given: drive}
    for value in values:
        with contextlib.suppress(ParameterError):  # out of what this drive can be asked for
            drives.setdefault(value, drive.with_values({control.key: value}))
    law = _of_law(drives, given)
    if law is not None:
        drives = {value: drives[value] for value in law}
    values, elsewhere = sorted(drives), False
    plant = tables(
        {value: parameters(one, of_control=False) for value, one in drives.items()}, given
    )
    if plant is None or len(values) < 2:
        return None
    changed = None if law is None else tables(law, given)
    if changed is None:
        if not control.off_design:
            return None
        changed, elsewhere = {}, True
    if not plant and not changed:
        return None
    return {
        "key": control.key,
        "label": control.label,
        "unit": control.unit,
        "values": values,
        "given": given,
        "off_design": elsewhere,
        "sets": {name: [one[v] for v in values] for name, one in (plant | changed).items()},
    }


def _of_law(drives: Mapping[Value, Drive], given: Value) -> dict[Value, Numbers] | None:
    """The controller's numbers over the values that it can have; None where a long table differs.
    The first that differs ends the search: such tables take seconds."""
    found = {given: parameters(drives[given], of_control=True)}
    for value, drive in drives.items():
        if value == given:
            continue
        with contextlib.suppress(ParameterError):
            found[value] = parameters(drive, of_control=True)
            if tables(found, given) is None:
                return None
    return found


def parameters(drive: Drive, *, of_control: bool) -> Numbers:
    """The numbers of the controller, or else of plant, sensors and reference, by their names in the
    C interface. A long table is one entry: its values cannot be set by name."""
    made = exported_controller(drive) if of_control else None
    found: Numbers = {}
    for name, given in _core.numbers(made, _core.SimulationParts(**loop_parts(drive, 0.0))).items():
        if of_control != name.startswith("control."):
            continue
        if not isinstance(given, list | tuple):
            found[name] = float(given)
        elif isinstance(given, tuple) and len(given) > (SHORT if of_control else LONG):
            found[name] = given
        else:
            found |= {f"{name}_{j}": float(v) for j, v in enumerate(given)}
    return found


def _whole(name: str, of: Numbers) -> bool:
    """True for what is no single number."""
    return isinstance(of[name], tuple) or name.endswith("|kind")


def tables(numbers: Mapping[Value, Numbers], given: Value) -> Tables | None:
    """The parameters that differ, over the values; None where more than single numbers differ, or
    so many that they would weigh a quarter of the page."""
    base = numbers[given]
    if any(one.keys() != base.keys() for one in numbers.values()):
        return None
    names = [name for name in base if any(one[name] != base[name] for one in numbers.values())]
    if len(names) > MANY or any(_whole(name, base) for name in names):
        return None
    return {name: {value: one[name] for value, one in numbers.items()} for name in names}


def controls_of(drive: Drive) -> list[dict[str, Any]]:
    """The controls of a drive. Two that set the same parameter cannot stand side by side: the first
    stays, and of an operating point the plant's part."""
    kept: list[dict[str, Any]] = []
    for control in CONTROLS:
        one = offered(drive, control)
        taken = {name for other in kept for name in other["sets"]}
        if one and control.off_design and one["sets"].keys() & taken:
            plant = {n: v for n, v in one["sets"].items() if not n.startswith("control.")}
            one = {**one, "sets": plant, "off_design": True}
        if one and not one["sets"].keys() & taken:
            kept.append(one)
    return kept
