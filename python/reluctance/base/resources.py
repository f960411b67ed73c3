"""Data that comes with the package: machines, examples, headers of the core and its bindings,
firmware templates, the page of the studio."""

from pathlib import Path


def resources(name: str) -> Path:
    """The folder `machines`, `examples`, `include`, `bindings`, `firmware` or `web`: in the
    installed package, or in the source tree."""
    installed = Path(__file__).parents[1] / name
    return installed if installed.is_dir() else Path(__file__).parents[3] / name
