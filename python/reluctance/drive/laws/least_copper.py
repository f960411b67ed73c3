"""The turn-on and turn-off angle that give a mean torque for the least rms current."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from reluctance.base.arrays import FloatArray
from reluctance.drive.laws.pulses import Pulses, chopped, full_flux_speed, pulses
from reluctance.drive.tables.known import Known

WIDE = 180.0  # dwell up to which every current returns to zero [deg]
WIDEST = 255.0  # dwell that is tried where none of those gives the torque [deg]
CURRENTS = 5  # that a window is tried with: the torque grows as a power of them between
# Of the speed at which the flux linkage of i_max takes half a period: below, the best window is
# that of this speed.
SLOW = 0.15
BAND = 0.02  # half width of the current band, of i_max
ROOM = 1.1  # over the torque: what a window has to reach, for what a sampled current leaves out


def least_copper_angles(known: Known, tau: float, room: float = ROOM) -> tuple[float, float]:
    """Turn-on and turn-off angle, electrical [rad], at the working speed.

    Searched in steps of 15 deg among windows of at least a stroke, so that every rotor angle is
    covered, and in steps of 5 deg around the best of them. Where the best of half a period leaves
    no room above the torque, wider ones are tried, whose current need not return to zero. Where
    none reaches the torque, those of the greatest torque. A negative torque brakes in forward
    motion.
    """
    known = replace(known, omega_m=max(known.omega_m, SLOW * full_flux_speed(known)))
    # As the pulses know it: the same for any torque.
    known = chopped(known, BAND * known.i_max, brakes=False, hard=False).known
    aside = 180 if tau < 0 else 0
    coarse = np.arange(-60.0, 181.0, 15.0) + aside
    near = np.arange(-10.0, 11.0, 5.0)
    widest, (on, off, found) = WIDE, _best_window(known, tau, room, coarse, coarse, WIDE)
    if not found:
        early, late = np.arange(-120.0, 91.0, 15.0) + aside, np.arange(90.0, 241.0, 15.0) + aside
        widest, (on, off, _) = WIDEST, _best_window(known, tau, room, early, late, WIDEST)
    on, off, _ = _best_window(known, tau, room, on + near, off + near, widest)
    return float(np.radians(on)), float(np.radians(off))


def _best_window(
    known: Known, tau: float, room: float, on: FloatArray, off: FloatArray, widest: float
) -> tuple[float, float, bool]:
    """The best pair of some angles [deg], and whether it has room above the torque."""
    tried = _windows(known, tuple(on.tolist()), tuple(off.tolist()), widest, tau < 0)
    given = np.maximum.accumulate(tried.pulses.tau, axis=1)
    enough = given[:, -1] >= room * abs(tau)
    i_rms = [
        np.interp(np.sqrt(abs(tau)), np.sqrt(np.maximum(t, 0)), rms, left=rms[0])
        for t, rms in zip(given, tried.pulses.i_rms, strict=True)
    ]
    best = np.argmin(np.where(enough, i_rms, np.inf)) if enough.any() else np.argmax(given[:, -1])
    return float(tried.on[best]), float(tried.off[best]), bool(enough[best])


@dataclass(frozen=True)
class _Windows:
    """Windows that were tried [deg], and the pulses of each with CURRENTS currents."""

    on: FloatArray
    off: FloatArray
    pulses: Pulses


@lru_cache(maxsize=16)  # the same ones serve for any torque and room
def _windows(
    known: Known,
    on_deg: tuple[float, ...],
    off_deg: tuple[float, ...],
    widest: float,
    brakes: bool,
) -> _Windows:
    """The valid windows among these angles, with their pulses."""
    on, off = (pair.ravel() for pair in np.meshgrid(on_deg, off_deg))
    middle = 270 if brakes else 90
    fits = (on <= middle) & (off >= middle)
    fits &= (off - on >= 360 / known.n_phases) & (off - on <= widest)
    on, off = on[fits], off[fits]
    i = known.i_max * np.linspace(0, 1, CURRENTS + 1)[1:] ** 1.5
    law = chopped(known, BAND * known.i_max, brakes=brakes, hard=False)
    ends = np.radians(on)[:, None], np.radians(off)[:, None]
    return _Windows(on, off, pulses(law, *ends, i[None, :]))
