"""Radial force on the stator poles of a run: its spatial orders, each over time.

Each pole has the force of its own phase, alone at its current and angle. Over the N_s poles,

    F_n(t) = c/N_s sum over k of f_k(t) exp(-2 pi j n k/N_s),    c = 1 for n = 0 and N_s/2, else 2,

so that order 0 is the mean of the poles, and order n the amplitude of a wave with n periods around
the stator, in newton a pole. What the field of one phase does on the poles of another is left out.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import gcd

import numpy as np
from numpy.typing import NDArray

from reluctance.base.arrays import FloatArray
from reluctance.base.errors import ParameterError
from reluctance.drive.run.kpis import evaluated
from reluctance.drive.run.record import Record
from reluctance.machine.machine_file import MachineFile

MOST_SAMPLES = 2**16  # over the window of the key figures
NOTHING = 1e-9  # of the largest force: rounding


@dataclass(frozen=True)
class ForceOrder:
    """One spatial order of the radial force, over the window of the key figures."""

    order: int  # periods around the stator
    mean: float  # of the amplitude [N]
    max: float  # [N]
    f: float  # frequency of the largest oscillation; negative: against the order of the poles [Hz]
    amplitude: float  # of that oscillation [N]

    def with_units(self) -> dict[str, float]:
        """The same under the names of the command line."""
        return {
            "order": self.order,
            "mean_N": self.mean,
            "max_N": self.max,
            "f_Hz": self.f,
            "amplitude_N": self.amplitude,
        }

    def __str__(self) -> str:
        return (
            f"order {self.order}: {self.mean:.3g} N mean, {self.max:.3g} N greatest; largest "
            f"oscillation {self.amplitude:.3g} N at {abs(self.f):.4g} Hz"
        )


def pole_forces(machine: MachineFile, i: FloatArray, theta_m: FloatArray) -> FloatArray:
    """Radial force on each stator pole, shape (N_s, n) [N], from phase currents (n_phases, n) [A]
    and rotor angles (n,) [rad].

    Raises
    ------
    ParameterError
        If the machine has no force table.
    """
    if machine.pole_force is None:
        raise ParameterError(
            "this machine has no radial force; make it with `reluctance machine from-geometry`"
        )
    ahead = machine.N_r // gcd(machine.N_s, machine.N_r)  # phases of the drive from pole to pole
    phases = ahead * np.arange(machine.N_s) % machine.n_phases
    theta_e = machine.N_r * theta_m - 2 * np.pi * phases[:, None] / machine.n_phases
    return machine.pole_force.at(i[phases], theta_e)


def spatial_orders(forces: FloatArray) -> NDArray[np.complex128]:
    """F_n(t) of forces (N_s, n), shape (N_s//2 + 1, n)."""
    N_s = len(forces)
    waves = np.fft.rfft(forces, axis=0) / N_s
    waves[1 : (N_s + 1) // 2] *= 2
    return np.asarray(waves)


def force_orders(result: Record) -> list[ForceOrder]:
    """The orders that a run has, over the window of its key figures.

    Raises
    ------
    ParameterError
        If the machine has no force table, or the run no waveforms.
    """
    if result.t.size == 0:
        raise ParameterError("the run has no waveforms; simulate with record = 0")
    machine = result.drive.machine
    window = evaluated(result.periods, machine.N_r)[0]["t"]
    n = min(MOST_SAMPLES, max(result.t.size, 16))
    t = np.linspace(window[0], window[-1], n, endpoint=False)
    i = np.array([np.interp(t, result.t, current) for current in result.i])
    forces = pole_forces(machine, i, np.interp(t, result.t, result.theta_m))
    frequencies = np.fft.fftfreq(n, (window[-1] - window[0]) / n)
    found = []
    for order, wave in enumerate(spatial_orders(forces)):
        size = np.abs(wave)
        if size.max() <= NOTHING * np.abs(forces).max():
            continue  # an order that the winding does not have
        lines = np.fft.fft(wave) / n
        lines[0] = 0
        if order in (0, machine.N_s / 2):  # real: both signs of the frequency are one oscillation
            lines = np.where(frequencies < 0, 2 * lines, 0)
        peak = int(np.argmax(np.abs(lines)))
        found.append(
            ForceOrder(
                order=order,
                mean=float(size.mean()),
                max=float(size.max()),
                f=-float(frequencies[peak]),
                amplitude=float(abs(lines[peak])),
            )
        )
    return found
