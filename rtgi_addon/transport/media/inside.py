"""Where along rays a medium is: the spans that they run inside a closed mesh or a box.

Spans are two arrays (n, k) float64, where each one starts and ends in units of the directions' length; one that ends where it
starts is none. They ascend along a row and do not overlap.
"""

from typing import NamedTuple, Protocol

import numpy as np

from ...numerics.grid import transform_points
from ...scene import Instance, Mesh, Scene
from ...scene.medium import ClosedMesh
from ..rays.choose import make_opaque_tracer
from ..rays.tracer import SELF_INTERSECTION
from ..surfaces.geometry import flatten
from ..vectors import dot

# A convex mesh of at most so many planes is met plane by plane, others by a tracer.
PLANES = 32
# Surfaces of one mesh that a ray may cross; a ray that crosses more is taken to stay as it was.
CROSSINGS = 64
# A vertex this far outside a face's plane, as a share of the mesh's size, makes the mesh no convex one.
FLAT = 1e-5


class Spans(NamedTuple):
    """Where (n, k) rays are inside, see the module's docstring."""

    enter: np.ndarray
    leave: np.ndarray


class Inside(Protocol):
    """The inside of something."""

    def spans(self, origins: np.ndarray, directions: np.ndarray, t_max: np.ndarray) -> Spans:
        """The spans inside along rays (n, 3) float64 from 0 to ``t_max`` (n,), which may be infinite."""

    def contains(self, points: np.ndarray) -> np.ndarray:
        """(n,) bool: which of ``points`` (n, 3) are inside."""


class Everywhere:
    """All space."""

    def spans(self, origins, directions, t_max) -> Spans:
        """See Inside."""
        return Spans(np.zeros((len(origins), 1)), np.asarray(t_max, np.float64)[:, None])

    def contains(self, points) -> np.ndarray:
        """See Inside."""
        return np.ones(len(points), bool)


class Convex:
    """Where all of ``planes`` (p, 4) float64 have n·x + d ≤ 0."""

    def __init__(self, planes: np.ndarray):
        self._planes = planes

    @staticmethod
    def box(world_from_local: np.ndarray) -> "Convex":
        """The box local [−1, 1]³ under an affine map."""
        local_from_world = np.linalg.inv(np.asarray(world_from_local, np.float64))
        rows = np.concatenate([local_from_world[:3], -local_from_world[:3]])
        rows[:, 3] -= 1.0
        return Convex(rows / np.linalg.norm(rows[:, :3], axis=1, keepdims=True))

    def spans(self, origins, directions, t_max) -> Spans:
        """See Inside."""
        enter, leave = np.zeros(len(origins)), np.asarray(t_max, np.float64).copy()
        for plane in self._planes:
            height, slope = origins @ plane[:3] + plane[3], directions @ plane[:3]
            with np.errstate(divide="ignore", invalid="ignore"):
                t = -height / slope
            np.maximum(enter, np.where(slope < 0, t, 0.0), out=enter)
            np.minimum(leave, np.where(slope > 0, t, np.where((slope == 0) & (height > 0), 0.0, np.inf)), out=leave)
        enter = np.minimum(enter, t_max)
        return Spans(enter[:, None], np.maximum(leave, enter)[:, None])

    def contains(self, points) -> np.ndarray:
        """See Inside."""
        return np.all(points @ self._planes[:, :3].T + self._planes[:, 3] <= 0, axis=1)


class Winding:
    """Where a closed surface winds about a point at least once, by the crossings of a ray."""

    def __init__(self, mesh: ClosedMesh, threads: int | None = None):
        surface = Mesh("", mesh.vertices_local, mesh.triangles, np.zeros(len(mesh.triangles), np.int32))
        self._geometry = flatten(Scene("", meshes=(surface,), instances=(Instance("", 0, mesh.world_from_local),)))
        self._tracer = make_opaque_tracer(self._geometry, threads)
        low, high = self._geometry.bounds()
        matrix = np.diag([*np.maximum(0.5 * (high - low), 1e-30), 1.0])
        matrix[:3, 3] = 0.5 * (low + high)
        self._box = Convex.box(matrix)

    def spans(self, origins, directions, t_max) -> Spans:
        """See Inside."""
        n = len(origins)
        box = self._box.spans(origins, directions, np.full(n, np.inf))
        rows = np.flatnonzero(box.leave[:, 0] > box.enter[:, 0])
        crossings, turns = [np.zeros(n)], []
        start = np.zeros(n)
        for _ in range(CROSSINGS):
            if rows.size == 0:
                break
            here = origins[rows] + directions[rows] * start[rows, None]
            hits = self._tracer.intersect(here.astype(np.float32), directions[rows].astype(np.float32))
            found = hits.primitive >= 0
            rows, reached = rows[found], hits.t[found].astype(np.float64)
            t, turn = np.full(n, np.inf), np.zeros(n, np.int64)
            t[rows] = start[rows] + reached
            turn[rows] = np.where(dot(self._geometry.normals_world[hits.primitive[found]], directions[rows]) > 0, 1, -1)
            crossings.append(t)
            turns.append(turn)
            length = np.sqrt(dot(directions[rows], directions[rows]))
            start[rows] = t[rows] + SELF_INTERSECTION * (np.abs(here[found]).max(axis=1) + reached * length) / length
        # What leaves the surface ahead, less what enters it, is how often it winds about the origin.
        winding = np.sum(turns, axis=0) if turns else np.zeros(n, np.int64)
        edges = np.stack([*crossings, np.full(n, np.inf)], axis=1)
        within = np.cumsum(np.stack([winding, *(-turn for turn in turns)], axis=1), axis=1) != 0
        limits = np.minimum(np.asarray(t_max, np.float64), np.maximum(box.leave[:, 0], 0.0))[:, None]
        enter = np.minimum(np.clip(np.where(within, edges[:, :-1], 0.0), box.enter, None), limits)
        return Spans(enter, np.maximum(np.where(within, np.minimum(edges[:, 1:], limits), 0.0), enter))

    def contains(self, points) -> np.ndarray:
        """See Inside."""
        # No direction in which modelled faces tend to lie edge on.
        direction = np.broadcast_to(np.array([0.2672612, 0.5345225, 0.8017837]), (len(points), 3))
        spans = self.spans(np.asarray(points, np.float64), direction, np.full(len(points), np.inf))
        return np.any((spans.enter <= 0) & (spans.leave > 0), axis=1)


def inside_of(mesh: ClosedMesh, threads: int | None = None) -> Inside:
    """The inside of a closed mesh, by the cheapest way that knows it."""
    vertices = transform_points(mesh.world_from_local, mesh.vertices_local)
    planes = _convex_planes(vertices, mesh.triangles)
    return Winding(mesh, threads) if planes is None else Convex(planes)


def _convex_planes(vertices: np.ndarray, triangles: np.ndarray) -> np.ndarray | None:
    """The different planes (p, 4) of a convex mesh's faces; None if it is not convex, or has too many."""
    vertices = vertices[np.unique(triangles)]
    corners = vertices[np.searchsorted(np.unique(triangles), triangles)]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    lengths = np.linalg.norm(normals, axis=1)
    size = np.linalg.norm(np.ptp(vertices, axis=0))
    kept = lengths > FLAT**2 * size**2
    normals, corners = normals[kept] / lengths[kept, None], corners[kept]
    normals *= np.sign(np.einsum("ij,ij->i", normals, corners[:, 0] - vertices.mean(axis=0)))[:, None]
    planes = np.concatenate([normals, -np.einsum("ij,ij->i", normals, corners[:, 0])[:, None]], axis=1)
    scaled = planes / np.array([1.0, 1.0, 1.0, max(size, 1e-30)])
    _, first = np.unique(np.round(scaled / (4 * FLAT)), axis=0, return_index=True)
    planes = planes[np.sort(first)]
    if not 4 <= len(planes) <= PLANES or np.any(vertices @ planes[:, :3].T + planes[:, 3] > FLAT * size):
        return None
    return planes
