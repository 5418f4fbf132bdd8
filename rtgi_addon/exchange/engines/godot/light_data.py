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
from itertools import permutations

import numpy as np

from ..volumes import ExportVolume

# How many times the bounds are larger than the volumes: Godot darkens objects towards the corners of the bounds, and black out.
_REACH = 4.0
_ORDERS = tuple(permutations(range(3)))
# Within a cell: x > y; if so y > z, else x > z; if neither ends it x > z or y > z. Over and under, a leaf is -1 - tetrahedron.
_CELL_NODES = 5
_CELL_NORMALS = np.array([[1, -1, 0], [0, 1, -1], [1, 0, -1], [1, 0, -1], [0, 1, -1]], np.float64)
_CELL_CHILDREN = np.array([[1, 2], [-1 - _ORDERS.index((0, 1, 2)), 3], [-1 - _ORDERS.index((1, 0, 2)), 4],
                           [-1 - _ORDERS.index((0, 2, 1)), -1 - _ORDERS.index((2, 0, 1))],
                           [-1 - _ORDERS.index((1, 2, 0)), -1 - _ORDERS.index((2, 1, 0))]])


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
    """The capture data of ``volumes``, finest first; of scattered ones on their nodes."""
    volumes = tuple(volume.on_nodes for volume in volumes)
    points, sh, tetrahedra, planes, children = [], [], [], [], []
    first_point = first_tetrahedron = first_node = 0
    for number, volume in enumerate(volumes):
        own_points, own_sh, own_tetrahedra = _lattice(volume)
        own_planes, own_children = _tree(volume, first_node, first_tetrahedron, gated=number + 1 < len(volumes))
        points.append(own_points)
        sh.append(own_sh)
        tetrahedra.append(own_tetrahedra + first_point)
        planes.append(own_planes)
        children.append(own_children)
        first_point += len(own_points)
        first_tetrahedron += len(own_tetrahedra)
        first_node += len(own_planes)
    points = np.concatenate(points).astype(np.float32)
    low, high = points.min(axis=0), points.max(axis=0)
    centre, half = 0.5 * (low + high), _REACH * 0.5 * (high - low)
    return LightData(points, np.concatenate(sh), np.concatenate(tetrahedra).astype(np.int32),
                     np.concatenate(planes).astype(np.float32), np.concatenate(children).astype(np.int32),
                     np.stack([centre - half, 2.0 * half]))


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


def _tree(volume: ExportVolume, first_node: int, first_tetrahedron: int, gated: bool) -> tuple[np.ndarray, np.ndarray]:
    """Planes (b, 4) and children (b, 2), over and under, of one volume: if ``gated`` the six sides of its box, what lies over
    any of which is sent on to the next volume's tree; then the k-d tree over the cells, then the comparisons in each cell."""
    gates = 6 if gated else 0
    root = first_node + gates
    axes, positions, children = _cells(volume.resolution)
    cells = len(positions) + 1
    first_cell = root + len(positions)
    children = np.where(children < 0, first_cell + _CELL_NODES * (-1 - children), root + children)
    coordinates = [_coordinates(count) for count in volume.resolution]
    splits = np.array([coordinates[axis][position] for axis, position in zip(axes, positions, strict=True)])
    planes = [_planes(volume, np.eye(3)[axes], splits), _comparisons(volume, coordinates)]
    number = np.arange(cells)[:, None, None]
    inner = np.where(_CELL_CHILDREN < 0, _CELL_CHILDREN - first_tetrahedron - len(_ORDERS) * number,
                     first_cell + _CELL_NODES * number + _CELL_CHILDREN)
    children = [children, inner.reshape(-1, 2)]
    if gated:
        normals = np.concatenate([np.eye(3), -np.eye(3)])
        planes.insert(0, _planes(volume, normals, np.concatenate([np.array(volume.resolution) - 0.5, np.full(3, 0.5)])))
        after = first_node + gates + len(positions) + _CELL_NODES * cells
        children.insert(0, np.stack([np.full(gates, after), np.arange(first_node + 1, first_node + gates + 1)], axis=1))
    return np.concatenate(planes), np.concatenate(children)


def _planes(volume: ExportVolume, normals: np.ndarray, distances: np.ndarray) -> np.ndarray:
    """World planes (n, 4) with unit normals of n·l = distance in lattice coordinates."""
    matrix = volume.lattice_from_offset
    world = normals @ matrix[:3, :3]
    planes = np.concatenate([world, (distances - normals @ matrix[:3, 3] + world @ volume.centre)[:, None]], axis=1)
    return planes / np.linalg.norm(world, axis=1, keepdims=True)


def _cells(resolution) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The k-d tree over the cells between the points of a lattice: per node the axis (n,) and the point (n,) that split it, and its
    children (n, 2), upper and lower: another node, or -1 - cell."""
    counts = [count + 1 for count in resolution]
    axes, positions, children = [], [], []
    pending = [((0, 0, 0), tuple(counts), None)]
    while pending:
        low, high, parent = pending.pop()
        sides = [b - a for a, b in zip(low, high, strict=True)]
        longest = max(sides)
        if longest == 1:
            node = -1 - ((low[2] * counts[1] + low[1]) * counts[0] + low[0])
        else:
            node, axis = len(axes), sides.index(longest)
            middle = (low[axis] + high[axis]) // 2
            axes.append(axis)
            positions.append(middle)
            children.append([0, 0])
            split = middle,
            pending.append((low[:axis] + split + low[axis + 1:], high, (node, 0)))
            pending.append((low, high[:axis] + split + high[axis + 1:], (node, 1)))
        if parent is not None:
            children[parent[0]][parent[1]] = node
    return np.array(axes), np.array(positions), np.array(children)


def _comparisons(volume: ExportVolume, coordinates: list[np.ndarray]) -> np.ndarray:
    """The planes (cells * 5, 4) on which two of a cell's coordinates, each from 0 to 1, are equal."""
    corners = np.meshgrid(*(axis[:-1] for axis in reversed(coordinates)), indexing="ij")
    widths = np.meshgrid(*(np.diff(axis) for axis in reversed(coordinates)), indexing="ij")
    corner, width = (np.stack(parts[::-1], axis=-1).reshape(-1, 3) for parts in (corners, widths))
    normals = _CELL_NORMALS / width[:, None]
    distances = np.einsum("cni,ci->cn", normals, corner)
    return _planes(volume, normals.reshape(-1, 3), distances.reshape(-1))


def _numbers(values: np.ndarray) -> str:
    flat = np.ravel(values)
    return ", ".join(map(str, flat.tolist()) if flat.dtype.kind == "i" else (f"{value:.9g}" for value in flat.tolist()))
