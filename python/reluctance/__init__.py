"""Switched-reluctance motor drives: simulate, control, find the physical limit, flash."""

import re
from importlib import import_module
from pathlib import Path
from typing import Any

from reluctance.errors import ParameterError

__version__ = "0.1.0"

# The stub lists the names, for type checkers and for this file: each is imported when it is used
# (Scientific Python SPEC 1).
_STUB = Path(__file__).with_suffix(".pyi").read_text(encoding="utf-8")
_MODULES = {
    name: module for module, name in re.findall(r"^from (\S+) import (\w+) as", _STUB, re.M)
}
__all__ = sorted(_MODULES)


def __getattr__(name: str) -> Any:
    if name not in _MODULES:
        raise AttributeError(f"module 'reluctance' has no attribute {name!r}")
    try:
        module = import_module(_MODULES[name])
    except ParameterError as fault:  # of a package that is not installed: hasattr says False
        raise AttributeError(f"reluctance.{name}: {fault}") from None
    value = globals()[name] = getattr(module, name)
    return value


def __dir__() -> list[str]:
    return [*__all__, "__version__"]
