"""Material inputs at ray hits: textures, vertex colours and shading normals, evaluated for whole arrays of hits."""

import numpy as np

from ..scene import Channel, Material, Mesh, Scene, Texture
from .geometry import Geometry

# A closed room of albedo 1 has no finite radiance; this cap keeps the series of bounces convergent (500 bounces to 1/e).
MAX_ALBEDO = 0.998

_BYTE_TO_UNIT = (np.arange(256) / 255.0).astype(np.float32)


class Surfaces:
    """Looks up what the scene's materials say at hits (``primitive`` (n,) int32, ``u`` and ``v`` (n,) Embree barycentrics)."""

    def __init__(self, scene: Scene, geometry: Geometry):
        self._scene = scene
        self._geometry = geometry
        self._materials = scene.materials or (Material("default"),)
        self._uv_cache: dict[str | None, np.ndarray] = {}
        self._attribute_cache: dict[str, np.ndarray] = {}
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

    def channel(self, channel: Channel, primitive: np.ndarray, u: np.ndarray, v: np.ndarray) -> np.ndarray:
        """One channel's value (n, 3) at hits, unclamped."""
        value = np.broadcast_to(channel.constant.astype(np.float32), (len(primitive), 3))
        mesh_triangle = self._geometry.mesh_triangle[primitive]
        if channel.texture is not None:
            uv = _interpolate(self.corner_uv(channel.uv_layer)[mesh_triangle], u, v)
            if channel.uv_transform is not None:
                matrix = np.asarray(channel.uv_transform, np.float32)
                uv = uv @ matrix[:, :2].T + matrix[:, 2]
            value = value * sample_texture(channel.texture, uv, channel.texture_channel)
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


def sample_texture(texture: Texture, uv: np.ndarray, component: str = "rgb") -> np.ndarray:
    """Texture value (n, 3), scene-linear, at ``uv`` (n, 2): bilinear between texel centres (or the nearest texel for
    'Closest'), v = 0 at row 0, outside handled by the texture's extension as Cycles does (CLIP is black and transparent).

    sRGB is decoded after filtering, as in Cycles (`svm_image_texture`), which also costs one decoding instead of four."""
    value = _filtered(texture, uv, component)
    return _linear_from_srgb(value) if texture.srgb and component != "a" else value


def _filtered(texture: Texture, uv: np.ndarray, component: str) -> np.ndarray:
    height, width = texture.pixels.shape[:2]
    x, y = uv[:, 0] * width, uv[:, 1] * height
    if texture.interpolation == "Closest":
        return _texel(texture, np.floor(x).astype(np.int64), np.floor(y).astype(np.int64), component)
    x, y = x - 0.5, y - 0.5
    column, row = np.floor(x), np.floor(y)
    fx, fy = (x - column).astype(np.float32)[:, None], (y - row).astype(np.float32)[:, None]
    column, row = column.astype(np.int64), row.astype(np.int64)
    lower = _texel(texture, column, row, component) * (1 - fx) + _texel(texture, column + 1, row, component) * fx
    upper = _texel(texture, column, row + 1, component) * (1 - fx) + _texel(texture, column + 1, row + 1, component) * fx
    return lower * (1 - fy) + upper * fy


def _texel(texture: Texture, column: np.ndarray, row: np.ndarray, component: str) -> np.ndarray:
    height, width, channels = texture.pixels.shape
    outside = None
    if texture.extension == "REPEAT":
        column, row = column % width, row % height
    elif texture.extension == "MIRROR":
        column, row = _mirror(column, width), _mirror(row, height)
    else:
        if texture.extension == "CLIP":
            outside = (column < 0) | (column >= width) | (row < 0) | (row >= height)
        column, row = np.clip(column, 0, width - 1), np.clip(row, 0, height - 1)
    if component == "rgb":
        pick = [0, 1, 2] if channels >= 3 else [0, 0, 0]
    else:
        pick = ["rgba".index(component)] if "rgba".index(component) < channels else None
    if pick is None:
        return np.ones((len(row), 3), np.float32)
    value = texture.pixels[row, column][:, pick]
    if value.dtype == np.uint8:
        value = _BYTE_TO_UNIT[value]
    if value.shape[1] == 1:
        value = np.repeat(value, 3, axis=1)
    if outside is not None:
        value[outside] = 0.0
    return value.astype(np.float32, copy=False)


def _linear_from_srgb(encoded: np.ndarray) -> np.ndarray:
    curve = ((np.maximum(encoded, np.float32(0)) + np.float32(0.055)) / np.float32(1.055)) ** np.float32(2.4)
    return np.where(encoded <= np.float32(0.04045), encoded / np.float32(12.92), curve)


def _mirror(index: np.ndarray, size: int) -> np.ndarray:
    period = index % (2 * size)
    return np.where(period < size, period, 2 * size - 1 - period)


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
