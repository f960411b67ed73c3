"""A drive as checked tables, and what a controller may know of it."""

from reluctance.drive.drive import Drive

__all__ = ["Drive"]
