"""What techniques that work from maps of what lamps see do not follow, with the names of whom it concerns."""

from collections.abc import Iterator

import numpy as np

from ..scene import Omission
from ..transport.context import LightContext
from ..transport.views.reflective_shadow_map import left_unlit


def quoted(names) -> str:
    """``names`` as part of a sentence."""
    return ", ".join(map(repr, names))


def surfaces_of_maps(technique: str, context: LightContext) -> Iterator[Omission]:
    """Surfaces of which a reflective shadow map shows less than there is: that cast no shadow, and that light passes diffusely."""
    unlit = tuple(left_unlit(context))
    if unlit:
        yield Omission(f"{technique} leaves {quoted(unlit)} unlit: a map holds the nearest surface that casts a shadow",
                       objects=unlit)
    passing = np.unique(context.geometry.material[context.surfaces.translucent[context.geometry.material]])
    names = tuple(dict.fromkeys(context.scene.materials[index].name for index in passing))
    if names:
        yield Omission(f"{technique} sends no light on through {quoted(names)}, which pass it diffusely", materials=names)
