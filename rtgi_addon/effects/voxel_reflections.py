"""Glossy layers show lit voxels: one cone about the mirrored direction, as wide as the layer is rough.

Source: C. Crassin et al., "Interactive Indirect Illumination Using Voxel Cone Tracing", Computer Graphics Forum 30(7), 2011. The
cone holds half of what a lobe of α reflects head-on: rays that a GGX layer mirrors lie within 2·atan(α√(q/(1 - q))) of the mirrored
direction with the share q. What is not on the screen is there, too, and nothing settles over samples; a cube of light is as sharp
as it gets, so smooth mirrors show voxels.
"""

from dataclasses import dataclass

import numpy as np

from ..progress import Progress
from ..techniques.base import Field
from ..techniques.cone_tracing import ConeField, ConeSettings
from ..techniques.voxels.field import VoxelField
from ..techniques.voxels.settings import VOXELS
from ..transport.context import LightContext
from ..transport.parallel import chunks, parallel_for
from ..transport.vectors import dot
from ..transport.voxels import grid_around, voxelize
from ..transport.voxels.cascades import by_cascade
from ..transport.voxels.cones import specular_spread, trace_cones
from .base import Effect, setting
from .frame import Frame
from .lit import SeenSurfaces, seen_surfaces

# Pixels at once.
_TOGETHER = 2048
_KEPT = "lit voxels"
# Share of the points that may lie beyond each side of the box that others fill, and how far voxels reach about that, in its longest
# sides.
_APART, _REACH = 0.02, 0.5


@dataclass(frozen=True)
class VoxelReflectionSettings:
    """What a user may set."""

    resolution: int = setting(64, "Resolution", "Voxels along the longest side of the scene, where the bake has none of its own",
                              "", 8, 512)
    step: float = setting(0.5, "Step", "Length of a step along a cone, in the voxels that it reads there", "", 0.05, 2.0)
    near: float = setting(3.0, "Near Field", "Voxels from a surface that are walked one by one before the cone widens", "", 0.0,
                          64.0)
    max_roughness: float = setting(0.7, "Max Roughness", "Rougher layers are taken for this rough: their lobe is no cone any more",
                                   "", 0.0, 0.7)


class VoxelReflections(Effect):
    """See the module's docstring."""

    name, label = "voxel_reflections", "Voxel Reflections"
    description = "Reflections of the scene in lit voxels, one cone a pixel by its roughness: off the screen, too, and never sharp"
    stage = "reflections"
    local = True
    Settings = VoxelReflectionSettings

    def mirrors(self, settings: VoxelReflectionSettings) -> bool:
        """See Effect.mirrors."""
        return True

    def sweep(self, pixels: int) -> tuple[VoxelReflectionSettings, ...]:
        """Voxels of their own, and where they are the bake's, steps."""
        return (VoxelReflectionSettings(resolution=32), VoxelReflectionSettings(step=1.0), VoxelReflectionSettings(),
                VoxelReflectionSettings(resolution=128))

    def apply(self, frame: Frame, field: Field | None, settings: VoxelReflectionSettings) -> np.ndarray:
        """See Effect.apply."""
        seen, context = frame.gbuffer.seen, frame.context
        if context is None or not seen.any():
            return frame.light
        surfaces = seen_surfaces(frame.gbuffer, frame.view)
        shown = mirrored(voxels_of(context, field, surfaces.points, settings), surfaces, settings, context.threads)
        albedo, gathered = frame.gbuffer.albedo[seen][:, :3], frame.irradiance[seen][:, :3]
        light = frame.light.copy()
        # What the layer reflects does not get below it.
        light[seen, :3] += surfaces.look.layer * shown - (albedo - surfaces.look.diffuse) * gathered / np.pi
        light[seen, :3] = np.maximum(light[seen, :3], 0.0)
        return light


def voxels_of(context: LightContext, field: Field | None, points: np.ndarray, settings: VoxelReflectionSettings) -> VoxelField:
    """The bake's own lit voxels, or some about ``points`` (n, 3) that are seen, kept with ``context`` for all pictures of it."""
    if isinstance(field, VoxelField):
        return field
    key = f"{_KEPT} {settings.resolution}"
    if key not in context.kept:
        wanted, bounds = ConeSettings(resolution=settings.resolution, light=VOXELS), np.array(context.geometry.bounds(), np.float64)
        low, high = np.quantile(points, (_APART, 1.0 - _APART), axis=0)
        # One pixel, or a few on one point, say nothing of how far the picture reaches: all there is, then.
        reach = _REACH * float((high - low).max()) or np.inf
        grid = grid_around(np.stack([np.maximum(bounds[0], low - reach), np.minimum(bounds[1], high + reach)]), settings.resolution)
        voxels = voxelize(context.geometry, context.surfaces, grid, context.threads)
        context.kept[key] = ConeField(context, wanted, 0, (voxels,), Progress())
    return context.kept[key]


def mirrored(voxels: VoxelField, surfaces: SeenSurfaces, settings: VoxelReflectionSettings, threads: int | None) -> np.ndarray:
    """Radiance (n, 3) from about the mirrored directions of ``surfaces``."""
    normals, towards_eye = surfaces.normals, surfaces.towards_eye
    directions = 2.0 * dot(normals, towards_eye)[:, None] * normals - towards_eye
    # Below the surface itself nothing is met: along it.
    below = np.minimum(dot(directions, surfaces.faces), 0.0)
    directions = directions - 1.02 * below[:, None] * surfaces.faces
    directions = (directions / np.linalg.norm(directions, axis=1)[:, None]).astype(np.float32)
    spread = specular_spread(np.minimum(surfaces.look.alpha, settings.max_roughness**2))
    spans = chunks(len(directions), _TOGETHER)

    def work(i: int) -> np.ndarray:
        rows = spans[i]
        points, along, wide = surfaces.points[rows], directions[rows], spread[rows]

        def seen_in(hierarchy, here):
            start, way = points[here], along[here]
            found = trace_cones(hierarchy, start, way, wide[here], surfaces.faces[rows][here], settings.step, settings.near)
            radiance, open_ = found.radiance, np.flatnonzero(found.passed)
            if open_.size:
                radiance[open_] += found.passed[open_, None] * voxels.beyond(start[open_], way[open_], wide[here][open_])
            return radiance

        return by_cascade(voxels.hierarchies, points, seen_in)

    return np.concatenate(parallel_for(work, len(spans), threads))


EFFECT = VoxelReflections()
