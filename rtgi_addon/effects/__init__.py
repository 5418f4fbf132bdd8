"""View-dependent images (rank 4): one effect, one file or folder, discovered here. An effect comes in as a file that ends in
``EFFECT = Name()``; it reads geometry, light and a technique's field and returns a picture.

`base` is the interface and the chain, `frame` what an effect is given, `lit` the light so far on the CPU. What is baked once for
every view is a technique; what draws on a GPU is the effect's other half in `preview/effects/`.
"""

from functools import cache

from ..discovery import discover, named
from .base import EFFECT_PASSES, STAGES, Chosen, Effect, concerned, in_order, notes_of, setting, validate_settings
from .frame import Frame, History

__all__ = ["EFFECT_PASSES", "STAGES", "Chosen", "Effect", "Frame", "History", "concerned", "get", "in_order", "names", "notes_of",
           "registry", "setting", "validate_settings"]


@cache
def registry() -> dict[str, Effect]:
    """Every effect found in this folder, by name, in the order in which they are applied."""
    found = discover(__name__, __path__, "EFFECT")
    return dict(sorted(found.items(), key=lambda entry: STAGES.index(entry[1].stage)))


def names() -> list[str]:
    """The names of all effects."""
    return list(registry())


def get(name: str) -> Effect:
    """The effect called ``name``. Raises UsageError with the list of known ones."""
    return named(registry(), name, "effect")
