"""Media that differ from place to place, sampled on a lattice by Blender itself: nodes by Cycles, grids of volumes by geometry
nodes.

The lattice is that of ``scene.DensityGrid``: cell-centred samples of a box in an object's own space.
"""

from dataclasses import dataclass
from typing import NamedTuple

import bpy
import numpy as np

from ...numerics.grid import lattice_points
from ...scene import Phase
from ..materials import BakeRequest
from ..materials.circumstances import Ray
from ..materials.fallback import BAKE_MAPPING, BakedNodes, Leaf, bake_on_corners
from ..materials.images import ImageCache
from ..materials.links import follow, volume_of
from ..materials.media import MediumReader, merged
from ..materials.nodes import NodeReader
from ..materials.values import ComputedTexture, Unreadable, Value, apply, texels

# What Volume Info gives, by the names of the grids that it reads.
_VOLUME_INFO = {"Color": "color", "Density": "density", "Flame": "flame", "Temperature": "temperature"}
# Who asks the nodes: a ray between surfaces.
_RAY = Ray("diffuse")


@dataclass(frozen=True, eq=False)
class Lattice:
    """Where a medium is sampled: the box local [−1, 1]³ under ``object_from_box`` (4, 4), in the space of its object."""

    object_from_box: np.ndarray
    resolution: tuple[int, int, int]

    @staticmethod
    def around(low, high, cells) -> "Lattice":
        """The lattice of ``cells`` (3,) over a box from ``low`` to ``high`` (3,)."""
        matrix = np.diag([*np.maximum(0.5 * (np.asarray(high) - low), 1e-9), 1.0])
        matrix[:3, 3] = 0.5 * (np.asarray(low) + high)
        return Lattice(matrix, tuple(int(count) for count in cells))

    @property
    def shape(self) -> tuple[int, int, int]:
        """Of arrays over it: [z, y, x]."""
        return self.resolution[::-1]

    def points(self) -> np.ndarray:
        """(n, 3) float64 in the object's space."""
        return lattice_points(self.object_from_box, self.resolution).reshape(-1, 3)


class _LatticeNodes(BakedNodes):
    """Evaluates what is constant, and what nodes make of ``grids``; Cycles bakes the rest on the points of a lattice."""

    def __init__(self, images, baked, placed, wanted, grids):
        super().__init__(images, baked, _RAY, placed, wanted)
        self._grids = grids

    def output(self, out, path: tuple) -> Value:
        """See NodeReader."""
        node = out.node
        if node.bl_idname == "ShaderNodeVolumeInfo":
            return self._grids.get(_VOLUME_INFO[out.identifier], Value.of(0.0))
        if node.bl_idname == "ShaderNodeAttribute" and node.attribute_type == "GEOMETRY" and node.attribute_name in self._grids:
            grid = self._grids[node.attribute_name]
            return grid if out.identifier != "Fac" else apply(lambda x: np.repeat(x.mean(axis=-1, keepdims=True), 3, -1), grid)
        try:
            value = NodeReader.output(self, out, path)
            if value.is_constant or (value.attribute is None and value.mapping == BAKE_MAPPING):
                return value
        except Unreadable:
            pass
        if _asks_volume_info(out, path):
            raise Unreadable(node.label or node.name, "it follows Volume Info, which no bake can answer; an Attribute node can")
        return self.leaf(out, path, "EMIT")


class Sampled(NamedTuple):
    """One part of a medium over the points of a lattice: σ_s, σ_a [1/m] and emission [W·sr⁻¹·m⁻³] (n, 3) float32."""

    scattering: np.ndarray
    absorption: np.ndarray
    emission: np.ndarray
    phase: Phase


def sampled_parts(name: str, material, lattice: Lattice, world_from_object, scene, placed: tuple = (), texspace=None,
                  grids: dict[str, np.ndarray] | None = None, remarks: list[str] | None = None) -> list[Sampled]:
    """The volume of a bpy ``material`` over the ``lattice`` of the object ``name``.

    ``texspace`` (location, size) is that of the mesh; ``grids`` are its values (n,) or (n, 3) at the lattice's points by name.
    Raises Unreadable, and BakeError if Cycles cannot bake. Runs Blender operators.
    """
    points, grids = lattice.points(), grids or {}
    order = _order(len(points))
    mesh = _scattered_mesh(points[order], {key: values[order] for key, values in grids.items()})
    known = {key: _known(values[order], key) for key, values in grids.items()}
    images = ImageCache([])
    try:
        if texspace is not None:
            mesh.use_auto_texspace = False
            mesh.texspace_location, mesh.texspace_size = texspace
        request = BakeRequest(name, mesh, [material], [placed], (0,), world_from_object)
        baked: dict[Leaf, Value] = {}
        while True:
            wanted: list[Leaf] = []
            reader = MediumReader(_LatticeNodes(images, baked, placed, wanted, known), known.get)
            parts = merged(reader.parts(*volume_of(material)))
            if not wanted:
                break
            baked |= bake_on_corners(request, {0: wanted}, scene)[0]
    finally:
        bpy.data.meshes.remove(mesh)
    if remarks is not None:
        remarks += reader.remarks
    return [Sampled(*(_over(value, order) for value in (part.scattering, part.absorption, part.emission)), part.phase)
            for part in parts]


def sampled_grids(volume, names: dict[str, str], lattice: Lattice) -> dict[str, np.ndarray]:
    """Grids of a VOLUME object (an original one, with its modifiers) at the lattice's points, by name: (n,) of 'FLOAT' and (n, 3)
    of 'VECTOR', as ``names`` says. Interpolated as Blender does, its background outside.

    Raises Unreadable where this Blender cannot (the nodes came with 5.0). Runs no operator, but evaluates a scene of its own.
    """
    if not hasattr(bpy.types, "GeometryNodeSampleGrid") or not hasattr(bpy.types, "GeometryNodeGetNamedGrid"):
        raise Unreadable(volume.name, f"Blender {bpy.app.version_string} cannot read its grids; 5.0 and later can")
    points, made = lattice.points(), []
    try:
        mesh = bpy.data.meshes.new("rtgi lattice")
        made.append((bpy.data.meshes, mesh))
        mesh.vertices.add(len(points))
        mesh.vertices.foreach_set("co", points.astype(np.float32).ravel())
        holder = bpy.data.objects.new("rtgi lattice", mesh)
        made.append((bpy.data.objects, holder))
        tree = bpy.data.node_groups.new("rtgi lattice", "GeometryNodeTree")
        made.append((bpy.data.node_groups, tree))
        _sample_by_nodes(tree, volume, names)
        holder.modifiers.new("rtgi lattice", "NODES").node_group = tree
        scene = bpy.data.scenes.new("rtgi lattice")
        made.append((bpy.data.scenes, scene))
        scene.collection.objects.link(holder)
        layer = scene.view_layers[0]
        layer.update()
        found = holder.evaluated_get(layer.depsgraph).data.attributes
        grids = {name: _read(found[name], len(points)) for name in names if name in found}
    finally:
        for collection, datablock in reversed(made):
            collection.remove(datablock)
    if not grids:
        raise Unreadable(volume.name, "nodes make its grids anew on each instance")
    return grids


def _sample_by_nodes(tree, volume, names: dict[str, str]) -> None:
    """Nodes that store every grid of ``volume`` as an attribute of the points that come in."""
    for direction in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=direction, socket_type="NodeSocketGeometry")
    source, position = tree.nodes.new("GeometryNodeObjectInfo"), tree.nodes.new("GeometryNodeInputPosition")
    source.transform_space, source.inputs["Object"].default_value = "ORIGINAL", volume
    geometry = tree.nodes.new("NodeGroupInput").outputs[0]
    for name, kind in names.items():
        grid, sample, store = (tree.nodes.new(f"GeometryNode{node}")
                               for node in ("GetNamedGrid", "SampleGrid", "StoreNamedAttribute"))
        grid.data_type = sample.data_type = kind
        store.data_type, store.domain = ("FLOAT" if kind == "FLOAT" else "FLOAT_VECTOR"), "POINT"
        grid.inputs["Name"].default_value = store.inputs["Name"].default_value = name
        for start, end in ((source.outputs["Geometry"], grid.inputs["Volume"]), (grid.outputs["Grid"], sample.inputs["Grid"]),
                           (position.outputs["Position"], sample.inputs["Position"]),
                           (sample.outputs["Value"], store.inputs["Value"]), (geometry, store.inputs["Geometry"])):
            tree.links.new(start, end)
        geometry = store.outputs["Geometry"]
    tree.links.new(geometry, tree.nodes.new("NodeGroupOutput").inputs[0])


def _read(attribute, count: int) -> np.ndarray:
    scalar = attribute.data_type == "FLOAT"
    values = np.empty(count if scalar else count * 3, np.float32)
    attribute.data.foreach_get("value" if scalar else "vector", values)
    return values if scalar else values.reshape(-1, 3)


def _order(count: int) -> np.ndarray:
    """The points that corners of triangles lie on: all of them, shuffled, for neighbours in a row would make triangles without an
    area; some twice where ``count`` is no multiple of three."""
    order = np.random.default_rng(0).permutation(count)
    return np.resize(order, -(-count // 3) * 3)


def _scattered_mesh(points: np.ndarray, grids: dict[str, np.ndarray]):
    """A bpy mesh of loose triangles with its corners at ``points`` (n, 3), n a multiple of 3, and ``grids`` as attributes."""
    count = len(points)
    mesh = bpy.data.meshes.new("rtgi lattice")
    mesh.vertices.add(count)
    mesh.vertices.foreach_set("co", points.astype(np.float32).ravel())
    mesh.loops.add(count)
    mesh.loops.foreach_set("vertex_index", np.arange(count, dtype=np.int32))
    mesh.polygons.add(count // 3)
    mesh.polygons.foreach_set("loop_start", np.arange(0, count, 3, dtype=np.int32))
    mesh.update(calc_edges=True)
    for name, values in grids.items():
        scalar = values.ndim == 1
        attribute = mesh.attributes.new(name, "FLOAT" if scalar else "FLOAT_VECTOR", "POINT")
        attribute.data.foreach_set("value" if scalar else "vector", np.ascontiguousarray(values, np.float32).ravel())
    return mesh


def _known(values: np.ndarray, name: str) -> Value:
    """A grid's values at the corners, as Cycles would have baked them."""
    rgb = np.repeat(values[:, None], 3, axis=1) if values.ndim == 1 else values
    texture = ComputedTexture(name, np.ascontiguousarray(rgb, np.float32)[None], False, "EXTEND")
    return Value(np.ones(3, np.float32), texture, mapping=BAKE_MAPPING)


def _over(value: Value, order: np.ndarray) -> np.ndarray:
    """A value at the corners ``order`` as an array over the points (n, 3)."""
    result = np.empty((order.max() + 1, 3), np.float32)
    result[order] = value.constant if value.is_constant else texels(value)[0]
    return result


def _asks_volume_info(out, path: tuple) -> bool:
    """Whether an output is made from what Volume Info says."""
    pending, seen = [(out.node, path)], set()
    while pending:
        node, where = pending.pop()
        if node.as_pointer() in seen:
            continue
        seen.add(node.as_pointer())
        if node.bl_idname == "ShaderNodeVolumeInfo":
            return True
        for socket in node.inputs:
            (found, inner), _types = follow(socket, where)
            if found.is_output:
                pending.append((found.node, inner))
    return False
