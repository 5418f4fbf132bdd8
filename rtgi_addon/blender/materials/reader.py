"""The door to materials: what extraction calls, a cache per datablock, and the report."""

from dataclasses import dataclass

import numpy as np

from ...scene import Channel, Material, Mesh

# The name under which a mesh carries whichever colour attribute is active for render.
ACTIVE_COLOR = "_rtgi_active_color"


@dataclass(eq=False)
class BakeRequest:
    """A mesh copied for a later Cycles bake, with the materials of its slots and the slots that need it."""

    name: str
    mesh: object
    materials: list
    slots: tuple[int, ...]
    world_from_local: object


class MaterialReader:
    """Reads each bpy material once.

    ``notes`` are lines for the user: materials read through Cycles and why, missing images, approximations. ``attributes`` are the
    names of the mesh attributes that channels read so far refer to.
    """

    def __init__(self, scene, depsgraph):
        self.scene, self.depsgraph = scene, depsgraph
        self.notes: list[str] = []
        self.attributes: set[str] = set()
        self._requests: list[BakeRequest] = []

    def __enter__(self) -> "MaterialReader":
        return self

    def __exit__(self, *_exception) -> None:
        pass

    def read(self, material) -> Material | None:
        """The material as nodes give it (``None`` is Blender's grey default); None if it takes a Cycles bake on each mesh."""
        if material is None:
            return Material("default")
        color = Channel.of(material.diffuse_color[:3])
        return Material(material.name, albedo=color, base_color=color)

    def request_bake(self, evaluated_object, materials, world_from_local) -> BakeRequest:
        """Copy the evaluated geometry for a bake of those ``materials`` (one bpy material or None per slot) whose ``read`` is None."""
        raise NotImplementedError

    def bake(self, request: BakeRequest, mesh: Mesh, corner_loops: np.ndarray) -> tuple[Mesh, dict[int, Material]]:
        """Bake a request: the mesh with what the new channels need (a UV map or corner attributes), and a Material per slot.

        ``corner_loops`` (t, 3) int: the loop index, in the evaluated mesh, of every corner of ``mesh.triangles``.
        """
        raise NotImplementedError
