"""The light so far, on the CPU: what a camera sees of a scene in a field's light, ray by ray, before any effect.

The twin of the preview's picture (preview/renderer.py): the same surfaces, the same reflectance, lamps shadowed by rays where the
preview has shadow maps, indirect light as albedo·E/π with E from ``Field.irradiance``, or from the field's light atlas.
"""

from collections.abc import Callable
from typing import NamedTuple
from weakref import WeakKeyDictionary

import numpy as np

from ..numerics.sampling import sobol_owen_at
from ..scene import Scene
from ..scene.lights import lamps_to_add
from ..techniques.base import Field
from ..techniques.lattice.near_light import near_light
from ..transport.context import LightContext
from ..transport.lights.world_sh import unshadowed_irradiance
from ..transport.rays.tracer import offset_origins, short_of
from ..transport.surfaces.ggx import SurfaceLook, reflectance, surface_look
from ..transport.vectors import dot, largest, luminance, normalized
from ..transport.views.camera import CameraView
from ..transport.views.gbuffer import GBuffer, draw_gbuffer, draw_places, empty_gbuffer
from .atlas.surfaces import surfaces_in
from .frame import Frame, History, Samples

# Each lamp's points on it are drawn by a sequence of its own.
_LAMP_SEED = 0x2000
# What every effect asks for, by the G-buffers that are in use.
_SEEN: WeakKeyDictionary = WeakKeyDictionary()


class SeenSurfaces(NamedTuple):
    """Surfaces that pixels show: ``points``, unit shading normals ``normals`` and triangles' normals ``faces`` on the side that is
    seen, and ``towards_eye`` (n, 3), world, and how they ``look``."""

    points: np.ndarray
    normals: np.ndarray
    faces: np.ndarray
    towards_eye: np.ndarray
    look: SurfaceLook

    def take(self, rows: np.ndarray) -> "SeenSurfaces":
        """The given ones only."""
        return SeenSurfaces(*(part.take(rows) if isinstance(part, SurfaceLook) else np.take(part, rows, axis=0) for part in self))


def draw_frame(scene: Scene | LightContext, field: Field | None, view: CameraView, size: tuple[int, int], *, index: int = 0,
               offset=(0.0, 0.0), lamp_points: int = 1, transparent: bool = False, history: History | None = None,
               threads: int | None = None, lamps: Callable | None = None) -> Frame:
    """Sample number ``index`` of a picture of ``size`` (width, height) pixels, shifted by ``offset`` (2,) pixels, in the light of
    ``field`` (None: the world's own, with nothing in its way). Every wide lamp is seen through ``lamp_points`` of its points,
    others in every sample; with ``lamps`` (Effect.lamps) the frame is bare. A LightContext in place of ``scene`` saves building
    one. The same for any number of ``threads``."""
    context = scene if isinstance(scene, LightContext) else light_context(scene, threads)
    scene = context.scene if isinstance(scene, LightContext) else scene
    gbuffer = empty_gbuffer(size) if context is None else draw_gbuffer(context, view, size, offset)
    direct, irradiance = _arriving(context, field, gbuffer, view, index, lamp_points, lamps)
    frame = Frame(scene, view, gbuffer, direct, irradiance, direct, index, tuple(offset), transparent, history, lambda: context,
                  bare=lamps is not None)
    return frame.lit()


def draw_samples(context: LightContext, field: Field | None, view: CameraView, samples: Samples, *,
                 transparent: bool = False, lamps: Callable | None = None) -> Frame:
    """As ``draw_frame``, of single pixels: what it draws in these ``samples``."""
    gbuffer = draw_places(context, view, *samples.places())
    direct, irradiance = _arriving(context, field, gbuffer, view, samples.index[gbuffer.seen[0]], lamps=lamps)
    return Frame(context.scene, view, gbuffer, direct, irradiance, direct, None, None, transparent, None, lambda: context,
                 samples=samples, bare=lamps is not None).lit()


def _arriving(context: LightContext | None, field: Field | None, gbuffer: GBuffer, view: CameraView, index: int | np.ndarray,
              lamp_points: int = 1, lamps: Callable | None = None) -> tuple[np.ndarray, np.ndarray]:
    """``direct`` and ``irradiance`` of a frame (h, w, 4)."""
    direct, irradiance = np.zeros((2, *gbuffer.position.shape), np.float32)
    if context is not None:
        held = frozenset() if field is None else field.direct_lamps
        if lamps is not None:
            direct.reshape(-1, 4)[gbuffer.rows] = lamps(context, gbuffer, view, index)
            return direct, irradiance
        direct.reshape(-1, 4)[gbuffer.rows] = direct_light(context, gbuffer, view, index, lamp_points, held)
        irradiance.reshape(-1, 4)[gbuffer.rows, :3] = indirect_irradiance(context, field, gbuffer, index)
    return direct, irradiance


def direct_light(context: LightContext, gbuffer: GBuffer, view: CameraView, index: int | np.ndarray = 0, lamp_points: int = 1,
                 held: frozenset[str] | None = frozenset()) -> np.ndarray:
    """Radiance [W·sr⁻¹·m⁻²] that the n pixels in ``gbuffer.seen`` reflect towards the eye of ``view`` of all lamps but those
    whose direct light a bake holds (``held`` as ``Field.direct_lamps``), and the luminance of their irradiance [W·m⁻²]: (n, 4);
    in the sample number ``index`` of the picture, or (n,) each in its own."""
    surfaces, instance = seen_surfaces(gbuffer, view), gbuffer.shown(gbuffer.albedo)[:, 3].astype(np.int64)
    return lamps_on(context, surfaces, instance, index, lamp_points, held)


def lamps_on(context: LightContext, surfaces: SeenSurfaces, instance: np.ndarray, index: int | np.ndarray, lamp_points: int,
             held: frozenset[str] | None, layer_share: Callable[[int, np.ndarray, np.ndarray], np.ndarray] | None = None):
    """As ``direct_light``, of any n ``surfaces`` on the instances ``instance`` (n,). ``layer_share(lamp, rows, directions)`` tells
    what (m,) of the layer's reflection counts of a wide ``lamp``'s samples in ``directions`` (m, 3); None: all."""
    points, normals, faces, look = surfaces.points, surfaces.normals, surfaces.faces, surfaces.look
    lamps, links, total = context.lamps, context.links, np.zeros((len(points), 4), np.float64)
    # What the bake holds of lamps would be lit twice.
    added = frozenset(lamps_to_add(context.scene.lights, held))
    for lamp in (number for number, light in enumerate(context.scene.lights) if light in added):
        shared = layer_share is not None and not lamps.is_delta[lamp]
        count = 1 if lamps.is_delta[lamp] else lamp_points
        for point in range(count):
            uv = sobol_owen_at(np.atleast_1d(index) * count + point, 2, _LAMP_SEED + lamp, shuffle=True)
            sample = lamps.sample(lamp, points, np.broadcast_to(uv, (len(points), 2)), even=shared)
            cosine = dot(normals, sample.direction)
            lit = (cosine > 0) & (dot(faces, sample.direction) > 0) & (largest(sample.irradiance) > 0)
            rows = np.flatnonzero(lit & links.lamp_lights(lamp, instance) if links.has_receivers else lit)
            arriving = sample.irradiance[rows] * (cosine[rows] / count)[:, None]
            if lamps.casts_shadow[lamp] and rows.size:
                starts = offset_origins(points[rows], faces[rows], sample.direction[rows])
                limits = short_of(sample.distance[rows])
                arriving *= context.lamp_transmittance(lamps.is_delta[lamp], starts, sample.direction[rows], limits,
                                                       int(links.lamp_blockers(lamp)))
            reflected = reflectance(look.take(rows), normals[rows], surfaces.towards_eye[rows], sample.direction[rows])
            if shared:
                below = look.diffuse[rows] / np.pi
                reflected = below + (reflected - below) * layer_share(lamp, rows, sample.direction[rows])[:, None]
            total[rows, :3] += reflected * arriving
            total[rows, 3] += luminance(arriving)
    return total.astype(np.float32)


def seen_surfaces(gbuffer: GBuffer, view: CameraView) -> SeenSurfaces:
    """The surfaces of the n pixels in ``gbuffer.seen``; asked for again as long as the first are about, the same."""
    known = _SEEN.get(gbuffer)
    if known is None or known[0] is not view:
        known = _SEEN[gbuffer] = view, _seen_surfaces(gbuffer, view)
    return known[1]


def _seen_surfaces(gbuffer: GBuffer, view: CameraView) -> SeenSurfaces:
    shown = {name: gbuffer.shown(target) for name, target in gbuffer.items()}
    # Dense, as kernels take them.
    points, normals, faces = (np.ascontiguousarray(shown[name][:, :3]) for name in ("position", "normal", "geometry"))
    towards_eye = normalized(view.position.astype(np.float32) - points)
    if view.orthographic:
        towards_eye = np.broadcast_to(-view.forward.astype(np.float32), points.shape)
    base, roughness = shown["base_color"], shown["emission"][:, 3]
    look = surface_look(shown["albedo"][:, :3], base[:, :3], base[:, 3], roughness, shown["geometry"][:, 3],
                        np.clip(dot(normals, towards_eye), 0.0, 1.0))
    return SeenSurfaces(points, normals, faces, towards_eye, look)


def indirect_irradiance(context: LightContext, field: Field | None, gbuffer: GBuffer, index: int | np.ndarray = 0) -> np.ndarray:
    """Irradiance (n, 3) [W·m⁻²] of ``field`` at the n pixels in ``gbuffer.seen``, of its light atlas where the surface is in it; of
    the world's own light for None. What emissive surfaces give others closer than probes are apart is that of the sample number
    ``index`` of the picture, or (n,) each its own (techniques/lattice/near_light.py)."""
    points, normals = gbuffer.shown(gbuffer.position)[:, :3], gbuffer.shown(gbuffer.normal)[:, :3]
    scene = context.scene
    if field is None:
        return unshadowed_irradiance(scene.world, normals)
    result, elsewhere = np.zeros((len(points), 3), np.float32), np.ones(len(points), bool)
    atlas = None if field.atlas is None else surfaces_in(scene, field.atlas)
    if atlas is not None:
        rows, places = atlas.find(gbuffer.primitive[gbuffer.seen], gbuffer.instance[gbuffer.seen], points,
                                  gbuffer.geometry[gbuffer.seen][:, :3])
        result[rows], elsewhere[rows] = field.atlas.read(places, normals[rows]), False
    if not elsewhere.any():
        return result
    near, points, normals = near_light(context, field), points[elsewhere], normals[elsewhere]
    light = np.maximum((field if near is None else near.left).irradiance(points, normals), 0.0)
    if near is not None:
        faces = gbuffer.geometry[gbuffer.seen][:, :3][elsewhere]
        light += near.irradiance(context, points, normals, faces, index if np.ndim(index) == 0 else index[elsewhere])
    result[elsewhere] = light
    return result


def light_context(scene: Scene, threads: int | None = None) -> LightContext | None:
    """``scene`` made ready for rays, None if it has no geometry."""
    has_surfaces = any(len(scene.meshes[item.mesh].triangles) for item in scene.instances)
    return LightContext(scene, threads, whole=True) if has_surfaces else None
