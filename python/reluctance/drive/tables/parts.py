"""The tables of a drive file as parts of the core's plant."""

from __future__ import annotations

from reluctance import _core
from reluctance.drive.tables.pump_load import pump
from reluctance.drive.tables.pv_source import pv_array
from reluctance.drive.tables.sections import Converter, Load, Source


def course(points: tuple[list[float], list[float]]) -> _core.Course:
    """Times [s] and values."""
    t, value = points
    return _core.Course(t=t, value=value)


def source(table: Source, u_dc: float) -> _core.StiffSource | _core.Battery | _core.PvArray:
    """What feeds the dc link; u_dc: its nominal voltage [V]."""
    if table.kind == "pv":
        return pv_array(table)
    voltage = course(table.points(u_dc))
    if table.kind == "stiff":
        return _core.StiffSource(u_dc=voltage)
    return _core.Battery(E=voltage, R=table.si["R"], C=table.si["C"], one_way=table.one_way)


def bridge(converter: Converter) -> _core.AsymmetricBridge | _core.SharedSwitchBridge:
    """The power converter."""
    devices = _core.Devices(
        v_switch=converter.v_switch_V,
        R_switch=converter.R_switch_ohm,
        v_diode=converter.v_diode_V,
        R_diode=converter.R_diode_ohm,
    )
    if converter.bridge == "asymmetric":
        return _core.AsymmetricBridge(device=devices)
    return _core.SharedSwitchBridge(device=devices)


def shaft(load: Load, *, J: float, B: float) -> _core.Shaft:
    """The shaft and its load: J of rotor and load [kg m^2], B of the machine [N m s]."""
    held = load.kind == "locked"
    return _core.Shaft(
        rotation=_core.Rotation.locked if held else _core.Rotation.turning,
        J=J,
        B=B,
        k=load.k,
        tau_0=course(load.tau_0),
        omega=course(load.omega),
        load=None,
        pump=pump(load),
    )
