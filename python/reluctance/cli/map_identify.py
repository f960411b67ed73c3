"""`reluctance map identify`: from voltage pulses at standstill to a flux table."""

from pathlib import Path
from typing import Annotated

import typer

from reluctance.base.errors import ParameterError
from reluctance.base.files import check_ending, check_own_table, refuse_input, write_whole
from reluctance.cli.stated_map import (
    AlignedAt,
    AngleKind,
    AngleUnit,
    MaxCurrent,
    RotorPoles,
    Zero,
)


def identify(
    files: Annotated[
        list[Path],
        typer.Argument(
            metavar="PULSES.csv...", help="Time, voltage, current and angle; as t_s, u_V, i_A, ..."
        ),
    ],
    R: Annotated[
        float, typer.Option("--R_ohm", "--resistance", metavar="OHM", help="Phase resistance.")
    ],
    out: Annotated[
        Path | None,
        typer.Option(metavar="MAP.csv", help="Flux table to write; pair table with --pairs."),
    ] = None,
    pairs: Annotated[
        Path | None,
        typer.Option(
            metavar="DRIVE.toml",
            help="Drive whose pairs pulses beside a held phase tell: a factor; with --out a table.",
        ),
    ] = None,
    poles: RotorPoles = None,
    angle: Annotated[
        list[float] | None,
        typer.Option(metavar="ANGLE", help="Of each file, in order, where no column has it."),
    ] = None,
    angle_unit: AngleUnit = None,
    angle_kind: AngleKind = None,
    zero: Zero = None,
    aligned_at: AlignedAt = None,
    name: Annotated[
        list[str] | None,
        typer.Option("--name", metavar="QUANTITY=NAME", help="t, u, i or theta in the files."),
    ] = None,
    probe: Annotated[
        float | None,
        typer.Option(
            "--probe_A_per_V",
            metavar="A/V",
            min=1e-6,
            help="Of a current probe whose column holds volts: 10 of one with 100 mV/A.",
        ),
    ] = None,
    i_max: MaxCurrent = None,
) -> None:
    """Make a flux table of voltage pulses from a bench. By oscilloscope or firmware; exit code 1
    where `map check` refuses the table."""
    from reluctance.machine.maps import check_map, identify, read_pulses, write_map
    from reluctance.machine.maps.importers import MAP_COLUMNS

    if pairs is not None:
        from reluctance.cli.map_identify_pairs import identify_pairs

        _only_with_a_map(
            N_r=poles, angle=angle, angle_unit=angle_unit, angle_kind=angle_kind, zero=zero,
            aligned_at=aligned_at, name=name, probe_A_per_V=probe,
        )  # fmt: skip
        return identify_pairs(files, pairs, R, out, i_max)
    if out is None:
        raise ParameterError("need --out MAP.csv, or --pairs DRIVE.toml for a factor of its pairs")
    check_ending(out, {".csv"})
    refuse_input(out, files)
    check_own_table(out, MAP_COLUMNS)
    if poles is None:
        raise ParameterError("the recording does not give the rotor poles; pass --N_r")
    recording = read_pulses(files, angles=angle or (), names=_names(name), probe=probe)
    found = identify(
        recording,
        N_r=poles,
        R=R,
        i_max=i_max,
        angle_unit=angle_unit,
        angle_kind=angle_kind,
        zero=zero,
        aligned_at=aligned_at,
    )
    write_whole(out, lambda path: write_map(found.table, path))
    print(f"{found.n_pulses} pulses at {found.n_angles} angles; noise {found.i_noise:.3g} A rms")
    if found.R_closing is not None:
        print(f"rising and falling currents agree with {found.R_closing:.4g} ohm; given {R:g}")
    for note in found.table.notes:
        print(f"read as: {note}")
    print(f"wrote {out}, to {found.table.i[-1]:.4g} A")
    if reasons := check_map(found.table).reasons:
        for reason in reasons:
            print(f"refused: {reason}")
        raise typer.Exit(1)
    print(
        f"next: reluctance map import {out} --N_r {poles} --angle_kind electrical --R_ohm {R:g} "
        "--N_s POLES --J_kgm2 KGM2 --out MACHINE.toml"
    )


def _only_with_a_map(**given: object) -> None:
    for name, value in given.items():
        if value is not None:
            raise ParameterError(f"--{name} goes with a flux table, not with --pairs")


def _names(given: list[str] | None) -> dict[str, str]:
    pairs = [text.partition("=") for text in given or ()]
    for quantity, equals, column in pairs:
        if not equals or not column or quantity not in ("t", "u", "i", "theta"):
            raise ParameterError(
                f"--name {quantity}{equals}{column}: need t=NAME, u=NAME, i=NAME or theta=NAME"
            )
    return {quantity: column for quantity, _, column in pairs}
