"""The physical limit of torque smoothness: the best periodic phase current of any controller.

One phase current i(theta_e) over one electrical period; the other phases carry shifted copies. On
a grid of n points, with theta_e the electrical angle and omega_e = N_r omega_m,

    minimise    mean(i^2)                                              (copper)
    subject to  sum_k tau(i_k, theta_k) = tau_ref   at every point     (no ripple)
                |R i + omega_e dpsi/dtheta_e| <= u_dc  over every interval
                0 <= i <= i_max.

The voltage is exact for the mean over an interval: flux difference over angle difference, and the
trapezoid of R i. Written with omega_e, not with dt, it holds at standstill as well. Where no
profile without ripple exists, the least torque error comes first and the copper after it.
A nonlinear programme for IPOPT (A. Waechter, L. T. Biegler, Math. Programming 106, 2006, 25-57)
through CasADi (J. Andersson et al., Math. Prog. Comp. 11, 2019, 1-36).
"""

import hashlib
import json
import os
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import asdict, astuple, dataclass, fields, replace
from pathlib import Path
from typing import Any, Literal, Protocol, TypeVar

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike, NDArray

from reluctance.errors import ParameterError

FloatArray = NDArray[np.float64]
Norm = Literal["max", "rms"]
Objective = Literal["copper", "error", "torque"]
Constraint = Literal["none", "max", "rms", "constant"]

ALGORITHM = 2  # part of every cache key: raise it when the numbers of this file move
SLACK = 1e-4  # share of the least error given back before copper is minimised at that error
FEASIBLE = 1e-6  # error relative to tau_ref below which a profile counts as free of ripple

_IPOPT: dict[str, Any] = {
    "print_time": False,
    "ipopt.print_level": 0,
    "ipopt.sb": "yes",
    "ipopt.bound_relax_factor": 0.0,  # no current below zero, however little
    "ipopt.max_iter": 500,  # hardest case seen: 153, an infeasible point on 360 grid points
}


class Machine(Protocol):
    """What is read of a machine: the numbers of the Le-Huy and Brunelle model."""

    @property
    def N_r(self) -> int: ...
    @property
    def L_u(self) -> float: ...
    @property
    def L_sat(self) -> float: ...
    @property
    def A(self) -> float: ...
    @property
    def B(self) -> float: ...


@dataclass(frozen=True)
class LeHuyParameters:
    """The Le-Huy and Brunelle model by its numbers, named as in include/srm/machine/lehuy.hpp."""

    N_r: int  # rotor poles
    L_u: float  # unaligned inductance [H]
    L_sat: float  # aligned incremental inductance, fully saturated [H]
    A: float  # flux that saturates [Wb]
    B: float  # saturation rate [1/A]


@dataclass(frozen=True)
class Profile:
    """One periodic phase current and what it does. Phase k lags phase 0 by 2 pi k/n_phases."""

    theta_e: FloatArray  # (n,) electrical angle [rad], 0 unaligned
    i: FloatArray  # (n,) phase current [A]
    psi: FloatArray  # (n,) flux linkage [Wb]
    u: FloatArray  # (n,) mean voltage from point j to point j + 1 [V]
    tau_error_max: float  # greatest |torque - tau_ref| on the grid [N m]
    tau_error_rms: float  # [N m]
    i_rms: float  # [A]
    i_peak: float  # [A]
    p_cu: float  # copper loss of all phases [W]
    tau_ref: float  # [N m]
    omega_m: float  # [rad/s]
    u_dc: float  # [V]


@dataclass(frozen=True)
class Table:
    """Current and flux profiles over torque and angle, as a controller stores them."""

    tau_ref: FloatArray  # (n_levels,) tau_max (j/(n_levels - 1))^2 [N m]
    theta_e: FloatArray  # (n_points,) [rad]
    i: FloatArray  # (n_levels, n_points) [A]
    psi: FloatArray  # (n_levels, n_points) [Wb]
    tau_error_max: FloatArray  # (n_levels,) zero (to FEASIBLE) where no ripple is needed [N m]
    tau_error_rms: FloatArray  # (n_levels,) [N m]
    i_rms: FloatArray  # (n_levels,) [A]
    omega_m: float  # [rad/s]
    u_dc: float  # [V]


@dataclass(frozen=True)
class Envelope:
    """The greatest torque without ripple at each speed, and the least copper that it takes."""

    omega_m: FloatArray  # (n_speeds,) [rad/s]
    tau_max: FloatArray  # (n_speeds,) [N m]
    i_rms: FloatArray  # (n_speeds,) [A]
    i_peak: FloatArray  # (n_speeds,) [A]
    p_cu: FloatArray  # (n_speeds,) [W]


Result = TypeVar("Result", Profile, Table, Envelope)
PhaseMagnetics = Callable[[Any, FloatArray], tuple[Any, Any]]


def phase_magnetics(machine: Machine) -> PhaseMagnetics:
    """Flux linkage and torque of one phase, ready for a programme in which only i is unknown.

    The returned function maps i (n,) [A], a CasADi vector, and theta_e (n,), numbers in
    [0, 2 pi), to the CasADi vectors psi (n,) [Wb] and tau (n,) [N m]. As the angles are numbers,
    the mirror at alignment is no branch in the programme; a flux map need only be a spline in i
    at each angle. Formulae: include/srm/machine/lehuy.hpp.
    """
    N_r, L_u, L_sat, A, B = _numbers(machine)

    def le_huy(i: Any, theta_e: FloatArray) -> tuple[Any, Any]:
        past = theta_e > np.pi
        x = np.where(past, 2 - theta_e / np.pi, theta_e / np.pi)
        f = x * x * (3 - 2 * x)
        df = np.where(past, -1.0, 1.0) * N_r * 6 / np.pi * x * (1 - x)
        E = ca.exp(-B * i)
        psi = L_u * i + ((L_sat - L_u) * i + A * (1 - E)) * f
        tau = ((L_sat - L_u) * i * i / 2 + A * i - A / B * (1 - E)) * df
        return psi, tau

    return le_huy


def best_profile(
    machine: Machine,
    *,
    n_phases: int,
    R: float,
    tau_ref: float,
    omega_m: float,
    u_dc: float,
    i_max: float,
    n_points: int = 180,
    norm: Norm = "max",
    smoothing: float = 0.0,
) -> Profile:
    """Phase current with least copper for zero torque ripple; with least ripple where it must be.

    Parameters
    ----------
    machine : the Le-Huy numbers N_r, L_u, L_sat, A, B.
    n_phases : phases, at least 2.
    R : phase resistance [ohm].
    tau_ref : torque to hold [N m]; of either sign.
    omega_m : speed [rad/s]; of either sign, 0 is standstill.
    u_dc : dc-link voltage [V].
    i_max : greatest phase current [A].
    n_points : grid points of one electrical period; a multiple of n_phases.
    norm : which torque error is least where zero is impossible: its "max" or its "rms".
    smoothing : weight of mean((di/dtheta_e)^2) beside mean(i^2) [rad^2].

    Raises
    ------
    ParameterError : a parameter out of range.
    RuntimeError : IPOPT found no optimum.
    """
    setting = _Setting(
        n_phases=n_phases, R=R, u_dc=u_dc, i_max=i_max, n_points=n_points, smoothing=smoothing
    )
    _need(np.isfinite(tau_ref), "tau_ref", tau_ref, "a finite torque [N m]")
    _need(np.isfinite(omega_m), "omega_m", omega_m, "a finite speed [rad/s]")
    _need(norm in ("max", "rms"), "norm", norm, "'max' or 'rms'")

    def compute() -> Profile:
        sign = -1 if tau_ref < 0 else 1
        programme = _Programme(machine, setting, sign * omega_m)
        profile = programme.profile(abs(tau_ref), norm)
        return profile if tau_ref >= 0 else _mirrored(profile)

    inputs = [*_numbers(machine), *astuple(setting), tau_ref, omega_m, norm]
    return _cached(Profile, inputs, compute)


def profile_table(
    machine: Machine,
    *,
    n_phases: int,
    R: float,
    tau_max: float,
    omega_m: float,
    u_dc: float,
    i_max: float,
    n_levels: int = 9,
    n_points: int = 180,
    norm: Norm = "rms",
    smoothing: float = 1e-3,
) -> Table:
    """Best profiles for n_levels torques from 0 to tau_max; parameters as for `best_profile`.

    The levels are equidistant in the square root of the torque: at low current torque grows as
    i^2, so that the current between two levels is then close to linear.

    Two defaults suit a table: the small smoothing takes out the steps of the optimum between grid
    points (rms current + 0.01 % at rated torque of the paper's machine, + 0.1 % near zero torque);
    and a level that cannot be free of ripple has the least rms error, not the least greatest
    error, which is large at every angle.

    Raises
    ------
    ParameterError : a parameter out of range.
    RuntimeError : IPOPT found no optimum.
    """
    setting = _Setting(
        n_phases=n_phases, R=R, u_dc=u_dc, i_max=i_max, n_points=n_points, smoothing=smoothing
    )
    _need(tau_max > 0, "tau_max", tau_max, "a torque > 0 N m")
    _need(np.isfinite(omega_m), "omega_m", omega_m, "a finite speed [rad/s]")
    _need(n_levels >= 2, "n_levels", n_levels, "at least 2: zero and tau_max")
    _need(norm in ("max", "rms"), "norm", norm, "'max' or 'rms'")

    def compute() -> Table:
        programme = _Programme(machine, setting, omega_m)
        levels = tau_max * np.linspace(0.0, 1.0, n_levels) ** 2
        profiles = [programme.profile(float(tau_ref), norm) for tau_ref in levels]
        return Table(
            tau_ref=levels,
            theta_e=programme.theta_e,
            i=np.array([p.i for p in profiles]),
            psi=np.array([p.psi for p in profiles]),
            tau_error_max=np.array([p.tau_error_max for p in profiles]),
            tau_error_rms=np.array([p.tau_error_rms for p in profiles]),
            i_rms=np.array([p.i_rms for p in profiles]),
            omega_m=omega_m,
            u_dc=u_dc,
        )

    inputs = [*_numbers(machine), *astuple(setting), tau_max, omega_m, n_levels, norm]
    return _cached(Table, inputs, compute)


def torque_speed_envelope(
    machine: Machine,
    *,
    n_phases: int,
    R: float,
    omega_m: ArrayLike,
    u_dc: float,
    i_max: float,
    n_points: int = 180,
) -> Envelope:
    """Greatest ripple-free torque at each speed omega_m (n_speeds,) [rad/s].

    A negative speed is braking: torque against rotation. Other parameters as for `best_profile`.

    Raises
    ------
    ParameterError : a parameter out of range.
    RuntimeError : IPOPT found no optimum.
    """
    setting = _Setting(
        n_phases=n_phases, R=R, u_dc=u_dc, i_max=i_max, n_points=n_points, smoothing=0.0
    )
    speeds = np.atleast_1d(np.asarray(omega_m, dtype=np.float64))
    _need(bool(np.isfinite(speeds).all()), "omega_m", omega_m, "finite speeds [rad/s]")

    def compute() -> Envelope:
        tau_max, best = [], []
        for speed in speeds:
            programme = _Programme(machine, setting, float(speed))
            tau_max.append(programme.greatest_torque())
            best.append(programme.profile(tau_max[-1] * (1 - SLACK), "max"))
        return Envelope(
            omega_m=speeds,
            tau_max=np.array(tau_max),
            i_rms=np.array([p.i_rms for p in best]),
            i_peak=np.array([p.i_peak for p in best]),
            p_cu=np.array([p.p_cu for p in best]),
        )

    inputs = [*_numbers(machine), *astuple(setting), speeds.tolist()]
    return _cached(Envelope, inputs, compute)


@dataclass(frozen=True)
class _Setting:
    """What the three searches share, checked."""

    n_phases: int
    R: float  # [ohm]
    u_dc: float  # [V]
    i_max: float  # [A]
    n_points: int
    smoothing: float  # [rad^2]

    def __post_init__(self) -> None:
        N = self.n_phases
        _need(N >= 2, "n_phases", N, "at least 2 phases")
        _need(self.R >= 0, "R", self.R, "a resistance >= 0 ohm")
        _need(self.u_dc > 0, "u_dc", self.u_dc, "a voltage > 0 V")
        _need(self.i_max > 0, "i_max", self.i_max, "a current > 0 A")
        _need(self.smoothing >= 0, "smoothing", self.smoothing, "a weight >= 0 rad^2")
        fits = self.n_points % N == 0 and self.n_points >= 12 * N
        need = f"a multiple of n_phases = {N}, at least {12 * N}; try {60 * N}"
        _need(fits, "n_points", self.n_points, need)


class _Programme:
    """The nonlinear programme of one machine, operating point and grid; the torque is an argument.

    Unknowns are the current i (n,) and one torque s [N m]: the error allowed, or the torque held.
    """

    def __init__(self, machine: Machine, setting: _Setting, omega_m: float) -> None:
        n, n_phases, R = setting.n_points, setting.n_phases, setting.R
        self.theta_e: FloatArray = 2 * np.pi * np.arange(n) / n
        self.setting, self.omega_m = setting, omega_m
        i, s, tau_ref = ca.MX.sym("i", n), ca.MX.sym("s"), ca.MX.sym("tau_ref")
        step = 2 * np.pi / n
        psi, tau_ph = phase_magnetics(machine)(i, self.theta_e)
        u = R * (i + _next(i)) / 2 + machine.N_r * omega_m * (_next(psi) - psi) / step
        m = n // n_phases  # one stroke: phase k does what phase 0 did k m points earlier
        tau = sum(tau_ph[k * m : (k + 1) * m] for k in range(n_phases))
        error = tau - tau_ref
        self._unknowns, self._tau_ref, self._u = ca.vertcat(i, s), tau_ref, u
        self._objectives: dict[Objective, Any] = {
            "copper": ca.sumsqr(i) / n + setting.smoothing * ca.sumsqr((_next(i) - i) / step) / n,
            "error": s,
            "torque": -s,
        }
        self._constraints: dict[Constraint, tuple[Any, float]] = {  # 0 <= value <= bound
            "none": (error, 0.0),
            "max": (ca.vertcat(s - error, s + error), np.inf),
            "rms": (s * s - ca.sumsqr(error) / m, np.inf),
            "constant": (tau - s, 0.0),
        }
        self._solvers: dict[tuple[Objective, Constraint], Any] = {}
        self._tau_ph = ca.Function("tau_ph", [i], [tau_ph])
        self._waveforms = ca.Function("waveforms", [i], [psi, u, tau])

    def _solve(
        self,
        objective: Objective,
        constraint: Constraint,
        start: FloatArray,
        *,
        tau_ref: float,
        s: tuple[float, float] = (0.0, 0.0),
    ) -> tuple[FloatArray, float, bool]:
        """Optimum i (n,) and s from a start, s within bounds; and whether IPOPT calls it one."""
        value, bound = self._constraints[constraint]
        if (objective, constraint) not in self._solvers:
            problem = {
                "x": self._unknowns,
                "p": self._tau_ref,
                "f": self._objectives[objective],
                "g": ca.vertcat(self._u / self.setting.u_dc, value),
            }
            self._solvers[objective, constraint] = ca.nlpsol("limit", "ipopt", problem, _IPOPT)
        solver = self._solvers[objective, constraint]
        n, m = len(start), value.numel()
        i_max = self.setting.i_max
        solution = solver(
            x0=np.append(start, min(tau_ref, s[1])),
            p=tau_ref,
            lbx=np.append(np.zeros(n), s[0]),
            ubx=np.append(np.full(n, i_max), s[1]),
            lbg=np.append(np.full(n, -1.0), np.zeros(m)),
            ubg=np.append(np.ones(n), np.full(m, bound)),
        )
        x, found = _array(solution["x"]), bool(solver.stats()["success"])
        return x[:-1], float(x[-1]), found

    def start(self, tau_ref: float) -> FloatArray:
        """Each phase takes a share ~ max(sin theta_e, 0) of the torque; no voltage limit; (n,)."""
        weight = np.maximum(np.sin(self.theta_e), 0.0)
        total = weight.reshape(self.setting.n_phases, -1).sum(axis=0)
        share = weight / np.tile(np.maximum(total, 1e-9), self.setting.n_phases)
        low, high = np.zeros_like(weight), np.full_like(weight, self.setting.i_max)
        for _ in range(30):  # bisection: torque rises with current
            i = (low + high) / 2
            below = _array(self._tau_ph(i)) < share * tau_ref
            low, high = np.where(below, i, low), np.where(below, high, i)
        return np.where(weight > 0, low, 0.0)

    def starts(self, tau_ref: float) -> list[FloatArray]:
        """Where to search from: pulses first, then currents that never return to zero.

        Below base speed all lead to one optimum. Far above it the best may be continuous
        conduction, and pulses alone lead to less torque or to none.
        """
        flat = np.full_like(self.theta_e, self.setting.i_max)
        return [self.start(tau_ref), self.start(tau_ref / 10), flat / 8, flat / 2]

    def best(self, tau_ref: float, norm: Norm, start: FloatArray | None = None) -> FloatArray:
        """The best current (n,) for a torque tau_ref >= 0."""
        if tau_ref == 0:
            return np.zeros_like(self.theta_e)
        starts = self.starts(tau_ref) if start is None else [start]
        for i_0 in starts:
            i, _, found = self._solve("copper", "none", i_0, tau_ref=tau_ref)
            if found:
                return i
        any_error = (0.0, np.inf)
        tries = [self._solve("error", norm, i_0, tau_ref=tau_ref, s=any_error) for i_0 in starts]
        # The next step can fail from an ill-conditioned least error: then from the second least.
        for i_0, e, found in sorted(tries, key=lambda t: t[1]):
            if found and e > FEASIBLE * tau_ref:
                e *= 1 + SLACK
                i, _, found = self._solve("copper", norm, i_0, tau_ref=tau_ref, s=(e, e))
            elif found:
                i, _, found = self._solve("copper", "none", i_0, tau_ref=tau_ref)
            if found:
                return i
        raise RuntimeError(f"no optimum found at tau_ref = {tau_ref} N m; change n_points")

    def profile(self, tau_ref: float, norm: Norm) -> Profile:
        """The best profile for a torque tau_ref >= 0, with all that it does."""
        i = self.best(tau_ref, norm)
        psi, u, tau = (_array(v) for v in self._waveforms(i))
        error = tau - tau_ref
        i_rms = float(np.sqrt(np.mean(i * i)))
        return Profile(
            theta_e=self.theta_e,
            i=i,
            psi=psi,
            u=u,
            tau_error_max=float(np.abs(error).max()),
            tau_error_rms=float(np.sqrt(np.mean(error * error))),
            i_rms=i_rms,
            i_peak=float(i.max()),
            p_cu=self.setting.n_phases * self.setting.R * i_rms**2,
            tau_ref=tau_ref,
            omega_m=self.omega_m,
            u_dc=self.setting.u_dc,
        )

    def greatest_torque(self) -> float:
        """The greatest constant torque [N m]: the best optimum found from all starts."""
        full = float(_array(self._tau_ph(np.full_like(self.theta_e, self.setting.i_max))).max())
        any_torque = (0.0, np.inf)
        starts = [*self.starts(full / 2), self.start(full / 100)]
        tries = [
            self._solve("torque", "constant", i_0, tau_ref=full / 2, s=any_torque) for i_0 in starts
        ]
        torques = [tau for _, tau, found in tries if found]
        if not torques:
            raise RuntimeError(f"no greatest torque found at {self.omega_m} rad/s; change n_points")
        return max(torques)


def _mirrored(profile: Profile) -> Profile:
    """The same currents at -theta_e: torque and speed of the other sign, the same voltages."""
    j = np.arange(len(profile.i))
    return replace(
        profile,
        i=profile.i[-j],
        psi=profile.psi[-j],
        u=profile.u[-j - 1],  # the interval after -theta_e is the one before theta_e
        tau_ref=-profile.tau_ref,
        omega_m=-profile.omega_m,
    )


def _next(v: Any) -> Any:
    """The value at the next grid point of a periodic quantity."""
    return ca.vertcat(v[1:], v[0])


def _array(v: ca.DM) -> FloatArray:
    return np.asarray(v.full(), dtype=np.float64).ravel()


def _numbers(machine: Machine) -> tuple[int, float, float, float, float]:
    return machine.N_r, machine.L_u, machine.L_sat, machine.A, machine.B


def _need(holds: bool, what: str, value: object, need: str) -> None:
    if not holds:
        raise ParameterError(f"{what} = {value}, need {need}")


def _cache_dir() -> Path:
    own, xdg = os.environ.get("RELUCTANCE_CACHE"), os.environ.get("XDG_CACHE_HOME")
    return Path(own) if own else (Path(xdg) if xdg else Path.home() / ".cache") / "reluctance"


def _cached(kind: type[Result], inputs: list[Any], compute: Callable[[], Result]) -> Result:
    """The result stored under the hash of its inputs; computed and stored where there is none."""
    content = json.dumps([ALGORITHM, kind.__name__, *inputs], default=float)
    path = _cache_dir() / f"{kind.__name__}-{hashlib.sha256(content.encode()).hexdigest()}.npz"
    try:
        with path.open("rb") as file, np.load(file) as stored:
            arrays = {f.name: stored[f.name] for f in fields(kind)}
        values: dict[str, Any] = {k: v if v.ndim else float(v) for k, v in arrays.items()}
        return kind(**values)
    except Exception:  # absent, or damaged in any of the ways a zip file can be: compute again
        result = compute()
    _store(path, asdict(result))
    return result


def _store(path: Path, values: Mapping[str, Any]) -> None:
    """Write whole or not at all. A cache that cannot be written is no reason to fail."""
    temporary = ""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile(dir=path.parent, delete=False) as file:
            temporary = file.name
            np.savez(file, **values)
        os.replace(temporary, path)
    except OSError:
        if temporary:
            Path(temporary).unlink(missing_ok=True)
