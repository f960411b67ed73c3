"""The closed loop of the guided predictive laws, for their tests and docs/control/best_mpc.md.

`python tests/mpc_loop.py` prints the numbers of the page.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from reluctance import _core
from reluctance.drive.pump_load import pump
from reluctance.drive.tables import Load
from reluctance.laws.flux_guide import FluxGuide
from reluctance.limit import OperatingPoint, best_profile, profile_table
from reluctance.run.columns import Rows

RPM = np.pi / 30
NO_PUMP = pump(Load(kind="locked"))
U_DC = 240.0  # of the guides
PAPER = {"N_r": 4, "L_u": 0.67e-3, "L_a": 23.62e-3, "L_sat": 0.15e-3, "i_m": 450.0, "psi_m": 0.468}
GENERIC = {**PAPER, "L_a": 23.6e-3, "psi_m": 0.486}
SMALL = {"N_r": 6, "L_u": 8.7e-3, "L_a": 0.25, "L_sat": 0.5e-3, "i_m": 5.0, "psi_m": 0.3}


@dataclass(frozen=True)
class Point:
    """A machine at an operating point."""

    tau: float  # [N m]
    rpm: float
    lehuy: Any
    R: float = 0.72
    i_max: float = 150.0
    n_phases: int = 3
    guide_rpm: tuple[float, ...] = ()  # speeds of the guide; by default this one
    u_dc: float = U_DC  # of the loop [V]
    i_range: float = 200.0  # of the current sensor [A]
    smoothing: float = 1e-3  # of the guide, see `best_profile` [rad^2]

    @property
    def machine(self) -> Any:
        return _core.LeHuy(**self.lehuy)

    def at(self, rpm: float, u_dc: float = U_DC) -> OperatingPoint:
        """The machine at a speed, on the voltage of the guides."""
        return OperatingPoint(self.machine, self.n_phases, self.R, self.i_max, u_dc, rpm * RPM)

    def guide(self, f_switch: float) -> FluxGuide:
        """Flux profiles for torques up to 1.1 tau, and the weights of the rules."""
        tables = tuple(
            profile_table(
                self.at(rpm),
                1.1 * abs(self.tau),
                n_levels=10,
                n_points=360 // self.n_phases * self.n_phases,
                smoothing=self.smoothing,
            )
            for rpm in self.guide_rpm or (self.rpm,)
        )
        return FluxGuide(tables, self.at(self.rpm), abs(self.tau), f_switch)


@dataclass(frozen=True)
class Timing:
    """Sampling of the controller."""

    T_s: float
    delay: int = 0
    adc_bits: int = 0
    encoder_counts: int = 0


FPGA = Timing(2e-6)
STUDY = Timing(5e-6)
MICROCONTROLLER = Timing(20e-6, delay=1, adc_bits=12, encoder_counts=4096)
RATED = Point(41.339, 1500, PAPER)
HALF = Point(20.669, 1060.7, PAPER)
ONE_HP = Point(2.0, 1500, SMALL, R=2.15, i_max=5.0, n_phases=4, i_range=10.0)  # 8/6


def controller(
    law: str,
    point: Point,
    timing: Timing,
    f_switch: float,
    *,
    single: bool = False,
    horizon: int = 1,
) -> Any:
    """A guided law with the weights of the rule."""
    setting = _core.Setting(
        machine=point.machine,
        n_phases=point.n_phases,
        single=single,
        outer=_core.Outer.torque,
        K_p=0,
        K_i=0,
        tau_min=0,
        tau_max=0,
        T_s=timing.T_s,
    )
    guide = point.guide(f_switch)
    pulse = 1 / (4.8 * f_switch)
    common = {
        "guide": guide.profiles,
        "w_sw": guide.w_sw,
        "R": point.R,
        "i_max": point.i_max,
        "T_s": timing.T_s,
        "delay": timing.delay,
    }
    if law == "edge_mpc":
        return _core.edge_mpc(setting, psi_slack=guide.psi_slack, conducts=guide.conducts, **common)
    return _core.finite_set_mpc(
        setting,
        horizon=horizon,
        w_psi=guide.w_psi,
        conducts=guide.conducts,
        w_i=0.0,
        t_end=pulse**2 / (24 * horizon * timing.T_s),
        **common,
    )


def loop(
    law: Any,
    point: Point,
    timing: Timing,
    *,
    theta_m: float = 0.0,
    record_every: float = -1.0,
    reference: tuple[list[float], list[float]] | None = None,
) -> Any:
    """The law on its machine at the speed that a dynamometer holds. reference: times [s] and
    torques [N m]; by default that of the point throughout."""
    t_ref, ref = reference or ([0.0], [point.tau])
    return _core.Simulation(
        machine=point.machine,
        n_phases=point.n_phases,
        R=point.R,
        source=_core.StiffSource(u_dc=_constant(point.u_dc)),
        bridge=_core.AsymmetricBridge(
            device=_core.Devices(v_switch=0.0, R_switch=0.0, v_diode=0.0, R_diode=0.0)
        ),
        shaft=_core.Shaft(
            rotation=_core.Rotation.locked,
            J=0.008,
            B=0.0,
            k=0.0,
            tau_0=_constant(0.0),
            omega=_constant(point.rpm * RPM),
            load=None,
            pump=NO_PUMP,
        ),
        t_dead=0.0,
        sampling=_core.Sampling(
            T_s=timing.T_s,
            delay=timing.delay,
            adc_bits=timing.adc_bits,
            i_range=point.i_range,
            i_noise=0.0,
            i_offset=[0.0] * 6,
            i_gain=[1.0] * 6,
            u_noise=0.0,
            seed=0,
            rotor=_core.RotorSensor(
                counts=timing.encoder_counts, index=False, hall=False, hall_error=0.0
            ),
            angle_offset=0.0,
        ),
        controller=law,
        reference=_core.Course(t=t_ref, value=ref),
        theta_m=theta_m,
        resolution=_core.Resolution(
            dt_max=5e-6, scale=_core.Scale(i=100.0, u_dc=point.u_dc), record_every=record_every
        ),
    )


def _constant(value: float) -> Any:
    return _core.Course(t=[0.0], value=[value])


def sums(run: Any) -> dict[str, float]:
    """The last period row of a run of three phases, by name."""
    return dict(zip(_core.period_columns(3), run.take_periods()[-1], strict=True))


@dataclass(frozen=True)
class Figures:
    """Over the last periods of a run; ratios to the torque reference [1]."""

    error_rms: float
    ripple_pp: float
    i_rms: float  # mean over the phases [A]
    f_switch: float  # turn-ons per switch per second [Hz]


def figures(law: Any, point: Point, timing: Timing, *, periods: int = 6) -> Figures:
    """After two electrical periods of settling."""
    t_end = (2 + periods + 0.01) * 60 / (abs(point.rpm) * point.machine.N_r)
    run = loop(law, point, timing)
    blocks, t = [], 0.0
    while t < t_end:
        t = run.advance(t_end)
        blocks.append(run.take_periods())
    rows = Rows(np.vstack(blocks)[-periods - 1 :], _core.period_columns(point.n_phases))
    duration, N = rows.rise("t"), point.n_phases
    extremes = rows["tau_max"][1:].max() - rows["tau_min"][1:].min()
    squared = rows.phases("i_squared")[:, -1] - rows.phases("i_squared")[:, 0]
    return Figures(
        error_rms=float(np.sqrt(rows.rise("error_squared") / duration) / abs(point.tau)),
        ripple_pp=float(extremes / abs(point.tau)),
        i_rms=float(np.sqrt(squared.mean() / duration)),
        f_switch=float(rows.rise("turn_ons") / duration / (2 * N)),
    )


def over_speed() -> None:
    """The second table of docs/control/best_mpc.md: one guide over speed."""
    speeds = (1500, 1800, 2100, 2400, 2550, 2700, 2850, 3000)
    for u_dc, rpm in ((240, 1500), (240, 2250), (240, 2625), (240, 3000), (200, 1500), (200, 2250)):
        limit = best_profile(RATED.at(rpm, u_dc), RATED.tau, norm="rms")
        row = f"| {u_dc} V, {rpm} rpm | {limit.tau_error_rms / RATED.tau:.2%}, {limit.i_rms:.1f} A "
        for law in ("edge_mpc", "finite_set_mpc"):
            for guide_rpm in ((1500,), speeds):
                point = replace(RATED, rpm=rpm, u_dc=float(u_dc), guide_rpm=guide_rpm)
                y = figures(controller(law, point, STUDY, 10e3), point, STUDY, periods=30)
                row += f"| {y.error_rms:.2%}, {y.i_rms:.1f} A "
        print(row + "|")


def single_figures() -> None:
    """What the text of docs/control/best_mpc.md says beside its tables, of edge_mpc."""

    def told(what: str, point: Point, timing: Timing, f_switch: float) -> None:
        y = figures(controller("edge_mpc", point, timing, f_switch), point, timing, periods=30)
        print(f"{what}: {y.error_rms:.2%} rms, {y.i_rms:.2f} A at {y.f_switch / 1e3:.1f} kHz")

    reserve = replace(RATED, guide_rpm=(1500, 2625, 3000)).guide(10e3).reserve
    print("voltage reserve at 1500, 2625, 3000 rpm:", ", ".join(f"{r:.2f}" for r in reserve))
    for guide_rpm in ((2625, 3000), (2700, 2850), (2812,)):
        told(
            f"2812 rpm, guide {guide_rpm}",
            replace(RATED, rpm=2812, guide_rpm=guide_rpm),
            STUDY,
            10e3,
        )
    for smoothing, f_switch in ((1e-3, 21e3), (0.1, 22e3)):
        told(
            f"guide smoothed by {smoothing:g}", replace(RATED, smoothing=smoothing), FPGA, f_switch
        )
    for f_switch in (5.67e3, 11.3e3, 22.7e3, 45.4e3):  # about 5, 10, 20, 40 kHz are reached
        told("2 us, ideal", RATED, FPGA, f_switch)
    told("20 us, one sample late, sensed", RATED, MICROCONTROLLER, 16e3)
    told("20 us, ideal", RATED, Timing(20e-6), 16e3)
    told("2 us, ideal", RATED, FPGA, 14e3)
    told("20 us, one sample late, sensed", RATED, MICROCONTROLLER, 26e3)


def main() -> None:
    """The first table of docs/control/best_mpc.md."""
    generic = Point(80.0, 1500, GENERIC, R=0.05, i_max=200.0)
    points = {
        "paper 41.339 N m 1500 rpm": RATED,
        "paper 20.669 N m 1060.7 rpm": HALF,
        "60 kW 80 N m 1500 rpm": generic,
        "four phases 41.339 N m 1500 rpm": Point(41.339, 1500, PAPER, n_phases=4),
        "8/6, 1 hp, 2 N m 1500 rpm": ONE_HP,
    }
    cells = [
        ("edge_mpc", FPGA, 21e3, 1),
        ("edge_mpc", MICROCONTROLLER, 16e3, 1),
        ("finite_set_mpc", FPGA, 18e3, 1),
        ("finite_set_mpc", FPGA, 18e3, 3),
        ("finite_set_mpc", Timing(10e-6, delay=1, adc_bits=12, encoder_counts=4096), 20e3, 1),
    ]
    for law, timing, f, horizon in cells:
        for name, point in points.items():
            y = figures(
                controller(law, point, timing, f, horizon=horizon), point, timing, periods=30
            )
            sampling = f"{timing.T_s * 1e6:.0f} us, {timing.delay}"
            values = f"{100 * y.error_rms:.2f} % | {100 * y.ripple_pp:.1f} % | {y.i_rms:.2f} A"
            reached = f"{y.f_switch / 1e3:.1f} kHz"
            print(
                f"| {law} {horizon} | {sampling} | {name} | {values} | {f / 1e3:.0f} | {reached} |"
            )


if __name__ == "__main__":
    main()
    over_speed()
    single_figures()
