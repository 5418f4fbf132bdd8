"""Holding a scene as it was read, and a bake of it, to another renderer: where they are compared, by how much they differ, and
which object, lamp or material makes the difference.

What a new kind of suspect needs comes in as one more case of `suspects.replaced`, with its twin where the other renderer's scene is
changed.
"""

from .places import Places, choose_places
from .search import Culprit, Difference, Judge, search
from .suspects import Suspect, leaves_surfaces, replaced, suspects_of

__all__ = ["Culprit", "Difference", "Judge", "Places", "Suspect", "choose_places", "leaves_surfaces", "replaced", "search",
           "suspects_of"]
