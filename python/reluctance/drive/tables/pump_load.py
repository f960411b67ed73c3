"""The pump of a [load] table: its torque over speed and static head, as the core takes it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from reluctance import _core
from reluctance.base.arrays import FloatArray
from reluctance.base.schema import checked
from reluctance.drive.tables.sections import Load

if TYPE_CHECKING:
    from reluctance.plant.hydraulics.pipe import Pipe
    from reluctance.plant.hydraulics.pump import Curve


COLUMNS = 97  # of the table: torque is off by 1e-6 of itself between them
FINE = 1001  # of the flow: linear between them, off by 1e-5 of itself
ROWS = 9  # static heads, where the level moves
NEVER = 1e9  # a static head that is not reached [m]


def pump(load: Load) -> _core.Pump:
    """The core's part; without a table where the load has no such pump."""
    t, heads = load.H_static
    course = _core.Course(t=t, value=heads)
    if load.pump is None:
        return _core.Pump(
            H_static=course,
            H_dry=NEVER,
            k_dry=0.0,
            k_shut=0.0,
            omega2_per_m=0.0,
            H_first=0.0,
            H_step=1.0,
            s_step=1.0,
            tau=[],
            rise=[],
            columns=0,
        )
    from scipy.interpolate import CubicSpline

    curve, omega_max = _curve(load)
    rows = np.linspace(min(heads), max(heads), ROWS if max(heads) > min(heads) else 1)
    per_m = curve.omega_ref**2 / curve.H_0
    s = np.linspace(0.0, omega_max, COLUMNS)
    tau = np.array([_torque(load, curve, float(H), np.sqrt(s**2 + per_m * H)) for H in rows])
    rise = CubicSpline(s, tau, axis=1)(s, 1) * s[1]
    k_shut = float(curve.shaft_power(np.zeros(1), np.ones(1))[0]) / curve.omega_ref**3
    return _core.Pump(
        H_static=course,
        H_dry=load.H_dry_m or NEVER,
        k_dry=load.dry_part * k_shut,
        k_shut=k_shut,
        omega2_per_m=per_m,
        H_first=float(rows[0]),
        H_step=float(rows[1] - rows[0]) if len(rows) > 1 else 1.0,
        s_step=float(s[1]),
        tau=tau.ravel().tolist(),
        rise=rise.ravel().tolist(),
        columns=COLUMNS,
    )


def flow(load: Load, omega_m: ArrayLike, t: ArrayLike) -> FloatArray:
    """Flow of the pump at speeds [rad/s] and times [s]; [m^3/s]. 0 where the load has no pump."""
    omega, times = np.asarray(omega_m, float), np.asarray(t, float)
    if load.pump is None or not omega.size:
        return np.zeros_like(omega)
    from scipy.interpolate import RegularGridInterpolator

    H = np.interp(times, *load.H_static)
    curve, omega_max = _curve(load)
    per_m = curve.omega_ref**2 / curve.H_0
    rows = np.linspace(H.min(), H.max() + 1.0, ROWS)
    s = np.linspace(0.0, omega_max, FINE)  # the flow is nearly straight over it
    table = [_flow(load, curve, float(row), np.sqrt(s**2 + per_m * row)) for row in rows]
    x = np.sqrt(np.maximum(omega * np.abs(omega) - per_m * H, 0.0))
    Q = RegularGridInterpolator((rows, s), table)(np.stack([H, np.minimum(x, s[-1])], -1))
    dry = load.H_dry_m is not None and H >= (load.H_dry_m or NEVER)
    return np.where((x <= 0) | dry, 0.0, Q)


def _flow(load: Load, curve: Curve, H: float, omega: FloatArray) -> FloatArray:
    """At speeds from the one on at which the pump reaches the static head [m^3/s]."""
    from reluctance.plant.hydraulics.pipe import flow as flow_of

    return flow_of(curve, _pipe(load, H), omega / curve.omega_ref)


def _torque(load: Load, curve: Curve, H: float, omega: FloatArray) -> FloatArray:
    """At speeds from the one on at which the pump reaches the static head [N m]."""
    power = curve.shaft_power(_flow(load, curve, H, omega), omega / curve.omega_ref)
    return np.asarray(np.divide(power, omega, out=np.zeros_like(power), where=omega > 0))


def _pipe(load: Load, H: float) -> Pipe:
    from reluctance.plant.hydraulics.pipe import Pipe

    keys = ("L_m", "D_mm", "roughness_mm", "K")
    return checked(Pipe, {"H_static_m": H, **{key: getattr(load, key) for key in keys}}, "[load]")


def _curve(load: Load) -> tuple[Curve, float]:
    """The pump's curve and greatest speed [rad/s]."""
    from reluctance.plant.hydraulics.pump import Pump, pump_from

    found = load.pump if isinstance(load.pump, Pump) else pump_from(load.pump, Path())
    return found.curve(), found.omega_max
