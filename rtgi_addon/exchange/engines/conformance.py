"""What every export is held to inside its engine: points and normals with the irradiance that our own lookup gives there.

Two sets of probes: the ``kit``, whose content is known (a constant, six lobes along the axes, every single coefficient; then probes
with everything that the lookup weighs), and the bundle itself. The tolerance of a point is what rounding its coefficients to half
floats can change: 2^-11 of the sum of the terms' magnitudes, and as much again of float32's as the weights need.
"""

from dataclasses import dataclass

import numpy as np

from ...numerics import grid as lattice
from ...numerics import sh
from ...scene import ProbeVolume
from ...techniques import ProbeGrid
from ...techniques.probes.field import ProbeField
from .axes import Axes
from .volumes import ORDER

POINTS = 200
SCHEMA = "rtgi-conformance/1"
KIT, BUNDLE = "kit", "bundle"

_HALF, _FLOAT = 2.0**-11, 1e-4
_COUNT = sh.coefficient_count(ORDER)
_TILE = 8
# A colour of its own for every channel, so that swapped ones are seen.
_TINT = np.array([1.0, 0.5, 0.25])


@dataclass(frozen=True, eq=False)
class Case:
    """``points`` and unit ``normals`` (n, 3) float32 in the engine's axes and units, with ``irradiance`` [W/m^2] and ``tolerance``
    (n, 3) float32, of the probes that ``volumes`` names: KIT or BUNDLE."""

    name: str
    description: str
    volumes: str
    points: np.ndarray
    normals: np.ndarray
    irradiance: np.ndarray
    tolerance: np.ndarray

    def to_json(self) -> dict:
        """The case as JSON-able values."""
        arrays = {name: _digits(getattr(self, name)) for name in ("points", "normals", "irradiance", "tolerance")}
        return {"name": self.name, "description": self.description, "volumes": self.volumes, **arrays}


def kit_field() -> ProbeField:
    """The kit's probes: the volumes "Known", "Hard" and "Inset", of which the last lies partly inside the second."""
    return ProbeField((_known_grid(), _hard_grid("Hard", (5, 3, 4), _hard_matrix(), 1),
                       _hard_grid("Inset", (3, 3, 3), _inset_matrix(), 2)))


def cases(field: ProbeField, axes: Axes) -> tuple[Case, ...]:
    """The kit's cases and the one of ``field``, an ``engine_field``."""
    kit = kit_field()
    rng = np.random.default_rng(3)
    known = _known_grid().volume
    probes = lattice.lattice_points(known.world_from_local, known.resolution).reshape(-1, 3)
    return (
        case("known content", "a constant, six lobes along the axes, each single coefficient: at the probes", KIT, kit, axes,
             probes[np.arange(POINTS) % len(probes)], rng),
        case("between known probes", "the same, blended", KIT, kit, axes, _inside(known, POINTS, rng), rng),
        case("visibility", "rotated, non-cubic and overlapping volumes, walls, probes moved and inside geometry, points outside",
             KIT, kit, axes, np.concatenate([_inside(grid.volume, POINTS // 2, rng, 1.15) for grid in kit.grids()[1:]]), rng),
        case("bundle", "the volumes of this export", BUNDLE, field, axes, _spread(field, rng), rng),
    )


def to_json(field: ProbeField, axes: Axes) -> dict:
    """The contents of an export's conformance.json."""
    return {"schema": SCHEMA, "unit": "W/m^2", "cases": [case.to_json() for case in cases(field, axes)]}


def case(name: str, description: str, volumes: str, field: ProbeField, axes: Axes, points: np.ndarray, rng) -> Case:
    """What ``field`` says at ``points`` (n, 3) of Blender's world and at normals that ``rng`` draws."""
    normals = _unit(rng.normal(size=points.shape)).astype(np.float32)
    # The engine reads float32 positions in its own axes: what is asked of ours is the very same points.
    points_engine = axes.vectors(points).astype(np.float32)
    points = points_engine.astype(np.float64) @ axes.engine_from_blender / axes.scale
    magnitude = _magnitude(field, points, normals)
    return Case(name, description, volumes, points_engine, axes.directions(normals), field.irradiance(points, normals),
                (_HALF + _FLOAT) * magnitude)


def _magnitude(field: ProbeField, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """(n, 3): the sum of the magnitudes of all terms of the irradiance, by which rounding errors are counted."""
    basis = np.abs(sh.evaluate(normals, ORDER) * sh.cosine_coefficients(ORDER))
    total = np.zeros((len(points), 3))
    for lookup, share in zip(field.lookups, field.shares(points).T, strict=True):
        index, weight = lookup.weights(points, normals)
        total += share[:, None] * np.einsum("nw,nk,nwkc->nc", weight, basis, np.abs(lookup.coefficients[index]))
    return total.astype(np.float32)


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
    offset = np.where(moved[..., None], reach * _unit(rng.normal(size=(*shape, 3))), 0.0)
    return ProbeGrid(volume, coefficients.astype(np.float32), validity.astype(np.float32),
                     np.stack([mean, mean**2 + deviation**2], axis=-1).astype(np.float32),
                     offset.astype(np.float16).astype(np.float32), np.full(shape, np.nan, np.float32))


def _hard_matrix() -> np.ndarray:
    turn = _unit(np.array([[0.8, 0.5, -0.2]]))[0]
    side = _unit(np.cross(turn, [[0.0, 0.0, 1.0]]))[0]
    return _box((8.0, -3.0, 1.5), (2.5, 1.2, 1.8), np.stack([turn, np.cross(side, turn), side], axis=1))


def _inset_matrix() -> np.ndarray:
    return _box((8.6, -2.6, 1.2), (0.9, 0.9, 0.7), np.eye(3))


def _box(centre, half_sides, rotation: np.ndarray) -> np.ndarray:
    matrix = np.eye(4)
    matrix[:3, :3] = rotation * np.asarray(half_sides)
    matrix[:3, 3] = centre
    return matrix


def _inside(volume: ProbeVolume, count: int, rng, reach: float = 1.0) -> np.ndarray:
    """``count`` random points of the box, ``reach`` times as large."""
    return lattice.transform_points(volume.world_from_local, reach * rng.uniform(-1.0, 1.0, (count, 3)))


def _spread(field: ProbeField, rng) -> np.ndarray:
    """POINTS points over all volumes of ``field``."""
    grids = field.grids()
    shares = [POINTS // len(grids) + (number < POINTS % len(grids)) for number in range(len(grids))]
    return np.concatenate([_inside(grid.volume, count, rng) for grid, count in zip(grids, shares, strict=True)])


def _unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def _digits(array: np.ndarray) -> list:
    """Rows of numbers with the nine digits that bring a float32 back."""
    return [[float(f"{value:.9g}") for value in row] for row in np.asarray(array, np.float64)]
