"""Every medium of a file: of the world, within meshes, on the grids of volumes."""

from dataclasses import dataclass, replace
from pathlib import Path

import bpy
import numpy as np
from mathutils import Matrix

from ...scene import ClosedMesh, DensityGrid, Medium, Mesh, Omissions, Phase
from ...transport.surfaces.solids import closed_components
from ..materials.circumstances import PLACEMENT, questions
from ..materials.copied_nodes import material_of
from ..materials.images import ImageCache
from ..materials.links import volume_of
from ..materials.media import MediumReader, constant_parts
from ..materials.nodes import NodeReader
from ..materials.values import Unreadable
from .lattice import Lattice, Sampled, sampled_grids, sampled_parts
from .roles import Role, read_role

# Cells along the longest side of a mesh whose nodes are sampled, and all cells of a grid at most.
CELLS, MOST_CELLS = 64, 1 << 21
# Cells along the longest side of the scene where a world's nodes are sampled.
WORLD_CELLS = 96
# Location and size of the texture space in which generated coordinates are those of the object.
_UNIT_CUBE = (0.5, 0.5, 0.5), (0.5, 0.5, 0.5)
# Values that differ by less than this share of the largest are the same.
_SAME = 1e-4
_GRID_KINDS = {"FLOAT": "FLOAT", "DOUBLE": "FLOAT", "VECTOR_FLOAT": "VECTOR", "VECTOR_DOUBLE": "VECTOR"}


@dataclass(frozen=True, eq=False)
class Filled:
    """A placement of a mesh of which ``faces`` (t,) bool bound the volume of a bpy ``material``, which they answer ``placed``.
    ``texspace`` (location, size) is where its generated coordinates run."""

    name: str
    mesh: Mesh
    faces: np.ndarray
    material: object
    placed: tuple
    texspace: tuple
    world_from_local: np.ndarray
    role: Role


@dataclass(frozen=True, eq=False)
class _Volume:
    """A placement of a VOLUME object: ``grids`` by name with their kind, ``cell`` their finest voxel (3,) and ``box`` (2, 3) what
    they reach over, in the object's space."""

    name: str
    original: object
    material: object
    grids: dict[str, str]
    cell: np.ndarray
    box: np.ndarray
    world_from_local: np.ndarray
    role: Role


class MediaCollector:
    """Collects what is filled with media, then finishes them once the dependency graph is gone. ``scene`` is Blender's;
    ``omissions`` takes in what is not followed, ``notes`` how it was read."""

    def __init__(self, scene, omissions: Omissions, notes: list[str]):
        self._scene, self._omissions, self._notes = scene, omissions, notes
        self._volumes: list[_Volume] = []
        self._sampled: dict[tuple, list[Sampled] | None] = {}

    def add_volume(self, item) -> None:
        """Take in a ``DepsgraphObjectInstance`` of a VOLUME object, while the graph lives."""
        obj, role = item.object, read_role(item)
        if not role.takes_part:
            return
        grids = obj.data.grids
        grids.load()
        if grids.error_message:
            # A file that is not there has a line of its own (unresolved.py), with the path and what to do.
            if not _is_missing(obj.original.data):
                self._omit(obj.name, f"is a volume whose file cannot be read ({grids.error_message.strip()}); it is left out")
            return
        kinds = {grid.name: _GRID_KINDS[grid.data_type] for grid in grids if grid.data_type in _GRID_KINDS}
        # What a file says of a grid may be whole where its values are cut short.
        damaged = [grid.name for grid in grids if grid.name in kinds and not grid.load()]
        if damaged:
            self._omit(obj.name, f"is a volume whose file cannot be read (the values of {', '.join(damaged)} are damaged); it is "
                                 "left out")
            return
        if not kinds:
            self._omit(obj.name, "is a volume without grids of numbers; it is left out")
            return
        sizes = [np.linalg.norm(np.array(grid.matrix_object, np.float64)[:3, :3], axis=1) for grid in grids if grid.name in kinds]
        corners = np.array(obj.bound_box, np.float64)
        material = obj.material_slots[0].material if obj.material_slots else None
        self._volumes.append(_Volume(obj.name, obj.original, None if material is None else material.original, kinds,
                                     np.min(sizes, axis=0), np.stack([corners.min(axis=0), corners.max(axis=0)]),
                                     np.array(item.matrix_world, np.float64), role))

    def finish(self, world, filled: list[Filled], box) -> tuple[Medium, ...]:
        """All media, of the world, of meshes and of volumes. Runs Blender operators where nodes do not tell. ``box`` (2, 3) is
        where a world's volume that differs from place to place is sampled; None where the scene has no extent."""
        media = self._of_world(world, box)
        for mesh in filled:
            media += self._of_mesh(mesh)
        for volume in self._volumes:
            media += self._of_volume(volume)
        return tuple(media)

    def _of_world(self, world, box) -> list[Medium]:
        socket = volume_of(world)
        if socket is None:
            return []
        remarks: list[str] = []
        parts = self._constant(socket, remarks)
        if parts is None:
            return self._of_varying_world(world, box)
        self._note(f"world '{world.name}'", remarks)
        return [_homogeneous(f"world '{world.name}'", part) for part in parts if not _is_nothing(part)]

    def _of_varying_world(self, world, box) -> list[Medium]:
        """What differs from place to place, on a grid over ``box``."""
        everywhere = [[-np.inf] * 3, [np.inf] * 3]
        if box is None:
            self._omissions.add(f"the volume of world '{world.name}' differs from place to place, and there is nothing to sample "
                                "it around", box_world=everywhere)
            return []
        low, high = np.asarray(box, np.float64)
        lengths = np.maximum(high - low, 1e-9)
        lattice = Lattice.around(low, high, np.clip(np.rint(WORLD_CELLS * lengths / lengths.max()), 2, WORLD_CELLS))
        remarks: list[str] = []
        try:
            material = material_of(world)
            try:
                # Generated coordinates of a world are places in it: those of a mesh whose texture space is the unit cube.
                found = sampled_parts(world.name, material, lattice, Matrix.Identity(4), self._scene, texspace=_UNIT_CUBE,
                                      remarks=remarks)
            finally:
                bpy.data.materials.remove(material)
        except Unreadable as unreadable:
            self._omissions.add(f"the volume of world '{world.name}' differs from place to place and cannot be read: {unreadable}; "
                                "it is left out", box_world=everywhere)
            return []
        media = [medium for part in found
                 if (medium := _on_grid(f"world '{world.name}'", part, lattice, lattice.object_from_box)) is not None]
        if media:
            cell = f"{lengths.max() / WORLD_CELLS:.2g}"
            remarks.append(f"differs from place to place, and is sampled on {_size(lattice)} cells of {cell} m around the scene; "
                           f"beyond ({_place(low)}) to ({_place(high)}) there is none of it")
        self._note(f"the volume of world '{world.name}'", remarks)
        return media

    def _of_mesh(self, filled: Filled) -> list[Medium]:
        bounds = _closed(filled)
        if bounds is None:
            self._omit(filled.name, f"has the volume of material '{filled.material.name}' within a surface that is not closed, or "
                                    f"whose faces point both ways; the volume is left out")
            return []
        remarks: list[str] = []
        parts = self._constant(volume_of(filled.material), remarks)
        placed = filled.role.of_medium
        if parts is not None:
            self._note(f"the volume of material '{filled.material.name}'", remarks)
            return [replace(_homogeneous(filled.name, part), bounds=bounds, **placed) for part in parts if not _is_nothing(part)]
        low, high = bounds.vertices_local.min(axis=0), bounds.vertices_local.max(axis=0)
        scale = np.linalg.norm(filled.world_from_local[:3, :3], axis=0)
        lengths = np.maximum((high - low) * scale, 1e-9)
        lattice = Lattice.around(low, high, np.clip(np.rint(CELLS * lengths / lengths.max()), 2, CELLS))
        asks = any(question[0] in PLACEMENT for question in questions(*volume_of(filled.material)))
        key = (id(filled.mesh), filled.material.name_full, filled.placed, filled.world_from_local.tobytes() if asks else b"")

        def sample():
            return sampled_parts(filled.name, filled.material, lattice, Matrix(filled.world_from_local), self._scene,
                                 filled.placed, filled.texspace, remarks=remarks)

        found = self._once(key, sample, filled.name, filled.material)
        if found:
            remarks.append(f"differs from place to place, and is sampled on {_size(lattice)} cells")
        self._note(f"the volume of material '{filled.material.name}'", remarks)
        matrix = filled.world_from_local @ lattice.object_from_box
        return [replace(medium, bounds=bounds, **placed) for part in found or []
                if (medium := _on_grid(filled.name, part, lattice, matrix)) is not None]

    def _of_volume(self, volume: _Volume) -> list[Medium]:
        extent = np.ptp(volume.box, axis=0)
        cells = np.maximum(np.ceil(extent / np.maximum(volume.cell, 1e-9)), 1)
        coarser = max(1.0, (float(np.prod(cells)) / MOST_CELLS) ** (1 / 3))
        cells = np.maximum(np.ceil(cells / coarser), 2)
        lattice = Lattice.around(*volume.box, cells)
        if coarser > 1.0:
            self._notes.append(f"the grids of {volume.name} are read on {_size(lattice)} cells, "
                               f"{coarser:.1f} times coarser than they are")
        remarks: list[str] = []

        def sample():
            grids = sampled_grids(volume.original, volume.grids, lattice)
            for name, values in grids.items():
                if not np.isfinite(values).all():
                    self._notes.append(f"the grid '{name}' of {volume.name} has values at NaN or infinity, which count as 0")
                    grids[name] = np.nan_to_num(values, nan=0.0, posinf=0.0, neginf=0.0)
                elif name == "density" and values.min() < -_SAME * np.abs(values).max():
                    self._notes.append(f"the grid 'density' of {volume.name} is negative in places, which count as 0")
            if volume.material is None:
                return _default_shader(grids, len(lattice.points()))
            if volume_of(volume.material) is None:
                return []
            return sampled_parts(volume.name, volume.material, lattice, Matrix(volume.world_from_local), self._scene, grids=grids,
                                 remarks=remarks)

        name = "" if volume.material is None else volume.material.name_full
        found = self._once((volume.original.name_full, name), sample, volume.name, volume.material)
        if found is None:
            return []
        matrix = volume.world_from_local @ lattice.object_from_box
        media = [replace(medium, **volume.role.of_medium) for part in found
                 if (medium := _on_grid(volume.name, _denser(part, volume), lattice, matrix)) is not None]
        if not media:
            self._omit(volume.name, "is a volume with nothing in it; it is left out")
        if volume.material is not None:
            self._note(f"the volume of material '{volume.material.name}'", remarks)
        return media

    def _once(self, key, sample, name: str, material) -> list[Sampled] | None:
        """What ``sample`` gives, asked once a ``key``; None, and a line of it, where Blender cannot tell."""
        if key not in self._sampled:
            try:
                self._sampled[key] = sample()
            except Unreadable as unreadable:
                of = "" if material is None else f" of material '{material.name}'"
                self._omit(name, f"holds a volume{of} that cannot be read: {unreadable}; it is left out")
                self._sampled[key] = None
        return self._sampled[key]

    def _constant(self, socket, remarks: list[str]):
        reader = MediumReader(NodeReader(ImageCache([]), set()))
        parts = constant_parts(reader, *socket)
        remarks += reader.remarks if parts is not None else ()
        return parts

    def _note(self, what: str, remarks: list[str]) -> None:
        self._notes += [line for remark in remarks if (line := f"{what}: {remark}") not in self._notes]

    def _omit(self, name: str, what: str) -> None:
        self._omissions.add(f"{name} {what}", objects=[name])


def _is_missing(volume) -> bool:
    """Whether the one file of a bpy ``volume`` is not there."""
    path = Path(bpy.path.abspath(volume.filepath, library=volume.library))
    return bool(volume.filepath) and not (path.parent if volume.is_sequence else path).exists()


def _homogeneous(name: str, part) -> Medium:
    return Medium(name, *(np.asarray(value.constant, np.float64) for value in (part.scattering, part.absorption, part.emission)),
                  part.phase)


def _is_nothing(part) -> bool:
    return all(np.all(value.constant == 0) for value in (part.scattering, part.absorption, part.emission))


def _closed(filled: Filled) -> ClosedMesh | None:
    """The closed parts of the surface that bounds a medium; None if no part is closed."""
    mesh, faces = filled.mesh, filled.faces
    mesh = mesh if faces.all() else replace(mesh, triangles=np.ascontiguousarray(mesh.triangles[faces]))
    label, closed = closed_components(mesh)
    if not closed.any():
        return None
    triangles = mesh.triangles if closed.all() else np.ascontiguousarray(mesh.triangles[closed[label]])
    return ClosedMesh(mesh.vertices_local, triangles, filled.world_from_local)


def _default_shader(grids: dict[str, np.ndarray], count: int) -> list[Sampled]:
    """Principled Volume as it is when it is added, which Cycles gives a volume without a material."""
    density = np.maximum(grids.get("density", np.zeros(count, np.float32)), 0.0)[:, None]
    return [Sampled(np.repeat(0.5 * density, 3, axis=1), np.repeat(0.5 * density, 3, axis=1), np.zeros((count, 3), np.float32),
                    Phase())]


def _denser(part: Sampled, volume: _Volume) -> Sampled:
    """What a volume is per metre where its density keeps to its own space: by how much the object is scaled, as Cycles has it."""
    if getattr(getattr(volume.original.data, "render", None), "space", "OBJECT") != "OBJECT":
        return part
    factor = np.float32(1.0 / np.linalg.norm(volume.world_from_local[:3, :3] @ np.full(3, 3**-0.5)))
    return Sampled(part.scattering * factor, part.absorption * factor, part.emission * factor, part.phase)


def _on_grid(name: str, part: Sampled, lattice: Lattice, matrix: np.ndarray) -> Medium | None:
    """A medium on a grid from what was sampled; None if there is nothing anywhere. Where scattering and absorption keep one
    proportion all over, one array of density serves them both."""
    both = np.concatenate([part.scattering, part.absorption], axis=1).astype(np.float64)
    largest = both.max(axis=0)
    if largest.max() <= 0 and part.emission.max() <= 0:
        return None
    total = both.sum(axis=1)
    ratio = both[np.argmax(total)]
    density = total / max(total.max(), 1e-30)
    shape = lattice.shape
    emission = np.maximum(part.emission.astype(np.float64).max(axis=0), 0.0)
    glow = None if np.ptp(part.emission, axis=0).max() <= _SAME * emission.max() else _factor(part.emission, emission, shape)
    if np.abs(both - density[:, None] * ratio).max() <= _SAME * largest.max():
        grid = DensityGrid(matrix, density.astype(np.float32).reshape(shape), emission=glow)
        return Medium(name, ratio[:3], ratio[3:], emission, part.phase, grid=grid)
    grid = DensityGrid(matrix, np.ones(shape, np.float32), _factor(part.scattering, largest[:3], shape),
                       _factor(part.absorption, largest[3:], shape), glow)
    return Medium(name, largest[:3], largest[3:], emission, part.phase, grid=grid)


def _factor(values: np.ndarray, largest: np.ndarray, shape) -> np.ndarray:
    scaled = np.divide(values, largest, out=np.zeros(values.shape), where=largest > 0)
    return np.maximum(scaled, 0.0).astype(np.float32).reshape(*shape, 3)


def _place(point: np.ndarray) -> str:
    return ", ".join(f"{value:.3g}" for value in point)


def _size(lattice: Lattice) -> str:
    return " × ".join(map(str, lattice.resolution))


def texspace_of(obj) -> tuple:
    """Where generated coordinates of an evaluated mesh object run: (location, size) of the mesh before its modifiers."""
    source = obj.original.data if isinstance(obj.original.data, bpy.types.Mesh) else obj.data
    return tuple(source.texspace_location), tuple(source.texspace_size)
