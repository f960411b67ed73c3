"""Pump, pipe and lift: flow, head and shaft power over speed.

    H_pump(Q, r) = H_static + (f L/D + K) v^2 / (2 g),   v = Q / (pi D^2/4)

f = 64/Re below Re = 2300, above it Swamee and Jain, J. Hydraul. Div. 102 (1976) 657. A check valve
keeps Q >= 0: below the speed at which the shut-off head reaches the static head nothing flows.
"""

from dataclasses import dataclass

import numpy as np
from pydantic import Field, model_validator

from reluctance.base.arrays import FloatArray
from reluctance.base.errors import ParameterError
from reluctance.base.schema import Section
from reluctance.plant.hydraulics.curve import GRAVITY, Curve

LAMINAR = 2300.0  # Reynolds number
ON_CURVE = 0.999  # of the end of the curve: a flow above it is taken as past it
WIDER = 1.01  # the least speed times this is the first one that is of use
HALVINGS = 60  # of the flow: to the last digit
LEAST_FLOW = 0.02  # of the end of the curve: less at the largest speed is no pipe for this pump
LEAST_SPARE = 0.05  # of the shut-off head over the static one: with less the lift is the cause
LONGEST = 2e4  # of a pipe [m]: 20 m in millimetres
SPEEDS = 241  # of the table


class Pipe(Section):
    """[pipe]: what the pump works against."""

    H_static_m: float = Field(ge=0)  # from the water level in the well to the outlet
    L_m: float = Field(0.0, ge=0)
    D_mm: float = Field(gt=0)
    roughness_mm: float = Field(0.05, ge=0)
    K: float = Field(0.0, ge=0)  # sum of the minor loss coefficients
    nu_m2ps: float = Field(1e-6, gt=0)  # kinematic viscosity of water
    well_yield_m3ph: float | None = Field(None, gt=0)  # more would run the well, and the pump, dry

    @model_validator(mode="after")
    def pipe_is_in_metres(self) -> "Pipe":
        if self.L_m > LONGEST:
            raise ValueError(
                f"L_m = {self.L_m:g}, need at most {LONGEST:g}; check its unit: it is in metres"
            )
        return self

    @model_validator(mode="after")
    def pump_works_against_something(self) -> "Pipe":
        if self.H_static_m == 0 and self.L_m == 0 and self.K == 0:
            raise ValueError(
                "H_static_m = 0 without L_m or K: no head at all, the pump would run out to the "
                "end of its curve; give the pipe or the head"
            )
        return self

    def friction_head(self, Q: FloatArray) -> FloatArray:
        """Head lost in the pipe at a flow [m^3/s]; [m]."""
        D = self.D_mm * 1e-3
        v = np.asarray(Q) / (np.pi * D**2 / 4)
        Re = np.maximum(v * D / self.nu_m2ps, 1.0)
        rough = self.roughness_mm / self.D_mm / 3.7
        turbulent = 0.25 / np.log10(rough + 5.74 / np.maximum(Re, LAMINAR) ** 0.9) ** 2
        f = np.where(Re < LAMINAR, 64 / Re, turbulent)
        return np.asarray((f * self.L_m / D + self.K) * v**2 / (2 * GRAVITY))


@dataclass(frozen=True)
class Hydraulics:
    """Flow and power over speed, from the least speed that lifts water to the largest allowed."""

    omega: FloatArray  # (n,) shaft speed [rad/s]
    Q: FloatArray  # (n,) flow [m^3/s]
    H: FloatArray  # (n,) head of the pump [m]
    p_shaft: FloatArray  # (n,) [W]

    @property
    def tau(self) -> FloatArray:
        """Torque of the pump [N m]."""
        return np.asarray(self.p_shaft / self.omega)


def flow(curve: Curve, pipe: Pipe, r: FloatArray) -> FloatArray:
    """Flow at a part of the reference speed, by bisection [m^3/s]."""
    r = np.asarray(r, dtype=float)
    low, high = np.zeros_like(r), curve.Q_end * r
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        lifts = curve.head(middle, r) > pipe.H_static_m + pipe.friction_head(middle)
        low, high = np.where(lifts, middle, low), np.where(lifts, high, middle)
    return np.asarray(np.where(curve.H_0 * r**2 > pipe.H_static_m, (low + high) / 2, 0.0))


def least_speed(curve: Curve, pipe: Pipe) -> float:
    """Part of the reference speed below which nothing flows."""
    return float(np.sqrt(pipe.H_static_m / curve.H_0))


def _slower(curve: Curve, pipe: Pipe, least: float, most: float) -> str:
    """A remedy: the greatest speed at which the pump stays on its curve, where there is one."""
    low, high = least, most
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        out = flow(curve, pipe, np.array(middle)) > ON_CURVE * curve.Q_end * middle
        low, high = (low, middle) if out else (middle, high)
    if low < WIDER * least:  # without static head it runs out at any speed
        return ""
    return f"lower [pump] speed_max_rpm to {np.floor(low * curve.omega_ref * 30 / np.pi):g}, or "


def hydraulics(curve: Curve, pipe: Pipe, omega_max: float) -> Hydraulics:
    """The table over speed. Its nodes are equidistant in sqrt(r^2 - r_min^2), in which flow is
    nearly straight: it starts at the threshold with a vertical tangent over speed.

    Raises
    ------
    ParameterError
        If the pump never lifts water to the outlet, or runs out past the end of its curve.
    """
    least, most = least_speed(curve, pipe), omega_max / curve.omega_ref
    if least >= most:
        raise ParameterError(
            f"[pipe] H_static_m = {pipe.H_static_m:g}, but the pump reaches "
            f"{curve.H_0 * most**2:.4g} m without flow at its largest speed "
            f"{omega_max * 30 / np.pi:.4g} rpm; lower the head or take another pump"
        )
    least = max(least, 0.02 * most)  # no head: from a creeping speed on
    r = np.sqrt(least**2 + np.linspace(0, np.sqrt(most**2 - least**2), SPEEDS) ** 2)
    Q = flow(curve, pipe, r)
    if Q[-1] > ON_CURVE * curve.Q_end * r[-1]:
        raise ParameterError(
            f"[pipe] the pump runs out past {curve.Q_end * r[-1] * 3600:.4g} m3/h, the end of its "
            f"curve at {omega_max * 30 / np.pi:.4g} rpm: too little head; "
            f"{_slower(curve, pipe, least, most)}take a curve with more flow; check H_static_m, "
            "L_m, D_mm and K"
        )
    ends, shut_off = curve.Q_end * r[-1], curve.H_0 * r[-1] ** 2
    if Q[-1] < LEAST_FLOW * ends and shut_off - pipe.H_static_m > LEAST_SPARE * shut_off:
        raise ParameterError(
            f"[pipe] D_mm = {pipe.D_mm:g} lets {Q[-1] * 3600:.3g} m3/h through at the largest "
            f"speed, of {ends * 3600:.4g} m3/h that the pump's curve has: friction takes all head; "
            "check the unit (millimetres), L_m and K"
        )
    return Hydraulics(r * curve.omega_ref, Q, curve.head(Q, r), curve.shaft_power(Q, r))
