"""The field at one angle and one set of currents: Newton steps with a line search on the energy.

The energy minus the work of the currents is convex, so a Newton direction always descends, and a
step that is shortened until the function has fallen always arrives.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.sparse.linalg import splu

from reluctance.base.errors import ParameterError
from reluctance.machine.geometry.position import Position
from reluctance.machine.geometry.steel import Array

TOLERANCE = 1e-8  # residual of the field equations, of their right-hand side: rounding is 1e-11
MOST_STEPS = 60  # 7 to 14 are usual from zero, 2 from a predicted potential
DESCENT = 1e-4  # share of the linear fall that a step must keep (Armijo)
SHORTEST = 1e-3  # step length at which rounding, not the model, decides


@dataclass(frozen=True)
class Field:
    """A solution and what follows from it, for the whole machine."""

    position: Position
    i: Array  # (n_phases) currents [A]
    A: Array  # (n) vector potential [Wb/m]
    energy: float  # of one sector per length [J/m]
    steps: int  # Newton steps
    solve: Callable[[Array], Array]  # inverse of the last step's tangent matrix

    @property
    def _scale(self) -> float:
        return self.position.system.length

    @property
    def psi(self) -> Array:
        """Flux linkages of the phases (n_phases) [Wb]."""
        return np.asarray(self._scale * (self.position.coils.T @ self.A))

    @property
    def coenergy(self) -> float:
        """W_c [J]."""
        return float(self.psi @ self.i - self._scale * self.energy)

    @property
    def rings(self) -> tuple[Array, Array]:
        """Potential of rotor and stator on the gap [Wb/m]."""
        system = self.position.system
        return self.A[system.rotor.ring], self.A[system.stator.ring]

    @property
    def tau(self) -> float:
        """Torque, -dE/dalpha at constant potential [N m]."""
        rotor, stator = self.rings
        return float(-self._scale * (rotor @ self.position.slope @ stator))

    def tangent(self, k: int) -> tuple[Array, Array, float]:
        """Derivatives in the current of phase k: of A, of psi (n_phases) and of the torque."""
        system = self.position.system
        coils = self.position.coils
        dA = self.solve(np.ascontiguousarray(coils[:, k]))
        rotor, stator = self.rings
        slope = self.position.slope
        dtau = (rotor @ slope) @ dA[system.stator.ring] + dA[system.rotor.ring] @ (slope @ stator)
        return dA, self._scale * (coils.T @ dA), float(-self._scale * dtau)


def solve(
    position: Position, i: Array, *, start: Array | None = None, tolerance: float = TOLERANCE
) -> Field:
    """The field of the currents i (n_phases) [A], from a guess of the potential.

    Raises
    ------
    ParameterError
        If Newton's method does not arrive, which no valid B-H curve should cause.
    """
    system = position.system
    i = np.asarray(i, dtype=np.float64)
    drive = position.coils @ i
    A = np.zeros(system.n) if start is None else start
    energy, force, iron = _state(position, A)
    residual, steps = force - drive, 0
    inverse: Callable[[Array], Array] | None = None
    while np.linalg.norm(residual) > tolerance * np.linalg.norm(drive):
        if steps == MOST_STEPS:
            raise ParameterError(
                f"field at {np.degrees(position.alpha):.4g} deg and {np.abs(i).max():.4g} A not "
                f"solved in {MOST_STEPS} steps; check the B-H curve and the current"
            )
        inverse = _inverse(position, iron)
        direction = -inverse(residual)
        fall, length, before = float(residual @ direction), 1.0, energy - drive @ A
        while True:
            new_A = A + length * direction
            energy, force, iron = _state(position, new_A)
            change = energy - drive @ new_A - before
            if change <= DESCENT * length * fall + 1e-12 * abs(before) or length < SHORTEST:
                break
            length /= 2
        A, residual, steps = new_A, force - drive, steps + 1
    return Field(
        position=position,
        i=i,
        A=A,
        energy=energy,
        steps=steps,
        solve=inverse or _inverse(position, iron),
    )


@dataclass(frozen=True)
class _IronState:
    """Steel at one potential, at its Gauss points (n_e, 3)."""

    B: Array  # (n_e, 3, 2) [T]
    size: Array  # |B| [T]
    nu: Array  # H/B [m/H]
    slope: Array  # dH/dB [m/H]


def _state(position: Position, A: Array) -> tuple[float, Array, _IronState]:
    """Energy, its gradient in A, and what the tangent matrix needs."""
    system = position.system
    unknown = system.iron
    of_elements = np.append(A, 0.0)[unknown]
    B = (position.gradient @ of_elements[:, :, None]).reshape(-1, 3, 2)
    size = np.hypot(B[..., 0], B[..., 1])
    nu, slope, density = system.steel.reluctivity(size)
    H = (B * (position.weight * nu)[..., None]).reshape(-1, 1, 6)
    force = np.bincount(unknown.ravel(), (H @ position.gradient).ravel(), system.n + 1)[:-1]
    linear = position.matrix @ A
    energy = float(A @ linear / 2 + (position.weight * density).sum())
    return energy, force + linear, _IronState(B=B, size=size, nu=nu, slope=slope)


def _inverse(position: Position, state: _IronState) -> Callable[[Array], Array]:
    """Solves with the tangent matrix, the second derivative of the energy."""
    system = position.system
    along = position.weight * (state.slope - state.nu) / np.maximum(state.size, 1e-12) ** 2
    tensor = along[..., None, None] * state.B[..., :, None] * state.B[..., None, :]
    tensor[..., [0, 1], [0, 1]] += (position.weight * state.nu)[..., None]
    left = position.gradient.reshape(-1, 3, 2, 6)
    H = (tensor @ left).reshape(-1, 6, 6)
    blocks = position.gradient.transpose(0, 2, 1) @ H
    data = position.linear + system.sparsity.sum(system.place.steel, blocks)
    # The matrix is symmetric and positive definite: no pivoting, and the numbering is the order.
    factors = splu(
        system.sparsity.matrix(data),
        permc_spec="NATURAL",
        diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    )
    inverse: Callable[[Array], Array] = factors.solve
    return inverse
