"""Where the nested volumes of a cascade lie, and how much each counts at a point."""

import numpy as np

from ...errors import BakeError, UsageError
from ...numerics.grid import box_corners, transform_points
from ...scene import Scene
from ..base import MAX_TEXTURE_SIDE
from .grid import LpvGrid
from .settings import LpvSettings

# How far beyond the probe volumes a fitted cascade may reach for the room's walls, as a share of the volumes' size.
REACH = 0.5
# Cells over which a cascade gives way to the next one, in from its border.
BLEND_CELLS = 2.0
# Names of objects that an error lists.
_SHOWN_NAMES = 20


def place_cascades(scene: Scene, settings: LpvSettings, bounds: np.ndarray) -> tuple[LpvGrid, ...]:
    """The cascades of ``scene``, finest first: equal resolution, cells of 1, 2, 4, … times the finest one's size, each snapped to
    whole cells of its own, so that moving the centre never shifts a cell by less than a cell.

    ``bounds`` (2, 3) are those of the geometry. Raises BakeError for a volume larger than a texture may be and for a camera that
    is not there, UsageError for an unknown object.
    """
    count = settings.resolution
    # A volume is a sheet of its slices there.
    columns = -(-count * count // MAX_TEXTURE_SIDE)
    if columns * count > MAX_TEXTURE_SIDE:
        raise BakeError(f"a light propagation volume of {count} cells a side is larger than a texture of {MAX_TEXTURE_SIDE} pixels",
                        "lower resolution, and add cascades to reach farther")
    box = _fitted(scene, np.asarray(bounds, np.float64))
    center = _center(scene, settings.center, box)
    cell = settings.cell_size
    if cell is None:
        # A cell beyond the walls on either side, half of which snapping may cost.
        cell = 2.0 * float(np.abs(box - center).max()) / (count - 2)
    return tuple(_snapped(center, cell * 2**level, count) for level in range(settings.cascades))


def _snapped(center: np.ndarray, cell: float, count: int) -> LpvGrid:
    corner = np.round(center / cell - 0.5 * count) * cell
    return LpvGrid(tuple(float(value) for value in corner), float(cell), (count, count, count))


def _fitted(scene: Scene, bounds: np.ndarray) -> np.ndarray:
    """Box (2, 3) of all probe volumes and what geometry there is around them, up to REACH of their size."""
    corners = np.concatenate([box_corners(volume.world_from_local) for volume in scene.volumes])
    low, high = corners.min(axis=0), corners.max(axis=0)
    margin = REACH * float((high - low).max())
    return np.stack([np.minimum(low, np.maximum(bounds[0], low - margin)), np.maximum(high, np.minimum(bounds[1], high + margin))])


def _center(scene: Scene, name: str, box: np.ndarray) -> np.ndarray:
    if name == "volumes":
        return box.mean(axis=0)
    if name == "camera":
        if not scene.cameras:
            raise BakeError("the cascades are to be centred on the camera and the scene has none",
                            "add a camera or set center to volumes")
        return np.asarray(scene.cameras[0].world_from_camera, np.float64)[:3, 3]
    for instance in scene.instances:
        if instance.name == name:
            vertices = scene.meshes[instance.mesh].vertices_local
            world = transform_points(instance.world_from_local, vertices)
            return 0.5 * (world.min(axis=0) + world.max(axis=0))
    known = ", ".join(sorted({instance.name for instance in scene.instances})[:_SHOWN_NAMES])
    raise UsageError(f"center is {name!r}", f"choose volumes, camera or an object that renders: {known}")


def shares(grids: tuple[LpvGrid, ...], points_world: np.ndarray) -> np.ndarray:
    """Share (n, cascades) float32 of each cascade at ``points_world`` (n, 3): the finest wins, and gives way to the next over its
    outermost cells. Outside all of them the last one counts. Rows sum to 1."""
    share = np.zeros((len(points_world), len(grids)), np.float32)
    left = np.ones(len(points_world), np.float32)
    for column, grid in enumerate(grids[:-1]):
        cells = grid.cells_of(points_world)
        depth = np.minimum(cells, np.asarray(grid.resolution) - cells).min(axis=1)
        covered = np.clip(depth / BLEND_CELLS, 0.0, 1.0).astype(np.float32)
        share[:, column] = left * covered
        left *= 1.0 - covered
    share[:, -1] = left
    return share
