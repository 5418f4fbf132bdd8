"""What Cycles makes of a mesh before it traces it: adaptive subdivision and true displacement.

Cycles dices adaptively subdivided meshes to the camera's pixels; a bake has no camera, so they are subdivided to a number of faces
that light can tell apart. Blender evaluates such a mesh at the modifier's render level, and the levels beyond that are added here.
"""

from dataclasses import dataclass

import bpy
import numpy as np

from ...jobs.fingerprint import content_hash
from ...scene import Mesh
from ..fingerprint import node_digest
from ..materials import BakeRequest
from ..materials.displacement import displacement
from ..materials.links import displacement_of
from ..remembered import answer
from .meshes import MeshReader

# Faces of one displaced mesh, of all of them together, and of one that is only smoothed.
_MOST_FACES, _MOST_FACES_TOGETHER, _SMOOTH_FACES = 1 << 17, 1 << 20, 1 << 13
_MOST_LEVELS = 11


@dataclass(frozen=True)
class Dicing:
    """How an adaptive subdivision goes on: the options of its modifier, and the edge length in the object's space at which it ends
    (0: at the camera's pixels)."""

    options: tuple[tuple[str, object], ...]
    edge: float


@dataclass(eq=False)
class Shaping:
    """A mesh to be shaped: a copy of it with its materials and, in ``request.slots``, those that displace it; how it is diced."""

    request: BakeRequest
    dicing: Dicing | None


def dicing_of(obj) -> Dicing | None:
    """How Cycles subdivides an evaluated object adaptively; None if it does not."""
    last = obj.modifiers[-1] if len(obj.modifiers) else None
    if last is None or last.type != "SUBSURF" or not last.show_render:
        return None
    own = getattr(obj, "cycles", None)  # up to 4.5 it is the object's, and experimental
    if not getattr(last, "use_adaptive_subdivision", getattr(own, "use_adaptive_subdivision", False)):
        return None
    names = ("subdivision_type", "uv_smooth", "boundary_smooth", "use_creases", "quality")
    edge = last.adaptive_object_edge_length if getattr(last, "adaptive_space", "PIXEL") == "OBJECT" else 0.0
    return Dicing(tuple((name, getattr(last, name)) for name in names), edge)


def displacing_slots(materials, used) -> tuple[int, ...]:
    """The slots that have faces (``used``) and a bpy material that moves them."""
    return tuple(slot for slot, (material, faces) in enumerate(zip(materials, used, strict=True))
                 if faces and displacement_of(material) is not None)


def shaped(shaping: Shaping, scene, together: int, attributes) -> tuple[Mesh, np.ndarray]:
    """The mesh as it is traced, read with ``attributes``, and its ``corner_loops`` (MeshReader). ``together`` meshes are shaped.

    ``shaping.request.mesh`` is that mesh afterwards. Runs Blender operators; raises BakeError if Cycles cannot bake.
    """
    request = shaping.request
    if shaping.dicing is not None:
        levels = _levels(request.mesh, shaping.dicing, bool(request.slots), together)
        if levels:
            _subdivide(request, shaping.dicing, levels)
    if request.slots:
        before = request.mesh.copy()
        moved = answer(lambda: _digest(request), lambda: displacement(request, scene))
        # The bake left its own blank materials and a colour attribute on the mesh.
        bpy.data.meshes.remove(request.mesh)
        request.mesh = before
        _move(request.mesh, moved)
    holder = bpy.data.objects.new("rtgi shape", request.mesh)
    try:
        reader = MeshReader(request.mesh, holder.vertex_groups)
        return reader.read(request.name, attributes), reader.corner_loops
    finally:
        bpy.data.objects.remove(holder)


def _levels(mesh, dicing: Dicing, displaced: bool, together: int) -> int:
    """How many levels more a mesh is subdivided."""
    most = min(_MOST_FACES, _MOST_FACES_TOGETHER // max(together, 1)) if displaced else _SMOOTH_FACES
    if not displaced and dict(dicing.options)["subdivision_type"] == "SIMPLE":
        return 0
    faces = max(len(mesh.loops), 1)
    levels = int(np.clip(np.floor(np.log(most / faces) / np.log(4.0)) + 1, 0, _MOST_LEVELS))
    if dicing.edge > 0.0:
        longest = _longest_edge(mesh)
        levels = min(levels, int(np.ceil(np.log2(max(longest / dicing.edge, 1.0)))))
    return levels


def _longest_edge(mesh) -> float:
    points, edges = np.empty(3 * len(mesh.vertices), np.float32), np.empty(2 * len(mesh.edges), np.int32)
    mesh.vertices.foreach_get("co", points)
    mesh.edges.foreach_get("vertices", edges)
    ends = points.reshape(-1, 3)[edges.reshape(-1, 2)]
    return float(np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1).max(initial=0.0))


def _subdivide(request: BakeRequest, dicing: Dicing, levels: int) -> None:
    """Replace the mesh of ``request`` by itself with ``levels`` more."""
    scene = bpy.data.scenes.new("rtgi shape")
    obj = bpy.data.objects.new("rtgi shape", request.mesh)
    try:
        scene.collection.objects.link(obj)
        modifier = obj.modifiers.new("subdivision", "SUBSURF")
        for name, value in dicing.options:
            setattr(modifier, name, value)
        # What Blender evaluated lies on the limit surface already.
        modifier.use_limit_surface = False
        modifier.levels = levels
        layer = scene.view_layers[0]
        layer.update()
        fine = bpy.data.meshes.new_from_object(obj.evaluated_get(layer.depsgraph), preserve_all_data_layers=True,
                                               depsgraph=layer.depsgraph)
    finally:
        bpy.data.objects.remove(obj)
        bpy.data.scenes.remove(scene)
    bpy.data.meshes.remove(request.mesh)
    request.mesh = fine


def _move(mesh, moved: np.ndarray) -> None:
    """Move the vertices of ``mesh`` by ``moved`` (v, 3). Where its textures lie stays as it was."""
    points = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get("co", points)
    location, size = tuple(mesh.texspace_location), tuple(mesh.texspace_size)
    mesh.use_auto_texspace = False
    mesh.texspace_location, mesh.texspace_size = location, size
    mesh.vertices.foreach_set("co", points + moved.ravel())
    mesh.update()


def _digest(request: BakeRequest) -> str:
    """What the displacement of a request depends on."""
    points = np.empty(3 * len(request.mesh.vertices), np.float32)
    request.mesh.vertices.foreach_get("co", points)
    placed = tuple(map(tuple, request.world_from_local)), request.placed, request.slots
    return "displacement" + node_digest(*request.materials) + content_hash((placed, points))
