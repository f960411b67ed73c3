"""Hand a drive over: firmware of its controller, parameters for the C interface, mock-up units."""

from reluctance.targets.export.blob import Kind, blob, write_blob
from reluctance.targets.export.fmu import Fmu, fmu
from reluctance.targets.export.package import Firmware, firmware

__all__ = ["Firmware", "Fmu", "Kind", "blob", "firmware", "fmu", "write_blob"]
