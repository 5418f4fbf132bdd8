"""Lit voxels as engines take them: in half floats, with the cones that read them and the smooth sky as harmonics. What follows
lamps and surfaces beyond the grid by rays stays behind."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ...numerics import sh
from ...transport.parallel import chunks
from ...transport.voxels.cascades import by_cascade
from ...transport.voxels.cones import NEAR, STEP, cone_set, irradiance
from ...transport.voxels.hierarchy import Hierarchy
from ...transport.voxels.tables import VoxelTables, pack, unpack

# Cones where a bake has none: rays are too many for a shader.
CONES = 16
# Band of the sky, and the largest half float.
SKY_ORDER, HALF_MAX = 2, 65504.0
# Degree to which a sky is integrated.
_DEGREE = 64
# Receivers at once.
_TOGETHER = 1024


@dataclass(frozen=True, eq=False)
class ShippedVoxels:
    """``tables`` of values that half floats hold (or of floats, where those do not), read by so many ``cones`` with ``step`` and
    ``near`` (transport/voxels/cones.py); ``sky`` (9, 3): SH of the radiance beyond. ``left`` says what of the bake is not in it."""

    tables: VoxelTables
    cones: int
    step: float
    near: float
    sky: np.ndarray
    left: tuple[str, ...] = ()

    @cached_property
    def hierarchies(self) -> tuple[Hierarchy, ...]:
        """What receivers in each of the grids read."""
        return unpack(self.tables)

    def beyond(self, _points, directions: np.ndarray, _spread) -> np.ndarray:
        """Radiance (n, 3) of the sky."""
        seen = sh.evaluate(np.asarray(directions, np.float64), SKY_ORDER) @ self.sky
        return np.maximum(seen, 0.0).astype(np.float32)

    def irradiance(self, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """(n, 3) [W·m⁻²] at ``points`` (n, 3) under unit ``normals`` (n, 3): what an engine's shader finds."""
        spans = chunks(len(points), _TOGETHER)
        cones = cone_set(self.cones)

        def gathered(points, normals):
            return by_cascade(self.hierarchies, points, lambda hierarchy, rows: irradiance(
                hierarchy, points[rows], normals[rows], cones, self.beyond, self.step, self.near))

        return np.concatenate([gathered(points[rows], normals[rows]) for rows in spans])


def shipped(field) -> ShippedVoxels:
    """Those of a VoxelField."""
    settings, environment = field.settings, field.context.environment
    directions, solid_angles = sh.quadrature(_DEGREE)
    sky = sh.project(directions, environment.base_radiance(directions.astype(np.float32)), solid_angles, SKY_ORDER)
    left = ["bright patches of the sky: add a DirectionalLight"] if environment.bright.count else []
    if field.goes_on and not environment.is_black:
        left.append("surfaces beyond the voxel grid, which hide the sky in a bake")
    if field.direct_lamps:
        left.append("the direct light of lamps")
    return ShippedVoxels(rounded(pack(field.hierarchies)), getattr(settings, "cones", CONES), getattr(settings, "step", STEP),
                         getattr(settings, "near", NEAR), np.asarray(sky, np.float64).reshape(-1, 3), tuple(left))


def rounded(tables: VoxelTables) -> VoxelTables:
    """``tables`` as half floats hold them; light that is brighter than those stays as it is."""
    light = tables.light if np.abs(tables.light).max(initial=0.0) > HALF_MAX else tables.light.astype(np.float16)
    return replace(tables, cells=tables.cells.astype(np.float16), light=light)
