"""The scene as one soup of world-space triangles, the form in which rays meet it."""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ... import kernels
from ...errors import BakeError
from ...numerics.blocks import blocks, cross, extent
from ...scene import Instance, Mesh, Scene


class Visibility(NamedTuple):
    """Which instances (i,) bool each kind of ray meets: Blender's ray visibility."""

    camera: np.ndarray
    diffuse: np.ndarray
    shadow: np.ndarray
    scatter: np.ndarray


@dataclass(frozen=True, eq=False)
class Geometry:
    """World-space triangles of every instance, in scene order.

    ``triangles_world`` (t, 3, 3) float32 corners; ``normals_world`` (t, 3) float32 unit geometric normals on the side the mesh
    calls its front (mirrored instances included; 0 for zero-area triangles); ``areas`` (t,) float32 [m²]; ``material``,
    ``instance`` (t,) int32 into the scene's tuples; ``mesh_triangle`` (t,) int32 into all meshes' triangles laid end to
    end; ``local_triangle`` (t,) int32 within its mesh; ``normal_matrices`` (i, 3, 3) float32 inverse transposes of the
    instances; ``mesh_offsets`` (m + 1,) int64: where each mesh's triangles start in that numbering; ``visibility`` of the
    instances.
    """

    triangles_world: np.ndarray
    normals_world: np.ndarray
    areas: np.ndarray
    material: np.ndarray
    instance: np.ndarray
    mesh_triangle: np.ndarray
    local_triangle: np.ndarray
    normal_matrices: np.ndarray
    mesh_offsets: np.ndarray
    visibility: Visibility

    @property
    def count(self) -> int:
        """Number of triangles."""
        return len(self.triangles_world)

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Lowest and highest corner (3,) of all triangles."""
        return extent(self.triangles_world.reshape(-1, 3))

    def part(self, triangles: np.ndarray) -> "Geometry":
        """Only the ``triangles`` (indices), numbered anew."""
        names = ("triangles_world", "normals_world", "areas", "material", "instance", "mesh_triangle", "local_triangle")
        return replace(self, **{name: getattr(self, name)[triangles] for name in names})

    def points(self, primitive: np.ndarray, u: np.ndarray, v: np.ndarray) -> np.ndarray:
        """World points (n, 3) at Embree's barycentrics: (1−u−v)·v0 + u·v1 + v·v2."""
        if kernels.is_available() and primitive.dtype == np.int32 and u.dtype == v.dtype == np.float32:
            n, points = len(primitive), np.empty((len(primitive), 3), np.float32)
            kernels.call("points", self.count, self.triangles_world, n, *dense(n, primitive, u, v), points)
            return points
        corners = self.triangles_world[primitive]
        return (corners[:, 0] + u[:, None] * (corners[:, 1] - corners[:, 0]) + v[:, None] * (corners[:, 2] - corners[:, 0]))


def dense(n: int, *arrays: np.ndarray) -> list[np.ndarray]:
    """``arrays`` (n,) as kernels take them. Raises ValueError for another length."""
    if any(array.shape != (n,) for array in arrays):
        raise ValueError(f"{[array.shape for array in arrays]} where {n} hits are expected")
    return [np.ascontiguousarray(array) for array in arrays]


def flatten(scene: Scene) -> Geometry:
    """Lay out every instance's triangles in world space. Raises BakeError if there are none."""
    counts = [len(scene.meshes[instance.mesh].triangles) for instance in scene.instances]
    total = int(sum(counts))
    if total == 0:
        raise BakeError("the scene has no geometry", "add a mesh that is visible to renders")
    mesh_offsets = np.concatenate(([0], np.cumsum([len(mesh.triangles) for mesh in scene.meshes]))).astype(np.int64)
    triangles = np.empty((total, 3, 3), np.float32)
    material, index, mesh_triangle, local = (np.empty(total, np.int32) for _ in range(4))
    matrices, mirrored = normal_matrices(scene)
    start = 0
    for i, (instance, count) in enumerate(zip(scene.instances, counts, strict=True)):
        mesh = scene.meshes[instance.mesh]
        span = slice(start, start + count)
        start += count
        vertices = _world_vertices(mesh, instance)
        for rows in blocks(count):
            triangles[span][rows] = vertices[mesh.triangles[rows]]
        material[span] = _materials(mesh, instance)
        index[span] = i
        local[span] = np.arange(count, dtype=np.int32)
        mesh_triangle[span] = local[span] + np.int32(mesh_offsets[instance.mesh])
    normals, lengths = np.empty((total, 3), np.float32), np.empty(total, np.float32)
    for rows in blocks(total):
        corners = triangles[rows]
        across = cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        lengths[rows] = np.sqrt(np.einsum("ij,ij->i", across, across))
        normals[rows] = across / np.maximum(lengths[rows], np.finfo(np.float32).tiny)[:, None]
    if mirrored.any():
        normals[mirrored[index]] *= -1.0
    visibility = Visibility(*(np.array([getattr(instance, f"visible_{kind}") for instance in scene.instances], bool)
                              for kind in Visibility._fields))
    if not any(np.any(np.asarray(medium.scattering) > 0) for medium in scene.media):
        # No ray is of that kind: nothing is told apart by it.
        visibility = visibility._replace(scatter=visibility.camera | visibility.diffuse)
    lengths *= np.float32(0.5)
    return Geometry(triangles, normals, lengths, material, index, mesh_triangle, local, matrices, mesh_offsets,
                    visibility)


def normal_matrices(scene: Scene) -> tuple[np.ndarray, np.ndarray]:
    """For every instance the inverse transpose (i, 3, 3) float32 up to a positive scale, and whether it is mirrored (i,) bool."""
    linear = np.array([instance.world_from_local for instance in scene.instances], np.float64).reshape(-1, 4, 4)[:, :3, :3]
    # The cofactor matrix is the inverse transpose up to a positive or negative scale and exists for flattened axes too.
    cofactors = np.stack([np.cross(linear[:, 1], linear[:, 2]), np.cross(linear[:, 2], linear[:, 0]),
                          np.cross(linear[:, 0], linear[:, 1])], axis=1)
    mirrored = np.linalg.det(linear) < 0
    return np.where(mirrored[:, None, None], -cofactors, cofactors).astype(np.float32), mirrored


def _world_vertices(mesh: Mesh, instance: Instance) -> np.ndarray:
    matrix = np.asarray(instance.world_from_local, np.float64)
    world = np.empty((len(mesh.vertices_local), 3), np.float32)
    for rows in blocks(len(world)):
        local = mesh.vertices_local[rows]
        for axis in range(3):
            world[rows, axis] = (local[:, 0] * matrix[axis, 0] + local[:, 1] * matrix[axis, 1] + local[:, 2] * matrix[axis, 2]
                                 + matrix[axis, 3])
    return world


def _materials(mesh: Mesh, instance: Instance) -> np.ndarray:
    if not instance.material_override:
        return mesh.triangle_material
    result = mesh.triangle_material.copy()
    for old, new in instance.material_override.items():
        result[mesh.triangle_material == old] = new
    return result
