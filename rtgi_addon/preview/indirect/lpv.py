"""Tables of light propagation volumes for include/irradiance_lpv.glsl, the twin of techniques/lpv/gather.py, ``gather``."""

import numpy as np

from ...techniques.lpv.cascades import BLEND_CELLS
from ...techniques.lpv.field import LpvField
from ...techniques.lpv.gather import SURFACE_CELLS, irradiance_factors
from ...techniques.lpv.grid import LpvGrid
from ..atlas import Atlas
from ..packing import wall_texels
from ..programs import lpv_cascades
from .tables import Tables

CHANNELS = ("red", "green", "blue")


class Stack:
    """The atlases of ``grids`` one above the other in textures of one size: ``rows`` are those that each begins with."""

    def __init__(self, grids: tuple[LpvGrid, ...]):
        self.atlases = tuple(Atlas.of(grid.resolution) for grid in grids)
        self.rows = tuple(int(row) for row in np.cumsum([0, *(atlas.size[1] for atlas in self.atlases[:-1])]))
        self.size = max(atlas.size[0] for atlas in self.atlases), sum(atlas.size[1] for atlas in self.atlases)


def stacked_walls(stack: Stack, faces: tuple[np.ndarray | None, ...]) -> np.ndarray:
    """The ``faces`` of every cascade as texels, for include/standing.glsl."""
    width, height = stack.size
    texels = np.zeros((height, 2 * width, 4), np.float32)
    for of_grid, atlas, row in zip(faces, stack.atlases, stack.rows, strict=True):
        for column, half in zip((0, width), np.split(wall_texels(atlas, of_grid), 2, axis=1), strict=True):
            texels[row:row + atlas.size[1], column:column + atlas.size[0]] = half
    return texels


def lpv_values(grids: tuple[LpvGrid, ...], stack: Stack, dampening: bool) -> dict:
    """Values of ``programs.lpv_cascades``."""
    return {
        "corner": [(*grid.corner, grid.cell) for grid in grids],
        "resolution": [(*grid.resolution, atlas.columns) for grid, atlas in zip(grids, stack.atlases, strict=True)],
        "factors": [(*irradiance_factors(grid), row, 0.0) for grid, row in zip(grids, stack.rows, strict=True)],
        "surface_cells": SURFACE_CELLS, "blend_cells": BLEND_CELLS, "dampening": int(dampening),
    }


def lpv_tables(field: LpvField) -> Tables:
    """The accumulated volumes of ``field``."""
    grids, stack = field.volume_grids, Stack(field.volume_grids)
    light = np.zeros((3, stack.size[1], stack.size[0], 4), np.float32)
    for volume, atlas, row in zip(field.volumes, stack.atlases, stack.rows, strict=True):
        for channel in range(3):
            light[channel, row:row + atlas.size[1], :atlas.size[0]] = atlas.pack(np.moveaxis(volume[:, channel], 0, -1))
    return Tables("indirect_lpv", lpv_cascades(len(grids)), lpv_values(grids, stack, field.params.get("dampening", False)),
                  {**{f"light_{name}": light[channel] for channel, name in enumerate(CHANNELS)},
                   "walls": stacked_walls(stack, field.faces)},
                  (("LPV_CASCADES", str(len(grids))),))
