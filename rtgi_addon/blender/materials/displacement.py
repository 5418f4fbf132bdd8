"""Cycles' true displacement: how far a material moves the vertices of a mesh.

Cycles asks the shader that feeds the output's Displacement once for every vertex, on the first triangle that has it, and moves the
vertex by the answer, a vector in world space (`scene/displacement` in Cycles: `MeshManager::displace`). So does this, through a
Cycles bake of that socket at the mesh's corners.
"""

import numpy as np

from .circumstances import Ray
from .fallback import Leaf, bake_on_corners
from .links import displacement_of
from .values import texels


def displacement(request, scene) -> np.ndarray:
    """How far each vertex of ``request.mesh`` (v, 3) float32 is moved, in the mesh's own space; 0 where no material of
    ``request.slots`` is. ``request`` is a BakeRequest. Raises BakeError if Cycles cannot bake."""
    wanted = {slot: _leaf(request.materials[slot]) for slot in request.slots}
    baked = bake_on_corners(request, {slot: [leaf] for slot, leaf in wanted.items()}, scene)
    mesh = request.mesh
    vertex, index = np.empty(len(mesh.loops), np.int32), np.empty(len(mesh.polygons), np.int32)
    counts = np.empty(len(mesh.polygons), np.int32)
    mesh.loops.foreach_get("vertex_index", vertex)
    mesh.polygons.foreach_get("material_index", index)
    mesh.polygons.foreach_get("loop_total", counts)
    slot_of_loop = np.repeat(np.clip(index, 0, len(request.materials) - 1), counts)
    moved = np.zeros((len(mesh.loops), 3), np.float32)
    for slot, leaf in wanted.items():
        rows = slot_of_loop == slot
        value = baked[slot][leaf]
        moved[rows] = value.constant if value.is_constant else texels(value)[0][rows]
    loops = np.flatnonzero(np.isin(slot_of_loop, list(wanted)))
    vertices, first = np.unique(vertex[loops], return_index=True)
    result = np.zeros((len(mesh.vertices), 3), np.float32)
    result[vertices] = moved[loops[first]] @ np.linalg.inv(np.array(request.world_from_local, np.float64)[:3, :3]).T
    return result


def _leaf(material) -> Leaf:
    out, path = displacement_of(material)
    return Leaf(tuple(node.name for node in path), out.node.name, out.identifier, "EMIT", Ray())
