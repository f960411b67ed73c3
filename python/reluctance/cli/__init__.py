"""The command line: one file per command."""

from typing import Any

from reluctance.cli.entry import main

__all__ = ["app", "main"]


def __getattr__(name: str) -> Any:
    if name != "app":
        raise AttributeError(f"module 'reluctance.cli' has no attribute {name!r}")
    from reluctance.cli.main import app

    return app
