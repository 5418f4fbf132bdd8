"""Cones through the hierarchy: what a receiver gets from all around, by a few of them.

Source: C. Crassin, F. Neyret, M. Sainz, S. Green and E. Eisemann, "Interactive Indirect Illumination Using Voxel Cone Tracing",
Computer Graphics Forum 30(7), 2011. Apart from it: weights and elevations of a set reproduce the cosine lobe's moments of bands 0
to 2 exactly (the common ¼ + 5·3/20 under 60° answers 6 % too little to a gradient, and has 0.16 of the lobe's 0.25 in band 2);
optical depth is interpolated, not opacity, so a slab does not depend on steps; the way up to NEAR cells is walked cell by cell;
a cone is no wider than that the cells it reads keep off the receiver's own plane, which a cone of 30° under 60° touches all along;
cells are half as large as the cone is wide, for what is read between cells of side s spreads by s/2 along each axis (their own
s/√12 and the interpolation's s/√6), as a disc of 2s does; while a cone crosses a sheet it stays on the level where it met it,
since a sheet lies in other places on other levels, and a quarter of it would be met twice or never; and beside walls of few cells
none are read that are so wide that their faces show the mean of both sides (walls.py).
"""

from typing import NamedTuple

import numpy as np

from ...numerics import sh
from ...numerics.sampling import GOLDEN_FRACTION, frame
from ..vectors import dot
from .cascades import coarsest_needed
from .hierarchy import Hierarchy, Level
from .rays import SPENT, march, span_of

# Cells that cones cross one by one, before they widen.
NEAR = 3.0
# Steps in cells that are read.
STEP = 0.5
# Between cells' centres the shares of a plane are interpolated: over a crossing they add up to one on average, and to half of that
# at the least, as plane and ray lie. So they count twice, and no plane lets light through; where a sheet ends it reaches further.
TIGHT = np.float32(2.0)
# Cells reach this far from a sample that reads them, in their sides: one between samples, and half of their own.
SUPPORT = 1.5

# Fewer cones than these, but for six, cannot have the moments of the cosine lobe with weights that are positive.
FEWEST = 12


class ConeSet(NamedTuple):
    """Cones about +z: unit ``directions`` (k, 3), ``weights`` (k,) that sum to 1, and the ``spread`` (k,): tangent of the half
    angle. Irradiance is π times the weighted sum of what they see."""

    directions: np.ndarray
    weights: np.ndarray
    spread: np.ndarray


def cone_set(count: int) -> ConeSet:
    """``count`` cones: 6, or more of them on a spiral that is as dense as the cosine lobe. All sets have its moments of bands 0 to
    2, in every direction. Raises ValueError for fewer that cannot."""
    if count == 6:
        return _SIX
    if count < FEWEST:
        raise ValueError(f"{count} cones cannot have the moments of the cosine lobe: choose 6, or {FEWEST} and more")
    index = np.arange(count)
    height = np.sqrt(1.0 - (index + 0.5) / count)
    azimuth, ring = 2.0 * np.pi * np.mod(index * GOLDEN_FRACTION, 1.0), np.sqrt(1.0 - height * height)
    directions = np.stack([ring * np.cos(azimuth), ring * np.sin(azimuth), height], axis=1)
    # The smallest change of equal weights that gives the lobe's projection on each basis function of bands 0 to 2.
    basis = sh.evaluate(directions, 2)
    exact = sh.cosine_coefficients(2) / np.pi * sh.evaluate(np.array([[0.0, 0.0, 1.0]]), 2)[0]
    even = np.full(count, 1.0 / count)
    weights = even + np.linalg.lstsq(basis.T, exact - even @ basis, rcond=None)[0]
    half_angle = np.arccos(1.0 - 1.0 / count)
    return ConeSet(directions, weights, np.full(count, np.tan(half_angle)))


def _six() -> ConeSet:
    azimuth = 2.0 * np.pi * np.arange(5) / 5
    ring = np.stack([np.sqrt(0.75) * np.cos(azimuth), np.sqrt(0.75) * np.sin(azimuth), np.full(5, 0.5)], axis=1)
    return ConeSet(np.concatenate([[[0.0, 0.0, 1.0]], ring]), np.array([1 / 3, *[2 / 15] * 5]), np.full(6, np.tan(np.pi / 6)))


_SIX = _six()


def specular_spread(alpha: np.ndarray) -> np.ndarray:
    """Tangent (n,) of the half angle of cones that hold half of what GGX layers of ``alpha`` (n,) below 1 reflect head-on,
    2·atan(α)."""
    return 2.0 * alpha / (1.0 - alpha * alpha)


class Traced(NamedTuple):
    """What cones (n,) see: ``radiance`` (n, 3), and the share ``passed`` (n,) that is left of what lies beyond the grid."""

    radiance: np.ndarray
    passed: np.ndarray


def trace_cones(hierarchy: Hierarchy, origins: np.ndarray, directions: np.ndarray, spread: np.ndarray,
                normals: np.ndarray | None = None, step: float = STEP, near: float = NEAR) -> Traced:
    """Cones from ``origins`` (n, 3) [m] along unit ``directions`` (n, 3), 2·``spread`` (n,) as wide as they are long. ``normals``
    (n, 3): those of the receivers' surfaces, None for points in free space."""
    grid, count = hierarchy.grid, len(origins)
    clear, at = np.full(count, np.inf), np.full(count, near)
    if normals is not None:
        # How far along a cone one may be for each side of the cells that are read.
        clear = dot(np.asarray(directions, np.float64), normals) / (SUPPORT * np.abs(normals).sum(axis=1))
        at = np.maximum(at, 1.0 / np.maximum(clear, 1e-6))
    first = march(hierarchy, origins, directions, normals, at)
    radiance, passed = first.radiance, first.passed
    start, direction = grid.cells_of(origins), np.asarray(directions, np.float64)
    enter, leave = span_of(hierarchy, start, direction)
    at, spread = np.maximum(enter, first.at), np.asarray(spread, np.float64)
    # What a wide cone reads of the outermost cells it reads in part when it has left them.
    leave += np.minimum(np.maximum(spread * leave, 1.0), clear * np.maximum(leave, 0.0) + 1.0)
    rows = np.flatnonzero((leave > at) & (passed > SPENT))
    top, sheet, level = float(len(hierarchy.levels) - 1), np.ones(count, np.float32), np.zeros(count)
    while rows.size:
        position = at[rows]
        lod = np.log2(np.maximum(spread[rows] * position, 1.0))
        # Both levels that a sample lies between keep off.
        lod = np.minimum(np.minimum(lod, np.floor(np.log2(np.maximum(clear[rows] * position, 1.0)))), top)
        lod = np.where(sheet[rows] < 1, level[rows], lod)
        lod = level[rows] = _narrow(hierarchy, start[rows], direction[rows], position, step, lod)
        if hierarchy.cascades:
            lod = level[rows] = np.maximum(lod, coarsest_needed(hierarchy, start[rows] + direction[rows] * position[:, None]))
        advance = np.minimum(step * np.exp2(lod), leave[rows] - position)
        middle = position + 0.5 * advance
        met = _sample(hierarchy, start[rows] + direction[rows] * middle[:, None], direction[rows], lod)
        way = advance.astype(np.float32)
        # As `rays` has it: shares of one sheet add up, all else multiplies.
        crossed = TIGHT * met.share * way
        cut = np.minimum(crossed / np.maximum(sheet[rows], np.float32(1e-6)), np.float32(1))
        sheet[rows] = np.where(crossed > 0, sheet[rows] - crossed, np.float32(1))
        open_ = np.exp(-met.depth * way)
        of_sheet = cut * (0.5 + 0.5 * open_) / np.maximum(met.share, np.float32(1e-30))
        of_rest = (1 - open_) * (1 - 0.5 * cut) / np.maximum(met.depth, np.float32(1e-30))
        radiance[rows] += passed[rows, None] * (of_sheet[:, None] * met.shown + of_rest[:, None] * met.glow)
        passed[rows] *= open_ * (1 - cut)
        at[rows] = position + advance
        rows = rows[(at[rows] < leave[rows] - 1e-9) & (passed[rows] > SPENT)]
    passed[passed <= SPENT] = 0.0
    return Traced(radiance, passed)


def irradiance(hierarchy: Hierarchy, points: np.ndarray, normals: np.ndarray, cones: ConeSet, beyond,
               step: float = STEP, near: float = NEAR) -> np.ndarray:
    """Irradiance (n, 3) [W·m⁻²] at ``points`` (n, 3) under unit ``normals`` (n, 3). ``beyond``(points, directions, spread), all (m,
    …), is the radiance (m, 3) of what lies outside the grid."""
    tangent, bitangent = frame(np.asarray(normals, np.float32))
    total = np.zeros((len(points), 3), np.float32)
    for local, weight, spread in zip(*cones, strict=True):
        direction = tangent * np.float32(local[0]) + bitangent * np.float32(local[1]) + normals * np.float32(local[2])
        wide = np.full(len(points), spread)
        seen = trace_cones(hierarchy, points, direction, wide, normals, step, near)
        total += np.float32(np.pi * weight) * seen.radiance
        open_ = np.flatnonzero(seen.passed)
        if open_.size:
            rest = beyond(points[open_], direction[open_], wide[open_])
            total[open_] += np.float32(np.pi * weight) * seen.passed[open_, None] * rest
    return total


def _narrow(hierarchy: Hierarchy, start, direction, at, step, lod) -> np.ndarray:
    """``lod`` (n,), or the largest whole number below it for which no level that the next sample from ``at`` (n,) on lies between
    has cells there that are too wide for the walls in them."""
    for index in range(len(hierarchy.levels) - 1, 0, -1):
        level = hierarchy.levels[index]
        rows = np.flatnonzero(lod > index - 1) if level.wide.any() else np.zeros(0, int)
        if rows.size:
            middle = start[rows] + direction[rows] * (at[rows] + 0.5 * step * np.exp2(lod[rows]))[:, None]
            low, _ = _low(level, middle / level.size - level.offset)
            lod[rows[level.wide[low @ np.array(level.strides)]]] = index - 1
    return lod


class _Met(NamedTuple):
    """What samples (n,) find for each cell's length: optical ``depth`` (n,) and that times radiance, ``glow`` (n, 3); the ``share``
    (n,) of crossings of sheets, and that times radiance, ``shown`` (n, 3)."""

    depth: np.ndarray
    glow: np.ndarray
    share: np.ndarray
    shown: np.ndarray


def _sample(hierarchy: Hierarchy, position, direction, lod) -> _Met:
    """What is at ``position`` (n, 3) in the finest cells, between levels."""
    lower = np.minimum(lod.astype(np.int64), len(hierarchy.levels) - 1)
    blend, count = (lod - lower).astype(np.float32), len(position)
    met = _Met(*(np.zeros(shape, np.float32) for shape in (count, (count, 3), count, (count, 3))))
    direction = direction.astype(np.float32)
    for index, level in enumerate(hierarchy.levels):
        weight = np.where(lower == index, 1.0 - blend, np.where(lower == index - 1, blend, 0.0)).astype(np.float32)
        rows = np.flatnonzero(weight > 0)
        if rows.size:
            place = position[rows] / level.size - level.offset
            _add(level, place, direction[rows], weight[rows] / np.float32(level.size), rows, met)
    return met


def _add(level: Level, position, direction, weight, rows, met: _Met) -> None:
    """Add one level's trilinear samples to ``met`` at ``rows``."""
    low, part = _low(level, position)
    base, face, strides = low @ np.array(level.strides), 2 * np.arange(3) + (direction < 0), level.strides
    parts = [(1.0 - part[:, axis], part[:, axis]) for axis in range(3)]
    for corner in range(8):
        x, y, z = corner & 1, corner >> 1 & 1, corner >> 2
        row = level.row[base + x * strides[0] + y * strides[1] + z * strides[2]]
        found = np.flatnonzero(row)
        if not found.size:
            continue
        share = (weight * parts[0][x] * parts[1][y] * parts[2][z])[found]
        row, way, at = row[found], direction[found] * share[:, None], rows[found]
        crossed = np.abs(way)
        depth, adds = dot(level.depth[row], crossed), level.adds[row]
        glow = sum(level.glow[6 * row + face[found, axis]] * crossed[:, axis, None] for axis in range(3))
        through = dot(level.sheet[row], way)
        met.depth[at] += np.where(adds, np.float32(0), depth)
        met.glow[at] += np.where(adds[:, None], np.float32(0), glow)
        met.share[at] += np.where(adds, depth, np.abs(through))
        shown = np.abs(through)[:, None] * level.shown[2 * row + (through > 0)]
        met.shown[at] += np.where(adds[:, None], glow, shown)


def _low(level: Level, position) -> tuple[np.ndarray, np.ndarray]:
    """The lowest (n, 3) of the eight cells that a sample at ``position`` (n, 3), in this level's cells, lies between, and how far
    (n, 3) it is on the way from its centre."""
    # The array begins with an empty layer, and samples lie at cells' centres.
    place = np.clip(position + 0.5, 0.0, np.array(level.shape[::-1]) - 1.0)
    low = np.minimum(place.astype(np.int64), np.array(level.shape[::-1]) - 2)
    return low, (place - low).astype(np.float32)
