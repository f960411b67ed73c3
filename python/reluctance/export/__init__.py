"""Hand a drive over: the firmware of its controller, its parameters for the C interface."""

from reluctance.export.blob import Kind, blob, write_blob
from reluctance.export.package import Firmware, firmware

__all__ = ["Firmware", "Kind", "blob", "firmware", "write_blob"]
