"""The scene in cubes: how much of each stands in the way along each axis, which light leaves it by each face, and rays and cones
through that. What sees a scene as cells of one lattice comes in here; where their light comes from is for who asks.

`crossings` finds where lines along the axes meet triangles, `voxelize` sums that over cells, `hierarchy` filters it, `rays` walks
the cells, `cones` the hierarchy.
"""

from .grid import VoxelGrid, grid_around
from .voxelize import Voxels, holds_geometry, voxelize

__all__ = ["VoxelGrid", "Voxels", "grid_around", "holds_geometry", "voxelize"]
