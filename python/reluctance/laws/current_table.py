"""The current of fixed conduction angles over the torque: the inverse of the mean torque over the
current, as a table."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from reluctance.drive.operating_point import OperatingPoint
from reluctance.errors import ParameterError
from reluctance.laws import flat_top
from reluctance.units import from_si

FloatArray = NDArray[np.float64]
Currents = tuple[list[float], list[float]]  # over torques, motoring and braking [A]

TABLE_POINTS = 17  # of srm::MeanTorque
CURRENTS = 8 * TABLE_POINTS  # of a curve that is inverted
SMALL = 0.005  # of the torque: less is no difference between a law's own pulse and the flat top
FROM = 1 / 8  # of the greatest torque: where that is asked
FINER = 6  # currents between two of the curve, where the law's own pulses are followed


@dataclass(frozen=True)
class Windows:
    """The angles of motoring and of braking at one speed."""

    point: OperatingPoint
    motors: tuple[float, float]  # turn-on and turn-off, electrical [rad]
    brakes: tuple[float, float]
    currents: tuple[tuple[float, ...], ...] = ()  # of their curves, one or two rows [A]; none: all

    @property
    def pulses(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Turn-on and turn-off angles [rad] and currents [A] of the curves, (2, n), motoring
        first."""
        i = np.array(self.currents or self.point.i_max * np.linspace(0, 1, CURRENTS) ** 1.5)
        on, off = np.transpose([self.motors, self.brakes])[:, :, None]
        on, off, i = np.broadcast_arrays(on, off, i)
        return on, off, i

    def tables(
        self, tau_max: float, mean: Callable[[Windows], FloatArray | None], *, by_rule: bool
    ) -> Currents:
        """The current references [A] for the mean torques 0..tau_max in equal steps, motoring and
        braking; past the greatest torque of the angles that of i_max.

        Parameters
        ----------
        tau_max : float
            [N m].
        mean : callable
            Mean torque of the law's own pulses, as of `pulses` [N m], or None. Flat-top pulses
            serve where they have the same mean, as below base speed, and where it is not known.
        by_rule : bool
            The angles are nobody's choice: a drive whose angles only brake with tau_max is one too.

        Raises
        ------
        ParameterError
            If the angles do not reach tau_max at i_max.
        """
        on, off, i = self.pulses
        wanted = np.linspace(0, tau_max, TABLE_POINTS)
        flat = _rising(flat_top.flat_top(self.point, on, off, i).tau)
        found = [_inverse(flat[way], i[way], wanted) for way in (0, 1)]
        own = mean(self)
        others = []
        for way, tau in enumerate(() if own is None else _rising(own)):
            asked = (wanted >= FROM * tau_max) & (wanted <= flat[way, -1])
            given = np.interp(found[way][asked], i[way], tau)
            if np.any(np.abs(given - wanted[asked]) > SMALL * wanted[asked]):
                found[way] = _inverse(tau, i[way], wanted)
                others.append(way)
        finer = self._about(found)
        own = mean(finer) if others else None
        if own is not None:
            for way in others:
                found[way] = _inverse(_rising(own)[way], finer.pulses[2][way], wanted)
        if (flat[:, -1].max() if by_rule else flat[0, -1]) < tau_max:
            raise self._refused(flat[0, -1], tau_max)
        return found[0].tolist(), found[1].tolist()

    def short(self, tau_max: float, own: FloatArray | None) -> tuple[bool, bool]:
        """Whether the law's own pulses stay below a torque, motoring and braking."""
        if own is None:
            return False, False
        motors, brakes = _rising(own)[:, -1] < tau_max
        return bool(motors), bool(brakes)

    def _about(self, found: list[FloatArray]) -> Windows:
        """The same with more currents between those of the curves that lie about the found."""
        rows = []
        for i, near in zip(self.pulses[2], found, strict=True):
            j = np.clip(np.searchsorted(i, near), 1, len(i) - 1)
            rows.append(tuple(np.sort(np.linspace(i[j - 1], i[j], FINER).ravel()).tolist()))
        return replace(self, currents=tuple(rows))

    def _refused(self, most: float, tau_max: float) -> ParameterError:
        on, off = np.degrees(self.motors)
        return ParameterError(
            f"[control] angles {on:g} to {off:g} deg give a mean torque of at most {most:.4g} N m "
            f"at i_max_A = {self.point.i_max:g} and {from_si(self.point.omega_m, 'rpm'):.5g} rpm, "
            f"need {tau_max:g}; change the angles, the speed or the torque"
        )


def _rising(tau: FloatArray) -> FloatArray:
    """Torque of either way as a positive one that does not fall with the current."""
    return np.asarray(np.maximum.accumulate(tau * np.array([[1], [-1]]), axis=1))


def _inverse(tau: FloatArray, i: FloatArray, wanted: FloatArray) -> FloatArray:
    """The currents over mean torques."""
    rising = np.flatnonzero(np.diff(tau, prepend=-1.0) > 0)
    return np.asarray(np.interp(wanted, tau[rising], i[rising]))
