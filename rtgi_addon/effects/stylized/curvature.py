"""Lines along what bulges and what is hollow: where normals turn, thinned to the middle of each bend.

Over a picture the normal's component across the view changes by a symmetric tensor, H = ½(∇n + ∇nᵀ), whose trace is Malt's
curvature (BNPR) and whose eigenvalues say which way it turns. A ridge turns one way, a ball both: lines are where one eigenvalue
outweighs the other. A bend spreads over as many pixels as it is round, and its line runs where half of the turn is behind it: the
middle of an even bend, near the crest of an uneven one. (Non-maximum suppression as in J. Canny, "A Computational Approach to Edge
Detection", 1986, leaves nothing, or noise, of the even bend of a rounded edge.)
"""

import numpy as np

from ...transport.vectors import dot
from ..frame import Frame

# Pixels to either side over which a bend is followed: what is wider is a round thing, and no line.
REACH = 16
# How much larger one eigenvalue is than the other, at least: |k₁ − k₂| over |k₁ + k₂|.
ONE_WAY = 0.5
# Which pixels' borders a line takes: those across which the normal turns, both where that is about the same.
ALONG = 0.8
# The share of a bend behind its line: of two middles that are as good the first one is it, whatever way sums are rounded.
HALF = 0.5 - 1e-4


def turning(frame: Frame) -> np.ndarray:
    """(h, w, 3) float32: how the normal turns over a pixel [rad], to the right, upwards and the mixed one, positive where the
    surface bulges; 0 where a neighbour is of another object."""
    gbuffer = frame.gbuffer
    pose = np.asarray(frame.view.world_from_camera, np.float32)
    across = np.stack([dot(gbuffer.normal[..., :3], pose[:3, axis]) for axis in (0, 1)], axis=-1)
    change = np.zeros((*gbuffer.seen.shape, 2, 2), np.float32)
    whole = gbuffer.seen.copy()
    for axis, way in ((1, 0), (0, 1)):
        middle, before, after = (_part(axis, span) for span in (slice(1, -1), slice(None, -2), slice(2, None)))
        change[..., way, :][middle] = 0.5 * (across[after] - across[before])
        alike = np.zeros_like(whole)
        alike[middle] = (gbuffer.instance[before] == gbuffer.instance[middle]) & (
            gbuffer.instance[after] == gbuffer.instance[middle])
        whole &= alike
    found = np.stack([change[..., 0, 0], change[..., 1, 1], 0.5 * (change[..., 0, 1] + change[..., 1, 0])], axis=-1)
    return np.where(whole[..., None], found, np.float32(0.0))


def bent(turn: np.ndarray, instance: np.ndarray, values: dict, axis: int) -> np.ndarray:
    """Whether a line along a bend runs between each pixel and the next along ``axis``: bool, one shorter along it. ``turn`` as
    ``turning`` gives it, ``instance`` (h, w) int."""
    here, there = _part(axis, slice(None, -1)), _part(axis, slice(1, None))
    mean = 0.5 * (turn[here] + turn[there])
    along, other, mixed = (mean[..., 0], mean[..., 1], mean[..., 2]) if axis == 1 else (mean[..., 1], mean[..., 0], mean[..., 2])
    bend = along + other
    one_way = np.sqrt((along - other) ** 2 + 4 * mixed**2) >= np.float32(ONE_WAY) * np.abs(bend)
    threshold = np.float32(values["curvature_radians"])
    kind = np.zeros(bend.shape, np.int8)
    if values["curvature_edges"] in (1, 3):
        kind[bend > threshold] = 1
    if values["curvature_edges"] in (2, 3):
        kind[bend < -threshold] = -1
    kind[~one_way | (instance[here] != instance[there])] = 0
    return _middles(np.abs(bend), kind, axis) & (np.abs(along) >= np.float32(ALONG) * np.abs(other))


def _middles(bend: np.ndarray, kind: np.ndarray, axis: int) -> np.ndarray:
    """Of every run along ``axis`` of one ``kind`` (not 0), at most REACH to either side, the place where half of its ``bend`` is
    behind."""
    bend, kind = (np.moveaxis(values, axis, -1) for values in (bend, kind))
    y, x = np.nonzero(kind)
    own, sums, ended = kind[y, x], [], []
    for way in (-1, 1):
        going, total = np.ones(len(x), bool), np.zeros(len(x), np.float32)
        for step in range(1, REACH + 2):
            place = x + way * step
            going &= (place >= 0) & (place < bend.shape[1])
            place = np.clip(place, 0, bend.shape[1] - 1)
            going &= kind[y, place] == own
            total[going] += bend[y[going], place[going]]
        sums.append(total)
        ended.append(~going)
    half = np.float32(HALF) * (sums[0] + sums[1] + bend[y, x])
    middle = ended[0] & ended[1] & (sums[0] < half) & (sums[0] + bend[y, x] >= half)
    found = np.zeros(bend.shape, bool)
    found[y[middle], x[middle]] = True
    return np.moveaxis(found, -1, axis)


def _part(axis: int, span: slice) -> tuple:
    part = [slice(None)] * 2
    part[axis] = span
    return tuple(part)
