"""Hemispherical reflectance of layered closures, for a transport that has only diffuse reflection.

Every formula reproduces the white furnace of Cycles (smooth sphere, uniform sky, orthographic camera: the average over its disk
is the bihemispherical albedo). Measured with 5.2, Principled, IOR 1.5, specular level 0.5, against what is computed here:

==========  =========  ===============  ===============  ===============
roughness   metallic   base 0.2         base 0.5         base 0.8
==========  =========  ===============  ===============  ===============
0.0         0          0.274 / 0.274    0.546 / 0.546    0.818 / 0.818
0.5         0          0.248 / 0.248    0.529 / 0.530    0.811 / 0.812
1.0         0          0.218 / 0.218    0.511 / 0.511    0.804 / 0.804
0.0         1          0.239 / 0.238    0.524 / 0.524    0.810 / 0.810
0.5         1          0.197 / 0.197    0.480 / 0.480    0.785 / 0.785
1.0         1          0.098 / 0.098    0.298 / 0.298    0.628 / 0.629
==========  =========  ===============  ===============  ===============
"""

import numpy as np

# Dielectric specular albedo under a uniform sky: rows roughness, columns the square root of the reflectance at normal incidence F₀.
_ROUGHNESS = np.array([0.0, 0.25, 0.5, 0.75, 1.0])
_F0 = np.array([0.0, 0.01, 0.02, 0.04, 0.06, 0.08, 0.12, 0.2, 0.3, 0.45, 0.7, 0.95, 1.0])
_ROOT_F0 = np.sqrt(_F0)
_SPECULAR = np.array([
    [0.0, 0.0485, 0.0661, 0.0921, 0.1135, 0.1328, 0.1686, 0.2355, 0.3178, 0.4536, 0.7014, 0.9503, 1.0],
    [0.0, 0.0416, 0.0587, 0.0842, 0.1055, 0.1249, 0.1608, 0.2284, 0.3116, 0.4488, 0.6982, 0.9496, 1.0],
    [0.0, 0.0245, 0.0380, 0.0599, 0.0792, 0.0973, 0.1317, 0.1984, 0.2821, 0.4199, 0.6734, 0.9440, 1.0],
    [0.0, 0.0130, 0.0220, 0.0377, 0.0524, 0.0666, 0.0945, 0.1507, 0.2243, 0.3497, 0.6052, 0.9257, 1.0],
    [0.0, 0.0069, 0.0121, 0.0219, 0.0313, 0.0406, 0.0595, 0.0989, 0.1532, 0.2514, 0.4890, 0.8859, 1.0],
])
# Directions over which a thin wall is averaged, evenly in cos², and colours at which that is done.
_DIRECTIONS, _COLOURS = 64, 65
# GGX: what single scattering keeps of a white Fresnel term, the share of edge reflectance in the mean Fresnel term, and the mean of
# μ (1 − μ)⁶, by which the F82 model darkens edges.
_GGX_ROUGHNESS = np.linspace(0.0, 1.0, 9)
_GGX_ENERGY = np.array([1.0, 0.998, 0.990, 0.953, 0.885, 0.785, 0.664, 0.536, 0.418])
_GGX_EDGE = np.array([0.0480, 0.0470, 0.0400, 0.0305, 0.0215, 0.0150, 0.0105, 0.0085, 0.0070])
_GGX_DARKENED = np.array([0.0079, 0.0079, 0.0073, 0.0061, 0.0046, 0.0036, 0.0031, 0.0031, 0.0031])
# Where the F82 model takes its second colour: at this cosine.
_F82_COSINE = 6.0 / 7.0


def reflectance_from_ior(ior: float) -> float:
    """Fresnel reflectance of a dielectric at normal incidence."""
    return ((ior - 1.0) / (ior + 1.0)) ** 2


def dielectric_specular(roughness: float, f0) -> np.ndarray:
    """(3,) albedo of a dielectric GGX layer of normal reflectance ``f0`` (scalar or RGB): bilinear in the measured table."""
    column = np.sqrt(np.clip(np.broadcast_to(f0, (3,)), 0.0, _F0[-1]))
    row = np.clip(roughness, 0.0, 1.0) * (len(_ROUGHNESS) - 1)
    low = min(int(row), len(_ROUGHNESS) - 2)
    ends = [np.interp(column, _ROOT_F0, _SPECULAR[low + step]) for step in (0, 1)]
    return (ends[0] + (ends[1] - ends[0]) * (row - low)).astype(np.float32)


def inside_reflectance(specular: np.ndarray, ior: float) -> np.ndarray:
    """(3,) albedo from within a dielectric that reflects ``specular`` (3,) from outside, the side of lower index: 1/n² of what
    comes from within lies in the cone that leaves, the rest is reflected totally."""
    return (1.0 - (1.0 - specular) / max(ior, 1.0 / max(ior, 1e-3)) ** 2).astype(np.float32)


def thin_wall(base_color: np.ndarray, ior: float) -> tuple[np.ndarray, np.ndarray]:
    """Reflectance and transmittance (..., 3) of Principled's thin wall: two faces of index ``ior`` with all reflections between
    them, ``base_color`` (..., 3) to the power of the way through. Within 0.002 of Cycles 5.2 (0.746 and 0.136 of 0.9 and 0.2
    at IOR 1.5)."""
    cosine = np.sqrt((np.arange(_DIRECTIONS) + 0.5) / _DIRECTIONS)
    refracted = np.sqrt(np.maximum(1.0 - (1.0 - cosine**2) / max(ior, 1.0) ** 2, 1e-9))
    perpendicular = (cosine - ior * refracted) / (cosine + ior * refracted)
    parallel = (refracted - ior * cosine) / (refracted + ior * cosine)
    fresnel = (0.5 * (perpendicular * perpendicular + parallel * parallel))[:, None]
    color = np.linspace(0.0, 1.0, _COLOURS)
    once = color ** (1.0 / refracted[:, None])
    passes = (1.0 - fresnel) ** 2 * once / (1.0 - (fresnel * once) ** 2)
    curves = ((fresnel + passes * fresnel * once).mean(axis=0), passes.mean(axis=0))
    return tuple(np.interp(np.clip(base_color, 0.0, 1.0), color, curve).astype(np.float32) for curve in curves)


def through_coat(tint: np.ndarray, ior: float) -> np.ndarray:
    """(3,) what a coat of index ``ior``, of colour ``tint`` (3,) along its normal, leaves of what lies under it: tint^(1/cos θt) on
    the way out, averaged over the cosine-weighted hemisphere (Cycles' Principled, which takes the way in for free)."""
    cosine_squared = (np.arange(_DIRECTIONS) + 0.5) / _DIRECTIONS
    way = 1.0 / np.sqrt(np.maximum(1.0 - (1.0 - cosine_squared) / max(ior, 1.0) ** 2, 1e-9))
    return (np.asarray(tint, np.float64) ** way[:, None]).mean(axis=0).astype(np.float32)


def rough_diffuse(color: np.ndarray, roughness: float) -> np.ndarray:
    """Albedo of Cycles' Oren-Nayar closure of ``color`` (..., 3), Fujii's improved form: E ρ of single scattering, and of multiple
    scattering ρ³ E (1 − E) / (1 − ρ (1 − E)); E is the albedo of white. Within 0.001 of Cycles 5.2, whose last term has one ρ more
    than conserves the energy of what is coloured."""
    rho, sigma = np.clip(color, 0.0, 1.0), min(max(roughness, 0.0), 1.0)
    scale = 1.0 / (np.pi + sigma * (np.pi / 2.0 - 2.0 / 3.0))
    energy = np.float32(scale * (np.pi + sigma * (2.0 * np.pi - 5.6) / 3.0))
    return color * energy + rho**3 * (energy * (1.0 - energy)) / (1.0 - rho * (1.0 - energy))


def metal(base_color: np.ndarray, roughness: float, multiple_scattering: bool = True, edge=1.0) -> np.ndarray:
    """Albedo of a GGX conductor whose reflectance at normal incidence is ``base_color`` (..., 3).

    F·E / (1 − F·(1 − E)) with the mean Fresnel term F and the single-scattering energy E (the closed form of the multiple
    scattering in Kulla & Conty 2017); F·E without it. ``edge`` (3,) is the second colour of the F82 model (Kutz et al., "Novel
    aspects of the Adobe Standard Material", 2021), 1 for Schlick's; None: reflectance that does not rise towards grazing angles.
    """
    fresnel = base_color
    if edge is not None:
        rise = np.float32(np.interp(roughness, _GGX_ROUGHNESS, _GGX_EDGE))
        at_82 = base_color + (1.0 - base_color) * np.float32(_F82_COSINE**5)
        fall = at_82 * ((1.0 - np.asarray(edge, np.float32)) * np.float32(7.0 / _F82_COSINE**6))
        fresnel = base_color + (1.0 - base_color) * rise - fall * np.float32(np.interp(roughness, _GGX_ROUGHNESS, _GGX_DARKENED))
    return _scattered_on(np.clip(fresnel, 0.0, None), roughness, multiple_scattering)


def conductor_fresnel(index: np.ndarray, extinction: np.ndarray, cosine) -> np.ndarray:
    """Fresnel reflectance of the complex index n + ik, (..., 3) each, at ``cosine`` (unpolarized; n and k large beside sin θ)."""
    both = index * index + extinction * extinction
    across = (both - 2.0 * index * cosine + cosine**2) / np.maximum(both + 2.0 * index * cosine + cosine**2, 1e-9)
    along = (both * cosine**2 - 2.0 * index * cosine + 1.0) / np.maximum(both * cosine**2 + 2.0 * index * cosine + 1.0, 1e-9)
    return 0.5 * (across + along)


def conductor(index: np.ndarray, extinction: np.ndarray, roughness: float, multiple_scattering: bool = True) -> np.ndarray:
    """Albedo (..., 3) of a GGX conductor of the complex index n + ik: its mean Fresnel term when smooth, of whose difference from
    that along the normal roughness leaves as much as of Schlick's; the rest as in ``metal``."""
    normal = conductor_fresnel(index, extinction, 1.0)
    cosines = np.sqrt((np.arange(_DIRECTIONS) + 0.5) / _DIRECTIONS)
    mean = sum(conductor_fresnel(index, extinction, cosine) for cosine in cosines) / np.float32(_DIRECTIONS)
    kept = np.float32(np.interp(roughness, _GGX_ROUGHNESS, _GGX_EDGE) / _GGX_EDGE[0])
    return _scattered_on(normal + (mean - normal) * kept, roughness, multiple_scattering)


def _scattered_on(fresnel: np.ndarray, roughness: float, multiple_scattering: bool) -> np.ndarray:
    energy = np.float32(np.interp(roughness, _GGX_ROUGHNESS, _GGX_ENERGY))
    if not multiple_scattering:
        return fresnel * energy
    return fresnel * energy / (1.0 - fresnel * (1.0 - energy))
