"""`reluctance map import --pairs`: the pairs that a machine of a new map takes over."""

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from reluctance.base.errors import ParameterError

if TYPE_CHECKING:
    from reluctance.machine.coupling import Coupling


def taken_over(file: Path, N_r: int, n_phases: int) -> "tuple[Coupling, float]":
    """The pairs of a drive or of a pair table, and the `pair_factor` that stays a key of the
    machine file.

    Raises
    ------
    ParameterError
        If there are none, or they are of other poles.
    """
    from reluctance import load
    from reluctance.machine.pair_file import read_pairs

    if file.suffix.lower() != ".toml":
        return read_pairs(file, N_r=N_r, n_phases=n_phases), 1.0
    machine = load(file).machine
    coupling = machine.coupling
    if coupling is None:
        raise ParameterError(f"the machine of {file} has no pairs; leave --pairs out")
    if (machine.N_r, machine.n_phases) != (N_r, n_phases):
        raise ParameterError(
            f"the machine of {file} has {machine.n_phases} phases and {machine.N_r} rotor poles, "
            f"the map {n_phases} and {N_r}; need the same for --pairs"
        )
    on_flux, on_pairs = (getattr(machine, f"{key}_factor", 1.0) for key in ("psi", "pair"))
    return replace(coupling, factor=on_flux), on_pairs
