"""Material inputs at ray hits: textures, vertex colours and shading normals, evaluated for whole arrays of hits."""

import numpy as np

from ... import kernels
from ...scene import Channel, Material, Scene, Texture
from .angles import AngleProfiles
from .geometry import Geometry, dense
from .look_ups import LookUps
from .textures import TextureSampler

# A closed room of albedo 1 has no finite radiance; this cap keeps the series of bounces convergent (500 bounces to 1/e).
MAX_ALBEDO = 0.998
# What rays are for: to look, or to tell what is in the way of light, of a lamp without a size if it comes to that.
LOOK, SHADOW, POINT = range(3)
# Points of a triangle, as Embree's u and v, by which what varies over it is judged.
_WITHIN = np.float32([[1 / 3, 1 / 3], [0.6, 0.2], [0.2, 0.6], [0.2, 0.2]])


class Surfaces:
    """Looks up what the scene's materials say at hits (``primitive`` (n,) int32, ``u`` and ``v`` (n,) Embree barycentrics).

    Both sides of a surface may differ: ``cosine`` (n,) is that between the front's geometric normal and the way that light leaves
    (or a ray came from), negative on the back; where nothing varies with the angle its sign alone counts.
    """

    def __init__(self, scene: Scene, geometry: Geometry):
        self._scene = scene
        self._geometry = geometry
        self._materials = scene.materials or (Material("default"),)
        self._uv_cache: dict[str | None, np.ndarray] = {}
        self._attribute_cache: dict[str, np.ndarray] = {}
        self._samplers: dict[int, TextureSampler] = {}
        # Faces: every material's front under its own index, then the backs that differ.
        backs = [index for index, material in enumerate(self._materials) if material.back is not None]
        faces = [*self._materials, *(self._materials[index].back for index in backs)]
        # What pictures ask for by a channel's name, once somebody does.
        self._sided, self._sides = faces, {}
        self._two_sided, self._back = bool(backs), np.arange(len(self._materials))
        self._back[backs] = len(self._materials) + np.arange(len(backs))
        self._albedo = _Table(self, [face.albedo for face in faces], 0.0, MAX_ALBEDO)
        self._emission = _Table(self, [face.emission for face in faces], 0.0, np.inf)
        self._emission_by_angle = AngleProfiles([face.emission_by_angle for face in faces])
        self.albedo_by_angle = AngleProfiles([face.albedo_by_angle for face in faces])
        # Coverage as rays towards a light meet it comes after all that other rays meet, then that of lamps without a size.
        answers = [_answers(face) for face in faces]
        self._alpha = _Table(self, [answer[kind][0] for kind in range(3) for answer in answers], 0.0, 1.0)
        thresholds = [answer[kind][1] for kind in range(3) for answer in answers]
        self._thresholds = np.array([np.nan if threshold is None else threshold for threshold in thresholds], np.float32)
        # More than 1 where what is added to a clear surface needs coverage that takes nothing from what passes.
        self._tint = _Table(self, [answer[kind][2] for kind in range(3) for answer in answers], 0.0, np.inf)
        # What no ray meets, as the walls of a medium that have no surface: rays need not pass it.
        self.clear = np.array([all(face is None or all(_is_clear(*answer) for answer in _answers(face))
                                   for face in (material, material.back)) for material in self._materials], bool)
        self._faces = len(faces)
        hidden = ~geometry.visibility.diffuse[geometry.instance]
        self._dark = hidden if hidden.any() else None
        self.has_emission = any(material.is_emissive for material in self._materials)
        self.transparent = np.array([not material.is_opaque for material in self._materials])
        self.keeps_shadow = np.array([all(face is None or _keeps_shadow(face) for face in (material, material.back))
                                      for material in self._materials]) & self.transparent
        self.has_transparency = bool(np.any(self.transparent[np.unique(geometry.material)]))
        self._smooth = np.array([mesh.corner_normals_local is not None for mesh in scene.meshes] or [False])
        self.has_smooth_normals = bool(self._smooth.any())
        self._corner_normals = None
        self._smooth_triangle = None
        if self.has_smooth_normals:
            self._corner_normals, self._smooth_triangle = _corner_normals(scene)
        self.emissive = np.array([material.is_emissive for material in self._materials])
        # What passes straight on, and what passes diffusely.
        self._translucency = _Table(self, [face.translucency for face in faces], 0.0, MAX_ALBEDO)
        self._translucency.limit(MAX_ALBEDO - self._albedo.constants)
        used = np.isin(np.arange(len(self._materials)), geometry.material)
        self.translucent = np.array([material.is_translucent for material in self._materials]) & used
        self.has_translucency = bool(self.translucent.any())
        self.has_tint = bool(np.any(np.array([material.is_tinted for material in self._materials]) & self.transparent & used))
        self.glass = np.array([material.glass for material in self._materials])
        self.has_glass = bool(np.any(self.glass & used))

    @property
    def has_uniform_albedo(self) -> bool:
        """True if no albedo varies within a triangle, from one side to the other, or with the angle."""
        return not (self._two_sided or self._albedo.varying.any() or self.albedo_by_angle.present)

    def albedo_of_side(self, primitive: np.ndarray, u: np.ndarray, v: np.ndarray, side: np.ndarray) -> np.ndarray:
        """Hemispherical diffuse reflectance (n, 3) in [0, MAX_ALBEDO]: the mean over the hemisphere of a ``side`` (n,), ±1."""
        return self._albedo.evaluate(self.face(primitive, side), primitive, u, v)

    def albedo(self, primitive: np.ndarray, u: np.ndarray, v: np.ndarray, cosine: np.ndarray) -> np.ndarray:
        """π times the radiance (n, 3) over the irradiance that it reflects, in the direction that ``cosine`` tells."""
        mean = self.albedo_of_side(primitive, u, v, cosine)
        return mean * self.albedo_by_angle.of(self.face(primitive, cosine), cosine) if self.albedo_by_angle.present else mean

    def emission_of_side(self, primitive: np.ndarray, u: np.ndarray, v: np.ndarray, cosine: np.ndarray) -> np.ndarray:
        """Emitted radiance (n, 3) [W·sr⁻¹·m⁻²], the mean over the side's cosine-weighted hemisphere; what is
        hidden from diffuse rays lights nothing."""
        emission = self._emission.evaluate(self.face(primitive, cosine), primitive, u, v)
        if self._dark is not None:
            emission[self._dark[primitive]] = 0.0
        return emission

    def emission(self, primitive: np.ndarray, u: np.ndarray, v: np.ndarray, cosine: np.ndarray) -> np.ndarray:
        """Emitted radiance (n, 3) [W·sr⁻¹·m⁻²] in the direction that ``cosine`` tells."""
        mean = self.emission_of_side(primitive, u, v, cosine)
        return mean * self._emission_by_angle.of(self.face(primitive, cosine), cosine) if self._emission_by_angle.present else mean

    def mean_emission(self, primitive: np.ndarray, u: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Exitance (n, 3) over 2π: the mean radiance of both sides over their cosine-weighted hemispheres, coverage included."""
        total = np.zeros((len(primitive), 3), np.float32)
        for side in (1.0, -1.0) if self._two_sided else (1.0,):
            cosine = np.full(len(primitive), side, np.float32)
            total += self.emission_of_side(primitive, u, v, cosine) * self.coverage(primitive, u, v, cosine)[:, None]
        return total * np.float32(0.5) if self._two_sided else total

    def alpha(self, primitive: np.ndarray, u: np.ndarray, v: np.ndarray, cosine: np.ndarray,
              shadow: int = LOOK) -> tuple[np.ndarray, np.ndarray]:
        """Coverage (n,) in [0, 1] as rays meet it that LOOK, or cast a SHADOW of a light or of a POINT, and its threshold (n,): NaN
        where rays pass with probability 1 − coverage."""
        face = self.face(primitive, cosine) + shadow * self._faces
        return self._alpha.evaluate(face, primitive, u, v)[:, 0], self._thresholds[face]

    def tint(self, primitive: np.ndarray, u: np.ndarray, v: np.ndarray, cosine: np.ndarray, shadow: int = LOOK) -> np.ndarray:
        """Colour (n, 3) in [0, 1] of what passes straight on."""
        return self._tint.evaluate(self.face(primitive, cosine) + shadow * self._faces, primitive, u, v)

    def translucency(self, primitive: np.ndarray, u: np.ndarray, v: np.ndarray, cosine: np.ndarray) -> np.ndarray:
        """π times the radiance (n, 3) that leaves to the side that ``cosine`` tells, over the irradiance on the other."""
        return self._translucency.evaluate(self.face(primitive, -cosine), primitive, u, v)

    def passed(self, primitive: np.ndarray) -> np.ndarray:
        """Share (n,) of light that gets through triangles (n,) from their front, straight or diffusely, by a few points on each."""
        share = np.zeros(len(primitive), np.float32)
        material = self._geometry.material[primitive]
        rows = np.flatnonzero(self.transparent[material] | self.translucent[material])
        if rows.size:
            corner = np.repeat(_WITHIN, rows.size, axis=0)
            where = np.tile(primitive[rows], len(_WITHIN)), corner[:, 0], corner[:, 1], np.ones(len(corner), np.float32)
            covered = self.coverage(*where)[:, None]
            through = (1.0 - covered) * self.tint(*where) + covered * self.translucency(*where[:3], -where[3])
            share[rows] = through.mean(axis=1).reshape(len(_WITHIN), -1).mean(axis=0)
        return share

    def coverage(self, primitive: np.ndarray, u: np.ndarray, v: np.ndarray, cosine: np.ndarray) -> np.ndarray:
        """The share (n,) float32 of rays that meet the surface: 0 or 1 where there is a threshold."""
        covered = np.ones(len(primitive), np.float32)
        rows = np.flatnonzero(self.transparent[self._geometry.material[primitive]])
        if rows.size:
            alpha, threshold = self.alpha(primitive[rows], u[rows], v[rows], cosine[rows])
            covered[rows] = np.where(np.isnan(threshold), alpha, alpha >= threshold)
        return covered

    def face(self, primitive: np.ndarray, cosine: np.ndarray) -> np.ndarray:
        """Which of all materials' sides (n,) is met: what tables are indexed by."""
        material = self._geometry.material[primitive]
        return np.where(cosine < 0, self._back[material], material) if self._two_sided else material

    def emission_varies(self, material: np.ndarray) -> np.ndarray:
        """(n,) bool: materials (n,) whose emission is not the same everywhere on each side."""
        return self._emission.varying[material] | self._emission.varying[self._back[material]]

    def emission_channels(self, material: int) -> list[Channel]:
        """What the emission of the sides of one material is read from: one where both are alike."""
        sides = [self._materials[material], self._materials[material].back]
        return [side.emission for side in sides if side is not None]

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
        if kernels.is_available() and primitive.dtype == np.int32 and u.dtype == v.dtype == np.float32:
            n, geometry = len(primitive), self._geometry
            kernels.call("shading_normals", geometry.count, geometry.normals_world, geometry.mesh_triangle, geometry.instance,
                         len(self._smooth_triangle), self._smooth_triangle, self._corner_normals, len(geometry.normal_matrices),
                         geometry.normal_matrices, n, *dense(n, primitive, u, v), normals)
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

    def texture_corners(self, channel: Channel, primitive: np.ndarray) -> np.ndarray:
        """(n, 3, 2) UVs at which the corners of triangles (n,) read the texture of ``channel``."""
        return _transformed(self.corner_uv(channel.uv_layer)[self._geometry.mesh_triangle[primitive]], channel)

    @property
    def geometry(self) -> Geometry:
        """The triangles that it is asked about."""
        return self._geometry

    def sampler(self, texture: Texture) -> TextureSampler:
        """What reads ``texture``."""
        # By identity: the scene holds its textures for as long as this lives.
        if id(texture) not in self._samplers:
            self._samplers[id(texture)] = TextureSampler(texture)
        return self._samplers[id(texture)]

    def of_side(self, name: str, primitive: np.ndarray, u: np.ndarray, v: np.ndarray, side: np.ndarray) -> np.ndarray:
        """The value (n, 3) of the material's channel ``name`` on a ``side`` (n,), ±1, unclamped."""
        if name not in self._sides:
            self._sides[name] = _Table(self, [getattr(face, name) for face in self._sided], -np.inf, np.inf)
        return self._sides[name].evaluate(self.face(primitive, side), primitive, u, v)

    def channel(self, channel: Channel, primitive: np.ndarray, u: np.ndarray, v: np.ndarray) -> np.ndarray:
        """One channel's value (n, 3) at hits, unclamped."""
        value = self.scaled(channel, channel.constant.astype(np.float32), primitive, u, v)
        return value if channel.offset is None else value + np.asarray(channel.offset, np.float32)

    def scaled(self, channel: Channel, factor: np.ndarray, primitive: np.ndarray, u: np.ndarray, v: np.ndarray) -> np.ndarray:
        """``factor`` (3,) or (n, 3) times what a channel reads from its texture and attribute at hits: (n, 3)."""
        value = np.broadcast_to(factor, (len(primitive), 3))
        mesh_triangle = self._geometry.mesh_triangle[primitive]
        if channel.texture is not None:
            uv = _transformed(_interpolate(self.corner_uv(channel.uv_layer)[mesh_triangle], u, v), channel)
            value = value * self.sampler(channel.texture).sample(uv, channel.texture_channel)
        if channel.attribute is not None:
            value = value * _interpolate(self.corner_attribute(channel.attribute)[mesh_triangle], u, v)
        return value


class _Table:
    """One input of every face: a table of constants, and the faces for which more than that is needed, by what they look up."""

    def __init__(self, surfaces: Surfaces, channels: list[Channel], low: float, high: float):
        self._surfaces, self._low, self._high = surfaces, low, high
        self.varying = np.array([not channel.is_constant for channel in channels])
        self._factors = np.array([channel.constant for channel in channels], np.float32)
        self._offsets = np.array([np.zeros(3) if channel.offset is None else channel.offset for channel in channels], np.float32)
        self.constants = np.clip(self._factors + self._offsets, low, high)
        # Instances that each have a tint of their own share one look-up.
        groups: dict[tuple, int] = {}
        self._group = np.array([-1 if channel.is_constant else groups.setdefault(_look_up(channel), len(groups))
                                for channel in channels])
        self._looks: LookUps | None = None
        self._shared = [next(channel for channel, number in zip(channels, self._group, strict=True) if number == group)
                        for group in range(len(groups))]

    def limit(self, highest: np.ndarray) -> None:
        """Hold the constants of each face to ``highest`` (faces, 3)."""
        self.constants = np.minimum(self.constants, highest)

    def evaluate(self, face, primitive, u, v):
        if not self._shared:
            return self.constants[face]
        if kernels.is_available() and primitive.dtype == np.int32 and u.dtype == v.dtype == np.float32:
            looks = self._looks or LookUps(self._surfaces, self._shared, self._group, self._factors, self._offsets)
            self._looks = looks
            return looks.evaluate(self.constants, self._low, self._high, face, primitive, u, v)
        result, group = self.constants[face], self._group[face]
        for number, channel in enumerate(self._shared):
            rows = np.flatnonzero(group == number)
            if rows.size:
                value = self._surfaces.scaled(channel, self._factors[face[rows]], primitive[rows], u[rows], v[rows])
                result[rows] = np.clip(value + self._offsets[face[rows]], self._low, self._high)
        return result


def _keeps_shadow(face: Material) -> bool:
    """Whether no light of sources gets through a side, whatever it shows."""
    return face.shadow_alpha is not None and face.shadow_alpha.is_constant and bool(face.shadow_alpha.constant[0] >= 1.0)


def _is_clear(alpha, threshold, tint) -> bool:
    """Whether what a kind of ray meets lets all of it through as it is."""
    nothing = alpha.is_constant and not np.any(alpha.constant) and (threshold is None or threshold > 0)
    return bool(nothing and tint.is_constant and np.all(np.asarray(tint.constant) == 1.0))


def _answers(face: Material) -> list[tuple[Channel, float | None, Channel]]:
    """Coverage, its threshold and tint of one side as rays meet it that LOOK, cast a SHADOW or the shadow of a POINT."""
    looks = face.alpha, face.alpha_threshold, face.tint
    shadows = looks if face.shadow_alpha is None else (face.shadow_alpha, None, face.shadow_tint or face.tint)
    return [looks, shadows, shadows if face.point_alpha is None else (face.point_alpha, None, shadows[2])]


def _transformed(uv: np.ndarray, channel: Channel) -> np.ndarray:
    """``uv`` (…, 2) by the channel's affine map."""
    if channel.uv_transform is None:
        return uv
    matrix = np.asarray(channel.uv_transform, np.float32)
    return uv @ matrix[:, :2].T + matrix[:, 2]


def _look_up(channel: Channel) -> tuple:
    """What tells one look-up of texture and attribute from another."""
    transform = None if channel.uv_transform is None else np.asarray(channel.uv_transform, np.float32).tobytes()
    return id(channel.texture), channel.texture_channel, channel.uv_layer, transform, channel.attribute


def _interpolate(corners: np.ndarray, u: np.ndarray, v: np.ndarray) -> np.ndarray:
    return (1 - u - v)[:, None] * corners[:, 0] + u[:, None] * corners[:, 1] + v[:, None] * corners[:, 2]


def _corner_normals(scene: Scene) -> tuple[np.ndarray, np.ndarray]:
    parts, smooth = [], []
    for mesh in scene.meshes:
        flat = mesh.corner_normals_local is None
        parts.append(np.zeros((len(mesh.triangles), 3, 3), np.float32) if flat else unit_corner_normals(mesh.corner_normals_local))
        smooth.append(np.full(len(mesh.triangles), not flat))
    return np.concatenate(parts), np.concatenate(smooth)


def unit_corner_normals(normals: np.ndarray) -> np.ndarray:
    """``normals`` (t, 3, 3) of triangles' corners, unit; those of a triangle with one that is no number are 0, which stands for the
    face's own: one corner would spoil every point between."""
    normals = np.asarray(normals, np.float32)
    length = np.linalg.norm(normals, axis=-1, keepdims=True)
    whole = np.isfinite(length).all(axis=1, keepdims=True)
    return np.where(whole, normals, np.float32(0)) / np.maximum(np.where(whole, length, np.float32(1)), np.float32(1e-30))
