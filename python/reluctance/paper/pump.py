"""Where a torque and the pump of eq. 2.2 and 2.3 come to rest, and how fast small errors decay."""

import numpy as np


def equilibrium_speed(tau: float, *, k_pump: float, B: float) -> float:
    """The speed [rad/s] at which k omega^2 + B omega = tau: the positive root.

    Parameters
    ----------
    tau : float
        Constant torque, >= 0 [N m].
    k_pump : float
        Pump, > 0 [N m s^2].
    B : float
        Viscous friction, >= 0 [N m s].
    """
    return float((np.sqrt(B**2 + 4 * k_pump * tau) - B) / (2 * k_pump))


def pole(omega_m: float, *, k_pump: float, B: float, J: float) -> float:
    """d(domega/dt)/domega at a speed, torque held [1/s]; the paper prints (k omega^2 + f)/J."""
    return -(2 * k_pump * omega_m + B) / J
