"""The curve of a centrifugal pump at one speed, and by affinity at all others.

H(Q, r) = r^2 H_1(Q/r),   P(Q, r) = r^3 P_1(Q/r),   r = speed / reference speed
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from reluctance.base.arrays import FloatArray

RHO = 998.2  # water at 20 degC [kg/m^3]
GRAVITY = 9.80665  # [m/s^2]
RPM = np.pi / 30
M3PH = 1 / 3600


@dataclass(frozen=True)
class Curve:
    """Head and shaft power at the reference speed."""

    omega_ref: float  # [rad/s]
    Q_end: float  # largest flow that the curve describes, at the reference speed [m^3/s]
    head_1: Callable[[FloatArray], FloatArray]  # of flow [m]
    power_1: Callable[[FloatArray], FloatArray]  # of flow [W]

    def head(self, Q: FloatArray, r: FloatArray) -> FloatArray:
        """Head at a flow [m^3/s] and a part of the reference speed [m]."""
        return np.asarray(r**2 * self.head_1(Q / np.maximum(r, 1e-12)))

    def shaft_power(self, Q: FloatArray, r: FloatArray) -> FloatArray:
        """Shaft power, finite without flow [W]."""
        return np.asarray(r**3 * self.power_1(Q / np.maximum(r, 1e-12)))

    @property
    def H_0(self) -> float:
        """Head without flow at the reference speed [m]."""
        return float(self.head_1(np.zeros(1))[0])
