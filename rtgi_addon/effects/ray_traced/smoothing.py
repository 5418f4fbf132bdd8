"""Irradiance shared between pixels that show nearly the same place of the same surface.

A wavelet filter with holes (à trous; Dammertz et al. 2010) over what light arrives, not over the picture: colours and textures stay
sharp. How far a pixel's light reaches is what irradiance caching says (Ward, Rubinstein and Clear 1988): a share of the harmonic
mean distance to what lights the place, so that corners and contacts keep their shadows; and it shrinks from sample to sample, so
that the mean over many settles on the light that is there. Pixels without rays of their own are filled by the same weights
(normalized convolution; Kopf et al. 2007, "Joint Bilateral Upsampling").
"""

from collections.abc import Callable
from functools import cache
from typing import NamedTuple

import numpy as np

from ... import kernels
from ...transport.lights.world_sh import unshadowed_irradiance
from ..frame import Frame

# Taps of every pass, as many pixels apart as its step.
_KERNEL = np.float32([0.25, 0.5, 0.25])
_STEPS = 1, 2, 4
# One of every two opposite neighbours, and by how much one counts whose opposite is not like the pixel: only where nothing else is
# known. A pixel at an edge that took from one side alone would have that side's light, however evenly light changes.
_HALF, _ALONE = ((0, 1), (1, -1), (1, 0), (1, 1)), np.float32(1e-3)
# Ward's a: how far light may come along, as a share of the harmonic mean distance, in the first sample; and samples after which it
# is half of that.
_SHARE, _HALVED = 0.25, 32.0
# Normals that differ by 8° share half, by the 72nd power of their cosine, as surfaces do that lie off the plane by half a pixel's
# width. What counts by less than two to this power does not.
_LEAST_EXPONENT = -64.0
_TINY = np.float32(1e-20)


class _Places(NamedTuple):
    """What pixels show, each part in planes (h, w), or (n,) of single pixels: ``points`` and ``normals`` by their components,
    one over a pixel's width there [m], and where anything is ``seen``.
    ``pairs`` tells which have a neighbour so far down and along, and which these are. ``whole`` are points and normals of a
    picture (h, w, 3) for the kernel; None where it does not take them."""

    points: tuple[np.ndarray, ...]
    normals: tuple[np.ndarray, ...]
    inverse_width: np.ndarray
    seen: np.ndarray
    pairs: Callable[[int, int], tuple]
    whole: tuple[np.ndarray, np.ndarray] | None = None


def smoothed(frame: Frame, light: np.ndarray, known: np.ndarray, spacing: int) -> np.ndarray:
    """Irradiance (n, 3) [W·m⁻²] of the n pixels that show a surface, from ``light`` (h, w, 4), irradiance and the mean inverse
    distance [1/m] to what gives it, of the pixels that are ``known`` (h, w) bool, about ``spacing`` pixels apart. Where none is
    like a pixel, the frame's own, which of a bare one is the world's with nothing in its way."""
    whole, seen, own = frame.gbuffer.seen, frame.gbuffer.seen, frame.irradiance[..., :3]
    if frame.bare and spacing > 1:
        own = own.copy()
        own[seen] = unshadowed_irradiance(frame.scene.world, frame.gbuffer.normal[seen][:, :3])
    width, position, normal, pairs = frame.footprint, frame.gbuffer.position, frame.gbuffer.normal, _overlap(whole.shape)
    if frame.samples is not None:
        pairs = _listed(frame)
        light, known, seen, own, width, position, normal = (
            part[whole] for part in (light, known, seen, own, width, position, normal))
    width = np.where(seen, width, np.float32(1.0))
    inverse = (np.float32(1.0) / width).astype(np.float32)
    if frame.samples is None and kernels.is_available():
        dense = tuple(np.ascontiguousarray(part[..., :3], np.float32) for part in (position, normal))
        places = _Places((), (), inverse, seen, pairs, dense)
    else:
        places = _Places(_planes(position), _planes(normal), inverse, seen, pairs)
    steps = [*_STEPS, *(step for step in (8, 16, 32) if step < 2 * spacing)]
    weight = (known & seen).astype(np.float32)
    nearness, found = light[..., 3:], weight
    for step in steps if spacing > 1 else _STEPS[:1]:
        nearness, found = _pass(places, nearness, found, step, None)
    turn = frame.index if frame.samples is None else frame.turn[whole]
    share = (_SHARE / np.sqrt(1.0 + 3.0 * turn / _HALVED)).astype(np.float32)
    # The width of what has to be filled is always bridged.
    reach = np.maximum(share / np.maximum(nearness[..., 0], np.float32(1e-6)), width * (spacing - 1))
    irradiance = light[..., :3]
    for step in steps:
        irradiance, weight = _pass(places, irradiance, weight, step, reach)
    return np.where((weight > 0)[..., None], irradiance, own)[whole if frame.samples is None else ...]


def _planes(target: np.ndarray) -> tuple[np.ndarray, ...]:
    return tuple(np.ascontiguousarray(target[..., axis]) for axis in range(3))


def _pass(places: _Places, values: np.ndarray, weight: np.ndarray, step: int,
          reach: np.ndarray | None) -> tuple[np.ndarray, np.ndarray]:
    """``values`` (..., c) that count by ``weight`` (...), averaged over taps ``step`` pixels apart; ``reach`` (...) [m]."""
    if places.whole is not None:
        height, width = weight.shape
        values, weight, inverse = (np.ascontiguousarray(part, np.float32) for part in (values, weight, places.inverse_width))
        found, counted = np.empty_like(values), np.empty_like(weight)
        near = None if reach is None else np.ascontiguousarray(reach, np.float32)
        kernels.call("share_light", height, width, step, *places.whole, inverse, near, np.ascontiguousarray(places.seen),
                     values.shape[-1], values, weight, float(_ALONE), found, counted)
        return found, counted
    channels = [np.ascontiguousarray(values[..., channel]) for channel in range(values.shape[-1])]
    own = _KERNEL[1] * _KERNEL[1]
    totals, weights, most = [channel * (weight * own) for channel in channels], weight * own, np.full_like(weight, own)
    for down, along in _HALF:
        ways = [(sign * down * step, sign * along * step) for sign in (1, -1)]
        likeness = [_likeness(places, *way, reach) for way in ways]
        both = np.minimum(*likeness)
        for way, alike in zip(ways, likeness, strict=True):
            here, there = places.pairs(*way)
            counts = (both[here] + _ALONE * alike[here]) * (_KERNEL[1 + down] * _KERNEL[1 + along])
            most[here] += counts
            counts *= weight[there]
            for total, channel in zip(totals, channels, strict=True):
                total[here] += channel[there] * counts
            weights[here] += counts
    found = np.stack(totals, axis=-1) / np.maximum(weights, _TINY)[..., None]
    # A share, not a sum: pixels at edges, which take from few, would count less in the passes that follow than their opposites.
    return found, np.where(places.seen, weights / most, np.float32(0.0))


def _likeness(places: _Places, down: int, along: int, reach: np.ndarray | None) -> np.ndarray:
    """How much (...) light counts that comes to every pixel from the one so far ``down`` and ``along``, in [0, 1]."""
    points, normals, inverse_width, _, pairs, _ = places
    here, there = pairs(down, along)
    apart = [part[there] - part[here] for part in points]
    alike = np.maximum(sum(part[here] * part[there] for part in normals), np.float32(0.0))
    for _ in range(3):
        alike = alike * alike
    # To the power of 72.
    alike = np.square(np.square(np.square(alike))) * alike
    off = sum(part[here] * way for part, way in zip(normals, apart, strict=True)) * inverse_width[here]
    exponent = np.float32(-4.0) * off * off
    if reach is not None:
        near = np.minimum(reach[here], reach[there])
        exponent -= sum(way * way for way in apart) / np.maximum(near * near, _TINY)
    result = np.zeros_like(inverse_width)
    result[here] = np.where(exponent > _LEAST_EXPONENT, alike * np.exp2(exponent), np.float32(0.0))
    return result


def _overlap(shape: tuple[int, int]) -> Callable[[int, int], tuple]:
    """See _Places.pairs, for all pixels: slices."""
    def axis(size: int, shift: int) -> tuple[slice, slice]:
        return slice(max(0, -shift), min(size, size - shift)), slice(max(0, shift), min(size, size + shift))

    def pairs(down: int, along: int) -> tuple[tuple, tuple]:
        (row, other_row), (column, other_column) = axis(shape[0], down), axis(shape[1], along)
        return (row, column), (other_row, other_column)
    return pairs


def _listed(frame: Frame) -> Callable[[int, int], tuple]:
    """See _Places.pairs, for the samples of ``frame`` that show a surface: indices into a list of them. Those of one number are
    neighbours."""
    (width, height), seen = frame.size, frame.gbuffer.seen
    rows, columns = np.divmod(frame.pixel[seen], width)
    # In ascending order, as the samples are.
    known = frame.turn[seen] * (width * height) + frame.pixel[seen]

    @cache
    def pairs(down: int, along: int) -> tuple[np.ndarray, np.ndarray]:
        row, column = rows + down, columns + along
        inside = np.flatnonzero((row >= 0) & (row < height) & (column >= 0) & (column < width))
        wanted = known[inside] + (down * width + along)
        there = np.minimum(np.searchsorted(known, wanted), len(known) - 1)
        found = known[there] == wanted
        return inside[found], there[found]
    return pairs
