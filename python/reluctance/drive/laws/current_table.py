"""The current of fixed conduction angles over the torque: the inverse of the mean torque over the
current, as a table."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from reluctance.base.arrays import FloatArray
from reluctance.drive.laws.pulses import FixedLaw, pulses

TABLE_POINTS = 17  # of srm::MeanTorque
CURRENTS = 4 * TABLE_POINTS  # of the curve that is inverted; it can jump with a chopping more
FEW = 2 * TABLE_POINTS  # where it does not
FINER = 5  # currents between two of the curve, about each entry of the table


@dataclass(frozen=True)
class Window:
    """Turn-on and turn-off angle of a law whose current is fixed, electrical [rad]."""

    theta_on: float
    theta_off: float
    law: FixedLaw

    @property
    def ends(self) -> tuple[float, float]:
        """Both angles."""
        return self.theta_on, self.theta_off

    @cached_property
    def curve(self) -> Curve:
        """Mean torque over the current, up to i_max."""
        return self._curve(self.law.known.i_max * np.linspace(0, 1, self._count) ** 1.5)

    def currents(self, tau_max: float) -> list[float]:
        """The current references for the mean torques 0..tau_max in equal steps [A]; past the
        greatest torque that of i_max."""
        wanted, i = np.linspace(0, tau_max, TABLE_POINTS), self.curve.i
        finest = 2 if self.law.smooth else FINER
        at = np.clip(np.searchsorted(i, self.curve.inverse(wanted)), 1, len(i) - 1)
        finer = self._curve(np.unique(np.linspace(i[at - 1], i[at], finest + 1)))
        return [float(current) for current in finer.inverse(wanted)]

    @property
    def _count(self) -> int:
        return FEW if self.law.smooth else CURRENTS

    def _curve(self, i: FloatArray) -> Curve:
        tau = pulses(self.law, self.theta_on, self.theta_off, i).tau
        return Curve(i, np.maximum.accumulate(np.maximum(tau, 0.0)))


@dataclass(frozen=True)
class Curve:
    """Mean torque, which does not fall, over the current."""

    i: FloatArray  # rising [A]
    tau: FloatArray  # [N m]

    def inverse(self, wanted: FloatArray) -> FloatArray:
        """The currents of mean torques [A]. Between two the torque grows as their square, as
        without saturation."""
        rising = np.flatnonzero(np.diff(self.tau, prepend=-1.0) > 0)
        return np.interp(np.sqrt(wanted), np.sqrt(self.tau[rising]), self.i[rising])
