"""Where a bake was too coarse for what it shows: a spot of a few texels that has most of the light is known by a few samples only.

What matters is the sum: a texel's mean must be right, how light lies within it is below what transport resolves. So the places with
the most doubt are baked again through a magnifying glass, and their texels become the means of what that shows. Where a mesh of
many polygons has its bake at their corners, those between whose corners a light may begin or end get texels as well.
"""

from dataclasses import replace

import numpy as np

from ...scene import Channel, Material, Texture
from ...transport.vectors import luminance
from .values import Value, texels

# The UV map of the polygons that have texels beside corners.
DETAIL_UV = "_rtgi_detail"
# Rows of ones above a texture of details, which all other polygons read.
_PLAIN_ROWS = 4

# Doubt, as a share of the whole sum, up to which a bake will do; and how much of it may remain.
DOUBT, REMAINING = 0.005, 0.0015
# Places are squares of so many parts of the texture's side, and at most so many are baked again.
PARTS, MOST_PLACES = 16, 8
# Standard deviation of a mean of one sample of what lies anywhere within a range, over that range.
_SPREAD = 12.0**-0.5


def doubtful_places(rgb: np.ndarray, filled: np.ndarray, samples: int) -> list[tuple[int, int]]:
    """Row and column, in PARTS of the side, of the places of a bake ``rgb`` (side, side, 3), known where ``filled`` (side, side),
    to look at more closely, the worst first; none where the sum of its light is well known from ``samples`` per texel."""
    value = np.where(filled, luminance(np.maximum(rgb, 0.0)), 0.0).astype(np.float64)
    total = value.sum()
    if total <= 0.0:
        return []
    doubt = np.square(_SPREAD * _range_around(value, filled)) / samples
    if doubt.sum() <= (DOUBT * total) ** 2:
        return []
    side = len(value) // PARTS
    places = doubt.reshape(PARTS, side, PARTS, side).sum(axis=(1, 3)).ravel()
    order = np.argsort(-places, kind="stable")
    left = places.sum() - np.cumsum(places[order])
    count = int(np.searchsorted(-left, -(REMAINING * total) ** 2)) + 1
    return [divmod(int(place), PARTS) for place in order[:min(count, MOST_PLACES)]]


def sharpened(rgb: np.ndarray, filled: np.ndarray, place: tuple[int, int], close: np.ndarray,
              close_filled: np.ndarray) -> np.ndarray:
    """``rgb`` with the texels of ``place`` as the means of ``close`` (side, side, 3), which shows nothing else, where that is
    ``close_filled``."""
    side = len(rgb) // PARTS
    blocks = (side, PARTS, side, PARTS)
    count = close_filled.reshape(blocks).sum(axis=(1, 3))
    mean = np.where(close_filled[..., None], close, 0.0).reshape(*blocks, 3).sum(axis=(1, 3), dtype=np.float64)
    mean = mean / np.maximum(count, 1)[..., None]
    rows, columns = (slice(part * side, (part + 1) * side) for part in place)
    known = (filled[rows, columns] & (count > 0))[..., None]
    result = rgb.copy()
    result[rows, columns] = np.where(known, mean, rgb[rows, columns])
    return result


def magnified(uv: np.ndarray, place: tuple[int, int]) -> np.ndarray:
    """UVs (n, 2) under which the whole texture shows ``place`` alone."""
    return (uv * PARTS - np.float32([place[1], place[0]])).astype(np.float32)


def _range_around(value: np.ndarray, filled: np.ndarray) -> np.ndarray:
    """(side, side) the range of ``value`` over each filled texel and its filled neighbours; 0 elsewhere."""
    high, low = np.where(filled, value, -np.inf), np.where(filled, value, np.inf)
    for axis in (0, 1):
        high = np.maximum.reduce([high, _moved(high, axis, 1, -np.inf), _moved(high, axis, -1, -np.inf)])
        low = np.minimum.reduce([low, _moved(low, axis, 1, np.inf), _moved(low, axis, -1, np.inf)])
    return np.where(filled, high - low, 0.0)


def _moved(values: np.ndarray, axis: int, step: int, edge: float) -> np.ndarray:
    result = np.roll(values, step, axis)
    result[(0 if step > 0 else -1,) if axis == 0 else (slice(None), 0 if step > 0 else -1)] = edge
    return result


def doubtful_polygons(corners: np.ndarray, starts: np.ndarray, areas: np.ndarray, most: int) -> np.ndarray:
    """Indices of up to ``most`` polygons that ``corners`` (loops, 3), interpolated, may be far off for, the worst first; none where
    the sum of the light is well known. ``starts`` (polygons,) are their first loops."""
    value = luminance(np.maximum(corners, 0.0)).astype(np.float64)
    high, low = np.maximum.reduceat(value, starts), np.minimum.reduceat(value, starts)
    count = np.diff(np.append(starts, len(value)))
    total = float((np.add.reduceat(value, starts) / count * areas).sum())
    doubt = np.square(_SPREAD * (high - low) * areas)
    if total <= 0.0 or doubt.sum() <= (DOUBT * total) ** 2:
        return np.zeros(0, np.int64)
    order = np.argsort(-doubt, kind="stable")[:most]
    left = doubt.sum() - np.cumsum(doubt[order])
    return order[:int(np.searchsorted(-left, -(REMAINING * total) ** 2)) + 1]


def detail_uv(uv: np.ndarray, inside: np.ndarray, side: int) -> np.ndarray:
    """UVs (…, 2) for a texture of details of ``side`` texels: ``uv`` (…, 2) where ``inside`` (…), else a place that reads one."""
    height = side + _PLAIN_ROWS
    placed = uv * np.float32([1.0, side / height])
    return np.where(inside[..., None], placed, np.float32([0.5, 1.0 - 0.5 * _PLAIN_ROWS / height])).astype(np.float32)


def in_detail(material: Material, fine: Material, attributes: dict[str, np.ndarray], inside: np.ndarray) -> Material:
    """``material``, whose emission is read from corner ``attributes``, with that of ``fine``, which was baked to texels, on the
    corners ``inside`` (t, 3) bool; both sides of it."""
    back = material.back
    if back is not None:
        back = in_detail(back, fine if fine.back is None else fine.back, attributes, inside)
    coarse, emission = material.emission.attribute, fine.emission
    if coarse is None or emission.texture is None:
        return material if back is material.back else replace(material, back=back)
    found = texels(Value(emission.constant, emission.texture, emission.texture_channel, offset=emission.offset))
    pixels = np.concatenate([found, np.ones((_PLAIN_ROWS, found.shape[1], 3), np.float32)]).astype(np.float32)
    attributes[coarse] = np.where(inside[..., None], np.float32(1.0), attributes[coarse])
    texture = Texture(emission.texture.name, pixels, False, "EXTEND")
    return replace(material, emission=Channel(texture=texture, uv_layer=DETAIL_UV, attribute=coarse), back=back)
