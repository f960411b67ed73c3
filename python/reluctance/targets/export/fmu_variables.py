"""The variables of a functional mock-up unit: the tables of its C interface, with unit, meaning and
role. Names, order and start values come from the compiled unit itself."""

from __future__ import annotations

import ctypes
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from reluctance import _core
from reluctance.base.errors import ParameterError

Part = Literal["drive", "stage", "controller"]
PARTS: tuple[Part, ...] = ("drive", "stage", "controller")
TABLES = (
    *("parameter", "input", "waveform", "period", "last_period", "measurement", "order"),
    *("leg", "states"),
)
RENAMED = {  # where a state has the name too
    ("input", "u_dc"): "u_source",
    ("input", "omega_m"): "omega_held",
    ("parameter", "theta_m"): "theta_start",
}
PREFIX = {
    "period": "period.",
    "last_period": "last_period.",
    "measurement": "measured.",
    "order": "order.",
    "states": "states.",
}
OUTPUTS = {  # of the board besides the legs, 1 or 0
    "gate_enable": "the gate drivers may switch",
    "precharged": "the precharge resistor is bridged",
    "chopper": "the brake chopper is on",
}

Meanings = dict[str, tuple[str | None, str]]
# The last word of a name, without the phase, to unit and meaning.
MEANINGS: Meanings = {
    "i": ("A", "phase current"),
    "i_ref": ("A", "current reference of the comparator"),
    "i_band": ("A", "half width of the current band"),
    "i_max": ("A", "current limit"),
    "i_peak": ("A", "peak phase current"),
    "i_source": ("A", "current of the source into the dc link"),
    "i_sat": ("A", "current scale of saturation"),
    "i_squared": ("A2.s", "integral of the squared phase current"),
    "three_on": ("s", "time with three phases on, where phases couple"),
    "u": ("V", "winding voltage"),
    "u_dc": ("V", "dc-link voltage"),
    "u_source": ("V", "voltage of the source of the dc link"),
    "u_min": ("V", "least dc-link voltage"),
    "u_max": ("V", "greatest dc-link voltage"),
    "psi": ("Wb", "flux linkage"),
    "tau": ("N.m", "machine torque"),
    "tau_ref": ("N.m", "torque reference"),
    "tau_load": ("N.m", "torque of the load against positive rotation"),
    "tau_ph": ("N.m", "torque of a phase"),
    "tau_min": ("N.m", "least torque"),
    "tau_max": ("N.m", "greatest torque"),
    "tau_squared": ("N2.m2.s", "integral of the squared torque"),
    "error_squared": ("N2.m2.s", "integral of the squared torque error"),
    "omega_m": ("rad/s", "rotor speed"),
    "omega_held": ("rad/s", "speed at which the shaft is held"),
    "theta_start": ("rad", "rotor angle at the start"),
    "omega_min": ("rad/s", "least rotor speed"),
    "omega_max": ("rad/s", "greatest rotor speed"),
    "theta_m": ("rad", "rotor angle"),
    "theta_e": ("rad", "electrical angle of the first phase"),
    "theta_on": ("rad", "turn-on angle, electrical"),
    "theta_off": ("rad", "turn-off angle, electrical"),
    "theta_ov": ("rad", "overlap angle, electrical"),
    "t": ("s", "time"),
    "t_edge": ("s", "instant of a change of leg, from the sample on"),
    "t_dead": ("s", "dead time"),
    "T_s": ("s", "control period"),
    "dt_max": ("s", "longest integration step"),
    "E_source": ("J", "energy from the source"),
    "E_loss": ("J", "energy lost between source and dc link"),
    "E_dc": ("J", "energy from the dc link"),
    "i_cap": ("A.s", "charge into the dc-link capacitor"),
    "i_cap_squared": ("A2.s", "integral of the squared current of the dc-link capacitor"),
    "E_winding": ("J", "energy into the windings"),
    "E_mech": ("J", "mechanical energy"),
    "W_f": ("J", "field energy"),
    "W_dc": ("J", "energy of the dc link"),
    "turn_ons": (None, "turn-ons of all switches"),
    "S_on": ("V.A", "sum of voltage and current over turn-ons"),
    "S_off": ("V.A", "sum of voltage and current over turn-offs"),
    "leg": (None, "leg: 1 magnetize, 0 freewheel, -1 demagnetize"),
    "gate": (None, f"who switches: {', '.join(f'{g.value} {g.name}' for g in _core.Gate)}"),
    "chop": (None, "leg above the band: 0 freewheel, -1 demagnetize"),
    "R": ("Ohm", "resistance"),
    "R_switch": ("Ohm", "resistance of a switch"),
    "R_diode": ("Ohm", "resistance of a diode"),
    "v_switch": ("V", "threshold voltage of a switch"),
    "v_diode": ("V", "threshold voltage of a diode"),
    "L_u": ("H", "unaligned inductance"),
    "L_sat": ("H", "saturated aligned inductance"),
    "J": ("kg.m2", "inertia of rotor and load"),
    "B": (None, "viscous friction [N m s], or saturation rate of the machine [1/A]"),
    "C": ("F", "capacitance of the dc link"),
    "poa_global": ("W/m2", "irradiance on the array"),
    "temp_cell": ("degC", "cell temperature"),
    "H_static": ("m", "static head"),
    "enable": (None, "1: the drive is asked to run"),
    "clear": (None, "1: a fault is to be cleared; the drive must not be enabled"),
    "at_once": (None, "1: the gates are off, in effect at this sample whatever the delay"),
    "mode": (None, "0 off, 1 precharge, 2 calibrate, 3 ready, 4 run, 5 fault"),
    "status": (None, "what the protection found; 0 is nothing (docs/firmware.md)"),
    "phase": (None, "of the fault; -1: of none"),
    "value": (None, "that the fault was found by"),
    "limit": (None, "of that value"),
    **{name: (None, f"1: {text}") for name, text in OUTPUTS.items()},
}
# The reference of a drive, by its kind.
REFERENCES: Meanings = {
    "torque": ("N.m", "torque reference"),
    "speed": ("rad/s", "speed reference"),
    "pv": ("rad/s", "greatest speed; 0 stops the pump"),
    "none": (None, "1 to motor with the law's own current, -1 to brake, 0 off"),
}
INTEGERS = {"leg", "gate", "chop", "at_once", "mode", "status", "phase", *OUTPUTS}
INDEX = re.compile(r"(_\d+)+$")


@dataclass(frozen=True)
class Variable:
    """One variable of a unit."""

    name: str
    reference: int  # 65536 times the table plus the index plus 1; include/srm/fmi/instance.hpp
    causality: str
    variability: str
    integer: bool
    unit: str | None
    description: str
    start: float | None


def variables(
    library: Path, part: Part, content: bytes, floats: set[str], reference: str
) -> list[Variable]:
    """The variables of a compiled unit; `floats` are the parameters that are real numbers,
    `reference` is the kind of the drive's reference."""
    return list(_variables(_Tables(library, part, content), part, floats, reference))


def _variables(tables: _Tables, part: Part, floats: set[str], reference: str) -> Iterator[Variable]:
    meanings = MEANINGS | {"reference": REFERENCES[reference]}
    for code, table in enumerate(TABLES):
        if table == "measurement" and part == "drive":
            continue  # the controller's business
        if table == "leg" or (table == "order" and part == "drive"):
            continue
        causality, variability = _role(table, part)
        values = tables.values(table) if causality != "output" else None
        for index, name in enumerate(tables.names(table)):
            if table in ("waveform", "states") and name == "t":
                continue
            if table == "parameter" and name not in floats:
                continue
            shown = RENAMED.get((table, name), name)
            word = INDEX.sub("", shown.rpartition(".")[2])
            unit, description = meanings.get(word, (None, ""))
            integer = word in INTEGERS and table != "parameter"
            if table in ("period", "last_period") and word in ("tau", "tau_ref"):
                unit, description = "N.m.s", f"integral of the {description}"
            if table == "last_period":
                description += ", at the end of the last electrical period"
            yield Variable(
                name=PREFIX.get(table, "") + shown,
                reference=65536 * code + index + 1,
                causality=causality,
                variability="discrete" if integer else variability,
                integer=integer,
                unit=unit,
                description=description,
                start=None if values is None else float(values[index]),
            )


def _role(table: str, part: Part) -> tuple[str, str]:
    """Causality and variability of a table's variables."""
    if table == "parameter":
        return "parameter", "fixed"
    if table == "input":
        return "input", "continuous"
    if (table, part) in (("measurement", "controller"), ("order", "stage")):
        return "input", "discrete"
    discrete = table in ("last_period", "order", "states") or part == "controller"
    return "output", "discrete" if discrete else "continuous"


class _Tables:
    """Names and values of the tables of a unit."""

    def __init__(self, library: Path, part: Part, content: bytes) -> None:
        self.lib = ctypes.CDLL(str(library))
        self.lib.srm_last_error.restype = ctypes.c_char_p
        handle = ctypes.c_uint32()
        size = ctypes.c_size_t(len(content))
        self._check(self.lib.srm_create(content, size, PARTS.index(part), ctypes.byref(handle)))
        self.handle = handle.value
        self._check(self.lib.srm_start(handle))

    def names(self, table: str) -> list[str]:
        code, count, name = TABLES.index(table), ctypes.c_int32(), ctypes.c_char_p()
        if self.lib.srm_count(self.handle, code, ctypes.byref(count)) < 0:
            return []  # this part has no such table
        found = []
        for j in range(count.value):
            self._check(self.lib.srm_name(self.handle, code, j, ctypes.byref(name)))
            found.append((name.value or b"").decode())
        return found

    def values(self, table: str) -> NDArray[np.float64]:
        row = np.zeros(len(self.names(table)))
        if len(row):
            code, size = TABLES.index(table), ctypes.c_size_t(len(row))
            place = row.ctypes.data_as(ctypes.c_void_p)
            self._check(self.lib.srm_read(self.handle, code, place, size))
        return row

    def _check(self, status: int) -> None:
        if status < 0:
            raise ParameterError(f"the unit cannot be made: {self.lib.srm_last_error().decode()}")
