"""A cheap digest of all that a bake depends on, to tell whether a scene has changed since.

It reads the viewport's evaluated data without copying geometry twice: transforms, vertex positions, lamps, shader nodes, probe
volumes and the bake's own settings. It may miss a change (a texture painted over); it never reports one that did not happen.
"""

import hashlib
from dataclasses import astuple
from functools import cache

import bpy
import numpy as np

from .atlas_materials import MARK
from .evaluated import evaluated_mesh
from .extract.spheres import is_sphere
from .ui.properties import atlas_settings, overrides, scatter_settings, scene_settings, sphere_settings
from .ui.role_properties import atlas_map, is_left_out, lamp_role

_PLAIN = {"BOOLEAN", "INT", "FLOAT", "STRING", "ENUM"}
_LIGHT_TYPES = {"MESH", "CURVE", "CURVES", "SURFACE", "FONT", "META", "LIGHT", "LIGHT_PROBE"}
# What the interface keeps in the same structs and light does not depend on.
_IGNORED = {"name", "session_uid", "use_nodes", "is_evaluated", "is_runtime_data", "location", "location_absolute", "select",
            "show_expanded", "show_options", "show_preview", "show_texture", "width", "width_hidden", "height", "dimensions",
            "use_custom_color"}
_DIGEST_BYTES = 16
# Places behind the point to which transforms count: evaluating a scene twice may differ in the last digits.
_DECIMALS = 5


def fingerprint(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> str:
    """A hexadecimal digest of ``scene`` as ``depsgraph`` evaluates it."""
    digest = hashlib.blake2b(digest_size=_DIGEST_BYTES)
    seen = set()
    for instance in depsgraph.object_instances:
        obj = instance.object
        if obj.type not in _LIGHT_TYPES or obj.original.hide_render or is_left_out(obj):
            continue
        digest.update(obj.name.encode())
        digest.update(repr(_part(obj)).encode())
        digest.update(np.round(np.array(instance.matrix_world, np.float64), _DECIMALS).tobytes())
        if obj.data is None or obj.data.as_pointer() in seen:
            continue
        seen.add(obj.data.as_pointer())
        _add_data(digest, obj)
        for slot in obj.material_slots:
            _add_nodes(digest, slot.material, seen)
    _add_nodes(digest, scene.world, seen)
    technique, settings = scene_settings(scene)
    digest.update(repr((technique.name, astuple(settings), scene.rtgi.seed)).encode())
    if any(is_sphere(obj) and not obj.hide_render for obj in scene.objects):
        digest.update(repr(astuple(sphere_settings(scene))).encode())
    if any(atlas_map(obj) is not None for obj in scene.objects):
        digest.update(repr(astuple(atlas_settings(scene))).encode())
    placement = scatter_settings(scene)
    if placement.scatters:
        digest.update(repr(astuple(placement)).encode())
        points = bpy.data.collections.get(placement.points)
        for obj in [] if points is None else points.all_objects:
            if obj.type == "EMPTY":
                digest.update(np.round(np.array(obj.matrix_world.translation, np.float64), _DECIMALS).tobytes())
    return digest.hexdigest()


def _part(obj) -> tuple:
    """What rays, lights and bakes make of an object, by names that hold from one session to the next."""
    owner = obj.original
    role = lamp_role(obj.data) if obj.type == "LIGHT" else owner.hide_probe_volume
    linking = getattr(owner, "light_linking", None)
    linked = [] if linking is None else [_linked(linking.receiver_collection), _linked(linking.blocker_collection)]
    scattered = (obj.data.volume_factor,) if obj.type == "LIGHT" else ()
    in_atlas = [uv_map] if (uv_map := atlas_map(obj)) is not None else []
    return (role, owner.visible_camera, owner.visible_diffuse, owner.visible_shadow, owner.visible_volume_scatter, *scattered,
            *linked, *in_atlas)


def _linked(collection) -> list | None:
    if collection is None:
        return None
    pairs = ((collection.collection_objects, collection.objects), (collection.collection_children, collection.children))
    return [(member.name, entry.light_linking.link_state) for entries, members in pairs
            for entry, member in zip(entries, members, strict=True)]


def node_digest(*owners) -> str:
    """A hexadecimal digest of the shader nodes of materials, worlds or lamps (None counts too)."""
    digest, seen = hashlib.blake2b(digest_size=_DIGEST_BYTES), set()
    for owner in owners:
        digest.update(b"-" if owner is None else b"+")
        _add_nodes(digest, owner, seen)
    return digest.hexdigest()


def _add_data(digest, obj) -> None:
    if obj.type == "MESH":
        with evaluated_mesh(obj) as mesh:
            positions = np.empty(3 * len(mesh.vertices), np.float32)
            mesh.attributes["position"].data.foreach_get("vector", positions) if positions.size else None
        digest.update(positions.tobytes())
    else:
        _add_struct(digest, obj.data)
        _add_nodes(digest, obj.data, set())
    if obj.type == "LIGHT_PROBE" and obj.data.type == "VOLUME":
        own = obj.data.original.rtgi
        digest.update(repr(overrides(own)).encode())
        if own.near_surfaces:
            digest.update(repr((own.clearance, own.outside, own.outermost)).encode())


def _add_nodes(digest, owner, seen: set) -> None:
    tree = owner if isinstance(owner, bpy.types.NodeTree) else getattr(owner, "node_tree", None)
    if tree is None or tree.as_pointer() in seen:
        return
    seen.add(tree.as_pointer())
    for node in tree.nodes:
        if node.get(MARK):
            # It shows a bake, and is no part of one.
            continue
        digest.update(node.bl_idname.encode())
        _add_struct(digest, node)
        for socket in node.inputs:
            value = getattr(socket, "default_value", None)
            digest.update(repr(tuple(value) if hasattr(value, "__len__") and not isinstance(value, str) else value).encode())
        image = getattr(node, "image", None)
        if image is not None:
            digest.update(repr((image.name, tuple(image.size), image.filepath)).encode())
        _add_contents(digest, node)
        _add_nodes(digest, getattr(node, "node_tree", None), seen)
    for link in tree.links:
        if link.to_node.get(MARK):
            continue
        ends = link.from_node.name, link.from_socket.identifier, link.to_node.name, link.to_socket.identifier
        digest.update(repr(ends).encode())


def _add_contents(digest, node) -> None:
    """What a node shows that is no plain property of it: ramps, curves, texts (IES profiles, scripts), where an object stands."""
    ramp, curves = getattr(node, "color_ramp", None), getattr(node, "mapping", None)
    if ramp is not None:
        _add_struct(digest, ramp)
        digest.update(repr([(element.position, tuple(element.color)) for element in ramp.elements]).encode())
    if isinstance(curves, bpy.types.CurveMapping):
        digest.update(repr([[(tuple(point.location), point.handle_type) for point in curve.points]
                            for curve in curves.curves]).encode())
    for text in (getattr(node, name, None) for name in ("ies", "script")):
        if isinstance(text, bpy.types.Text):
            digest.update(text.as_string().encode())
    looked_at = getattr(node, "object", None)
    if isinstance(looked_at, bpy.types.Object):
        digest.update(looked_at.name.encode())
        digest.update(np.round(np.array(looked_at.matrix_world, np.float64), _DECIMALS).tobytes())


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
