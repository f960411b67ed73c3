"""Where the voltage suffices for the window of DITC (control/law/ditc.hpp)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from reluctance import _core
from reluctance.base.arrays import FloatArray
from reluctance.drive.laws.hand_over import TORQUES
from reluctance.drive.tables.known import Known

STEPS = 60  # angles of a stroke
CURRENTS = 200  # of the flux linkage at an angle
LEADS = np.geomspace(0.02, 1, 80)  # tried: what the rise of the flux takes of a stroke [1]
NO_FLUX = 1e-12  # less is none [Wb]
PASSES = 3  # in which phases make up for what their neighbours give


@dataclass(frozen=True)
class Alone:
    """A phase that gives the torques 0..tau_max alone, for a stroke before it is turned off."""

    known: Known
    theta_off: float  # [rad]
    sense: int  # of the torque; -1 brakes

    @property
    def stroke(self) -> float:
        """[rad]"""
        return 2 * np.pi / self.known.n_phases

    @cached_property
    def angles(self) -> FloatArray:
        """An electrical period that begins two strokes before turn-off, (n_angles,) [rad]."""
        strokes = np.arange(self.known.n_phases * STEPS) / STEPS - 2
        return np.asarray(self.theta_off + self.stroke * strokes)

    @cached_property
    def maps(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Current, flux linkage and wanted torque at the angles, each (n_angles, CURRENTS)."""
        i = np.tile(self.known.i_max * np.linspace(0, 1, CURRENTS) ** 1.5, (self.angles.size, 1))
        at = _core.magnetics(self.known.magnetics, i.ravel(), np.repeat(self.angles, CURRENTS))
        return i, at[:, 0].reshape(i.shape), self.sense * at[:, 2].reshape(i.shape)

    @cached_property
    def torques(self) -> FloatArray:
        """(TORQUES,) [N m]"""
        return np.asarray(self.known.tau_max * np.linspace(0, 1, TORQUES))

    def flux(self, n: int, tau: FloatArray) -> FloatArray:
        """That gives a torque at an angle [Wb]."""
        _, psi, given = self.maps
        return np.asarray(np.interp(tau, np.maximum.accumulate(given[n].clip(0)), psi[n]))

    def torque(self, n: int, psi: FloatArray) -> FloatArray:
        """At an angle [N m]."""
        return np.asarray(np.interp(psi, self.maps[1][n], self.maps[2][n]))

    @cached_property
    def taken_over(self) -> tuple[FloatArray, FloatArray]:
        """Flux linkage a stroke before turn-off [Wb], and the part of the voltage that the
        resistance leaves while it rises [1]; both (TORQUES,)."""
        psi = self.flux(STEPS, self.torques)
        i = np.interp(psi, self.maps[1][STEPS], self.maps[0][STEPS])
        return psi, np.maximum(1 - self.known.R * i / 2 / self.known.u_dc, 0.5)

    @property
    def psi(self) -> FloatArray:
        """Flux linkage that full voltage has to build for each torque, (TORQUES,) [Wb]."""
        psi, left = self.taken_over
        return psi / left

    def reach(self, band: float) -> FloatArray:
        """Greatest omega_e/u_dc at which the torque is the one asked for at every angle, for each
        torque, (TORQUES,) [rad/Wb]; none where i_max does not give it.

        Full voltage builds the flux linkage within a stroke, for the rules know two phases. Then
        the phase gives what its neighbours leave, as far as the voltage lets its flux linkage
        follow; turned off, the flux linkage falls.

        Parameters
        ----------
        band : what may be missing of the torque [1].
        """
        wanted, leads = np.meshgrid(self.torques[1:], LEADS, indexing="ij")
        short = self._short(wanted.ravel(), leads.ravel()).reshape(wanted.shape)
        holds = np.logical_and.accumulate(short <= band * wanted, axis=1)
        lead = np.append(0.0, LEADS)[holds.sum(axis=1)] * self.stroke
        most = lead / np.maximum(self.psi[1:], NO_FLUX)
        return np.append(most[0], most)  # no torque: nothing is asked

    def _short(self, wanted: FloatArray, leads: FloatArray) -> FloatArray:
        """Torque that is missing at the worst angle [N m]. wanted: torque, leads: in strokes; each
        of any one shape."""
        first, left = (np.interp(wanted, self.torques, of) for of in self.taken_over)
        step = first / left / (leads * STEPS)  # of the flux linkage, under all of the voltage [Wb]
        drop = self.known.R / self.known.u_dc * step  # of the resistance, for an ampere [Wb]
        given = np.zeros((self.angles.size, wanted.size))
        for n in range(STEPS):  # until it takes over
            given[n] = self.torque(n, np.maximum(first - (STEPS - n) * left * step, 0.0))
        for _ in range(PASSES):
            others = given[:STEPS] + _folded(given[2 * STEPS :])
            psi, given[STEPS] = first, self.torque(STEPS, first)
            for n in range(STEPS + 1, 2 * STEPS):
                goal = self.flux(n, np.maximum(wanted - others[n - STEPS], 0.0))
                i = np.interp(psi, self.maps[1][n], self.maps[0][n])
                psi = np.clip(goal, psi - step, psi + step - drop * i)
                given[n] = self.torque(n, psi)
            for n in range(2 * STEPS, self.angles.size):
                psi = np.maximum(psi - step, 0.0)
                given[n] = self.torque(n, psi)
        return np.asarray(wanted - _folded(given).min(axis=0))


def _folded(given: FloatArray) -> FloatArray:
    """Sum over the phases, from that of one, (STEPS, ...)."""
    return np.asarray(given.reshape(-1, STEPS, *given.shape[1:]).sum(axis=0))
