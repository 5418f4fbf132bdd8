"""GI techniques (rank 3): one file or folder each, discovered here. A technique comes in as a file that ends in ``TECHNIQUE =
Name()`` and bakes a `Field` which is the same from every view; what all readers of probes share is in `lattice/`.
"""

from functools import cache

from ..discovery import discover, named
from .base import PRESETS, Cause, Checkpoint, Field, ProbeGrid, Technique, setting, validate_settings, volumes_by_settings

__all__ = ["PRESETS", "Cause", "Checkpoint", "Field", "ProbeGrid", "Technique", "get", "names", "registry", "setting",
           "validate_settings", "volumes_by_settings"]


@cache
def registry() -> dict[str, Technique]:
    """Every technique found in this folder, by name, in alphabetical order."""
    return discover(__name__, __path__, "TECHNIQUE")


def names() -> list[str]:
    """The names of all techniques."""
    return list(registry())


def get(name: str) -> Technique:
    """The technique called ``name``. Raises UsageError with the list of known ones."""
    return named(registry(), name, "technique")
