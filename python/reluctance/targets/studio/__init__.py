"""The studio, a page that runs the core in the browser: what the page reads, and its server."""

from reluctance.targets.studio.serve import serve
from reluctance.targets.studio.write import write_data

__all__ = ["serve", "write_data"]
