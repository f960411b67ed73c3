"""What the control has wrong about its plant: parameters of the machine, zero of the angle."""

from pydantic import Field

from reluctance.machine.machine_file import MachineFile
from reluctance.schema import Section

# What scales with the flux linkage, by model. The current of the aligned point stays.
FLUX_KEYS = {"lehuy": ("L_u_H", "L_a_H", "L_sat_H", "psi_m_Wb"), "map": ("psi_factor",)}


class Mismatch(Section):
    """The [mismatch] table. Factors: the control's value over the plant's."""

    R_factor: float = Field(1.0, gt=0)  # of the phase resistance
    flux_factor: float = Field(1.0, gt=0)  # of the flux linkage at every current and angle
    angle_offset_deg: float = Field(0.0, ge=-90, le=90)  # electrical: measured less true


def as_known(machine: MachineFile, mismatch: Mismatch) -> MachineFile:
    """The machine as the control knows it: the base of its model and of its tables."""
    if mismatch.R_factor == 1 and mismatch.flux_factor == 1:
        return machine
    keys = FLUX_KEYS[machine.model]
    changed = {key: getattr(machine, key) * mismatch.flux_factor for key in keys}
    changed["R_ohm"] = machine.R_ohm * mismatch.R_factor
    return machine.computed(**changed)
