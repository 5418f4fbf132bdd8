"""The door to materials: what extraction calls, a cache per datablock, and the report."""

from dataclasses import dataclass, replace
from functools import cached_property

import bpy
import numpy as np

from ...jobs.fingerprint import content_hash
from ...scene import Channel, Material, Mesh
from ..fingerprint import node_digest
from ..remembered import answer
from .fallback import BAKE_UV, BakedNodes, BakedShaders, bake_leaves, wanted_leaves
from .images import ImageCache
from .nodes import ACTIVE_COLOR, NodeReader
from .shaders import ShaderReader, Surface, default_surface
from .values import Unreadable, Value, apply, texels

__all__ = ["ACTIVE_COLOR", "BakeRequest", "MaterialReader"]


@dataclass(eq=False)
class BakeRequest:
    """A mesh copied for a later Cycles bake, with the materials of its slots and which of them need it."""

    name: str
    mesh: bpy.types.Mesh
    materials: list
    slots: tuple[int, ...]
    world_from_local: object
    color: tuple
    pass_index: int


class MaterialReader:
    """Reads each bpy material once.

    ``notes`` are lines for the user: materials read through Cycles and why, missing images, approximations. ``attributes`` are
    the names of the mesh attributes that channels read so far refer to.
    """

    def __init__(self, scene, depsgraph):
        self.notes: list[str] = []
        self.attributes: set[str] = set()
        self._scene, self._depsgraph = scene, depsgraph
        self._images = ImageCache(self.notes)
        self._read: dict[str, Material | None] = {}
        self._requests: list[BakeRequest] = []

    def __enter__(self) -> "MaterialReader":
        return self

    def __exit__(self, *_exception) -> None:
        for request in list(self._requests):
            self._discard(request)

    def read(self, material) -> Material | None:
        """The material as nodes give it (``None`` is Blender's default surface); None if it takes a Cycles bake on each mesh."""
        if material is None:
            return self._default
        material = material.original
        if material.name_full not in self._read:
            self._read[material.name_full] = self._from_nodes(material)
        return self._read[material.name_full]

    def request_bake(self, evaluated_object, materials, world_from_local) -> BakeRequest:
        """Copy the evaluated geometry, to bake those ``materials`` (one bpy material or None per slot) that ``read`` refuses."""
        # Asked to preserve all layers, this would evaluate the original anew and lose instances made by geometry nodes.
        mesh = bpy.data.meshes.new_from_object(evaluated_object)
        originals = [None if material is None else material.original for material in materials]
        slots = tuple(slot for slot, material in enumerate(originals) if self.read(material) is None)
        request = BakeRequest(evaluated_object.name, mesh, originals, slots, world_from_local.copy(),
                              tuple(evaluated_object.color), evaluated_object.pass_index)
        self._requests.append(request)
        return request

    def bake(self, request: BakeRequest, mesh: Mesh, corner_loops: np.ndarray) -> tuple[Mesh, dict[int, Material]]:
        """Bake a request: the mesh with what the new channels need (a UV map or corner attributes), and a Material per slot.

        ``corner_loops`` (t, 3) int: the loop index, in the evaluated mesh, of every corner of ``mesh.triangles``. Raises
        BakeError if Cycles cannot bake. Each request is baked once.
        """
        try:
            leaves = {slot: wanted_leaves(self._images, request.materials[slot]) for slot in request.slots}
            baked, uv = answer(lambda: _digest(request, mesh), lambda: bake_leaves(request, leaves, self._scene))
        finally:
            self._discard(request)
        attributes = dict(mesh.attributes)
        materials = {}
        for slot in request.slots:
            source = request.materials[slot]
            shaders = BakedShaders(BakedNodes(self._images, baked[slot]))
            material = self._material(source, shaders.surface(source), "cycles-bake")
            materials[slot] = material if uv is not None else _on_corners(material, attributes, corner_loops, slot)
        uv_layers = mesh.uv_layers if uv is None else {**mesh.uv_layers, BAKE_UV: uv[corner_loops]}
        return replace(mesh, uv_layers=uv_layers, attributes=attributes), materials

    def _from_nodes(self, material) -> Material | None:
        if material.node_tree is None or (bpy.app.version < (5, 0) and not material.use_nodes):  # always on from 5.0
            color = Value.of(tuple(material.diffuse_color)[:3])
            return self._material(material, Surface(color, base_color=color), "nodes")
        attributes: set[str] = set()
        shaders = ShaderReader(NodeReader(self._images, attributes))
        try:
            result = self._material(material, shaders.surface(material), "nodes")
        except Unreadable as unreadable:
            self._note(f"material '{material.name}' was read by a Cycles bake, because of {unreadable}")
            return None
        for remark in shaders.remarks:
            self._note(f"material '{material.name}': {remark}")
        self.attributes |= attributes
        return result

    @cached_property
    def _default(self) -> Material:
        # Up to 4.5 it was a plain diffuse one.
        surface = default_surface() if bpy.app.version >= (5, 0) else Surface(Value.of(0.8), base_color=Value.of(0.8))
        return Material("default", _channel(surface.albedo), base_color=_channel(surface.base_color),
                        roughness=_channel(surface.roughness), specular=_channel(surface.specular))

    def _material(self, source, surface: Surface, extraction: str) -> Material:
        """A surface as a Material. Raises Unreadable if a channel cannot hold it."""
        alpha, threshold = surface.alpha, None
        if alpha.cut is not None:
            threshold, above = alpha.cut
            alpha = replace(alpha, cut=None)
            if not above:
                alpha, threshold = 1.0 - alpha, 1.0 - threshold
        base = surface.albedo if surface.base_color is None else surface.base_color
        return Material(
            source.name, _channel(surface.albedo), _channel(surface.emission), _channel(alpha), threshold,
            _channel(base), _channel(surface.metallic), _channel(surface.roughness), source.use_backface_culling, extraction,
            _channel(surface.specular))

    def _note(self, line: str) -> None:
        if line not in self.notes:
            self.notes.append(line)

    def _discard(self, request: BakeRequest) -> None:
        if request in self._requests:
            self._requests.remove(request)
            bpy.data.meshes.remove(request.mesh)


def _digest(request: BakeRequest, mesh: Mesh) -> str:
    """What a Cycles bake of a request depends on."""
    placed = (tuple(map(tuple, request.world_from_local)), request.color, request.pass_index, request.slots)
    return node_digest(*request.materials) + content_hash((placed, mesh))


def _channel(value: Value) -> Channel:
    return (value if value.cut is None else apply(np.positive, value)).channel()


def _on_corners(material: Material, attributes: dict, corner_loops: np.ndarray, slot: int) -> Material:
    """The same material with channels read from corner attributes, which are added to ``attributes``."""
    changed = {}
    for name in ("albedo", "emission", "alpha", "base_color", "metallic", "roughness", "specular"):
        channel = getattr(material, name)
        if channel.texture is None:
            continue
        value = Value(channel.constant, channel.texture, channel.texture_channel, offset=channel.offset)
        corners = np.ones((*corner_loops.shape, 4), np.float32)
        corners[..., :3] = texels(value)[0][corner_loops]
        attributes[f"_rtgi_{name}_{slot}"] = corners
        changed[name] = Channel(attribute=f"_rtgi_{name}_{slot}")
    return replace(material, **changed)
