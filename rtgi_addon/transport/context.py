"""Everything light transport derives from a scene once: triangles, BVH, material lookups, tables of light."""

from dataclasses import fields, is_dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ..errors import BakeError
from ..scene import Scene, baked_part, seen_by_camera
from .lights.emitters import EmitterTable
from .lights.environment import Environment
from .lights.lamps import LampTable
from .lights.links import LightLinks
from .media.table import MediaTable
from .media.tracer import in_shadow, looked_at, through_media
from .rays.kinds import make_tracers
from .rays.moving import MovingTracers
from .rays.shadows import ShadowRays
from .rays.tracer import Tracer
from .surfaces.geometry import Geometry, flatten
from .surfaces.materials import Surfaces
from .surfaces.solids import Solids


class Sight(NamedTuple):
    """A scene with its materials as a camera sees them, made ready for its rays."""

    scene: Scene
    geometry: Geometry
    surfaces: Surfaces
    tracer: Tracer


class LightContext:
    """A scene made ready for rays: the part of it that takes part in bakes, or all that pictures show if ``whole``. ``threads``
    None means every core.

    ``tracers`` are those of each kind of ray, ``shadows`` tells what stands in a light's way, and ``links`` what lights light.
    Rays find what is left of light in ``media`` as the tint of what comes along them, a camera's rays excepted: pictures put media
    before surfaces by themselves. ``media`` are those that looks find, ``media_in_shadow`` those in the way of lamps, ``all_media``
    these and those that cameras alone see; ``bare`` are the tracers that know no medium.
    ``same_surfaces``: a context of the same geometry, materials and media, whose tables and BVH serve again; ``make`` makes its
    tracers otherwise (rays.kinds.make_tracers).
    """

    def __init__(self, scene: Scene, threads: int | None = None, same_surfaces: "LightContext | None" = None, whole: bool = False,
                 make: MovingTracers | None = None):
        self.whole = whole
        # What others derive from it and keep as long as it lives, each by a key of its own.
        self.kept: dict[str, object] = {}
        scene = self._part(scene)
        self.scene = scene
        self.threads = threads
        if same_surfaces is None:
            self.geometry = flatten(scene)
            self.surfaces = Surfaces(scene, self.geometry)
            self.all_media = MediaTable(scene.media, threads)
            self.media, self.media_in_shadow = self.all_media.part(looked_at), self.all_media.part(in_shadow)
            self.bare = make_tracers(self.geometry, self.surfaces, threads, make)
            self.tracers = self.bare if self.all_media.is_empty else through_media(self.bare, self.all_media)
            self.emitters = EmitterTable(self.geometry, self.surfaces)
        else:
            self.geometry, self.surfaces = same_surfaces.geometry, same_surfaces.surfaces
            self.media, self.media_in_shadow = same_surfaces.media, same_surfaces.media_in_shadow
            self.all_media, self.bare = same_surfaces.all_media, same_surfaces.bare
            self.tracers, self.emitters = same_surfaces.tracers, same_surfaces.emitters
        self.lamps, self.links = LampTable(scene.lights), LightLinks(scene)
        self.shadows = ShadowRays(self.bare.opaque_shadow, self.geometry, self.surfaces, self.links.blockers)
        same_world = same_surfaces is not None and same_values(scene.world, same_surfaces.scene.world)
        self.environment = same_surfaces.environment if same_world else Environment(scene.world)

    @property
    def tracer(self) -> Tracer:
        """What probes look along."""
        return self.tracers.view

    @property
    def point_tracer(self) -> Tracer:
        """What stands in the way of the light of lamps without a size."""
        return self.shadows.tracer(0, True)

    def _part(self, scene: Scene) -> Scene:
        return scene if self.whole else baked_part(scene)

    def lamp_transmittance(self, is_delta, origins: np.ndarray, directions: np.ndarray, t_max: np.ndarray | None,
                           blockers=0) -> np.ndarray:
        """As Tracer's, towards lamps of which ``is_delta`` (one for all rays, or (n,)) tells those without a size; ``blockers``
        (one, or (n,)) are the sets of instances in the way, as ``links`` numbers them."""
        passed = self.shadows.transmittance(is_delta, origins, directions, t_max, blockers)
        if self.media_in_shadow.is_empty:
            return passed
        return passed * self.media_in_shadow.transmittance(origins, directions, t_max)

    @cached_property
    def solids(self) -> Solids:
        """Which triangles bound solid matter."""
        return Solids(self.scene, self.geometry, self.surfaces)

    @cached_property
    def sight(self) -> Sight:
        """What a camera's rays meet: the same surfaces as light does, but for materials that show a camera something else."""
        shown = seen_by_camera(self.scene)
        if shown is self.scene:
            return Sight(self.scene, self.geometry, self.surfaces, self.tracers.camera)
        surfaces = Surfaces(shown, self.geometry)
        return Sight(shown, self.geometry, surfaces, make_tracers(self.geometry, surfaces, self.threads).camera)

    def relit(self, scene: Scene) -> "LightContext":
        """The same triangles, BVH and materials under the lamps and world of ``scene``. Raises BakeError if those differ."""
        scene = self._part(scene)
        changed = changed_surfaces(self.scene, scene)
        if changed:
            raise BakeError(f"the scene's {changed} changed since the bake", "bake again; relighting follows lamps and world only")
        return LightContext(scene, self.threads, same_surfaces=self, whole=self.whole)


def changed_surfaces(before: Scene, after: Scene) -> str:
    """What of the surfaces and media that light meets differs, as the beginning of a sentence ("geometry has"), or nothing."""
    for part, words in (("meshes", "geometry has"), ("instances", "geometry has"), ("materials", "materials have"),
                        ("media", "media have")):
        if not same_values(getattr(after, part), getattr(before, part), looks=False):
            return words
    return ""


def same_values(a, b, looks: bool = True) -> bool:
    """Whether two parts of scenes hold the same values; with ``looks`` also what changes pictures and no light."""
    if a is b:
        return True
    if type(a) is not type(b):
        return False
    if isinstance(a, np.ndarray):
        return np.array_equal(a, b)
    if is_dataclass(a):
        return all(same_values(getattr(a, item.name), getattr(b, item.name), looks) for item in fields(a)
                   if looks or not item.metadata.get("look"))
    if isinstance(a, dict):
        return a.keys() == b.keys() and all(same_values(value, b[key], looks) for key, value in a.items())
    if isinstance(a, tuple):
        return len(a) == len(b) and all(same_values(x, y, looks) for x, y in zip(a, b, strict=True))
    return a == b
