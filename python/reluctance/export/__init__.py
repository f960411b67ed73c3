"""Hand a drive over: the firmware of its controller."""

from reluctance.export.package import Firmware, firmware

__all__ = ["Firmware", "firmware"]
