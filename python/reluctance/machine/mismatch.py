"""What the control has wrong about its plant: parameters of the machine, zero of the angle."""

from pydantic import Field

from reluctance.base.errors import ParameterError
from reluctance.base.schema import Section
from reluctance.machine.machine_file import MachineFile


class Mismatch(Section):
    """The [mismatch] table. Factors: the control's value over the plant's."""

    R_factor: float = Field(1.0, gt=0)  # of the phase resistance
    flux_factor: float = Field(1.0, gt=0)  # of the flux linkage at every current and angle
    pair_factor: float = Field(1.0, ge=0)  # of what pairs of phases add, besides flux_factor
    angle_offset_deg: float = Field(0.0, ge=-90, le=90)  # electrical: measured less true


def as_known(machine: MachineFile, mismatch: Mismatch) -> MachineFile:
    """The machine as the control knows it: the base of its model and of its tables."""
    if mismatch.R_factor == mismatch.flux_factor == mismatch.pair_factor == 1:
        return machine
    if mismatch.pair_factor != 1 and not machine.coupled:
        raise ParameterError(
            f"[mismatch] pair_factor = {mismatch.pair_factor:g}, need 1 for a machine whose phases "
            "do not couple"
        )
    flux = [key for key in machine.flux_keys if key in type(machine).model_fields]
    if mismatch.flux_factor != 1 and not flux:
        raise ParameterError(
            f"[mismatch] flux_factor = {mismatch.flux_factor:g}, need 1 for a machine of model = "
            f"{machine.model!r}; a machine file with its flux map takes another"
        )
    changed = {key: getattr(machine, key) * mismatch.flux_factor for key in flux}
    changed["R_ohm"] = machine.R_ohm * mismatch.R_factor
    if machine.coupled:
        changed["pair_factor"] = getattr(machine, "pair_factor", 1.0) * mismatch.pair_factor
    return machine.computed(**changed)
