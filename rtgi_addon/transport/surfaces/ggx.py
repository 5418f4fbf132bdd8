"""What a surface reflects: a GGX layer, what it reflects in all as a table, and Lambert below it with the rest of the light.

Smith's height-correlated shadowing and masking (Heitz 2014), α = roughness². Metals have Schlick's Fresnel term, of which
E(cos, roughness) = f0·a + f90·b is reflected (the split sum of Karis 2013), dielectrics the Fresnel equations of an index:
Schlick's curve is up to a sixth off them. Integrated over visible normals (Heitz 2018). Light that leaves the layer after more than
one reflection goes where once reflected light goes (Turquin 2019, "Practical Multiple Scattering Compensation"), less what it loses
each time (Kulla and Conty 2017, "Revisiting Physically Based Shading at Imageworks"). So has Cycles it.
"""

from collections.abc import Iterable
from dataclasses import dataclass, fields
from functools import cache

import numpy as np

from ... import kernels
from ...numerics.sampling import about, sobol_owen
from ..vectors import dot, normalized

SIZE = 32
_SAMPLES = 512
# Indices of refraction in the table: fourth roots of the reflectance at normal incidence, evenly from 0 to 1.
INDICES = 12
# α below this is taken as this: a lamp of no extent would be seen in a mirror as an infinitely bright point. Rays are mirrored by
# such layers as by a plane: the tails of GGX are long, and even so narrow a lobe takes 1 % of a lamp's light from its highlight.
MIN_ALPHA = 2e-3
# What stands for the density of directions in which a mirror sends rays [1/sr].
_MIRRORED = np.float32(1e20)
# The largest fourth root of a dielectric's reflectance at normal incidence.
_MOST_ROOT = 0.99


@cache
def energy_table() -> np.ndarray:
    """(SIZE · INDICES, SIZE, 4) float32: blocks of SIZE rows, a row a roughness, a column a cosine of the view, both from 0 to 1 at
    texel centres. The first block has a and b, and their means over a uniform sky; block 1 + i what of the way from the reflectance
    at normal incidence to 1 a dielectric reflects on the average, of index i and of i + 1, and their means."""
    parts, cosine = _layer_parts(), (np.arange(SIZE) + 0.5) / SIZE
    means = [np.repeat(np.sum(part * (2.0 * cosine / SIZE), axis=1, keepdims=True), SIZE, axis=1) for part in parts]
    pairs = [(0, 1), *((2 + index, 3 + index) for index in range(INDICES - 1))]
    blocks = [np.stack([parts[i], parts[j], means[i], means[j]], axis=-1) for i, j in pairs]
    return np.concatenate(blocks).astype(np.float32)


def _layer_parts() -> list[np.ndarray]:
    """The parts (SIZE, SIZE) that the energy table is made of: a, b, and each index's way."""
    cosine = ((np.arange(SIZE) + 0.5) / SIZE)[None, :, None]
    alpha = np.maximum(((np.arange(SIZE) + 0.5) / SIZE) ** 2, MIN_ALPHA)[:, None, None]
    u = sobol_owen(_SAMPLES, 2, 0).astype(np.float64)
    at_normal = np.clip(np.linspace(0.0, 1.0, INDICES), 1e-2, _MOST_ROOT) ** 4
    dielectrics = [(f0, index_of(f0)) for f0 in at_normal.astype(np.float32)]
    if kernels.is_available():
        radius, angle = np.sqrt(u[:, 0]), 2.0 * np.pi * u[:, 1]
        disk = np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1)
        parts = np.empty((2 + INDICES, SIZE, SIZE))
        kernels.call("layer_parts", SIZE, _SAMPLES, np.ravel(alpha), disk, INDICES, np.array(dielectrics, np.float32), parts)
        return list(parts)
    view = np.stack(np.broadcast_arrays(np.sqrt(1.0 - cosine**2), 0.0, cosine), axis=-1)
    half = _visible_normal(view, alpha, u)
    along = np.sum(view * half, axis=-1)
    light_z = 2.0 * along * half[..., 2] - cosine
    lit = light_z > 0
    # What is left of visible normals' own masking: G2/G1.
    mask, shadow = _lambda(cosine, alpha), _lambda(np.where(lit, light_z, 1.0), alpha)
    share = np.where(lit, (1.0 + mask) / (1.0 + mask + shadow), 0.0)
    grazing = np.clip(1.0 - along, 0.0, 1.0) ** 5
    parts = [np.mean(share * (1.0 - grazing), axis=-1), np.mean(share * grazing, axis=-1)]
    share, along = share.astype(np.float32), np.clip(along, 0.0, 1.0).astype(np.float32)
    for f0, index in dielectrics:
        way = (dielectric_fresnel(along, index) - f0) / (1.0 - f0)
        parts.append(np.mean(share * way, axis=-1, dtype=np.float64))
    return parts


def index_of(f0: np.ndarray) -> np.ndarray:
    """Indices of refraction (n,) of dielectrics that reflect ``f0`` (n,) at normal incidence."""
    root = np.sqrt(np.clip(f0, 0.0, np.float32(_MOST_ROOT**4)))
    return (1.0 + root) / (1.0 - root)


def dielectric_fresnel(cosine: np.ndarray, index: np.ndarray) -> np.ndarray:
    """Share (n,) of unpolarized light that a boundary to a medium of ``index`` (n,) ≥ 1 reflects at ``cosine`` (n,)."""
    g = np.sqrt(np.maximum(index * index - 1.0 + cosine * cosine, 0.0))
    across = (g - cosine) / np.maximum(g + cosine, np.float32(1e-6))
    along = (cosine * (g + cosine) - 1.0) / (cosine * (g - cosine) + 1.0)
    return 0.5 * across * across * (1.0 + along * along)


def _visible_normal(view: np.ndarray, alpha: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Normals of microfacets as they are seen from ``view`` (..., 3)."""
    stretched = view * np.stack(np.broadcast_arrays(alpha, alpha, 1.0), axis=-1)
    stretched /= np.linalg.norm(stretched, axis=-1, keepdims=True)
    # The view lies in the plane y = 0: the basis is (sideways, up, stretched).
    side = np.array([0.0, 1.0, 0.0])
    up = np.cross(stretched, side)
    # In tails of the lobe x² + y² is 1 but for float32's last digits.
    u = u.astype(np.float64)
    radius, angle = np.sqrt(u[:, 0]), 2.0 * np.pi * u[:, 1]
    x = radius * np.cos(angle)
    blend = 0.5 * (1.0 + stretched[..., 2])
    y = (1.0 - blend) * np.sqrt(1.0 - x * x) + blend * radius * np.sin(angle)
    z = np.sqrt(np.maximum(1.0 - x * x - y * y, 0.0))
    normal = x[..., None] * side + y[..., None] * up + z[..., None] * stretched
    normal *= np.stack(np.broadcast_arrays(alpha, alpha, 1.0), axis=-1)
    return normal / np.linalg.norm(normal, axis=-1, keepdims=True)


def _lambda(cosine: np.ndarray, alpha: np.ndarray) -> np.ndarray:
    return 0.5 * (np.sqrt(1.0 + alpha**2 * (1.0 / cosine**2 - 1.0)) - 1.0)


@dataclass(frozen=True, eq=False)
class SurfaceLook:
    """How surfaces seen from one side each reflect: ``diffuse``, and of the layer what reflects as metal at normal incidence ``f0``
    and how much more at grazing angles ``edge``, and what share of light from everywhere alike it reflects to the eye in all,
    ``layer``, all (n, 3); how much of it is a dielectric, ``coat``, of the index ``index``, and its ``alpha`` (n,). What scattering
    more than once adds is in all of them."""

    diffuse: np.ndarray
    f0: np.ndarray
    edge: np.ndarray
    layer: np.ndarray
    coat: np.ndarray
    index: np.ndarray
    alpha: np.ndarray

    def take(self, rows: np.ndarray) -> "SurfaceLook":
        """Some of the surfaces."""
        return SurfaceLook(*(np.take(getattr(self, item.name), rows, axis=0) for item in fields(self)))

    def fresnel(self, cosine: np.ndarray) -> np.ndarray:
        """Share (n, 3) that microfacets reflect at ``cosine`` (n,) to their normals."""
        cosine = np.clip(cosine, 0.0, 1.0)
        coat = self.coat * dielectric_fresnel(cosine, self.index)
        return self.f0 + self.edge * ((1 - cosine) ** 5)[:, None] + coat[:, None]


def layer_energy(cosine: np.ndarray, roughness: np.ndarray, block: np.ndarray | int = 0) -> np.ndarray:
    """The energy table's ``block`` (n,) at ``cosine`` and ``roughness`` (n,), (n, 4), bilinear between texel centres."""
    # The last half texel, where roughness is 1 and eyes look straight on, goes on as the one before.
    x, y = (np.clip(np.asarray(value, np.float32) * np.float32(SIZE) - np.float32(0.5), 0.0, SIZE - 0.5)
            for value in (cosine, roughness))
    column, row = (np.minimum(value.astype(np.int32), SIZE - 2) for value in (x, y))
    fx, fy = (x - column)[:, None], (y - row)[:, None]
    table, first = energy_table().reshape(-1, 4), (row + block * SIZE) * SIZE + column
    lower, right, upper, opposite = (table.take(first + step, axis=0) for step in (0, 1, SIZE, SIZE + 1))
    lower += (right - lower) * fx
    upper += (opposite - upper) * fx
    return lower + (upper - lower) * fy


def _dielectric_energy(f0: np.ndarray, cosine: np.ndarray, roughness: np.ndarray, energy: np.ndarray) -> np.ndarray:
    """Share (n, 2) of light from everywhere alike that dielectric layers of ``f0`` (n,) reflect once, at ``cosine`` and in the
    mean; ``energy`` (n, 4) is that of ``layer_energy``."""
    place = np.clip(f0, 0.0, 1.0) ** 0.25 * np.float32(INDICES - 1)
    low = np.minimum(place.astype(np.int32), INDICES - 2)
    way, blend = layer_energy(cosine, roughness, 1 + low), (place - low)[:, None]
    way = way[:, 0::2] * (1 - blend) + way[:, 1::2] * blend
    f0 = f0[:, None]
    return f0 * (energy[:, 0::2] + energy[:, 1::2]) + (1 - f0) * way


def surface_look(albedo, base_color, metallic, roughness, specular, view_cosine) -> SurfaceLook:
    """Lambert under a GGX layer as Cycles' Principled BSDF with multiple scattering has it: the twin of include/brdf.glsl. Colours
    (n, 3), the others (n,)."""
    if kernels.is_available():
        return _surface_look(albedo, base_color, metallic, roughness, specular, view_cosine)
    specular, metal = np.asarray(specular), metallic[:, None]
    energy = layer_energy(view_cosine, roughness)
    once, mean_once = energy[:, 0] + energy[:, 1], energy[:, 2] + energy[:, 3]
    # A metal that reflects almost nothing head on reflects little at grazing angles, too.
    rise = np.clip(100.0 * base_color, 0.0, 1.0) - base_color
    more = multiple_scattering(base_color + rise / np.float32(21.0), once[:, None], mean_once[:, None])
    more_mean = multiple_scattering(base_color + rise / np.float32(21.0), mean_once[:, None], mean_once[:, None])
    index = index_of(specular)
    # The mean of the Fresnel equations over a uniform sky (Kulla and Conty 2017).
    fresnel_mean = (index - 1) / (np.float32(4.08567) + np.float32(1.00071) * index)
    more_coat = multiple_scattering(fresnel_mean, once, mean_once)
    dielectric = _dielectric_energy(specular, view_cosine, roughness, energy)
    below = np.maximum(1 - dielectric[:, 0] * more_coat, 0.0)
    mean_coat = dielectric[:, 1] * multiple_scattering(fresnel_mean, mean_once, mean_once)
    mean = metal * (base_color * mean_once[:, None] + rise * energy[:, 3:4]) * more_mean + ((1 - metallic) * mean_coat)[:, None]
    diffuse = np.maximum(albedo - mean, 0.0) * (below / np.maximum(1 - mean_coat, 0.05))[:, None]
    f0, edge, coat = metal * base_color * more, metal * rise * more, (1 - metallic) * more_coat
    layer = f0 * once[:, None] + edge * energy[:, 1:2] + (coat * dielectric[:, 0])[:, None]
    return SurfaceLook(diffuse, f0, edge, layer, coat, index, np.maximum(roughness * roughness, MIN_ALPHA))


def _surface_look(*inputs: np.ndarray) -> SurfaceLook:
    """See surface_look: in one pass."""
    n = len(inputs[0])
    colours, numbers = [np.empty((n, 3), np.float32) for _ in range(4)], [np.empty(n, np.float32) for _ in range(3)]
    kernels.call("surface_look", energy_table(), SIZE, INDICES, n, *_dense(n, (3, 3, 1, 1, 1, 1), inputs), *colours, *numbers)
    return SurfaceLook(*colours, *numbers)


def _dense(n: int, widths: tuple[int, ...], parts: Iterable[np.ndarray]) -> list[np.ndarray]:
    """``parts`` as kernels take them: (n, width) float32 each, (n,) of a width of 1."""
    shapes = [(n,) if width == 1 else (n, width) for width in widths]
    return [np.ascontiguousarray(np.broadcast_to(part, shape), np.float32) for part, shape in zip(parts, shapes, strict=True)]


def reflectance(look: SurfaceLook, normals: np.ndarray, towards_eye: np.ndarray, towards_light: np.ndarray) -> np.ndarray:
    """Radiance per irradiance (n, 3) [1/sr] from unit ``towards_light`` to unit ``towards_eye`` (n, 3), with the light above the
    surface."""
    half = normalized(towards_eye + towards_light)
    nh = np.clip(dot(normals, half), 0.0, 1.0)
    # A shading normal may be seen from behind.
    nv, nl = np.maximum(dot(normals, towards_eye), 1e-3), np.maximum(dot(normals, towards_light), 1e-6)
    a2 = look.alpha * look.alpha
    t = nh * nh * (a2 - 1) + 1
    distribution = a2 / (np.pi * t * t)
    masking = 0.5 / (nl * np.sqrt(nv * nv * (1 - a2) + a2) + nv * np.sqrt(nl * nl * (1 - a2) + a2))
    return look.diffuse / np.pi + look.fresnel(dot(towards_eye, half)) * (distribution * masking)[:, None]


def reflection_density(look: SurfaceLook, normals: np.ndarray, towards_eye: np.ndarray, towards_light: np.ndarray) -> np.ndarray:
    """Density (n,) [1/sr] with which ``sample_reflection`` draws unit ``towards_light`` (n, 3): G₁·D/(4 cos) (Heitz 2018, 17); of
    mirrors beyond that of any lamp, for points on these are never where they send rays."""
    half = normalized(towards_eye + towards_light)
    nh, nv = np.clip(dot(normals, half), 0.0, 1.0), np.clip(dot(normals, towards_eye), 1e-3, 1.0)
    a2 = look.alpha * look.alpha
    t = nh * nh * (a2 - 1) + 1
    return np.where(_is_mirror(look), _MIRRORED, a2 / (np.pi * t * t) / (4.0 * nv * (1.0 + _lambda(nv, look.alpha))))


def sample_reflection(look: SurfaceLook, normals: np.ndarray, towards_eye: np.ndarray,
                      u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Unit directions (n, 3) that the layer reflects to unit ``towards_eye`` (n, 3), drawn by visible normals from ``u`` (n, 2) in
    [0, 1) (Heitz 2018), of mirrors by their own, and weights (n, 3): their mean times radiance is what the layer reflects. A
    direction below the surface weighs nothing."""
    if kernels.is_available():
        n, parts = len(normals), (look.f0, look.edge, look.coat, look.index, look.alpha, normals, towards_eye, u)
        directions, weights = np.empty((2, n, 3), np.float32)
        kernels.call("sample_reflection", n, *_dense(n, (3, 3, 1, 1, 1, 3, 3, 2), parts), directions, weights)
        return directions, weights
    cosine = np.clip(dot(normals, towards_eye), 1e-3, 1.0)
    sideways = towards_eye - normals * dot(normals, towards_eye)[:, None]
    length = np.sqrt(dot(sideways, sideways))
    # Seen straight on, any tangent is as good as any other.
    across = about(normals, np.tile(np.float32([1.0, 0.0, 0.0]), (len(normals), 1)))
    tangent = np.where(length[:, None] > 1e-6, sideways / np.maximum(length, 1e-12)[:, None], across)
    view = np.stack([np.sqrt(1.0 - cosine**2), np.zeros_like(cosine), cosine], axis=1)
    local = np.where(_is_mirror(look)[:, None], np.array([0.0, 0.0, 1.0]), _visible_normal(view, look.alpha, u))
    half = (local[:, 0:1] * tangent + local[:, 1:2] * np.cross(normals, tangent) + local[:, 2:3] * normals).astype(np.float32)
    along = np.sum(view * local, axis=1)
    light = 2.0 * along * local[:, 2] - cosine
    lit = light > 0
    mask, shadow = _lambda(cosine, look.alpha), _lambda(np.where(lit, light, 1.0), look.alpha)
    share = np.where(lit, (1.0 + mask) / (1.0 + mask + shadow), 0.0)
    weight = look.fresnel(along) * share[:, None]
    direction = 2.0 * dot(half, towards_eye)[:, None] * half - towards_eye
    return normalized(direction.astype(np.float32)), weight.astype(np.float32)


def _is_mirror(look: SurfaceLook) -> np.ndarray:
    """Layers (n,) bool that are too smooth to have a lobe."""
    return look.alpha <= MIN_ALPHA


def multiple_scattering(fresnel: np.ndarray, energy: np.ndarray, mean_energy: np.ndarray) -> np.ndarray:
    """By what a layer of mean reflectance ``fresnel`` that reflects ``energy`` of light once, ``mean_energy`` in the mean over a
    uniform sky, reflects more than that: 1 of what loses nothing is what there is to reflect."""
    again = fresnel * mean_energy / np.maximum(1 - fresnel * (1 - mean_energy), np.float32(1e-3))
    return 1 + again * (1 - energy) / np.maximum(energy, np.float32(1e-3))
