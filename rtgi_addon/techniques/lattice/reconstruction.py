"""Irradiance from a probe's SH radiance: linear, minimally deringed, Geomerics non-linear L1, and L1 with hallucinated ZH3.

Every reconstruction takes radiance coefficients (…, k, c) and unit normals (…, 3) whose leading dimensions broadcast, and
returns irradiance (…, c) [W·m⁻²]. ``linear`` is what a deringed probe is evaluated with; the two non-linear ones read the first
four coefficients only and win where those are all there is.

Sources: deringing each probe as little as it needs: P.-P. Sloan, "Deringing Spherical Harmonics", SIGGRAPH Asia 2017 Technical
Briefs, by a window of one strength, where we have two shares; the non-linear L1: Geomerics, "Reconstructing Diffuse Lighting from
Spherical Harmonic Data", 2015; ZH3: T. Roughton et al., "ZH3: Quadratic Zonal Harmonics", Proc. ACM Comput. Graph. Interact.
Tech. (I3D) 2024.
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
# So many times as many above order 2, whose minima lie closer together.
_MORE = 4
# Directions around the lowest one that a step of the refinement tries.
_RING = 8
# Probes that are deringed at once.
_CHUNK = 1024
# The highest band that the compiled kernels know.
_MOST_ORDER = 2
# Rays of shares are told apart to a part in a million, in engines as well; and steps to a least irradiance.
_BISECTIONS, _NEWTON = 20, 8
# What a band counts at least, as a share of all bands: one that is not there could be scaled by anything.
_LEAST_POWER = 1e-6
# How often the lowest direction of what is scaled joins those that shares are chosen for, where directions are sampled.
_ROUNDS = 2
# Bands up to here are quadratic in the direction: of band 1 the factor of (x, y, z), of band 2 the matrices of its five.
_QUADRATIC_ORDER = 2
_LINEAR = np.sqrt(3.0 / (4.0 * np.pi))
_QUADRATIC = np.sqrt(15.0 / (16.0 * np.pi)) * np.array([
    [[0, 1, 0], [1, 0, 0], [0, 0, 0]], [[0, 0, 0], [0, 0, 1], [0, 1, 0]], np.diag([-1, -1, 2]) / np.sqrt(3.0),
    [[0, 0, 1], [0, 0, 0], [1, 0, 0]], np.diag([1, -1, 0])])
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
    """Scale band 1 of each probe of ``coefficients`` (…, k, c), and all bands above it, by two shares of at most 1 that leave no
    negative irradiance in any direction or channel, and change irradiance by the least that does (root mean square over all normals
    and channels).

    Shares that leave none are a convex set, so that the one nearest to (1, 1) moves with the coefficients, and never jumps. Probes
    that have no negative irradiance come back bit for bit; L0, and so the mean irradiance, is always kept. A channel whose L0 is
    not positive has no such shares and keeps only its L0.
    """
    coefficients = np.asarray(coefficients)
    order = sh.order_of(coefficients.shape[-2])
    if order == 0:
        return coefficients
    flat = coefficients.reshape(-1, *coefficients.shape[-2:]).copy()
    chunk = _CHUNK if order <= _QUADRATIC_ORDER else _CHUNK // _MORE
    for start in range(0, len(flat), chunk):
        probes = flat[start:start + chunk]
        lit = np.where(probes[:, :1] > 0.0, probes, 0.0)
        probes[:, 1:] = lit[:, 1:]
        doubtful = np.flatnonzero(np.any(_least_irradiance(lit, order) < 0.0, axis=1))
        if not len(doubtful):
            continue
        ringing = doubtful[np.any(_lowest_irradiance(lit[doubtful], order)[0] < 0.0, axis=1)]
        if len(ringing):
            probes[ringing, 1:] = _scaled(lit[ringing].astype(np.float64), order)[:, 1:]
    return flat.reshape(coefficients.shape)


def _scaled(coefficients: np.ndarray, order: int) -> np.ndarray:
    """``coefficients`` (p, k, c) float64 of probes that all ring, scaled by their shares."""
    convolved, band = coefficients * sh.cosine_coefficients(order)[:, None], sh.bands(order)
    mean = _mean_irradiance(coefficients[:, 0])
    if order <= _QUADRATIC_ORDER:
        shares = _nearest_shares(mean, convolved, band, _quadratic_lowest(convolved))
    else:
        # Sampled directions find shares; the true minimum that they leave joins the set of its own probe, and they are found again.
        extra = np.empty((len(coefficients), 0, 3))
        for _ in range(_ROUNDS):
            shares = _nearest_shares(mean, convolved, band, _sampled_lowest(convolved, order, extra))
            found = _lowest_irradiance(coefficients * _by_band(shares, band)[..., None], order)[1]
            extra = np.concatenate([extra, found], axis=1)
    scaled = coefficients * _by_band(shares, band)[..., None]
    # What bisection leaves goes by an exact scale of the bands above 0, which also covers the rounding to float32.
    residue = np.maximum(-_lowest_irradiance(scaled, order)[0], 0.0)
    mean = np.maximum(mean, np.finfo(np.float64).tiny)
    scaled[:, 1:] *= (mean / (mean + residue + _ROUNDING * mean)).min(axis=1)[:, None, None]
    return scaled


def _by_band(shares: np.ndarray, band: np.ndarray) -> np.ndarray:
    """(p, k): the factor of each coefficient."""
    return np.concatenate([np.ones((len(shares), 1)), shares], axis=1)[:, np.minimum(band, 2)]


def _nearest_shares(mean: np.ndarray, convolved: np.ndarray, band: np.ndarray, lowest) -> np.ndarray:
    """Shares (p, 2) in [0, 1]² of band 1 and of the bands above it, for probes of ``mean`` irradiance (p, c): of those that leave
    none negative the nearest to (1, 1), a band counting by its square. ``lowest`` gives for shares (p,) and (p,) the least that
    these make of the bands (p, c), and what band 1 is there (p, c).

    Along a ray from (0, 0), on which the least falls in proportion, shares serve up to one place. So a bisection over rays is all
    that it takes: on either side of the nearest place the way along the border towards it is known from the direction in which
    irradiance is 0.
    """
    power = np.stack([np.sum(convolved[:, band == 1] ** 2, axis=(1, 2)), np.sum(convolved[:, band > 1] ** 2, axis=(1, 2))])
    power = power + _LEAST_POWER * power.sum(axis=0)
    low, high = np.zeros(len(mean)), np.ones(len(mean))
    for step in range(_BISECTIONS + 1):
        turn = 0.5 * (low + high)
        ray = np.stack([1.0 - turn, turn])
        least, first = lowest(*ray)
        reach = np.where(least < 0.0, mean / np.maximum(-least, np.finfo(np.float64).tiny), np.inf)
        channel = np.argmin(reach, axis=1)[:, None]
        reach, least, first = (np.take_along_axis(values, channel, axis=1)[:, 0] for values in (reach, least, first))
        nearest = np.sum(power * ray, axis=0) / np.sum(power * ray**2, axis=0)
        edge = 1.0 / np.maximum(ray[0], ray[1])
        length = np.minimum(np.minimum(reach, nearest), edge)
        shares = length * ray
        if step == _BISECTIONS:
            break
        # How irradiance grows with the shares at the border: where it is 0, at the square's sides, or on the way to them.
        grows = np.stack([first / np.maximum(ray[0], 1e-30), (least - first) / np.maximum(ray[1], 1e-30)])
        side = np.where(turn < 0.5, np.array([[-1.0], [0.0]]), np.array([[0.0], [-1.0]]))
        grows = np.where(length < reach, np.where(length < edge, -ray, side), grows)
        left = power * (1.0 - shares)
        up = left[0] * grows[1] > left[1] * grows[0]
        low, high = np.where(up, turn, low), np.where(up, high, turn)
    return shares.T


def _quadratic_lowest(convolved: np.ndarray):
    """``lowest`` of ``_nearest_shares`` for bands up to 2, exactly: the least of linear·n + nᵀ·M·n over unit vectors n by the dual
    of this problem, which has no gap, in the axes of M, and Newton's steps after J. Moré and D. Sorensen, "Computing a Trust
    Region Step", SIAM J. Sci. Stat. Comput. 4, 1983."""
    linear = np.moveaxis(convolved[:, [3, 1, 2]], 1, 2) * _LINEAR
    if convolved.shape[1] > 4:
        values, axes = np.linalg.eigh(np.einsum("pkc,kij->pcij", convolved[:, 4:9], _QUADRATIC))
        linear = np.einsum("pci,pcij->pcj", linear, axes)
    else:
        values = np.zeros_like(linear)

    def lowest(first: np.ndarray, second: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        line, bend = 0.5 * first[:, None, None] * linear, second[:, None, None] * values
        low = np.max(np.abs(line) - bend, axis=2)
        shift = low
        for _ in range(_NEWTON):
            gap = np.maximum(bend + shift[..., None], 1e-30)
            part = line / gap
            square, slope = np.sum(part**2, axis=2), np.sum(part**2 / gap, axis=2)
            step = np.divide((np.sqrt(square) - 1.0) * square, slope, out=np.zeros_like(square), where=slope > 0.0)
            shift = np.maximum(low, shift + step)
        half = np.sum(line**2 / np.maximum(bend + shift[..., None], 1e-30), axis=2)
        return -shift - half, -2.0 * half

    return lowest


def _sampled_lowest(convolved: np.ndarray, order: int, extra: np.ndarray):
    """``lowest`` of ``_nearest_shares`` for any bands, at the common directions and each probe's own ``extra`` (p, m, 3)."""
    band = sh.bands(order)
    shared, by_probe = sh.evaluate(_directions(order).astype(np.float64), order), sh.evaluate(extra, order)
    of_first, of_rest = (np.concatenate([shared[:, chosen] @ convolved[:, chosen], by_probe[..., chosen] @ convolved[:, chosen]],
                                        axis=1) for chosen in (band == 1, band > 1))

    def lowest(first: np.ndarray, second: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        of_one = first[:, None, None] * of_first
        total = of_one + second[:, None, None] * of_rest
        where = np.argmin(total, axis=1)[:, None]
        return np.take_along_axis(total, where, axis=1)[:, 0], np.take_along_axis(of_one, where, axis=1)[:, 0]

    return lowest


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
    common = _directions(order)
    step = np.sqrt(4.0 * np.pi / len(common))
    if kernels.is_available() and order <= _MOST_ORDER:
        count, channels = len(coefficients), coefficients.shape[2]
        values, directions = np.empty((count, channels)), np.empty((count, channels, 3))
        common = common.astype(np.float64)
        kernels.call("lowest_irradiance", count, order, channels, np.array(convolved, np.float64), len(common), common,
                     np.ascontiguousarray(sh.evaluate(common, order)), step, _REFINEMENTS, _RING,
                     np.stack([np.cos(angle), np.sin(angle)], axis=1), values, directions)
        return values, directions
    sampled = sh.evaluate(common, order) @ convolved
    best = np.argmin(sampled, axis=1)
    directions = common[best].astype(np.float64)
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
def _directions(order: int) -> np.ndarray:
    return sampling.fibonacci_sphere(_DIRECTIONS * (_MORE if order > _QUADRATIC_ORDER else 1))


def _l1_per_channel(coefficients: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """L0 (…, c), the unit L1 vector (…, 3, c) in x, y, z and its length (…, c) of every channel."""
    vector = np.take(coefficients, [3, 1, 2], axis=-2)
    length = np.linalg.norm(vector, axis=-2)
    axis = vector / np.maximum(length, np.finfo(np.float32).tiny)[..., None, :]
    return np.maximum(coefficients[..., 0, :], 0.0), axis, length


def _mean_irradiance(l0: np.ndarray) -> np.ndarray:
    """Irradiance averaged over all normals: A₀·Y₀₀·L0."""
    return l0 * np.float32(np.sqrt(np.pi) / 2.0)
