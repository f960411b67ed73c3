"""Machine, plant and control in C++. SI units and radians throughout."""

from collections.abc import Callable, Sequence as _Sequence
import enum
from typing import Annotated, Any, Final

import numpy
import numpy.typing
from numpy.typing import NDArray


class Leg(enum.Enum):
    demagnetize = -1

    freewheel = 0

    magnetize = 1

class Gate(enum.Enum):
    off = 0

    timer = 1

    comparator = 2

    window = 3

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

class Outer(enum.Enum):
    torque = 0

    speed = 1

    none = 2

    pv = 3

class Motion(enum.Enum):
    measured = 0

    tracked = 1

class LoadTorque(enum.Enum):
    integral = 0

    observer = 1

class Actuator(enum.Enum):
    torque = 0

    speed = 1

class ArrayCurrent(enum.Enum):
    sensor = 0

    legs = 1

class Tracking(enum.Enum):
    constant = 0

    perturb_observe = 1

    incremental_conductance = 2

class Comparators(enum.Enum):
    analog = 0

    sampled = 1

    two_level = 2

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

    def magnetics(self, i: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], theta_e: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)]) -> NDArray[numpy.float64]:
        """
        Columns psi [Wb], W_c [J], tau [N m], L_inc [H], psi_theta [Wb/rad], shape (n, 5), at n currents [A] and electrical angles [rad] of one phase.
        """

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
        Columns psi [Wb], W_c [J], tau [N m], L_inc [H], psi_theta [Wb/rad], shape (n, 5), at n currents [A] and electrical angles [rad] of one phase.
        """

    def current(self, psi: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], theta_e: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], i_max: float) -> NDArray[numpy.float64]:
        """Current in [0, i_max] at flux psi and angle theta_e, shape (n,) [A]."""

def magnetics(machine: LeHuy | FluxMap, i: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], theta_e: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)]) -> NDArray[numpy.float64]:
    """
    Columns psi [Wb], W_c [J], tau [N m], L_inc [H], psi_theta [Wb/rad], shape (n, 5), at n currents [A] and electrical angles [rad] of one phase.
    """

class Coupling:
    """Phases that share iron: what two currents at once add."""

    def __init__(self, *, N_r: int, factor: float, pairs: _Sequence[tuple[int, int, int]], behind: _Sequence[float], knots: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], functions: Annotated[NDArray[numpy.float64], dict(shape=(None, None, None, None), order='C', device='cpu', writable=False)], tables: Annotated[NDArray[numpy.float64], dict(shape=(None, None, None, None), order='C', device='cpu', writable=False)]) -> None:
        """
        pairs: both phases and the table of each; behind: electrical angle of phase 0 less that of the pair, in [0, 2 pi) [rad]; knots: (n_i) [A]; functions: (n_tables, n_i, rank, 4) powers of the current above its knot; tables: (n_tables, n_phi + 3, rank, rank) of half a period [J].
        """

    def at(self, pair: int, a: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], b: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], theta_e: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)]) -> NDArray[numpy.float64]:
        """
        Columns W_c [J], tau [N m], psi of the first and of the second phase [Wb], their incremental inductances and the mutual one [H], dpsi/dtheta of both [Wb/rad], shape (n, 9), at n currents of both [A] and electrical angles of phase 0 [rad].
        """

    def torque(self, i: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], theta_e: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)]) -> NDArray[numpy.float64]:
        """
        Torque of all pairs (n) [N m] at currents (n, n_phases) [A] and electrical angles of phase 0 (n) [rad].
        """

class LimitedPi:
    """Output per error, and per error and control period."""

    def __init__(self, *, K_p: float, K_iT: float) -> None: ...

class PowerTracker:
    """Maximum power point tracking on a voltage reference [V]."""

    def __init__(self, *, method: Tracking, u_start: float, u_min: float, u_max: float, step: float) -> None: ...

class WholePeriods:
    """Means over whole electrical periods [s]."""

    def __init__(self, *, T_s: float, t_settle: float, t_least: float, t_most: float) -> None: ...

class StrokeRipple:
    """Adaptive notch filter at the stroke frequency [s]."""

    def __init__(self, *, learning: float) -> None: ...

class PvControl:
    """
    Voltage control and tracking of a drive on a photovoltaic array. SI units.
    """

    def __init__(self, *, actuator: Actuator, current: ArrayCurrent, link: LimitedPi, tracker: PowerTracker, mean: WholePeriods, ripple: StrokeRipple, C: float, delay: int, acceleration: float, omega_lead: float, u_stop: float, u_full: float, u_wake: float, t_wake: float, p_sleep: float, t_sleep: float, k_dry: float, omega_dry: float, t_dry: float, t_rest: float) -> None: ...

class SpeedPi:
    """PI speed controller. SI units."""

    def __init__(self, *, K_p: float, K_i: float, tau_min: float, tau_max: float, T_s: float) -> None: ...

class SpeedRamp:
    """The speed reference that the torque can follow. SI units."""

    def __init__(self, *, J: float, tau: float, rate: float, T_s: float) -> None: ...

class TrackerGains:
    """Of angle [1], speed [1/s] and load torque [N m/rad]."""

    def __init__(self, *, angle: float, speed: float, load: float) -> None: ...

class AngleTracker:
    """Observer of angle, speed and load torque on the angle. SI units."""

    def __init__(self, *, T_s: float, half_step: float, acceleration: float, within: TrackerGains, beyond: TrackerGains, N_r: int) -> None: ...

class EdgeLimits:
    """
    Shortest leg state, time without edges before a sample, control period [s].
    """

    def __init__(self, *, t_min: float, t_blank: float, T_s: float) -> None: ...

class UserLimits:
    """
    Of torque [N m] and phase current [A], below what the law is built for.
    """

    def __init__(self, *, tau: float, i: float) -> None: ...

class Frame:
    """
    What stands around a control law: angle tracker, speed or voltage loop, limits, sampled comparators, dead-time compensation. By default none of them. SI units.
    """

    def __init__(self, *, outer: Outer = Outer.torque, speed: SpeedPi = ..., ramp: SpeedRamp = ..., load: LoadTorque = LoadTorque.integral, pv: PvControl = ..., motion: Motion = Motion.measured, tracker: AngleTracker = ..., delay: int = 0, comparators: Comparators = Comparators.analog, t_dead: float = 0.0, edges: EdgeLimits = ..., u_brake_full: float = 1e+30, u_brake_none: float = 2e+30, limits: UserLimits = ...) -> None: ...

class Law:
    """A control law of the core, or a function that stands for one."""

class Controller:
    """A complete controller, ready to be sampled."""

    def __init__(self, law: Law, frame: Frame, coupling: Coupling | None = None) -> None:
        """
        A law with its frame and the pairs of phases that it knows, and their state.
        """

ORDER_COLUMNS: list = ...

def step(controller: Controller, y: Measurement, reference: float) -> list[float]:
    """
    One sample of a controller: a measurement and the reference [N m or rad/s] to orders. ORDER_COLUMNS for each phase, last the torque reference worked to [N m].
    """

def controller_from(n_phases: int, function: Callable) -> Controller:
    """
    A controller that calls function(measurement, reference) at every sample and takes the orders from it, in the form that `step` returns.
    """

def wrap_float(theta: float) -> float:
    """theta [rad] brought into [0, 2 pi), in single precision."""

class Measurement:
    """One sample, as the sensors deliver it."""

    def __init__(self, *, i: _Sequence[float], theta_e: float, omega_m: float, u_dc: float, i_source: float = 0.0) -> None: ...

    @property
    def i(self) -> list[float]:
        """Phase currents, one a phase [A]."""

    @property
    def theta_e(self) -> float:
        """Electrical angle of the first phase, in [0, 2 pi) [rad]."""

    @property
    def omega_m(self) -> float:
        """Rotor speed [rad/s]."""

    @property
    def u_dc(self) -> float:
        """dc-link voltage [V]."""

    @property
    def i_source(self) -> float:
        """Current of the source into the dc link [A]."""

    @property
    def n_phases(self) -> int: ...

    @property
    def columns(self) -> list[float]:
        """The numbers in their order: i, theta_e, omega_m, u_dc, i_source."""

    def angle(self, k: int) -> float:
        """Electrical angle of phase k: 0 unaligned, pi aligned [rad]."""

class Order:
    """What one phase does until the next sample."""

    def __init__(self) -> None:
        """All off: the leg demagnetizes."""

    @staticmethod
    def hold(leg: Leg) -> Order:
        """One leg state for the whole sample."""

    @staticmethod
    def pulse(outside: Leg, inside: Leg, start: float, end: float) -> Order:
        """
        `inside` between two instants of the sample [s], `outside` before and after.
        """

    @staticmethod
    def pwm(duty: float, T_s: float, centre: float = 0.5) -> Order:
        """
        A pulse of the mean voltage duty u_dc, held within -u_dc and u_dc, centred at this fraction of the sample T_s [s].
        """

    @staticmethod
    def regulate(i_ref: float, i_band: float, chop: Leg = Leg.freewheel) -> Order:
        """
        The hysteresis comparator holds the current at i_ref +- i_band [A]; above the band the leg freewheels (soft chopping) or demagnetizes (hard chopping).
        """

    def __repr__(self) -> str: ...

    @property
    def leg(self) -> object: ...

    @property
    def gate(self) -> object: ...

    @property
    def chop(self) -> object: ...

    @property
    def t_edge(self) -> object: ...

    @property
    def i_ref(self) -> object: ...

    @property
    def i_band(self) -> object: ...

    @property
    def theta_on(self) -> object: ...

    @property
    def theta_off(self) -> object: ...

    @property
    def i_lower(self) -> object: ...

    @property
    def i_centre(self) -> object: ...

    @property
    def i_upper(self) -> object: ...

    @property
    def i_runaway(self) -> object: ...

def python_law(n_phases: int, step: Callable) -> Law:
    """
    A law in Python: step(measurement, tau_ref) is called at every sample and returns an Order for each phase.
    """

class Rotation(enum.Enum):
    locked = 0

    turning = 1

class Course:
    """
    A quantity over time: linear between points, two points at the same time make a step. Times in s.
    """

    def __init__(self, *, t: _Sequence[float], value: _Sequence[float]) -> None: ...

class StiffSource:
    """A dc link that holds its voltage [V]."""

    def __init__(self, *, u_dc: Course) -> None: ...

class Battery:
    """Open-circuit voltage [V] behind R [ohm], dc-link capacitor C [F]."""

    def __init__(self, *, E: Course, R: float, C: float, one_way: bool) -> None: ...

class PvArray:
    """
    A photovoltaic array of one diode on a dc-link capacitor: numbers at 1000 W/m^2 and 25 degC, irradiance and cell temperature over time.
    """

    def __init__(self, *, I_L: float, R_s: float, R_sh: float, a: float, alpha: float, v_block: float, C: float, u_start: float, ln_ref: float, poa_global: Course, temp_cell: Course) -> None: ...

    def current(self, u: float, G: float, T_degC: float) -> float:
        """
        Current of the array at a voltage [V], irradiance [W/m^2] and cell temperature [degC]; negative above its open-circuit voltage [A].
        """

class Devices:
    """
    On-state voltages of switches and diodes: thresholds [V], slopes [ohm].
    """

    def __init__(self, *, v_switch: float, R_switch: float, v_diode: float, R_diode: float) -> None: ...

class AsymmetricBridge:
    """Two switches and two diodes a phase."""

    def __init__(self, *, device: Devices) -> None: ...

class SharedSwitchBridge:
    """All phases share one upper switch (Miller converter)."""

    def __init__(self, *, device: Devices) -> None: ...

class Pump:
    """
    A pump that lifts water: torque (rows of static heads, columns of sqrt(omega^2 - omega_0^2)) [N m], static head over time [m]. By default none.
    """

    def __init__(self, *, H_static: Course = ..., H_dry: float = 0.0, k_dry: float = 0.0, k_shut: float = 0.0, omega2_per_m: float = 0.0, H_first: float = 0.0, H_step: float = 1.0, s_step: float = 1.0, tau: _Sequence[float] = [], rise: _Sequence[float] = [], columns: int = 0) -> None: ...

    def torque(self, omega_m: float, t: float) -> float:
        """Torque at a speed [rad/s] and time [s]; [N m]."""

class Shaft:
    """
    Inertia J [kg m^2], friction B [N m s], k of a fan or pump [N m s^2], torque tau_0 [N m] and held speed omega [rad/s] over time, and a function of speed [rad/s] that gives more load torque [N m]; a pump.
    """

    def __init__(self, *, rotation: Rotation = Rotation.locked, J: float = 1.0, B: float = 0.0, k: float = 0.0, tau_0: Course = ..., omega: Course = ..., load: Callable[[float], float] | None = None, pump: Pump = ...) -> None: ...

class RotorSensor:
    """
    Encoder counts per revolution, whether it has an index and Hall sensors, error of their edges [rad].
    """

    def __init__(self, *, counts: int, index: bool, hall: bool, hall_error: float) -> None: ...

class Broken(enum.Enum):
    """The list of faults."""

    open_wire = 0
    """a wire of the winding is open"""

    upper_open = 1
    """the upper switch stays off"""

    lower_open = 2
    """the lower switch stays off"""

    upper_shorted = 3
    """the upper switch stays on"""

    lower_shorted = 4
    """the lower switch stays on"""

    diode_shorted = 5
    """the lower diode conducts both ways, with R"""

    turns_shorted = 6
    """a part of the turns is bridged by R"""

    winding_to_ground = 7
    """the upper end of the winding is at the negative rail, with R"""

    poor_contact = 8
    """R is in series with the winding"""

    sensor_gain = 9
    """a current channel shows a multiple"""

    sensor_offset = 10
    """a current channel shows too much"""

    sensor_stuck = 11
    """a current channel stays at what it showed"""

    sensor_dead = 12
    """a current channel shows zero"""

    encoder_off = 13
    """the angle is shown off: a jump, or a wrong zero"""

    encoder_frozen = 14
    """the angle stays at what it showed"""

    encoder_lost_counts = 15
    """a part of the counts is lost"""

    encoder_reversed = 16
    """the angle is shown in the other direction"""

    power_exchanged = 17
    """two phases drive each other's windings"""

    sensors_exchanged = 18
    """two phases show each other's currents"""

most_faults: int = 8

never_ends: float = float('inf')

class BrokenPart:
    """One fault, and when it is present. SI units."""

    def __init__(self, *, kind: Broken, phase: int, other: int, value: float, R: float, start: float, end: float, theta_e: float) -> None: ...

class Sampling:
    """Sensors and timing of the controller."""

    def __init__(self, *, T_s: float, delay: int, adc_bits: int, i_range: float, i_noise: float, i_offset: _Sequence[float], i_gain: _Sequence[float], u_noise: float, seed: int, rotor: RotorSensor, angle_offset: float) -> None: ...

class Scale:
    """Currents [A] and voltages [V] that matter."""

    def __init__(self, *, i: float, u_dc: float) -> None: ...

class Resolution:
    """How finely a run is computed and kept."""

    def __init__(self, *, dt_max: float, scale: Scale, record_every: float) -> None: ...

def n_switches(bridge: AsymmetricBridge | SharedSwitchBridge, n_phases: int) -> int:
    """Switches of a bridge."""

def described(controller: Controller) -> dict[str, Any]:
    """
    The controller, and its machine, as trees of names and numbers, for export.
    """

def law_of(controller: Controller) -> str | None:
    """The struct of a controller's law; None where it has no such form."""

def numbers(controller: Controller | None, loop: SimulationParts) -> dict[str, float | list[float] | tuple[float, ...]]:
    """
    Every number of a drive by its name in the C interface: arrays as lists, tables as tuples. Without a controller those of the plant.
    """

def blob(controller: Controller, loop: SimulationParts) -> bytes:
    """The parameters of a drive as bytes, for the C interface."""

class SimulationParts:
    """All of a closed loop but its controller. SI units."""

    def __init__(self, *, machine: LeHuy | FluxMap, R: float, source: StiffSource | Battery | PvArray, bridge: AsymmetricBridge | SharedSwitchBridge, shaft: Shaft, coupling: Coupling | None = None, t_dead: float, sampling: Sampling, reference: Course, theta_m: float, resolution: Resolution) -> None: ...

class Simulation:
    """The closed loop. SI units."""

    def __init__(self, controller: Controller, loop: SimulationParts, faults: _Sequence[BrokenPart] = []) -> None: ...

    def advance(self, t_stop: float) -> float:
        """
        Runs to t_stop [s], or until a table is full or many steps are taken; returns the time reached.
        """

    @property
    def steps(self) -> int:
        """Integration steps taken so far."""

    def state(self) -> tuple[list[float], float, float, float]:
        """
        Currents of the phases [A], speed [rad/s], rotor angle [rad], dc-link voltage [V].
        """

    def learned(self) -> list[float]:
        """
        What the controller has learned of its machine, with the columns of learned_columns.
        """

    def onsets(self) -> list[float]:
        """
        When the faults of the list have begun [s]; infinity where one has not.
        """

    def change_R(self, R: float) -> None:
        """The windings have another resistance from now on [ohm]."""

    def record(self) -> None:
        """Adds the present instant to the waveforms."""

    def close_period(self) -> None:
        """Adds the integrals so far to the periods."""

    def take_waveforms(self) -> NDArray[numpy.float64]:
        """
        Rows recorded since the last call, with the columns of waveform_columns; with those of flux_estimate_columns behind them where the controller follows the rotor.
        """

    def take_periods(self) -> NDArray[numpy.float64]:
        """
        Rows at the ends of electrical periods since the last call, with the columns of period_columns.
        """

def waveform_columns(n_phases: int) -> list[str]:
    """Names of the columns of a waveform row."""

def period_columns(n_phases: int) -> list[str]:
    """Names of the columns of a period row."""

flux_estimate_columns: list = ...

learned_columns: list = ...

class Within:
    """What a run must stay within: speed, current, voltage, steps."""

    def __init__(self, *, omega_m: float, i: float, u_dc: float, steps: float, judged: float) -> None: ...

class Runs:
    """
    Threads that run closed loops to their ends. A control law in Python makes them wait for the interpreter lock at every sample.
    """

    def __init__(self, threads: int) -> None: ...

    def add(self, tag: int, loop: Simulation, end: float, within: Within) -> None:
        """
        One more run, to its end [s]. The loop keeps no waveforms and is not touched until it has been taken.
        """

    @property
    def unfinished(self) -> int:
        """Runs added and not taken."""

    def take(self) -> tuple[int, float, float, Annotated[numpy.typing.NDArray, dict(dtype='float64')]]:
        """
        Waits for a run that has ended: its tag, the time reached [s], the wall time spent [s], and its period rows.
        """

    def close(self) -> None:
        """Ends the threads; what has not been taken is lost."""

class Task(enum.Enum):
    torque = 0

    current = 1

    speed = 2

class Action(enum.Enum):
    legs = 0

    duties = 1

    currents = 2

class Rules:
    """
    What is the same in all episodes of an environment: task and action, sensors, units of the observation, trip levels, prices. SI units.
    """

    def __init__(self, *, task: Task, action: Action, t_dead: float, sampling: Sampling, resolution: Resolution, comparators: Comparators, i_band: float, theta_on: float, theta_off: float, i_max: float, u_dc: float, omega_m: float, tau: float, i_trip: float, omega_trip: float, error_price: float, copper_price: float, switching_price: float, trip_price: float) -> None: ...

class Batch:
    """
    Drives for learning that are stepped together, a control period at a time. Arrays have a row for each drive.
    """

    @property
    def size(self) -> int:
        """Drives."""

    @property
    def observed(self) -> int:
        """Columns of the observations."""

    def numbers(self) -> list[tuple[str, float]]:
        """The numbers that an episode begins with, and their names."""

    def start(self, drive: int, drawn: _Sequence[float]) -> None:
        """Begins an episode of a drive with a value for each name in `drawn`."""

    def observe(self, observations: Annotated[NDArray[numpy.float32], dict(shape=(None, None), order='C', device='cpu')]) -> None:
        """Writes the observations."""

    def step(self, actions: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], waiting: Annotated[NDArray[numpy.bool_], dict(shape=(None,), order='C', device='cpu')], observations: Annotated[NDArray[numpy.float32], dict(shape=(None, None), order='C', device='cpu')], prices: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu')], tripped: Annotated[NDArray[numpy.bool_], dict(shape=(None,), order='C', device='cpu')]) -> None:
        """
        One control period of all drives but those that wait; writes the last three.
        """

    def obey(self, orders: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], observations: Annotated[NDArray[numpy.float32], dict(shape=(None, None), order='C', device='cpu')], prices: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu')], tripped: Annotated[NDArray[numpy.bool_], dict(shape=(None,), order='C', device='cpu')]) -> None:
        """The same with orders of control laws, the columns of each phase."""

    def figures(self, drive: int) -> list[float]:
        """
        Since the start of an episode: duration [s]; integrals of torque, of its squared error, of copper loss, mechanical power and power of the dc link; turn-ons.
        """

    def sample(self, drive: int) -> list[float]:
        """The columns of the last measurement, and the reference."""

def batch(count: int, n_phases: int, loop: SimulationParts, *, rules: Rules, drawn: _Sequence[str]) -> Batch:
    """Drives that share all but the numbers named in `drawn`."""

class Routine(enum.Enum):
    """A commissioning routine."""

    wiring = 1

    resistance = 2

    alignment = 3

    pulses = 4

class CurrentHold:
    """PI controller of a held current."""

    def __init__(self, *, pi: LimitedPi, duty_max: float) -> None: ...

class Wiring:
    """A short pulse of each leg. SI units."""

    def __init__(self, *, duty: float, i_detect: float, n_pulse: int, n_rest: int) -> None: ...

class Resistance:
    """Two currents of each phase. SI units."""

    def __init__(self, *, hold: CurrentHold, i_1: float, i_2: float, n_settle: int, n_mean: int) -> None: ...

class Alignment:
    """Rests of a free rotor. SI units."""

    def __init__(self, *, hold: CurrentHold, i_hold: float, i_low: float, slack: float, n_rest: int, n_wait: int) -> None: ...

class FluxPulses:
    """Voltage pulses at a clamped rotor. SI units."""

    def __init__(self, *, duty: float, i_top: float, i_beside: float, i_end: float, slack: float, v_switch: float, v_diode: float, n_rest: int, n_pulse: int, delay: int, hold: CurrentHold, duty_dead: float, n_settle: int) -> None: ...

class Commission:
    """The commissioning routines, and the checks around them."""

    def __init__(self, *, T_s: float, t_dead: float, i_trip: float, u_dc_min: float, u_dc_max: float, t_max: float, wiring: Wiring, resistance: Resistance, alignment: Alignment, pulses: FluxPulses) -> None: ...

def described_commission(routines: Commission) -> dict:
    """In single precision as a tree of names and numbers, for export."""

class Bench:
    """A routine between a plant and how somebody has wired it."""

    def __init__(self, *, routines: Commission, phase: _Sequence[int], sensor: _Sequence[int], sign: _Sequence[int], direction: int, zero: float, routine: Routine, pulsed: int, count: int, held: int = -1, i_held: float = 0.0) -> None: ...

    @property
    def controller(self) -> Controller:
        """Takes the place of a drive's controller."""

    @property
    def finding(self) -> int:
        """Number of the finding."""

    @property
    def text(self) -> str:
        """In words."""

    def found(self) -> dict:
        """What was found so far, SI units."""

    def rows(self) -> NDArray[numpy.float64]:
        """
        The recording of the pulses: pulse, sample, mean voltage since the row before [V], current [A], electrical angle as shown [rad], and of the held phase mean voltage [V] and current [A].
        """

def step_time(controller: Controller, samples: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], *, repeats: int) -> float:
    """
    Wall time of a control step [s], the least mean of `repeats` passes. samples: (n, n_phases + 5) the columns of a measurement, and the reference [N m or rad/s].
    """

class Drops:
    """Dead time [s] and threshold voltages [V] of the converter."""

    def __init__(self, *, t_dead: float, v_switch: float, v_diode: float) -> None: ...

class FluxBounds:
    """What a current reading may be wrong by, and the voltage. SI units."""

    def __init__(self, *, R: float, T_s: float, i_error: float, model_error: float, u_margin: float) -> None: ...

    @property
    def R(self) -> float: ...

    @property
    def T_s(self) -> float: ...

    @property
    def i_error(self) -> float: ...

    @property
    def model_error(self) -> float: ...

    @property
    def u_margin(self) -> float: ...

class TripLevels:
    """Levels of the readings. SI units."""

    def __init__(self, *, i_trip: float, u_dc_min: float, u_dc_max: float, omega_max: float, angle_slack: float) -> None: ...

    @property
    def i_trip(self) -> float: ...

    @property
    def u_dc_min(self) -> float: ...

    @property
    def u_dc_max(self) -> float: ...

    @property
    def omega_max(self) -> float: ...

    @property
    def angle_slack(self) -> float: ...

class Advance:
    """How the angle of a rotor can advance. SI units."""

    def __init__(self, *, bend: float, block: int) -> None: ...

    @property
    def bend(self) -> float: ...

    @property
    def block(self) -> int: ...

    parts: Final[int] = ...
    """(arg: object, /) -> int"""

class Protection:
    """The checks of every sample before the control law sees it. SI units."""

    def __init__(self, *, flux: FluxBounds, levels: TripLevels, advance: Advance, i_zero: float, delay: int, frozen: int) -> None: ...

    @property
    def flux(self) -> FluxBounds: ...

    @property
    def levels(self) -> TripLevels: ...

    @property
    def advance(self) -> Advance: ...

    @property
    def i_zero(self) -> float: ...

    @property
    def delay(self) -> int: ...

    @property
    def frozen(self) -> int: ...

class WindingFlux:
    """
    What the flux linkage of a phase may be wrong by in a sound drive. SI units.
    """

    def __init__(self, *, drops: Drops, R_error: float, u_error: float, i_gain: float, map_error: float, psi_error: float, psi_zero: float, psi_max: float) -> None: ...

    @property
    def drops(self) -> Drops: ...

    @property
    def R_error(self) -> float: ...

    @property
    def u_error(self) -> float: ...

    @property
    def i_gain(self) -> float: ...

    @property
    def map_error(self) -> float: ...

    @property
    def psi_error(self) -> float: ...

    @property
    def psi_zero(self) -> float: ...

    @property
    def psi_max(self) -> float: ...

class PhaseTrial:
    """
    How far each phase is magnetized alone while the law does not run. SI units.
    """

    def __init__(self, *, i: float, psi: float, psi_sample: float) -> None: ...

    @property
    def i(self) -> float: ...

    @property
    def psi(self) -> float: ...

    @property
    def psi_sample(self) -> float: ...

class Likeness:
    """By what a phase may differ from the others in a sound drive. SI units."""

    def __init__(self, *, spread: float, i_gain: float, i_noise: float, i_offset: float, u_noise: float, psi_error: float, R_error: float, u_error: float, map_error: float, recent: int) -> None: ...

    @property
    def spread(self) -> float: ...

    @property
    def i_gain(self) -> float: ...

    @property
    def i_noise(self) -> float: ...

    @property
    def i_offset(self) -> float: ...

    @property
    def u_noise(self) -> float: ...

    @property
    def psi_error(self) -> float: ...

    @property
    def R_error(self) -> float: ...

    @property
    def u_error(self) -> float: ...

    @property
    def map_error(self) -> float: ...

    @property
    def recent(self) -> int: ...

class Diagnosis:
    """What tells the faults of a drive apart. SI units."""

    def __init__(self, *, flux: WindingFlux, trial: PhaseTrial, likeness: Likeness, theta_error: float, i_max: float, patience: int) -> None: ...

    @property
    def flux(self) -> WindingFlux: ...

    @property
    def trial(self) -> PhaseTrial: ...

    @property
    def likeness(self) -> Likeness: ...

    @property
    def theta_error(self) -> float: ...

    @property
    def i_max(self) -> float: ...

    @property
    def patience(self) -> int: ...

class FluxAngle:
    """What the angle by the flux linkages may be wrong by. SI units."""

    def __init__(self, *, T_s: float, acceleration: float, theta_step: float, theta_error: float, zero_drift: float, tau_drift: float, omega_error: float, map_error: float, R_error: float, psi_error: float, i_noise: float, i_zero: float, alike: float) -> None: ...

    @property
    def T_s(self) -> float: ...

    @property
    def acceleration(self) -> float: ...

    @property
    def theta_step(self) -> float: ...

    @property
    def theta_error(self) -> float: ...

    @property
    def zero_drift(self) -> float: ...

    @property
    def tau_drift(self) -> float: ...

    @property
    def omega_error(self) -> float: ...

    @property
    def map_error(self) -> float: ...

    @property
    def R_error(self) -> float: ...

    @property
    def psi_error(self) -> float: ...

    @property
    def i_noise(self) -> float: ...

    @property
    def i_zero(self) -> float: ...

    @property
    def alike(self) -> float: ...

class Sequence:
    """The states of a drive, from precharge to a fault and back. SI units."""

    def __init__(self, *, T_s: float, u_ready: float, t_precharge: float, n_settle: int, n_calibrate: int, i_offset: float, t_command: float, u_chop_on: float, u_chop_off: float, reference_max: float, omega_none: float) -> None: ...

    @property
    def T_s(self) -> float: ...

    @property
    def u_ready(self) -> float: ...

    @property
    def t_precharge(self) -> float: ...

    @property
    def n_settle(self) -> int: ...

    @property
    def n_calibrate(self) -> int: ...

    @property
    def i_offset(self) -> float: ...

    @property
    def t_command(self) -> float: ...

    @property
    def u_chop_on(self) -> float: ...

    @property
    def u_chop_off(self) -> float: ...

    @property
    def reference_max(self) -> float: ...

    @property
    def omega_none(self) -> float: ...

def described_guard(protection: Protection, sequence: Sequence, diagnosis: Diagnosis | None = None, flux_angle: FluxAngle | None = None) -> dict:
    """All in single precision as trees of names and numbers, for export."""

class Trouble(enum.Enum):
    """What goes wrong with a supervised drive."""

    none = 0

    over_current = 1

    over_voltage = 2

    under_voltage = 3

    dead_current_sensor = 4

    frozen_current_sensor = 5

    lost_encoder = 6

    no_command = 7

    hardware_trip = 8

class Supervision:
    """
    When a supervised drive is enabled and cleared, and its trouble; courses of 0 and 1. SI units.
    """

    def __init__(self, *, T_s: float, enable: Course, clear: Course, troubled: Course, trouble: Trouble, phase: int, level: float) -> None: ...

def supervised(law: Law, frame: Frame, *, machine: LeHuy | FluxMap, protection: Protection, sequence: Sequence, supervision: Supervision, coupling: Coupling | None = None, diagnosis: Diagnosis | None = None, flux_angle: FluxAngle | None = None) -> Controller:
    """
    A law with its frame, protection and states, and their state: the step of a target, on the desk. machine: as the protection knows it.
    """

def events(controller: Controller) -> Annotated[numpy.typing.NDArray[numpy.float64], dict(shape=(None, 6))] | None:
    """
    The states that a supervised drive has entered: time [s], state, status, phase, value and limit of a fault. None where the controller is not supervised.
    """

def describe_status(status: int) -> str:
    """A status of the protection in words."""

class ReferenceProfile:
    """Profiles over torque, electrical angle and speed."""

    def __init__(self, values: Annotated[NDArray[numpy.float64], dict(shape=(None, None, None, None), order='C', device='cpu', writable=False)], *, tau_max: float, omega_m: _Sequence[float], u_dc: float, drop: float = 0.0, mutual: Annotated[NDArray[numpy.float64], dict(shape=(None, None, None, None), order='C', device='cpu', writable=False)] | None = None, mirrored: _Sequence[int] = []) -> None:
        """
        values: (1 or n_phases or more, n_speeds, n_levels, n_angles), for the speeds omega_m [rad/s], increasing, the torques tau_max (j/(n_levels - 1))^2 [N m] and one electrical period, at u_dc [V]; drop: R i at their peak [V]; mutual: flux linkage that neighbouring phases add [Wb], of the same shape, where phases couple; mirrored: (n_phases), which of them a phase has at a torque of the other sense, where each has its own.
        """

    def at(self, tau: float, theta_e: float, *, omega_m: float, u_dc: float) -> float:
        """
        The value at a torque [N m], electrical angle [rad], speed [rad/s] and voltage [V].
        """

def switching_weight(machine: LeHuy | FluxMap, *, guide: ReferenceProfile, R: float, tau_ref: float, omega_m: float, u_dc: float, i_max: float, f_switch: float) -> float:
    """
    Cost of a turn-on [N^2 m^2 s] that makes about f_switch [Hz] per switch.
    """

class Conduction:
    """
    Turn-on and turn-off angle, electrical [rad]; the speed below which a window for starting replaces them [rad/s].
    """

    def __init__(self, *, theta_on: float, theta_off: float, brake_on: float, brake_off: float, omega_start: float) -> None: ...

class TorqueBands:
    """Half widths of two torque bands [N m]."""

    def __init__(self, *, inner: float, outer: float) -> None: ...

class MeanTorque:
    """
    Current reference over the torque reference: 17 currents [A] for the torques 0..tau_max [N m].
    """

    def __init__(self, *, tau_max: float, i_ref: _Sequence[float], i_brake: _Sequence[float]) -> None: ...

    @staticmethod
    def constant(i_ref: float) -> MeanTorque:
        """The same current [A] for every torque."""

class TurnOn:
    """
    Flux [Wb] that a phase is turned on ahead for: 9 values for the torques 0..tau_max, motoring and braking.
    """

    def __init__(self, *, tau_max: float, psi: _Sequence[float], psi_brake: _Sequence[float]) -> None: ...

class Feasible:
    """
    Greatest omega_e/u_dc [rad/Wb] at which the voltage suffices for a law's own references: 9 values for the torques 0..tau_max, motoring and braking.
    """

    def __init__(self, *, tau_max: float, motoring: _Sequence[float], braking: _Sequence[float]) -> None: ...

class StrokeFit:
    """
    Resistance and flux map from the strokes of the phases: unaligned inductance [H], currents [A], period [s].
    """

    def __init__(self, *, drops: Drops, edges: EdgeLimits, L_u: float, i_least: float, i_missing: float, psi_least: float, T_s: float, delay: int) -> None: ...

class Sharing:
    """
    Torque sharing function. Turn-on and overlap angle, electrical [rad]; with Shape.table the rise at 33 equally spaced angles of the overlap.
    """

    def __init__(self, *, shape: Shape, theta_on: float, theta_ov: float, table: _Sequence[float]) -> None: ...

    def is_feasible(self, n_phases: int) -> bool:
        """True if every phase with a share can give torque."""

    def share(self, n_phases: int, theta_e: float) -> float:
        """Share of the phase at theta_e [1]."""

class PulseTable:
    """
    Angles [rad] and current [A] of motoring pulses over speed [rad/s] and torque [N m], row by row of speed; without values no table.
    """

    def __init__(self, *, omega: _Sequence[float] = [], tau: _Sequence[float] = [], theta_on: _Sequence[float] = [], theta_off: _Sequence[float] = [], i_ref: _Sequence[float] = []) -> None: ...

    def at(self, omega_m: float, tau: float) -> list[float]:
        """
        Turn-on and turn-off angle [rad] and current [A] at a speed [rad/s] and torque [N m].
        """

def angles(machine: LeHuy | FluxMap, n_phases: int, single: bool, *, conduction: Conduction, reference: MeanTorque, i_band: float, chop: Leg, watch: AngleWatch, table: PulseTable) -> Law:
    """
    Current held in a band of half width i_band [A] between turn-on and turn-off.
    """

def pwm_current(machine: LeHuy | FluxMap, n_phases: int, single: bool, *, R: float, conduction: Conduction, reference: MeanTorque, bandwidth: float, T_s: float) -> Law:
    """
    Current held by a PI controller of this bandwidth [rad/s] between turn-on and turn-off.
    """

def torque_sharing(machine: LeHuy | FluxMap, n_phases: int, single: bool, *, sharing: Sharing, feasible: Feasible, guide: ReferenceProfile, R: float, i_max: float, i_band: float, T_s: float, delay: float, chop: Leg) -> Law:
    """Shared torque as current references. guide: phase current [A]."""

def coupled_torque_sharing(machine: LeHuy | FluxMap, n_phases: int, single: bool, *, pairs: Coupling, sharing: Sharing, feasible: Feasible, guide: ReferenceProfile, R: float, i_max: float, i_band: float, T_s: float, delay: float, chop: Leg) -> Law:
    """The same law, which computes with the pairs of phases."""

def ditc(machine: LeHuy | FluxMap, n_phases: int, single: bool, *, conduction: Conduction, turn_on: TurnOn, bands: TorqueBands, feasible: Feasible, guide: ReferenceProfile, psi_band: float, R: float, i_max: float, T_s: float) -> Law:
    """Direct instantaneous torque control: the torque error picks the legs."""

def coupled_ditc(machine: LeHuy | FluxMap, n_phases: int, single: bool, *, pairs: Coupling, conduction: Conduction, turn_on: TurnOn, bands: TorqueBands, feasible: Feasible, guide: ReferenceProfile, psi_band: float, R: float, i_max: float, T_s: float) -> Law:
    """The same law, which computes with the pairs of phases."""

def deadbeat(machine: LeHuy | FluxMap, n_phases: int, single: bool, *, R: float, sharing: Sharing, feasible: Feasible, guide: ReferenceProfile, i_max: float, T_s: float, delay: int, carriers: Carriers) -> Law:
    """
    The duty cycle that brings each phase to its shared torque in one sample.
    """

def learning_deadbeat(machine: LeHuy | FluxMap, n_phases: int, single: bool, *, fit: StrokeFit, pairs: Coupling | None, w_sw_torque: float, w_sw_voltage: float, R: float, sharing: Sharing, feasible: Feasible, guide: ReferenceProfile, i_max: float, T_s: float, delay: int, carriers: Carriers) -> Law:
    """The same law, which learns the machine that it drives."""

def coupled_deadbeat(machine: LeHuy | FluxMap, n_phases: int, single: bool, *, pairs: Coupling, R: float, sharing: Sharing, feasible: Feasible, guide: ReferenceProfile, i_max: float, T_s: float, delay: int, carriers: Carriers) -> Law:
    """The same law, which computes with the pairs of phases."""

N_p_max: int = 10

N_c_max: int = 4

def paper_mpc(machine: LeHuy | FluxMap, n_phases: int, single: bool, *, guide: ReferenceProfile, N_p: int, N_c: int, r_w: float, w_i: float, R: float, i_max: float, i_band: float, T_s: float, delay: float, short_from: float) -> Law:
    """Predictive controller of current references. guide: phase current [A]."""

def coupled_paper_mpc(machine: LeHuy | FluxMap, n_phases: int, single: bool, *, pairs: Coupling, guide: ReferenceProfile, N_p: int, N_c: int, r_w: float, w_i: float, R: float, i_max: float, i_band: float, T_s: float, delay: float, short_from: float) -> Law:
    """The same law, which computes with the pairs of phases."""

def finite_set_mpc(machine: LeHuy | FluxMap, n_phases: int, single: bool, *, guide: ReferenceProfile, horizon: int, w_psi: _Sequence[float], feedback: _Sequence[float], w_i: float, w_sw: float, t_end: float, R: float, i_max: float, T_s: float, delay: int) -> Law:
    """
    Finite-control-set predictive torque control. guide: flux linkage [Wb]; w_psi: weight of the distance to it [N^2 m^2/Wb^2], feedback: 1 where feedback holds the mean, else 0 [1], each at each of its speeds.
    """

def coupled_finite_set_mpc(machine: LeHuy | FluxMap, n_phases: int, single: bool, *, pairs: Coupling, guide: ReferenceProfile, horizon: int, w_psi: _Sequence[float], feedback: _Sequence[float], w_i: float, w_sw: float, t_end: float, R: float, i_max: float, T_s: float, delay: int) -> Law:
    """The same law, which computes with the pairs of phases."""

def edge_mpc(machine: LeHuy | FluxMap, n_phases: int, single: bool, *, guide: ReferenceProfile, w_sw: float, psi_slack: _Sequence[float], R: float, i_max: float, T_s: float, delay: int) -> Law:
    """
    Predictive torque control with switching instants as variables. guide: flux linkage [Wb]; psi_slack: most that a phase may leave it, at each of its speeds [Wb].
    """

def learning_edge_mpc(machine: LeHuy | FluxMap, n_phases: int, single: bool, *, fit: StrokeFit, pairs: Coupling | None, w_sw_torque: float, w_sw_voltage: float, guide: ReferenceProfile, w_sw: float, psi_slack: _Sequence[float], R: float, i_max: float, T_s: float, delay: int) -> Law:
    """The same law, which learns the machine that it drives."""

def coupled_edge_mpc(machine: LeHuy | FluxMap, n_phases: int, single: bool, *, pairs: Coupling, guide: ReferenceProfile, w_sw: float, psi_slack: _Sequence[float], R: float, i_max: float, T_s: float, delay: int) -> Law:
    """The same law, which computes with the pairs of phases."""
