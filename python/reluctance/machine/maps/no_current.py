"""Flux linkages without current: none. A row at 0 A that has some is noise, or tells the offset of
all others."""

import numpy as np

from reluctance.base.errors import ParameterError
from reluctance.machine.maps.table import Array

NO_FLUX = 0.02  # of the largest flux linkage: more at 0 A is another axis, an offset or noise
MOST_NOISE, LEAST_OF_NOISE = 0.03, 8  # rms, of the largest flux linkage; samples that tell it


def from_zero(
    i: Array, psi: Array, tau: Array | None, notes: list[str]
) -> tuple[Array, Array, Array | None]:
    """The table from 0 A on, without flux linkage there; i: rising.

    Raises
    ------
    ParameterError
        Where the flux linkages at 0 A are too large for either.
    """
    if i[0] > 0:
        notes.append("row at 0 A added: no flux, no torque")
        nothing = np.zeros((1, psi.shape[1]))
        i, psi = np.append(0.0, i), np.vstack([nothing, psi])
        tau = None if tau is None else np.vstack([nothing, tau])
    elif np.abs(psi[0]).max() > NO_FLUX * np.nanmax(np.abs(psi)):
        if not is_noise(psi[0], np.nanmax(np.abs(psi))):
            raise ParameterError(
                f"flux at 0 A is {np.abs(psi[0]).max():.3g} Wb, need 0; axes are swapped: state "
                "the layout; or the flux has an offset: subtract it; or it is noise: leave the "
                "samples at 0 A out"
            )
        notes.append(
            f"flux at 0 A, noise of {np.abs(psi[0]).max():.2g} Wb at most about 0, set to 0"
        )
        psi = np.vstack([np.zeros((1, psi.shape[1])), psi[1:]])
    elif np.abs(psi[0]).max() > 0:
        offset = offset_of(i, psi)
        if offset:
            notes.append(f"an offset of {offset:.2g} Wb, seen at 0 A, taken off all fluxes")
        else:
            notes.append(f"flux of {np.abs(psi[0]).max():.2g} Wb at 0 A set to 0")
        psi = np.vstack([np.zeros((1, psi.shape[1])), psi[1:] - offset])
    return i, psi, tau


def is_noise(psi: Array, most: float) -> bool:
    """Whether fluxes at 0 A, at rising angles, scatter about 0: their mean is within three of its
    standard errors, and neighbours differ as much as any two of them, by J. von Neumann's ratio
    (Annals of Mathematical Statistics 12(4), 1941), 1 for noise and near 0 for a curve."""
    spread = float(np.sqrt(np.mean(psi**2)))
    if len(psi) < LEAST_OF_NOISE or not np.isfinite(psi).all() or spread > MOST_NOISE * most:
        return False
    ratio = float(np.mean(np.diff(psi) ** 2)) / (2 * spread**2)
    return bool(abs(psi.mean()) <= 3 * spread / np.sqrt(len(psi)) and ratio > 0.5)


def offset_of(i: Array, psi: Array) -> float:
    """What the fluxes at 0 A share with those of all currents [Wb]: the parabola through the next
    three rows goes there; else 0. Its angles are the quarter where a line through two of the rows
    comes nearest to it: elsewhere saturation bends the curves between coarse currents."""
    if len(i) < 3:
        return 0.0
    at_zero = float(np.median(psi[0]))
    slope = np.diff(psi[1:], axis=0) / np.diff(i[1:])[:, None]
    started = psi[1] - slope[0] * i[1]
    if len(i) > 3:
        bend = (slope[1] - slope[0]) / (i[3] - i[1]) * i[1] * i[2]
        straight = np.argsort(np.abs(bend))[: max(1, len(bend) // 4)]
        started = (started + bend)[straight]
    apart = abs(float(np.median(started)) - at_zero)
    return at_zero if apart < abs(at_zero) / 2 else 0.0
