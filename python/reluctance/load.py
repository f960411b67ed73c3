"""Drive files: from TOML to a checked Drive, or to one line that says what is wrong."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from reluctance.drive import Drive
from reluctance.drive.control import Control
from reluctance.drive.library import machine_from, machine_table
from reluctance.drive.map_machine import with_paths
from reluctance.drive.mismatch import Mismatch
from reluctance.drive.own_code import names_code, trusted
from reluctance.drive.plausible import check_plausible
from reluctance.drive.protection import Protection
from reluctance.drive.pv_control import PvControl
from reluctance.drive.pv_source import cold_voltage
from reluctance.drive.schema import Section, checked, did_you_mean
from reluctance.drive.tables import (
    Converter,
    Load,
    Reference,
    Sensing,
    SimulationSettings,
    Source,
)
from reluctance.errors import ParameterError
from reluctance.files import is_file, read_toml, toml_value
from reluctance.laws import LAWS, table_of

TABLES: dict[str, type[Section]] = {
    "converter": Converter,
    "source": Source,
    "load": Load,
    "reference": Reference,
    "sensing": Sensing,
    "simulation": SimulationSettings,
    "protection": Protection,
    "mismatch": Mismatch,
    "pv_control": PvControl,
}
OPTIONAL = {"source", "sensing", "protection", "mismatch", "pv_control"}


def load(
    path: str | Path,
    overrides: list[str] | None = None,
    *,
    trust: bool = False,
    check_torque: bool = True,
) -> Drive:
    """A drive from a TOML file.

    Parameters
    ----------
    path : str or Path
        The drive file. Its `machine` is a name from the machine library, a path to a machine file
        relative to the drive file, or a table.
    overrides : list of str, optional
        `section.key=value` with the value as in TOML; bare words are text; no value removes the
        key. `machine=...` takes a name from the library or a path.
    trust : bool
        Run the code that the file names: a law in Python (`law = "python:FILE:CLASS"`) or a
        compiled one (`law = "cpp:FILE:STRUCT"`). A drive file of unknown origin is data, and stays
        data without it.
    check_torque : bool
        False leaves out whether the torque reference is in reach, for a caller that asks for
        another torque.

    Raises
    ------
    ParameterError
        With one line that says what is wrong and what is needed.
    """
    if not isinstance(path, str | Path):
        raise ParameterError(f"load takes the path of a drive file, not {path!r}")
    if isinstance(overrides, str) or not isinstance(overrides or [], Sequence):
        raise ParameterError(
            f"overrides = {overrides!r}, need a list of texts as in [{str(overrides)!r}]"
        )
    path = Path(path)
    data = read_toml(path)
    if isinstance(data.get("machine"), str):
        data["machine"] = machine_table(data["machine"], path.parent)
    elif isinstance(data.get("machine"), dict):
        data["machine"] = with_paths(data["machine"], path.parent)
    if is_system(data):
        raise ParameterError(
            f"{path} is a pumping system, not a drive file; use `reluctance pump {path}`"
        )
    try:
        _settle_own_law(data, path.parent, trust)
        for text in overrides or []:
            name, value = _parsed(text)
            _put(data, name, value, f"--set {text}")
            if name == "control.law":
                _settle_own_law(data, Path(), trust)
        _settle_file(data, path.parent, "load", "pump")
        _settle_file(data, path.parent, "control", "angle_table")
        return drive_from(data, name=path.stem, check_torque=check_torque)
    except ParameterError as fault:
        raise ParameterError(f"{path}: {fault}") from None


def is_system(data: Mapping[str, Any]) -> bool:
    """Whether the tables of a file are those of a pumping system."""
    return "drive" in data and "site" in data


def with_values(drive: Drive, values: Mapping[str, Any]) -> Drive:
    """See `Drive.with_values`."""
    if not isinstance(values, Mapping):
        raise ParameterError(
            f"with_values takes a dict as in {{'converter.u_dc_V': 300}}, not {values!r}"
        )
    for name in values:
        if not isinstance(name, str):
            raise ParameterError(f"with_values: {name!r} is not a `section.key`")
    kept = drive.sections()
    data = {
        key: kept.pop(key).given
        for key in {name.partition(".")[0] for name in values}
        if key in kept
    }
    for name, value in values.items():
        _put(data, name, _plain(value), f"with_values {name} = {value!r}")
    return drive_from(data, name=drive.name, kept=kept)


def drive_from(
    data: dict[str, Any],
    *,
    name: str = "drive",
    check_torque: bool = True,
    kept: Mapping[str, Section] | None = None,
) -> Drive:
    """A drive from the tables of a drive file; `machine` must be a table here. `kept` has those
    that have been checked before."""
    kept = kept or {}
    for key in data:
        if key not in (known := [*TABLES, "machine", "control"]):
            raise ParameterError(f"unknown table `{key}`{did_you_mean(key, known)}")
    for key in ("machine", "control", *TABLES):
        if key not in data and key not in kept and key not in OPTIONAL:
            raise ParameterError(f"missing table [{key}]")
    sections: dict[str, Any] = {
        key: kept.get(key) or checked(section, data.get(key, {}), f"[{key}]")
        for key, section in TABLES.items()
    }
    drive = Drive(
        name=name,
        machine=kept.get("machine") or machine_from(data["machine"]),  # type: ignore[arg-type]
        control=kept.get("control") or _control(data["control"]),  # type: ignore[arg-type]
        **sections,
    )
    _check_together(drive)
    check_plausible(drive)
    if check_torque and drive.reference.kind != "none":
        _check_torque(drive)
    return drive


def _control(table: object) -> Control:
    law = table.get("law") if isinstance(table, dict) else None
    return checked(table_of(law), table, "[control]")


def _settle_own_law(data: dict[str, Any], folder: Path, trust: bool) -> None:
    """A law that is code: its file relative to a folder, if it may run."""
    if names_code(law := _law(data)):
        data["control"]["law"] = trusted(str(law), folder, trust)


def _settle_file(data: dict[str, Any], folder: Path, section: str, key: str) -> None:
    """The file that a key names, relative to the drive file where it is there."""
    table = data.get(section)
    if isinstance(table, dict) and isinstance(table.get(key), str):
        if is_file(folder / table[key]):
            table[key] = str(folder / table[key])


def _check_together(drive: Drive) -> None:
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
    band = getattr(drive.control, "i_band_A", None) or 0.0
    if band >= drive.machine.i_max_A:
        raise ParameterError(
            f"[control] i_band_A = {band:g}, need less than [machine] i_max_A = "
            f"{drive.machine.i_max_A:g}"
        )
    drive.control.check(drive.known())
    if drive.control.follows_torque != (drive.reference.kind != "none"):
        raise ParameterError(
            "[control] fixes its current: it takes [reference] kind = 'none'"
            if drive.reference.kind != "none"
            else "[reference] kind = 'none': the control law needs a torque or speed to follow"
        )
    if drive.reference.kind in ("speed", "pv") and drive.control.tau_max_Nm is None:
        raise ParameterError("[control] missing key `tau_max_Nm`: the speed loop needs its limit")


def _check_edges(drive: Drive) -> None:
    """Whether minimum pulse and blanking leave half of the control period to the edges."""
    for key, taken_us in (
        ("[converter] min_pulse_us", drive.converter.min_pulse_us),
        ("[sensing] blank_us", drive.sensing.blank_us),
    ):
        if taken_us > drive.control.T_s_us / 2:
            raise ParameterError(
                f"{key} = {taken_us:g}, need at most half of [control] T_s_us = "
                f"{drive.control.T_s_us:g}"
            )


def _check_sensors(drive: Drive) -> None:
    """One value a phase, or none."""
    n_phases = drive.machine.n_phases
    for key in ("i_offset_A", "i_gain"):
        values = getattr(drive.sensing, key)
        if len(values) not in (0, n_phases):
            raise ParameterError(
                f"[sensing] {key} = {values} has {len(values)} values, need {n_phases}: one a phase"
            )


def _check_torque(drive: Drive) -> None:
    """Whether the machine and the controller's own limit let the torque reference be held."""
    asked = float(np.max(np.abs(drive.reference.course[1])))
    if drive.reference.kind == "torque" and asked > drive.tau_max:
        raise ParameterError(
            f"[reference] torque {asked:g} N m is above [control] tau_max_Nm = {drive.tau_max:g}"
        )
    if drive.tau_max == 0:
        raise ParameterError("[reference] torque is 0 throughout; set [control] tau_max_Nm")
    most = drive.machine.greatest_torque
    if drive.tau_max > most:
        raise ParameterError(
            f"torque {drive.tau_max:g} N m is out of reach: more than {most:.4g} N m is impossible "
            f"at any angle with i_max_A = {drive.machine.i_max_A:g}; lower the torque or raise "
            "i_max_A"
        )


def _check_array(drive: Drive) -> None:
    """What an array asks of switches and controller."""
    if drive.source.kind == "pv":
        u_cold, rating = cold_voltage(drive.source), drive.converter.u_rating_V
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
        if getattr(drive.control, "i_band_A", "none") != "none":
            raise ParameterError(
                "[pv_control] current = 'legs' with analog comparators: the controller does not "
                "know when they switch; set [sensing] comparators = 'sampled' or current = 'sensor'"
            )
    drive.pv_control.check(drive.converter.u_dc_V)


def _law(data: dict[str, Any]) -> object:
    control = data.get("control")
    return control.get("law") if isinstance(control, dict) else None


def _keep_known(control: dict[str, Any]) -> None:
    """Drops the keys of [control] that its law does not have; those of a law of one's own are
    given after it."""
    law = control.get("law")
    if isinstance(law, str) and (law in LAWS or names_code(law)):
        for key in set(control) - set(table_of(law).model_fields):
            del control[key]


def _parsed(text: str) -> tuple[str, Any]:
    """Name and value of `section.key=value`; None where no value is given."""
    if not isinstance(text, str):
        raise ParameterError(f"override {text!r}, need a text as in 'section.key=value'")
    name, equals, value = (part.strip() for part in text.partition("="))
    if not equals:
        raise ParameterError(f"--set {text}: need section.key=value")
    if not value:
        return name, None
    if name == "machine":
        return name, value.strip("\"'")
    return name, toml_value(value)


def _put(data: dict[str, Any], name: str, value: Any, where: str) -> None:
    """Puts a value into the tables, or takes the key out where it is None. A new law takes the keys
    with it that it does not have."""
    if name == "machine" and value is not None:
        data["machine"] = (
            machine_table(value, Path()) if isinstance(value, str) else with_paths(value, Path())
        )
        return
    *path, key = name.split(".")
    if not path or not key:
        raise ParameterError(f"{where}: need section.key=value")
    table, law = data, _law(data)
    for part in path:
        table = table.setdefault(part, {})
        if not isinstance(table, dict):
            raise ParameterError(f"{where}: `{part}` is not a table")
    if value is not None:
        table[key] = value
    elif key in table:
        del table[key]
    else:
        raise ParameterError(
            f"{where}: no such key to remove{did_you_mean(key, table) if table else ''}"
        )
    if _law(data) != law:
        _keep_known(data["control"])


def _plain(value: Any) -> Any:
    """Numbers and lists as TOML has them, of NumPy's and of other sequences."""
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    return list(value) if isinstance(value, tuple | range) else value
