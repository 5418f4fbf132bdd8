"""Everything light transport derives from a scene once: triangles, BVH, material lookups, tables of light."""

from dataclasses import fields, is_dataclass

import numpy as np

from ..errors import BakeError
from ..scene import Scene
from .emitters import EmitterTable
from .environment import Environment
from .geometry import flatten
from .lamps import LampTable
from .rays import make_tracer
from .surfaces import Surfaces


class LightContext:
    """A scene made ready for rays. ``threads`` None means every core."""

    def __init__(self, scene: Scene, threads: int | None = None):
        self.scene = scene
        self.threads = threads
        self.geometry = flatten(scene)
        self.surfaces = Surfaces(scene, self.geometry)
        self.tracer = make_tracer(self.geometry, self.surfaces, threads)
        self.lamps = LampTable(scene.lights)
        self.emitters = EmitterTable(self.geometry, self.surfaces)
        self.environment = Environment(scene.world)

    def relit(self, scene: Scene) -> "LightContext":
        """The same triangles, BVH and materials under the lamps and world of ``scene``. Raises BakeError if those differ."""
        changed = changed_surfaces(self.scene, scene)
        if changed:
            raise BakeError(f"the scene's {changed} changed since the bake", "bake again; relighting follows lamps and world only")
        other = object.__new__(LightContext)
        other.__dict__.update(self.__dict__)
        other.scene, other.lamps = scene, LampTable(scene.lights)
        if not same_values(scene.world, self.scene.world):
            other.environment = Environment(scene.world)
        return other


def changed_surfaces(before: Scene, after: Scene) -> str:
    """What of the surfaces that light meets differs, as the beginning of a sentence ("geometry has"), or nothing."""
    for part in ("meshes", "instances", "materials"):
        if not same_values(getattr(after, part), getattr(before, part)):
            return "materials have" if part == "materials" else "geometry has"
    return ""


def same_values(a, b) -> bool:
    """Whether two parts of scenes hold the same values."""
    if a is b:
        return True
    if type(a) is not type(b):
        return False
    if isinstance(a, np.ndarray):
        return np.array_equal(a, b)
    if is_dataclass(a):
        return all(same_values(getattr(a, item.name), getattr(b, item.name)) for item in fields(a))
    if isinstance(a, dict):
        return a.keys() == b.keys() and all(same_values(value, b[key]) for key, value in a.items())
    if isinstance(a, tuple):
        return len(a) == len(b) and all(same_values(x, y) for x, y in zip(a, b, strict=True))
    return a == b
