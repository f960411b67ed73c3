"""The closed loop of the guided predictive laws, for their tests and docs/control/best_mpc.md.

`python tests/support/mpc_loop.py` writes bench/mpc_loop.csv and bench/mpc_speed.csv, the numbers of
the page.
"""

from __future__ import annotations

import csv
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from reluctance import _core
from reluctance.drive.laws.flux_guide import FluxGuide
from reluctance.drive.run.columns import Rows
from reluctance.machine.optimum import OperatingPoint, best_profile, profile_table

BENCH = Path(__file__).parents[2] / "bench"
RPM = np.pi / 30
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
TEN = Timing(10e-6, delay=1, adc_bits=12, encoder_counts=4096)
MICROCONTROLLER = replace(TEN, T_s=20e-6)
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
    built_for = (point.machine, point.n_phases, single)
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
        core = _core.edge_mpc(*built_for, psi_slack=guide.psi_slack, **common)
        return _core.Controller(core, _core.Frame())
    core = _core.finite_set_mpc(
        *built_for,
        horizon=horizon,
        w_psi=guide.w_psi,
        feedback=guide.feedback,
        w_i=0.0,
        t_end=pulse**2 / (24 * horizon * timing.T_s),
        **common,
    )
    return _core.Controller(core, _core.Frame())


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
    parts = _core.SimulationParts(
        machine=point.machine,
        R=point.R,
        source=_core.StiffSource(u_dc=_constant(point.u_dc)),
        bridge=_core.AsymmetricBridge(
            device=_core.Devices(v_switch=0.0, R_switch=0.0, v_diode=0.0, R_diode=0.0)
        ),
        shaft=_core.Shaft(J=0.008, omega=_constant(point.rpm * RPM)),
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
        reference=_core.Course(t=t_ref, value=ref),
        theta_m=theta_m,
        resolution=_core.Resolution(
            dt_max=5e-6, scale=_core.Scale(i=100.0, u_dc=point.u_dc), record_every=record_every
        ),
    )
    return _core.Simulation(law, parts)


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


def over_speed() -> list[dict[str, str]]:
    """Rows of bench/mpc_speed.csv: one guide over speed."""
    speeds = (1500, 1800, 2100, 2400, 2550, 2700, 2850, 3000)
    rows = []
    for u_dc, rpm in ((240, 1500), (240, 2250), (240, 2625), (240, 3000), (200, 1500), (200, 2250)):
        limit = best_profile(RATED.at(rpm, u_dc), RATED.tau, norm="rms")
        row = {
            "point": f"{u_dc} V, {rpm} rpm",
            "limit_pct": f"{100 * limit.tau_error_rms / RATED.tau:.3f}",
            "limit_A": f"{limit.i_rms:.2f}",
        }
        for law in ("edge_mpc", "finite_set_mpc"):
            for guide, guide_rpm in (("one", (1500,)), ("eight", speeds)):
                point = replace(RATED, rpm=rpm, u_dc=float(u_dc), guide_rpm=guide_rpm)
                y = figures(controller(law, point, STUDY, 10e3), point, STUDY, periods=30)
                row[f"{law}_{guide}_pct"] = f"{100 * y.error_rms:.3f}"
                row[f"{law}_{guide}_A"] = f"{y.i_rms:.2f}"
        rows.append(row)
    return rows


@dataclass(frozen=True)
class Run:
    """A law at a point, with the name that its row of bench/mpc_loop.csv has."""

    name: str
    point: Point
    timing: Timing
    f_switch: float  # asked for [Hz]
    law: str = "edge_mpc"
    horizon: int = 1

    def row(self) -> dict[str, str]:
        law = controller(self.law, self.point, self.timing, self.f_switch, horizon=self.horizon)
        y = figures(law, self.point, self.timing, periods=30)
        return {
            "run": self.name,
            "error_rms_pct": f"{100 * y.error_rms:.3f}",
            "ripple_pp_pct": f"{100 * y.ripple_pp:.2f}",
            "i_rms_A": f"{y.i_rms:.3f}",
            "asked_kHz": f"{self.f_switch / 1e3:g}",
            "f_switch_kHz": f"{y.f_switch / 1e3:.2f}",
        }


def tabled() -> list[Run]:
    """The first table of the page, and what it leaves out."""
    points = {
        "paper 41.339 N m 1500 rpm": RATED,
        "paper 20.669 N m 1060.7 rpm": HALF,
        "60 kW 80 N m 1500 rpm": Point(80.0, 1500, GENERIC, R=0.05, i_max=200.0),
        "four phases 41.339 N m 1500 rpm": Point(41.339, 1500, PAPER, n_phases=4),
        "8/6, 1 hp, 2 N m 1500 rpm": ONE_HP,
    }
    laws = [
        ("edge_mpc, 2 µs", FPGA, 21e3, "edge_mpc", 1),
        ("edge_mpc, 20 µs late", MICROCONTROLLER, 16e3, "edge_mpc", 1),
        ("finite_set_mpc, 2 µs", FPGA, 18e3, "finite_set_mpc", 1),
        ("finite_set_mpc, horizon 3, 2 µs", FPGA, 18e3, "finite_set_mpc", 3),
        ("finite_set_mpc, 10 µs late", TEN, 20e3, "finite_set_mpc", 1),
    ]
    return [
        Run(f"{name}, {where}", point, timing, f_switch, law, horizon)
        for name, timing, f_switch, law, horizon in laws
        for where, point in points.items()
    ]


def single() -> list[Run]:
    """What the text of the page says beside its tables, of edge_mpc."""
    guides = {"2625 and 3000": (2625, 3000), "2700 and 2850": (2700, 2850), "2812": (2812,)}
    return [
        *(
            Run(f"2812 rpm, guide {name}", replace(RATED, rpm=2812, guide_rpm=rpm), STUDY, 10e3)
            for name, rpm in guides.items()
        ),
        Run("guide smoothed by 0.1", replace(RATED, smoothing=0.1), FPGA, 22e3),
        # about 5, 10, 20 and 40 kHz are reached
        *(
            Run(f"2 µs at {name} kHz", RATED, FPGA, f_switch)
            for name, f_switch in ((5, 5.67e3), (10, 11.3e3), (20, 22.7e3), (40, 45.4e3))
        ),
        Run("20 µs ideal", RATED, Timing(20e-6), 16e3),
        Run("2 µs at 12 kHz", RATED, FPGA, 14e3),
        Run("20 µs late at 15 kHz", RATED, MICROCONTROLLER, 26e3),
    ]


def reserves() -> list[dict[str, str]]:
    """Rows of bench/mpc_reserve.csv: voltage reserve of the guide."""
    speeds = (1500, 2625, 3000)
    found = replace(RATED, guide_rpm=speeds).guide(10e3).reserve
    return [{"rpm": str(rpm), "reserve": f"{r:.3f}"} for rpm, r in zip(speeds, found, strict=True)]


def written(name: str, rows: list[dict[str, str]]) -> None:
    with (BENCH / name).open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, rows[0].keys(), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


def main() -> None:
    written("mpc_loop.csv", [run.row() for run in (*tabled(), *single())])
    written("mpc_speed.csv", over_speed())
    written("mpc_reserve.csv", reserves())


if __name__ == "__main__":
    main()
