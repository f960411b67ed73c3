"""`reluctance emulate`: a package on the emulated board, one step of its README at a time."""

import json
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from reluctance import load
from reluctance.base.errors import ParameterError
from reluctance.base.files import check_ending, write_whole
from reluctance.cli.options import AsJson, Overrides, Trust
from reluctance.cli.progress import progress_bar

if TYPE_CHECKING:
    from reluctance.targets.commission.bench import Found, Held
    from reluctance.targets.commission.board import Emulated
    from reluctance.targets.commission.wiring import Wiring

STEPS = ("precharge", "wiring", "resistance", "alignment", "pulses", "spin", "trip")
CORRECTING = ("wiring", "alignment")
UNPAIRED = (
    "the phases couple, and the map is of one alone: `reluctance map import --pairs DRIVE.toml` "
    "takes the pairs over"
)
ZERO = (
    "where the zero is off, it names the angle of alignment, --aligned_at A: add N_r A - 180 "
    "degrees to WIRING_ZERO_RAD, in rad"
)
Progress = Callable[[float], None]


def emulate(
    package: Annotated[
        Path, typer.Argument(metavar="PACKAGE", help="Folder that `export firmware` wrote.")
    ],
    step: Annotated[str, typer.Argument(metavar="STEP", help=f"One of {', '.join(STEPS)}.")],
    drive_file: Annotated[
        Path,
        typer.Option(
            "--drive",
            metavar="DRIVE.toml",
            help="Drive file of the real machine, converter and sensors.",
        ),
    ],
    overrides: Overrides = None,
    trust: Trust = False,
    wires: Annotated[
        Path | None, typer.Option(metavar="WIRES.toml", help="How the board is wired.")
    ] = None,
    correct: Annotated[
        bool, typer.Option("--correct", help="Write what was found into emulated/wiring.h.")
    ] = False,
    angles: Annotated[
        int, typer.Option(metavar="N", min=2, help="Number of clamped positions.")
    ] = 31,
    pulses: Annotated[int, typer.Option(metavar="N", min=1, help="Pulses at each position.")] = 8,
    phase: Annotated[int, typer.Option(metavar="K", min=0, help="Phase that is pulsed.")] = 0,
    held: Annotated[
        int | None,
        typer.Option(metavar="K", min=0, help="Phase that is held at --held_A meanwhile."),
    ] = None,
    held_A: Annotated[
        float | None, typer.Option("--held_A", metavar="AMPERE", help="Current of the held phase.")
    ] = None,
    whole_period: Annotated[
        bool,
        typer.Option(
            "--whole-period", help="Angles of `pulses` over a whole period: the zero is not known."
        ),
    ] = False,
    out: Annotated[
        Path | None, typer.Option(metavar="PULSES.csv", help="Recording that `pulses` writes.")
    ] = None,
    reference: Annotated[
        float | None, typer.Option(metavar="X", help="Reference of `spin` and `trip` [N m or rpm].")
    ] = None,
    until: Annotated[
        float | None,
        typer.Option(
            metavar="SECONDS", min=0.2, help="Duration of `spin`; by default until the speed limit."
        ),
    ] = None,
    cpu: Annotated[str, typer.Option(help="cortex-m4 or cortex-m7, emulated.")] = "cortex-m7",
    as_json: AsJson = False,
) -> None:
    """Take a package into operation on the emulated board. Step by step."""
    from reluctance.targets.commission import Held, Wires, emulated, read_wires
    from reluctance.targets.commission.bench import pair_of
    from reluctance.targets.export.target import known_cpu

    if step not in STEPS:
        raise ParameterError(f"step `{step}`, need one of: {', '.join(STEPS)}")
    if correct and step not in CORRECTING:
        raise ParameterError(f"--correct goes with {' or '.join(CORRECTING)}, not with `{step}`")
    for name, value, of in (
        ("--out", out, ("pulses",)),
        ("--until", until, ("spin",)),
        ("--reference", reference, ("spin", "trip")),
        ("--held", held, ("pulses",)),
        ("--held_A", held_A, ("pulses",)),
        ("--whole-period", whole_period or None, ("pulses",)),
    ):
        if value is not None and step not in of:
            raise ParameterError(f"{name} goes with {' or '.join(of)}, not with `{step}`")
    drive = load(drive_file, overrides, trust=trust)
    if phase >= drive.machine.n_phases:
        raise ParameterError(f"--phase {phase}, need less than {drive.machine.n_phases}")
    if (held is None) != (held_A is None):
        raise ParameterError("--held and --held_A go together: a phase and its current")
    beside = None if held is None or held_A is None else Held(held, held_A)
    pair_of(phase, beside, drive.machine.n_phases)
    if step == "pulses":
        if out is None:
            raise ParameterError("`pulses` needs --out PULSES.csv")
        check_ending(out, {".csv"})
    on = emulated(package, drive, read_wires(wires) if wires else Wires(), known_cpu(cpu))
    with progress_bar(step, 1.0) as progress:
        found, lines = _step(
            on,
            step,
            progress,
            (angles, pulses, phase, beside, whole_period),
            out,
            reference=reference,
            until=until,
        )
    if correct and found["done"]:
        lines += _corrected(on, step, found)
    if as_json:
        print(json.dumps(found))
    elif lines:
        print("\n".join(lines), flush=True)
    if not found["done"]:
        raise ParameterError(f"{step}: {found['text']}{_hint(package, step)}")


def _step(
    on: "Emulated",
    step: str,
    progress: Progress,
    recording: "tuple[int, int, int, Held | None, bool]",
    out: Path | None,
    *,
    reference: float | None,
    until: float | None,
) -> tuple[dict[str, Any], list[str]]:
    """What a step found, and the lines that tell it."""
    from reluctance.targets.commission import steps, write_pulses

    if step == "precharge":
        up = steps.precharge(on)
        return asdict(up), [
            *_states(up.states),
            *([f"offsets [A]: {_numbers(up.offset, '.3f')}"] if up.done else []),
        ]
    if step == "spin":
        turn = steps.spin(on, reference=reference, until=until, progress=progress)
        return asdict(turn), [
            *_states(turn.states),
            f"{turn.speed_rpm:.0f} rpm at the end, {turn.fastest_rpm:.0f} rpm at most; "
            f"greatest current {turn.i_peak:.1f} A",
        ]
    if step == "trip":
        all_trips = steps.trips(on, reference=reference)
        good = all(t.off and t.stays and t.clears for t in all_trips)
        text = "all stop the drive" if good else "a cause does not stop the drive as it must"
        if not all_trips[-1].began:
            text = all_trips.pop().text
        return {"done": good, "text": text, "trips": [asdict(t) for t in all_trips]}, [
            f"{t.what}: {'legs off' if t.off else 'LEGS ARE ON'} after {t.late_us:.0f} us, "
            f"{t.text}; "
            f"{'stays' if t.stays else 'DOES NOT STAY'}, "
            f"{'clears once the cause is gone' if t.clears else 'DOES NOT CLEAR'}"
            for t in all_trips
        ]
    if step == "pulses":
        assert out is not None
        angles, pulses, phase, held, whole_period = recording
        runs = steps.recordings(
            on,
            angles=angles,
            pulses=pulses,
            phase=phase,
            held=held,
            whole_period=whole_period,
            progress=progress,
        )
        write_whole(out, lambda path: write_pulses(path, runs, on.drive))
        n_rows = sum(len(run.rows) for run in runs)
        return {"done": True, "text": "done", "angles": angles, "rows": n_rows, "file": str(out)}, [
            f"{out}: {pulses} pulses at each of {angles} angles, {n_rows} rows",
            f"next: reluctance map identify {out} --R_ohm R "
            + (
                f"--N_r {on.drive.machine.N_r} --out map.csv"
                if held is None
                else "--pairs DRIVE.toml"
            ),
            *([ZERO] if whole_period and held is None else []),
            *([UNPAIRED] if held is None and on.drive.machine.coupled else []),
        ]
    one = steps.routine(on, step, progress=progress)
    values = {k: v for k, v in asdict(one).items() if k != "rows"}
    return values, _lines(step, one) if one.done else []


def _lines(step: str, found: "Found") -> list[str]:
    """What a routine found, and what to do about it."""
    legs = range(len(found.sensor))
    if step == "wiring":
        straight = found.sensor == tuple(legs) and set(found.sign) == {1}
        return [
            *(f"leg {k}: sensor {found.sensor[k]}, sign {found.sign[k]:+d}" for k in legs),
            "as it must be" if straight else "correct sensors and signs, then run `wiring` again",
        ]
    if step == "resistance":
        mean = sum(found.R) / len(found.R)
        return [f"R [ohm]: {_numbers(found.R, '.4f')}; mean {mean:.4f}"]
    what = {
        1: "subtract the zero from the angle",
        -1: "the angle counts against the order of the legs. Where the direction of rotation is "
        "chosen, exchange two legs with their sensors; else count the other way, and the zero is "
        "then minus this",
        0: "the legs are in another order: exchange them, and run `alignment` again",
    }[found.direction]
    near = (found.zero_deg + 180) % 360 - 180
    return [
        f"place of legs {_numbers(legs, 'd')}: {_numbers(found.place, 'd')}",
        f"direction {found.direction:+d}, zero {near:.3f} deg electrical, "
        f"spread {found.spread_deg:.3f} deg",
        "as it must be"
        if found.direction == 1 and abs(near) <= max(found.spread_deg, 0.05)
        else what,
    ]


def _hint(package: Path, step: str) -> str:
    """What may be behind a step that fails, and what to do then."""
    from reluctance.targets.commission import wiring

    if step in ("precharge", "wiring"):
        return ""
    flat = "; where the inductance is flat around alignment, take the zero from `pulses` with "
    flat += "--whole-period (docs/commissioning.md)"
    if not wiring.read_wiring(package).straight:
        return flat if step == "alignment" else ""
    done = (
        "was `wiring`" if step in ("resistance", "alignment") else "were `wiring` and `alignment`"
    )
    never = f"; {package / wiring.HEADER} corrects nothing: {done} done?"
    return never + (flat if step == "alignment" else "")


def _corrected(on: "Emulated", step: str, found: dict[str, Any]) -> list[str]:
    """Writes the wiring that follows from a finding."""
    from reluctance.targets.commission import wiring

    now: Wiring = wiring.read_wiring(on.package)
    if step == "wiring":
        now = now.with_sensors(found["sensor"], found["sign"])
    else:
        now = now.with_angle(found["direction"], found["zero_deg"], found["place"])
    wiring.write_wiring(on.package, now)
    return [f"wrote {on.package / wiring.HEADER}:", *(f"  {line}" for line in now.lines())]


def _states(states: list[tuple[float, str]]) -> list[str]:
    return [f"{t:8.4f} s  {name}" for t, name in states]


def _numbers(values: Any, form: str) -> str:
    return ", ".join(format(value, form) for value in values)
