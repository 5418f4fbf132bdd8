"""Material inputs at ray hits: textures, vertex colours and shading normals, evaluated for whole arrays of hits."""

import numpy as np

from ..scene import Channel, Material, Mesh, Scene, Texture
from .geometry import Geometry
from .textures import TextureSampler

# A closed room of albedo 1 has no finite radiance; this cap keeps the series of bounces convergent (500 bounces to 1/e).
MAX_ALBEDO = 0.998


class Surfaces:
    """Looks up what the scene's materials say at hits (``primitive`` (n,) int32, ``u`` and ``v`` (n,) Embree barycentrics)."""

    def __init__(self, scene: Scene, geometry: Geometry):
        self._scene = scene
        self._geometry = geometry
        self._materials = scene.materials or (Material("default"),)
        self._uv_cache: dict[str | None, np.ndarray] = {}
        self._attribute_cache: dict[str, np.ndarray] = {}
        self._samplers: dict[int, TextureSampler] = {}
        self._albedo = _Table(self, [material.albedo for material in self._materials], 0.0, MAX_ALBEDO)
        self._emission = _Table(self, [material.emission for material in self._materials], 0.0, np.inf)
        self._alpha = _Table(self, [material.alpha for material in self._materials], 0.0, 1.0)
        self.has_emission = any(material.is_emissive for material in self._materials)
        self.transparent = np.array([not material.is_opaque for material in self._materials])
        self.has_transparency = bool(np.any(self.transparent[np.unique(geometry.material)]))
        self.alpha_threshold = np.array(
            [np.nan if material.alpha_threshold is None else material.alpha_threshold for material in self._materials], np.float32)
        self._smooth = np.array([mesh.corner_normals_local is not None for mesh in scene.meshes] or [False])
        self.has_smooth_normals = bool(self._smooth.any())
        self._corner_normals = None
        self._smooth_triangle = None
        if self.has_smooth_normals:
            self._corner_normals, self._smooth_triangle = _corner_normals(scene)
        self.emissive = np.array([material.is_emissive for material in self._materials])

    @property
    def has_uniform_albedo(self) -> bool:
        """True if no albedo varies within a triangle."""
        return not self._albedo.varying.any()

    def albedo(self, primitive: np.ndarray, u: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Hemispherical diffuse reflectance (n, 3) in [0, MAX_ALBEDO]."""
        return self._albedo.evaluate(primitive, u, v)

    def emission(self, primitive: np.ndarray, u: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Emitted radiance (n, 3) [W·sr⁻¹·m⁻²], from both faces."""
        return self._emission.evaluate(primitive, u, v)

    def alpha(self, primitive: np.ndarray, u: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Coverage (n,) in [0, 1]."""
        return self._alpha.evaluate(primitive, u, v)[:, 0]

    def albedo_by_triangle(self) -> np.ndarray | None:
        """(t, 3) albedo of each triangle where none varies within one, else None: lets a caller skip the evaluation."""
        if not self.has_uniform_albedo:
            return None
        return self._albedo.constants[self._geometry.material]

    def shading_normal(self, primitive: np.ndarray, u: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Unit shading normal (n, 3) in world space on the mesh's front side, not flipped towards the ray."""
        normals = self._geometry.normals_world[primitive]
        if not self.has_smooth_normals:
            return normals
        mesh_triangle = self._geometry.mesh_triangle[primitive]
        smooth = np.flatnonzero(self._smooth_triangle[mesh_triangle])
        if smooth.size == 0:
            return normals
        corners = self._corner_normals[mesh_triangle[smooth]]
        uu, vv = u[smooth, None], v[smooth, None]
        local = (1 - uu - vv) * corners[:, 0] + uu * corners[:, 1] + vv * corners[:, 2]
        matrices = self._geometry.normal_matrices[self._geometry.instance[primitive[smooth]]]
        world = np.einsum("nij,nj->ni", matrices, local)
        length = np.sqrt(np.einsum("ij,ij->i", world, world))[:, None]
        normals[smooth] = np.where(length > 0, world / np.maximum(length, 1e-30), normals[smooth])
        return normals

    def corner_uv(self, layer: str | None) -> np.ndarray:
        """(total mesh triangles, 3, 2) UVs of a layer (None: each mesh's active one); zero on meshes that lack it."""
        if layer not in self._uv_cache:
            parts = []
            for mesh in self._scene.meshes:
                uv = mesh.uv_layers.get(layer if layer is not None else mesh.active_uv)
                parts.append(np.zeros((len(mesh.triangles), 3, 2), np.float32) if uv is None else np.asarray(uv, np.float32))
            self._uv_cache[layer] = np.concatenate(parts)
        return self._uv_cache[layer]

    def corner_attribute(self, name: str) -> np.ndarray:
        """(total mesh triangles, 3, 3) RGB of a corner attribute; zero (as in Cycles) on meshes that lack it."""
        if name not in self._attribute_cache:
            parts = [np.asarray(mesh.attributes[name], np.float32)[..., :3] if name in mesh.attributes
                     else np.zeros((len(mesh.triangles), 3, 3), np.float32) for mesh in self._scene.meshes]
            self._attribute_cache[name] = np.concatenate(parts)
        return self._attribute_cache[name]

    def _sampler(self, texture: Texture) -> TextureSampler:
        # By identity: the scene holds its textures for as long as this lives.
        if id(texture) not in self._samplers:
            self._samplers[id(texture)] = TextureSampler(texture)
        return self._samplers[id(texture)]

    def channel(self, channel: Channel, primitive: np.ndarray, u: np.ndarray, v: np.ndarray) -> np.ndarray:
        """One channel's value (n, 3) at hits, unclamped."""
        value = np.broadcast_to(channel.constant.astype(np.float32), (len(primitive), 3))
        mesh_triangle = self._geometry.mesh_triangle[primitive]
        if channel.texture is not None:
            uv = _interpolate(self.corner_uv(channel.uv_layer)[mesh_triangle], u, v)
            if channel.uv_transform is not None:
                matrix = np.asarray(channel.uv_transform, np.float32)
                uv = uv @ matrix[:, :2].T + matrix[:, 2]
            value = value * self._sampler(channel.texture).sample(uv, channel.texture_channel)
        if channel.attribute is not None:
            value = value * _interpolate(self.corner_attribute(channel.attribute)[mesh_triangle], u, v)
        if channel.offset is not None:
            value = value + np.asarray(channel.offset, np.float32)
        return value


class _Table:
    """One input of every material: a table of constants, and the materials for which more than that is needed."""

    def __init__(self, surfaces: Surfaces, channels: list[Channel], low: float, high: float):
        self._surfaces, self._channels, self._low, self._high = surfaces, channels, low, high
        self.varying = np.array([not channel.is_constant for channel in channels])
        self.constants = np.array(
            [channel.constant + (0 if channel.offset is None else channel.offset) for channel in channels], np.float32)
        np.clip(self.constants, low, high, out=self.constants)

    def evaluate(self, primitive, u, v):
        material = self._surfaces._geometry.material[primitive]
        result = self.constants[material]
        for index in np.flatnonzero(self.varying):
            rows = np.flatnonzero(material == index)
            if rows.size:
                value = self._surfaces.channel(self._channels[index], primitive[rows], u[rows], v[rows])
                result[rows] = np.clip(value, self._low, self._high)
        return result


def _interpolate(corners: np.ndarray, u: np.ndarray, v: np.ndarray) -> np.ndarray:
    return (1 - u - v)[:, None] * corners[:, 0] + u[:, None] * corners[:, 1] + v[:, None] * corners[:, 2]


def _corner_normals(scene: Scene) -> tuple[np.ndarray, np.ndarray]:
    parts, smooth = [], []
    for mesh in scene.meshes:
        flat = mesh.corner_normals_local is None
        parts.append(np.zeros((len(mesh.triangles), 3, 3), np.float32) if flat else _unit(mesh))
        smooth.append(np.full(len(mesh.triangles), not flat))
    return np.concatenate(parts), np.concatenate(smooth)


def _unit(mesh: Mesh) -> np.ndarray:
    normals = np.asarray(mesh.corner_normals_local, np.float32)
    return normals / np.maximum(np.linalg.norm(normals, axis=-1, keepdims=True), 1e-30)
