"""Programs that a test needs besides those of README's quick start."""

import os
import shutil

import pytest

CI = os.environ.get("CI") == "true"


def missing(*programs: str) -> list[str]:
    """Those of the programs that are not on the path."""
    return [program for program in programs if shutil.which(program) is None]


def needs(*programs: str) -> pytest.MarkDecorator:
    """Skips a test where a program is missing; in the check of a change it fails instead."""
    without = missing(*programs)
    return pytest.mark.skipif(not CI and bool(without), reason=f"needs {', '.join(without)}")
