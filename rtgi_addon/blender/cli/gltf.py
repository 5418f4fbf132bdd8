"""glTF through Blender's importer, with what that skips: nodes switched off (KHR_node_visibility) are hidden, other extensions that
it does not know are told with where they stand.

Source: the Khronos glTF 2.0 extension registry; Blender's importer (`io_scene_gltf2`) passes over optional extensions in silence.
"""

import json
import struct
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace

import bpy

from ...scene import Omission, Omissions

_VISIBILITY = "KHR_node_visibility"
# What says nothing about how a scene looks.
_INVISIBLE = {"KHR_xmp", "KHR_xmp_json_ld", "KHR_audio", "KHR_audio_emitter", "KHR_interactivity", "KHR_physics_rigid_bodies",
              "KHR_implicit_shapes", "EXT_structural_metadata", "EXT_mesh_features"}
# Parts of a file that become objects and materials.
_NODES, _MATERIALS = "nodes", "materials"
_SHOWN_NAMES = 4
# A .glb (glTF 2.0, 4.4): its magic; a header of three words of four bytes, then chunks, each with its length and type before it.
_GLB_MAGIC, _GLB_HEADER, _CHUNK_HEADER = b"glTF", 12, 8


def import_gltf(path: Path) -> tuple[Omission, ...]:
    """Import a .glb or .gltf into the open file; returns what of it Blender did not take in. Raises the importer's RuntimeError."""
    hook = _Hook()
    with _hooked(hook):
        bpy.ops.import_scene.gltf(filepath=str(path))
    for obj in hook.hidden:
        for hidden in (obj, *obj.children_recursive):
            hidden.hide_render = hidden.hide_viewport = True
    return _skipped(_content(path), hook)


class _Hook:
    """What the importer calls: collects the objects of nodes that are switched off, what Blender calls the parts of the file, and
    what extensions the importer knows."""

    # Else the importer refuses files that require it.
    extensions = (SimpleNamespace(name=_VISIBILITY, required=True),)

    def __init__(self):
        self.hidden, self.managed = [], {_VISIBILITY}
        self.names: dict[str, dict[int, set[str]]] = {part: {} for part in (_NODES, _MATERIALS)}
        self._index: dict[int, int] = {}

    def gather_import_gltf_before_hook(self, gltf) -> None:
        """Note what the importer knows, and number the parts."""
        self.managed.update(gltf.extensions_managed)
        for part in self.names:
            self._index.update((id(entry), index) for index, entry in enumerate(getattr(gltf.data, part) or ()))

    def gather_import_node_after_hook(self, _vnode, gltf_node, obj, _gltf) -> None:
        """Note what a node became, and that it is switched off."""
        if obj is None or gltf_node is None:
            return
        self._name(_NODES, gltf_node, obj)
        if not (gltf_node.extensions or {}).get(_VISIBILITY, {}).get("visible", True):
            self.hidden.append(obj)

    def gather_import_material_after_hook(self, material, _vertex_color, made, _gltf) -> None:
        """Note what a material became; with and without vertex colours it is two."""
        self._name(_MATERIALS, material, made)

    def _name(self, part, entry, made) -> None:
        self.names[part].setdefault(self._index.get(id(entry), -1), set()).add(made.name)


@contextmanager
def _hooked(hook: _Hook) -> Iterator[None]:
    """``hook`` where the importer looks for extensions of its own: in the modules of enabled add-ons, of which it is one."""
    module = sys.modules.get("io_scene_gltf2")
    if module is None:
        yield
        return
    module.glTF2ImportUserExtension = lambda: hook
    try:
        yield
    finally:
        del module.glTF2ImportUserExtension


def _content(path: Path) -> dict:
    """The JSON of a .glb (its first chunk) or .gltf that was just imported."""
    data = path.read_bytes()
    if data.startswith(_GLB_MAGIC):
        length, = struct.unpack_from("<I", data, _GLB_HEADER)
        first = _GLB_HEADER + _CHUNK_HEADER
        data = data[first:first + length]
    return json.loads(data)


def _skipped(content: dict, hook: _Hook) -> tuple[Omission, ...]:
    omissions = Omissions()
    for extension in content.get("extensionsUsed", ()):
        if extension in hook.managed or extension in _INVISIBLE:
            continue
        meshes, textures = (_bearing(content.get(part, ()), extension) for part in ("meshes", "textures"))
        nodes = _bearing(content.get(_NODES, ()), extension) | {
            index for index, node in enumerate(content.get(_NODES, ())) if node.get("mesh") in meshes}
        materials = _bearing(content.get(_MATERIALS, ()), extension) | {
            index for index, material in enumerate(content.get(_MATERIALS, ())) if textures & set(_textures(material))}
        objects = _named(hook.names[_NODES], nodes)
        surfaces = _named(hook.names[_MATERIALS], materials)
        where = ", ".join([*objects, *surfaces][:_SHOWN_NAMES]) or "the file as a whole"
        omissions.add(f"glTF extension {extension} is not known to Blender's importer: {where}", objects=objects,
                      materials=surfaces)
    return omissions.all()


def _bearing(entries, extension: str) -> set[int]:
    """Indices of the entries that hold ``extension`` at any depth."""
    return {index for index, entry in enumerate(entries) if f'"{extension}"' in json.dumps(entry)}


def _textures(material: dict) -> Iterator[int]:
    """Indices of the textures that a material, or an extension in it, refers to."""
    for key, value in material.items():
        if isinstance(value, dict):
            if key.endswith("Texture") and "index" in value:
                yield value["index"]
            yield from _textures(value)


def _named(names: dict[int, set[str]], indices: set[int]) -> list[str]:
    return sorted(name for index in indices for name in names.get(index, ()))
