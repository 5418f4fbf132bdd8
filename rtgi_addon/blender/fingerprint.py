"""A cheap digest of all that a bake depends on, to tell whether a scene has changed since.

It reads the viewport's evaluated data without copying geometry twice: transforms, vertex positions, lamps, shader nodes, probe
volumes and the bake's own settings. It may miss a change (a texture painted over); it never reports one that did not happen.
"""

import hashlib
from dataclasses import astuple
from functools import cache

import bpy
import numpy as np

from .properties import overrides, scene_settings

_PLAIN = {"BOOLEAN", "INT", "FLOAT", "STRING", "ENUM"}
_LIGHT_TYPES = {"MESH", "CURVE", "CURVES", "SURFACE", "FONT", "META", "LIGHT", "LIGHT_PROBE"}
# What the interface keeps in the same structs and light does not depend on.
_IGNORED = {"name", "session_uid", "use_nodes", "is_evaluated", "is_runtime_data", "location", "location_absolute", "select",
            "show_expanded", "show_options", "show_preview", "show_texture", "width", "width_hidden", "height", "dimensions",
            "use_custom_color"}


def fingerprint(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> str:
    """A hexadecimal digest of ``scene`` as ``depsgraph`` evaluates it."""
    digest = hashlib.blake2b(digest_size=16)
    seen = set()
    for instance in depsgraph.object_instances:
        obj = instance.object
        if obj.type not in _LIGHT_TYPES or obj.original.hide_render:
            continue
        digest.update(obj.name.encode())
        digest.update(np.round(np.array(instance.matrix_world, np.float64), 5).tobytes())
        if obj.data is None or obj.data.as_pointer() in seen:
            continue
        seen.add(obj.data.as_pointer())
        _add_data(digest, obj)
        for slot in obj.material_slots:
            _add_nodes(digest, slot.material, seen)
    _add_nodes(digest, scene.world, seen)
    technique, settings = scene_settings(scene)
    digest.update(repr((technique.name, astuple(settings), scene.rtgi.seed)).encode())
    return digest.hexdigest()


def node_digest(*owners) -> str:
    """A hexadecimal digest of the shader nodes of materials, worlds or lamps (None counts too)."""
    digest, seen = hashlib.blake2b(digest_size=16), set()
    for owner in owners:
        digest.update(b"-" if owner is None else b"+")
        _add_nodes(digest, owner, seen)
    return digest.hexdigest()


def _add_data(digest, obj) -> None:
    if obj.type == "MESH":
        positions = np.empty(3 * len(obj.data.vertices), np.float32)
        obj.data.attributes["position"].data.foreach_get("vector", positions) if positions.size else None
        digest.update(positions.tobytes())
    else:
        _add_struct(digest, obj.data)
        _add_nodes(digest, obj.data, set())
    if obj.type == "LIGHT_PROBE" and obj.data.type == "VOLUME":
        digest.update(repr(overrides(obj.data.original.rtgi)).encode())


def _add_nodes(digest, owner, seen: set) -> None:
    tree = owner if isinstance(owner, bpy.types.NodeTree) else getattr(owner, "node_tree", None)
    if tree is None or tree.as_pointer() in seen:
        return
    seen.add(tree.as_pointer())
    for node in tree.nodes:
        digest.update(node.bl_idname.encode())
        _add_struct(digest, node)
        for socket in node.inputs:
            value = getattr(socket, "default_value", None)
            digest.update(repr(tuple(value) if hasattr(value, "__len__") and not isinstance(value, str) else value).encode())
        image = getattr(node, "image", None)
        if image is not None:
            digest.update(repr((image.name, tuple(image.size), image.filepath)).encode())
        _add_nodes(digest, getattr(node, "node_tree", None), seen)
    for link in tree.links:
        ends = link.from_node.name, link.from_socket.identifier, link.to_node.name, link.to_socket.identifier
        digest.update(repr(ends).encode())


def _add_struct(digest, struct) -> None:
    for name, is_array in _plain_properties(type(struct)):
        value = getattr(struct, name)
        digest.update(repr(tuple(value) if is_array else value).encode())


@cache
def _plain_properties(kind: type) -> tuple[tuple[str, bool], ...]:
    """(name, whether it is an array) of every plain property that a type of Blender struct declares."""
    return tuple((declared.identifier, getattr(declared, "is_array", False)) for declared in kind.bl_rna.properties
                 if declared.type in _PLAIN and not declared.is_readonly and declared.identifier not in _IGNORED
                 and not declared.identifier.startswith("bl_"))
