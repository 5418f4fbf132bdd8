"""The light in the slices of the sample before, found again where it was while the eye moves.

It is light that is kept, not what was added up along rays, so that it can be looked up from elsewhere. What was lit otherwise is of
no use: as soon as anything that gives, blocks or scatters light is another, nothing of the sample before counts, and nothing trails
behind a moving lamp. While a picture stands still its own samples take over within the first MOST of them: their mean settles on
themselves.

Source: B. Wronski, "Volumetric Fog", SIGGRAPH 2014, which keeps a fixed share of the sample before.
"""

from dataclasses import dataclass

import numpy as np

from ...scene import Scene
from ...transport.views.camera import CameraView
from .froxels import Columns, Shape
from .integrate import Slices

# So many samples count at most.
MOST = 16
_PARTS = "lights", "world", "media", "instances", "materials", "meshes"


@dataclass(frozen=True, eq=False)
class Kept:
    """The slices of one sample of ``scene``, in a volume of ``shape`` seen by ``view`` whose pixels were shifted by ``offset`` and
    whose columns passed the points ``jitter`` of theirs; ``count`` samples are in them. ``lit_by`` is the field, ``number`` that of
    the sample's random numbers: a view that moves has sample 0 again and again."""

    scene: Scene
    lit_by: object
    shape: Shape
    view: CameraView
    offset: tuple[float, float]
    jitter: np.ndarray
    slices: Slices
    count: int
    number: int


def is_lit_alike(before: Scene, after: Scene) -> bool:
    """Whether two scenes hold the very same objects, so that all light is the same."""
    def same(one, other):
        return one is other or (isinstance(one, tuple) and len(one) == len(other) and all(
            a is b for a, b in zip(one, other, strict=True)))
    return all(same(getattr(before, part), getattr(after, part)) for part in _PARTS)


def share_before(count: int, index: int) -> float:
    """How much the sample before counts, if there are ``count`` in it and this one is number ``index`` of its picture."""
    return count / (count + 1) * max(0.0, 1.0 - index / MOST)


def followed(kept: Kept, columns: Columns, slices: Slices, share: float) -> Slices:
    """``slices`` of this sample with the light of ``kept``, where that was seen, at ``share``."""
    shape = columns.shape
    middle = 0.5 * (slices.enter + slices.leave).reshape(shape.slices, -1)
    points = columns.origins + columns.directions * middle[..., None].astype(np.float64)
    place, w = kept.view.project(points.reshape(-1, 3), kept.shape.size, kept.offset)
    if kept.view.orthographic:
        away = (points.reshape(-1, 3) - kept.view.position) @ kept.view.forward
    else:
        away = np.linalg.norm(points.reshape(-1, 3) - kept.view.position, axis=1)
    column = place * (np.array(kept.shape.size) / kept.shape.tile) - kept.jitter
    seen = (w > 0) & np.all((place >= 0) & (place <= 1), axis=1) & (away >= kept.shape.start) & (away <= kept.shape.far)
    rows = np.flatnonzero(seen & (slices.leave > slices.enter).ravel())
    # The middle of slice k lies at k + ½ among the limits.
    found, weight = _between(kept.slices, column[rows], kept.shape.slice_of(away[rows]) - np.float32(0.5))
    length = np.maximum(slices.leave - slices.enter, 0.0).reshape(-1, 1)[rows]
    counts = np.float32(share) * (weight > 0)
    results = []
    for light, before in zip((slices.direct, slices.indirect), found, strict=True):
        blended = light.copy().reshape(-1, 3)
        blended[rows] += counts[:, None] * (before / np.maximum(weight, 1e-6)[:, None] * length - blended[rows])
        results.append(blended.reshape(light.shape))
    return slices._replace(direct=results[0], indirect=results[1])


def _between(slices: Slices, column: np.ndarray, along: np.ndarray) -> tuple[tuple[np.ndarray, np.ndarray], np.ndarray]:
    """Light a metre (n, 3), direct and indirect, between the eight slices about places, times the ``weight`` (n,) of those in which
    there is a medium."""
    count, up, across = slices.enter.shape
    place = np.stack([column[:, 0], column[:, 1], along], axis=1).astype(np.float32)
    low = np.floor(place)
    part, index, last = place - low, low.astype(np.intp), np.array([across, up, count]) - 1
    totals, weight = [np.zeros((len(place), 3), np.float32) for _ in range(2)], np.zeros(len(place), np.float32)
    for corner in range(8):
        bits = np.array([corner & 1, (corner >> 1) & 1, corner >> 2])
        x, y, z = np.clip(index + bits, 0, last).T
        length = slices.leave[z, y, x] - slices.enter[z, y, x]
        counts = np.where(bits == 1, part, 1.0 - part).prod(axis=1) * (length > 0)
        weight += counts
        per_metre = (counts / np.maximum(length, 1e-12))[:, None]
        for total, light in zip(totals, (slices.direct, slices.indirect), strict=True):
            total += per_metre * light[z, y, x]
    return tuple(totals), weight
