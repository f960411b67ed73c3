"""Question: does a law that learns its machine hold the torque, whatever it believes at first?

    python studies/learning.py [--out DIR] [--runs COUNT]

`edge_mpc` and `deadbeat` at 20 us, with one sample of delay, 12-bit currents, 4096 counts, 1 us of
dead time and the drops of the devices, start with a wrong flux map and a wrong resistance. The
table has the mean torque and the ripple from 0.2 s after the start on, with learning and without,
against the same law with the right map. Then a winding that warms, drives in which nothing can be
learned, and many random starts.
"""

from __future__ import annotations

import argparse
import csv
import multiprocessing
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

import reluctance as rl
from reluctance import _core
from reluctance.base.key_figures import definite
from reluctance.base.picture import Picture
from reluctance.drive.run.result import Result
from reluctance.drive.tables.known import Known
from reluctance.explore.comparison.comparison import PROCESSES

EXAMPLES = Path(__file__).parents[1] / "examples"
LAWS = {"edge_mpc": "edge_mpc_learning", "deadbeat": "deadbeat_learning"}
UNTIL = 0.4  # the key figures are those of its second half [s]
COPPER = 3.93e-3  # of the resistance, at 20 degC [1/K]
HOT = 1 + COPPER * 100  # at 120 over that at 20 degC [1]
WARMS = ((0.2, 1.2), (1.0, HOT))  # times [s], factors on the resistance
RUNS, CHUNK = 10_000, 50


@dataclass(frozen=True)
class Point:
    """A machine, what feeds it, and what is asked of it."""

    machine: str
    u_dc_V: float
    i_range_A: float  # of the current converter
    rpm: float
    tau_Nm: float


PAPER = [Point("paper_6_4", 240, 200, 1500, tau) for tau in (41.339, 20.67, -20.0)]
OTHERS = [
    Point("paper_6_4", 240, 200, 500, 20.67),
    Point("paper_6_4", 240, 200, 2250, 20.67),
    Point("generic_60kw_6_4", 300, 600, 1500, 80.0),
    Point("generic_1hp_8_6", 240, 10, 1500, 2.0),
    Point("design_12_8", 300, 150, 1000, 20.0),
    Point("npf_vector_6_4", 560, 50, 1000, 10.0),
]


@dataclass(frozen=True)
class Belief:
    """The control's value over the plant's."""

    flux: float = 1.0
    R: float = 1.0
    unaligned: float = 1.0  # of the unaligned inductance
    saturated: float = 1.0  # of the flux linkage at the last point of the aligned curve


BELIEFS = {
    "right": Belief(),
    "flux +10 %": Belief(flux=1.1),
    "flux -10 %": Belief(flux=0.9),
    "R +20 %": Belief(R=1.2),
    "R -20 %": Belief(R=0.8),
    "flux +10 %, R +20 %": Belief(flux=1.1, R=1.2),
    "flux +10 %, R -20 %": Belief(flux=1.1, R=0.8),
    "flux -10 %, R +20 %": Belief(flux=0.9, R=1.2),
    "flux -10 %, R -20 %": Belief(flux=0.9, R=0.8),
    "unaligned +10 %, saturated -10 %": Belief(unaligned=1.1, saturated=0.9),
    "unaligned -10 %, saturated +10 %": Belief(unaligned=0.9, saturated=1.1),
    "all: flux -10 %, R -20 %, u. +10 %, s. -10 %": Belief(0.9, 0.8, 1.1, 0.9),
    "all: flux +10 %, R -20 %, u. -10 %, s. +10 %": Belief(1.1, 0.8, 0.9, 1.1),
}
FEW = ("right", "flux +10 %, R -20 %", "flux -10 %, R +20 %", "unaligned +10 %, saturated -10 %")


def drive(law: str, point: Point, belief: Belief, *, learn: bool) -> rl.Drive:
    """The drive of the law's example; its map is wrong in its scale only."""
    return rl.load(EXAMPLES / f"{LAWS[law]}.toml").with_values(
        {
            "machine": point.machine,
            "converter.u_dc_V": point.u_dc_V,
            "sensing.i_range_A": point.i_range_A,
            "load.speed_rpm": point.rpm,
            "reference.tau_Nm": point.tau_Nm,
            "mismatch.flux_factor": belief.flux,
            "mismatch.R_factor": belief.R,
            "control.learn": learn,
        }
    )


def known(given: rl.Drive, belief: Belief) -> Known:
    """What the control believes: the shape of the map may be wrong too."""
    it = given.known()
    shape = {"L_u_H": belief.unaligned, "psi_m_Wb": belief.saturated}
    if all(factor == 1 for factor in shape.values()):
        return it
    changed: dict[str, Any] = {key: getattr(it.machine, key) * f for key, f in shape.items()}
    return replace(it, machine=it.machine.computed(**changed))


def run(law: str, point: Point, belief: Belief, *, learn: bool, until: float = UNTIL) -> Result:
    """A run with it."""
    given = drive(law, point, belief, learn=learn)
    controller = given.controller(known(given, belief))
    return rl.simulate(given, until=until, record=None, controller=controller)


@dataclass(frozen=True)
class Row:
    """A law, point and belief, from 0.2 s on; errors are relative."""

    law: str
    machine: str
    rpm: float
    tau_Nm: float
    belief: str
    mean_error: float
    mean_error_without: float  # without learning
    ripple: float  # rms over the mean
    ripple_without: float
    ripple_right: float  # with the right map, without learning
    ripple_ratio: float  # ripple/ripple_right
    f_switch_kHz: float
    f_switch_right_kHz: float
    R_error: float
    aligned: float  # what was learned: factors on the belief
    unaligned: float
    saturated: float
    strokes: int
    state: str


def measured(task: tuple[str, Point, str]) -> Row:
    """One of the table."""
    law, point, name = task
    belief = BELIEFS[name]
    right = run(law, point, Belief(), learn=False).kpis
    without = run(law, point, belief, learn=False).kpis
    result = run(law, point, belief, learn=True)
    found, figures = result.learned, result.kpis
    assert found is not None
    ripple, ripple_right = definite(figures.torque_ripple_rms), definite(right.torque_ripple_rms)
    return Row(
        law=law,
        machine=point.machine,
        rpm=point.rpm,
        tau_Nm=point.tau_Nm,
        belief=name,
        mean_error=figures.tau_mean / point.tau_Nm - 1,
        mean_error_without=without.tau_mean / point.tau_Nm - 1,
        ripple=ripple,
        ripple_without=definite(without.torque_ripple_rms),
        ripple_right=ripple_right,
        ripple_ratio=ripple / ripple_right,
        f_switch_kHz=figures.f_switch / 1e3,
        f_switch_right_kHz=right.f_switch / 1e3,
        R_error=float(found.R[-1]) / result.drive.machine.R - 1,
        aligned=float(found.aligned[-1]),
        unaligned=float(found.unaligned[-1]),
        saturated=float(found.saturated[-1]),
        strokes=int(found.strokes[-1]),
        state=found.state,
    )


def tasks() -> list[tuple[str, Point, str]]:
    """All beliefs at the paper's points, a few elsewhere; a map from a file has no other shape."""
    return [
        *((law, point, name) for law in LAWS for point in PAPER for name in BELIEFS),
        *(
            (law, point, name)
            for law in LAWS
            for point in OTHERS
            for name in FEW
            if not (point.machine == "npf_vector_6_4" and "saturated" in name)
        ),
    ]


def warming(law: str) -> Result:
    """The winding warms from 20 to 120 degC in a second, at the rated point."""
    given = drive(law, PAPER[0], Belief(), learn=True)
    return rl.simulate(given, until=WARMS[0][1] + 0.2, record=None, warming=WARMS)


def lag(result: Result) -> float:
    """Greatest distance of the learned resistance from the true one while it warms [1]."""
    assert result.learned is not None
    true = result.drive.machine.R * np.interp(result.learned.t, *WARMS)
    return float(np.max(np.abs(result.learned.R / true - 1)[result.learned.t > WARMS[0][0]]))


def quiet(name: str) -> Result:
    """A drive in which nothing can be learned."""
    given = drive("edge_mpc", PAPER[0], BELIEFS["flux +10 %, R -20 %"], learn=True)
    changes: dict[str, dict[str, Any]] = {
        "standstill": {"load.speed_rpm": 0.0, "simulation.theta_start_deg": 20.0},
        "no torque": {"reference.tau_Nm": 1e-3, "control.tau_max_Nm": 41.339},
    }
    return rl.simulate(given.with_values(changes[name]), until=UNTIL, record=None)


@dataclass(frozen=True)
class Start:
    """A random plant, start and demand; the control believes the paper's machine."""

    factors: tuple[float, float, float, float]  # of L_u, L_a, psi_m and R: plant over belief
    rpm: float
    tau_Nm: float
    theta_deg: float


def start(seed: int) -> Start:
    """Flux within 10 %, a shape that is off by 10 % besides, resistance within 20 %."""
    draw = np.random.default_rng(seed)
    flux, aligned = draw.uniform(0.9, 1.1), draw.uniform(0.95, 1.05)
    unaligned, saturated = draw.uniform(0.9, 1.1, 2)
    rpm = float(draw.uniform(200, 2000))
    tau = float(draw.uniform(4, 41) if draw.random() < 0.5 else draw.uniform(-30, -4))
    factors = (flux * unaligned, flux * aligned, flux * saturated, float(draw.uniform(0.8, 1.2)))
    return Start(factors, rpm, tau, float(draw.uniform(0, 90)))


@cache
def believed(law: str) -> tuple[rl.Drive, _core.Controller]:
    """The drive that the control is made for. A loop copies its controller."""
    given = drive(law, PAPER[0], Belief(), learn=True)
    if law == "edge_mpc":
        given = given.with_values({"control.guide_speed_rpm": [500.0, 1000.0, 1500.0, 2000.0]})
    return given, given.controller()


def random_run(law: str, seed: int) -> tuple[float, float, float]:
    """Error of the mean torque [1], peak current [A], error of the learned resistance [1]."""
    made, controller = believed(law)
    at = start(seed)
    L_u, L_a, psi_m, R = at.factors
    machine = made.machine
    given = made.with_values(
        {
            "load.speed_rpm": at.rpm,
            "reference.tau_Nm": at.tau_Nm,
            "simulation.theta_start_deg": at.theta_deg,
            "control.tau_max_Nm": made.tau_max,
        }
    )
    plant = machine.computed(
        L_u_H=machine.L_u_H * L_u,  # type: ignore[attr-defined]
        L_a_H=machine.L_a_H * L_a,  # type: ignore[attr-defined]
        psi_m_Wb=machine.psi_m_Wb * psi_m,  # type: ignore[attr-defined]
        R_ohm=machine.R * R,
    )
    strokes = 24 / given.machine.n_phases  # periods
    until = max(0.06, strokes / (at.rpm / 60 * given.machine.N_r))
    result = rl.simulate(
        replace(given, machine=plant), until=until, record=None, controller=controller
    )
    found = result.learned
    assert found is not None
    R_error = float(found.R[-1]) / (machine.R * R) - 1
    return result.kpis.tau_mean / at.tau_Nm - 1, result.kpis.i_peak, R_error


def random_chunk(task: tuple[str, int]) -> list[tuple[float, float, float]]:
    """Some of them."""
    law, first = task
    return [random_run(law, first + n) for n in range(CHUNK)]


def plot(warm: Result) -> Figure:
    """What is learned from a wrong shape, and of a winding that warms."""
    figure = Picture(11, 4)
    shape, heat = figure.subplots(1, 2)
    belief = BELIEFS["unaligned +10 %, saturated -10 %"]
    given = drive("edge_mpc", PAPER[0], belief, learn=True)
    course: list[list[float]] = []
    loop_until(given, known(given, belief), course)
    t, rows = np.array([c[0] for c in course]), np.array([c[1:] for c in course])
    for j, label in enumerate(("resistance", "unaligned", "aligned", "saturated")):
        shape.plot(1e3 * t, rows[:, j], label=label)
    shape.set(xlabel="time (ms)", ylabel="learned over believed", xlim=(0, 150))
    learned = warm.learned
    assert learned is not None
    true = warm.drive.machine.R * np.interp(learned.t, *WARMS)
    heat.plot(learned.t, true, "k--", label="winding")
    heat.plot(learned.t, learned.R, label="learned")
    heat.set(xlabel="time (s)", ylabel="resistance (ohm)")
    for ax in (shape, heat):
        ax.grid(alpha=0.3)
        ax.legend(fontsize=8)
    return figure


def loop_until(given: rl.Drive, it: Known, course: list[list[float]], until: float = 0.15) -> None:
    """Adds time and what is learned, every millisecond."""
    from reluctance.drive.run.plant import closed_loop

    loop = closed_loop(given, given.controller(it), -1.0)
    for t in np.arange(0.001, until, 0.001):
        while loop.advance(float(t)) < t:
            pass
        course.append([float(t), *loop.learned()])


def write(path: Path, rows: list[dict[str, Any]]) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(
            {key: f"{x:.6g}" if isinstance(x, float) else x for key, x in row.items()}
            for row in rows
        )


def summary(law: str, runs: list[tuple[float, float, float]]) -> dict[str, Any]:
    """Of the random runs."""
    error, i_peak, _ = np.array(runs).T
    return {
        "case": f"random {law}",
        "runs": len(runs),
        "value": float(np.max(np.abs(error))),
        "median": float(np.median(np.abs(error))),
        "percentile_99": float(np.percentile(np.abs(error), 99)),
        "i_peak_A": float(i_peak.max()),
        "state": "",
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("out/learning"))
    parser.add_argument("--runs", type=int, default=RUNS, help="random starts, of each law half")
    arguments = parser.parse_args()
    out: Path = arguments.out
    out.mkdir(parents=True, exist_ok=True)
    with multiprocessing.get_context("spawn").Pool(PROCESSES) as pool:
        rows = pool.map(measured, tasks(), chunksize=1)
        write(out / "learning.csv", [vars(row) for row in rows])
        more = []
        for law in LAWS:
            chunks = [(law, n * CHUNK) for n in range(arguments.runs // 2 // CHUNK)]
            runs = [r for chunk in pool.map(random_chunk, chunks, chunksize=1) for r in chunk]
            more.append(summary(law, runs))
    blank = {key: "" for key in more[0]}
    for law in LAWS:
        warm = warming(law)
        more.append({**blank, "case": f"warming {law}", "value": lag(warm)})
    for name in ("standstill", "no torque"):
        found = quiet(name).learned
        assert found is not None
        strokes = float(found.strokes[-1])
        more.append({**blank, "case": name, "value": strokes, "state": found.state})
    write(out / "learning_more.csv", more)
    plot(warming("edge_mpc")).savefig(out / "learning.png", dpi=80, metadata={"Software": None})
    for row in rows:
        print(
            f"{row.law:9s} {row.machine:16s} {row.rpm:5.0f} {row.tau_Nm:7.2f} {row.belief:45s}"
            f" mean {100 * row.mean_error:+6.2f} ({100 * row.mean_error_without:+6.1f}) %"
            f"  ripple x {row.ripple_ratio:.3f}  R {100 * row.R_error:+6.2f} %  {row.state}"
        )
    for each in more:
        print(each)


if __name__ == "__main__":
    main()
