"""GI techniques (rank 3): one file or folder each, discovered here; adding one is adding one file."""

import importlib
import pkgutil
from functools import cache

from ..errors import UsageError
from .base import PRESETS, Checkpoint, Field, ProbeGrid, Technique, setting, validate_settings, volumes_by_settings

__all__ = ["PRESETS", "Checkpoint", "Field", "ProbeGrid", "Technique", "get", "names", "registry", "setting", "validate_settings",
           "volumes_by_settings"]


@cache
def registry() -> dict[str, Technique]:
    """Every technique found in this folder, by name, in alphabetical order."""
    found = {}
    for info in sorted(pkgutil.iter_modules(__path__), key=lambda item: item.name):
        if info.name == "base":
            continue
        technique = getattr(importlib.import_module(f"{__name__}.{info.name}"), "TECHNIQUE", None)
        if technique is not None:
            found[technique.name] = technique
    return dict(sorted(found.items()))


def names() -> list[str]:
    """The names of all techniques."""
    return list(registry())


def get(name: str) -> Technique:
    """The technique called ``name``. Raises UsageError with the list of known ones."""
    try:
        return registry()[name]
    except KeyError:
        raise UsageError(f"unknown technique {name!r}", f"choose one of {', '.join(registry())}") from None
