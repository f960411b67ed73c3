"""The closed loop of a drive as the core takes it: its tables become parts of the plant."""

from __future__ import annotations

from typing import Any

from reluctance import _core
from reluctance.base.units import to_si
from reluctance.drive.drive import Drive
from reluctance.drive.tables.over_time import course
from reluctance.drive.tables.supervision import Supervision

EMPTY = 0.01  # of its voltage: the dc link before its precharge


def closed_loop(
    drive: Drive, controller: _core.Controller, record_every: float
) -> _core.Simulation:
    """The loop at its start. record_every: waveform interval [s]; 0: every point; < 0: none."""
    parts = _core.SimulationParts(**loop_parts(drive, record_every))
    return _core.Simulation(controller, parts, drive.faults.core(drive.machine.N_r))


def loop_parts(drive: Drive, record_every: float) -> dict[str, Any]:
    """All parts of the loop but its controller."""
    machine = drive.machine
    return {
        "machine": machine.magnetics,
        "R": machine.R,
        "source": _source(drive),
        "bridge": drive.converter.core(),
        "shaft": drive.load.core(J=drive.J, B=machine.B_Nms),
        "coupling": machine.pair_tables,
        "t_dead": drive.converter.t_dead,
        "sampling": drive.sensing.core(
            T_s=drive.control.T_s,
            N_r=machine.N_r,
            angle_offset=to_si(drive.mismatch.angle_offset_deg, "deg"),
        ),
        "reference": course(drive.reference.course),
        "theta_m": to_si(drive.simulation.theta_start_deg, "deg"),
        "resolution": _core.Resolution(
            dt_max=to_si(drive.simulation.dt_max_us, "us"),
            scale=_core.Scale(i=machine.i_max_A, u_dc=drive.converter.u_dc_V),
            record_every=record_every,
        ),
    }


def _source(drive: Drive) -> _core.StiffSource | _core.Battery | _core.PvArray:
    """What feeds the dc link, with its sags."""
    if drive.supervision.precharge_ms > 0:
        return precharged(drive, drive.supervision)
    u_dc = drive.converter.u_dc_V
    return drive.faults.sagged(drive.source, u_dc).core(u_dc)


def precharged(
    drive: Drive, supervision: Supervision
) -> _core.StiffSource | _core.Battery | _core.PvArray:
    """A source of constant voltage that rises through the precharge resistor."""
    u_dc, start = drive.converter.u_dc_V, supervision.enable_s or 0.0
    end = start + supervision.si["precharge"]
    rise = drive.source.computed(t_s=[start, end], values=[EMPTY * u_dc, u_dc])
    return drive.faults.sagged(rise, u_dc).core(u_dc)
