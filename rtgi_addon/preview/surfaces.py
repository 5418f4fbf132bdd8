"""The scene's surfaces on the GPU, and the pass that draws them: for shadow maps and for a camera's G-buffer alike.

A draw is one mesh's triangles of one material for all instances that have it; where a texel is covered by several, the nearest
along the view wins, as for a ray through its centre.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import gpu
import numpy as np

from ..scene import Material, Mesh, Scene
from ..transport.surfaces.geometry import normal_matrices
from ..transport.surfaces.materials import unit_corner_normals
from ..transport.views.camera import View
from .device import bind, uniform_buffer, vertex_buffer
from .materials import Images, Slots, uniforms
from .packing import fold
from .programs import MATERIAL, SURFACE_PASSES, VIEW, surface_program
from .textures import upload

# Numbers of triangles travel in two floats, as so many low ones and how often that (surface.vert.glsl).
LOW_INDICES = 1 << 16


@dataclass(frozen=True, eq=False)
class _Draw:
    """``hidden`` is the winding that is never drawn, in Blender's words, ``culled`` the one that culling leaves out; ``layout`` is
    what ``surface_program`` asks for."""

    layout: tuple[int, int, bool]
    batch: gpu.types.GPUBatch
    material: gpu.types.GPUUniformBuf
    images: dict[str, gpu.types.GPUTexture]
    count: int
    hidden: str
    culled: str


class SurfacePass:
    """The surfaces of ``scene``, ready for pass ``name`` of SURFACE_PASSES and for those that read no more of a material.

    Triangles are numbered instance by instance, as in a Geometry. ``images`` may be shared with other passes; of
    ``before``, the same pass over an earlier scene, the vertices of meshes that are the same objects are taken over."""

    def __init__(self, scene: Scene, name: str, images: Images | None = None, before: "SurfacePass | None" = None):
        self._inputs, self._name = SURFACE_PASSES[name][0], name
        self._images = images or Images()
        # Vertices by mesh, material slot and what the material reads of them; with the mesh, so that its id stays its own.
        self._batches: dict[tuple, tuple[Mesh, gpu.types.GPUBatch]] = {}
        self._sent = {} if before is None else before._batches
        self._groups = _groups(scene)
        self.move(scene)
        self._draws: list[_Draw] = []
        # The same draws for a shadow map, where some materials let more or less light through than is seen.
        self._shadows: list[_Draw] = []
        first = 0
        materials = scene.materials or (Material("default"),)
        for (mesh_index, override, mirrored), members in self._groups.items():
            mesh = scene.meshes[mesh_index]
            for old in np.unique(mesh.triangle_material):
                index = dict(override).get(int(old), int(old))
                lit, placed = materials[index], (index, first, len(members), mirrored)
                shown = (lit.camera or lit).as_drawn if name == "gbuffer" else lit
                draws = self._draws_of(mesh, int(old), shown, self._inputs, *placed)
                self._draws += draws
                blocking = lit.met_by_light.as_drawn
                if shown is not blocking:
                    draws = self._draws_of(mesh, int(old), blocking, SURFACE_PASSES["shadow"][0], *placed)
                self._shadows += draws
            first += len(members)
        self._sent = {}

    def can_move(self, scene: Scene) -> bool:
        """True if ``scene``, which has the same meshes and materials, differs in nothing but where instances stand."""
        return _groups(scene) == self._groups

    def move(self, scene: Scene) -> None:
        """Place the instances where they are in ``scene``."""
        self._order = [index for members in self._groups.values() for index in members]
        self._rows = _instance_rows(scene)[self._order]
        self._placed = {b"": upload(fold(self._rows.reshape(len(self._order), -1)))}

    def _instances(self, among: np.ndarray | None) -> gpu.types.GPUTexture:
        """What surface.vert.glsl reads of the instances; those that are not ``among`` (i,) bool shrink to a point."""
        key = b"" if among is None or among.all() else among.tobytes()
        if key not in self._placed:
            rows = self._rows.copy()
            rows[~among[self._order], :3] = 0.0
            self._placed[key] = upload(fold(rows.reshape(len(rows), -1)))
        return self._placed[key]

    def _draws_of(self, mesh: Mesh, slot: int, material: Material, *about) -> list[_Draw]:
        """One draw, or one for each side of a material that differs from side to side."""
        if material.back is None:
            return [self._draw_of(mesh, slot, material, *about, "NONE")]
        return [self._draw_of(mesh, slot, material, *about, "BACK"), self._draw_of(mesh, slot, material.back, *about, "FRONT")]

    def _draw_of(self, mesh: Mesh, slot: int, material: Material, inputs, index: int, first: int, count: int, mirrored: bool,
                 hidden: str) -> _Draw:
        slots = Slots(material, inputs)
        batch = self._batch(mesh, slot, slots)
        buffer = uniform_buffer(MATERIAL, uniforms(material, index, slots, inputs, first))
        images = {f"{name}_image": self._images.get(getattr(material, name).texture) for name in inputs}
        wound = {"NONE": "NONE", "BACK": "FRONT" if mirrored else "BACK", "FRONT": "BACK" if mirrored else "FRONT"}
        layout = len(slots.uv_layers), len(slots.attributes), mesh.corner_normals_local is not None
        return _Draw(layout, batch, buffer, images, count, wound[hidden], wound["BACK" if material.backface_culling else "NONE"])

    def _batch(self, mesh: Mesh, slot: int, slots: Slots) -> gpu.types.GPUBatch:
        key = id(mesh), slot, tuple(slots.uv_layers), tuple(slots.attributes)
        sent = self._batches.get(key) or self._sent.get(key)
        if sent is None:
            triangles = np.flatnonzero(mesh.triangle_material == slot).astype(np.int32)
            sent = mesh, gpu.types.GPUBatch(type="TRIS", buf=vertex_buffer(_attributes(mesh, triangles, slots)))
        self._batches[key] = sent
        return sent[1]

    def draw(self, view: View, samplers: Mapping[str, gpu.types.GPUTexture] | None = None, *, cull: bool = False,
             name: str | None = None, among: np.ndarray | None = None) -> None:
        """Draw the instances ``among`` (i,) bool (None: all) into the target that is bound, with pass ``name`` instead of its own
        if one is given. ``cull`` leaves out the backs of materials that say so."""
        shared, instances = uniform_buffer(VIEW, view.uniforms), self._instances(among)
        for draw in self._shadows if name == "shadow" else self._draws:
            culled = draw.culled if cull else "NONE"
            if "NONE" not in (culled, draw.hidden) and culled != draw.hidden:
                continue
            gpu.state.face_culling_set(draw.hidden if culled == "NONE" else culled)
            shader, _alive = bind(surface_program(name or self._name, *draw.layout),
                                  uniforms={"view": shared, "material": draw.material},
                                  samplers={"instances": instances, **draw.images, **(samplers or {})})
            draw.batch.draw_instanced(shader, instance_start=0, instance_count=draw.count)


def _groups(scene: Scene) -> dict[tuple, list[int]]:
    """Instances by what they can be drawn together for: mesh, overridden materials, whether they are mirrored."""
    groups: dict[tuple, list[int]] = {}
    _, mirrored = normal_matrices(scene)
    for index, instance in enumerate(scene.instances):
        override = tuple(sorted((instance.material_override or {}).items()))
        groups.setdefault((instance.mesh, override, bool(mirrored[index])), []).append(index)
    return groups


def _instance_rows(scene: Scene) -> np.ndarray:
    """(i, 6, 4) float32: what surface.vert.glsl reads of every instance."""
    counts = [len(scene.meshes[instance.mesh].triangles) for instance in scene.instances]
    starts = np.cumsum([0, *counts[:-1]])
    rows = np.zeros((len(counts), 6, 4), np.float32)
    rows[:, :3] = [np.asarray(instance.world_from_local)[:3] for instance in scene.instances]
    # Scaled to a largest element of 1: the cofactors of a tiny instance underflow when they are squared.
    matrices, _ = normal_matrices(scene)
    rows[:, 3:, :3] = matrices / np.maximum(np.abs(matrices).max(axis=(1, 2), keepdims=True), np.finfo(np.float32).tiny)
    rows[:, 3, 3], rows[:, 4, 3], rows[:, 5, 3] = starts // LOW_INDICES, starts % LOW_INDICES, np.arange(len(counts))
    return rows


def _attributes(mesh: Mesh, triangles: np.ndarray, slots: Slots) -> dict[str, np.ndarray]:
    """Vertex attributes (3t, c) of some of the mesh's triangles; zero where the mesh lacks a UV map or an attribute."""
    corners = mesh.vertices_local[mesh.triangles[triangles]]
    face_normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(face_normals, axis=1, keepdims=True)
    face_normals = face_normals / np.maximum(length, np.finfo(np.float32).tiny)
    attributes = {"position": corners, "face_normal": np.repeat(face_normals, 3, axis=0),
                  "triangle": np.repeat(triangles, 3)[:, None]}
    if mesh.corner_normals_local is not None:
        attributes["normal"] = unit_corner_normals(mesh.corner_normals_local[triangles])
    for number, layer in enumerate(slots.uv_layers):
        uv = mesh.uv_layers.get(layer if layer is not None else mesh.active_uv)
        attributes[f"uv_{number}"] = np.zeros((3 * len(triangles), 2), np.float32) if uv is None else uv[triangles]
    for number, name in enumerate(slots.attributes):
        colors = mesh.attributes.get(name)
        rgb = np.zeros((3 * len(triangles), 3), np.float32) if colors is None else colors[triangles][..., :3]
        attributes[f"color_{number}"] = rgb
    return {name: values.reshape(3 * len(triangles), -1).astype(np.int32 if name == "triangle" else np.float32)
            for name, values in attributes.items()}
