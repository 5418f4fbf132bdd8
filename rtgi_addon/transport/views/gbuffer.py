"""What a camera sees, by one ray a pixel and without any light in it: the twin of preview/gbuffer.py, under the same names.

Agrees with the raster texel by texel but where a pixel's centre lies on an edge, and for coverage without a threshold, where each
throws its own coins.
"""

from collections.abc import Iterator
from dataclasses import dataclass, fields
from functools import cached_property

import numpy as np

from ..rays.tracer import SELF_INTERSECTION, Hits
from ..surfaces.materials import MAX_ALBEDO
from ..vectors import dot, normalized
from .camera import CameraView

# Indices travel in the fourth components of two textures, as floats that hold them exactly: 16 bits of the triangle's index + 1
# in each, and above them 8 of the material's. Scenes with more materials than fit share the last index.
_TRIANGLES, _MATERIALS = 1 << 16, 1 << 8
MOST_MATERIALS = _MATERIALS**2 - 1
# Culled backs that one ray may pass.
_MOST_LAYERS = 64


@dataclass(frozen=True, eq=False)
class GBuffer:
    """The nearest surface of every pixel: arrays (h, w, 4) float32, row 0 at the bottom, all zero where nothing is seen.

    ``position`` world [m] and ``normal`` world, unit, on the side that is seen, with the triangle and the material in their fourth
    components (``primitive``, ``material``); ``albedo`` of diffuse transport and the instance's index; ``base_color`` and metallic;
    ``emission`` [W·sr⁻¹·m⁻²] and roughness; ``geometry`` the triangle's own normal on that side and the reflectance of its
    dielectric layer at normal incidence.
    """

    position: np.ndarray
    normal: np.ndarray
    albedo: np.ndarray
    base_color: np.ndarray
    emission: np.ndarray
    geometry: np.ndarray

    def items(self) -> Iterator[tuple[str, np.ndarray]]:
        """(name, array) of every target, in the order of GBUFFER."""
        return ((name, getattr(self, name)) for name in GBUFFER)

    @property
    def size(self) -> tuple[int, int]:
        """Width and height [pixels]."""
        return self.position.shape[1], self.position.shape[0]

    @cached_property
    def seen(self) -> np.ndarray:
        """(h, w) bool: where there is a surface."""
        return (self.normal[..., 0] != 0) | (self.normal[..., 1] != 0) | (self.normal[..., 2] != 0)

    @cached_property
    def rows(self) -> np.ndarray:
        """(n,) where there is a surface, in the picture as one row."""
        return np.flatnonzero(self.seen)

    def shown(self, target: np.ndarray) -> np.ndarray:
        """What ``target`` (h, w, ...), of this or of anything about the same picture, has where there is a surface: (n, ...)."""
        return np.take(target.reshape(-1, *target.shape[2:]), self.rows, axis=0)

    @cached_property
    def primitive(self) -> np.ndarray:
        """(h, w) int32: triangles as transport.surfaces.geometry.Geometry numbers them, −1 where nothing is seen."""
        return decode_primitive(self.position, self.normal)

    @cached_property
    def material(self) -> np.ndarray:
        """(h, w) int32 into ``Scene.materials``, −1 where nothing is seen."""
        return np.where(self.seen, decode_material(self.position, self.normal), -1)

    @cached_property
    def instance(self) -> np.ndarray:
        """(h, w) int32 into ``Scene.instances``, −1 where nothing is seen."""
        return np.where(self.seen, self.albedo[..., 3].astype(np.int32), -1)


GBUFFER = tuple(item.name for item in fields(GBuffer))


def empty_gbuffer(size: tuple[int, int]) -> GBuffer:
    """Nothing seen in ``size`` (width, height) pixels."""
    return GBuffer(*np.zeros((len(GBUFFER), size[1], size[0], 4), np.float32))


def draw_gbuffer(context, view: CameraView, size: tuple[int, int], offset=(0.0, 0.0)) -> GBuffer:
    """What ``view`` sees of a LightContext in ``size`` (width, height) pixels, between its near and far plane and shifted by
    ``offset`` (2,) pixels; backs of materials that cull them are left out. The same for any number of threads."""
    width, height = size
    pixels = np.arange(height * width)
    return _drawn(context, view.through((pixels % width + 0.5) / width, (pixels // width + 0.5) / height, size, offset), size)


def draw_places(context, view: CameraView, x: np.ndarray, y: np.ndarray) -> GBuffer:
    """As ``draw_gbuffer``, at any places (``x``, ``y``) (n,) of the picture in [0, 1]²: one row of n."""
    return _drawn(context, view.through(x, y), (len(x), 1))


def _drawn(context, rays: tuple[np.ndarray, np.ndarray, np.ndarray], size: tuple[int, int]) -> GBuffer:
    """What ``rays`` of CameraView.through see, as many as there are in ``size`` (width, height)."""
    sight = context.sight
    width, height = size
    origins, directions, reach = (part.astype(np.float32) for part in rays)
    hits = _nearest_shown(sight, origins, directions, reach)
    rows = np.flatnonzero(hits.primitive >= 0)
    primitive, u, v, directions = hits.primitive[rows], hits.u[rows], hits.v[rows], directions[rows]
    geometry, surfaces = sight.geometry, sight.surfaces
    material = geometry.material[primitive]
    face = geometry.normals_world[primitive]
    side = np.where(dot(face, directions) > 0, np.float32(-1.0), np.float32(1.0))

    def channel(name: str) -> np.ndarray:
        return surfaces.of_side(name, primitive, u, v, side)

    encoded = _encoded(primitive, material)
    targets = {
        "position": (geometry.points(primitive, u, v), encoded[0]),
        "normal": (normalized(surfaces.shading_normal(primitive, u, v)) * side[:, None], encoded[1]),
        "albedo": (np.clip(channel("albedo"), 0.0, MAX_ALBEDO), geometry.instance[primitive]),
        "base_color": (np.maximum(channel("base_color"), 0.0), np.clip(channel("metallic")[:, 0], 0.0, 1.0)),
        "emission": (np.maximum(channel("emission"), 0.0), np.clip(channel("roughness")[:, 0], 0.0, 1.0)),
        "geometry": (face * side[:, None], np.clip(channel("specular").mean(axis=1), 0.0, 1.0)),
    }
    arrays = {name: np.zeros((height * width, 4), np.float32) for name in GBUFFER}
    for name, (vectors, scalars) in targets.items():
        arrays[name][rows, :3], arrays[name][rows, 3] = vectors, scalars
    return GBuffer(**{name: array.reshape(height, width, 4) for name, array in arrays.items()})


def _nearest_shown(sight, origins, directions, reach) -> Hits:
    """Nearest hits within ``reach`` (n,), stepping through backs of materials that cull them."""
    hits = sight.tracer.intersect(origins, directions, reach)
    culls = np.array([material.backface_culling for material in sight.scene.materials] or [False])
    if not culls.any():
        return hits
    primitive, u, v, t = (part.copy() for part in (hits.primitive, hits.u, hits.v, hits.t))
    rows = np.arange(len(origins))
    for _ in range(_MOST_LAYERS):
        met = primitive[rows]
        back = (met >= 0) & culls[sight.geometry.material[met]] & (
            dot(sight.geometry.normals_world[met], directions[rows]) > 0)
        rows = rows[back]
        if not rows.size:
            return Hits(primitive, u, v, t)
        passed = t[rows] + SELF_INTERSECTION * (np.abs(origins[rows]).max(axis=1) + t[rows])
        onward = sight.tracer.intersect(origins[rows] + directions[rows] * passed[:, None], directions[rows],
                                          np.maximum(reach[rows] - passed, 0))
        primitive[rows], u[rows], v[rows], t[rows] = onward.primitive, onward.u, onward.v, onward.t + passed
    primitive[rows], t[rows] = -1, np.inf
    return Hits(primitive, u, v, t)


def _encoded(primitive: np.ndarray, material: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The fourth components (n,) of position and normal: include/fragment.glsl does the same."""
    index, material = primitive + 1, np.minimum(material, MOST_MATERIALS)
    return index // _TRIANGLES + _TRIANGLES * (material // _MATERIALS), index % _TRIANGLES + _TRIANGLES * (material % _MATERIALS)


def decode_primitive(position: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """Triangle indices (h, w) int32 from the fourth components of the position and normal targets; −1 where nothing was drawn."""
    high, low = (target[..., 3].astype(np.int32) % _TRIANGLES for target in (position, normal))
    return high * _TRIANGLES + low - 1


def decode_material(position: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """Material indices (h, w) int32 from the same components; 0 where nothing was drawn."""
    high, low = (target[..., 3].astype(np.int32) // _TRIANGLES for target in (position, normal))
    return high * _MATERIALS + low
