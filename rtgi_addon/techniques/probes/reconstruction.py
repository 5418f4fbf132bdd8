"""Irradiance from a probe's SH radiance: linear, minimally deringed, Geomerics non-linear L1, and L1 with hallucinated ZH3.

Every reconstruction takes radiance coefficients (…, k, c) and unit normals (…, 3) whose leading dimensions broadcast, and
returns irradiance (…, c) [W·m⁻²]. ``linear`` is what a deringed probe is evaluated with; the two non-linear ones read the first
four coefficients only and win where those are all there is.

Sources: the window: P.-P. Sloan, "Deringing Spherical Harmonics", SIGGRAPH Asia 2017 Technical Briefs; the non-linear L1:
Geomerics, "Reconstructing Diffuse Lighting from Spherical Harmonic Data", 2015; ZH3: T. Roughton et al., "ZH3: Quadratic Zonal
Harmonics", Proc. ACM Comput. Graph. Interact. Tech. (I3D) 2024.
"""

from functools import cache

import numpy as np

from ...numerics import sampling, sh

RECONSTRUCTIONS = ("deringed", "linear", "geomerics", "zh3")

_LUMINANCE_REC709 = np.array([0.2126, 0.7152, 0.0722], np.float32)
_DIRECTIONS = 1024
_CHUNK = 256
_REFINEMENTS = 12


def reconstruct(name: str, coefficients: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Irradiance (…, c), never negative, by the reconstruction called ``name``; 'deringed' expects deringed coefficients."""
    method = {"deringed": linear, "linear": linear, "geomerics": geomerics, "zh3": zh3}[name]
    if coefficients.shape[-2] < 4:
        method = linear
    return np.maximum(method(coefficients, normals), 0.0)


def linear(coefficients: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """E(n) = Σ A_l·L_lm·Y_lm(n) (Ramamoorthi & Hanrahan 2001): negative where a bright light rings."""
    order = sh.order_of(coefficients.shape[-2])
    weights = sh.evaluate(normals, order) * sh.cosine_coefficients(order)
    return np.einsum("...k,...kc->...c", weights, coefficients)


def geomerics(coefficients: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Non-linear L1, each channel by itself: E = R₀·(a + (1 − a)(p + 1)q^p).

    p = 1 + 2r, a = (1 − r)/(1 + r), q = (1 + cos)/2 and r = |L1|/(√3·L0), at most 1. Keeps the mean of the sphere, is never
    negative for L0 ≥ 0 and exact in its peak for a single direction.
    """
    mean, axis, length = _l1_per_channel(coefficients)
    r = np.minimum(length / np.maximum(np.sqrt(3.0) * mean, np.finfo(np.float32).tiny), 1.0)
    q = np.clip(0.5 * (1.0 + np.einsum("...ic,...i->...c", axis, normals)), 0.0, 1.0)
    p = 1.0 + 2.0 * r
    a = (1.0 - r) / (1.0 + r)
    return _mean_irradiance(mean) * (a + (1.0 - a) * (p + 1.0) * q**p)


def zh3(coefficients: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """L1 plus a zonal quadratic band guessed from it: L₂ = L0·(0.08·r + 0.6·r²) about the luminance's L1 axis (§3.4.3).

    r is the share of a channel's L1 along that axis over its L0. One-channel input uses its own axis. Slightly negative for
    a single direction (−0.04 of its peak).
    """
    l1 = coefficients[..., 1:4, :]
    vector = np.take(l1, [2, 0, 1], axis=-2)
    luminance = _LUMINANCE_REC709 if coefficients.shape[-1] == 3 else np.ones(coefficients.shape[-1], np.float32)
    axis = vector @ luminance
    axis = axis / np.maximum(np.linalg.norm(axis, axis=-1, keepdims=True), np.finfo(np.float32).tiny)
    mean = np.maximum(coefficients[..., 0, :], 0.0)
    along = np.abs(np.einsum("...ic,...i->...c", vector, axis))
    ratio = np.minimum(along / np.maximum(mean, np.finfo(np.float32).tiny), np.sqrt(3.0))
    cosine = np.sum(axis * normals, axis=-1)[..., None]
    zonal = np.sqrt(5.0 / (16.0 * np.pi)) * (3.0 * cosine * cosine - 1.0)
    return linear(coefficients[..., :4, :], normals) + (np.pi / 4.0) * mean * (0.08 * ratio + 0.6 * ratio**2) * zonal


def dering(coefficients: np.ndarray) -> np.ndarray:
    """Window each probe of ``coefficients`` (…, k, c) by 1/(1 + λ·l²(l + 1)²) with the smallest λ that leaves no negative
    irradiance in any direction or channel.

    Probes that have none come back bit for bit; L0, and so the mean irradiance, is always kept. A channel whose L0 is not
    positive has no such window and keeps only its L0.
    """
    coefficients = np.asarray(coefficients)
    order = sh.order_of(coefficients.shape[-2])
    if order == 0:
        return coefficients
    flat = coefficients.reshape(-1, *coefficients.shape[-2:]).copy()
    for start in range(0, len(flat), _CHUNK):
        part = flat[start:start + _CHUNK]
        lit = np.where(part[:, :1] > 0.0, part, 0.0)
        part[:, 1:] = lit[:, 1:]
        ringing = np.flatnonzero(np.any(_lowest_irradiance(lit, order)[0] < 0.0, axis=1))
        if len(ringing):
            part[ringing, 1:] = _window(lit[ringing].astype(np.float64), order)[:, 1:]
    return flat.reshape(coefficients.shape)


def _window(coefficients: np.ndarray, order: int) -> np.ndarray:
    """The windowed ``coefficients`` (p, k, c) float64 of probes that all ring."""
    band = sh.bands(order)
    # Sampled directions find λ; the true minimum found between them joins the set of its own probe, and λ is found again.
    extra = np.empty((len(coefficients), 0, 3))
    for _ in range(2):
        strength = _smallest_strength(_band_irradiance(coefficients, order, extra))
        windowed = coefficients * _window_weights(strength, order)[:, band, None]
        extra = np.concatenate([extra, _lowest_irradiance(windowed, order)[1]], axis=1)
    strength = _smallest_strength(_band_irradiance(coefficients, order, extra))
    windowed = coefficients * _window_weights(strength, order)[:, band, None]
    # What bisection and refinement leave (about 1e-6 of the mean) goes by an exact scale of the bands above 0, which also
    # covers the rounding to float32.
    residue = np.maximum(-_lowest_irradiance(windowed, order)[0], 0.0)
    mean = np.maximum(_mean_irradiance(windowed[:, 0]), np.finfo(np.float64).tiny)
    windowed[:, 1:] *= (mean / (mean + residue + 1e-6 * mean))[:, None]
    return windowed


def _smallest_strength(irradiance_bands: np.ndarray) -> np.ndarray:
    """Smallest λ (p,) for which Σ_l w_l(λ)·E_l ≥ 0 at every sample; ``irradiance_bands`` (p, samples, L + 1)."""
    order = irradiance_bands.shape[-1] - 1

    def rings(strength):
        return np.any(irradiance_bands @ _window_weights(strength, order)[..., None] < 0.0, axis=(1, 2))

    # The feasible λ need not form one interval: walk up a ladder and bisect the first step that ends without ringing.
    low, high = np.zeros(len(irradiance_bands)), np.full(len(irradiance_bands), np.inf)
    for rung in np.geomspace(1e-4, 1e4, 33):
        still = np.isinf(high)
        if not still.any():
            break
        bad = rings(np.full(len(high), rung))
        low = np.where(still & bad, rung, low)
        high = np.where(still & ~bad, rung, high)
    high = np.where(np.isinf(high), 1e4, high)
    for _ in range(24):
        middle = 0.5 * (low + high)
        bad = rings(middle)
        low, high = np.where(bad, middle, low), np.where(bad, high, middle)
    return high


def _window_weights(strength: np.ndarray, order: int) -> np.ndarray:
    l = np.arange(order + 1)
    return 1.0 / (1.0 + strength[:, None] * (l * (l + 1)) ** 2)


def _band_irradiance(coefficients: np.ndarray, order: int, extra: np.ndarray) -> np.ndarray:
    """Each band's irradiance (p, samples, L + 1) at the common directions and each probe's own ``extra`` (p, m, 3), all
    channels that have light one after the other."""
    band, convolved = sh.bands(order), coefficients * sh.cosine_coefficients(order)[:, None]
    common, own = sh.evaluate(_directions().astype(np.float64), order), sh.evaluate(extra, order)
    parts = []
    for l in range(order + 1):
        chosen = band == l
        parts.append(np.concatenate([common[:, chosen] @ convolved[:, chosen], own[..., chosen] @ convolved[:, chosen]], axis=1))
    stacked = np.stack(parts, axis=-1)
    return stacked.reshape(len(coefficients), -1, order + 1)


def _lowest_irradiance(coefficients: np.ndarray, order: int) -> tuple[np.ndarray, np.ndarray]:
    """Lowest irradiance (p, c) float64 of each channel of each probe, and the direction (p, c, 3) where it is.

    The best of the common directions is refined by a pattern search on the sphere whose step halves each time.
    """
    convolved = coefficients * sh.cosine_coefficients(order)[:, None]
    sampled = sh.evaluate(_directions(), order) @ convolved
    best = np.argmin(sampled, axis=1)
    directions = _directions()[best].astype(np.float64)
    values = np.take_along_axis(sampled, best[:, None], axis=1)[:, 0]
    angle = 2.0 * np.pi * np.arange(8) / 8
    step = np.sqrt(4.0 * np.pi / _DIRECTIONS)
    # A spherical polynomial of degree L bends by at most L² times its range, so only these can dip below 0 between samples.
    margin = 0.5 * (step * order) ** 2 * (np.max(sampled, axis=1) - values)
    probe, channel = np.nonzero(values < margin)
    own = np.take_along_axis(convolved[probe], channel[:, None, None], axis=2)[..., 0]
    centre = directions[probe, channel]
    for _ in range(_REFINEMENTS):
        tangent, bitangent = sampling.frame(centre)
        ring = np.cos(angle)[:, None] * tangent[:, None] + np.sin(angle)[:, None] * bitangent[:, None]
        candidates = np.concatenate([centre[:, None], centre[:, None] + step * ring], axis=1)
        candidates /= np.linalg.norm(candidates, axis=-1, keepdims=True)
        heights = (sh.evaluate(candidates, order) @ own[..., None])[..., 0]
        best = np.argmin(heights, axis=1)
        centre = candidates[np.arange(len(best)), best]
        step *= 0.5
    directions[probe, channel] = centre
    values = values.astype(np.float64)
    if len(probe):
        values[probe, channel] = heights[np.arange(len(best)), best]
    return values, directions


@cache
def _directions() -> np.ndarray:
    return sampling.fibonacci_sphere(_DIRECTIONS)


def _l1_per_channel(coefficients: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """L0 (…, c), the unit L1 vector (…, 3, c) in x, y, z and its length (…, c) of every channel."""
    vector = np.take(coefficients, [3, 1, 2], axis=-2)
    length = np.linalg.norm(vector, axis=-2)
    axis = vector / np.maximum(length, np.finfo(np.float32).tiny)[..., None, :]
    return np.maximum(coefficients[..., 0, :], 0.0), axis, length


def _mean_irradiance(l0: np.ndarray) -> np.ndarray:
    """Irradiance averaged over all normals: A₀·Y₀₀·L0."""
    return l0 * np.float32(np.sqrt(np.pi) / 2.0)
