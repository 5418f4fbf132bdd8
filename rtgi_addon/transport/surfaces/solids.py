"""Which triangles bound solid matter: closed, outward-facing shells that keep light out, with no lamp, camera or emitter inside,
and the shells of the rooms in them, which face inwards and may have all of that.

A hit on the back of such a triangle means that the ray started inside a wall or a piece of furniture. The back of an open
sheet, or of a box that serves as a room, means nothing of the kind.
"""

import numpy as np

from ...scene import Mesh, Scene
from .geometry import Geometry
from .materials import Surfaces

# A shell that lets through more than this share of the light that falls on it is no wall: what lies inside is lit.
LIGHT_TIGHT = 0.01


class Solids:
    """Answers per triangle, and looks at a mesh only when a ray meets its back."""

    def __init__(self, scene: Scene, geometry: Geometry, surfaces: Surfaces):
        self._scene, self._geometry, self._surfaces = scene, geometry, surfaces
        self._components: dict[int, tuple[np.ndarray, np.ndarray]] = {}
        self._solid_of_instance: dict[int, np.ndarray] = {}
        self._anchors = None

    def is_solid(self, primitive: np.ndarray) -> np.ndarray:
        """(n,) bool: whether each triangle (n,) bounds a solid."""
        result = np.zeros(len(primitive), bool)
        instances = self._geometry.instance[primitive]
        for instance in np.unique(instances):
            rows = np.flatnonzero(instances == instance)
            if instance not in self._solid_of_instance:
                self._solid_of_instance[int(instance)] = self._solid_triangles(int(instance))
            result[rows] = self._solid_of_instance[int(instance)][self._geometry.local_triangle[primitive[rows]]]
        return result

    def _solid_triangles(self, instance: int) -> np.ndarray:
        index = self._scene.instances[instance].mesh
        if index not in self._components:
            self._components[index] = closed_components(self._scene.meshes[index])
        label, closed = self._components[index]
        solid = closed[label]
        if not solid.any():
            return solid
        triangles = self._geometry.triangles_world[self._geometry.instance == instance].astype(np.float64)
        volume = np.einsum("ij,ij->i", triangles[:, 0] - triangles[0, 0],
                           np.cross(triangles[:, 1] - triangles[0, 0], triangles[:, 2] - triangles[0, 0]))
        if np.linalg.det(np.asarray(self._scene.instances[instance].world_from_local)[:3, :3]) < 0:
            volume = -volume
        outward = np.bincount(label, volume, minlength=len(closed)) > 0
        keep = closed & outward
        if keep.any():
            rows = np.flatnonzero(self._geometry.instance == instance)
            areas = self._geometry.areas[rows].astype(np.float64)
            through = np.bincount(label, areas * self._surfaces.passed(rows), minlength=len(closed))
            keep &= through <= LIGHT_TIGHT * np.bincount(label, areas, minlength=len(closed))
        shells = {int(component): triangles[label == component] for component in np.flatnonzero(keep)}
        rooms = _rooms(shells, {int(component): triangles[label == component] for component in np.flatnonzero(closed & ~outward)})
        for component, shell in shells.items():
            keep[component] = not self._holds_anchor(shell, [room for room, _ in rooms[component]], instance)
            keep[[number for _, number in rooms[component]]] = keep[component]
        return keep[label]

    def _holds_anchor(self, shell: np.ndarray, rooms: list[np.ndarray], instance: int) -> bool:
        """Whether a lamp, a camera or an emitter lies in what ``shell`` (t, 3, 3) bounds, and in none of its ``rooms``."""
        if self._anchors is None:
            self._anchors = self._find_anchors()
        points, owners = self._anchors
        points = points[_within(points, _box(shell)) & (owners != instance)]
        return any(winding_number(shell, point) > 0.5 and not any(winding_number(room, point) > 0.5 for room in rooms)
                   for point in points)

    def _find_anchors(self) -> tuple[np.ndarray, np.ndarray]:
        points = [light.position_world for light in self._scene.lights if hasattr(light, "position_world")]
        points += [np.asarray(camera.world_from_camera)[:3, 3] for camera in self._scene.cameras]
        owners = [-1] * len(points)
        emissive = np.flatnonzero(self._surfaces.emissive[self._geometry.material])
        instances, first = np.unique(self._geometry.instance[emissive], return_index=True)
        points += list(self._geometry.triangles_world[emissive[first]].mean(axis=1))
        owners += list(instances)
        return np.array(points, np.float64).reshape(-1, 3), np.array(owners, np.int64)


def _rooms(shells: dict[int, np.ndarray], inwards: dict[int, np.ndarray]) -> dict[int, list[tuple[np.ndarray, int]]]:
    """For each of the ``shells`` by number, of triangles (t, 3, 3), those of ``inwards`` that lie in it and in no smaller one, with
    their numbers."""
    rooms: dict[int, list[tuple[np.ndarray, int]]] = {number: [] for number in shells}
    if not shells or not inwards:
        return rooms
    numbers = np.array(list(shells))
    boxes = np.array([_box(shell) for shell in shells.values()])
    by_size = np.argsort(np.prod(boxes[:, 1] - boxes[:, 0], axis=1), kind="stable")
    for number, room in inwards.items():
        point = room[0, 0]
        about = by_size[np.all((boxes[by_size, 0] < point) & (boxes[by_size, 1] > point), axis=1)]
        shell = next((int(numbers[row]) for row in about if winding_number(shells[int(numbers[row])], point) > 0.5), None)
        if shell is not None:
            rooms[shell].append((room, number))
    return rooms


def _box(triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The corners of the box about ``triangles`` (t, 3, 3)."""
    points = triangles.reshape(-1, 3)
    return points.min(axis=0), points.max(axis=0)


def _within(points: np.ndarray, box: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
    return np.all((points > box[0]) & (points < box[1]), axis=1)


def closed_components(mesh: Mesh) -> tuple[np.ndarray, np.ndarray]:
    """Connected parts of a mesh: a label per triangle (t,), and whether each part (c,) is closed: every edge is shared by two
    triangles that run through it in opposite directions.

    Parts that are open by their vertices' indices are looked at again by their positions: files like glTF split vertices wherever
    normals or UV break, and a box of theirs is six loose quads.
    """
    triangles = mesh.triangles.astype(np.int64)
    label, closed = _parts(triangles, len(mesh.vertices_local))
    loose = np.flatnonzero(~closed[label])
    if loose.size == 0:
        return label, closed
    point = _first_of_equal(mesh.vertices_local)
    welded_label, welded_closed = _parts(point[triangles[loose]], len(point))
    label[loose] = len(closed) + welded_label
    kept, label = np.unique(label, return_inverse=True)
    return label.reshape(-1), np.concatenate([closed, welded_closed])[kept]


def _parts(triangles: np.ndarray, vertex_count: int) -> tuple[np.ndarray, np.ndarray]:
    """``closed_components`` of ``triangles`` (t, 3) as their indices tell it. Those that name a vertex twice have no say in it."""
    label = connected(triangles, vertex_count)
    of_row = np.flatnonzero(np.all(triangles != np.roll(triangles, -1, axis=1), axis=1))
    triangles = triangles[of_row]
    start, end = triangles.reshape(-1), np.roll(triangles, -1, axis=1).reshape(-1)
    low, high = np.minimum(start, end), np.maximum(start, end)
    order = np.argsort(low * (vertex_count + 1) + high, kind="stable")
    low, high, direction = low[order], high[order], np.where(start < end, 1, -1)[order]
    first = np.flatnonzero(np.append(True, (low[1:] != low[:-1]) | (high[1:] != high[:-1])))
    count = np.diff(np.append(first, len(low)))
    good = (count == 2) & (np.add.reduceat(direction, first) == 0)
    closed = np.ones(int(label.max(initial=-1)) + 1, bool)
    closed[label[of_row[order[first[~good]] // 3]]] = False
    return label, closed


def _first_of_equal(positions: np.ndarray) -> np.ndarray:
    """For each of ``positions`` (n, 3), one index (n,) that all with the very same coordinates share."""
    order = np.lexsort(positions.T)
    ordered = positions[order]
    first = np.append(True, np.any(ordered[1:] != ordered[:-1], axis=1))
    shared = np.empty(len(positions), np.int64)
    shared[order] = order[np.flatnonzero(first)[np.cumsum(first) - 1]]
    return shared


def connected(triangles: np.ndarray, vertex_count: int) -> np.ndarray:
    """Part (t,) of each triangle: the lowest vertex reachable, by hooking and pointer jumping (Shiloach and Vishkin 1982)."""
    parent = np.arange(vertex_count)
    while True:
        lowest = parent[triangles].min(axis=1)
        before = parent.copy()
        for corner in range(3):
            np.minimum.at(parent, parent[triangles[:, corner]], lowest)
        while not np.array_equal(parent, parent[parent]):
            parent = parent[parent]
        if np.array_equal(parent, before):
            break
    return np.unique(parent[triangles[:, 0]], return_inverse=True)[1].reshape(-1)


def winding_number(triangles: np.ndarray, point: np.ndarray) -> float:
    """How often closed ``triangles`` (t, 3, 3) go around ``point`` (3,): 1 inside, 0 outside (Van Oosterom and Strackee 1983)."""
    a, b, c = (triangles[:, i] - point for i in range(3))
    la, lb, lc = (np.linalg.norm(side, axis=1) for side in (a, b, c))
    numerator = np.einsum("ij,ij->i", a, np.cross(b, c))
    denominator = (la * lb * lc + np.einsum("ij,ij->i", a, b) * lc + np.einsum("ij,ij->i", b, c) * la
                   + np.einsum("ij,ij->i", c, a) * lb)
    return float(np.abs(2.0 * np.arctan2(numerator, denominator).sum()) / (4.0 * np.pi))
