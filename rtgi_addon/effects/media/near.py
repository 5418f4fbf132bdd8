"""What media scatter of small lamps close about these, pixel by pixel: there light changes faster than columns are wide.

The light f of a lamp at a distance d from it is two parts, W·f and (1 − W)·f, with W = (1 − d²/R²)² within the reach R of a few
columns. Slices take the second (`lighting`), which stays finite at the lamp and is as wide as columns can show. The first is summed
here along every pixel's own ray, at points that are even in the angle under which the lamp sees them: so close to it as 1/d² asks
for. W being the same in both, nothing is lit twice and there is no seam.

Source: C. Kulla and M. Fajardo, "Importance Sampling Techniques for Path Tracing in Participating Media", EGSR 2012, section 4.
"""

from dataclasses import dataclass

import numpy as np

from ...numerics.sampling import hash_u32, unit_interval
from ...transport.lights.kinds import kind_of
from ...transport.media.phase import phase_value
from ...transport.parallel import chunks, parallel_for
from ...transport.vectors import dot
from ...transport.views.camera import CameraView
from .froxels import Columns, Near, Shape
from .integrate import Gathered, left_before
from .lighting import Surroundings, lamp_uv

# Points along a ray; what number shifts those of a pixel, the letters ne; and by how much of their distance they go on from
# sample to sample, the golden section of 2³².
POINTS, SEED, STEP = 4, 0x6E65, 0x9E3779B9
# Rays that pass a lamp by less than this share of its reach are taken to pass it by so much.
CLOSEST = 1e-4
# Pixels per unit of work.
_CHUNK = 1 << 14


def near_lamps(around: Surroundings, shape: Shape, view: CameraView) -> dict[int, Near]:
    """The lamps by their numbers that media scatter and whose light is narrower than columns show."""
    found = {}
    for lamp in around.added:
        if around.falls_off(lamp) and around.lamps.scattered[lamp] > 0:
            light = around.scene.lights[lamp]
            near = Near.of(shape, view, light.position_world, kind_of(light).extent(light))
            found.update({} if near is None else {lamp: near})
    return found


def near_light(around: Surroundings, lamps: dict[int, Near], gathered: Gathered, columns: Columns, view: CameraView, index: int,
               offset, distance: np.ndarray) -> np.ndarray:
    """W's part of what reaches the eye (h, w, 3) float32 from before surfaces at ``distance`` (h, w) [m], in sample number
    ``index``, whose pixels are shifted by ``offset`` (2,) and whose slices are ``gathered``."""
    result = np.zeros((*distance.shape, 3), np.float32)
    work = []
    for lamp, near in lamps.items():
        pixels = _pixels_about(near, view, columns.shape.size, offset)
        work += [(lamp, near, pixels[rows]) for rows in chunks(len(pixels), _CHUNK)]
    rays = _Rays(around, gathered, columns, view, index, offset)
    parts = parallel_for(lambda i: rays.light(*work[i], distance.ravel()[work[i][2]]), len(work), around.threads)
    for pixels, light in parts:
        result.reshape(-1, 3)[pixels] += light
    return result


def _pixels_about(near: Near, view: CameraView, size: tuple[int, int], offset) -> np.ndarray:
    """Numbers (n,) of the pixels, row by row, in a rectangle about what a lamp reaches."""
    corners = near.centre + near.reach * np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    place, w = view.project(corners, size, offset)
    low, high = np.zeros(2), np.ones(2)
    if np.all(w > 0):
        low, high = np.clip(place.min(axis=0), 0, 1), np.clip(place.max(axis=0), 0, 1)
    (left, right), (bottom, top) = ((int(np.floor(a * side)), int(np.ceil(b * side)))
                                    for a, b, side in zip(low, high, size, strict=True))
    return (np.arange(bottom, top)[:, None] * size[0] + np.arange(left, right)).ravel()


@dataclass(frozen=True, eq=False)
class _Rays:
    around: Surroundings
    gathered: Gathered
    columns: Columns
    view: CameraView
    index: int
    offset: tuple[float, float]

    def light(self, lamp: int, near: Near, pixels: np.ndarray, distance: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Of those ``pixels`` (n,), with surfaces at ``distance`` (n,) [m], whose rays come close enough to ``lamp`` the numbers
        (m,), and the light (m, 3)."""
        shape = self.columns.shape
        width, height = shape.size
        x, y = pixels % width, pixels // width
        origins, directions, _ = self.view.through((x + 0.5) / width, (y + 0.5) / height, shape.size, self.offset)
        if self.view.orthographic:
            origins = origins - directions * self.view.depths[0]
        else:
            origins = np.broadcast_to(self.view.position, origins.shape)
        nearest = dot(near.centre - origins, directions)
        aside = near.centre - (origins + directions * nearest[:, None])
        squared = dot(aside, aside)
        half = np.sqrt(np.maximum(near.reach**2 - squared, 0.0))
        first = np.maximum(nearest - half, shape.start)
        last = np.minimum(np.minimum(nearest + half, distance), shape.far)
        rows = np.flatnonzero(last > first)
        x, y, pixels, origins, directions, nearest, first, last = (
            part[rows] for part in (x, y, pixels, origins, directions, nearest, first, last))
        closest = np.maximum(np.sqrt(squared[rows]), CLOSEST * near.reach)
        begin = np.arctan2(first - nearest, closest)
        angle = np.arctan2(last - nearest, closest) - begin
        u = unit_interval(hash_u32(SEED, pixels) + np.uint32(self.index * STEP & 0xFFFFFFFF))
        result = np.zeros((len(rows), 3), np.float32)
        for number in range(POINTS):
            aside = closest * np.tan(begin + angle * ((number + u) / POINTS))
            # ∫W·f·dt with t = closest·tan(θ): dt = d²/closest·dθ.
            squared = aside**2 + closest**2
            weight = np.maximum(1.0 - squared / near.reach**2, 0.0) ** 2 * squared * angle / (closest * POINTS)
            along = nearest + aside
            found = self._scattered(lamp, origins + directions * along[:, None], directions)
            left = left_before(self.gathered, shape, self.columns.jitter, x, y, along.astype(np.float32))
            result += (weight[:, None] * found * left).astype(np.float32)
        return pixels, result

    def _scattered(self, lamp: int, points: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """Light a metre (n, 3) of ``lamp`` that turns at ``points`` (n, 3) against ``directions`` (n, 3)."""
        around, points, result = self.around, points.astype(np.float32), np.zeros(points.shape)
        there = [(filling, np.flatnonzero(filling.contains(points))) for filling in around.seen]
        rows = np.unique(np.concatenate([np.zeros(0, np.intp), *(within for _, within in there)]))
        if not rows.size:
            return result
        sample = around.lamps.sample(lamp, points[rows], lamp_uv(lamp, self.index, len(rows)))
        arriving, cosine = np.zeros(points.shape), np.zeros(len(points))
        arriving[rows] = around.lamps.scattered[lamp] * sample.irradiance * around.reaching(
            lamp, points[rows], sample.direction, sample.distance)
        cosine[rows] = dot(directions[rows], sample.direction)
        for filling, within in there:
            turned = filling.coefficients(points[within]).scattering * phase_value(filling.medium.phase, cosine[within])[:, None]
            result[within] += turned * arriving[within]
        return result
