"""The scene's surfaces on the GPU, and the pass that draws them: for shadow maps and for a camera's G-buffer alike.

A draw is one mesh's triangles of one material for all instances that have it; where a texel is covered by several, the nearest
along the view wins, as for a ray through its centre.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import gpu
import numpy as np

from ..scene import Material, Mesh, Scene
from ..transport.geometry import normal_matrices
from .camera_view import View
from .device import bind, uniform_buffer, vertex_buffer
from .materials import Images, Slots, uniforms
from .packing import fold
from .programs import MATERIAL, SURFACE_PASSES, VIEW, surface_program
from .textures import upload


@dataclass(frozen=True, eq=False)
class _Draw:
    """``hidden`` is the winding that culling leaves out, in Blender's words; ``layout`` what ``surface_program`` asks for."""

    layout: tuple[int, int, bool]
    batch: gpu.types.GPUBatch
    material: gpu.types.GPUUniformBuf
    images: dict[str, gpu.types.GPUTexture]
    count: int
    hidden: str


class SurfacePass:
    """The surfaces of ``scene``, ready for pass ``name`` of SURFACE_PASSES and for those that read no more of a material.

    Triangles are numbered instance by instance, as in transport.geometry.Geometry. ``images`` may be shared with other passes; of
    ``before``, the same pass over an earlier scene, the vertices of meshes that are the same objects are taken over."""

    def __init__(self, scene: Scene, name: str, images: Images | None = None, before: "SurfacePass | None" = None):
        self._inputs, self._name = SURFACE_PASSES[name][0], name
        self._images = images or Images()
        # Vertices by mesh, material slot and what the material reads of them; with the mesh, so that its id stays its own.
        self._batches: dict[tuple, tuple[Mesh, gpu.types.GPUBatch]] = {}
        self._sent = {} if before is None else before._batches
        self._groups = _groups(scene)
        self.move(scene)
        self._draws, first = [], 0
        materials = scene.materials or (Material("default"),)
        for (mesh_index, override, mirrored), members in self._groups.items():
            mesh = scene.meshes[mesh_index]
            for old in np.unique(mesh.triangle_material):
                material = materials[dict(override).get(int(old), int(old))]
                self._draws.append(self._draw_of(mesh, int(old), material, first, len(members), mirrored))
            first += len(members)
        self._sent = {}

    def can_move(self, scene: Scene) -> bool:
        """True if ``scene``, which has the same meshes and materials, differs in nothing but where instances stand."""
        return _groups(scene) == self._groups

    def move(self, scene: Scene) -> None:
        """Place the instances where they are in ``scene``."""
        ordered = [index for members in self._groups.values() for index in members]
        self._instances = upload(fold(_instance_rows(scene)[ordered].reshape(len(ordered), -1)))

    def _draw_of(self, mesh: Mesh, slot: int, material: Material, first: int, count: int, mirrored: bool) -> _Draw:
        slots = Slots(material, self._inputs)
        batch = self._batch(mesh, slot, slots)
        buffer = uniform_buffer(MATERIAL, uniforms(material, slots, self._inputs, first))
        images = {f"{name}_image": self._images.get(getattr(material, name).texture) for name in self._inputs}
        backs = "FRONT" if mirrored else "BACK"
        layout = len(slots.uv_layers), len(slots.attributes), mesh.corner_normals_local is not None
        return _Draw(layout, batch, buffer, images, count, backs if material.backface_culling else "NONE")

    def _batch(self, mesh: Mesh, slot: int, slots: Slots) -> gpu.types.GPUBatch:
        key = id(mesh), slot, tuple(slots.uv_layers), tuple(slots.attributes)
        sent = self._batches.get(key) or self._sent.get(key)
        if sent is None:
            triangles = np.flatnonzero(mesh.triangle_material == slot).astype(np.int32)
            sent = mesh, gpu.types.GPUBatch(type="TRIS", buf=vertex_buffer(_attributes(mesh, triangles, slots)))
        self._batches[key] = sent
        return sent[1]

    def draw(self, view: View, samplers: Mapping[str, gpu.types.GPUTexture] | None = None, *, cull: bool = False,
             name: str | None = None) -> None:
        """Draw everything into the target that is bound, with pass ``name`` instead of its own if one is given. ``cull`` leaves out
        the backs of materials that say so."""
        shared = uniform_buffer(VIEW, view.uniforms)
        for draw in self._draws:
            gpu.state.face_culling_set(draw.hidden if cull else "NONE")
            shader, _alive = bind(surface_program(name or self._name, *draw.layout),
                                  uniforms={"view": shared, "material": draw.material},
                                  samplers={"instances": self._instances, **draw.images, **(samplers or {})})
            draw.batch.draw_instanced(shader, instance_start=0, instance_count=draw.count)


def _groups(scene: Scene) -> dict[tuple, list[int]]:
    """Instances by what they can be drawn together for: mesh, overridden materials, whether they are mirrored."""
    groups: dict[tuple, list[int]] = {}
    _, mirrored = normal_matrices(scene)
    for index, instance in enumerate(scene.instances):
        override = tuple(sorted((instance.material_override or {}).items()))
        groups.setdefault((instance.mesh, override, bool(mirrored[index])), []).append(index)
    return groups


def decode_primitive(position: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """Triangle indices (h, w) int32 from the fourth components of the position and normal targets; −1 where nothing was drawn."""
    return position[..., 3].astype(np.int32) * 65536 + normal[..., 3].astype(np.int32) - 1


def _instance_rows(scene: Scene) -> np.ndarray:
    """(i, 6, 4) float32: what surface.vert.glsl reads of every instance."""
    counts = [len(scene.meshes[instance.mesh].triangles) for instance in scene.instances]
    starts = np.cumsum([0, *counts[:-1]])
    rows = np.zeros((len(counts), 6, 4), np.float32)
    rows[:, :3] = [np.asarray(instance.world_from_local)[:3] for instance in scene.instances]
    # Scaled to a largest element of 1: the cofactors of a tiny instance underflow when they are squared.
    matrices, _ = normal_matrices(scene)
    rows[:, 3:, :3] = matrices / np.maximum(np.abs(matrices).max(axis=(1, 2), keepdims=True), np.finfo(np.float32).tiny)
    rows[:, 3, 3], rows[:, 4, 3], rows[:, 5, 3] = starts // 65536, starts % 65536, np.arange(len(counts))
    return rows


def _attributes(mesh: Mesh, triangles: np.ndarray, slots: Slots) -> dict[str, np.ndarray]:
    """Vertex attributes (3t, c) of some of the mesh's triangles; zero where the mesh lacks a UV map or an attribute."""
    corners = mesh.vertices_local[mesh.triangles[triangles]]
    face_normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(face_normals, axis=1, keepdims=True)
    face_normals = face_normals / np.maximum(length, np.finfo(np.float32).tiny)
    found = {"position": corners, "face_normal": np.repeat(face_normals, 3, axis=0), "triangle": np.repeat(triangles, 3)[:, None]}
    if mesh.corner_normals_local is not None:
        found["normal"] = _unit(mesh.corner_normals_local[triangles])
    for k, layer in enumerate(slots.uv_layers):
        uv = mesh.uv_layers.get(layer if layer is not None else mesh.active_uv)
        found[f"uv_{k}"] = np.zeros((3 * len(triangles), 2), np.float32) if uv is None else uv[triangles]
    for k, name in enumerate(slots.attributes):
        colors = mesh.attributes.get(name)
        found[f"color_{k}"] = np.zeros((3 * len(triangles), 3), np.float32) if colors is None else colors[triangles][..., :3]
    return {name: values.reshape(3 * len(triangles), -1).astype(np.int32 if name == "triangle" else np.float32)
            for name, values in found.items()}


def _unit(normals: np.ndarray) -> np.ndarray:
    return normals / np.maximum(np.linalg.norm(normals, axis=-1, keepdims=True), 1e-30)
