"""Finer lattices within a lattice: boxes on its cells where the error lives, in place of fine cells everywhere.

Of several volumes the one with the smallest cells is read, and fades over its outermost cell into the next (techniques/lattice/
field.py). A box is a range of its parent's cells, each cut into RATIO along every axis; where it touches the parent's own side it
reaches one of its cells further, so that walls there lie in it and not in the cell over which it fades.

Boxes are chosen on one half of the surface points, where the squared error of what is there already lies, and held to the other:
what was chosen for being wrong at some points says nothing of others. Greedy: the box that takes most error for what its probes are
worth, at the rate at which a lattice that is finer everywhere would buy it.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ...numerics.grid import cell_volume, lattice_from_world, local_from_world
from ...progress import Progress
from ...scene import ProbeVolume
from .pilot import LEVELS, RAYS_A_PROBE, Pilot, Reading
from .sample import NORMALS_PER_POINT
from .search import Found
from .tries import upper

# Cells of a nested volume along each side of its parent's.
RATIO = 2
# The most volumes of all: a shader in Godot has samplers for no more (exchange/engines/godot).
MOST_VOLUMES = 8
# Error falls like the spacing: what finer cells leave of the squared one.
LEFT = RATIO**-2.0
# A probe of a box may cost this share of what it would take of the error as one of a lattice that is finer everywhere: boxes that
# are a little too large cost less than many small ones, which fade everywhere.
EAGER = 0.3
# The least share of the squared error that a box is placed for.
LEAST_GAIN = 0.02
# Boxes are placed in lattices so many times coarser along each axis than the single one that would do, and taken where there are
# no more than this share of its probes then.
COARSER, SAVES = (2.0, 1.5), 0.6
# In a lattice of fewer probes nothing is looked for unless it was asked for: what it could save is less than that takes.
FEWEST_PROBES = 256
# All ranges of cells along all three axes are tried, but on a coarser raster where those were more boxes than this.
MOST_TRIED = 1 << 21


@dataclass(frozen=True)
class Box:
    """Cells ``low`` (3,) to ``high`` (3,) of a parent, x y z; ``gain`` is the share of the squared error that it should take."""

    low: tuple[int, int, int]
    high: tuple[int, int, int]
    gain: float


def best_box(volume: ProbeVolume, points: np.ndarray, errors: np.ndarray, probes: int) -> Box | None:
    """The box on the cells of ``volume`` whose probes take most of the squared ``errors`` (n,), in shares of the whole, at
    ``points`` (n, 3) for their number, where all lattices have ``probes`` so far; None where none is worth it."""
    resolution = np.asarray(volume.resolution)
    # By halves of cells: a box fades over one of its own.
    halves = RATIO * resolution
    index = np.floor(RATIO * (lattice_from_world(volume.world_from_local, resolution, points) + 0.5)).astype(np.int64)
    index = np.clip(index, 0, halves - 1)
    sums = np.zeros(halves + 1)
    # A point that is wrong says that those around it are: each counts for its neighbours as well.
    sums[1:, 1:, 1:] = _blurred(np.bincount(np.ravel_multi_index(tuple(index.T), halves), errors, halves.prod()).reshape(halves))
    sums = sums.cumsum(0).cumsum(1).cumsum(2)
    ranges = _ranges(resolution)
    whole = _within(sums, [RATIO * ends for ends in ranges])
    core = _within(sums, [_inset(ends, count) for ends, count in zip(ranges, resolution, strict=True)])
    x, y, z = (_counts(ends, count) for ends, count in zip(ranges, resolution, strict=True))
    gain = 0.5 * (whole + core) * (1.0 - LEFT)
    # What a probe more takes of the squared error of a lattice of n that is finer everywhere: 2/3 of it by n.
    score = gain - EAGER * (2.0 / 3.0) / probes * (x[:, None, None] * y[None, :, None] * z[None, None, :])
    best = np.unravel_index(score.argmax(), score.shape)
    if score[best] <= 0.0 or gain[best] < LEAST_GAIN:
        return None
    ends = [ends[:, at] for ends, at in zip(ranges, best, strict=True)]
    return Box(tuple(int(low) for low, _ in ends), tuple(int(high) for _, high in ends), float(gain[best]))


def nested_volume(volume: ProbeVolume, box: Box, name: str) -> ProbeVolume:
    """The volume called ``name`` of ``box`` in ``volume``."""
    resolution = np.asarray(volume.resolution, np.float64)
    low, high = np.array(box.low, np.float64), np.array(box.high, np.float64)
    low, high = low - (low == 0) / RATIO, high + (high == resolution) / RATIO
    local = np.eye(4)
    local[:3, :3] = np.diag((high - low) / resolution)
    local[:3, 3] = (low + high) / resolution - 1.0
    return replace(volume, name=name, world_from_local=np.asarray(volume.world_from_local, np.float64) @ local,
                   resolution=tuple(int(count) for count in np.round(RATIO * (high - low))), fitted=False,
                   planned=volume.planned or volume.name)


def nest(pilot: Pilot, found: Found, target: float, fits: Callable[[tuple[ProbeVolume, ...], int], str],
         may_spend: Callable[[float], bool], progress: Progress) -> Found:
    """``found``, or coarser lattices with boxes in them that do as well with fewer probes: below ``target`` where that is met, and
    else as right as ``found``.

    ``fits(volumes, order)`` returns "" or the name of the limit that is passed; ``may_spend(rays)`` whether the plan may. The
    errors of what comes back are those at the half of the points that no box was chosen by. Raises Cancelled.
    """
    single, most = found.reading, int(SAVES * found.reading.lattice_points)
    bases = [tuple(replace(volume, resolution=_coarser(volume.resolution, factor)) for volume in single.volumes)
             for factor in COARSER]
    bases = [base for base in bases if probes_in(base) < most]
    level = next((level for level in reversed(range(1, len(LEVELS)))
                  if may_spend(_cost(pilot, single, bases, level))), None)
    if level is None or not bases:
        return found
    # Few points miss the worst ones: both are held to the same.
    single = pilot.measure_volumes(single.volumes, progress, level - 1)
    error = single.error(found.order, found.ray_error)
    found = replace(found, reading=single, error=error, met=upper(error) <= target)

    def passes(reading: Reading) -> bool:
        other = reading.error(found.order, found.ray_error)
        as_good = upper(other) <= target if found.met else other.value <= error.value
        return as_good and not fits(reading.volumes, found.order)

    made = [_with_boxes(pilot, base, found.order, level, most, passes, progress) for base in bases]
    made = [reading for reading in made if reading is not None]
    if not made:
        return replace(found, nesting="spread")
    best = min(made, key=lambda reading: reading.lattice_points)
    best_found = replace(found, reading=best, error=best.error(found.order, found.ray_error))
    # More points may tell that a coarser lattice does, without anything in it.
    return replace(best_found, nesting="nested", single=single) if len(best.volumes) > len(single.volumes) else best_found


def _coarser(resolution: tuple[int, int, int], factor: float) -> tuple[int, int, int]:
    return tuple(max(min(2, count), round(count / factor)) for count in resolution)


def _cost(pilot: Pilot, single: Reading, bases, level: int) -> float:
    """About how many rays it takes to look for boxes on the points of ``level``: all probes of the bases, as many in boxes, and
    what more points read of the single lattice."""
    points = pilot.points(level)
    missing = max(0, NORMALS_PER_POINT * points - len(pilot.truth.mean)) * pilot.receiver_rays
    again = max(0.0, 0.5 * points * NORMALS_PER_POINT / len(single.variance) - 1.0) * single.probes
    return missing + RAYS_A_PROBE * (2.0 * sum(map(probes_in, bases)) + min(again, single.lattice_points))


def _with_boxes(pilot: Pilot, base: tuple[ProbeVolume, ...], order: int, level: int, most: int, passes: Callable[[Reading], bool],
                progress: Progress) -> Reading | None:
    """``base`` with boxes in it, as read at the first half of the points of ``level``, which it ``passes``; None where that takes
    more than ``most`` probes, or no box is worth its own."""
    volumes = base
    while True:
        held = pilot.measure_volumes(volumes, progress, level - 1)
        if passes(held):
            return held
        points, errors = _squares(pilot, pilot.measure_volumes(volumes, progress, level), order)
        chosen = np.arange(len(points)) >= len(held.variance) // NORMALS_PER_POINT
        parent, box = _best(volumes, points[chosen], errors[chosen] / max(errors[chosen].sum(), 1e-30))
        if box is None or len(volumes) >= MOST_VOLUMES:
            return None
        root, number = parent.planned or parent.name, len(volumes) - len(base) + 1
        volumes = (*volumes, nested_volume(parent, box, f"{root} fine {number}"))
        if probes_in(volumes) > most:
            return None


def _best(volumes: tuple[ProbeVolume, ...], points: np.ndarray, errors: np.ndarray) -> tuple[ProbeVolume | None, Box | None]:
    """The box that should take most of the ``errors`` in any of ``volumes``, and in which: each is asked for the points that none
    with smaller cells has."""
    left, best = np.ones(len(points), bool), (None, None)
    for volume in sorted(volumes, key=lambda one: cell_volume(one.world_from_local, one.resolution)):
        own = left & _inside(volume, points)
        box = best_box(volume, points[own], errors[own], probes_in(volumes))
        if box is not None and (best[1] is None or box.gain > best[1].gain):
            best = volume, box
        left &= ~own
    return best


def _squares(pilot: Pilot, reading: Reading, order: int) -> tuple[np.ndarray, np.ndarray]:
    """Where (p, 3) the surface points of ``reading`` are, and what they have (p,) of its squared error, noise taken out."""
    receivers = pilot.sample.receivers.take(slice(0, len(reading.variance)))
    off, _ = pilot.sample.squares(reading.estimate(order), pilot.truth, reading.variance)
    return receivers.points[receivers.own], np.maximum(off, 0.0)


def _inside(volume: ProbeVolume, points: np.ndarray) -> np.ndarray:
    """(n,) bool: which ``points`` (n, 3) lie in ``volume``, or on walls up to half a cell outside."""
    local = np.abs(local_from_world(volume.world_from_local, points))
    return np.all(local <= 1.0 + 1.0 / np.asarray(volume.resolution), axis=1)


def probes_in(volumes: tuple[ProbeVolume, ...]) -> int:
    """Lattice points of all ``volumes``."""
    return int(sum(np.prod(volume.resolution) for volume in volumes))


def _ranges(resolution: np.ndarray) -> list[np.ndarray]:
    """Low and high ends (2, m) of ranges of cells along each axis: all of them, unless together they are more than MOST_TRIED."""
    step = 1
    while True:
        edges = [np.unique([*range(0, count, step), count]) for count in resolution]
        pairs = [np.stack(np.triu_indices(len(some) - 1)) + np.array([[0], [1]]) for some in edges]
        if np.prod([float(pair.shape[1]) for pair in pairs]) <= MOST_TRIED:
            return [some[pair] for some, pair in zip(edges, pairs, strict=True)]
        step += 1


def _blurred(values: np.ndarray) -> np.ndarray:
    """``values`` spread over themselves and both neighbours along each axis."""
    for axis, count in enumerate(values.shape):
        steps = [np.clip(np.arange(count) + step, 0, count - 1) for step in (-1, 0, 1)]
        spread = np.zeros_like(values)
        for step in steps:
            np.add.at(spread, (slice(None),) * axis + (step,), values / 3.0)
        values = spread
    return values


def _within(sums: np.ndarray, ranges: list[np.ndarray]) -> np.ndarray:
    """What lies in all boxes of ``ranges`` (2, m) along each axis, by the running ``sums``."""
    for axis, (low, high) in enumerate(ranges):
        sums = np.take(sums, high, axis) - np.take(sums, low, axis)
    return sums


def _inset(ends: np.ndarray, count: int) -> np.ndarray:
    """Ranges in halves of cells without the one over which a box fades, inside of its parent."""
    low, high = ends
    first = RATIO * low + (low > 0)
    return np.stack([first, np.maximum(RATIO * high - (high < count), first)])


def _counts(ends: np.ndarray, count: int) -> np.ndarray:
    """Probes of boxes along an axis."""
    low, high = ends
    return RATIO * (high - low) + (low == 0) + (high == count)
