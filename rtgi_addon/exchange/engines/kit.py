"""The conformance kit's probes: some whose content is known, some with everything that the look-up weighs, some that tell weights.

The volume "Weights" is made of blocks of eight probes, 2 x 2 x 2. Along its x axis three blocks have the same walls about them, and
each of a block's probes shines in at most one colour, another one in every block: red, green and blue of the light at a point in
the first block are the weights of its probes 0 to 2, in the second those of 3 to 5, in the third those of 6 and 7 and all
together. Along y the blocks differ: open, with probes that were moved and that are inside geometry, and all but blind.

The volume "Scattered" has a list of probes anywhere in it, and nodes that name one to four of them, or stand in for others.
"""

from dataclasses import replace

import numpy as np

from ...numerics import grid as lattice
from ...numerics import sh
from ...scene import ProbeVolume
from ...scene.scattered import SLOTS, of_grid, words
from ...techniques import ProbeGrid
from ...techniques.lattice.field import ProbeField
from .volumes import ORDER

_COUNT = sh.coefficient_count(ORDER)
_TILE = 8
# A colour of its own for every channel, so that swapped ones are seen.
_TINT = np.array([1.0, 0.5, 0.25])
# The longest distance of "Weights" [m], of which 16-bit numbers are multiples of a power of two.
_LONGEST = 65535.0 * 2.0**-15
# Points in each block of "Weights".
_POINTS_A_BLOCK = 22


def kit_field() -> ProbeField:
    """The volumes "Known", "Hard" and "Inset", of which the last lies partly inside the second, "Weights" and "Scattered"."""
    return ProbeField((_known_grid(), _hard_grid("Hard", (5, 3, 4), _hard_matrix(), 1),
                       _hard_grid("Inset", (3, 3, 3), _inset_matrix(), 2), _weights_grid(), _scattered_grid()))


def weighed_points(rng) -> np.ndarray:
    """Points (n, 3) of the world between the probes of each block of "Weights", the same in the three of a row."""
    volume = _weights_volume()
    # Clear of the blocks' sides, for neighbours are looked for a little along the normal.
    inside = rng.uniform(0.05, 0.95, (3, _POINTS_A_BLOCK, 3))
    blocks = [inside[y] + (2.0 * x, 2.0 * y, 0.0) for y in range(3) for x in range(3)]
    local = lattice.local_from_lattice(np.concatenate(blocks), volume.resolution)
    return lattice.transform_points(volume.world_from_local, local)


def _known_grid() -> ProbeGrid:
    """16 probes: a constant, six lobes (±x, ±y, ±z), and each coefficient by itself on top of a constant."""
    directions, solid_angles = sh.quadrature(64)
    constant = sh.project(directions, np.ones((len(directions), 1)), solid_angles, ORDER) * _TINT
    # On a floor, without which the lobes would ring and deringing would change what is known.
    shapes = np.maximum(directions @ np.concatenate([np.eye(3), -np.eye(3)]).T, 0.0) ** 2 + 0.1
    lobes = [sh.project(directions, shape[:, None], solid_angles, ORDER) * np.roll(_TINT, turn)
             for turn, shape in enumerate(shapes.T)]
    single = [constant + 0.4 * np.eye(_COUNT)[:, [index]] * np.array([1.0, -0.75, 0.5]) for index in range(_COUNT)]
    values = np.stack([constant, *lobes, *single]).astype(np.float32)
    volume = ProbeVolume("Known", _box((0.0, 0.0, 0.0), (2.0, 1.0, 1.0), np.eye(3)), (4, 2, 2))
    shape = volume.resolution[::-1]
    visibility = np.empty((*shape, _TILE, _TILE, 2), np.float32)
    visibility[...] = (50.0, 2501.0)
    return ProbeGrid(volume, values.reshape(*shape, _COUNT, 3), np.ones(shape, np.float32), visibility,
                     np.zeros((*shape, 3), np.float32), np.full(shape, np.nan, np.float32))


def _hard_grid(name: str, resolution: tuple[int, int, int], world_from_local: np.ndarray, seed: int) -> ProbeGrid:
    """Probes of every kind: bright and dim, ringing, behind walls, moved, inside geometry."""
    rng = np.random.default_rng(seed)
    volume = ProbeVolume(name, world_from_local, resolution)
    shape = resolution[::-1]
    coefficients = rng.normal(size=(*shape, _COUNT, 3)) * np.array([1.0, 0.7, 0.35])[sh.bands(ORDER)][:, None]
    coefficients[..., 0, :] = np.abs(coefficients[..., 0, :]) + 0.8
    coefficients *= np.exp(rng.normal(size=(*shape, 1, 1)))
    mean = rng.uniform(0.3, 2.5, (*shape, _TILE, _TILE))
    deviation = rng.uniform(0.05, 0.5, mean.shape)
    kind = rng.random(shape)
    validity = np.where(kind < 0.25, 0.0, 1.0)
    moved = (kind > 0.15) & (kind < 0.4)
    reach = 0.3 * lattice.cell_size(world_from_local, resolution).min()
    offset = np.where(moved[..., None], reach * unit(rng.normal(size=(*shape, 3))), 0.0)
    return ProbeGrid(volume, coefficients.astype(np.float32), validity.astype(np.float32),
                     np.stack([mean, mean**2 + deviation**2], axis=-1).astype(np.float32),
                     offset.astype(np.float16).astype(np.float32), np.full(shape, np.nan, np.float32))


def _weights_volume() -> ProbeVolume:
    return ProbeVolume("Weights", _box((-9.0, 4.0, 2.0), (2.9, 2.3, 1.1), _turned((-0.4, 0.7, 0.3))), (6, 6, 2))


def _weights_grid() -> ProbeGrid:
    """See the module's docstring."""
    rng, volume = np.random.default_rng(6), _weights_volume()
    reach = lattice.cell_size(volume.world_from_local, volume.resolution).min()
    # Three kinds of walls about the eight probes [z, y, x] of a block: far, near and far, and right at the probes.
    block = (3, 2, 2, 2)
    nearest, farthest = np.array([0.5, 0.3, 0.2]) * reach, np.array([1.8, 1.3, 0.3]) * reach
    mean = rng.uniform(0.0, 1.0, (*block, _TILE, _TILE))
    mean = nearest.reshape(3, 1, 1, 1, 1, 1) * (1.0 - mean) + farthest.reshape(3, 1, 1, 1, 1, 1) * mean
    deviation = mean * rng.uniform(0.15, 0.4, mean.shape)
    # Weights hang on distances so much that they are such as every engine's format holds exactly.
    mean.flat[0] = _LONGEST
    mean, deviation = (np.rint(values * (65535.0 / _LONGEST)) * (_LONGEST / 65535.0) for values in (mean, deviation))
    validity, offset = np.ones(block), np.zeros((*block, 3))
    validity[1, 0, 1, 0] = validity[1, 1, 0, 1] = 0.0
    offset[1, 1, 1, 1], offset[1, 0, 0, 0] = 0.3 * reach * unit(rng.normal(size=(2, 3)))
    # A probe whose place was moved counts although its lattice point is inside geometry.
    validity[1, 1, 1, 1] = 0.0

    def spread(values: np.ndarray) -> np.ndarray:
        """(3, 2, 2, 2, …) → [z, y, x], each kind of block along y and the same ones along x."""
        rows = np.concatenate([np.concatenate([kind] * 3, axis=2) for kind in values], axis=1)
        return np.ascontiguousarray(rows, np.float32)

    shape = volume.resolution[::-1]
    coefficients = np.zeros((*shape, _COUNT, 3), np.float32)
    z, y, x = np.meshgrid(*map(np.arange, shape), indexing="ij")
    probe = 4 * z + 2 * (y % 2) + x % 2
    for channel in range(3):
        shines = 3 * (x // 2) + channel
        coefficients[..., 0, channel] = (probe == shines) | (shines == 8)
    return ProbeGrid(volume, coefficients, spread(validity), spread(np.stack([mean, mean**2 + deviation**2], axis=-1)),
                     spread(offset).astype(np.float16).astype(np.float32), np.full(shape, np.nan, np.float32))


def _scattered_grid() -> ProbeGrid:
    """Probes of a hard grid anywhere in their box, from whose centre their ways are halves; the last seven fill up the rows."""
    rng = np.random.default_rng(8)
    hard = _hard_grid("Scattered", (20, 2, 1), _box((-3.0, -7.0, 3.0), (2.1, 1.4, 0.9), _turned((0.5, -0.3, 0.8))), 9)
    volume, count = hard.volume, 33
    centre = np.asarray(volume.world_from_local)[:3, 3]
    places = lattice.transform_points(volume.world_from_local, rng.uniform(-0.95, 0.95, (count, 3)))
    places = centre + (places - centre).astype(np.float16)
    offset, validity = np.zeros((40, 3)), np.zeros(40, np.float32)
    points = lattice.lattice_points(volume.world_from_local, volume.resolution).reshape(-1, 3)
    offset[:count], validity[:count] = places - points[:count], 1.0
    nodes = (3, 3, 4)
    named = np.argsort(rng.random((*nodes, count)), axis=-1)[..., :SLOTS]
    share = rng.random((*nodes, SLOTS)) * (np.arange(SLOTS) <= rng.integers(0, SLOTS, (*nodes, 1)))
    index = words(named, share) * np.where(rng.random((*nodes, 1)) < 0.2, -1, 1)
    # A whole cell that stands in for others.
    index[:2, :2, :2] = -np.abs(index[:2, :2, :2])
    offset, validity = offset.reshape(*hard.validity.shape, 3).astype(np.float32), validity.reshape(hard.validity.shape)
    scattered = of_grid(index.astype(np.int32), volume.world_from_local, offset, validity)
    return replace(hard, volume=replace(volume, scattered=scattered), validity=validity, offset_world=offset)


def _hard_matrix() -> np.ndarray:
    return _box((8.0, -3.0, 1.5), (2.5, 1.2, 1.8), _turned((0.8, 0.5, -0.2)))


def _inset_matrix() -> np.ndarray:
    return _box((8.6, -2.6, 1.2), (0.9, 0.9, 0.7), np.eye(3))


def _turned(axis) -> np.ndarray:
    """(3, 3): a rotation whose first axis points along ``axis``."""
    first = unit(np.array(axis))
    last = unit(np.cross(first, (0.0, 0.0, 1.0)))
    return np.stack([first, np.cross(last, first), last], axis=1)


def _box(centre, half_sides, rotation: np.ndarray) -> np.ndarray:
    matrix = np.eye(4)
    matrix[:3, :3] = rotation * np.asarray(half_sides)
    matrix[:3, 3] = centre
    return matrix


def unit(vectors: np.ndarray) -> np.ndarray:
    """``vectors`` (…, 3) of length 1."""
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
