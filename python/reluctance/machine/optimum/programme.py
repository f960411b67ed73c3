"""The nonlinear programme behind every limit: one machine, operating point and grid of angles.

One phase current i(theta_e) over one electrical period; the other phases carry shifted copies. On
a grid of n points, with theta_e the electrical angle and omega_e = N_r omega_m,

    minimise    mean(i^2)                                              (copper)
    subject to  sum_k tau(i_k, theta_k) = tau_ref   at every point     (no ripple)
                |R i + omega_e dpsi/dtheta_e| <= u_dc  over every interval
                0 <= i <= i_max.

The voltage is exact for the mean over an interval: flux difference over angle difference, and the
trapezoid of R i. Written with omega_e, not with dt, it holds at standstill as well. Phases that
couple add the torque and the flux linkages of their pairs (coupling.py). Where the neighbours of
all phases are alike, all carry the same current; else each has its own, and the torque is held over
the whole period. Where no
profile without ripple exists, the least torque error comes first and the copper after it.

Where a profile without ripple has a current that never ends, it may take ten times the current of
one with a few percent of ripple. There a weight w trades one for the other,

    minimise    log(mean(i^2)) + w mean(error^2)/tau_ref^2
    subject to  mean(error) = 0 and the bounds above,    error = sum_k tau(i_k, theta_k) - tau_ref.

With pairs there are more optima. So their strength grows from none to all in steps, each from the
optimum of the one before.

IPOPT's tolerances are absolute. So that every torque of every machine has the same accuracy, the
programme is in relative units: torques over tau_ref, voltages over u_dc, currents over about the
one that makes this torque.

A nonlinear programme for IPOPT (A. Waechter, L. T. Biegler, Math. Programming 106, 2006, 25-57)
through CasADi (J. Andersson et al., Math. Prog. Comp. 11, 2019, 1-36).
"""

from collections.abc import Callable, Iterable
from itertools import product
from typing import Any, Literal

import numpy as np

from reluctance.base.arrays import FloatArray
from reluctance.base.errors import Unsolved, need
from reluctance.base.units import from_si
from reluctance.machine.operating_point import OperatingPoint
from reluctance.machine.optimum.coupled import of_pairs
from reluctance.machine.optimum.magnetics import content, phase_magnetics

Norm = Literal["max", "rms"]
Objective = Literal["copper", "error", "torque", "weighted"]
Constraint = Literal["none", "max", "rms", "constant", "mean", "held"]

ALGORITHM = 8  # part of every cache key: raise it when the numbers of this package move
SLACK = 1e-4  # share of the least error given back before copper is minimised at that error
# In this order until IPOPT finds an optimum: shares of the least error, and of the torque, where
# the least error is nearly none.
MORE_SLACK = ((SLACK, 0.0), (10 * SLACK, 0.0), (100 * SLACK, 0.0), (0.0, 1e-3))
NO_COPPER = 1e-9  # of the squared unit of current: less is no mean squared current
REST = 1e-4  # of i_max: less is none; the interior point stays up to 3e-5 above zero
STRENGTHS = (0.0, 0.2, 0.4, 0.6, 0.8, 1.0)  # of the pairs, one after the other
FEASIBLE = 1e-6  # error relative to tau_ref below which a profile counts as free of ripple

IPOPT: dict[str, Any] = {
    "print_time": False,
    "ipopt.print_level": 0,
    "ipopt.sb": "yes",
    "ipopt.bound_relax_factor": 0.0,  # no current below zero, however little
    "ipopt.max_iter": 300,  # hardest case seen: 181, an infeasible point of a drawn machine
}
# How the barrier falls. Adaptively it takes half the iterations to the same optimum; but the least
# error has two optima, and on 24 drawn machines 2 of 251 levels then missed the better one.
_BARRIER: dict[Objective, str] = {"error": "monotone"}


def checked_inputs(point: OperatingPoint, n_points: int, smoothing: float) -> list[Any]:
    """What every search depends on, for a cache key.

    Raises
    ------
    ParameterError : the grid does not fit the phases, or the weight is negative.
    """
    N = point.n_phases
    need(smoothing >= 0, "smoothing", smoothing, "a weight >= 0 rad^2")
    fits = n_points % N == 0 and n_points >= 12 * N
    grid = f"a multiple of n_phases = {N}, at least {12 * N}; try {60 * N}"
    need(fits, "n_points", n_points, grid)
    numbers = [point.n_phases, point.R, point.u_dc, point.i_max, n_points, smoothing]
    pairs = [] if point.coupling is None else point.coupling.content
    return [*content(point.magnetics), *numbers, *pairs]


class Programme:
    """The programme of one machine, operating point and grid; the torque is an argument.

    Unknowns are the current (n,) and one number s: the error allowed, the torque held, or the mean
    squared current, whose logarithm as an unknown leaves the Hessian sparse. All are relative.
    `direction` -1 turns the machine round: angles and torque change sign. `ripple_weight` is w.
    """

    def __init__(
        self,
        point: OperatingPoint,
        *,
        n_points: int = 180,
        smoothing: float = 0.0,
        direction: Literal[1, -1] = 1,
        ripple_weight: float = 0.0,
    ) -> None:
        import casadi as ca  # here: it is slow to import, and a cached result does without

        n, n_phases, R = n_points, point.n_phases, point.R
        j, m = np.arange(n), n // n_phases  # a stroke has m points
        self.theta_e: FloatArray = 2 * np.pi * j / n
        self.point = point
        self._pairs = () if point.coupling is None else point.coupling.pairs
        # Currents that differ: one, of which phase k does what phase 0 did k m points earlier, or
        # one of each phase; all over the angle of their own phase.
        self.n_currents = 1 if point.coupling is None or point.coupling.is_alike else n_phases
        self._n = n * self.n_currents
        x, s = ca.MX.sym("x", self._n), ca.MX.sym("s")
        tau_ref, i_unit, strength = (ca.MX.sym(name) for name in ("tau_ref", "i_unit", "strength"))
        i = i_unit * x
        step = 2 * np.pi / n
        theta_e = self.theta_e[direction * j]
        psi, tau_ph = phase_magnetics(point.magnetics)(i, np.tile(theta_e, self.n_currents))
        tau_ph = direction * tau_ph
        self._tau_ph = ca.Function("tau_ph", [x, i_unit], [tau_ph])
        if point.coupling is not None:
            psi_pairs, tau_pairs = of_pairs(point.coupling, i, theta_e, direction, self.n_currents)
            psi, tau_ph = psi + strength * psi_pairs, tau_ph + strength * tau_pairs
        u = R * (i + _next(i, n)) / 2 + point.N_r * point.omega_m * (_next(psi, n) - psi) / step
        if self.n_currents == 1:
            tau = sum(tau_ph[k * m : (k + 1) * m] for k in range(n_phases))
        else:
            tau = sum(tau_ph[k * n + (j - direction * k * m) % n] for k in range(n_phases))
        instants = tau.numel()
        error = tau / tau_ref - 1
        self._unknowns, self._u = ca.vertcat(x, s), u
        self._given = ca.vertcat(tau_ref, i_unit, strength)
        copper = (ca.sumsqr(x) + smoothing * ca.sumsqr((_next(x, n) - x) / step)) / self._n
        ripple = ca.sumsqr(error) / instants
        self._objectives: dict[Objective, Any] = {
            "copper": copper,
            "weighted": ca.log(s) + ripple_weight * ripple,
            "error": s,
            "torque": -s,
        }
        self._constraints: dict[Constraint, tuple[Any, float]] = {  # 0 <= value <= bound
            "none": (error, 0.0),
            "max": (ca.vertcat(s - error, s + error), np.inf),
            "rms": (s * s - ca.sumsqr(error) / instants, np.inf),
            "constant": (tau / tau_ref - s, 0.0),
            "mean": (ca.vertcat(ca.sum1(error) / instants, s - copper), 0.0),
            "held": (ca.sum1(tau) / instants / tau_ref - s, 0.0),
        }
        cost = ca.log(copper) + ripple_weight * ripple
        self._weighed = ca.Function("weighed", [x, self._given], [copper, cost])
        self._solvers: dict[tuple[Objective, Constraint], Any] = {}
        self._strength = STRENGTHS[-1]  # of the pairs
        # The last torque of a strength, if that was not free of ripple [N m].
        self._ripples_from = dict.fromkeys(STRENGTHS, np.inf)
        self.effects = ca.Function("effects", [x, i_unit, strength], [psi, u, tau])
        at_most = self._tau_ph(np.full(self._n, point.i_max), 1.0)
        self._tau_most = float(_array(at_most).max())  # of one phase [N m]

    def waveforms(self, i: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Flux linkage (n,) [Wb], voltage (n,) [V] and torque of one stroke (n/n_phases,) [N m];
        where each phase has a current, (n_phases n,) of all in turn, and torque of a period (n,).
        """
        psi, u, tau = (_array(v) for v in self.effects(i, 1.0, STRENGTHS[-1]))
        return psi, u, tau

    def best(
        self, tau_ref: float, norm: Norm, *starts: FloatArray, near: FloatArray | None = None
    ) -> FloatArray:
        """The best current (n,) for a torque tau_ref >= 0; `starts` are tried before its own.

        `near` is the optimum of a torque near by. Where phases couple, an optimum without ripple
        that it leads to is the best: it lies on the same branch, found by growing strength. At
        every level of six machines it was the one that growing strength finds.

        Searches without ripple where there is none take most of the time, and the one for the least
        error always has an optimum. So it is the first above a torque that was not free of ripple.

        Raises
        ------
        Unsolved : IPOPT found no optimum.
        """
        if tau_ref == 0:
            return np.zeros(self._n)
        if self._pairs and near is not None:
            self._strength = STRENGTHS[-1]
            free = self._free_of_ripple(tau_ref, [near])
            if free is not None:
                return free
        return self._grown(
            lambda tried: self._best(tau_ref, norm, tried), starts, self.starts(tau_ref)
        )

    def _grown(
        self,
        search: Callable[[list[FloatArray]], FloatArray],
        starts: Iterable[FloatArray],
        own: list[FloatArray],
    ) -> FloatArray:
        """What a search finds from starts and its own; of pairs, from the optimum of weaker ones
        and from starts."""
        if not self._pairs:
            return search([*starts, *own])
        tried = own
        for strength in STRENGTHS[:-1]:
            self._strength = strength
            try:
                tried = [search(tried)]
            except Unsolved:  # perhaps stronger pairs have one
                continue
        self._strength = STRENGTHS[-1]
        return search([*tried, *starts])

    def _best(self, tau_ref: float, norm: Norm, tried: list[FloatArray]) -> FloatArray:
        """At one strength of the pairs."""
        if tau_ref < self._ripples_from[self._strength]:
            free = self._free_of_ripple(tau_ref, tried)
            if free is not None:
                return free
        any_error = (0.0, np.inf)
        tries = [self._solve("error", norm, i_0, tau_ref=tau_ref, s=any_error) for i_0 in tried]
        # The next step can fail from an ill-conditioned least error: then from the second least,
        # where that is another optimum.
        least: list[tuple[float, FloatArray]] = []
        for i, e, _ in sorted((t for t in tries if t[2]), key=lambda t: t[1]):
            if not least or e > (1 + SLACK) * least[-1][0]:
                least.append((e, i))
        if least and least[0][0] <= FEASIBLE * tau_ref:
            free = self._free_of_ripple(tau_ref, [*tried, *(i for _, i in least)])
            if free is not None:
                return free
        for (of_error, of_torque), (e, i_0) in product(MORE_SLACK, least):
            given = e * (1 + of_error) + of_torque * tau_ref
            i, _, found = self._solve("copper", norm, i_0, tau_ref=tau_ref, s=(given, given))
            if found:
                self._ripples_from[self._strength] = tau_ref
                return i
        raise Unsolved(f"no optimum found at tau_ref = {tau_ref} N m, {self._where()}")

    def _free_of_ripple(self, tau_ref: float, starts: list[FloatArray]) -> FloatArray | None:
        """The first optimum (n,) without ripple from these starts; of pairs the best one."""
        optima = []
        for i_0 in starts:
            i, _, found = self._solve("copper", "none", i_0, tau_ref=tau_ref)
            if found:
                self._ripples_from[self._strength] = np.inf
                optima.append(i)
                if not self._pairs or self._strength < STRENGTHS[-1]:
                    break
        return min(optima, key=lambda i: float(i @ i)) if optima else None

    def ends(self, i: FloatArray) -> bool:
        """True of a current that is none somewhere in the period."""
        return bool(i.min() <= REST * self.point.i_max)

    def weighted(self, tau_ref: float, *starts: FloatArray) -> FloatArray | None:
        """The weighted current (n,) for tau_ref > 0, the best from `starts` and from currents that
        never return to zero; none where the mean is out of reach.

        Pulses take twice the iterations and led to no better one at any of 289 levels of 24 drawn
        machines with 3 to 5 phases at 1 to 3.5 times base speed.
        """

        def search(tried: list[FloatArray]) -> FloatArray:
            given = self._parameters(tau_ref)
            tries: list[tuple[float, int, FloatArray]] = []
            for i_0 in tried:
                i, _, found = self._solve("weighted", "mean", i_0, tau_ref=tau_ref)
                if found:
                    tries.append((float(self._weighed(i / given[1], given)[1]), len(tries), i))
            if not tries:
                raise Unsolved(f"a mean of {tau_ref} N m is out of reach")
            return min(tries)[-1]

        try:
            return self._grown(search, starts, self.constant())
        except Unsolved:
            return None

    def greatest_mean(self, tau_ref: float, *starts: FloatArray) -> FloatArray:
        """The current (n,) of the greatest mean torque, for a torque beyond it: best of all starts.

        Raises
        ------
        Unsolved : none was found.
        """
        i = self._greatest("held", tau_ref, starts, self.starts(tau_ref))
        if i is None:
            raise Unsolved(f"no greatest mean found below {tau_ref} N m, {self._where()}")
        return i

    def greatest_torque(self, *starts: FloatArray) -> tuple[float, FloatArray]:
        """The greatest constant torque [N m] and its current (n,): best of all starts."""
        full = self._tau_most
        own = [self.start(full / 2), self.start(full / 100), np.full(self._n, self.point.i_max / 8)]
        i = self._greatest("constant", full / 2, starts, own)
        if i is None:
            raise Unsolved(f"no greatest torque found {self._where()}")
        return float(self.waveforms(i)[2].mean()), i

    def _greatest(
        self,
        held: Literal["constant", "held"],
        tau_unit: float,
        starts: Iterable[FloatArray],
        own: list[FloatArray],
    ) -> FloatArray | None:
        """The current of the greatest torque, or of the greatest mean; none if none was found."""

        def search(tried: list[FloatArray]) -> FloatArray:
            solved = (
                self._solve("torque", held, i_0, tau_ref=tau_unit, s=(0.0, np.inf)) for i_0 in tried
            )
            tries = [(tau, n, i) for n, (i, tau, found) in enumerate(solved) if found]
            if not tries:
                raise Unsolved
            return max(tries)[-1]

        try:
            return self._grown(search, starts, own)
        except Unsolved:
            return None

    def _where(self) -> str:
        """Where a search found nothing, and what may help."""
        return (
            f"at {from_si(self.point.omega_m, 'rpm'):.5g} rpm and {self.point.u_dc:g} V; take a "
            "little less torque or speed or more voltage (in Python: or another n_points)"
        )

    def start(self, tau_ref: float) -> FloatArray:
        """Each phase takes a share ~ max(sin theta_e, 0) of the torque; no voltage limit; (n,)."""
        weight = np.maximum(np.sin(self.theta_e), 0.0)
        total = weight.reshape(self.point.n_phases, -1).sum(axis=0)
        share = weight / np.tile(np.maximum(total, 1e-9), self.point.n_phases)
        weight, share = np.tile(weight, self.n_currents), np.tile(share, self.n_currents)
        low, high = np.zeros_like(weight), np.full_like(weight, self.point.i_max)
        for _ in range(30):  # bisection: torque rises with current
            i = (low + high) / 2
            below = _array(self._tau_ph(i, 1.0)) < share * tau_ref
            low, high = np.where(below, i, low), np.where(below, high, i)
        return np.where(weight > 0, low, 0.0)

    def starts(self, tau_ref: float) -> list[FloatArray]:
        """Where to search from: pulses first, then currents that never return to zero.

        Far above base speed, and when braking, the best torque may need continuous conduction. The
        first start that converges gave the least copper of all at 141 of 141 points with 3 and 4
        phases, an analytic machine and a map, driving and braking up to 6000 rpm.
        """
        return [self.start(tau_ref), self.start(tau_ref / 10), *self.constant()]

    def constant(self) -> list[FloatArray]:
        """Currents (n,) that never return to zero."""
        flat = np.full(self._n, self.point.i_max)
        return [flat / 8, flat / 2]

    def _parameters(self, tau_ref: float) -> tuple[float, float, float]:
        """The units of torque [N m] and of current [A], about the one that makes this torque, and
        the strength of the pairs [1]."""
        i_unit = self.point.i_max * (tau_ref / self._tau_most) ** 0.5
        return tau_ref, i_unit, self._strength

    def _solve(
        self,
        objective: Objective,
        constraint: Constraint,
        start: FloatArray,
        *,
        tau_ref: float,
        s: tuple[float, float] = (0.0, 0.0),
    ) -> tuple[FloatArray, float, bool]:
        """Optimum i (n,) and s [N m or A^2] from a start, s [N m] within bounds; and whether IPOPT
        calls it one."""
        import casadi as ca

        value, bound = self._constraints[constraint]
        if (objective, constraint) not in self._solvers:
            problem = {
                "x": self._unknowns,
                "p": self._given,
                "f": self._objectives[objective],
                "g": ca.vertcat(self._u / self.point.u_dc, value),
            }
            options = {**IPOPT, "ipopt.mu_strategy": _BARRIER.get(objective, "adaptive")}
            self._solvers[objective, constraint] = ca.nlpsol("limit", "ipopt", problem, options)
        solver = self._solvers[objective, constraint]
        n, m = len(start), value.numel()
        given = self._parameters(tau_ref)
        i_unit = given[1]
        x_0, x_max = start / i_unit, self.point.i_max / i_unit
        if objective == "weighted":
            unit, s_0, low, high = i_unit**2, float(self._weighed(x_0, given)[0]), NO_COPPER, np.inf
        else:
            unit, low, high = tau_ref, s[0] / tau_ref, s[1] / tau_ref
            s_0 = min(1.0, high)
        solution = solver(
            x0=np.append(x_0, s_0),
            p=given,
            lbx=np.append(np.zeros(n), low),
            ubx=np.append(np.full(n, x_max), high),
            lbg=np.append(np.full(n, -1.0), np.zeros(m)),
            ubg=np.append(np.ones(n), np.full(m, bound)),
        )
        x, found = _array(solution["x"]), bool(solver.stats()["success"])
        return i_unit * x[:-1], unit * float(x[-1]), found


def _next(v: Any, n: int) -> Any:
    """The values at the next grid point of quantities with a period of n points."""
    import casadi as ca

    periods = (v[k : k + n] for k in range(0, v.numel(), n))
    return ca.vertcat(*(part for period in periods for part in (period[1:], period[0])))


def _array(v: Any) -> FloatArray:
    return np.asarray(v.full(), dtype=np.float64).ravel()
