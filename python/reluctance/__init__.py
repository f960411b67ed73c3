"""Switched-reluctance motor drives: simulate, control, find the physical limit, flash."""

import re
import sys
from importlib import import_module
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from pathlib import Path
from types import ModuleType
from typing import Any

from reluctance.base.errors import ParameterError

__version__ = "0.1.0"

# The stub lists the names, for type checkers and for this file: each is imported when it is used
# (Scientific Python SPEC 1).
_STUB = Path(__file__).with_suffix(".pyi").read_text(encoding="utf-8")
_MODULES = {
    name: module for module, name in re.findall(r"^from (\S+) import (\w+) as", _STUB, re.M)
}
__all__ = sorted(_MODULES)


def __getattr__(name: str) -> Any:
    if name not in _MODULES and name not in _PUBLIC:
        raise AttributeError(f"module 'reluctance' has no attribute {name!r}")
    try:
        if name in _PUBLIC:
            return import_module(f"reluctance.{name}")
        module = import_module(_MODULES[name])
    except ParameterError as fault:  # of a package that is not installed: hasattr says False
        raise AttributeError(f"reluctance.{name}: {fault}") from None
    value = globals()[name] = getattr(module, name)
    return value


def __dir__() -> list[str]:
    return [*__all__, "__version__"]


_PUBLIC = {
    **dict.fromkeys(("maps", "optimum"), "machine"),
    **dict.fromkeys(("run",), "drive"),
    **dict.fromkeys(("limits", "tuning", "comparison", "efficiency_map"), "explore"),
    **dict.fromkeys(("export", "commission", "gym"), "targets"),
}


class _WithoutWing(MetaPathFinder, Loader):
    """Programs name the public parts without their wing: `reluctance.maps` is
    `reluctance.machine.maps`, the same module."""

    def find_spec(self, name: str, path: Any = None, target: Any = None) -> ModuleSpec | None:
        part = name.split(".")[1:2]
        ours = name.startswith("reluctance.") and part[0] in _PUBLIC
        return ModuleSpec(name, self) if ours else None

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        _, part, *rest = spec.name.split(".")
        module = import_module(".".join(("reluctance", _PUBLIC[part], part, *rest)))
        spec.loader_state = module.__spec__
        return module

    def exec_module(self, module: ModuleType) -> None:
        """It has run. The import system has given it the spec of this name: back to its own."""
        assert module.__spec__ is not None
        module.__spec__ = module.__spec__.loader_state


sys.meta_path.insert(0, _WithoutWing())
