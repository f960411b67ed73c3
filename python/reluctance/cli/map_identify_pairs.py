"""`reluctance map identify --pairs`: from pulses beside a held phase to the pairs of a machine."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from reluctance import load
from reluctance.base.errors import ParameterError
from reluctance.base.files import check_ending, check_own_table, refuse_input, write_whole

if TYPE_CHECKING:
    from reluctance.drive.drive import Drive
    from reluctance.machine.held_pulses import HeldPulse
    from reluctance.machine.measured_pairs import Measured

LOWER = [0.97**k for k in range(1, 24)]  # of the currents that were reached: tried in this order


def identify_pairs(
    files: Sequence[Path], drive_file: Path, R: float, out: Path | None, i_max: float | None
) -> None:
    """The factor of a drive's pairs, or with `out` a table of them; how certain, and what torque
    that costs."""
    from reluctance.machine.held_pulses import read_held_pulses
    from reluctance.machine.pair_file import COLUMNS

    if out is not None:
        check_ending(out, {".csv"})
        refuse_input(out, files)
        check_own_table(out, COLUMNS)
    drive = load(drive_file)
    pulses = read_held_pulses(files, n_phases=drive.machine.n_phases)
    coupling = drive.machine.coupling
    believed = coupling is not None and coupling.factor != 0
    if not believed and out is None:
        raise ParameterError(
            f"the machine of {drive_file} has no pairs, need a pair table that is believed, or "
            "--out PAIRS.csv for one from the pulses"
        )
    if believed:
        _factor(drive, pulses, R, alone=out is None)
    if out is not None:
        _table(drive, pulses, R, out, drive.machine.i_max_A if i_max is None else i_max)


def _factor(drive: "Drive", pulses: "Sequence[HeldPulse]", R: float, *, alone: bool) -> None:
    """alone: no table is made of the pulses, so that the factor has to do."""
    from reluctance.machine.coupling import LETTERS
    from reluctance.machine.identify_pairs import pair_factor, pair_torque, phase_of_first

    machine, tau = drive.machine, drive.tau_max
    assert machine.coupling is not None
    found = pair_factor(pulses, machine.coupling, machine.magnetics, R)
    print(f"{found.n_pulses} pulses at {found.n_positions} clamped positions")
    each = ", ".join(f"{pair} {factor:.3f}" for pair, factor in found.of_pair.items())
    print(f"the pairs are {found.factor:.4f} +- {found.error:.4f} of those believed ({each})")
    print(
        f"left over: {1e3 * found.residual:.3g} mWb rms, where the pairs add "
        f"{1e3 * abs(found.factor) * found.psi_rms:.3g} mWb"
    )
    if (first := phase_of_first(pulses, machine.coupling, machine.magnetics, R)) > 0:
        raise ParameterError(
            f"the pairs are where leg a drives phase {LETTERS[first]}, and every other leg as many "
            "phases on: move the leads of all legs and current sensors back, and repeat the "
            "commissioning"
        )
    if found.differ and alone:
        raise ParameterError(
            f"no factor makes the believed pairs right: {each}; check the order of the leads and "
            "the polarity of the poles, or take the pairs themselves from the pulses: --out "
            "PAIRS.csv"
        )
    rms = pair_torque(drive.at(drive.omega_nominal), tau)  # as believed
    print(
        f"the pairs as believed make {rms:.3g} N m rms at {tau:g} N m: the error of the factor "
        f"costs {100 * found.error * rms / tau:.2g} % of the torque, the believed factor "
        f"{100 * abs(1 - found.factor) * rms / tau:.2g} %"
    )
    key = getattr(machine, "pair_factor", 1.0) * found.factor
    print(
        f"next: pair_factor = {key:.4g} in the machine file, or --set machine.pair_factor={key:.4g}"
    )


def _table(
    drive: "Drive", pulses: "Sequence[HeldPulse]", R: float, out: Path, i_max: float
) -> None:
    from reluctance.machine.coupling import check_pairs
    from reluctance.machine.identify_pairs import smooth_currents
    from reluctance.machine.measured_pairs import kinds_of, measured_pairs
    from reluctance.machine.pair_file import check_ring, write_pairs

    machine, tau = drive.machine, drive.tau_max
    kinds = kinds_of(machine.coupling, pulses)

    def measured(i_max: float) -> "Measured":
        return measured_pairs(
            pulses, kinds, machine.magnetics, R=R, n_phases=machine.n_phases, i_max=i_max
        )

    def refused(found: "Measured", i_max: float) -> ParameterError | None:
        try:
            check_pairs(found.coupling, machine.magnetics, i_max)
        except ParameterError as fault:
            return fault
        return None

    found = measured(i_max)
    check_ring(found.coupling.pairs, machine.n_phases)
    if (fault := refused(found, i_max)) is not None:
        lower = (float(f"{part * found.i_reached:.3g}") for part in LOWER)
        able = next((i for i in lower if refused(measured(i), i) is None), None)
        if able is None:
            raise fault
        raise ParameterError(f"{fault}; pass --i_max_A {able:g}, here and in the machine file")
    write_whole(out, lambda path: write_pairs(found.coupling, path))
    point = replace(drive.at(drive.omega_nominal), coupling=found.coupling)
    error = found.torque_error(*smooth_currents(point, tau))
    print(f"wrote {out}, to {i_max:.4g} A; both phases reached {found.i_reached:.4g} A")
    print(f"the torque of the table is certain to {100 * error / tau:.2g} % rms of {tau:g} N m")
    print(f'next: pairs = "{out}" in the machine file, without pair_factor')
