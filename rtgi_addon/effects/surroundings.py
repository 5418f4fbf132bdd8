"""What is about a place: which surfaces its rays meet, and what it lies inside of. An eye or a probe within a solid sees nothing
but that."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ..numerics.grid import transform_points
from ..numerics.sampling import fibonacci_sphere
from ..scene import Scene
from ..transport.context import LightContext
from ..transport.surfaces.solids import winding_number

# Rays that look at what is about a place, and the share of them on the inside of solids from which on it lies in one.
LOOKS, _INSIDE = 1024, 0.5


class Around(NamedTuple):
    """What those of LOOKS rays of a place meet that meet anything: triangles ``primitive`` (n,), how far away ``distance`` (n,)
    [m], and which of them ``inside`` (n,) bool are the inside of solids."""

    primitive: np.ndarray
    distance: np.ndarray
    inside: np.ndarray

    @property
    def enclosed(self) -> bool:
        """Whether the place lies in solids."""
        return bool(self.inside.sum() > _INSIDE * LOOKS)


def look_around(context: LightContext, point_world: np.ndarray) -> Around:
    """What is about ``point_world`` (3,)."""
    directions = fibonacci_sphere(LOOKS)
    origins = np.broadcast_to(np.asarray(point_world, np.float32), directions.shape)
    hits = context.tracers.diffuse.intersect(origins, directions)
    rows = np.flatnonzero(hits.primitive >= 0)
    primitive = hits.primitive[rows]
    behind = np.einsum("ij,ij->i", context.geometry.normals_world[primitive], directions[rows]) > 0
    inside = np.zeros(len(rows), bool)
    inside[behind] = context.solids.is_solid(primitive[behind])
    return Around(primitive, hits.t[rows], inside)


def names_of(context: LightContext, primitive: np.ndarray) -> str:
    """The instance that most of the triangles ``primitive`` (n,) belong to, and how many others there are."""
    found, counts = np.unique(context.geometry.instance[primitive], return_counts=True)
    name = context.scene.instances[int(found[np.argmax(counts)])].name
    return name if len(found) == 1 else f"{name} and {len(found) - 1} more"


def eye_inside(scene: Scene, camera: str, position_world: np.ndarray, threads: int | None = None) -> str:
    """That the ``camera`` at ``position_world`` (3,) lies in a solid, as a sentence that users are told; or nothing.

    A bake takes what has a camera in it for a room. Here it is one only if a lamp or an emitter is in it as well: a picture of
    any other has no light.
    """
    if not any(_goes_round(scene, instance, position_world) for instance in scene.instances):
        return ""
    context = LightContext(replace(scene, cameras=()), threads)
    around = look_around(context, position_world)
    own = around.primitive[around.inside]
    # What shines itself is no emitter inside itself.
    if not around.enclosed or context.surfaces.emissive[context.geometry.material[own]].any():
        return ""
    return f"camera {camera} lies inside {names_of(context, own)}, which no light gets into: move it into the open"


def _goes_round(scene: Scene, instance, point_world: np.ndarray) -> bool:
    """Whether the mesh of ``instance`` may have the point in it: cheap, so that rays are made ready only where it has."""
    mesh = scene.meshes[instance.mesh]
    matrix = np.asarray(instance.world_from_local, np.float64)
    if not len(mesh.triangles) or abs(np.linalg.det(matrix[:3, :3])) == 0.0:
        return False
    point = transform_points(np.linalg.inv(matrix), np.asarray(point_world, np.float64)[None])[0]
    low, high = mesh.vertices_local.min(axis=0), mesh.vertices_local.max(axis=0)
    if not np.all((point > low) & (point < high)):
        return False
    return winding_number(mesh.vertices_local[mesh.triangles].astype(np.float64), point) > _INSIDE
