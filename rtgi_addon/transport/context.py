"""Everything light transport derives from a scene once: triangles, BVH, material lookups, tables of light."""

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
