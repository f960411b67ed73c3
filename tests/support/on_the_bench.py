"""Commissioning of simulated drives with 12-bit sensors and noise: what is found, and how far off.

`python tests/support/on_the_bench.py` writes bench/commission.csv and bench/commission_pairs.csv.
It takes some minutes; with the argument `pairs` it writes only the latter, in two.
"""

import csv
import sys
import tempfile
from dataclasses import dataclass
from itertools import permutations
from pathlib import Path
from typing import Any

import numpy as np

import reluctance as rl
from reluctance import _core
from reluctance.machine.coupling import Coupling
from reluctance.machine.held_pulses import HeldPulse, read_held_pulses
from reluctance.machine.identify_pairs import (
    PairFactor,
    pair_factor,
    pair_torque,
    smooth_currents,
)
from reluctance.machine.maps import identify, read_pulses, surface
from reluctance.machine.measured_pairs import Measured, kinds_of, measured_pairs
from reluctance.targets.commission import Held, Wires, commission, write_pulses

ROOT = Path(__file__).parents[2]
NOISE_LSB = 8.0  # rms
COUNTS = 4096  # of the encoder
FRICTION = 0.02  # dry, of the greatest torque
ANGLES, PULSES = 31, 8  # clamped positions from unaligned to aligned, and pulses at each
POSITIONS, CURRENTS, BESIDE = 12, (0.25, 0.5, 0.75), 2  # beside a held phase: of i_max, and pulses
TABLE_POSITIONS, TABLE_CURRENTS = 24, (0.1, 0.25, 0.4, 0.55, 0.7, 0.85)  # for a pair table
BELIEVED = 0.8  # of what the pairs are
MACHINES = {  # example, and what makes it fit the machine
    "paper_6_4": ("paper_rated", {}),
    "npf_vector_6_4": ("paper_rated", {"reference.tau_Nm": 5.0}),
    "generic_1hp_8_6": (
        "edge_mpc_mcu",
        {"reference.tau_Nm": 2, "control.tau_max_Nm": 2.2, "sensing.i_range_A": 8.0},
    ),
    "guc_linear_6_4": ("paper_rated", {"reference.tau_Nm": 2.0}),
}
CONVERTERS = {
    "ideal": {"sensing.delay_samples": 0},
    "real": {
        "converter.dead_time_us": 1.0,
        "converter.v_switch_V": 1.5,
        "converter.v_diode_V": 1.0,
        "sensing.delay_samples": 1,
    },
}


def bench_drive(machine: str, converter: str = "ideal", **more: Any) -> rl.Drive:
    """A drive with 12-bit current sensors and noise, 0.5 % of noise on the dc voltage."""
    example, fitted = MACHINES[machine]
    drive = rl.load(ROOT / "examples" / f"{example}.toml").with_values(
        {"machine": machine, **fitted}
    )
    return sensed(drive, converter, **more)


def sensed(drive: rl.Drive, converter: str = "ideal", **more: Any) -> rl.Drive:
    """The drive with these sensors."""
    return drive.with_values(
        {
            "sensing.adc_bits": 12,
            "sensing.i_range_A": 1.6 * drive.machine.i_max_A,
            "sensing.i_noise_LSB": NOISE_LSB,
            "sensing.u_dc_noise_V": 0.005 * drive.converter.u_dc_V,
            "sensing.encoder_counts": COUNTS,
            **CONVERTERS[converter],
            **more,
        }
    )


@dataclass(frozen=True)
class MapFound:
    """A map from pulses held against the plant's own."""

    R: float  # measured before [ohm]
    R_closing: float  # [ohm]
    torque_error: float  # rms over the field of angle and current, of the rms torque [1]
    psi_error: float  # likewise
    time_s: float  # of all pulses


def map_from_pulses(drive: rl.Drive, *, angles: int = ANGLES, pulses: int = PULSES) -> MapFound:
    """Resistance, then pulses at clamped angles, written and read as a CSV file, then the map."""
    R = float(np.mean(commission(drive, "resistance", clamped=True).R))
    found = [
        commission(
            drive.with_values({"sensing.noise_seed": n + 1}),
            "pulses",
            pulses=pulses,
            theta_e_deg=float(theta),
        )
        for n, theta in enumerate(np.linspace(0, 180, angles))
    ]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "pulses.csv"
        write_pulses(path, found, drive)
        identified = identify(read_pulses([path]), N_r=drive.machine.N_r, R=R)
    assert identified.R_closing is not None
    i, theta_e = np.meshgrid(
        np.linspace(0.02, 1, 40) * drive.machine.i_max_A, np.linspace(0, np.pi, 121)
    )
    ours, true = (
        _core.magnetics(machine, i.ravel(), theta_e.ravel())
        for machine in (surface(identified.table), drive.machine.magnetics)
    )
    psi, _, tau = np.sqrt(np.mean((ours - true) ** 2, axis=0) / np.mean(true**2, axis=0))[:3]
    return MapFound(
        R, identified.R_closing, float(tau), float(psi), sum(run.time_s for run in found)
    )


@dataclass(frozen=True)
class PairsFound:
    """The factor of a drive's pairs on what was believed of them, and the time of all pulses."""

    of: PairFactor
    time_s: float


def beside_held(
    drive: rl.Drive, positions: int, currents: tuple[float, ...], pulses: int, seed: int
) -> tuple[tuple[HeldPulse, ...], float]:
    """Pulses beside a held phase over a period, of one pair of each kind, written and read as a CSV
    file; and the time of all."""
    machine, found = drive.machine, []
    assert machine.coupling is not None
    for pair in {pair.table: pair for pair in machine.coupling.pairs}.values():
        for angle in 360 * np.arange(positions) / positions:
            for part in currents:
                noise = drive.with_values({"sensing.noise_seed": seed + len(found)})
                held = Held(pair.second, part * machine.i_max_A)
                asked = {"phase": pair.first, "pulses": pulses, "theta_e_deg": float(angle)}
                found.append(commission(noise, "pulses", held=held, **asked))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "pulses.csv"
        write_pulses(path, found, drive)
        recorded = read_held_pulses([path], n_phases=machine.n_phases)
    return recorded, sum(run.time_s for run in found)


def pairs_from_pulses(
    drive: rl.Drive,
    believed: Coupling,
    *,
    positions: int = POSITIONS,
    currents: tuple[float, ...] = CURRENTS,
    pulses: int = BESIDE,
    seed: int = 1,
) -> PairsFound:
    """The factor from few positions and currents."""
    recorded, time_s = beside_held(drive, positions, currents, pulses, seed)
    machine = drive.machine
    return PairsFound(pair_factor(recorded, believed, machine.magnetics, machine.R), time_s)


def table_from_pulses(drive: rl.Drive, seed: int = 1) -> Measured:
    """Pair tables from many."""
    recorded, _ = beside_held(drive, TABLE_POSITIONS, TABLE_CURRENTS, BESIDE, seed)
    machine = drive.machine
    return measured_pairs(
        recorded,
        kinds_of(machine.coupling, recorded),
        machine.magnetics,
        R=machine.R,
        n_phases=machine.n_phases,
        i_max=machine.i_max_A,
    )


def torque_of_table(drive: rl.Drive, found: Measured) -> tuple[float, float]:
    """Error of its torque at the currents of a smooth one, and the standard error, of the greatest
    torque, rms [%]."""
    true = drive.machine.coupling
    assert true is not None
    i, theta_e = smooth_currents(drive.at(drive.omega_nominal), drive.tau_max)
    off = found.coupling.tau(i, theta_e) - true.tau(i, theta_e)
    both = float(np.sqrt((off**2).mean())), found.torque_error(i, theta_e)
    return 100 * both[0] / drive.tau_max, 100 * both[1] / drive.tau_max


def arrangements(n_phases: int) -> list[tuple[tuple[int, ...], int]]:
    """Every order of the phases, with an encoder of either direction."""
    return [(order, way) for order in permutations(range(n_phases)) for way in (1, -1)]


@dataclass(frozen=True)
class ZeroFound:
    """What `alignment` made of one wiring."""

    right: bool  # order of the phases and direction of the encoder
    error_counts: float  # of the zero, in counts of the encoder
    spread_counts: float  # as the routine tells it
    time_s: float


def alignment_of(
    drive: rl.Drive, order: tuple[int, ...], way: int, *, zero_deg: float, friction_Nm: float = 0.0
) -> ZeroFound:
    """Order, direction and zero of a drive that somebody has wired so."""
    n = drive.machine.n_phases
    wires = Wires(phase=order, sensor=order, direction=way, zero_deg=zero_deg)
    found = commission(drive, "alignment", wires=wires, friction_Nm=friction_Nm)
    place = tuple((order[k] - order[0]) * way % n for k in range(n))
    direction = {tuple(range(n)): 1, tuple(-k % n for k in range(n)): -1}.get(place, 0)
    unaligned = way * 360 * order[0] / n + zero_deg
    error = (found.zero_deg - unaligned + 180) % 360 - 180
    count = 360 * drive.machine.N_r / COUNTS
    return ZeroFound(
        right=found.done and found.place == place and found.direction == direction,
        error_counts=abs(error) / count,
        spread_counts=found.spread_deg / count,
        time_s=found.time_s,
    )


def _worst(zeros: list[ZeroFound]) -> float | None:
    """Greatest error of the zero [counts]; None where one was not found."""
    if not all(zero.right for zero in zeros):
        return None
    return round(max(zero.error_counts for zero in zeros), 3)


def _row(machine: str, converter: str) -> dict[str, Any]:
    drive = bench_drive(machine, converter)
    by_pulses = map_from_pulses(drive)
    all_ways = arrangements(drive.machine.n_phases)
    if converter == "real":  # the ways of the first orders: the converter does not know them
        all_ways = all_ways[:4]
    zeros = [
        alignment_of(drive, order, way, zero_deg=37.0 + 11 * n)
        for n, (order, way) in enumerate(all_ways)
    ]
    rough = alignment_of(drive, *all_ways[0], zero_deg=37.0, friction_Nm=FRICTION * drive.tau_max)
    return {
        "machine": machine,
        "converter": converter,
        "u_dc_V": drive.converter.u_dc_V,
        "noise_A": round(drive.sensing.i_noise, 4),
        "R_ohm": drive.machine.R,
        "R_error_pct": round(100 * (by_pulses.R / drive.machine.R - 1), 3),
        "R_closing_error_pct": round(100 * (by_pulses.R_closing / drive.machine.R - 1), 3),
        "psi_error_pct": round(100 * by_pulses.psi_error, 3),
        "torque_error_pct": round(100 * by_pulses.torque_error, 3),
        "pulses_s": round(by_pulses.time_s, 2),
        "wirings": len(zeros),
        "wirings_found": sum(zero.right for zero in zeros),
        "zero_error_counts": _worst(zeros),
        "friction_Nm": round(FRICTION * drive.tau_max, 4),
        "zero_error_friction_counts": _worst([rough]),
        "alignment_s": round(max(zero.time_s for zero in zeros), 1),
    }


def row_of_pairs(machine: str, pairs: str, drive: rl.Drive) -> dict[str, Any]:
    """The factor that is found where pairs are believed 20 % too small, and what it helps."""
    coupling = drive.machine.coupling
    assert coupling is not None
    measured = sensed(drive, "real")
    found = pairs_from_pulses(measured, coupling.times(BELIEVED))
    of, tau = found.of, drive.tau_max
    factor = BELIEVED * of.factor

    def law(believed: float) -> float:
        known = drive.with_values({"mismatch.pair_factor": believed})
        return 100 * (rl.simulate(known, until=0.12, record=None).kpis.torque_error_rms or np.nan)

    pair_part = pair_torque(drive.at(drive.omega_nominal), tau) / tau
    table: list[float | None] = [None, None]
    if pairs == "groups":  # of both kinds
        table = [round(x, 3) for x in torque_of_table(drive, table_from_pulses(measured))]
    return {
        "machine": machine,
        "pairs": pairs,
        "u_dc_V": drive.converter.u_dc_V,
        "tau_Nm": tau,
        "believed": BELIEVED,
        "found": round(factor, 4),
        "error_pct": round(100 * (factor - 1), 2),
        "standard_error_pct": round(100 * BELIEVED * of.error, 2),
        "psi_pairs_mWb": round(1e3 * of.psi_rms / BELIEVED, 3),
        "residual_mWb": round(1e3 * of.residual, 3),
        "pair_torque_pct": round(100 * pair_part, 2),
        "expected_before_pct": round(100 * (1 - BELIEVED) * pair_part, 3),
        "expected_after_pct": round(100 * abs(1 - factor) * pair_part, 3),
        "torque_error_before_pct": round(law(BELIEVED), 3),
        "torque_error_after_pct": round(law(factor), 3),
        "torque_error_exact_pct": round(law(1.0), 3),
        "table_torque_pct": table[0],
        "table_standard_error_pct": table[1],
        "pulses": of.n_pulses,
        "pulses_s": round(found.time_s, 1),
    }


def _rows_of_pairs() -> list[dict[str, Any]]:
    """Of the machines and the law of docs/control/coupling.md."""
    sys.path.insert(0, str(ROOT / "studies"))
    import coupling

    with tempfile.TemporaryDirectory() as folder:
        return [
            row_of_pairs(title, at.kind, coupling.drive(at, "edge_mpc_mcu", 1.0))
            for title in coupling.MACHINES
            for at in coupling.points(title, Path(folder))
        ]


def _write(name: str, rows: list[dict[str, Any]]) -> None:
    with (ROOT / "bench" / name).open("w", newline="") as file:
        writer = csv.DictWriter(file, rows[0], lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


def main() -> None:
    _write("commission_pairs.csv", _rows_of_pairs())
    if "pairs" not in sys.argv:
        rows = [_row(machine, converter) for machine in MACHINES for converter in CONVERTERS]
        _write("commission.csv", rows)


if __name__ == "__main__":
    main()
