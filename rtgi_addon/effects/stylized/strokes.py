"""Drawing lines: how much of each pixel the lines around it cover, and whose they are.

Coverage falls from 1 to 0 over a pixel about the edge of a line, by the distance of the pixel's centre from the middle of the
border, so that a line of width w along an axis covers just w pixels. Every sample of a picture is shifted within the pixel, and
their mean is a line without steps.
"""

from typing import NamedTuple

import numpy as np

from .edges import AXES, Borders


class Lines(NamedTuple):
    """``coverage`` (h, w) float32 in [0, 1], and the ``material`` (h, w) int32 whose line that is, where it is above 0."""

    coverage: np.ndarray
    material: np.ndarray


def offsets(reach: int) -> list[tuple[int, int, int, float]]:
    """(axis, dx, dy, distance): pixels from the first of a border's two, and how far their centres are from the border's middle, up
    to ``reach`` pixels of it on either side. The order in which both halves look: of two lines as near, the first one is drawn."""
    found = []
    for axis in AXES:
        for dy in range(-reach, reach + 2):
            for dx in range(-reach, reach + 2):
                x, y = (dx - 0.5, dy) if axis == 1 else (dx, dy - 0.5)
                if abs(x) <= reach + 0.5 and abs(y) <= reach + 0.5:
                    found.append((axis, dx, dy, float(np.hypot(x, y))))
    return found


def reach_of(widest: float) -> int:
    """How many pixels on either side of a border a line ``widest`` pixels wide can touch."""
    return max(int(np.ceil(0.5 * widest)), 0)


def draw_lines(borders: tuple[Borders, Borders], widest: float, marked: tuple[np.ndarray, np.ndarray] | None = None) -> Lines:
    """What the lines on ``borders`` cover, none of which is wider than ``widest`` pixels, and those of `marked.draw_marked`."""
    height, width = borders[0].half_width.shape
    # How far the pixel is inside the line it is deepest in; below -1/2 it is beside it.
    inside, material = np.full(height * width, -1.0, np.float32), np.full(height * width, -1, np.int32)
    rows = {}
    for axis, border in zip(AXES, borders, strict=True):
        y, x = np.nonzero(border.half_width > 0)
        rows[axis] = y, x, border.half_width[y, x], border.material[y, x]
    for axis, dx, dy, distance in offsets(reach_of(widest)):
        y, x, half, owner = rows[axis]
        near = half - np.float32(distance) > -0.5
        y, x = y + dy, x + dx
        near &= (y >= 0) & (y < height) & (x >= 0) & (x < width)
        place = y[near] * width + x[near]
        depth = half[near] - np.float32(distance)
        # Each place comes once: borders of one axis are shifted alike.
        deeper = depth > inside[place]
        inside[place[deeper]] = depth[deeper]
        material[place[deeper]] = owner[near][deeper]
    if marked is not None:
        deeper = marked[0].ravel() > inside
        inside[deeper], material[deeper] = marked[0].ravel()[deeper], marked[1].ravel()[deeper]
    coverage = np.clip(inside + np.float32(0.5), 0.0, 1.0)
    return Lines(coverage.reshape(height, width), material.reshape(height, width))


def over(picture: np.ndarray, lines: Lines, colours: np.ndarray) -> np.ndarray:
    """``picture`` (h, w, 4), premultiplied, under ``lines`` of ``colours`` (materials, 4): RGB and opacity."""
    result = picture.copy()
    y, x = np.nonzero(lines.coverage > 0)
    colour = colours[lines.material[y, x]]
    share = (lines.coverage[y, x] * colour[:, 3])[:, None]
    target = np.concatenate([colour[:, :3], np.ones_like(colour[:, :1])], axis=1)
    result[y, x] += (target - result[y, x]) * share
    return result
