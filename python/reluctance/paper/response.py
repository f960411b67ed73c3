"""Torque response time: what the dc link allows, and what the controller does.

Response time: from zero current at a stated rotor angle, at held speed, until the torque first
reaches 95 % of its reference.

The physical bound. The torque at an instant depends on the currents at that instant alone. Each
current follows its own equation, L_inc di/dt = u - R i - omega psi_theta, in which a larger u at
any time never gives a smaller current later. So the greatest torque at time t is that of full
voltage from the start on every phase whose torque is positive at t, and of no current in the
others: the sharing by two phases solves itself. No controller is faster than the first t at which
this torque reaches the level. No limit of current; ideal switches; zero time to compute.
"""

import numpy as np
from numpy.typing import ArrayLike

from reluctance import _core
from reluctance.base.arrays import FloatArray
from reluctance.drive.run.result import Result
from reluctance.machine.machine_file import MachineFile

LEVEL = 0.95  # of the torque reference: our definition of "reached"; the paper gives none
DT = 2e-6  # step of the bound [s]; halving it moves no response time by more than 1e-8 s


def least_time(
    machine: MachineFile,
    *,
    tau: float,
    omega_m: float,
    u_dc: ArrayLike,
    theta_m: ArrayLike,
    horizon: float,
) -> FloatArray:
    """The first instant at which a torque is possible [s]; inf where later than `horizon`.

    Parameters
    ----------
    machine : MachineFile
    tau : float
        Torque to reach, > 0 [N m].
    omega_m : float
        Held speed [rad/s].
    u_dc, theta_m : array_like
        Dc-link voltage [V] and rotor angle at the start [rad], broadcast against each other.
    horizon : float
        When to give up [s].

    Returns
    -------
    ndarray, shape of u_dc and theta_m broadcast
    """
    u, start = np.broadcast_arrays(np.asarray(u_dc, float), np.asarray(theta_m, float))
    shape, u, start = u.shape, u.ravel(), start.ravel()
    lag = 2 * np.pi / machine.n_phases * np.arange(machine.n_phases)[:, None]

    def magnetics(i: FloatArray, t: float) -> FloatArray:
        theta_e = machine.N_r * (start + omega_m * t) - lag
        rows = _core.magnetics(machine.magnetics, i.ravel(), theta_e.ravel())
        return np.asarray(rows).reshape(*i.shape, 5)

    def slope(i: FloatArray, t: float) -> FloatArray:
        at = magnetics(i, t)
        return np.asarray((u - machine.R * i - omega_m * at[..., 4]) / at[..., 3])

    i = np.zeros((machine.n_phases, u.size))
    reached, before = np.full(u.size, np.inf), np.zeros(u.size)
    steps = int(np.ceil(horizon / DT))
    dt = horizon / steps
    for n in range(steps):  # classical Runge-Kutta
        t = n * dt
        k_1 = slope(i, t)
        k_2 = slope(np.maximum(i + dt / 2 * k_1, 0), t + dt / 2)
        k_3 = slope(np.maximum(i + dt / 2 * k_2, 0), t + dt / 2)
        k_4 = slope(np.maximum(i + dt * k_3, 0), t + dt)
        i = np.maximum(i + dt / 6 * (k_1 + 2 * k_2 + 2 * k_3 + k_4), 0)
        now = np.maximum(magnetics(i, t + dt)[..., 2], 0).sum(axis=0)
        first = np.isinf(reached) & (now >= tau)
        reached[first] = t + dt * ((tau - before[first]) / (now[first] - before[first]))
        before = now
    return reached.reshape(shape)


def least_voltage(
    machine: MachineFile, *, tau: float, omega_m: float, theta_m: ArrayLike, within: float
) -> FloatArray:
    """The least dc-link voltage [V] with which a torque is possible within a time [s].

    Parameters as for `least_time`. Bisection: more voltage is never slower.

    Returns
    -------
    ndarray, shape of theta_m
    """
    start = np.asarray(theta_m, float)
    low, high = np.zeros_like(start), np.full_like(start, 5000.0)
    for _ in range(22):  # 5000 V/2^22 = 1 mV
        u = (low + high) / 2
        time = least_time(machine, tau=tau, omega_m=omega_m, u_dc=u, theta_m=start, horizon=within)
        low, high = np.where(np.isinf(time), u, low), np.where(np.isinf(time), high, u)
    return high


def response_time(result: Result) -> float:
    """The first instant [s] at which the torque of a run is at LEVEL of its reference; or inf."""
    short = LEVEL * result.tau_ref - result.tau
    hits = np.flatnonzero((short[1:] <= 0) & (short[:-1] > 0))
    if hits.size == 0:
        return float("inf")
    j = int(hits[0])
    share = short[j] / (short[j] - short[j + 1])
    return float(result.t[j] + share * (result.t[j + 1] - result.t[j]))
