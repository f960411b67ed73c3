"""`reluctance map identify --pairs`: from pulses beside a held phase to the factor of the pairs."""

from collections.abc import Sequence
from pathlib import Path

from reluctance import load
from reluctance.base.errors import ParameterError


def identify_pairs(files: Sequence[Path], drive_file: Path, R: float) -> None:
    """The factor of a drive's pairs, how certain it is, and what torque its error costs."""
    from reluctance.machine.held_pulses import read_held_pulses
    from reluctance.machine.identify_pairs import pair_factor, pair_torque

    drive = load(drive_file)
    machine = drive.machine
    if machine.coupling is None or machine.coupling.factor == 0:
        raise ParameterError(
            f"the machine of {drive_file} has no pairs, need a pair table that is believed"
        )
    pulses = read_held_pulses(files, n_phases=machine.n_phases)
    found = pair_factor(pulses, machine.coupling, machine.magnetics, R)
    print(f"{found.n_pulses} pulses at {found.n_positions} clamped positions")
    alone = ", ".join(f"{pair} {factor:.3f}" for pair, factor in found.of_pair.items())
    print(f"the pairs are {found.factor:.4f} +- {found.error:.4f} of those believed ({alone})")
    print(
        f"left over: {1e3 * found.residual:.3g} mWb rms, where the pairs add "
        f"{1e3 * abs(found.factor) * found.psi_rms:.3g} mWb"
    )
    tau = drive.tau_max
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
