"""Tables of lit voxels for include/irradiance_cone_tracing.glsl and include/irradiance_voxel_march.glsl, the twins of
transport/voxels/cones.py, ``irradiance``, and of techniques/voxel_march.py, ``MarchField.gather``.

Shaders have no rays among triangles: where surfaces outside the grid hide the sky is read from a table, and what stands before the
sky's bright patches from the voxels. The light of lamps themselves is left out, even if the field has it.
"""

from dataclasses import dataclass

import numpy as np

from ...errors import BakeError
from ...numerics.sampling import sobol_owen
from ...techniques.cone_tracing import ConeSettings
from ...techniques.voxel_march import FIRST_HIT, OCCUPIED, STREAM
from ...techniques.voxels.beyond import DIRECTIONS, PATCHES, goes_on, hidden_sky
from ...techniques.voxels.field import LAMP_SAMPLES, RING, VoxelField
from ...techniques.voxels.settings import VoxelSettings
from ...transport.context import LightContext
from ...transport.paths.sources import Sources
from ...transport.voxels import cones
from ...transport.voxels.hierarchy import Hierarchy
from ...transport.voxels.tables import NUMBERS, VoxelTables, pack, row_numbers
from ..packing import fold, folded
from ..uniforms import UniformStruct
from .tables import Tables

# The samplers of include/voxels.glsl and include/voxel_sky.glsl.
TEXTURES = ("voxel_rows", "voxel_cells", "voxel_light", "voxel_sky", "voxel_hidden", "voxel_bright")
# Rows of voxels that a float tells apart, and quarters.
MOST_ROWS = 1 << 22
# Cones of a receiver in a frame that others are averaged with.
FRAME_CONES = 4
# A share that no voxel takes more of.
_NEVER = 2.0
# Directions and weights that a program without cones has room for all the same.
_NO_CONES = (np.zeros((1, 3)), np.zeros(1), np.zeros(1))


@dataclass(frozen=True, eq=False)
class LitVoxels:
    """What is looked up: the ``hierarchies`` of the scene of ``context``, of one grid or nested ones, by ``settings`` and the
    ``seed`` of rays."""

    context: LightContext
    settings: VoxelSettings
    seed: int
    hierarchies: tuple[Hierarchy, ...]


def voxel_tables(field: VoxelField, samples: int | None = None) -> Tables:
    """The voxels of ``field``, read as it does. With ``samples`` a receiver follows no more rays, or about FRAME_CONES cones, those
    of its own turn, for all."""
    return tables_of(LitVoxels(field.context, field.settings, field.seed, field.hierarchies), samples)


def tables_of(lit: LitVoxels, samples: int | None = None) -> Tables:
    """As ``voxel_tables``. Raises BakeError for more voxels than a texture tells apart."""
    settings, outermost = lit.settings, lit.hierarchies[-1].grid
    by_cones = isinstance(settings, ConeSettings)
    directions, weights, spread = cones.cone_set(settings.cones) if by_cones else _NO_CONES
    count = 0 if by_cones else settings.rays if samples is None else min(settings.rays, samples)
    stride = 1 if samples is None else -(-len(weights) // FRAME_CONES)
    tables = pack(lit.hierarchies)
    shapes = tables.shapes.tolist()
    hides, sky, bright = _beyond(lit)
    struct = UniformStruct("VoxelGather", (
        ("vec4", "corner"), ("float", "step"), ("float", "near"), ("float", "spread"),
        ("float", "first_hit"), ("int", "rays"), ("int", "stride"), ("uint", "seed"), ("ivec2", "hidden"), ("ivec2", "sky"),
        ("mat4", "map_from_world"), ("ivec4", "level", len(shapes)), ("vec4", "origin", len(shapes)),
        ("vec4", "cone", len(weights))))
    turn = np.eye(4)
    turn[:3, :3] = lit.context.scene.world.map_from_world
    first_hit = not by_cones and settings.opacity == FIRST_HIT
    values = {
        "corner": (*tables.grid.corner, tables.grid.cell), "step": settings.step if by_cones else 1.0,
        "near": settings.near if by_cones else 0.0, "spread": spread[0],
        "first_hit": OCCUPIED if first_hit else _NEVER, "rays": count, "stride": stride, "seed": lit.seed & 0xFFFFFFFF,
        "hidden": (PATCHES, DIRECTIONS) if goes_on(lit.context, outermost) else (0, 0), "map_from_world": turn,
        "sky": (_sky_kind(lit.context), len(bright)), "level": shapes, "origin": np.pad(tables.origins, ((0, 0), (0, 1))),
        "cone": np.concatenate([directions, weights[:, None]], axis=1)}
    textures = {"voxel_rows": _row_texels(tables), "voxel_cells": fold(tables.cells),
                "voxel_light": _light_texels(tables), "voxel_sky": sky, "voxel_hidden": hides, "voxel_bright": fold(bright)}
    if not by_cones:
        textures["voxel_numbers"] = fold(sobol_owen(max(count, 1), 2, lit.seed))
    return Tables("indirect_cone_tracing" if by_cones else "indirect_voxel_march", struct, values, textures,
                  (*_CONSTANTS, ("VOXEL_LEVELS", str(len(shapes))), ("VOXEL_GRIDS", str(len(tables.grids))),
                   ("VOXEL_CONES", str(len(weights)))))


def _row_texels(tables: VoxelTables) -> np.ndarray:
    """(h, w) float32: tables.row_numbers."""
    if len(tables.cells) >= MOST_ROWS:
        raise BakeError(f"the preview tells no more than {MOST_ROWS:,} voxels that hold surfaces apart", "lower the resolution")
    return folded(row_numbers(tables))


def _light_texels(tables: VoxelTables) -> np.ndarray:
    """Texels of what voxels show, for include/voxels.glsl."""
    texels = np.zeros((*tables.light.shape[:2], 4), np.float32)
    texels[..., :3] = tables.light
    return fold(texels.reshape(len(texels), -1))


def _sky_kind(context: LightContext) -> int:
    return 0 if context.environment.is_black else 1 if context.environment.is_constant else 2


def _beyond(lit: LitVoxels) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Texels of what hides the sky beyond the grid and of the smooth sky; rows (b, 8) of samples of its bright patches."""
    context, grid = lit.context, lit.hierarchies[-1].grid
    environment, nothing = context.environment, np.zeros((1, 1, 4), np.float32)
    dark = environment.is_black and not environment.bright.count
    hides = fold(hidden_sky(context, grid).reshape(-1, 1)) if goes_on(context, grid) and not dark else nothing
    pixels = environment.base_pixels if not environment.is_constant else environment.base_pixels[:1, :1]
    sky = np.concatenate([pixels, np.ones((*pixels.shape[:2], 1), np.float32)], axis=2)
    bright = np.zeros((0, 8), np.float32)
    if environment.bright.count:
        samples = list(Sources(context).lamp_samples([context.lamps.count], lit.seed, LAMP_SAMPLES))
        directions, irradiance = environment.bright.sample(np.stack([numbers for _, _, numbers in samples]))
        bright = np.zeros((len(samples), 8), np.float32)
        bright[:, :3], bright[:, 4:7] = directions, irradiance / samples[0][1]
    return hides, sky, bright


_CONSTANTS = (*((name, repr(float(value))) for name, value in NUMBERS.items()), ("SKY_RING", str(RING)),
              ("MARCH_STREAM", f"{STREAM}u"))
