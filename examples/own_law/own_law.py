"""A control law of one's own in Python: the incoming phase gives what the others leave to give."""

import numpy as np

import reluctance as rl


class RestOfTorque(rl.Law):
    """Cubic torque sharing in which the incoming phase makes up for the others' torque error."""

    def __init__(self, i_band=1.0, theta_on=0.1, theta_ov=0.8):
        self.i_band, self.theta_on, self.theta_ov = i_band, theta_on, theta_ov

    def reset(self, known):
        self.ahead = known.N_r * known.T_s * (0.5 + known.delay)  # to mid-sample [s]
        self.i = np.linspace(0, known.i_max, 301)
        self.torque = known.machine.tau(self.i, np.linspace(0, np.pi, 721)[:, None])

    def rise(self, theta):
        x = np.clip(theta / self.theta_ov, 0, 1)
        return x * x * (3 - 2 * x)

    def step(self, y, tau_ref):
        phases, stroke = range(y.n_phases), 2 * np.pi / y.n_phases
        theta = np.mod([y.angle(k) + self.ahead * y.omega_m for k in phases], 2 * np.pi)
        rows = self.torque[np.minimum(720 * theta / np.pi, 720).astype(int)]
        x = theta - self.theta_on
        tau = tau_ref * (self.rise(x) - self.rise(x - stroke))
        given = np.array([np.interp(y.i[k], self.i, rows[k]) for k in phases])
        tau = np.where((0 <= x) & (x < stroke), tau_ref - given.sum() + given, tau)
        i_ref = [np.interp(tau[k], rows[k], self.i) * (tau[k] > 0) for k in phases]
        return [rl.Order.regulate(i, self.i_band) for i in i_ref]
