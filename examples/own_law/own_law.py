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
        self.torque = known.machine.torque(self.i, np.linspace(0, np.pi, 721)[:, None])

    def rise(self, theta):
        x = min(max(theta / self.theta_ov, 0), 1)
        return x * x * (3 - 2 * x)

    def step(self, y, tau_ref):
        n, stroke = y.n_phases, 2 * np.pi / y.n_phases
        theta = [(y.angle(k) + self.ahead * y.omega_m) % (2 * np.pi) for k in range(n)]
        rows = [self.torque[min(int(720 * t / np.pi), 720)] for t in theta]
        x = [t - self.theta_on for t in theta]
        tau = [tau_ref * (self.rise(v) - self.rise(v - stroke)) for v in x]
        given = [np.interp(y.i[k], self.i, rows[k]) for k in range(n)]
        for k in range(n):
            if 0 <= x[k] < stroke:
                tau[k] = tau_ref - sum(given) + given[k]
        i_ref = [np.interp(tau[k], rows[k], self.i) if tau[k] > 0 else 0.0 for k in range(n)]
        return [rl.Order.regulate(i, self.i_band) for i in i_ref]
