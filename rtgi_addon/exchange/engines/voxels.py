"""The lit voxels of a bundle made ready for an engine: lists as slices of 3D textures, the shader that traces cones through them,
and what the engine is held to.

The shader is the preview's own (shaders/include/voxel_cones.glsl), with what differs between voxels as constants in front. Voxels
keep Blender's axes; a matrix takes the engine's points there.
"""

import re
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from ...errors import BakeError
from ...techniques.voxels.shipped import HALF_MAX, ShippedVoxels, rounded
from ...transport.voxels import VoxelGrid, Voxels
from ...transport.voxels.cascades import nested_hierarchies
from ...transport.voxels.cones import cone_set
from ...transport.voxels.tables import NUMBERS, pack, row_numbers
from ...transport.voxels.voxelize import NO_PLATE, Seen
from ..voxel_files import lists_of
from .axes import Axes
from .conformance import BUNDLE, KIT, POINTS
from .kit import unit

SCHEMA = "rtgi-voxels-conformance/1"
LISTS = ("rows", "cells", "light")
_HERE = Path(__file__).resolve().parent
_SHADERS = _HERE.parents[1] / "shaders" / "include"
# Texels of a line and lines of a slice, and slices that every driver has.
_SIDE, _SLICES = 2048, 256
# Rows that a float tells apart, with quarters.
_MOST_ROWS = 1 << 22
# Float32's share of what is found, and by how much points are moved to see where rounding decides [cells].
_FLOAT, _NUDGE = 1e-3, 2e-4
# Points whose answer changes by more than this share of the brightest are at the edge of a cell, and are not asked.
_EDGE = 2e-3

@dataclass(frozen=True, eq=False)
class EngineVoxels:
    """``source`` along an engine's ``axes``."""

    source: ShippedVoxels
    axes: Axes

    @property
    def slices(self) -> dict[str, np.ndarray]:
        """The lists by name: (slices, lines, texels, channels), rows in float32 and one channel, the others in float16 and four."""
        lists = lists_of(self.source.tables)
        lists["rows"] = row_numbers(self.source.tables).reshape(-1, 1, 1), 1
        return {name: _slices(items, texels) for name, (items, texels) in lists.items()}

    @property
    def cells_from_world(self) -> np.ndarray:
        """(4, 4) float64: places in cells of points of the engine's world."""
        grid, matrix = self.source.tables.grid, np.eye(4)
        matrix[:3, :3] = self.axes.blender_from_engine / (self.axes.scale * grid.cell)
        matrix[:3, 3] = -np.asarray(grid.corner) / grid.cell
        return matrix

    @property
    def cascades(self) -> list[dict]:
        """Of each grid, finest first, its least and greatest corner in the engine's world, the side of its cells there, and its
        resolution along Blender's axes."""
        result = []
        for grid in self.source.tables.grids:
            ends = self.axes.vectors(np.array([grid.corner, grid.high]))
            result.append({"low": ends.min(axis=0).tolist(), "high": ends.max(axis=0).tolist(), "cell": grid.cell * self.axes.scale,
                           "resolution": list(grid.resolution)})
        return result

    @property
    def lookup(self) -> dict:
        """What scripts that trace cones need to know beside the lists."""
        tables, (directions, weights, spread) = self.source.tables, cone_set(self.source.cones)
        return {"numbers": {name: float(value) for name, value in NUMBERS.items()}, "grids": len(tables.grids),
                "levels": tables.shapes.tolist(), "origins": tables.origins.tolist(),
                "cones": np.column_stack([directions, weights]).tolist(), "spread": float(spread[0]),
                "step": float(self.source.step), "near": float(self.source.near), "sky": self.source.sky.tolist()}

    def irradiance(self, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """(n, 3): what the engine is to find at its ``points`` (n, 3) under its unit ``normals`` (n, 3)."""
        turn = self.axes.blender_from_engine
        return self.source.irradiance(points @ turn.T / self.axes.scale, (normals @ turn.T).astype(np.float32)).astype(np.float64)


def engine_voxels(voxels: ShippedVoxels | None, axes: Axes) -> EngineVoxels | None:
    """``voxels`` along ``axes``; None for none. Raises BakeError for more of them than textures hold, and brighter ones."""
    if voxels is None:
        return None
    if voxels.tables.light.dtype != np.float16:
        raise BakeError(f"a voxel is brighter than half floats hold ({HALF_MAX:.0f} W/(sr m^2))",
                        "scale the scene's lights down and raise the engine's exposure by as much")
    most = max(len(voxels.tables.rows), len(voxels.tables.cells) * 8)
    if len(voxels.tables.cells) >= _MOST_ROWS or most > _SIDE * _SIDE * _SLICES:
        raise BakeError(f"the voxel grid has {len(voxels.tables.rows):,} cells and {len(voxels.tables.cells):,} voxels that hold "
                        "surfaces, more than textures of engines take", "bake it with a lower resolution")
    return EngineVoxels(voxels, axes)


def notes_on_voxels(voxels: EngineVoxels | None) -> list[str]:
    """What a user should know of ``voxels`` in an engine."""
    if voxels is None:
        return []
    size = sum(values.nbytes for values in voxels.slices.values()) / 2**20
    return [f"voxels: {voxels.source.cones} cones a pixel through {size:.1f} MiB; they keep the light of the bake",
            *(f"voxels in an engine leave out {what}" for what in voxels.source.left)]


def voxels_glsl(voxels: EngineVoxels, array: str = "{kind}[{count}]({values})", cells: float = 1.0,
                light: float = 1.0) -> str:
    """Constants of these voxels, then the functions, for a shader that has ``rtgi_list_texel(sampler, item, parts, part)`` and the
    samplers rtgi_voxel_rows, rtgi_voxel_cells, rtgi_voxel_light; ``array`` is how its language says one. Lists are stored over
    ``cells`` and ``light``."""
    tables, (directions, weights, spread) = voxels.source.tables, cone_set(voxels.source.cones)
    defines = {**{name: float(value) for name, value in NUMBERS.items()}, "VOXEL_LEVELS": len(tables.shapes),
               "VOXEL_GRIDS": len(tables.grids),
               "VOXEL_CONES": len(weights), "VOXEL_SPREAD": float(spread[0]), "VOXEL_STEP": float(voxels.source.step),
               "VOXEL_NEAR": float(voxels.source.near),
               "VOXEL_CELLS_OVER": cells, "VOXEL_LIGHT_OVER": light}
    text = "".join(f"#define RTGI_{name} {value!r}\n" for name, value in defines.items())
    cones = np.column_stack([directions, weights])
    for name, kind, rows in (("LEVEL", "ivec4", tables.shapes), ("ORIGIN", "vec3", tables.origins), ("CONE", "vec4", cones),
                             ("SKY", "vec3", voxels.source.sky)):
        values = ", ".join(f"{kind}({', '.join(_number(value) for value in row)})" for row in rows.tolist())
        text += (f"const {kind} RTGI_VOXEL_{name}[{len(rows)}] = "
                 f"{array.format(kind=kind, count=len(rows), values=values)};\n")
    shader = "".join(_include(name) for name in ("voxels.glsl", "voxel_cones.glsl"))
    return f"{text}\n{shader}\n{(_HERE / 'voxels.glsl').read_text(encoding='utf-8')}"


def _number(value) -> str:
    return str(value) if isinstance(value, int) else f"{value:.9e}"


def _include(name: str) -> str:
    """One of the preview's includes under names that leave an engine's own alone."""
    text = (_SHADERS / name).read_text(encoding="utf-8")
    text = re.sub(r"^#include .*\n", "", text, flags=re.MULTILINE)
    text = text.replace("indirect.level", "RTGI_VOXEL_LEVEL").replace("indirect.origin", "RTGI_VOXEL_ORIGIN")
    for name in ("cells", "light"):
        text = text.replace(f"list_texel(voxel_{name},", f"VOXEL_{name.upper()}_OVER * list_texel(voxel_{name},")
    text = re.sub(r"\b(VOXEL|CONE)_(?=[A-Z])", r"RTGI_\1_", text)
    text = re.sub(r"(?<!RTGI_)\b(voxel|cone|list)_(?=[a-z])", r"rtgi_\1_", text)
    return re.sub(r"\b(Voxel|VoxelRay|VoxelsSeen|ConeSample)\b", r"RTGI\1", text)


def _slices(items: np.ndarray, texels: int) -> np.ndarray:
    count, _, channels = items.shape
    per_line = _SIDE // texels
    lines = -(-count // per_line)
    slices = -(-lines // _SIDE)
    height = -(-lines // slices)
    wide = min(count, per_line)
    held = np.zeros((slices * height * wide, texels, 1 if channels == 1 else 4), items.dtype)
    held[:count, :, :channels] = items
    return held.reshape(slices, height, wide * texels, -1)


@cache
def kit_voxels(axes: Axes) -> EngineVoxels:
    """Two nested grids of voxels of every kind at random: sheets that lie any way, solid ones that lie in no plane, and ones that
    let light through."""
    rng, shape = np.random.default_rng(41), (12, 9, 10)
    nested = [_random_voxels(rng, VoxelGrid(corner, cell, shape)) for corner, cell in (((-1.25, -1.0, -1.5), 0.25),
                                                                                       ((-3.0, -2.0, -2.5), 0.5))]
    sky = np.concatenate([[[1.5, 1.8, 2.2]], 0.2 * rng.normal(size=(8, 3))])
    return EngineVoxels(ShippedVoxels(rounded(pack(nested_hierarchies(nested))), 16, 0.5, 3.0, sky), axes)


def _random_voxels(rng: np.random.Generator, grid: VoxelGrid) -> tuple[Voxels, np.ndarray]:
    """Some of ``grid``, and what their faces show (m, 6, 3)."""
    cells = np.sort(rng.permutation(grid.count)[:grid.count // 6])
    count, kind = len(cells), rng.integers(3, size=len(cells))
    normal = unit(rng.normal(size=(count, 3)))
    x, y, z = normal.T
    lie = np.stack([x * x, y * y, z * z, y * z, x * z, x * y], axis=1)
    lie[kind != 0] = (1 / 3, 1 / 3, 1 / 3, 0.0, 0.0, 0.0)
    opacity = np.where(kind[:, None] == 2, rng.uniform(0.1, 0.6, (count, 3)), rng.uniform(0.6, 1.0, (count, 3)))
    opacity = np.where(kind[:, None] == 0, np.minimum(np.abs(normal) * 1.2, 1.0), opacity).astype(np.float32)
    area = np.where(kind == 0, 1.0, rng.uniform(0.3, 1.5, count)) * grid.cell**2
    middle = 0.3 * (rng.random((count, 3)) - 0.5)
    radiance = (rng.random((count, 6, 3)) * np.repeat(opacity, 2, axis=1)[:, :, None]).astype(np.float32)
    # Some faces are fronts, so there are walls here and there.
    front, nothing = np.where(rng.random(6 * count) < 0.4, np.float32(1), np.float32(-1)), np.zeros(6 * count, np.float32)
    plates = np.where(rng.random((count, 3)) < 0.5, rng.uniform(-0.5, 0.5, (count, 3)), NO_PLATE).astype(np.float32)
    seen = Seen(np.arange(6 * count), nothing + 1, nothing.astype(np.int32), nothing, nothing, front)
    return Voxels(grid, cells, opacity, area, normal, np.zeros((count, 3)), lie, middle, kind != 2, plates, seen), radiance


def conformance_json(voxels: EngineVoxels) -> dict:
    """The contents of an export's conformance file of its voxels."""
    return {"schema": SCHEMA, "unit": "W/m^2", "cases": [_case("kit, voxels", KIT, kit_voxels(voxels.axes)),
                                                       _case("bundle, voxels", BUNDLE, voxels)]}


def _case(name: str, source: str, voxels: EngineVoxels) -> dict:
    """POINTS points of the grids with normals, clear of places where rounding decides which cell a ray meets."""
    rng, grids = np.random.default_rng(42), voxels.source.tables.grids
    grid, chosen = grids[0], np.arange(POINTS + POINTS // 2) % len(grids)
    corners, highs = np.array([part.corner for part in grids])[chosen], np.array([part.high for part in grids])[chosen]
    inside = rng.uniform(0.02, 0.98, corners.shape) * (highs - corners) + corners
    points = voxels.axes.vectors(inside).astype(np.float32).astype(np.float64)
    normals = unit(rng.normal(size=points.shape)).astype(np.float32).astype(np.float64)
    found, spread = voxels.irradiance(points, normals), np.zeros(points.shape)
    for _ in range(2):
        moved = points + _NUDGE * grid.cell * voxels.axes.scale * rng.normal(size=points.shape)
        turned = unit(normals + _NUDGE * rng.normal(size=points.shape))
        spread = np.maximum(spread, np.abs(voxels.irradiance(moved, turned) - found))
    kept = np.flatnonzero(spread.max(axis=1) < _EDGE * max(found.max(initial=0.0), 1e-9))[:POINTS]
    tolerance = spread[kept] + _FLOAT * (found[kept] + 0.05 * found.max(initial=0.0)) + 1e-9
    return {"name": name, "voxels": source, **{key: [[float(f"{value:.9g}") for value in row] for row in values]
                                               for key, values in (("points", points[kept]), ("normals", normals[kept]),
                                                                   ("irradiance", found[kept]), ("tolerance", tolerance))}}
