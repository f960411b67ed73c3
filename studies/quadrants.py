"""Question: which law holds its torque where, motoring and braking, up to three times base speed?

    python studies/quadrants.py [--out DIR] [--machine NAME] [--seed N ...] [--law NAME]
                                [--drive DRIVE.toml]

At 0.1 to 3 times base speed each law is asked for 20, 50 and 80 % of the greatest torque without
ripple at that speed (`reluctance limit`), of either sign. Base speed is the greatest at which that
torque is 95 % of the one at standstill. Everything is by rule: a drive is set up for one speed and
for 80 % of the limit, and no key is tuned. Ideal sensors; the shaft turns forwards: backwards the
figures are the same with both signs changed (`tests/drive/test_quadrants.py`).

--machine onelab_6_4_pairs runs a machine whose phases couple, with the limit of its pairs
(docs/control/coupled).

--drive takes a drive file's machine, voltage, sensors and law instead of the study's.

Writes quadrants.csv, one row a run: error of the mean over the torque asked for, rms ripple over
the mean, rms current over the limit's (the least for this torque without ripple), switching
frequency. `limit_conducts` is the part of the period in which the limit's phase has current: 1 says
that torque without ripple needs a current that never ends. `bound` is what |mean_error| must stay
within, `holds` whether it does. A drive that is refused at set-up has a row that does not hold,
with the reason in `refused`. Writes quadrants_summary.csv, one row for each law and speed,
and quadrants.png.
"""

from __future__ import annotations

import argparse
import csv
import tempfile
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path
from typing import Literal

import numpy as np
from drawn_machine import drawn_machine
from quadrants_plot import plot

import reluctance as rl
from reluctance.base.errors import ParameterError
from reluctance.base.units import from_si
from reluctance.drive.drive import Drive
from reluctance.drive.plausible import corner_speed
from reluctance.machine.optimum import best_profile, torque_speed_envelope

ROOT = Path(__file__).parents[1]
SEED = 2026  # of the machine that nobody tuned
NAN = float("nan")
ALL = "all"
MACHINES = {  # and their dc-link voltage [V]
    "paper_6_4": 240.0,
    "generic_60kw_6_4": 240.0,
    "generic_1hp_8_6": 240.0,
    f"random_{SEED}": None,  # drawn with the machine
}
# One whose phases couple, and the same uncoupled; the voltage of studies/coupling.py [V].
COUPLED = {"onelab_6_4": 285.0, "onelab_6_4_pairs": 285.0}
PERIODS = {  # control period [us]: those of the examples, PWM as fast as deadbeat
    "angles": 20,
    "pwm_current": 20,
    "torque_sharing": 20,
    "deadbeat": 20,
    "ditc": 5,
    "paper_mpc": 20,
    "finite_set_mpc": 2,
    "edge_mpc": 20,
}
BANDS = ("angles", "torque_sharing", "paper_mpc")  # laws that hold a current in a band
BAND = 1 / 150  # of i_max, half width: 1 A on the paper's machine, as in the examples
SPEEDS: tuple[float, ...] = (0.1, 0.5, 1.0, 1.5, 2.0, 3.0)  # of base speed
TORQUES = (0.2, 0.5, 0.8)  # of the limit
BOUNDS = {0.2: 0.02, 0.5: 0.01, 0.8: 0.02}  # of the mean; none is promised at 20 %
FULL = 0.95  # of the torque at standstill: base speed has it
CONDUCTS = 0.01  # of the peak: less is no current
RUN = 16  # electrical periods, the second half of which counts ...
SHORTEST = 0.2  # ... and the shortest run [s]


@dataclass(frozen=True)
class Row:
    """One law at one point."""

    machine: str
    law: str
    quadrant: str  # motoring or braking
    speed_part: float
    torque_part: float
    speed_rpm: float
    tau_ref_Nm: float
    mean_error: float
    ripple_rms: float
    i_over_limit: float
    limit_conducts: float
    f_switch_Hz: float
    efficiency: float
    bound: float
    holds: int
    refused: str  # why the drive cannot be set up; empty where it can


def number(figure: float | None) -> float:
    """A key figure; NaN where it has no meaning."""
    return NAN if figure is None else figure


@dataclass(frozen=True)
class Point:
    """A run of the study before it is made."""

    drive: Drive
    machine: str
    law: str
    quadrant: str
    speed_part: float
    torque_part: float
    i_limit: float  # [A]
    limit_conducts: float

    @property
    def length(self) -> float:
        """Of the run [s]."""
        period = 2 * np.pi / (self.drive.machine.N_r * self.drive.omega_nominal)
        return float(max(RUN * period, SHORTEST))

    def row(self, run: rl.Kpis | ParameterError) -> Row:
        """What it gave."""
        tau = float(self.drive.reference.course[1][0])
        bound = BOUNDS[self.torque_part]
        k = run if isinstance(run, rl.Kpis) else None
        error = NAN if k is None else k.tau_mean / tau - 1
        return Row(
            machine=self.machine,
            law=self.law,
            quadrant=self.quadrant,
            speed_part=self.speed_part,
            torque_part=self.torque_part,
            speed_rpm=from_si(self.drive.omega_nominal, "rpm"),
            tau_ref_Nm=tau,
            mean_error=error,
            ripple_rms=NAN if k is None else number(k.torque_ripple_rms),
            i_over_limit=NAN if k is None else k.i_rms / self.i_limit,
            limit_conducts=self.limit_conducts,
            f_switch_Hz=NAN if k is None else k.f_switch,
            efficiency=NAN if k is None else number(k.efficiency),
            bound=bound,
            holds=int(abs(error) <= bound),
            refused="" if k is not None else " ".join(str(run).split()),
        )


@dataclass(frozen=True)
class Bench:
    """A machine on its dc link, and its law where a drive file gives one."""

    name: str
    overrides: tuple[str, ...]  # machine and voltage
    file: Path = ROOT / "examples" / "sharing_cubic.toml"
    own_law: bool = False
    settings: tuple[str, ...] = ()  # of every drive, after those of its law

    def drive(self, law: str, speed_rpm: float, tau: float, tau_max: float) -> Drive:
        """A law at one point, by rule."""
        point = [
            *self.overrides,
            "load.kind=locked",
            f"load.speed_rpm={speed_rpm!r}",
            "reference.kind=torque",
            f"reference.tau_Nm={tau!r}",
            f"control.tau_max_Nm={tau_max!r}",
            "simulation.until_s=10",
        ]
        if not self.own_law:
            band = self.at_rest().machine.i_max_A * BAND
            point += [f"control.law={law}", f"control.T_s_us={PERIODS[law]}"]
            point += [f"control.i_band_A={band!r}"] if law in BANDS else []
        return rl.load(self.file, [*point, *self.settings])

    def at_rest(self) -> Drive:
        """The machine and its voltage; the law does not matter."""
        return _loaded(self.file, self.overrides)


@cache
def _loaded(file: Path, overrides: tuple[str, ...]) -> Drive:
    return rl.load(file, list(overrides))


def bench(name: str, folder: Path) -> Bench:
    """One of MACHINES or COUPLED, or drawn from another seed; a drawn one is written to the
    folder."""
    machine, u_dc = name, {**MACHINES, **COUPLED}.get(name)
    if u_dc is None:
        text, u_dc = drawn_machine(int(name.removeprefix("random_")))
        machine = str(folder / f"{name}.toml")
        Path(machine).write_text(text, encoding="utf-8")
    return Bench(name, (f"machine={machine}", f"converter.u_dc_V={u_dc}", "reference.tau_Nm=0.01"))


def limits(drive: Drive, omega: list[float], direction: Literal[1, -1]) -> list[float]:
    """Greatest torque without ripple at speeds [N m]."""
    points = 60 * drive.machine.n_phases
    found = torque_speed_envelope(drive.at(0.0), omega, n_points=points, direction=direction)
    return [float(tau) for tau in found.tau_max]


def base_speed(drive: Drive) -> float:
    """[rad/s], to 1 % of the speed at which the whole flux just fits in half a period."""
    corner = corner_speed(drive.machine, drive.converter.u_dc_V)
    speeds = np.linspace(0, 1, 26) * corner
    tau = np.array(limits(drive, speeds.tolist(), 1))
    past = int(np.argmax(tau < FULL * tau[0]))
    part = np.interp(-FULL * tau[0], -tau[past - 1 : past + 1], [past - 1, past]) / 25
    return float(round(part, 2) * corner)


def points(at: Bench, laws: list[str]) -> Iterator[Point]:
    """The runs on a machine."""
    rest = at.at_rest()
    omega = base_speed(rest)
    directions: dict[str, Literal[1, -1]] = {"motoring": 1, "braking": -1}
    for quadrant, direction in directions.items():
        most = limits(rest, [part * omega for part in SPEEDS], direction)
        for speed, tau_limit in zip(SPEEDS, most, strict=True):
            rpm = float(f"{from_si(speed * omega, 'rpm'):.6g}")
            top = float(f"{max(TORQUES) * abs(tau_limit):.5g}")
            for part in TORQUES:
                tau = float(f"{tau_limit * part:.5g}")
                count = 60 * rest.machine.n_phases
                best = best_profile(rest.at(speed * omega), tau, n_points=count)
                for law in laws:
                    yield Point(
                        drive=at.drive(law, rpm, tau, top),
                        machine=at.name,
                        law=law,
                        quadrant=quadrant,
                        speed_part=speed,
                        torque_part=part,
                        i_limit=best.i_rms,
                        limit_conducts=float(np.mean(best.i > CONDUCTS * best.i_peak)),
                    )


def study(at: Bench, laws: list[str]) -> list[Row]:
    """All rows of a machine."""
    return run_all(list(points(at, laws)))


def run_all(listed: list[Point]) -> list[Row]:
    """What the runs of some points gave."""
    found: dict[int, Row] = {}
    for until in sorted({point.length for point in listed}):
        those = [n for n, point in enumerate(listed) if point.length == until]
        runs = rl.simulate_all((listed[n].drive for n in those), until=until)
        found |= {n: listed[n].row(k) for n, k in zip(those, runs, strict=True)}
    return [found[n] for n in range(len(listed))]


def summary(rows: list[Row]) -> Iterator[str]:
    """A line for each law and quadrant: errors of the mean in percent, speed by speed."""
    for law in dict.fromkeys(row.law for row in rows):
        for quadrant in ("motoring", "braking"):
            mine = [r for r in rows if (r.law, r.quadrant) == (law, quadrant)]
            cells = []
            for speed in SPEEDS:
                here = [r for r in mine if r.speed_part == speed]
                cells.append(
                    " ".join(f"{100 * r.mean_error:6.2f}{' ' if r.holds else '*'}" for r in here)
                )
            yield f"{law:15s} {quadrant:8s} | " + " | ".join(cells)
            cells = []
            for speed in SPEEDS:
                here = [r for r in mine if r.speed_part == speed]
                cells.append(" ".join(f"{100 * r.ripple_rms:6.2f} " for r in here))
            yield f"{'':15s} {'ripple':>8s} | " + " | ".join(cells)


def summed(rows: list[Row]) -> list[dict[str, float | str]]:
    """A row for each law and speed, for each law, and for all, over machines, quadrants and
    torques. Promised are the means at 50 and 80 % of the limit's torque."""
    found: list[dict[str, float | str]] = []
    speeds: list[float | str] = [*dict.fromkeys(row.speed_part for row in rows), ALL]
    for law in [*dict.fromkeys(row.law for row in rows), ALL]:
        for speed in speeds:
            here = [r for r in rows if law in (r.law, ALL) and speed in (r.speed_part, ALL)]
            half = [r for r in here if r.torque_part == 0.5]
            promised = [r for r in here if r.torque_part > 0.2]
            found.append(
                {
                    "law": law,
                    "speed_part": speed,
                    "points": len(promised),
                    "held": sum(r.holds for r in promised),
                    "missed": sum(not r.holds for r in promised),
                    "refused": sum(bool(r.refused) for r in promised),
                    "worst_50": float(np.nanmax([abs(r.mean_error) for r in half])),
                    "ripple_50": float(np.nanmedian([r.ripple_rms for r in half])),
                    "i_over_limit_50": float(np.nanmedian([r.i_over_limit for r in half])),
                    "f_switch_50_Hz": float(np.nanmedian([r.f_switch_Hz for r in half])),
                }
            )
    return found


def written(path: Path, rows: list[dict[str, float | str]]) -> None:
    """A table of four digits; what has no meaning is empty."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, list(rows[0]), lineterminator="\n")
        writer.writeheader()
        for row in rows:
            writer.writerow({k: shown(v) for k, v in row.items()})


def shown(value: float | str) -> str:
    """A cell of the table."""
    if isinstance(value, float):
        return "" if np.isnan(value) else f"{value:.4g}"
    return str(value)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=ROOT / "docs" / "control")
    parser.add_argument("--machine", choices=[*MACHINES, *COUPLED], action="append")
    parser.add_argument("--seed", type=int, nargs="+", help="machines drawn from these seeds")
    parser.add_argument("--law", choices=[*PERIODS], action="append")
    parser.add_argument("--drive", type=Path, help="a drive file instead of the study's machines")
    arguments = parser.parse_args()
    rows: list[Row] = []
    with tempfile.TemporaryDirectory() as folder:
        if arguments.drive is not None:
            law = str(getattr(rl.load(arguments.drive).control, "law"))  # noqa: B009
            benches, laws = [Bench(arguments.drive.stem, (), arguments.drive, own_law=True)], [law]
        else:
            drawn = [f"random_{seed}" for seed in arguments.seed or ()]
            names = [*(arguments.machine or ()), *drawn] or MACHINES
            benches = [bench(name, Path(folder)) for name in names]
            laws = arguments.law or [*PERIODS]
        for at in benches:
            found = study(at, laws)
            base = next(row for row in found if row.speed_part == 1)
            print(f"{at.name}: base speed {base.speed_rpm:.0f} rpm")
            print("\n".join(summary(found)), flush=True)
            rows += found
    out: Path = arguments.out
    out.mkdir(parents=True, exist_ok=True)
    written(out / "quadrants.csv", [asdict(row) for row in rows])
    written(out / "quadrants_summary.csv", summed(rows))
    plot(rows).savefig(out / "quadrants.png", dpi=80, metadata={"Software": None})
    promised = [row for row in rows if row.torque_part > 0.2]
    print(f"{sum(r.holds for r in promised)} of {len(promised)} at 50 and 80 % hold their mean")


if __name__ == "__main__":
    main()
