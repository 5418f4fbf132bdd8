"""Every placement of geometry: what is read, once per mesh, and with which materials."""

from dataclasses import dataclass, replace

import numpy as np

from ...scene import Instance, Material, Mesh
from .meshes import MeshReader

# Curves, text, surfaces and metaballs come twice: as themselves, and as an instance of the mesh they evaluate to, which is read.
# These have no such mesh.
_SURFACELESS = {"CURVES": "hair curves", "POINTCLOUD": "a point cloud", "VOLUME": "a volume", "GREASEPENCIL": "grease pencil"}


@dataclass(eq=False)
class _Geometry:
    """One bpy mesh with one set of slot materials. ``mesh.triangle_material`` holds slots until it is settled; ``materials`` is
    the index of each slot's material, −1 for slots without faces; ``used`` tells which slots have faces."""

    mesh: Mesh
    used: np.ndarray
    materials: list[int]
    request: object = None
    corner_loops: np.ndarray | None = None


class GeometryCollector:
    """Collects meshes, instances and materials from a dependency graph, then finishes them once its data is gone.

    ``reader`` is a ``MaterialReader``; ``override`` the view layer's material override or None. Objects that do not take part in
    diffuse light (ray visibility) are left out, and ``notes`` says so. Call ``add`` for each instance while the graph lives, then
    ``finish``.
    """

    def __init__(self, reader, override=None):
        self.notes: list[str] = []
        self._reader, self._override = reader, override
        self._materials: list[Material] = []
        self._material_index: dict[int, int | None] = {}
        self._slot_keys: dict[tuple, tuple] = {}
        self._bases: dict[object, _Geometry | None] = {}
        self._asked: dict[object, set] = {}
        self._geometries: dict[tuple, _Geometry] = {}
        self._placements: list[tuple[str, _Geometry, _Geometry, np.ndarray]] = []

    def add(self, item) -> None:
        """Take in one ``DepsgraphObjectInstance``."""
        obj = item.object
        kind = obj.type
        if kind in _SURFACELESS:
            self._note(obj.name, f"is {_SURFACELESS[kind]}: it has no surface to bake and is left out")
        if kind != "MESH":
            return
        if not obj.visible_diffuse:
            self._note(obj.name, "is invisible to diffuse rays: it is left out, and so is any shadow it casts")
            return
        if not obj.visible_shadow:
            self._note(obj.name, "casts no shadows in Cycles, but does in the bake")
        key = obj.data.as_pointer()
        slots = self._slots(obj, key)
        geometry = self._geometries.get((key, slots))
        if geometry is None:
            if key in self._bases and self._bases[key] is None:
                return
            geometry = self._read(obj, key, item.matrix_world)
            self._bases.setdefault(key, geometry)
            if geometry is None:
                return
            self._geometries[key, slots] = geometry
        self._placements.append((obj.name, self._bases[key], geometry, np.array(item.matrix_world, np.float64)))

    def finish(self, progress=None) -> tuple[tuple[Mesh, ...], tuple[Instance, ...], tuple[Material, ...]]:
        """Bake what needs Cycles, settle materials, and return meshes, instances and materials. Runs Blender operators."""
        pending = [geometry for geometry in self._geometries.values() if geometry.request is not None]
        for done, geometry in enumerate(pending):
            if progress is not None:
                progress.step(done / len(pending), f"material bake: {geometry.mesh.name}")
            geometry.mesh, baked = self._reader.bake(geometry.request, geometry.mesh, geometry.corner_loops)
            for slot, material in baked.items():
                geometry.materials[slot] = len(self._materials)
                self._materials.append(material)
        meshes, index_of, instances = [], {}, []
        for name, base, geometry, matrix in self._placements:
            override = _override(base, geometry)
            if override is not None:
                geometry = base
            if geometry not in index_of:
                index_of[geometry] = len(meshes)
                materials = np.array(geometry.materials, np.int32)
                slots = np.minimum(geometry.mesh.triangle_material, len(materials) - 1)
                meshes.append(replace(geometry.mesh, triangle_material=materials[slots]))
            instances.append(Instance(name, index_of[geometry], matrix, override or None))
        return _without_unused_layers(meshes, self._materials), tuple(instances), tuple(self._materials)

    def _read(self, obj, key, matrix_world) -> _Geometry | None:
        """Read a mesh met for the first time, or met with new materials: then its arrays are shared, and only attributes that
        the new materials ask for are read. None if it has no faces."""
        if any(system.settings.type == "HAIR" and system.settings.render_type == "PATH" for system in obj.particle_systems):
            self._note(obj.name, "has particle hair: it has no surface to bake and is left out")
        if not len(obj.data.polygons):
            return None
        base = self._bases.get(key)
        source = MeshReader(obj.data) if base is None else None
        bpy_materials = self._bpy_materials(obj)
        slots = np.clip(source.triangle_slot if base is None else base.mesh.triangle_material, 0, len(bpy_materials) - 1)
        used = np.bincount(slots, minlength=len(bpy_materials)) > 0
        materials = [self._material(material) if faces else -1 for material, faces in zip(bpy_materials, used, strict=True)]
        asked = self._asked.setdefault(key, set())
        missing = self._reader.attributes - asked
        asked |= missing
        if base is None:
            mesh = source.read(obj.name, missing)
        else:
            if missing or None in materials:
                source = MeshReader(obj.data)
            added = source.attributes(missing) if missing else {}
            mesh = replace(base.mesh, attributes=base.mesh.attributes | added) if added else base.mesh
        geometry = _Geometry(mesh, used, materials)
        if None in materials:
            seen = [material if faces else None for material, faces in zip(bpy_materials, used, strict=True)]
            geometry.request = self._reader.request_bake(obj, seen, matrix_world.copy())
            geometry.corner_loops = source.corner_loops
        return geometry

    def _bpy_materials(self, obj) -> list:
        """The material of each slot, one None where there are no slots."""
        if self._override is not None:
            return [self._override] * max(len(obj.material_slots), 1)
        return [slot.material for slot in obj.material_slots] or [None]

    def _slots(self, obj, key) -> tuple:
        """What tells one set of slot materials from another, looked up once per object and mesh."""
        cache = (key, obj.original.as_pointer())
        slots = self._slot_keys.get(cache)
        if slots is None:
            slots = tuple(_identity(material) for material in self._bpy_materials(obj))
            self._slot_keys[cache] = slots
        return slots

    def _material(self, material) -> int | None:
        """Index of a material, read once; None if it takes a Cycles bake on each mesh."""
        key = _identity(material)
        if key not in self._material_index:
            read = self._reader.read(material)
            self._material_index[key] = None if read is None else len(self._materials)
            if read is not None:
                self._materials.append(read)
        return self._material_index[key]

    def _note(self, name, what) -> None:
        line = f"{name} {what}"
        if line not in self.notes:
            self.notes.append(line)


def _identity(material) -> int:
    return 0 if material is None else material.original.as_pointer()


def _override(base, geometry) -> dict[int, int] | None:
    """The material indices that turn ``base`` into ``geometry`` ({} = they are alike), or None where that takes another mesh."""
    if geometry is base:
        return {}
    if geometry.mesh is not base.mesh or len(geometry.materials) != len(base.materials):
        return None
    override = {}
    for was, becomes, used in zip(base.materials, geometry.materials, base.used, strict=True):
        if used and override.setdefault(was, becomes) != becomes:
            return None
    return {was: becomes for was, becomes in override.items() if was != becomes}


def _without_unused_layers(meshes, materials) -> tuple[Mesh, ...]:
    """The meshes without the UV maps and attributes that no material looks at: at millions of triangles they weigh the most."""
    channels = [channel for material in materials
                for channel in (material.albedo, material.emission, material.alpha, material.base_color, material.metallic,
                                material.roughness, material.specular)]
    attributes = {channel.attribute for channel in channels if channel.attribute}
    uv_layers = {channel.uv_layer for channel in channels if channel.texture is not None}
    return tuple(replace(mesh,
                         uv_layers={name: uv for name, uv in mesh.uv_layers.items()
                                    if name in uv_layers or (None in uv_layers and name == mesh.active_uv)},
                         attributes={name: values for name, values in mesh.attributes.items() if name in attributes})
                 for mesh in meshes)
