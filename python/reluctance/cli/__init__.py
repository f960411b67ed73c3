"""The command line: one file per command."""

from reluctance.cli.main import app, main

__all__ = ["app", "main"]
