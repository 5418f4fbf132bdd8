"""Where light is uneven: how many texels the islands of an object's UV map want of those that it has.

Two coarse bakes of few rays tell it. Where light bends within a texel, a line between texels misses it; so an island's need is the
mean square of second differences of light between its texels, first differences at its border, beyond which nothing is known. It is
taken as the product of both bakes, which noise has nothing in common of. A bilinear look-up's error falls about as the texels' side
h, so that for a given number of texels, the sum of area · need · h² is least with h ∝ need^−¼.
"""

from dataclasses import dataclass, replace

import numpy as np

from ...progress import Progress
from ...scene import Scene, baked_part
from ...transport.surfaces.geometry import flatten
from .bake import bake_atlas
from .islands import islands_of
from .settings import AtlasSettings
from .sheet import LightAtlas
from .unwrapped import Part, Sheet, places_of, texture_space

# Of the density asked for, and at most so many texels; rays of each.
_COARSER, _MOST_TEXELS, _RAYS = 0.5, 20_000, 128
# How much finer or coarser than on the mean islands may become, along a side.
LEAST, MOST = 0.25, 3.0
_POWER = 0.25


@dataclass(frozen=True, eq=False)
class Needs:
    """What is known on a coarse ``sheet``: the ``need`` (height, width) float32 of each texel, NaN where none is."""

    sheet: Sheet
    need: np.ndarray

    def of(self, name: str, uv: np.ndarray) -> np.ndarray:
        """(n,) need at places ``uv`` (n, 2) of the UV map of the object called ``name``; NaN where none is known."""
        part = next(part for part in self.sheet.parts if part.name == name)
        column, row = np.floor(texture_space(uv) * part.scale + part.offset).astype(np.int64).T
        height, width = self.need.shape
        return self.need[np.clip(row, 0, height - 1), np.clip(column, 0, width - 1)]


def uneven(scene: Scene, settings: AtlasSettings, seed: int = 0, threads: int | None = None,
           progress: Progress | None = None) -> Needs:
    """How uneven light is at texels of the objects of ``scene`` that are in the atlas. Raises BakeError as ``bake_atlas`` does,
    Cancelled."""
    progress, baked = progress or Progress(), baked_part(scene)
    geometry, chosen = flatten(baked), np.array([instance.atlas is not None for instance in baked.instances])
    area = float(geometry.areas[chosen[geometry.instance]].sum())
    density = min(_COARSER * settings.density, np.sqrt(_MOST_TEXELS / max(area, 1e-12)))
    coarse = replace(settings, density=float(density), rays=_RAYS)
    atlases = [bake_atlas(scene, None, coarse, 2 * seed + number, threads, progress.span(0.5 * number, 0.5 * number + 0.5)).atlas
               for number in (0, 1)]
    sheet, need = atlases[0].sheet, np.full(atlases[0].known.shape, np.nan, np.float32)
    for part in sheet.parts:
        owner = _owners(part, sheet, baked, geometry)
        owner[~atlases[0].known] = -1
        mine = owner >= 0
        need[mine] = sum(np.sum(one * other, axis=-1) for one, other in zip(*(_bends(atlas, owner) for atlas in atlases),
                                                                               strict=True))[mine]
    return Needs(sheet, need)


def shares(need: np.ndarray, area: np.ndarray) -> np.ndarray:
    """(i,) how much finer than on the mean, along a side, islands are to be that have ``need`` (i,) and ``area`` (i,): between
    LEAST and MOST, with as many texels in all as they have at 1. Islands of unknown need, NaN, are as coarse as can be."""
    power = np.maximum(np.nan_to_num(np.asarray(need, np.float64)), 0.0) ** _POWER
    if not power.any():
        return np.ones(len(power))
    # One factor that is common to all is left, and the number of texels grows with it.
    low, high = -60.0, 60.0
    for _ in range(80):
        middle = 0.5 * (low + high)
        found = np.clip(np.exp(middle) * power / power.max(), LEAST, MOST)
        low, high = (middle, high) if np.sum(area * found**2) < np.sum(area) else (low, middle)
    return found


def _owners(part: Part, sheet: Sheet, scene: Scene, geometry) -> np.ndarray:
    """(height, width) of the sheet: the island of each texel of ``part``, −1 elsewhere."""
    places, mesh = places_of(part, sheet, scene, geometry), scene.meshes[scene.instances[part.instance].mesh]
    island = islands_of(mesh.vertices_local[mesh.triangles], texture_space(mesh.uv_layers[part.uv_map]) * part.scale)
    owner = np.full(sheet.size[0] * sheet.size[1], -1, np.int64)
    owner[places.texel] = island[geometry.local_triangle[places.triangle]]
    return owner.reshape(sheet.size)


def _bends(atlas: LightAtlas, owner: np.ndarray) -> list[np.ndarray]:
    """Second differences (height, width, 3) of light down and across, texels of other islands being as the texel itself."""
    light, found = np.pad(atlas.irradiance, ((1, 1), (1, 1), (0, 0))), []
    island, height, width = np.pad(owner, 1, constant_values=-1), *owner.shape
    for steps in (((0, 1), (2, 1)), ((1, 0), (1, 2))):
        bend = np.zeros_like(atlas.irradiance)
        for down, across in steps:
            part = slice(down, down + height), slice(across, across + width)
            bend += np.where((island[part] == owner)[..., None], light[part] - atlas.irradiance, 0.0)
        found.append(bend)
    return found
