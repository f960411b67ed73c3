"""Data that comes with the package: machines, examples, headers of the core and its bindings,
firmware templates."""

from pathlib import Path


def resources(name: str) -> Path:
    """The folder `machines`, `examples`, `include`, `bindings` or `firmware`: in the installed
    package, or in the source tree."""
    installed = Path(__file__).parent / name
    return installed if installed.is_dir() else Path(__file__).parents[2] / name
