"""What arrives at sphere probes, by rays into every texel of their maps: emission, the world, and the light of surfaces as the
surface cache knows it, followed from mirror to mirror (effects/ray_traced/glossy.py has the same paths behind pixels).

Lamps are no part of it but those whose direct light the bake holds, which engines may lack: surfaces reflect the others by
themselves. Lamps without a size cannot be seen and are never in it.
"""

from dataclasses import dataclass, replace

import numpy as np

from ...numerics import octahedral
from ...numerics.sampling import hash_u32, sobol_owen
from ...progress import Progress
from ...scene import Scene
from ...scene.content import content_hash
from ...scene.lights import lamps_to_add
from ...scene.sphere_probe import SphereProbe
from ...techniques.base import Field
from ...transport.cache.look import CachedScene, Looks
from ...transport.context import LightContext
from ...transport.parallel import chunks, parallel_for
from ...transport.paths.numbers import PathNumbers
from ...transport.rays.ray_counter import count_rays
from ...transport.rays.tracer import short_of
from ..media.along import MediaAlong
from ..media.lighting import Surroundings
from ..ray_traced.diffuse import sent_along
from ..ray_traced.glossy import Ends, Paths, at_hits, onward
from ..ray_traced.lamps import MirroredLamps
from ..surroundings import LOOKS, look_around, names_of
from .maps import SphereMap, SphereProbes
from .prefilter import prefiltered
from .settings import SphereSettings

_STREAM = 0x5B43
# What is cut off concerns this share of all directions at least where it is told.
_TOLD = 0.005
# What a half float holds.
MOST = 65504.0


@dataclass(frozen=True, eq=False)
class BakedSpheres:
    """Finished ``probes`` (None: there are none), ``notes`` for the user, the number of ``rays``, which is that of paths, and
    of all rays that were ``traced`` in this process meanwhile."""

    probes: SphereProbes | None
    notes: tuple[str, ...]
    rays: int
    traced: int = 0


def light_of(scene: Scene) -> str:
    """A hash of the lamps and the world of ``scene``: what sphere probes that know it are out of date by."""
    return content_hash((scene.lights, scene.world))


def bake_spheres(scene: Scene, field: Field | None, settings: SphereSettings, seed: int = 0, threads: int | None = None,
                 progress: Progress | None = None) -> BakedSpheres:
    """Bake the sphere probes of ``scene``, whose indirect light is ``field``. One inside geometry is left out, and told. The same
    for any number of ``threads``. Raises BakeError where there is not the memory, Cancelled."""
    progress = progress or Progress()
    if not settings.bake or not scene.spheres:
        return BakedSpheres(None, (), 0)
    with count_rays() as counter:
        baked = _baked(scene, field, settings, seed, threads, progress)
    return replace(baked, traced=counter.rays)


def _baked(scene: Scene, field: Field | None, settings: SphereSettings, seed: int, threads: int | None,
           progress: Progress) -> BakedSpheres:
    context = LightContext(scene, threads)
    kept, notes = [], []
    for probe in scene.spheres:
        told, usable = surroundings(context, probe)
        notes += told
        if usable:
            kept.append(probe)
    if not kept:
        return BakedSpheres(None, tuple(notes), 0)
    centres = np.array([probe.centre_world for probe in kept])
    middle = centres.mean(axis=0)
    reach = max(float(np.linalg.norm(centre - middle)) + 0.5 * probe.extent**(1 / 3)
                for centre, probe in zip(centres, kept, strict=True))
    baking = _Baking(CachedScene.about(context, middle, reach), field, settings, seed)
    maps = baking.maps(kept, progress.span(0.0, 0.8))
    clipped = [probe.name for probe, image in zip(kept, maps, strict=True) if image.max() > MOST]
    if clipped:
        notes.append(f"sphere probes {', '.join(clipped)} see more than {MOST:g} W/(sr m²) in places, which is cut to that")
    progress.step(0.8, "Blurring sphere probes")
    levels = prefiltered(np.clip(maps, 0.0, MOST), threads)
    probes = SphereProbes([SphereMap(probe, tuple(level[number].astype(np.float16) for level in levels))
                           for number, probe in enumerate(kept)], light_of(scene))
    return BakedSpheres(probes, tuple(notes), baking.rays)


def surroundings(context: LightContext, probe: SphereProbe) -> tuple[list[str], bool]:
    """What a user should know of where ``probe`` lies, and whether it can be baked there."""
    around = look_around(context, probe.centre_world)
    primitive, distance, notes = around.primitive, around.distance, []
    if around.enclosed:
        notes.append(f"sphere probe {probe.name} lies inside {names_of(context, primitive[around.inside])} and is left out: move "
                     "it into the open")
        return notes, False
    near, far = distance < probe.clip_start, distance > probe.clip_end
    if near.sum() >= _TOLD * LOOKS:
        notes.append(f"sphere probe {probe.name} does not see {names_of(context, primitive[near])} in {near.sum() * 100 // LOOKS} "
                     f"% of all directions, nearer than its Clip Start of {probe.clip_start:g} m: lower that, or what is behind "
                     "shows in their place")
    if far.sum() >= _TOLD * LOOKS:
        notes.append(f"sphere probe {probe.name} does not see {names_of(context, primitive[far])} in {far.sum() * 100 // LOOKS} % "
                     f"of all directions, beyond its Clip End of {probe.clip_end:g} m: raise that, or the world shows in their "
                     "place")
    return notes, True


class _Baking:
    """The rays of sphere probes in a scene whose surfaces hold their light."""

    def __init__(self, cached: CachedScene, field: Field | None, settings: SphereSettings, seed: int):
        self._cached, self._settings, self._seed, self.rays = cached, settings, seed, 0
        context = cached.context
        self._lamps = MirroredLamps.of(context, frozenset() if field is None else field.direct_lamps)
        held = frozenset() if field is None else field.direct_lamps
        added = {id(light) for light in lamps_to_add(context.scene.lights, held)}
        self._held = [number for number, light in enumerate(context.scene.lights)
                      if id(light) not in added and not context.lamps.is_delta[number]
                      and (light.linking is None or light.linking.receivers is None)]
        self._media = None if context.media.is_empty else MediaAlong(Surroundings.of(context.scene, context, field))

    def maps(self, probes: list[SphereProbe], progress: Progress) -> np.ndarray:
        """(p, R, R, 3) float32 of radiance that arrives at ``probes``."""
        resolution, context = int(self._settings.resolution), self._cached.context
        count = resolution**2 * self._settings.rays
        parts = [(number, span) for number in range(len(probes)) for span in chunks(count)]
        progress.step(0.0, "Looking from sphere probes")
        paths = parallel_for(lambda i: self._trace(probes[parts[i][0]], *parts[i]), len(parts), context.threads,
                             progress.span(0.0, 0.4), "Looking from sphere probes")
        texels = self._cached.settle([end.looks for ends, _ in paths for end in ends], progress.span(0.4, 0.8))
        first = np.cumsum([0, *(len(ends) for ends, _ in paths)])

        def shade(i: int) -> np.ndarray:
            ends, total = paths[i]
            for end, texel in zip(ends, texels[first[i]:first[i + 1]], strict=True):
                total[end.rays] += self._cached.radiance(end.looks, texel, end.albedo) * end.weights
            return total

        shaded = parallel_for(shade, len(parts), context.threads, progress.span(0.8, 1.0), "Lighting sphere probes")
        self.rays = sum(len(end.rays) for ends, _ in paths for end in ends)
        images = np.concatenate(shaded).reshape(len(probes), resolution**2, self._settings.rays, 3).mean(axis=2)
        return images.reshape(len(probes), resolution, resolution, 3)

    def _trace(self, probe: SphereProbe, number: int, span: slice) -> tuple[list[Ends], np.ndarray]:
        """The rays ``span`` of a probe: where their paths end, and what (m, 3) of lamps and media came along them."""
        rays, resolution = self._settings.rays, int(self._settings.resolution)
        ray = np.arange(span.start, span.stop)
        texel, within = ray // rays, sobol_owen(rays, 2, self._seed, shuffle=True)[ray % rays]
        place = np.stack([texel % resolution, texel // resolution], axis=1) + within
        directions = octahedral.decode(2.0 * place / resolution - 1.0).astype(np.float32)
        numbers = PathNumbers(hash_u32(_STREAM, self._seed, number, texel), (ray % rays).astype(np.uint32))
        origins = (probe.centre_world + directions * probe.clip_start).astype(np.float32)
        paths = Paths(np.arange(len(ray)), origins, directions, np.ones((len(ray), 3), np.float32), numbers,
                      np.zeros(len(ray), np.float32))
        lit, ends = np.zeros((len(ray), 3), np.float32), []
        for depth in range(self._settings.reflections + 1):
            looks = self._cached.look(paths.origins, paths.directions, paths.numbers, depth=depth)
            if depth == 0:
                looks = _before(looks, probe.clip_end - probe.clip_start)
                lit += self._held_lamps(looks)
            if self._media is not None:
                lit[paths.rays] += sent_along(self._media, looks) * paths.weights
            if depth == self._settings.reflections:
                ends.append(Ends(paths.rays, looks, paths.weights, None))
                break
            ended, (rows, mirror, weights, numbers) = at_hits(self._cached, paths, looks)
            ends.append(ended)
            lit[rows] += self._lamps.sampled(mirror, numbers, depth) * weights
            paths, mirror = onward(rows, mirror, weights, numbers, depth)
            if not len(paths.rays):
                break
            if self._lamps.wide:
                lit[paths.rays] += self._lamps.met(mirror, paths.directions, depth) * paths.weights
        return ends, lit

    def _held_lamps(self, looks: Looks) -> np.ndarray:
        """Radiance (n, 3) of the lamps that the bake holds, where nothing is in front of them."""
        context, total = self._cached.context, np.zeros(looks.directions.shape, np.float32)
        limits = np.full(len(total), np.inf, np.float32)
        limits[looks.rows] = looks.t
        for lamp in self._held:
            met = context.lamps.meet(lamp, looks.origins, looks.directions)
            rows = np.flatnonzero((met.density > 0) & (short_of(met.distance) < limits))
            passed = 1.0 if looks.tint is None else looks.tint[rows]
            total[rows] += met.radiance[rows] * passed
        return total


def _before(looks: Looks, distance: float) -> Looks:
    """``looks`` without what they met farther than ``distance`` [m] away."""
    near = looks.t <= distance
    if near.all():
        return looks
    return replace(looks, rows=looks.rows[near], hits=looks.hits.take(near), t=looks.t[near], cosine=looks.cosine[near])
