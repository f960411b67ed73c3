"""From pulses beside a held phase to a pair table, where none is believed.

A pulse changes the flux linkage of the held phase by the derivative of the pair's co-energy,

    W(phi, a, b) = sum over p, q of C_pq(phi) g_p(a) g_q(b),    W(phi, a, b) = W(-phi, b, a),

in its current, and this is zero without the pulsed one. So the derivative alone tells all of W. g
are polynomials without a constant, C sums of cosines that are symmetric in p and q, and of sines
that are antisymmetric, as the mirror image asks for. Their coefficients are those nearest to all
pulses, with a little weight on smoothness. Torque follows as the derivative over the angle.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import Legendre

from reluctance.base.errors import ParameterError
from reluctance.machine.coupling import LETTERS, Coupling, Neighbours, behind
from reluctance.machine.held_pulses import HeldPulse
from reluctance.machine.identify_pairs import free_of_drift, pulsed_current
from reluctance.machine.maps.pairs import PairSamples, PairTable, pair_table
from reluctance.machine.maps.table import Array
from reluctance.machine.models import Magnetics

DEGREE = 5  # of the polynomials: with 4 the torque of an 8/6 machine is off by twice as much
HARMONICS = 6  # of the electrical angle: more leave the torque as it is
FEWEST_POSITIONS = 2 * HARMONICS + 1  # over a period
FEWEST_CURRENTS = DEGREE  # of the held phase
SAME_CURRENT = 0.04  # of the greatest: held currents nearer than this are one
SMOOTH = 1e-5  # weight of the square of a coefficient over what the pulses say of a mean one
ANGLES, CURRENTS = 19, 10  # nodes of the table: of half a period, and above 0 A

Pair = tuple[int, int]


@dataclass(frozen=True)
class Measured:
    """Pairs from pulses, and the same from all positions but one at a time, whose scatter tells how
    certain they are."""

    coupling: Coupling
    without_one: tuple[Coupling, ...]
    i_reached: float  # by both phases; flux linkages go on as straight lines beyond [A]

    def torque_error(self, i: Array, theta_e: Array) -> float:
        """Standard error of the torque of all pairs at currents (n, n_phases) [A] and angles of
        phase a (n) [rad], rms [N m]."""
        tau = np.stack([some.tau(i, theta_e) for some in self.without_one])
        n = len(tau)
        return float(np.sqrt((n - 1) * ((tau - tau.mean(axis=0)) ** 2).mean()))


@dataclass(frozen=True)
class _Said:
    """What a pulse says of the coefficients at its angle: least squares of some columns."""

    kind: int
    place: float  # clamped angle of phase a, electrical [rad]
    phi: float  # of the pair [rad]
    squares: Array  # (DEGREE^2, DEGREE^2)
    right: Array  # (DEGREE^2)


def kinds_of(coupling: Coupling | None, pulses: Sequence[HeldPulse]) -> list[list[Pair]]:
    """Pairs that have one table in a coupling; without one, each that was pulsed by itself."""
    if coupling is None:
        return [[pair] for pair in sorted({_sorted(pulse.pulsed, pulse.held) for pulse in pulses})]
    of: dict[PairTable, list[Pair]] = {}
    for pair in coupling.pairs:
        of.setdefault(pair.table, []).append((pair.first, pair.second))
    return list(of.values())


def _sorted(a: int, b: int) -> Pair:
    return min(a, b), max(a, b)


def measured_pairs(
    pulses: Sequence[HeldPulse],
    kinds: Sequence[Sequence[Pair]],
    magnetics: Magnetics,
    *,
    R: float,
    n_phases: int,
    i_max: float,
) -> Measured:
    """The pairs of a machine from pulses.

    Parameters
    ----------
    pulses : sequence of HeldPulse
        Of one pair of each kind or more.
    kinds : sequence of sequences of (int, int)
        Pairs that have one table: first and second phase.
    magnetics : Magnetics
        Of one phase alone.
    R : float
        Resistance of a phase [ohm].
    n_phases : int
    i_max : float
        Last current of the tables [A].

    Raises
    ------
    ParameterError
        Where the pulses leave a pair open.
    """
    i_reached = min(
        i_max,
        max(float(pulsed_current(pulse).max()) for pulse in pulses),
        max(float(pulse.i_held.max()) for pulse in pulses),
    )
    said = []
    for n, kind in enumerate(kinds):
        of_kind = [
            (pulse, pair)
            for pulse in pulses
            for pair in kind
            if {pulse.pulsed, pulse.held} == set(pair)
        ]
        _check(kind, [pulse for pulse, _ in of_kind], i_reached)
        said += [
            _said(pulse, n, pair, magnetics, R, n_phases, i_reached) for pulse, pair in of_kind
        ]

    def from_all_but(place: float | None) -> Coupling:
        tables = [
            _table(
                [x for x in said if x.kind == n and x.place != place],
                magnetics.N_r,
                i_reached,
                i_max,
            )
            for n in range(len(kinds))
        ]
        pairs = [
            Neighbours(first, second, table)
            for kind, table in zip(kinds, tables, strict=True)
            for first, second in kind
        ]
        return Coupling(n_phases, tuple(pairs))

    places = dict.fromkeys(x.place for x in said)
    return Measured(from_all_but(None), tuple(from_all_but(p) for p in places), i_reached)


def _check(kind: Sequence[Pair], pulses: list[HeldPulse], i_reached: float) -> None:
    letters = " ".join(LETTERS[first] + LETTERS[second] for first, second in kind)
    if not pulses:
        raise ParameterError(f"no pulses of any of the pairs {letters}; record those of one")
    places = {_place(pulse) for pulse in pulses}
    held = np.sort([pulse.i_held.mean() for pulse in pulses])
    currents = 1 + int((np.diff(held) > SAME_CURRENT * i_reached).sum())
    if len(places) < FEWEST_POSITIONS or currents < FEWEST_CURRENTS:
        raise ParameterError(
            f"pairs {letters}: {len(places)} clamped positions and {currents} held currents, need "
            f"at least {FEWEST_POSITIONS} over a period and {FEWEST_CURRENTS} for a table"
        )


def _place(pulse: HeldPulse) -> float:
    return round(pulse.theta_m, 3)


def _powers(i: Array, i_reached: float) -> tuple[Array, Array, Array]:
    """g [1] and their two derivatives over the current [1/A], [1/A^2], each (n, DEGREE)."""
    x = i / i_reached
    of = [Legendre.basis(k, domain=[0, 1]) for k in range(DEGREE)]
    g = np.stack([x * p(x) for p in of], axis=-1)
    slope = np.stack([p(x) + x * p.deriv()(x) for p in of], axis=-1)
    bend = np.stack([2 * p.deriv()(x) + x * p.deriv(2)(x) for p in of], axis=-1)
    return g, slope / i_reached, bend / i_reached**2


def _said(
    pulse: HeldPulse,
    kind: int,
    pair: Pair,
    magnetics: Magnetics,
    R: float,
    n_phases: int,
    i_reached: float,
) -> _Said:
    i = pulsed_current(pulse)
    g, _, _ = _powers(i, i_reached)
    _, slope, _ = _powers(pulse.i_held, i_reached)
    first = pulse.pulsed == pair[0]
    columns = (g[:, :, None] * slope[:, None, :]) if first else (slope[:, :, None] * g[:, None, :])
    within = np.maximum(i, pulse.i_held) <= i_reached
    turn = 2 * np.pi * pulse.held / n_phases
    z = free_of_drift(pulse, columns.reshape(len(i), -1), within, magnetics, R, turn)
    phi = magnetics.N_r * pulse.theta_m - behind(*pair, n_phases)
    return _Said(kind, _place(pulse), phi, z[:, :-1].T @ z[:, :-1], z[:, :-1].T @ z[:, -1])


def _table(said: list[_Said], N_r: int, i_reached: float, i_max: float) -> PairTable:
    squares, right = np.zeros((len(TERMS), len(TERMS))), np.zeros(len(TERMS))
    for x in said:
        shapes = _shapes(x.phi)
        squares += shapes.T @ x.squares @ shapes
        right += shapes.T @ x.right
    rough = np.array([1.0 + h**4 for h, *_ in TERMS])
    weight = SMOOTH * np.trace(squares) / len(TERMS) * np.diag(rough)
    c = np.linalg.solve(squares + weight, right)
    phi = np.linspace(0, np.pi, ANGLES)
    i = i_max * np.arange(1, CURRENTS + 1) / CURRENTS
    inside = np.minimum(i, i_reached)
    past = (i - inside)[:, None]
    g, slope, bend = _powers(inside, i_reached)
    g, slope = g + past * (slope + past * bend / 2), slope + past * bend
    C, rate = (np.stack([(_shapes(x, d) @ c).reshape(DEGREE, DEGREE) for x in phi]) for d in (0, 1))
    samples = PairSamples(
        phi,
        i,
        energy=np.einsum("npq,ap,bq->nab", C, g, g),
        tau=N_r * np.einsum("npq,ap,bq->nab", rate, g, g),
        psi_first=np.einsum("npq,ap,bq->nab", C, slope, g),
        psi_second=np.einsum("npq,ap,bq->nab", C, g, slope),
    )
    return pair_table(samples, N_r)


# (harmonic, p, q, sign): the coefficient of C_pq, and with the sign that of C_qp.
TERMS = [
    *((h, p, q, 1) for h in range(HARMONICS + 1) for p in range(DEGREE) for q in range(p, DEGREE)),
    *(
        (h, p, q, -1)
        for h in range(1, HARMONICS + 1)
        for p in range(DEGREE)
        for q in range(p + 1, DEGREE)
    ),
]


def _shapes(phi: float, derivative: int = 0) -> Array:
    """C at an angle, or its derivative, from the coefficients of TERMS, (DEGREE^2, n)."""
    h = np.array([term[0] for term in TERMS])
    even, odd = (np.cos(h * phi), np.sin(h * phi))
    if derivative:
        even, odd = -h * odd, h * even
    shapes = np.zeros((DEGREE, DEGREE, len(TERMS)))
    for n, (_, p, q, sign) in enumerate(TERMS):
        shapes[p, q, n] = even[n] if sign > 0 else odd[n]
        shapes[q, p, n] = even[n] if sign > 0 else -odd[n]
    return shapes.reshape(DEGREE * DEGREE, -1)
