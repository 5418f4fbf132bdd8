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

from ... import kernels
from ...numerics import sampling, sh
from ...transport.vectors import LUMINANCE

RECONSTRUCTIONS = ("deringed", "linear", "geomerics", "zh3")

# Directions in which every probe is searched for negative irradiance, and steps by which the lowest one found is refined: each
# halves the distance, from a tenth of a radian to two thousandths of a degree.
_DIRECTIONS, _REFINEMENTS = 1024, 12
# Directions around the lowest one that a step of the refinement tries.
_RING = 8
# Probes that are windowed at once.
_CHUNK = 256
# The highest band that the compiled kernels know.
_MOST_ORDER = 2
# Strengths of the window that are tried, from harmless to flat: four a decade, then bisected so often, to a part in 10⁷.
_WEAKEST, _STRONGEST, _RUNGS, _BISECTIONS = 1e-4, 1e4, 33, 24
# How often the lowest direction of the windowed probe joins those that the window is chosen for.
_ROUNDS = 2
# What bands above 0 are scaled down by, as a share of the mean, for rounding to float32.
_ROUNDING = 1e-6
# ZH3 (§3.4.3): the quadratic band's factors of the ratio and of its square, by the paper's fit.
_ZH3_LINEAR, _ZH3_SQUARE = 0.08, 0.6


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
    luminance = LUMINANCE if coefficients.shape[-1] == 3 else np.ones(coefficients.shape[-1], np.float32)
    axis = vector @ luminance
    axis = axis / np.maximum(np.linalg.norm(axis, axis=-1, keepdims=True), np.finfo(np.float32).tiny)
    mean = np.maximum(coefficients[..., 0, :], 0.0)
    along = np.abs(np.einsum("...ic,...i->...c", vector, axis))
    ratio = np.minimum(along / np.maximum(mean, np.finfo(np.float32).tiny), np.sqrt(3.0))
    cosine = np.sum(axis * normals, axis=-1)[..., None]
    zonal = np.sqrt(5.0 / (16.0 * np.pi)) * (3.0 * cosine * cosine - 1.0)
    return linear(coefficients[..., :4, :], normals) + (np.pi / 4.0) * mean * (_ZH3_LINEAR * ratio + _ZH3_SQUARE * ratio**2) * zonal


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
        probes = flat[start:start + _CHUNK]
        lit = np.where(probes[:, :1] > 0.0, probes, 0.0)
        probes[:, 1:] = lit[:, 1:]
        doubtful = np.flatnonzero(np.any(_least_irradiance(lit, order) < 0.0, axis=1))
        if not len(doubtful):
            continue
        ringing = doubtful[np.any(_lowest_irradiance(lit[doubtful], order)[0] < 0.0, axis=1)]
        if len(ringing):
            probes[ringing, 1:] = _window(lit[ringing].astype(np.float64), order)[:, 1:]
    return flat.reshape(coefficients.shape)


def _window(coefficients: np.ndarray, order: int) -> np.ndarray:
    """The windowed ``coefficients`` (p, k, c) float64 of probes that all ring."""
    band = sh.bands(order)
    # Sampled directions find λ; the true minimum found between them joins the set of its own probe, and λ is found again.
    extra = np.empty((len(coefficients), 0, 3))
    for _ in range(_ROUNDS):
        strength = _smallest_strength(_band_irradiance(coefficients, order, extra))
        windowed = coefficients * _window_weights(strength, order)[:, band, None]
        extra = np.concatenate([extra, _lowest_irradiance(windowed, order)[1]], axis=1)
    strength = _smallest_strength(_band_irradiance(coefficients, order, extra))
    windowed = coefficients * _window_weights(strength, order)[:, band, None]
    # What bisection and refinement leave (about 1e-6 of the mean) goes by an exact scale of the bands above 0, which also
    # covers the rounding to float32.
    residue = np.maximum(-_lowest_irradiance(windowed, order)[0], 0.0)
    mean = np.maximum(_mean_irradiance(windowed[:, 0]), np.finfo(np.float64).tiny)
    windowed[:, 1:] *= (mean / (mean + residue + _ROUNDING * mean))[:, None]
    return windowed


def _smallest_strength(irradiance_bands: np.ndarray) -> np.ndarray:
    """Smallest λ (p,) for which Σ_l w_l(λ)·E_l ≥ 0 at every sample; ``irradiance_bands`` (p, samples, L + 1)."""
    order = irradiance_bands.shape[-1] - 1
    ladder = np.geomspace(_WEAKEST, _STRONGEST, _RUNGS)
    if kernels.is_available() and order <= _MOST_ORDER:
        strength = np.empty(len(irradiance_bands))
        kernels.call("window_strength", *irradiance_bands.shape, np.array(irradiance_bands), _RUNGS, ladder, _BISECTIONS, strength)
        return strength

    def rings(strength):
        return np.any(irradiance_bands @ _window_weights(strength, order)[..., None] < 0.0, axis=(1, 2))

    # The feasible λ need not form one interval: walk up a ladder and bisect the first step that ends without ringing.
    low, high = np.zeros(len(irradiance_bands)), np.full(len(irradiance_bands), np.inf)
    for rung in ladder:
        still = np.isinf(high)
        if not still.any():
            break
        bad = rings(np.full(len(high), rung))
        low = np.where(still & bad, rung, low)
        high = np.where(still & ~bad, rung, high)
    high = np.where(np.isinf(high), _STRONGEST, high)
    for _ in range(_BISECTIONS):
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
    shared, by_probe = sh.evaluate(_directions().astype(np.float64), order), sh.evaluate(extra, order)
    of_bands = []
    for l in range(order + 1):
        chosen = band == l
        everywhere = [basis[..., chosen] @ convolved[:, chosen] for basis in (shared, by_probe)]
        of_bands.append(np.concatenate(everywhere, axis=1))
    stacked = np.stack(of_bands, axis=-1)
    return stacked.reshape(len(coefficients), -1, order + 1)


def _least_irradiance(coefficients: np.ndarray, order: int) -> np.ndarray:
    """What no irradiance (p, c) of ``coefficients`` (p, k, c) lies below: a band's sum is at most its norm times √((2l + 1)/4π), by
    Cauchy-Schwarz and the addition theorem. Most probes are seen not to ring by this alone."""
    convolved, band = coefficients * sh.cosine_coefficients(order)[:, None], sh.bands(order)
    most = np.sqrt((2 * np.arange(order + 1) + 1) / (4.0 * np.pi))
    above = sum(most[l] * np.linalg.norm(convolved[:, band == l], axis=1) for l in range(1, order + 1))
    return most[0] * convolved[:, 0] - (1.0 + _ROUNDING) * above


def _lowest_irradiance(coefficients: np.ndarray, order: int) -> tuple[np.ndarray, np.ndarray]:
    """Lowest irradiance (p, c) float64 of each channel of each probe, and the direction (p, c, 3) where it is.

    The best of the common directions is refined by a pattern search on the sphere whose step halves each time.
    """
    convolved = coefficients * sh.cosine_coefficients(order)[:, None]
    angle = 2.0 * np.pi * np.arange(_RING) / _RING
    step = np.sqrt(4.0 * np.pi / _DIRECTIONS)
    if kernels.is_available() and order <= _MOST_ORDER:
        count, channels = len(coefficients), coefficients.shape[2]
        values, directions = np.empty((count, channels)), np.empty((count, channels, 3))
        common = _directions().astype(np.float64)
        kernels.call("lowest_irradiance", count, order, channels, np.array(convolved, np.float64), len(common), common,
                     np.ascontiguousarray(sh.evaluate(common, order)), step, _REFINEMENTS, _RING,
                     np.stack([np.cos(angle), np.sin(angle)], axis=1), values, directions)
        return values, directions
    sampled = sh.evaluate(_directions(), order) @ convolved
    best = np.argmin(sampled, axis=1)
    directions = _directions()[best].astype(np.float64)
    values = np.take_along_axis(sampled, best[:, None], axis=1)[:, 0]
    # A spherical polynomial of degree L bends by at most L² times its range, so only these can dip below 0 between samples.
    margin = 0.5 * (step * order) ** 2 * (np.max(sampled, axis=1) - values)
    probe, channel = np.nonzero(values < margin)
    dipping = np.take_along_axis(convolved[probe], channel[:, None, None], axis=2)[..., 0]
    centre = directions[probe, channel]
    for _ in range(_REFINEMENTS):
        tangent, bitangent = sampling.frame(centre)
        ring = np.cos(angle)[:, None] * tangent[:, None] + np.sin(angle)[:, None] * bitangent[:, None]
        candidates = np.concatenate([centre[:, None], centre[:, None] + step * ring], axis=1)
        candidates /= np.linalg.norm(candidates, axis=-1, keepdims=True)
        heights = (sh.evaluate(candidates, order) @ dipping[..., None])[..., 0]
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
