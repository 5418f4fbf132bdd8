"""Probe volumes as Godot's LightmapGIData, which lights dynamic objects as a whole and needs no shader of ours.

Godot looks for the tetrahedron around an object's centre in a BSP tree and blends the harmonics (L / pi) of its four points. A
lattice is degenerate for the Delaunay tetrahedra that Godot makes itself, so each cell is split into the six of Kuhn's
triangulation, in each of which one order of the cell's coordinates holds; and since all planes are known, so is the tree: a k-d
tree over the cells, then three comparisons. Points are lattice points, also where a probe was moved, and once more on the faces of
the box, so that the volume reaches as far as ours. Of overlapping volumes the finest one wins: the tree asks for its box first.

Read in Godot 4.6: `LightStorage::lightmap_tap_sh_light` (a node: plane normal and distance, node over, node under; a leaf is
-1 - tetrahedron; children come after their parents), `RendererSceneCull::_update_instance_lightmap_captures`,
`scene_forward_*.glsl`.
"""

from dataclasses import dataclass
from itertools import pairwise, permutations

import numpy as np

from ..volumes import ExportVolume

# How many times the bounds are larger than the volumes: Godot darkens objects towards the corners of the bounds, and black out.
_REACH = 4.0
_ORDERS = tuple(permutations(range(3)))


@dataclass(frozen=True, eq=False)
class LightData:
    """``points`` (n, 3) float32, ``sh`` (n, 9, 3) float32 of radiance over pi, ``tetrahedra`` (t, 4) int32, ``planes`` (b, 4)
    float32 and ``children`` (b, 2) int32 (over, under) of the tree, ``bounds`` (2, 3) position and size."""

    points: np.ndarray
    sh: np.ndarray
    tetrahedra: np.ndarray
    planes: np.ndarray
    children: np.ndarray
    bounds: np.ndarray

    def to_text(self) -> str:
        """The resource as a .tres file."""
        bsp = np.concatenate([self.planes.view(np.int32), self.children], axis=1)
        colours = np.concatenate([self.sh, np.ones((*self.sh.shape[:2], 1), np.float32)], axis=2)
        return "\n".join([
            '[gd_resource type="LightmapGIData" format=3]', "", "[resource]", "probe_data = {",
            '"baked_exposure": 1.0,',
            f'"bounds": AABB({_numbers(self.bounds)}),',
            f'"bsp": PackedInt32Array({_numbers(bsp)}),',
            '"interior": true,',
            '"lightprobe_hash": 0,',
            f'"points": PackedVector3Array({_numbers(self.points)}),',
            f'"sh": PackedColorArray({_numbers(colours)}),',
            f'"tetrahedra": PackedInt32Array({_numbers(self.tetrahedra)})',
            "}", ""])

    def tap(self, points: np.ndarray) -> np.ndarray:
        """SH (n, 9, 3) at ``points`` (n, 3) as Godot finds them: the tree, then barycentric weights cut to 0..1."""
        result = []
        for point in np.asarray(points, np.float64):
            node = 0
            while node >= 0:
                plane = self.planes[node]
                node = int(self.children[node, 0 if plane[:3] @ point > plane[3] else 1])
            corners = self.tetrahedra[-1 - node]
            a, b, c, d = self.points[corners].astype(np.float64)
            weights = np.linalg.solve(np.stack([b - a, c - a, d - a], axis=1), point - a)
            weights = np.clip([1.0 - weights.sum(), *weights], 0.0, 1.0)
            result.append(np.einsum("w,wkc->kc", weights, self.sh[corners]))
        return np.array(result)


def light_data(volumes: tuple[ExportVolume, ...]) -> LightData:
    """The capture data of ``volumes``, finest first."""
    tree = _Tree()
    points, sh, tetrahedra = [], [], []
    first_point = first_tetrahedron = 0
    for number, volume in enumerate(volumes):
        own_points, own_sh, own_tetrahedra = _lattice(volume)
        box = _box_planes(volume) if number + 1 < len(volumes) else []
        gates = [tree.node(plane) for plane in box]
        for gate, following in pairwise(gates):
            tree.children[gate][1] = following
        root = _cells_tree(tree, volume, first_tetrahedron)
        if gates:
            tree.children[gates[-1]][1] = root
            for gate in gates:
                tree.children[gate][0] = len(tree.planes)
        points.append(own_points)
        sh.append(own_sh)
        tetrahedra.append(own_tetrahedra + first_point)
        first_point += len(own_points)
        first_tetrahedron += len(own_tetrahedra)
    points = np.concatenate(points).astype(np.float32)
    low, high = points.min(axis=0), points.max(axis=0)
    centre, half = 0.5 * (low + high), _REACH * 0.5 * (high - low)
    return LightData(points, np.concatenate(sh), np.concatenate(tetrahedra).astype(np.int32), np.array(tree.planes, np.float32),
                     np.array(tree.children, np.int32), np.stack([centre - half, 2.0 * half]))


class _Tree:
    """Nodes as they are added: ``planes`` and ``children``, over and under."""

    def __init__(self):
        self.planes: list[np.ndarray] = []
        self.children: list[list[int]] = []

    def node(self, plane: np.ndarray) -> int:
        """The number of a new node with ``plane`` (4,), normal of unit length."""
        self.planes.append(plane)
        self.children.append([0, 0])
        return len(self.planes) - 1


def _coordinates(count: int) -> np.ndarray:
    """Lattice coordinates of the points along an axis with ``count`` probes: the probes, between the faces of the box."""
    return np.concatenate([[-0.5], np.arange(count), [count - 0.5]])


def _lattice(volume: ExportVolume) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points (n, 3) float64, harmonics (n, 9, 3) and tetrahedra (t, 4) of one volume, cell by cell, x fastest."""
    axes = [_coordinates(count) for count in volume.resolution]
    z, y, x = np.meshgrid(axes[2], axes[1], axes[0], indexing="ij")
    lattice = np.stack([x, y, z], axis=-1)
    matrix = volume.offset_from_lattice
    points = lattice @ matrix[:3, :3].T + matrix[:3, 3] + volume.centre
    probe = [np.clip(np.arange(-1, count + 1), 0, count - 1) for count in volume.resolution]
    sh = volume.sh[np.ix_(probe[2], probe[1], probe[0])] / np.float32(np.pi)
    shape = lattice.shape[:3]
    number = np.arange(np.prod(shape)).reshape(shape)
    lowest = number[:-1, :-1, :-1].reshape(-1, 1)
    strides = (1, shape[2], shape[2] * shape[1])
    corners = np.array([np.cumsum([0, *(strides[axis] for axis in order)]) for order in _ORDERS])
    tetrahedra = (lowest[:, None] + corners).reshape(-1, 4)
    return points.reshape(-1, 3), sh.reshape(-1, *sh.shape[3:]).astype(np.float32), tetrahedra


def _plane(volume: ExportVolume, normal_lattice: np.ndarray, distance: float) -> np.ndarray:
    """The world plane (4,) of n·l = ``distance`` in lattice coordinates."""
    matrix = volume.lattice_from_offset
    normal = normal_lattice @ matrix[:3, :3]
    distance = distance - normal_lattice @ matrix[:3, 3] + normal @ volume.centre
    return np.append(normal, distance) / np.linalg.norm(normal)


def _box_planes(volume: ExportVolume) -> list[np.ndarray]:
    """The six planes of the volume's box; what lies over any of them is outside."""
    planes = []
    for axis, count in enumerate(volume.resolution):
        unit = np.eye(3)[axis]
        planes += [_plane(volume, unit, count - 0.5), _plane(volume, -unit, 0.5)]
    return planes


def _cells_tree(tree: _Tree, volume: ExportVolume, first_tetrahedron: int) -> int:
    """Add the k-d tree over the cells of ``volume`` and return its root."""
    axes = [_coordinates(count) for count in volume.resolution]
    counts = [len(axis) - 1 for axis in axes]
    root = None
    pending = [(np.zeros(3, int), np.array(counts), None)]
    while pending:
        low, high, parent = pending.pop()
        sides = high - low
        if sides.max() == 1:
            cell = (low[2] * counts[1] + low[1]) * counts[0] + low[0]
            corner = np.array([axes[axis][low[axis]] for axis in range(3)])
            width = np.array([axes[axis][low[axis] + 1] for axis in range(3)]) - corner
            node = _cell_tree(tree, volume, corner, width, first_tetrahedron + len(_ORDERS) * int(cell))
        else:
            axis = int(np.argmax(sides))
            middle = (low[axis] + high[axis]) // 2
            node = tree.node(_plane(volume, np.eye(3)[axis], axes[axis][middle]))
            upper, lower = low.copy(), high.copy()
            upper[axis] = lower[axis] = middle
            pending += [(upper, high, (node, 0)), (low, lower, (node, 1))]
        if parent is None:
            root = node
        else:
            tree.children[parent[0]][parent[1]] = node
    return root


def _cell_tree(tree: _Tree, volume: ExportVolume, corner: np.ndarray, width: np.ndarray, first: int) -> int:
    """Add the comparisons that tell the six tetrahedra of one cell apart and return the first."""
    def compare(a: int, b: int) -> int:
        normal = np.zeros(3)
        normal[a], normal[b] = 1.0 / width[a], -1.0 / width[b]
        return tree.node(_plane(volume, normal, float(normal @ corner)))

    def leaf(*order: int) -> int:
        return -1 - (first + _ORDERS.index(order))

    x, y, z = range(3)
    root, over, under = compare(x, y), compare(y, z), compare(x, z)
    over_under, under_under = compare(x, z), compare(y, z)
    tree.children[root] = [over, under]
    tree.children[over] = [leaf(x, y, z), over_under]
    tree.children[over_under] = [leaf(x, z, y), leaf(z, x, y)]
    tree.children[under] = [leaf(y, x, z), under_under]
    tree.children[under_under] = [leaf(y, z, x), leaf(z, y, x)]
    return root


def _numbers(values: np.ndarray) -> str:
    flat = np.ravel(values)
    return ", ".join(map(str, flat.tolist()) if flat.dtype.kind == "i" else (f"{value:.9g}" for value in flat.tolist()))
