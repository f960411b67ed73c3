"""How N_p, N_c and r_w act, and how response time depends on dc-link voltage and rotor angle."""

from dataclasses import dataclass

import numpy as np

from reluctance.base.arrays import FloatArray
from reluctance.base.key_figures import Kpis
from reluctance.drive.run.result import Result
from reluctance.drive.run.simulate import simulate
from reluctance.paper.points import Point
from reluctance.paper.response import LEVEL, least_time, least_voltage, response_time

STROKE_DEG = 30.0  # 6/4: after it the phases change places and all repeats
HORIZON = 4e-3  # of a response [s]; the slowest of the bound is 3 ms, at 150 V
FINE_DEG = 0.25  # angles of the search for the least voltage
VOLTAGE_STEP = 10.0  # to which the controller's least voltage is found [V]
VOLTAGE_MAX = 1500.0  # where that search gives up [V]
SETTINGS_UNTIL = 0.1  # five electrical periods in the second half at 1500 rpm [s]


@dataclass(frozen=True)
class Setting:
    """One setting of the predictive controller and what it gives."""

    name: str  # the key that is varied
    value: float
    kpis: Kpis
    response: float  # [s]


@dataclass(frozen=True)
class Response:
    """Response times of one operating point, speed held."""

    point: Point
    u_dc: FloatArray  # (n_u,) [V]
    theta_deg: FloatArray  # (n_theta,) rotor angle at the start, mechanical
    bound: FloatArray  # (n_u, n_theta) what physics allows [s]
    reached: FloatArray  # (n_u, n_theta) what the controller does [s]; inf if not in HORIZON
    u_least: float  # least voltage for the paper's response time at the best angle [V]
    theta_least_deg: float  # that angle
    u_least_any: float  # the same at the worst angle [V]
    u_least_standstill: float  # the same at the best angle with the shaft at rest [V]
    u_reached: float  # least voltage, in steps of VOLTAGE_STEP, with which the controller does it
    theta_start_deg: float  # where the controller is fastest at the drive's own voltage
    start: Result  # the run from there

    @property
    def own(self) -> int:
        """The row of the voltage that the drive file has."""
        return int(np.flatnonzero(self.u_dc == self.start.drive.converter.u_dc_V)[0])


def response(point: Point, *, u_dc: FloatArray, theta_deg: FloatArray) -> Response:
    """Response times over dc-link voltage (n_u,) [V] and rotor angle (n_theta,) [deg].

    The drive's own voltage must be among u_dc.
    """
    drive = point.drive()
    machine, omega_m, tau = drive.machine, drive.omega_nominal, LEVEL * point.tau_ref
    theta_m = np.radians(theta_deg)
    bound = least_time(
        machine,
        tau=tau,
        omega_m=omega_m,
        u_dc=u_dc[:, None],
        theta_m=theta_m[None],
        horizon=HORIZON,
    )
    reached = np.array([[controlled(point, u, angle) for angle in theta_deg] for u in u_dc])
    fine = np.arange(0.0, STROKE_DEG, FINE_DEG)
    u_least, u_at_rest = (
        least_voltage(machine, tau=tau, omega_m=w, theta_m=np.radians(fine), within=point.response)
        for w in (omega_m, 0.0)
    )
    own = int(np.flatnonzero(u_dc == drive.converter.u_dc_V)[0])
    best = theta_deg[reached[own].argmin()]
    behind = reached[own].min() / bound[own].min()  # controller over bound, at the own voltage
    return Response(
        point=point,
        u_dc=u_dc,
        theta_deg=theta_deg,
        bound=bound,
        reached=reached,
        u_least=float(u_least.min()),
        theta_least_deg=float(fine[u_least.argmin()]),
        u_least_any=float(u_least.max()),
        u_least_standstill=float(u_at_rest.min()),
        u_reached=_controllers_least_voltage(point, u_least.min() * behind, theta_deg),
        theta_start_deg=float(best),
        start=simulate(point.drive(f"simulation.theta_start_deg={best}"), until=0.04, record=0.0),
    )


def controlled(point: Point, u_dc: float, theta_deg: float, *overrides: str) -> float:
    """Response time of the controller [s]; inf if longer than HORIZON."""
    drive = point.drive(
        f"converter.u_dc_V={u_dc}", f"simulation.theta_start_deg={theta_deg}", *overrides
    )
    return response_time(simulate(drive, until=HORIZON, record=5e-6))  # read by straight lines


def _controllers_least_voltage(point: Point, guess: float, theta_deg: FloatArray) -> float:
    """The least voltage on the grid of VOLTAGE_STEP with which some start angle is fast enough."""

    def fast_enough(u_dc: float) -> bool:
        return min(controlled(point, u_dc, angle) for angle in theta_deg) <= point.response

    u = float(np.ceil(guess / VOLTAGE_STEP) * VOLTAGE_STEP)
    if fast_enough(u):
        while fast_enough(u - VOLTAGE_STEP):
            u -= VOLTAGE_STEP
        return u
    while u < VOLTAGE_MAX:
        u += VOLTAGE_STEP
        if fast_enough(u):
            return u
    raise RuntimeError(f"{point.label}: no response within {point.response} s up to {u:g} V")


def settings(point: Point, values: dict[str, list[float]], theta_deg: float) -> list[Setting]:
    """Key figures over each setting, the others as in the drive file.

    N_c stays at most N_p, and N_c is varied with N_p = 4 so that it has room.
    """
    found = []
    for name, axis in values.items():
        for value in axis:
            change = [f"control.{name}={value}"]
            if name == "N_p":
                change.append(f"control.N_c={min(int(value), 2)}")
            if name == "N_c":
                change.append("control.N_p=4")
            drive = point.drive(*change)
            u_dc = drive.converter.u_dc_V
            found.append(
                Setting(
                    name=name,
                    value=float(value),
                    kpis=simulate(drive, until=SETTINGS_UNTIL, record=None).kpis,
                    response=controlled(point, u_dc, theta_deg, *change),
                )
            )
    return found
