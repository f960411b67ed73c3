"""The [load] table: what is on the shaft, and the table of a pump's torque."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field, model_validator

from reluctance import _core
from reluctance.base.arrays import FloatArray
from reluctance.base.schema import checked
from reluctance.base.units import to_si
from reluctance.drive.tables.over_time import OverTime, course
from reluctance.plant.hydraulics.curve import Curve
from reluctance.plant.hydraulics.pipe import Pipe
from reluctance.plant.hydraulics.pipe import flow as flow_of
from reluctance.plant.hydraulics.pump import Pump, PumpName, pump_from

COLUMNS = 97  # of the table: torque is off by 1e-6 of itself between them
FINE = 1001  # of the flow: linear between them, off by 1e-5 of itself
ROWS = 9  # static heads, where the level moves
HYDRAULIC = {"pump", "H_static_m", "H_dry_m", "dry_part", "L_m", "D_mm", "roughness_mm", "K"}
NEVER = 1e9  # a static head that is not reached [m]


class Load(OverTime):
    """What is on the shaft. `speed_rpm` is held by a locked shaft and starts the others. The course
    over time is the held speed in rpm, the torque in N m, or the static head in m."""

    kind: Literal["locked", "pump", "fan", "torque"]
    speed_rpm: float = Field(0.0, ge=-1e6, le=1e6)
    J_kgm2: float = Field(0.0, ge=0)  # in addition to the rotor's
    k_pump_Nms2: float = Field(0.0, ge=0)  # pump torque k omega^2, or
    pump: PumpName | Pump | None = None  # of the library, the path of a file, or its table
    H_static_m: float | None = Field(None, ge=0)  # from the water level to the outlet
    H_dry_m: float | None = Field(None, gt=0)  # from here on the level is below the intake
    dry_part: float = Field(0.1, gt=0, lt=1)  # of the torque without flow: without water
    L_m: float = Field(0.0, ge=0)  # pipe
    D_mm: float | None = Field(None, gt=0)
    roughness_mm: float = Field(0.05, ge=0)
    K: float = Field(0.0, ge=0)  # sum of the minor loss coefficients
    k_fan_Nms2: float = Field(0.0, ge=0)  # fan torque k omega |omega|
    tau_Nm: float = 0.0  # constant torque against positive rotation

    @model_validator(mode="after")
    def numbers_belong_to_the_kind(self) -> Load:
        for key in sorted(self.model_fields_set & HYDRAULIC):
            if self.kind != "pump":
                raise ValueError(f"{key} has no effect with kind = {self.kind!r}; remove it")
            if self.pump is None:
                raise ValueError(
                    f"{key} has no effect without `pump`, a pump of the library or a file"
                )
        for kind in ("pump", "fan"):
            key = f"k_{kind}_Nms2"
            if self.kind == kind and getattr(self, key) == 0 and self.pump is None:
                raise ValueError(f"kind = {kind!r} needs {key} > 0")
            if self.kind != kind and getattr(self, key) != 0:
                raise ValueError(f"{key} has no effect with kind = {self.kind!r}; remove it")
        if self.pump is not None and self.k_pump_Nms2 != 0:
            raise ValueError("need either k_pump_Nms2 or pump")
        if self.pump is not None and self.D_mm is None:
            raise ValueError("pump needs D_mm, the inner diameter of its pipe")
        if self.kind != "torque" and self.tau_Nm != 0:
            raise ValueError(f"tau_Nm has no effect with kind = {self.kind!r}; remove it")
        if self.values and self.kind not in ("locked", "torque") and self.pump is None:
            raise ValueError(f"values have no effect with kind = {self.kind!r}; remove them")
        constant = {"locked": "speed_rpm", "torque": "tau_Nm"}.get(self.kind, "H_static_m")
        if self.values and getattr(self, constant):
            raise ValueError(f"need either {constant} or t_s and values")
        if self.pump is not None and not self.values and self.H_static_m is None:
            raise ValueError("pump needs H_static_m, or t_s and values")
        if self.pump is not None and any(H < 0 for H in self.values):
            raise ValueError(f"values = {self.values}, need static heads >= 0")
        return self

    @property
    def H_static(self) -> tuple[list[float], list[float]]:
        """Times [s] and static heads of a pump [m]."""
        return self.points(self.H_static_m or 0.0) if self.pump is not None else ([0.0], [0.0])

    @property
    def k(self) -> float:
        """Of the torque k omega |omega| of a pump or fan [N m s^2]."""
        return self.k_pump_Nms2 + self.k_fan_Nms2

    @property
    def omega(self) -> tuple[list[float], list[float]]:
        """Times [s] and speeds [rad/s]: held by a locked shaft, else the one at the start."""
        start = to_si(self.speed_rpm, "rpm")
        return self.points(start, "rpm") if self.kind == "locked" else ([0.0], [start])

    @property
    def tau_0(self) -> tuple[list[float], list[float]]:
        """Times [s] and load torques that do not depend on the speed [N m]."""
        return self.points(self.tau_Nm) if self.kind == "torque" else ([0.0], [0.0])

    def core(self, *, J: float, B: float) -> _core.Shaft:
        """The shaft and its load: J of rotor and load [kg m^2], B of the machine [N m s]."""
        held = self.kind == "locked"
        return _core.Shaft(
            rotation=_core.Rotation.locked if held else _core.Rotation.turning,
            J=J,
            B=B,
            k=self.k,
            tau_0=course(self.tau_0),
            omega=course(self.omega),
            pump=self._pump() if self.pump is not None else _core.Pump(),
        )

    def torque(self, omega_m: float) -> float:
        """Load torque at a speed, with the greatest torque and the first static head [N m]."""
        pumped = self._pump().torque(omega_m, 0.0) if self.pump is not None else 0.0
        return self.k * omega_m * abs(omega_m) + max(self.tau_0[1], key=abs) + pumped

    def _pump(self) -> _core.Pump:
        from scipy.interpolate import CubicSpline

        t, heads = self.H_static
        curve, omega_max = self._curve()
        rows = np.linspace(min(heads), max(heads), ROWS if max(heads) > min(heads) else 1)
        per_m = curve.omega_ref**2 / curve.H_0
        s = np.linspace(0.0, omega_max, COLUMNS)
        tau = np.array([self._tau(curve, float(H), np.sqrt(s**2 + per_m * H)) for H in rows])
        rise = CubicSpline(s, tau, axis=1)(s, 1) * s[1]
        k_shut = float(curve.shaft_power(np.zeros(1), np.ones(1))[0]) / curve.omega_ref**3
        return _core.Pump(
            H_static=course((t, heads)),
            H_dry=self.H_dry_m or NEVER,
            k_dry=self.dry_part * k_shut,
            k_shut=k_shut,
            omega2_per_m=per_m,
            H_first=float(rows[0]),
            H_step=float(rows[1] - rows[0]) if len(rows) > 1 else 1.0,
            s_step=float(s[1]),
            tau=tau.ravel().tolist(),
            rise=rise.ravel().tolist(),
            columns=COLUMNS,
        )

    def flow(self, omega_m: ArrayLike, t: ArrayLike) -> FloatArray:
        """Flow of the pump at speeds [rad/s] and times [s]; [m^3/s]. 0 where there is no pump."""
        omega, times = np.asarray(omega_m, float), np.asarray(t, float)
        if self.pump is None or not omega.size:
            return np.zeros_like(omega)
        from scipy.interpolate import RegularGridInterpolator

        H = np.interp(times, *self.H_static)
        curve, omega_max = self._curve()
        per_m = curve.omega_ref**2 / curve.H_0
        rows = np.linspace(H.min(), H.max() + 1.0, ROWS)
        s = np.linspace(0.0, omega_max, FINE)  # the flow is nearly straight over it
        table = [self._Q(curve, float(row), np.sqrt(s**2 + per_m * row)) for row in rows]
        x = np.sqrt(np.maximum(omega * np.abs(omega) - per_m * H, 0.0))
        Q = RegularGridInterpolator((rows, s), table)(np.stack([H, np.minimum(x, s[-1])], -1))
        dry = self.H_dry_m is not None and H >= (self.H_dry_m or NEVER)
        return np.where((x <= 0) | dry, 0.0, Q)

    def _Q(self, curve: Curve, H: float, omega: FloatArray) -> FloatArray:
        """At speeds from the one on at which the pump reaches the static head [m^3/s]."""
        return flow_of(curve, self._pipe(H), omega / curve.omega_ref)

    def _tau(self, curve: Curve, H: float, omega: FloatArray) -> FloatArray:
        """At speeds from the one on at which the pump reaches the static head [N m]."""
        power = curve.shaft_power(self._Q(curve, H, omega), omega / curve.omega_ref)
        return np.asarray(np.divide(power, omega, out=np.zeros_like(power), where=omega > 0))

    def _pipe(self, H: float) -> Pipe:
        keys = ("L_m", "D_mm", "roughness_mm", "K")
        values = {key: getattr(self, key) for key in keys}
        return checked(Pipe, {"H_static_m": H, **values}, "[load]")

    def _curve(self) -> tuple[Curve, float]:
        """The pump's curve and greatest speed [rad/s]."""
        found = self.pump if isinstance(self.pump, Pump) else pump_from(self.pump, Path())
        return found.curve(), found.omega_max
