"""Islands of a UV map that lie so near each other on the sheet that the look-up of one reads texels of the other."""

import numpy as np

from ...scene import Scene
from ...transport.surfaces.geometry import Geometry
from ...transport.surfaces.solids import connected
from .unwrapped import FINENESS, Part, Places, Sheet, texture_space

# Corners of triangles are the same on the sheet where they are as near as this share of a texel.
_SAME = 1.0 / 64.0
_NOTHING, _SEVERAL = -1, -2


def islands_of(corners: np.ndarray, on_sheet: np.ndarray) -> np.ndarray:
    """(t,) int64, from 0 on: the island of each triangle with ``corners`` (t, 3, 3) that lie ``on_sheet`` (t, 3, 2) [texels]; those
    that share a corner in space and on the sheet belong together."""
    _, point = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
    places = np.rint(on_sheet.reshape(-1, 2) / _SAME).astype(np.int64)
    _, corner = np.unique(np.column_stack([point.reshape(-1), places]), axis=0, return_inverse=True)
    corner = corner.reshape(-1, 3)
    return np.unique(connected(corner, int(corner.max(initial=-1)) + 1), return_inverse=True)[1].reshape(-1)


def bleeding(part: Part, sheet: Sheet, scene: Scene, geometry: Geometry, places: Places) -> float:
    """The share of the surface of ``part``, whose ``places`` these are, that reads texels of islands other than its own: lit by
    them, or filled from them."""
    mesh = scene.meshes[scene.instances[part.instance].mesh]
    on_sheet = texture_space(mesh.uv_layers[part.uv_map]) * part.scale
    island = islands_of(mesh.vertices_local[mesh.triangles], on_sheet)[geometry.local_triangle[places.triangle]]
    row, column = np.divmod(places.texel, sheet.size[1])
    row, column = row - part.y, column - part.x
    owner = _owners(row, column, island, (part.height, part.width))
    step_down, step_across = (np.where(step < FINENESS // 2, -1, 1) for step in np.divmod(places.step.astype(np.int64), FINENESS))
    other = np.zeros(len(row), bool)
    for down, across in ((0, 0), (1, 0), (0, 1), (1, 1)):
        read = owner[np.clip(row + down * step_down, 0, part.height - 1), np.clip(column + across * step_across, 0, part.width - 1)]
        other |= (read != island) & (read != _NOTHING)
    return float(other.mean()) if len(other) else 0.0


def _owners(row: np.ndarray, column: np.ndarray, island: np.ndarray, size: tuple[int, int]) -> np.ndarray:
    """(height, width) the island of each texel of a part's rectangle of ``size``, or of those around where it has none itself."""
    low, high = np.full(size, np.iinfo(np.int64).max), np.full(size, _NOTHING)
    np.minimum.at(low, (row, column), island)
    np.maximum.at(high, (row, column), island)
    bare, (height, width) = high == _NOTHING, size
    for values, choose, nothing in ((low, np.minimum, low.max()), (high, np.maximum, _NOTHING)):
        padded, around = np.pad(values, 1, constant_values=nothing), values.copy()
        for down in range(3):
            for across in range(3):
                choose(around, padded[down:down + height, across:across + width], out=around)
        values[bare] = around[bare]
    return np.where(high == _NOTHING, _NOTHING, np.where(low == high, low, _SEVERAL))
