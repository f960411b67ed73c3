"""Turn-off angles for torques that no current gives with a fixed window: offline.

Where a pulse has few choppings its mean torque jumps, by up to 15 %, as a peak of the current
begins to touch the band: what follows is one chopping more. A torque within such a jump takes the
current above it, without this chopping, in a window that is left earlier. Up to turn-off the pulse
stays the same, so the mean is a smooth function of that angle.
"""

from __future__ import annotations

import numpy as np

from reluctance import _core
from reluctance.base.arrays import FloatArray
from reluctance.drive.laws.current_table import Window
from reluctance.drive.laws.pulses import pulses

FROM = 1 / 8  # of the greatest torque: below, a pulse is not looked at
JUMP = 0.02  # of the torque, from one current to the next, besides the square of the current
CURRENTS = 250  # from the one of the least torque asked ...
MORE = 1.06  # ... to this times the greatest: past a jump at the greatest torque
TORQUES = 32  # nodes up to the greatest, besides those at jumps
LEVELS = 5  # nodes in a jump
NEXT = 1e-3  # of the torque: between the two nodes where a jump begins
ANGLES = 17  # of turn-off ...
EARLIEST = 0.5  # ... and the part of the window that is kept


def left_earlier(window: Window, tau_max: float, i_ref: list[float]) -> _core.PulseTable:
    """The motoring pulses over the torque, the same at every speed.

    Parameters
    ----------
    i_ref : list
        Currents for torques 0..tau_max in equal steps, with the whole window [A].

    Returns
    -------
    PulseTable
        Empty where the mean does not jump.
    """
    if window.law.smooth:
        return _core.PulseTable()
    on, off = window.ends

    def given(theta_off: FloatArray | float, i: FloatArray) -> FloatArray:
        """Mean torque [N m]."""
        return pulses(window.law, on, theta_off, i).tau

    wanted = np.linspace(0, tau_max, len(i_ref))
    low = wanted <= FROM * tau_max
    most = min(i_ref[-1] * MORE, window.law.known.i_max)
    i = np.geomspace(i_ref[int(low.sum()) - 1] / MORE, most, CURRENTS)
    tau = given(off, i)
    jumps = _jumps(tau, i, tau_max)
    if not jumps:
        return _core.PulseTable()
    angles = np.linspace(on + EARLIEST * (off - on), off, ANGLES)
    curves = given(angles, i[[above for _, above in jumps], None])
    torques = np.linspace(0, tau_max, TORQUES + 1)
    torques = torques[torques > FROM * tau_max]
    nodes = [(t, c, off) for t, c in zip(wanted[low], np.array(i_ref)[low], strict=True)]
    for (below, above), curve in zip(jumps, curves, strict=True):
        torques = torques[(torques < tau[below]) | (torques > tau[above])]
        nodes.append((tau[below], i[below], off))
        for level in np.linspace((1 + NEXT) * tau[below], tau[above], LEVELS):
            nodes.append((level, i[above], _last(angles, curve, level)))
    nodes += [(t, _last(i, tau, t), off) for t in torques]
    return _same_at_every_speed(window, np.array(sorted(nodes)))


def _jumps(tau: FloatArray, i: FloatArray, tau_max: float) -> list[tuple[int, int]]:
    """The last current before and the first clear of each jump below a torque."""
    grows = np.diff(np.log(np.maximum(tau, 1e-9 * tau_max) / i**2))
    steep = np.append(grows > JUMP, False)
    found: list[tuple[int, int]] = []
    for below in np.flatnonzero(steep & (tau < tau_max)).tolist():
        if found and below < found[-1][1]:
            continue
        above = below + 2
        while above < len(tau) - 1 and steep[above - 1 : above + 1].any():
            above += 1
        found.append((int(below), int(min(above, len(tau) - 1))))
    return found


def _last(x: FloatArray, y: FloatArray, wanted: float) -> float:
    """Where a curve passes a value for the last time; its end if it stays below."""
    below = np.flatnonzero(y < wanted)
    n = int(below[-1]) if len(below) else 0
    if n == len(x) - 1:
        return float(x[-1])
    return float(np.interp(wanted, y[n : n + 2], x[n : n + 2]))


def _same_at_every_speed(window: Window, nodes: FloatArray) -> _core.PulseTable:
    """A table of torques, currents and turn-off angles, (n, 3)."""
    tau, i, theta_off = nodes[np.unique(nodes[:, 0], return_index=True)[1]].T
    return _core.PulseTable(
        omega=(window.law.known.omega_m * np.array([1.0, 2.0])).tolist(),
        tau=tau.tolist(),
        theta_on=np.full(2 * len(tau), window.theta_on).tolist(),
        theta_off=np.tile(theta_off, 2).tolist(),
        i_ref=np.tile(i, 2).tolist(),
    )
