"""Hand a drive over: firmware of its controller, parameters for the C interface, mock-up units."""

from reluctance.export.blob import Kind, blob, write_blob
from reluctance.export.fmu import Fmu, fmu
from reluctance.export.package import Firmware, firmware

__all__ = ["Firmware", "Fmu", "Kind", "blob", "firmware", "fmu", "write_blob"]
