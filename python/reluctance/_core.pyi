"""Machine, plant and control in C++. SI units and radians throughout."""

from collections.abc import Callable, Sequence
import enum
from typing import Annotated, Any

import numpy
from numpy.typing import NDArray


class FluxMap:
    """
    Measured or computed machine: one co-energy spline over current and angle.
    """

    def __init__(self, *, N_r: int, knots: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], coefficients: Annotated[NDArray[numpy.float64], dict(shape=(None, None, None), order='C', device='cpu', writable=False)], theta_span: float) -> None:
        """
        From knots (n_i) [A], co-energy coefficients (n_i, n_theta + 3, 5) [J/A^p] and the angle they span, pi or 2 pi. Raises ValueError unless the flux provably rises with current.
        """

    @property
    def N_r(self) -> int: ...

    @property
    def i_last(self) -> float:
        """
        Last current of the table [A]; beyond it the flux keeps its last slope.
        """

    @property
    def theta_span(self) -> float: ...

    @property
    def inductance_bound(self) -> float:
        """Proven lower bound of the incremental inductance [H]."""

    @property
    def knots(self) -> NDArray[numpy.float64]:
        """Start of each current piece, shape (n_i,) [A]."""

    @property
    def coefficients(self) -> NDArray[numpy.float64]:
        """Shape (n_i, n_theta + 3, 5) [J/A^p]."""

    @property
    def pieces(self) -> bytes:
        """Piece of each current slot, one byte a slot."""

    def magnetics(self, i: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], theta_e: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)]) -> NDArray[numpy.float64]:
        """
        Columns psi [Wb], W_c [J], tau [N m], L_inc [H], psi_theta [Wb/rad], shape (n, 5).
        """

    def magnetics_single(self, i: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], theta_e: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)]) -> NDArray[numpy.float64]:
        """As magnetics, computed in float as on the target."""

    def current(self, psi: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], theta_e: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], i_max: float) -> NDArray[numpy.float64]:
        """Current in [0, i_max] at flux psi and angle theta_e, shape (n,) [A]."""

    def current_single(self, psi: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], theta_e: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], i_max: float) -> NDArray[numpy.float64]:
        """As current, computed in float as on the target."""

class LeHuy:
    """Analytic machine of Le-Huy and Brunelle (IECON 2005)."""

    def __init__(self, *, N_r: int, L_u: float, L_a: float, L_sat: float, i_m: float, psi_m: float) -> None:
        """
        From unaligned and unsaturated aligned inductance, saturated slope [H] and one point (i_m, psi_m) of the aligned curve [A, Wb].
        """

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

def magnetics(machine: LeHuy | FluxMap, i: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], theta_e: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)]) -> Annotated[NDArray[numpy.float64], dict(shape=(None, None))]:
    """
    Columns psi [Wb], W_c [J], tau [N m], L_inc [H], psi_theta [Wb/rad], shape (n, 5), at n currents [A] and electrical angles [rad] of one phase.
    """

def exp(x: float) -> float:
    """The core's exponential, without libm."""

def wrap(theta: float) -> float:
    """theta [rad] brought into [0, 2 pi)."""

def wrap_float(theta: float) -> float:
    """The same in single precision."""

class Shaft(enum.Enum):
    locked = 0

    turning = 1

class Outer(enum.Enum):
    torque = 0

    speed = 1

class Comparators(enum.Enum):
    analog = 0

    sampled = 1

class Controller:
    """A complete controller, ready to be sampled."""

class Setting:
    """What every control law is given beside its own parameters."""

    def __init__(self, *, machine: LeHuy | FluxMap, n_phases: int, single: bool, outer: Outer, K_p: float, K_i: float, tau_min: float, tau_max: float, T_s: float, tracker_bandwidth: float = 0.0, comparators: Comparators = Comparators.analog, t_dead: float = 0.0) -> None: ...

class Simulation:
    """The closed loop. SI units."""

    def __init__(self, *, machine: LeHuy | FluxMap, n_phases: int, R: float, u_dc: float, v_switch: float, R_switch: float, v_diode: float, R_diode: float, t_dead: float = 0.0, shaft: Shaft, J: float, B: float, k_pump: float, tau_load: float, T_s: float, delay: int, adc_bits: int, i_range: float, encoder_counts: int, controller: Controller, t_ref: Sequence[float], ref: Sequence[float], omega_m: float, theta_m: float, dt_max: float, i_scale: float = 100.0, record_every: float) -> None: ...

    def advance(self, t_stop: float) -> float:
        """Runs to t_stop [s] or until a table is full; returns the time reached."""

    def record(self) -> None:
        """Adds the present instant to the waveforms."""

    def close_period(self) -> None:
        """Adds the integrals so far to the periods."""

    def take_waveforms(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None, None))]:
        """
        Rows recorded since the last call: t, theta_m, omega_m, tau_ref, then i, leg, i_ref of each phase.
        """

    def take_periods(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None, None))]:
        """
        Rows at the ends of electrical periods since the last call: t, theta_m, omega_m, W_f, turn_ons, S_on, S_off, tau_min, tau_max, omega_min, omega_max, i_peak, integrals of p_dc, p_winding, p_mech, tau, tau^2, (tau - tau_ref)^2, i^2 per phase, tau_ref.
        """

COMMAND_COLUMNS: int = 15

def step(controller: Controller, i: Sequence[float], *, theta_e: float, omega_m: float, u_dc: float, reference: float) -> list[float]:
    """
    One sample of a controller: phase currents [A], angle [rad], speed [rad/s], dc-link voltage [V], reference [N m or rad/s] to commands. Per phase 15 numbers: gate, five legs, chop, four edges [s], i_ref, i_band [A], theta_on, theta_off [rad]; last the torque reference worked to [N m].
    """

def controller_from(n_phases: int, function: Callable) -> Controller:
    """
    A controller that calls function(i, theta_e, omega_m, u_dc, reference) at every sample and takes the commands from it, in the form that `step` returns.
    """

def described(controller: Controller) -> dict[str, Any] | None:
    """
    The controller's law, speed loop and machine as a tree of names and numbers, for export; None where it has no such form.
    """

def step_time(controller: Controller, samples: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], *, repeats: int) -> float:
    """
    Wall time of a control step [s], the least mean of `repeats` passes. samples: (n, n_phases + 4) phase currents [A], angle [rad], speed [rad/s], dc-link voltage [V], reference [N m or rad/s].
    """

def box_qp(H: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], f: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], lo: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], hi: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], precision: str = 'double', start: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)] | None = None, max_iterations: int = -1) -> tuple:
    """
    Minimum of 1/2 x'Hx + f'x on lo <= x <= hi, by the controller's active-set method.

    Parameters
    ----------
    H : array, shape (n, n)
        Symmetric positive definite; n from 1 to 24.
    f, lo, hi : array, shape (n,)
        Gradient at zero and bounds. Equal bounds fix a variable, infinite ones free it.
    precision : {"double", "single"}
        Scalar of the computation.
    start : array, shape (n,), optional
        Warm start, clipped to the box; zero by default.
    max_iterations : int
        Iteration limit; negative takes the controller's own.

    Returns
    -------
    x : ndarray, shape (n,)
        Within the bounds whatever the status.
    status : str
        "solved", "iteration_limit", "not_positive_definite" or "invalid".
    iterations : int
        Factorisations used.

    Raises
    ------
    ValueError
        If shapes do not agree or the precision is unknown.
    """

def box_qp_batch(H: Annotated[NDArray[numpy.float64], dict(shape=(None, None, None), order='C', device='cpu', writable=False)], f: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], lo: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], hi: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], precision: str = 'double', start: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)] | None = None, max_iterations: int = -1) -> tuple:
    """
    `box_qp` for n_problems problems of equal size.

    Parameters
    ----------
    H : array, shape (n_problems, n, n)
    f, lo, hi : array, shape (n_problems, n)
    precision, start, max_iterations
        As for `box_qp`; start has shape (n_problems, n).

    Returns
    -------
    x : ndarray, shape (n_problems, n)
    status : list of str
    iterations : ndarray of int, shape (n_problems,)

    Raises
    ------
    ValueError
        If shapes do not agree or the precision is unknown.
    """

def incremental_mpc(*, N_p: int, N_c: int, r_w: float, a: float, b: float, c: Sequence[float], error_free: Sequence[float]) -> list[list[float]]:
    """
    Rows of H, then f, then the free displacement of the one-channel problem.
    """

class Guide:
    """Profiles over torque, electrical angle and speed."""

    def __init__(self, values: Annotated[NDArray[numpy.float64], dict(shape=(None, None, None), order='C', device='cpu', writable=False)], *, tau_max: float, omega_m: Sequence[float], u_dc: float, drop: float = 0.0) -> None:
        """
        values: (n_speeds, n_levels, n_angles), for the speeds omega_m [rad/s], increasing, the torques tau_max (j/(n_levels - 1))^2 [N m] and one electrical period, at u_dc [V]; drop: R i at their peak [V].
        """

    def at(self, tau: float, theta_e: float, *, omega_m: float, u_dc: float) -> float:
        """
        The value at a torque [N m], electrical angle [rad], speed [rad/s] and voltage [V].
        """

N_p_max: int = 10

N_c_max: int = 4

def paper_mpc(setting: Setting, *, guide: Guide, N_p: int, N_c: int, r_w: float, w_i: float, R: float, i_max: float, i_band: float, T_s: float, delay: int) -> Controller:
    """Predictive controller of current references. guide: phase current [A]."""

class Leg(enum.Enum):
    demagnetize = -1

    freewheel = 0

    magnetize = 1

class AngleWatch(enum.Enum):
    compare = 0

    sampled = 1

class Carriers(enum.Enum):
    in_phase = 0

    interleaved = 1

class Shape(enum.Enum):
    linear = 0

    cubic = 1

    sinusoidal = 2

    exponential = 3

    table = 4

class Conduction:
    """Turn-on and turn-off angle, electrical."""

    def __init__(self, *, theta_on: float, theta_off: float, omega_start: float) -> None: ...

class MeanTorque:
    """Current reference over the torque reference."""

    def __init__(self, *, tau_max: float, i_ref: Sequence[float]) -> None:
        """i_ref: 17 currents [A] for the torques 0..tau_max [N m]."""

    @staticmethod
    def constant(i_ref: float) -> MeanTorque:
        """The same current [A] for every torque."""

class Sharing:
    """Torque sharing function."""

    def __init__(self, *, shape: Shape, theta_on: float, theta_ov: float, table: Sequence[float] = ...) -> None:
        """
        Turn-on and overlap angle, electrical [rad]; with Shape.table the rise at 33 equally spaced angles of the overlap.
        """

    def is_feasible(self, n_phases: int) -> bool:
        """True if every phase with a share can give torque."""

    def share(self, n_phases: int, theta_e: float) -> float:
        """Share of the phase at theta_e [1]."""

def without_reference(controller: Controller) -> Controller:
    """
    The controller of a law that holds a fixed current instead of a torque.
    """

def angles(setting: Setting, *, conduction: Conduction, reference: MeanTorque, i_band: float, chop: Leg, watch: AngleWatch) -> Controller:
    """
    Current held in a band of half width i_band [A] between turn-on and turn-off.
    """

def with_angle_offset(controller: Controller, offset: float) -> Controller:
    """
    The controller behind an angle sensor that shows the electrical angle plus offset [rad].
    """

def pwm_current(setting: Setting, *, conduction: Conduction, reference: MeanTorque, R: float, bandwidth: float, T_s: float) -> Controller:
    """
    Current held by a PI controller of this bandwidth [rad/s] between turn-on and turn-off.
    """

def torque_sharing(setting: Setting, *, sharing: Sharing, i_max: float, i_band: float, t_ahead: float, chop: Leg) -> Controller:
    """
    Shared torque as current references, for the instant t_ahead [s] after the sample.
    """

def ditc(setting: Setting, *, conduction: Conduction, inner: float, outer: float, i_max: float) -> Controller:
    """
    Legs chosen by the torque error. inner, outer: half widths of the torque bands [N m].
    """

def deadbeat(setting: Setting, *, sharing: Sharing, R: float, i_max: float, T_s: float, delay: int, carriers: Carriers) -> Controller:
    """
    The duty cycle that brings each phase to its shared torque in one sample.
    """

def finite_set_mpc(setting: Setting, *, guide: Guide, horizon: int, w_psi: Sequence[float], w_i: float, w_sw: float, t_end: float, R: float, i_max: float, T_s: float, delay: int) -> Controller:
    """
    Finite-control-set predictive torque control. guide: flux linkage [Wb]; w_psi: weight of the distance to it, at each of its speeds [N^2 m^2/Wb^2].
    """

def leg_search(phases: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], *, tau_ref: float, u_dc: float, R: float, i_max: float, T_s: float, t_end: float, w_psi: float, w_i: float, w_sw: float, horizon: int, prune: bool) -> tuple:
    """
    Best first legs of three phases, the cost of their sequence, and the combinations visited. phases: (3, 10) psi, i, tau, gain, drift, goal, goal_rate, i_gain, i_drift, last leg.
    """

def edge_mpc(setting: Setting, *, guide: Guide, w_sw: float, psi_slack: Sequence[float], R: float, i_max: float, T_s: float, delay: int) -> Controller:
    """
    Predictive torque control with switching instants as variables. guide: flux linkage [Wb]. psi_slack: most that a phase may leave it, at each of its speeds [Wb].
    """

def switching_weight(machine: LeHuy | FluxMap, *, guide: Guide, R: float, tau_ref: float, omega_m: float, u_dc: float, i_max: float, f_switch: float) -> float:
    """
    Cost of a turn-on [N^2 m^2 s] that makes about f_switch [Hz] per switch.
    """

def track_angle(theta_e: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], *, T_s: float, bandwidth: float, N_r: int, single: bool) -> Annotated[NDArray[numpy.float64], dict(shape=(None, None))]:
    """
    Estimated electrical angle [rad] and mechanical speed [rad/s], shape (n, 2), from n counted electrical angles.
    """
