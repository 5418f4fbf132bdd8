"""The door to materials: what extraction calls, a cache per datablock, and the report."""

from dataclasses import dataclass, replace
from functools import cached_property

import bpy
import numpy as np

from ...jobs.fingerprint import content_hash
from ...scene import Channel, Material, Mesh, Omissions
from ..fingerprint import node_digest
from ..remembered import answer
from .attributes import ACTIVE_COLOR
from .circumstances import PLACEMENT, asks_of_material
from .detail import DETAIL_UV, detail_uv, in_detail
from .fallback import BAKE_UV, DETAIL_SIDE, BakedNodes, BakedShaders, Leaf, bake_leaves
from .images import ImageCache
from .links import nodes_of
from .look import with_look
from .nodes import NodeReader
from .placement import Placements
from .shaders import ShaderReader, Surface, default_surface
from .values import Unreadable, Value, texels
from .whole import whole_material

__all__ = ["ACTIVE_COLOR", "BakeRequest", "MaterialReader"]

# Angles over which a shader that varies with them is averaged: constants cost nothing, what takes a Cycles bake one each.
ANGLES, BAKED_ANGLES = 64, 8


@dataclass(eq=False)
class BakeRequest:
    """A mesh copied for a later Cycles bake, with the materials of its slots, what its object answers each, and which of them
    need it."""

    name: str
    mesh: bpy.types.Mesh
    materials: list
    placed: list[tuple]
    slots: tuple[int, ...]
    world_from_local: object


class MaterialReader:
    """Reads each bpy material once for all objects that look alike to it.

    ``notes`` are lines for the user: materials read through Cycles and why, images that were made smaller. ``omissions`` takes in
    what is not followed, or only nearly, with the materials. ``attributes`` are the names of the mesh attributes that channels read
    so far refer to. Without a ``depsgraph`` materials are read, but nothing can be ``placed``.
    """

    def __init__(self, scene, depsgraph, omissions: Omissions | None = None):
        self.notes: list[str] = []
        self.omissions = Omissions() if omissions is None else omissions
        self.attributes: set[str] = set()
        self._scene = scene
        self._images = ImageCache(self.notes, self._missing)
        self._material = ""
        self._placements = None if depsgraph is None else Placements(scene, depsgraph)
        self._asked: dict[str, frozenset] = {}
        self._read: dict[tuple, Material | None] = {}
        self._requests: list[BakeRequest] = []

    def __enter__(self) -> "MaterialReader":
        return self

    def __exit__(self, *_exception) -> None:
        for request in list(self._requests):
            self._discard(request)

    def asks_of_objects(self, material) -> bool:
        """Whether a bpy material may differ from one instance to the next: whether ``placed`` ever gives anything."""
        return material is not None and any(question[0] in PLACEMENT for question in self._asks(material.original))

    def placed(self, material, item) -> tuple:
        """What a bpy material (or None) asks about a ``DepsgraphObjectInstance``, with the answers: empty for most. Where it is
        equal, so is the material. Only while the dependency graph lives."""
        if not self.asks_of_objects(material):
            return ()
        return self._placements.answers(self._asks(material.original), item)

    def read(self, material, placed: tuple = ()) -> Material | None:
        """The material as nodes give it (``None`` is Blender's default surface) where it is ``placed``; None if it takes a Cycles
        bake on each mesh."""
        if material is None:
            return self._default
        material = material.original
        key = material.name_full, placed
        if key not in self._read:
            found = self._from_nodes(material, placed)
            self._read[key] = None if found is None else with_look(found, material)
        return self._read[key]

    def request_bake(self, evaluated_object, materials, world_from_local, placed=None, slots=None) -> BakeRequest:
        """Copy the evaluated geometry, to bake those ``materials`` (one bpy material or None per slot) that ``read`` refuses where
        they are ``placed`` (one per slot), or of those in ``slots`` something else."""
        # Asked to preserve all layers, this would evaluate the original anew and lose instances made by geometry nodes.
        mesh = bpy.data.meshes.new_from_object(evaluated_object)
        source = evaluated_object.original.data
        if isinstance(source, bpy.types.Mesh) and source.name == evaluated_object.data.name:
            # Generated coordinates are those of the mesh before its modifiers.
            mesh.use_auto_texspace = False
            mesh.texspace_location, mesh.texspace_size = source.texspace_location, source.texspace_size
        originals = [None if material is None else material.original for material in materials]
        placed = list(placed or [()] * len(originals))
        if slots is None:
            slots = tuple(slot for slot, material in enumerate(originals) if self.read(material, placed[slot]) is None)
        request = BakeRequest(evaluated_object.name, mesh, originals, placed, slots, world_from_local.copy())
        self._requests.append(request)
        return request

    def bake(self, request: BakeRequest, mesh: Mesh, corner_loops: np.ndarray) -> tuple[Mesh, dict[int, Material]]:
        """Bake a request: the mesh with what the new channels need (a UV map or corner attributes), and a Material per slot.

        ``corner_loops`` (t, 3) int: the loop index, in the evaluated mesh, of every corner of ``mesh.triangles``. Raises
        BakeError if Cycles cannot bake. Each request is baked once.
        """
        try:
            leaves = {slot: self._wanted(request, slot) for slot in request.slots}
            baked = answer(lambda: _digest(request, mesh), lambda: bake_leaves(request, leaves, self._scene))
        finally:
            self._discard(request)
        attributes, uv_layers = dict(mesh.attributes), dict(mesh.uv_layers)
        materials = {slot: with_look(self._baked(request, slot, baked.values[slot]), request.materials[slot])
                     for slot in request.slots}
        if baked.uv is not None:
            uv_layers[BAKE_UV] = baked.uv[corner_loops]
        else:
            materials = {slot: _on_corners(material, attributes, corner_loops, str(slot)) for slot, material in materials.items()}
        if baked.detail is not None:
            inside = baked.inside[corner_loops]
            uv_layers[DETAIL_UV] = detail_uv(baked.detail.uv[corner_loops], inside, DETAIL_SIDE)
            materials = {slot: in_detail(material, self._baked(request, slot, baked.detail.values[slot]), attributes, inside)
                         for slot, material in materials.items()}
        return replace(mesh, uv_layers=uv_layers, attributes=attributes), materials

    def _wanted(self, request: BakeRequest, slot: int) -> list[Leaf]:
        """Every socket that must be baked before a slot's material can be read, for every ray that must be answered."""
        wanted: list[Leaf] = []
        self._baked(request, slot, {}, wanted)
        return wanted

    def _baked(self, request: BakeRequest, slot: int, known: dict, wanted: list[Leaf] | None = None) -> Material:
        """A slot's material from the leaves ``known``; the others are added to ``wanted``, and placeholders stand for them."""
        source = request.materials[slot]
        self._material = source.name
        remarks: list[str] = []

        def surface(ray):
            shaders = BakedShaders(BakedNodes(self._images, known, ray, request.placed[slot], wanted))
            found = shaders.surface(source)
            remarks.extend(shaders.remarks if ray.kind != "camera" else ())
            return found

        material = whole_material(source, self._asks(source), surface, BAKED_ANGLES, "cycles-bake", remarks.append)
        for remark in remarks if wanted is None else ():
            self._remark(remark)
        return material

    def _asks(self, material) -> frozenset:
        asked = self._asked.get(material.name_full)
        if asked is None:
            asked = self._asked[material.name_full] = asks_of_material(material)
        return asked

    def _from_nodes(self, material, placed: tuple) -> Material | None:
        self._material = material.name
        if nodes_of(material) is None:
            color = Value.of(tuple(material.diffuse_color)[:3])
            return whole_material(material, frozenset(), lambda ray: Surface(color, base_color=color), 1, "nodes", str)
        asked = self._asks(material)
        for question in sorted(asked):
            if question[0] == "unknown":
                self._remark(f"it asks for {question[1]}")
        attributes: set[str] = set()
        remarks: list[str] = []

        def surface(ray):
            shaders = ShaderReader(NodeReader(self._images, attributes, ray, placed))
            found = shaders.surface(material)
            remarks.extend(shaders.remarks if ray.kind != "camera" else ())
            return found

        try:
            result = whole_material(material, asked, surface, ANGLES, "nodes", remarks.append)
        except Unreadable as unreadable:
            self._note(f"material '{material.name}' was read by a Cycles bake, because of {unreadable}")
            return None
        for remark in remarks:
            self._remark(remark)
        self.attributes |= attributes
        return result

    @cached_property
    def _default(self) -> Material:
        surface = default_surface()
        return Material("default", surface.albedo.channel(), base_color=surface.base_color.channel(),
                        roughness=surface.roughness.channel(), specular=surface.specular.channel())

    def _remark(self, text: str) -> None:
        self.omissions.add(f"material '{self._material}': {text}", materials=[self._material])

    def _missing(self, line: str) -> None:
        self.omissions.add(line, materials=[self._material])

    def _note(self, line: str) -> None:
        if line not in self.notes:
            self.notes.append(line)

    def discard(self, request: BakeRequest) -> None:
        """Remove the mesh of a request that is done."""
        self._discard(request)

    def _discard(self, request: BakeRequest) -> None:
        if request in self._requests:
            self._requests.remove(request)
            bpy.data.meshes.remove(request.mesh)


def _digest(request: BakeRequest, mesh: Mesh) -> str:
    """What a Cycles bake of a request depends on."""
    placed = tuple(map(tuple, request.world_from_local)), request.placed, request.slots
    return node_digest(*request.materials) + content_hash((placed, mesh))


def _on_corners(material: Material, attributes: dict, corner_loops: np.ndarray, prefix: str) -> Material:
    """The same material with channels read from corner attributes, added to ``attributes`` under names with ``prefix``."""
    changed = {}
    for name in ("albedo", "emission", "alpha", "base_color", "metallic", "roughness", "specular", "tint", "translucency",
                 "shadow_alpha", "shadow_tint", "point_alpha"):
        channel = getattr(material, name)
        if channel is None or channel.texture is None:
            continue
        value = Value(channel.constant, channel.texture, channel.texture_channel, offset=channel.offset)
        corners = np.ones((*corner_loops.shape, 4), np.float32)
        corners[..., :3] = texels(value)[0][corner_loops]
        attributes[f"_rtgi_{prefix}_{name}"] = corners
        changed[name] = Channel(attribute=f"_rtgi_{prefix}_{name}")
    for name in ("back", "camera"):
        other = getattr(material, name)
        if other is not None:
            changed[name] = _on_corners(other, attributes, corner_loops, f"{prefix}_{name}")
    return replace(material, **changed)
