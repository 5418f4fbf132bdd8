"""From slices to what is seen through them: light and optical depth up to every limit, and up to every pixel's surface.

In a slice whose optical depth is τ a source that would give S were nothing in its way gives S·(1 − e^(−τ))/τ: exactly what light
that is the same all along it gives (Hillaire 2015), however thick the slice.
"""

from typing import NamedTuple

import numpy as np

from .froxels import Shape


class Slices(NamedTuple):
    """What is in each slice, (slices, rows, columns, 3) float32: its optical ``depth``, and the light ``direct`` and ``indirect``
    [W·sr⁻¹·m⁻²] that it would send to the eye were nothing in its way; ``enter`` and ``leave`` (slices, rows, columns) [m]: where
    in it the medium is."""

    depth: np.ndarray
    direct: np.ndarray
    indirect: np.ndarray
    enter: np.ndarray
    leave: np.ndarray


class Gathered(NamedTuple):
    """What reaches the eye from before every limit, (slices + 1, rows, columns, 3) float32: optical ``depth``, and light ``direct``
    and ``indirect``; in ``slices``."""

    depth: np.ndarray
    direct: np.ndarray
    indirect: np.ndarray
    slices: Slices


class SeenThrough(NamedTuple):
    """What media do in every pixel, (h, w, 3) float32: the share of light that they leave (``transmittance``), and light
    [W·sr⁻¹·m⁻²] that they send: scattered of lamps and given of their own (``direct``), and all that was scattered or reflected
    before (``indirect``)."""

    transmittance: np.ndarray
    direct: np.ndarray
    indirect: np.ndarray


def share_of(depth: np.ndarray) -> np.ndarray:
    """(1 − e^(−τ))/τ of optical ``depth`` τ from 0, float32; 1 at 0."""
    depth = np.asarray(depth, np.float32)
    thin = depth < np.float32(1e-3)
    safe = np.where(thin, np.float32(1.0), depth)
    return np.where(thin, np.float32(1.0) - np.float32(0.5) * depth, -np.expm1(-safe) / safe)


def gather(slices: Slices) -> Gathered:
    """Add up what slices send, from the eye on."""
    count, *rest = slices.depth.shape
    depth, direct, indirect = (np.zeros((count + 1, *rest), np.float32) for _ in range(3))
    left, gained = np.ones(rest, np.float32), np.empty(rest, np.float32)
    for k in range(count):
        tau = slices.depth[k]
        np.add(depth[k], tau, out=depth[k + 1])
        np.negative(depth[k + 1], out=gained)
        np.exp(gained, out=gained)
        # T_k·(1 − e^(−τ)) = T_k − T_(k+1), which loses digits where τ is small: there T_k·τ is as good, the share being nearly 1.
        lost = left - gained
        thin = tau < np.float32(1e-3)
        share = np.where(thin, left - np.float32(0.5) * left * tau, lost / np.where(thin, np.float32(1.0), tau))
        np.multiply(slices.direct[k], share, out=direct[k + 1])
        direct[k + 1] += direct[k]
        np.multiply(slices.indirect[k], share, out=indirect[k + 1])
        indirect[k + 1] += indirect[k]
        left, gained = gained, left
    return Gathered(depth, direct, indirect, slices)


def seen_through(gathered: Gathered, shape: Shape, jitter: np.ndarray, distance: np.ndarray) -> SeenThrough:
    """What media do between the eye and surfaces at ``distance`` (h, w) [m] from it, which may be infinite: between the four
    columns about each pixel, whose rays pass the points ``jitter`` (2,) of their pixels."""
    height, width = distance.shape
    results = [np.zeros((height, width, 3), np.float32) for _ in range(3)]
    for at, weight in _columns_about(shape, jitter, np.arange(width)[None, :], np.arange(height)[:, None], distance):
        depth, part, tau = _depth_before(gathered, at, distance)
        results[0] += weight * np.exp(-depth)
        # Of what the whole slice sends, the part before the surface.
        share = part * share_of(tau * part) / share_of(tau)
        above = at[0] + 1, *at[1:]
        for result, light in ((results[1], gathered.direct), (results[2], gathered.indirect)):
            first = light[at]
            result += weight * (first + (light[above] - first) * share)
    return SeenThrough(*results)


def left_before(gathered: Gathered, shape: Shape, jitter: np.ndarray, x: np.ndarray, y: np.ndarray,
                distance: np.ndarray) -> np.ndarray:
    """The share (n, 3) float32 of light that media leave before ``distance`` (n,) [m] along the rays of pixels in the columns ``x``
    and rows ``y`` (n,) of the picture, as ``seen_through`` has it."""
    return sum(weight * np.exp(-_depth_before(gathered, at, distance)[0])
               for at, weight in _columns_about(shape, jitter, x, y, distance))


def _columns_about(shape: Shape, jitter: np.ndarray, x: np.ndarray, y: np.ndarray, distance: np.ndarray):
    """For each of the four columns about pixels the places in the volume at ``distance`` (…), as an index, and weights (…, 1)."""
    across, up = (_taps(pixels, count, shape.tile, shift) for pixels, count, shift in
                  zip((x, y), shape.columns, jitter, strict=True))
    inner = np.minimum(shape.slice_of(distance).astype(np.intp), shape.slices - 1)
    for row, row_weight in up:
        for column, column_weight in across:
            yield (inner, row, column), (row_weight * column_weight)[..., None]


def _depth_before(gathered: Gathered, at, distance: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """At places ``at`` in the volume the optical depth (…, 3) before ``distance`` (…) [m], the part (…, 1) of what is in the slice
    that lies before it, and the depth (…, 3) of the slice."""
    enter, leave = gathered.slices.enter[at], gathered.slices.leave[at]
    part = np.clip((distance - enter) / np.maximum(leave - enter, np.float32(1e-12)), 0.0, 1.0)
    part = part.astype(np.float32)[..., None]
    tau = gathered.slices.depth[at]
    return gathered.depth[at] + tau * part, part, tau


def _taps(pixels: np.ndarray, columns: int, tile: int, shift: float) -> list[tuple[np.ndarray, np.ndarray]]:
    """The two columns about each of the numbers ``pixels`` along one axis, and how much each counts."""
    place = (pixels.astype(np.float32) + np.float32(0.5)) / np.float32(tile) - np.float32(shift)
    low = np.floor(place)
    part = place - low
    index = low.astype(np.intp)
    return [(np.clip(index, 0, columns - 1), np.float32(1.0) - part), (np.clip(index + 1, 0, columns - 1), part)]
