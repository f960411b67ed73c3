"""The entry point of the `reluctance` command: signals are watched before the imports begin."""

import sys

from reluctance.cli.ended import exit_code, tell_notes, watch_output, watch_signals


def main() -> None:
    """What the command `reluctance` runs."""
    watch_signals()
    watch_output()
    tell_notes()
    sys.exit(exit_code(_command))


def _command() -> object:
    from reluctance.cli.main import app  # here: it takes longer than the rest

    return app(prog_name="reluctance", standalone_mode=False)
