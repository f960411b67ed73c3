"""Several periods in one flux map, as of a whole turn of the shaft: the first one is taken."""

from collections.abc import Collection, Iterator, Mapping

import numpy as np
from scipy.interpolate import CubicSpline

from reluctance.base.errors import ParameterError
from reluctance.machine.maps.table import Array

SAME = 0.02  # of its rise: what the flux linkage may differ from one period to the next
LEAST_IN_PERIOD = 6  # samples, of a file with several periods
WHOLE = 1e-3  # of the angles: by how much they may miss a whole number of periods


def first_period(
    angle: Array,
    tables: list[Array],
    N_r: int,
    units: Mapping[str, float],
    kinds: Collection[str],
    notes: list[str],
) -> tuple[Array, list[Array], str | None]:
    """The first of several whole periods and the kind of its angles; None, and what is given, where
    it is one period or less.

    Parameters
    ----------
    angle : (n,), rising, in one of `units`.
    tables : each (n_currents, n), the flux linkage first.
    units : that the angle may have, with their size [rad].
    kinds : that it may be: "mechanical", "electrical".
    """
    for unit, kind, period, count in _readings(angle, N_r, units, kinds):
        if not _repeats(angle, tables[0], period):
            continue
        kept = angle < angle[0] + period * (1 - 1e-6)
        notes.append(f"{count} periods of {period:.6g} {unit} {kind}: the first one is taken")
        closed = [np.hstack([table[:, kept], table[:, :1]]) for table in tables]
        return np.append(angle[kept], angle[0] + period), closed, kind
    return angle, tables, None


def _readings(
    angle: Array, N_r: int, units: Mapping[str, float], kinds: Collection[str]
) -> Iterator[tuple[str, str, float, int]]:
    """Unit, kind, period in that unit and number of periods, of the ways to read the angles as
    several periods, with the last sample or without it."""
    step = (angle[-1] - angle[0]) / (len(angle) - 1)
    spans = angle[-1] - angle[0] + np.array([0.0, step])
    for unit, size in units.items():
        for kind in kinds:
            period = 2 * np.pi / (size * (N_r if kind == "mechanical" else 1))
            if period < LEAST_IN_PERIOD * step:  # a unit that leaves no sample in a period
                continue
            counts = np.round(spans / period)
            whole = (counts >= 2) & (np.abs(spans / period - counts) <= WHOLE * counts)
            yield from ((unit, kind, float(period), int(count)) for count in counts[whole])


def _repeats(angle: Array, psi: Array, period: float) -> bool:
    """Whether the flux linkage repeats over the angle."""
    flux = CubicSpline(angle, psi.mean(axis=0))
    early = angle[angle + period <= angle[-1]]
    off = np.abs(flux(early + period) - flux(early)).max(initial=0.0)
    return bool(len(early) > 2 and off < SAME * np.ptp(psi.mean(axis=0)))


def check_rises_once(theta_e: Array, flux: Array) -> None:
    """Raises ParameterError where a whole period [rad] of flux linkage is several of them."""
    even = np.linspace(theta_e[0], theta_e[-1], 4 * len(theta_e), endpoint=False)
    waves = np.abs(np.fft.rfft(np.interp(even, theta_e, flux)))
    most = 1 + int(np.argmax(waves[1:]))
    if most > 1:
        raise ParameterError(
            f"flux linkage rises and falls {most} times over the angles, need once over a period; "
            f"if they are a turn of the shaft, N_r is {most}: correct N_r, or the angle's unit"
        )
