"""Direct light after a few of many lamps changed: what went is taken from the texels, what came is added.

Light is linear in its sources, so the estimate stays unbiased; what remains of the noise of lamps that went is that of their share
in the texels' old means. Every relighting starts from the bake's own means, so it does not pile up.
"""

from collections import Counter
from dataclasses import fields, is_dataclass

import numpy as np

from ..context import LightContext

# More changes than this, and sampling all the light afresh costs less.
FEW_CHANGES = 8


def changed_sources(old: LightContext, new: LightContext) -> tuple[list[int], list[int]]:
    """Indices, as ``Sources`` counts, of the sources of ``old`` that are gone in ``new``, and of those that came."""
    gone, came = _missing(old.scene.lights, new.scene.lights), _missing(new.scene.lights, old.scene.lights)
    if old.environment is not new.environment:
        gone += [old.lamps.count] if old.environment.bright.count else []
        came += [new.lamps.count] if new.environment.bright.count else []
    return gone, came


def _missing(lights, others) -> list[int]:
    """Indices of the ``lights`` that have no equal of their own among the ``others``."""
    left = Counter(_values(light) for light in others)
    result = []
    for index, light in enumerate(lights):
        key = _values(light)
        if left[key]:
            left[key] -= 1
        else:
            result.append(index)
    return result


def _values(light) -> tuple:
    """All that determines a lamp's light, hashable."""
    return type(light), *(_hashable(getattr(light, item.name)) for item in fields(light) if item.name != "name")


def _hashable(value):
    if isinstance(value, np.ndarray):
        return value.shape, value.tobytes()
    return tuple(_hashable(getattr(value, item.name)) for item in fields(value)) if is_dataclass(value) else value
