"""What a GGX layer reflects in all, as a table: the rest of the light is left for what lies below it.

Smith's height-correlated shadowing and masking (Heitz 2014), Schlick's Fresnel term, α = roughness²: E(cos, roughness) = f0·a +
f90·b (the split sum of Karis 2013), integrated over visible normals (Heitz 2018).
"""

from functools import cache

import numpy as np

from ..numerics.sampling import sobol_owen

SIZE = 32
_SAMPLES = 512
# α below this is taken as this: a lamp of no extent would be seen in a mirror as an infinitely bright point.
MIN_ALPHA = 2e-3


@cache
def energy_table() -> np.ndarray:
    """(SIZE, SIZE, 4) float32: a row a roughness, a column a cosine of the view, both from 0 to 1 at texel centres; a and b, and
    their means over a uniform sky."""
    cosine = ((np.arange(SIZE) + 0.5) / SIZE)[None, :, None]
    alpha = np.maximum(((np.arange(SIZE) + 0.5) / SIZE) ** 2, MIN_ALPHA)[:, None, None]
    u = sobol_owen(_SAMPLES, 2, 0).astype(np.float64)
    view = np.stack(np.broadcast_arrays(np.sqrt(1.0 - cosine**2), 0.0, cosine), axis=-1)
    half = _visible_normal(view, alpha, u)
    along = np.sum(view * half, axis=-1)
    light_z = 2.0 * along * half[..., 2] - cosine
    lit = light_z > 0
    # What is left of visible normals' own masking: G2/G1.
    mask, shadow = _lambda(cosine, alpha), _lambda(np.where(lit, light_z, 1.0), alpha)
    share = np.where(lit, (1.0 + mask) / (1.0 + mask + shadow), 0.0)
    grazing = np.clip(1.0 - along, 0.0, 1.0) ** 5
    table = np.stack([np.mean(share * (1.0 - grazing), axis=-1), np.mean(share * grazing, axis=-1)], axis=-1)
    sky = 2.0 * cosine[0] / SIZE
    means = np.repeat(np.sum(table * sky, axis=1, keepdims=True), SIZE, axis=1)
    return np.concatenate([table, means], axis=-1).astype(np.float32)


def _visible_normal(view: np.ndarray, alpha: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Normals of microfacets as they are seen from ``view`` (..., 3)."""
    stretched = view * np.stack(np.broadcast_arrays(alpha, alpha, 1.0), axis=-1)
    stretched /= np.linalg.norm(stretched, axis=-1, keepdims=True)
    # The view lies in the plane y = 0: the basis is (sideways, up, stretched).
    side = np.array([0.0, 1.0, 0.0])
    up = np.cross(stretched, side)
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
