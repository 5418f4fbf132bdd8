"""Exports to engines: one file or folder each, discovered here; adding one is adding one file that ends in `ENGINE = Name()`."""

import importlib
import pkgutil
from functools import cache

from ...errors import UsageError
from .base import Engine, ExportReport, ExportSettings

__all__ = ["Engine", "ExportReport", "ExportSettings", "get", "names", "registry"]


@cache
def registry() -> dict[str, Engine]:
    """Every engine found in this folder, by name, in alphabetical order."""
    found = {}
    for info in pkgutil.iter_modules(__path__):
        engine = getattr(importlib.import_module(f"{__name__}.{info.name}"), "ENGINE", None)
        if engine is not None:
            found[engine.name] = engine
    return dict(sorted(found.items()))


def names() -> list[str]:
    """The names of all engines."""
    return list(registry())


def get(name: str) -> Engine:
    """The engine called ``name``, by its name or one of its aliases. Raises UsageError with the list of known ones."""
    for engine in registry().values():
        if name == engine.name or name in engine.aliases:
            return engine
    raise UsageError(f"unknown engine {name!r}", f"choose one of {', '.join(registry())}")
