"""Where the grid lies, and whether its voxels are small enough for the walls in it."""

from collections.abc import Iterator

import numpy as np

from ...errors import BakeError
from ...numerics.grid import box_corners
from ...scene import Omission, Scene
from ...transport.context import LightContext
from ...transport.rays.tracer import offset_origins
from ...transport.vectors import dot
from ...transport.voxels import VoxelGrid, Voxels
from ...transport.voxels.cascades import FEWEST, nested
from .settings import CAMERA, VoxelSettings

# Points whose walls are measured, and the share of them that must be thin to be worth a word.
_PROBED, _WORTH = 20000, 0.005
# A surface this close behind another, in voxels, is the same one twice: a decal, a poster on a wall.
_SAME = 0.01


def place_grids(scene: Scene, bounds: np.ndarray, settings: VoxelSettings) -> tuple[VoxelGrid, ...]:
    """The grid around the probe volumes of ``scene`` and the geometry about them, whose ``bounds`` are (2, 3), and those within it,
    finest first. Raises BakeError for no geometry there, for grids beyond limits, and for no camera where they lie about one."""
    corners = np.concatenate([box_corners(volume.world_from_local) for volume in scene.volumes])
    low, high = corners.min(axis=0), corners.max(axis=0)
    margin = settings.reach * float((high - low).max())
    box = np.stack([np.maximum(bounds[0], low - margin), np.minimum(bounds[1], high + margin)])
    if np.any(box[0] > box[1]):
        raise BakeError(f"the voxel grid holds no geometry: nothing lies within {margin:.3g} m of the probe volumes",
                        "raise reach, or place the probe volumes where surfaces are")
    center = 0.5 * (low + high)
    if settings.cascades > 1 and settings.center == CAMERA:
        if not scene.cameras:
            raise BakeError("the cascades of the voxel grid lie about the scene's camera, and it has none",
                            "add a camera, or set center to volumes")
        center = np.asarray(scene.cameras[0].world_from_camera, np.float64)[:3, 3]
    grids = nested(box, settings.resolution, settings.cascades, center, settings.voxel_size)
    if len(grids) > 1 and min(grids[0].resolution) < FEWEST:
        raise BakeError(f"cascades of {' x '.join(str(count) for count in grids[0].resolution)} voxels leave nothing between their "
                        f"borders", f"raise resolution until there are {FEWEST} along each side, or set cascades to 1")
    return grids


def thin_walls(context: LightContext, voxels: Voxels) -> Iterator[str]:
    """A line for the user where walls are thinner than a voxel, with the least thickness that is not a rarity."""
    seen = voxels.seen
    stride = max(1, len(seen.face) // _PROBED)
    chosen = slice(None, None, stride)
    primitive, u, v = seen.primitive[chosen], seen.u[chosen], seen.v[chosen]
    points = context.geometry.points(primitive, u, v)
    inward = -context.geometry.normals_world[primitive] * seen.side[chosen, None]
    hits = context.tracers.diffuse.intersect(offset_origins(points, inward, inward), inward)
    met = np.flatnonzero(hits.primitive >= 0)
    through = dot(context.geometry.normals_world[hits.primitive[met]], inward[met]) > 0.5
    facing_out = seen.side[chosen][met] > 0
    thickness = hits.t[met][through & facing_out].astype(np.float64)
    thickness = thickness[thickness > _SAME * voxels.grid.cell]
    thin = np.sort(thickness[thickness < voxels.grid.cell])
    if len(thin) > _WORTH * len(primitive):
        least = thin[int(0.05 * len(thin))]
        yield (f"a voxel of {voxels.grid.cell:.3g} m is larger than the thinnest wall ({least:.2g} m): light may get through; "
               f"voxels of {0.5 * least:.2g} m would hold two of them")


def beyond_grid(technique: str, context: LightContext, grid: VoxelGrid) -> Iterator[Omission]:
    """Surfaces that the grid does not hold."""
    corners = context.geometry.triangles_world
    outside = np.any((corners.max(axis=1) < grid.corner) | (corners.min(axis=1) > grid.high), axis=1)
    names = dict.fromkeys(context.scene.instances[index].name for index in np.unique(context.geometry.instance[outside]))
    if names:
        shown = ", ".join(map(repr, list(names)[:8])) + (" and others" if len(names) > 8 else "")
        yield Omission(f"{technique} takes what of {shown} lies beyond the voxel grid for black", objects=tuple(names))
