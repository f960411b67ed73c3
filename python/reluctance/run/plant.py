"""The closed loop of a drive as the core takes it: its tables become parts of the plant."""

from __future__ import annotations

from typing import Any

from reluctance import _core
from reluctance.drive import Drive
from reluctance.drive.pump_load import pump
from reluctance.drive.pv_source import pv_array
from reluctance.drive.tables import Converter, Load, Source
from reluctance.units import to_si


def closed_loop(
    drive: Drive, controller: _core.Controller, record_every: float
) -> _core.Simulation:
    """The loop at its start. record_every: waveform interval [s]; 0: every point; < 0: none."""
    return _core.Simulation(
        n_phases=drive.machine.n_phases, controller=controller, **loop_parts(drive, record_every)
    )


def loop_parts(drive: Drive, record_every: float) -> dict[str, Any]:
    """All parts of the loop but its controller."""
    machine, sensing, load = drive.machine, drive.sensing, drive.load
    return {
        "machine": machine.magnetics,
        "R": machine.R,
        "source": source(drive.source, drive.converter.u_dc_V),
        "bridge": bridge(drive.converter),
        "shaft": shaft(load, J=drive.J, B=machine.B_Nms),
        "t_dead": drive.converter.t_dead,
        "sampling": _core.Sampling(
            T_s=drive.control.T_s,
            angle_offset=to_si(drive.mismatch.angle_offset_deg, "deg"),
            **sensing.sampling(machine.N_r),
        ),
        "reference": course(drive.reference.course),
        "theta_m": to_si(drive.simulation.theta_start_deg, "deg"),
        "resolution": _core.Resolution(
            dt_max=to_si(drive.simulation.dt_max_us, "us"),
            scale=_core.Scale(i=machine.i_max_A, u_dc=drive.converter.u_dc_V),
            record_every=record_every,
        ),
    }


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
