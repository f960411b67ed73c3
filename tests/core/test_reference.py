"""Runs against integrations of the same equations that share no code with the program."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

import reluctance as rl

EXAMPLES = Path(__file__).parents[2] / "examples"
Array = NDArray[np.float64]


@dataclass(frozen=True)
class Plant:
    """Le-Huy and Brunelle's machine as published: mechanical angle from alignment, 6/4 poles."""

    R: float
    psi_m: float
    L_d: float
    J: float = 0.0  # 0: the speed is held
    B: float = 0.0
    k_pump: float = 0.0
    L_q: float = 0.67e-3
    L_ds: float = 0.15e-3
    I_m: float = 450.0
    n_phases: int = 3
    N_r: int = 4

    def phase(self, i: float, theta_e: float) -> tuple[float, float, float, float]:
        """psi, dpsi/di, dpsi/dtheta, torque; theta_e electrical, 0 unaligned."""
        N_r = self.N_r
        A = self.psi_m - self.L_ds * self.I_m
        B = (self.L_d - self.L_ds) / A
        before = (theta_e % (2 * np.pi)) < np.pi
        theta = abs((theta_e % (2 * np.pi)) - np.pi) / N_r  # from alignment, 0..pi/N_r
        f = 2 * N_r**3 / np.pi**3 * theta**3 - 3 * N_r**2 / np.pi**2 * theta**2 + 1
        df = 6 * N_r**3 / np.pi**3 * theta**2 - 6 * N_r**2 / np.pi**2 * theta
        df = -df if before else df  # theta falls towards alignment
        E = np.exp(-B * i)
        rise = self.L_ds * i + A * (1 - E) - self.L_q * i
        work = (self.L_ds - self.L_q) * i**2 / 2 + A * i - A / B * (1 - E)
        return (
            self.L_q * i + rise * f,
            self.L_q + (self.L_ds + A * B * E - self.L_q) * f,
            rise * df,
            work * df,
        )

    def electrical(self, theta_m: float, k: int) -> float:
        return float((self.N_r * theta_m - 2 * np.pi * k / self.n_phases) % (2 * np.pi))

    def rates(self, x: Array, u: list[float | None]) -> list[float]:
        """Of currents, speed and angle; u None: the diodes block."""
        *i, omega, theta = x
        di, tau = [], 0.0
        for k, voltage in enumerate(u):
            if voltage is None:
                di.append(0.0)
                continue
            _, L, slope, torque = self.phase(i[k], self.electrical(theta, k))
            di.append((voltage - self.R * i[k] - omega * slope) / L)
            tau += torque
        load = self.B * omega + self.k_pump * omega**2
        return [*di, (tau - load) / self.J if self.J else 0.0, omega]

    def torque(self, x: Array) -> Array:
        """Of all phases along a trajectory (n_phases + 2, n)."""
        return np.array(
            [
                sum(self.phase(i, self.electrical(c[-1], k))[3] for k, i in enumerate(c[:-2]))
                for c in x.T
            ]
        )


def single_pulse(plant: Plant, t: Array, omega: float, u_dc: float, on: float, off: float) -> Array:
    """States (n_phases + 2, n) at the times t, from zero current at angle zero.

    DOP853 between events: a phase enters or leaves its window, or its current ends.
    """
    n = plant.n_phases
    x, now = np.array([0.0] * n + [omega, 0.0]), 0.0
    inside = [(plant.electrical(0.0, k) - on) % (2 * np.pi) < off - on for k in range(n)]
    flows = list(inside)
    out = np.empty((n + 2, len(t)))
    while now < t[-1]:
        u = [u_dc if inside[k] else -u_dc if flows[k] else None for k in range(n)]
        edge = [off if inside[k] else on for k in range(n)]
        gap = [(edge[k] - plant.electrical(x[-1], k)) % (2 * np.pi) for k in range(n)]
        gap = [g if g > 1e-7 else 2 * np.pi for g in gap]
        events = [lambda _, y, k=k, to=x[-1] + gap[k] / plant.N_r: y[-1] - to for k in range(n)] + [
            lambda _, y, k=k: y[k] if flows[k] and not inside[k] else 1.0 for k in range(n)
        ]
        for event in events:
            event.terminal = True
        part = solve_ivp(
            lambda _, y, u=u: plant.rates(y, u),
            (now, t[-1]),
            x,
            "DOP853",
            dense_output=True,
            events=events,
            rtol=1e-11,
            atol=1e-12,
            max_step=5e-5,  # so that no trial step goes far past zero current
        )
        here = (t >= now) & (t <= part.t[-1])
        out[:, here] = part.sol(t[here])
        now, x = part.t[-1], part.y[:, -1]
        for k in range(n):
            if part.t_events[k].size:
                inside[k] = not inside[k]
                flows[k] = True
            if part.t_events[n + k].size:
                flows[k], x[k] = False, 0.0
    return out


TURNING = {"J": 0.008, "B": 0.02, "k_pump": 0.0015}


@pytest.mark.parametrize("turning", [False, True], ids=["locked", "pump"])
def test_single_pulse_is_that_of_dop853(turning: bool) -> None:
    overrides = ["load.kind='pump'", "load.k_pump_Nms2=0.0015"] if turning else []
    drive = rl.load(EXAMPLES / "single_pulse.toml", overrides)
    result = rl.simulate(drive, until=0.0205)
    assert result.theta_m[-1] * 4 / (2 * np.pi) > 3  # electrical periods
    assert np.ptp(result.omega_m) > 10 if turning else np.ptp(result.omega_m) == 0
    plant = Plant(R=0.72, psi_m=0.468, L_d=23.62e-3, **(TURNING if turning else {}))
    x = single_pulse(plant, result.t, omega=100 * np.pi, u_dc=240.0, on=0.0, off=np.radians(110))
    expected = [*x[:3], plant.torque(x), x[3]]
    found = [*result.i, result.tau, result.omega_m]
    for ours, theirs in zip(found, expected, strict=True):
        assert np.abs(ours - theirs).max() < 1e-6 * np.abs(theirs).max()


class FirstPhaseOn(rl.Law):
    def step(self, y: rl.Measurement, tau_ref: float) -> list[rl.Order]:
        legs = [rl.Leg.magnetize, rl.Leg.demagnetize, rl.Leg.demagnetize]
        return [rl.Order.hold(leg) for leg in legs]


def test_error_falls_with_the_fourth_power_of_the_step() -> None:
    """The order of Hermite's rule, where no event cuts a step short: a current that rises through
    saturation, against DOP853."""
    plant, omega, until = Plant(R=0.72, psi_m=0.468, L_d=23.62e-3), 20 * np.pi, 2e-3
    exact = solve_ivp(
        lambda _, x: plant.rates(x, [240.0, None, None]),
        (0, until),
        [0.0, 0.0, 0.0, omega, 0.0],
        "DOP853",
        rtol=1e-13,
        atol=1e-13,
    ).y[0, -1]
    drive = rl.load(EXAMPLES / "single_pulse.toml", ["control.T_s_us=1000", "load.speed_rpm=600"])
    steps = np.array([20.0, 10.0, 5.0])
    errors = []
    for dt_us in steps:
        fine = drive.with_values({"simulation.dt_max_us": dt_us})
        result = rl.simulate(fine, until=until, law=FirstPhaseOn())
        assert np.diff(result.t).max() == pytest.approx(dt_us * 1e-6)
        assert np.sort(np.diff(result.t))[2] > 0.9 * dt_us * 1e-6  # but for two slivers of rounding
        errors.append(abs(result.i[0, -1] - exact))
    order = np.diff(np.log(errors)) / np.diff(np.log(steps))
    assert errors[-1] > 1e-13 * exact  # above the rounding
    np.testing.assert_allclose(order, 4.0, atol=0.25)


@pytest.mark.parametrize("turning", [False, True], ids=["locked", "pump"])
@pytest.mark.parametrize("rpm", [1000, 3000, 6000, 10000])
def test_the_default_step_is_right_to_1e_6_at_any_speed(rpm: float, turning: bool) -> None:
    """Of peak against DOP853 with dt_max = 20 us: the step follows the speed."""
    overrides = [f"load.speed_rpm={rpm}", "simulation.dt_max_us=20"]
    overrides += ["load.kind='pump'", "load.k_pump_Nms2=0.0015"] if turning else []
    drive = rl.load(EXAMPLES / "single_pulse.toml", overrides)
    omega = rpm * np.pi / 30
    result = rl.simulate(drive, until=3.3 * 2 * np.pi / (4 * omega))
    plant = Plant(R=0.72, psi_m=0.468, L_d=23.62e-3, **(TURNING if turning else {}))
    x = single_pulse(plant, result.t, omega=omega, u_dc=240.0, on=0.0, off=np.radians(110))
    expected = [*x[:3], plant.torque(x), x[3]]
    found = [*result.i, result.tau, result.omega_m]
    for ours, theirs in zip(found, expected, strict=True):
        assert np.abs(ours - theirs).max() < 1e-6 * np.abs(theirs).max()


def hysteresis(
    plant: Plant, omega: float, *, band: tuple[float, float], off: float, dt: float
) -> float:
    """Mean torque of all phases with the demonstration's converter, from angle zero to zero
    current: flux linkage by the explicit Euler method, both switches by one relay."""
    psi, i, t, work, on = 0.0, 0.0, 0.0, 0.0, True
    period = 2 * np.pi / (plant.N_r * omega)
    lower, upper = band
    while t < period and (t == 0 or i > 0):
        theta_e = plant.N_r * omega * t
        on = theta_e < off and (i < lower or (on and i < upper))
        u = 240 - 2 * (1.0 + 1e-3 * i) if on else -240 - 2 * (0.8 + 1e-3 * i)
        psi += dt * (u - plant.R * i)
        t += dt
        for _ in range(2):  # Newton's method from the current before
            flux, L, _, torque = plant.phase(i, plant.N_r * omega * t)
            i += (psi - flux) / L
        work += torque * omega * dt
    return plant.n_phases * work / (period * omega)


def test_published_demonstration_gives_its_torque() -> None:
    """200 A +-10 A from 45 to 75 deg mechanical after alignment on the 60 kW machine at 500 rpm."""
    kpis = rl.simulate(rl.load(EXAMPLES / "hysteresis_200A.toml"), record=None).kpis
    plant = Plant(R=0.05, psi_m=0.486, L_d=23.6e-3)
    alone = hysteresis(plant, 500 * np.pi / 30, band=(190.0, 210.0), off=np.radians(120), dt=0.5e-6)
    assert kpis.tau_mean == pytest.approx(alone, rel=0.01)


def test_slow_demonstration_gives_the_energy_of_the_flat_top() -> None:
    """Without the time for rise and fall a stroke converts 48.764 J: 93.13 N m at 200 A."""
    drive = rl.load(EXAMPLES / "hysteresis_200A.toml", ["load.speed_rpm=20.0"])
    kpis = rl.simulate(drive, until=1.6, record=None).kpis
    flat_top = 12 * 48.764 / (2 * np.pi)
    assert kpis.periods >= 1
    assert kpis.tau_mean == pytest.approx(flat_top, rel=0.01)


HYSTERESIS = [
    "load.speed_rpm=1500",
    "control.regulate='current'",
    "control.i_ref_A=60",
    "control.i_band_A=1",
]


@pytest.mark.parametrize(
    ("example", "overrides"),
    [
        ("paper_rated", []),
        ("single_pulse", HYSTERESIS),
        ("single_pulse", [*HYSTERESIS, "load.speed_rpm=-2200"]),
        ("hysteresis_200A", ["control.T_s_us=50"]),
        ("deadbeat", ["converter.dead_time_us=1"]),
        ("map_mpc", []),
    ],
)
def test_independent_and_joint_steps_agree(example: str, overrides: list[str]) -> None:
    """A dc-link voltage that rises, by a millionth of a volt a second, takes the joint step."""
    drive = rl.load(EXAMPLES / f"{example}.toml", overrides)
    u_dc = drive.converter.u_dc_V
    rises = ["source.t_s=[0, 1]", f"source.values=[{u_dc}, {u_dc + 1e-6}]"]
    rising = rl.load(EXAMPLES / f"{example}.toml", [*overrides, *rises])
    alone, together = (rl.simulate(d, until=0.0293) for d in (drive, rising))
    assert alone.t.size != together.t.size  # each takes its own steps
    for one, other in ((alone.i, together.i), (alone.tau, together.tau)):
        assert np.abs(one[..., -1] - other[..., -1]).max() < 1e-6 * np.abs(other).max()
    one, other = alone.periods, together.periods
    for integral in ("tau", "tau_squared", "E_dc", "E_source", "E_winding", "E_mech"):
        np.testing.assert_allclose(one[integral], other[integral], rtol=1e-6)
    for extreme in ("tau_min", "tau_max", "i_peak"):
        np.testing.assert_allclose(one[extreme], other[extreme], rtol=1e-6, atol=1e-9)
