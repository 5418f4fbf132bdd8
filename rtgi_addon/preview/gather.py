"""Gathers at receivers: irradiance from reflective shadow maps, light propagation volumes and virtual point lights.

Each is the twin of the numpy function it names. Receivers are one invocation each; sums over maps and cascades grow in one image.
"""

from collections.abc import Mapping

import gpu
import numpy as np

from ..techniques.lpv.cascades import shares
from ..techniques.lpv.gather import SURFACE_CELLS, irradiance_factors
from ..techniques.lpv.grid import LpvGrid
from ..techniques.rsm.gather import GatherMap, Pattern, rotations
from ..techniques.vpl.virtual_lights import VirtualLights
from .device import dispatch
from .light_volume import atlas_of, upload_light
from .packing import FOLD_WIDTH, LIGHTS_PER_TEXEL, fold, light_rows, map_texels, unfold, visibility_bits, wall_texels
from .program import Program
from .programs import LPV_GATHER, RSM_GATHER, VPL_GATHER
from .textures import download, empty, upload

# Pairs of a receiver and what it sums over in one dispatch: drivers end what takes seconds.
_PAIRS_PER_DISPATCH = 1 << 27
# Cells that a receiver reads of a light propagation volume: eight before its surface, and eight further off for damping.
_LPV_STEPS = 16
# Lights and texels of visibility that one image of receivers is gathered from at once.
_LIGHTS_AT_ONCE, _VISIBILITY_TEXELS = 1 << 16, 1 << 24


class _Sum:
    """Irradiance of ``count`` receivers as an image that programs add to."""

    def __init__(self, count: int):
        self._count, self._width = count, max(min(count, FOLD_WIDTH), 1)
        self._image = empty(self._width, max(-(-count // self._width), 1))

    def add(self, program: Program, work: int, parameters: Mapping, samplers: Mapping[str, gpu.types.GPUTexture]) -> None:
        """Run ``program``, of which each receiver takes ``work`` steps, in bands of rows."""
        height = self._image.height
        rows = max(_PAIRS_PER_DISPATCH // (self._width * max(work, 1)), 1)
        for first in range(0, height, rows):
            values = {**parameters, "count": min(self._count, (first + rows) * self._width), "first_row": first}
            dispatch(program, (self._width, min(rows, height - first)), uniforms={"parameters": values}, samplers=samplers,
                     images={"irradiance": self._image})

    def result(self) -> np.ndarray:
        """(n, 3) float32."""
        return unfold(download(self._image), self._count, 3)


def rsm_gather(maps: tuple[GatherMap, ...], points: np.ndarray, normals: np.ndarray, pattern: Pattern) -> np.ndarray:
    """See techniques.rsm.gather.gather, without a tracer."""
    points, normals = np.asarray(points, np.float32), np.asarray(normals, np.float32)
    total, shift = _Sum(len(points)), rotations(points, pattern.seed)
    for item in maps if len(points) else ():
        size, (disk, flux) = item.view.resolution, item.places(pattern)
        receivers = np.concatenate([points, shift[:, :1], normals, shift[:, 1:], item.centres(points)], axis=1)
        total.add(RSM_GATHER, item.samples,
                  {"size": size, "in_disk": len(disk), "by_flux": len(flux), "disk_radius": pattern.disk_radius},
                  {"receivers": upload(fold(receivers)), "pattern": upload(fold(np.concatenate([disk, flux]))),
                   "texels": upload(map_texels(item)), "cumulative": upload(item.cumulative.reshape(size, size))})
    return total.result()


def lpv_gather(grids: tuple[LpvGrid, ...], volumes: tuple[np.ndarray, ...], points: np.ndarray, normals: np.ndarray,
               dampening: bool = False, faces: tuple[np.ndarray | None, ...] | None = None) -> np.ndarray:
    """See techniques.lpv.gather.gather."""
    points = np.asarray(points, np.float64)
    total, share = _Sum(len(points)), shares(grids, points)
    for grid, volume, weight, of_grid in zip(grids, volumes, share.T, faces or (None,) * len(grids), strict=True):
        if not weight.any():
            continue
        atlas = atlas_of(grid.resolution)
        receivers = np.concatenate([grid.cells_of(points), weight[:, None], normals], axis=1)
        light = dict(zip(("light_red", "light_green", "light_blue"), upload_light(volume, atlas), strict=True))
        of_flux, of_vector = irradiance_factors(grid)
        total.add(LPV_GATHER, _LPV_STEPS,
                  {"resolution": grid.resolution, "columns": atlas.columns, "dampening": int(dampening), "total": of_flux,
                   "along": of_vector, "surface_cells": SURFACE_CELLS},
                  {"receivers": upload(fold(receivers)), **light, "walls": upload(wall_texels(atlas, of_grid))})
    return total.result()


def vpl_gather(lights: VirtualLights, points: np.ndarray, normals: np.ndarray, visibility: np.ndarray | None,
               clamp: float | None) -> np.ndarray:
    """See techniques.vpl.gather.gather_visible."""
    rows = np.zeros((len(points), 7), np.float32)
    rows[:, :3], rows[:, 4:] = points, normals
    if visibility is None:
        return _vpl_block(lights, rows, None, clamp)
    per_receiver = -(-min(lights.count, _LIGHTS_AT_ONCE) // LIGHTS_PER_TEXEL)
    step = max(_VISIBILITY_TEXELS // max(per_receiver, 1), 1)
    parts = [_vpl_block(lights, rows[start:start + step], visibility[start:start + step], clamp)
             for start in range(0, len(rows), step)]
    return np.concatenate(parts) if parts else np.zeros((0, 3), np.float32)


def _vpl_block(lights: VirtualLights, rows: np.ndarray, visibility: np.ndarray | None, clamp: float | None) -> np.ndarray:
    total = _Sum(len(rows))
    receivers, unused = upload(fold(rows)), upload(np.zeros((1, 1, 4), np.float32))
    for start in range(0, lights.count if len(rows) else 0, _LIGHTS_AT_ONCE):
        some = lights.take(slice(start, start + _LIGHTS_AT_ONCE))
        seen = unused if visibility is None else upload(fold(visibility_bits(visibility[:, start:start + some.count])))
        total.add(VPL_GATHER, some.count, {"lights": some.count, "has_visibility": int(visibility is not None),
                                           "clamp_at": -1.0 if clamp is None else clamp},
                  {"receivers": receivers, "lights": upload(fold(light_rows(some))), "visibility": seen})
    return total.result()
