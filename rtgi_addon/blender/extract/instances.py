"""Every placement of geometry: what is read, once per mesh, and with which materials."""

from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from ...scene import Instance, Material, Mesh, Omissions
from ..evaluated import evaluated_mesh
from ..materials import BakeRequest
from ..materials.links import volume_of
from .linking import resolve
from .media import Filled, texspace_of
from .meshes import MeshReader
from .roles import Role, collections_of_objects, read_role
from .shape import Shaping, dicing_of, displacing_slots, shaped

# Curves, text, surfaces and metaballs come twice: as themselves, and as an instance of the mesh they evaluate to, which is read.
# These have no such mesh.
_SURFACELESS = {"CURVES": "hair curves", "POINTCLOUD": "a point cloud", "GREASEPENCIL": "grease pencil"}


@dataclass(eq=False)
class _Geometry:
    """One bpy mesh with one set of slot materials. ``mesh.triangle_material`` holds slots until it is settled; ``materials`` is
    the index of each slot's material, −1 for slots without faces; ``used`` tells which slots have faces; ``media`` has the slots
    whose bpy materials fill it with a medium, with those, and ``texspace`` is there where there are any."""

    mesh: Mesh
    used: np.ndarray
    materials: list[int]
    request: BakeRequest | None = None
    corner_loops: np.ndarray | None = None
    shaping: Shaping | None = None
    media: tuple[tuple[int, object], ...] = ()
    texspace: tuple = ()


class GeometryCollector:
    """Collects meshes, instances and materials from a dependency graph, then finishes them once its data is gone.

    ``scene`` is Blender's, ``reader`` a ``MaterialReader``; ``override`` the view layer's material override or None. What has no
    surface to read, and objects that no ray meets, are left out; ``omissions`` takes in what is not followed. Call ``add`` for each
    instance while the graph lives, then ``finish``.
    """

    def __init__(self, scene, reader, omissions: Omissions, override=None):
        self._scene, self._reader, self._omissions, self._override = scene, reader, omissions, override
        self._materials: list[Material] = []
        self._material_index: dict[int, int | None] = {}
        self._slot_keys: dict[tuple, tuple] = {}
        self._bases: dict[object, _Geometry | None] = {}
        self._asked: dict[object, set] = {}
        self._geometries: dict[tuple, _Geometry] = {}
        self._placements: list[tuple[str, _Geometry, _Geometry, np.ndarray, Role]] = []
        self._filled: list[tuple[_Geometry, int, object, tuple, int]] = []
        self._collections = collections_of_objects()
        self._scattered_alone: list[tuple[str, np.ndarray]] = []

    def add(self, item) -> None:
        """Take in one ``DepsgraphObjectInstance``."""
        obj = item.object
        kind = obj.type
        if kind in _SURFACELESS:
            self._omit(item, f"is {_SURFACELESS[kind]}: it has no surface to bake and is left out")
        if kind != "MESH":
            return
        role = read_role(item, self._collections)
        if not role.takes_part:
            if role.visible_scatter:
                self._scattered_alone.append((obj.name, _world_box(item)))
            return
        if role.visible_camera and not role.visible_diffuse:
            self._omit(item, "is invisible to diffuse rays, but probes see it: they look as a camera does")
        key = obj.data.as_pointer()
        slots = self._slots(item, key)
        hair = _hair_length(obj)
        if hair is not None:
            self._omit(item, "has particle hair: it has no surface to bake and is left out", hair)
        geometry = self._geometries.get((key, slots))
        if geometry is None:
            if key in self._bases and self._bases[key] is None:
                return
            with evaluated_mesh(obj) as mesh:
                geometry = self._read(obj, mesh, key, item.matrix_world, [placed for _, placed in slots])
            self._bases.setdefault(key, geometry)
            if geometry is None:
                return
            self._geometries[key, slots] = geometry
        matrix = np.array(item.matrix_world, np.float64)
        self._placements.append((obj.name, self._bases[key], geometry, matrix, role))
        self._filled += [(geometry, slot, material, slots[slot][1], len(self._placements) - 1) for slot, material in geometry.media]

    def omit_scattered_alone(self) -> None:
        """Say what is left out that only rays from media meet; to be called where media scatter."""
        for name, box in self._scattered_alone:
            self._omissions.add(f"{name} is visible to volume scatter rays alone and is left out: what media scatter passes it",
                                objects=[name], box_world=box)

    @property
    def identities(self) -> list[tuple[int, ...]]:
        """What each instance goes by in collections of linked objects, in the order of ``finish``."""
        return [role.identity for *_, role in self._placements]

    def filled(self) -> list[Filled]:
        """What is filled with media; after ``finish``, which shapes meshes."""
        found = []
        for geometry, slot, material, placed, index in self._filled:
            name, _base, _geometry, matrix, role = self._placements[index]
            faces = np.minimum(geometry.mesh.triangle_material, len(geometry.materials) - 1) == slot
            found.append(Filled(name, geometry.mesh, faces, material, placed, geometry.texspace, matrix, role))
        return found

    def finish(self, progress=None) -> tuple[tuple[Mesh, ...], tuple[Instance, ...], tuple[Material, ...]]:
        """Bake what needs Cycles, settle materials, and return meshes, instances and materials. Runs Blender operators."""
        self._shape()
        pending = [geometry for geometry in self._geometries.values() if geometry.request is not None]
        for done, geometry in enumerate(pending):
            if progress is not None:
                progress.step(done / len(pending), f"material bake: {geometry.mesh.name}")
            geometry.mesh, baked = self._reader.bake(geometry.request, geometry.mesh, geometry.corner_loops)
            for slot, material in baked.items():
                geometry.materials[slot] = len(self._materials)
                self._materials.append(material)
        meshes, index_of, instances, identities = [], {}, [], self.identities
        for name, base, geometry, matrix, role in self._placements:
            override = _override(base, geometry)
            if override is not None:
                geometry = base
            if geometry not in index_of:
                index_of[geometry] = len(meshes)
                materials = np.array(geometry.materials, np.int32)
                slots = np.minimum(geometry.mesh.triangle_material, len(materials) - 1)
                meshes.append(replace(geometry.mesh, triangle_material=materials[slots]))
            instances.append(Instance(name, index_of[geometry], matrix, override or None, **role.fields,
                                      linking=resolve(role.links, identities)))
        return _without_unused_layers(meshes, self._materials, instances), tuple(instances), tuple(self._materials)

    def _shape(self) -> None:
        """Subdivide and displace what Cycles would. What was read of those meshes before is read anew."""
        together = [geometry for geometry in self._geometries.values() if geometry.shaping is not None]
        for geometry in together:
            shaping = geometry.shaping
            geometry.mesh, geometry.corner_loops = shaped(shaping, self._scene, len(together), geometry.mesh.attributes)
            if geometry.request is not None:
                geometry.request.mesh, shaping.request.mesh = shaping.request.mesh, geometry.request.mesh
            self._reader.discard(shaping.request)

    def _read(self, obj, bpy_mesh, key, matrix_world, placed) -> _Geometry | None:
        """Read a mesh met for the first time, or met with materials that are new or look different where they are ``placed``: then
        its arrays are shared, and only attributes that the new materials ask for are read. None if it has no faces."""
        if not len(bpy_mesh.polygons):
            return None
        base = self._bases.get(key)
        source = MeshReader(bpy_mesh, obj.vertex_groups) if base is None else None
        bpy_materials = self._bpy_materials(obj)
        slots = np.clip(source.triangle_slot if base is None else base.mesh.triangle_material, 0, len(bpy_materials) - 1)
        used = np.bincount(slots, minlength=len(bpy_materials)) > 0
        materials = [self._material(material, where) if faces else -1
                     for material, where, faces in zip(bpy_materials, placed, used, strict=True)]
        asked = self._asked.setdefault(key, set())
        missing = self._reader.attributes - asked
        asked |= missing
        if base is None:
            mesh = source.read(obj.name, missing)
        else:
            if missing or None in materials:
                source = MeshReader(bpy_mesh, obj.vertex_groups)
            added = source.attributes(missing) if missing else {}
            mesh = replace(base.mesh, attributes=base.mesh.attributes | added) if added else base.mesh
        geometry = _Geometry(mesh, used, materials)
        if None in materials:
            seen = [material if faces else None for material, faces in zip(bpy_materials, used, strict=True)]
            geometry.request = self._reader.request_bake(obj, seen, matrix_world.copy(), placed)
            geometry.corner_loops = source.corner_loops
        geometry.media = tuple((slot, material.original) for slot, material in enumerate(bpy_materials)
                               if used[slot] and volume_of(material) is not None)
        geometry.texspace = texspace_of(obj) if geometry.media else ()
        dicing, displacing = dicing_of(obj), displacing_slots(bpy_materials, used)
        if dicing is not None or displacing:
            geometry.shaping = Shaping(self._reader.request_bake(obj, bpy_materials, matrix_world, placed, displacing), dicing)
        return geometry

    def _bpy_materials(self, obj) -> list:
        """The material of each slot, one None where there are no slots."""
        if self._override is not None:
            return [self._override] * max(len(obj.material_slots), 1)
        return [slot.material for slot in obj.material_slots] or [None]

    def _slots(self, item, key) -> tuple:
        """What tells one set of slot materials from another: (identity, what the instance answers it) of each. Materials are looked
        up once per object and mesh, answers for each instance where there is something to answer."""
        obj = item.object
        cache = (key, obj.original.as_pointer())
        known = self._slot_keys.get(cache)
        if known is None:
            materials = self._bpy_materials(obj)
            slots = tuple((_identity(material), ()) for material in materials)
            known = self._slot_keys[cache] = slots, any(self._reader.asks_of_objects(material) for material in materials)
        slots, asks = known
        if not asks:
            return slots
        return tuple((identity, self._reader.placed(material, item))
                     for (identity, _), material in zip(slots, self._bpy_materials(obj), strict=True))

    def _material(self, material, placed: tuple) -> int | None:
        """Index of a material where it is ``placed``, read once; None if it takes a Cycles bake on each mesh."""
        key = _identity(material), placed
        if key not in self._material_index:
            read = self._reader.read(material, placed)
            self._material_index[key] = None if read is None else len(self._materials)
            if read is not None:
                self._materials.append(read)
        return self._material_index[key]

    def _omit(self, item, what: str, around: float = 0.0) -> None:
        """Say what is not followed of one placement of an object, which reaches so far ``around`` it in its own space."""
        self._omissions.add(f"{item.object.name} {what}", objects=[item.object.name], box_world=_world_box(item, around))


def _hair_length(obj) -> float | None:
    """The length of an object's longest strands that are drawn as such, in its own space; None without any."""
    return max((system.settings.hair_length for system in obj.particle_systems
                if system.settings.type == "HAIR" and system.settings.render_type == "PATH"), default=None)


def _world_box(item, around: float = 0.0) -> np.ndarray:
    """Lowest and highest corner (2, 3) in the world of a ``DepsgraphObjectInstance``'s bounds, wider by ``around`` on each side in
    its own space."""
    matrix, local = np.array(item.matrix_world, np.float64), np.array(item.object.bound_box, np.float64)
    sides = zip(local.min(axis=0) - around, local.max(axis=0) + around, strict=True)
    corners = np.array(list(product(*sides))) @ matrix[:3, :3].T + matrix[:3, 3]
    return np.stack([corners.min(axis=0), corners.max(axis=0)])


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


def _without_unused_layers(meshes, materials, instances) -> tuple[Mesh, ...]:
    """The meshes without the UV maps and attributes that no material looks at: at millions of triangles they weigh the most. What
    is in a light atlas keeps its UV maps."""
    in_atlas = {instance.mesh for instance in instances if instance.atlas is not None}
    channels = [channel for material in materials for channel in material.channels()]
    attributes = {channel.attribute for channel in channels if channel.attribute}
    uv_layers = {channel.uv_layer for channel in channels if channel.texture is not None}
    return tuple(replace(mesh,
                         uv_layers={name: uv for name, uv in mesh.uv_layers.items()
                                    if number in in_atlas or name in uv_layers or (None in uv_layers and name == mesh.active_uv)},
                         attributes={name: values for name, values in mesh.attributes.items() if name in attributes})
                 for number, mesh in enumerate(meshes))
