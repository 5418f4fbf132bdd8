"""The open scene as a bake reads it, in a scene of its own that an exporter can hold: every instance an object, modifiers applied,
every slot's own material in the mesh.

Blender's glTF exporter takes materials from meshes, not from objects that link others, and leaves out what geometry nodes instance.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

import bpy

from .extract.extract import is_shown
from .extract.render_depsgraph import read_for_render
from .materials.gltf import replacement
from .materials.links import is_medium_alone

_KINDS = {"LIGHT", "CAMERA"}
# Evaluated kinds that have no mesh, and what they are called.
_SURFACELESS = {"VOLUME": "a volume", "CURVES": "hair", "POINTCLOUD": "a point cloud"}


@dataclass
class Realized:
    """A temporary ``scene``; ``names`` are Blender's names of its objects and meshes by those that they have there; ``lost`` what
    of the open scene it does not hold, one line each."""

    scene: bpy.types.Scene
    names: dict[str, str] = field(default_factory=dict)
    lost: list[str] = field(default_factory=list)


@contextmanager
def realized_scene() -> Iterator[Realized]:
    """The open scene at its current frame, evaluated as for F12, for as long as the context lasts. Raises BakeError where Blender
    cannot evaluate it."""
    scene, view_layer = bpy.context.scene, bpy.context.view_layer
    if view_layer is None or scene.view_layers.get(view_layer.name) != view_layer:
        view_layer = scene.view_layers[0]
    reading = _Reading()
    made = Realized(bpy.data.scenes.new("rtgi model"))
    for name in ("resolution_x", "resolution_y", "resolution_percentage", "pixel_aspect_x", "pixel_aspect_y"):
        # What a camera sees depends on the picture's shape.
        setattr(made.scene.render, name, getattr(scene.render, name))
    try:
        read_for_render(scene, view_layer, reading.read)
        reading.build(made)
        made.lost += reading.lost(scene)
        yield made
    finally:
        objects = list(made.scene.objects)
        bpy.data.scenes.remove(made.scene)
        bpy.data.batch_remove([*objects, *reading.meshes.values(), *reading.materials.made])


class _Reading:
    """What is in the scene: meshes by their data and the materials that they carry, and where they stand."""

    def __init__(self):
        self.meshes: dict[tuple, bpy.types.Mesh] = {}
        self.materials = _Materials()
        self._placed: list[tuple[str, object, object]] = []
        self._surfaceless: dict[str, str] = {}
        self._animated: dict[str, None] = {}

    def read(self, depsgraph) -> None:
        """Take in what ``depsgraph`` shows."""
        active = depsgraph.scene.camera
        for item in depsgraph.object_instances:
            obj = item.object
            if not is_shown(item, False):
                continue
            owner = obj.original
            if obj.type in _SURFACELESS:
                self._surfaceless[obj.name] = _SURFACELESS[obj.type]
            elif obj.type == "MESH":
                # What only bounds a medium would stand there as a block; its medium goes along with the probes.
                mesh = None if _is_medium_alone(obj) else self._mesh(obj, depsgraph)
                if mesh is not None:
                    self._placed.append((obj.name, mesh, item.matrix_world.copy()))
            elif obj.type in _KINDS:
                first = active is not None and owner == active.original
                self._placed.insert(0 if first else len(self._placed), (obj.name, owner.data, item.matrix_world.copy()))
            if obj.type in {"MESH", *_KINDS} and _is_animated(owner):
                self._animated[owner.name] = None

    def _mesh(self, obj, depsgraph):
        """The evaluated mesh of ``obj`` with the materials of its slots; None without faces."""
        override = depsgraph.view_layer_eval.material_override
        slots = tuple(None if material is None else material.original
                      for material in (override or slot.material for slot in obj.material_slots))
        key = obj.data.as_pointer(), slots
        if key not in self.meshes:
            # Of what geometry nodes instance, new_from_object makes the mesh of the object with the nodes.
            mesh = bpy.data.meshes.new_from_object(obj, preserve_all_data_layers=True, depsgraph=depsgraph) \
                if obj.data.is_editmode else obj.data.copy()
            if not len(mesh.polygons):
                bpy.data.meshes.remove(mesh)
                return None
            # In their places: clearing them would give every face the first.
            for number, material in enumerate(slots):
                if number < len(mesh.materials):
                    mesh.materials[number] = material
                else:
                    mesh.materials.append(material)
            self.meshes[key] = mesh
        return self.meshes[key]

    def build(self, made: Realized) -> None:
        """Fill the temporary scene."""
        for mesh in self.meshes.values():
            for slot, material in enumerate(mesh.materials):
                mesh.materials[slot] = self.materials.exported(material)
        for name, data, matrix in self._placed:
            obj = bpy.data.objects.new(name, data)
            obj.matrix_world = matrix
            made.scene.collection.objects.link(obj)
            made.names[obj.name] = name
            if obj.type == "MESH":
                made.names[data.name] = name

    def lost(self, scene) -> list[str]:
        """What the model does not hold, one line each."""
        lines = [f"{name} is {kind}, which glTF has not: the model lacks it" for name, kind in self._surfaceless.items()]
        if self._animated:
            lines.append(f"the model stands still as at frame {scene.frame_current}: {_listed(self._animated)} would move")
        return lines + self.materials.lost


def _is_medium_alone(obj) -> bool:
    slots = [slot.material for slot in obj.material_slots]
    return bool(slots) and all(is_medium_alone(material) for material in slots)


class _Materials:
    """Materials as the exporter can read them, each looked at once."""

    def __init__(self):
        self.made: list[bpy.types.Material] = []
        self.lost: list[str] = []
        self._known: dict[object, object] = {}

    def exported(self, material):
        """``material``, or one made for it."""
        if material is None:
            return None
        if material not in self._known:
            shown, lost = replacement(material)
            self._known[material] = shown
            if shown is not material:
                self.made.append(shown)
            if lost:
                self.lost.append(lost)
        return self._known[material]


def _is_animated(obj) -> bool:
    keys = getattr(obj.data, "shape_keys", None)
    owners = obj, keys, *(modifier.object for modifier in obj.modifiers if modifier.type == "ARMATURE")
    return any(getattr(getattr(owner, "animation_data", None), "action", None) is not None for owner in owners)


def _listed(names) -> str:
    names, shown = list(names), 8
    return ", ".join(names[:shown]) + (f" and {len(names) - shown} more" if len(names) > shown else "")
