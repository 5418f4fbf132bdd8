"""Everything light transport derives from a scene once: triangles, BVH, material lookups, tables of light."""

import numpy as np

from ..errors import BakeError
from ..scene import Scene, World
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
        if scene.meshes is not self.scene.meshes and _geometry_key(scene) != _geometry_key(self.scene):
            raise BakeError("the scene's geometry has changed since the bake", "bake again; relighting follows lamps and world only")
        other = object.__new__(LightContext)
        other.__dict__.update(self.__dict__)
        other.scene, other.lamps = scene, LampTable(scene.lights)
        if not _same_world(scene.world, self.scene.world):
            other.environment = Environment(scene.world)
        return other


def _geometry_key(scene: Scene) -> tuple:
    meshes = tuple((mesh.name, mesh.vertices_local.tobytes(), mesh.triangles.tobytes()) for mesh in scene.meshes)
    return meshes, tuple((instance.mesh, np.asarray(instance.world_from_local).tobytes()) for instance in scene.instances)


def _same_world(a: World, b: World) -> bool:
    return a is b or (np.array_equal(a.equirect, b.equirect) and np.array_equal(a.map_from_world, b.map_from_world))
