"""Exports to engines: one file or folder each, discovered here. An engine comes in as a file that ends in ``ENGINE = Name()``, or
as a folder with the textures, shaders and scripts that it writes; what several engines need is in `axes`, `volumes` and
`conformance`.
"""

from functools import cache

from ...discovery import discover, named
from .base import PARTS, Engine, ExportReport, ExportSettings

__all__ = ["PARTS", "Engine", "ExportReport", "ExportSettings", "get", "names", "registry", "taking_styles"]


@cache
def registry() -> dict[str, Engine]:
    """Every engine found in this folder, by name, in alphabetical order."""
    return discover(__name__, __path__, "ENGINE")


def names() -> list[str]:
    """The names of all engines."""
    return list(registry())


def taking_styles() -> list[str]:
    """The names of the engines that take a style."""
    return [name for name, engine in registry().items() if engine.styles]


def get(name: str) -> Engine:
    """The engine called ``name``, by its name or one of its aliases. Raises UsageError with the list of known ones."""
    aliases = {alias: engine.name for engine in registry().values() for alias in engine.aliases}
    return named(registry(), aliases.get(name, name), "engine")
