"""What every export is held to inside its engine: points and normals with the irradiance that our own lookup gives there.

Two sets of probes: the ``kit`` (`kit.py`), whose content is known, and the bundle itself. Each point has two normals, the one that
is shaded and the surface's own, so that an engine which takes one for the other is seen. The tolerance of a point is what rounding
its coefficients to half floats can change: 2^-11 of the sum of the terms' magnitudes, and as much again of float32's as the weights
need; of the brightest point's irradiance 5 millionths besides, below which halves and float32 world coordinates end.
"""

from dataclasses import dataclass

import numpy as np

from ...numerics import grid as lattice
from ...numerics import sh
from ...scene import ProbeVolume
from ...techniques.lattice.field import ProbeField
from ...techniques.lattice.lookup import normal_bias
from ...techniques.lattice.weights import LIFT
from .axes import Axes
from .kit import kit_field, unit, weighed_points
from .volumes import ORDER

POINTS = 200
SCHEMA = "rtgi-conformance/1"
KIT, BUNDLE = "kit", "bundle"

_HALF, _FLOAT, _LEAST = 2.0**-11, 1e-4, 5e-6


@dataclass(frozen=True, eq=False)
class Case:
    """``points``, unit ``normals`` and ``surface_normals`` (n, 3) float32 in the engine's axes and units, with ``irradiance``
    [W/m^2] and ``tolerance`` (n, 3) float32, of the probes that ``volumes`` names: KIT or BUNDLE."""

    name: str
    description: str
    volumes: str
    points: np.ndarray
    normals: np.ndarray
    surface_normals: np.ndarray
    irradiance: np.ndarray
    tolerance: np.ndarray

    def to_json(self) -> dict:
        """The case as JSON-able values."""
        names = "points", "normals", "surface_normals", "irradiance", "tolerance"
        arrays = {name: _digits(getattr(self, name)) for name in names}
        return {"name": self.name, "description": self.description, "volumes": self.volumes, **arrays}


def cases(field: ProbeField, axes: Axes) -> tuple[Case, ...]:
    """The kit's cases and the one of ``field``, an ``engine_field``."""
    kit = kit_field()
    rng = np.random.default_rng(3)
    known, *hard, _, scattered = (grid.volume for grid in kit.grids())
    probes = lattice.lattice_points(known.world_from_local, known.resolution).reshape(-1, 3)
    return (
        case("known content", "a constant, six lobes along the axes, each single coefficient: at the probes", KIT, kit, axes,
             probes[np.arange(POINTS) % len(probes)], rng, LIFT * normal_bias(known, kit.lookup)),
        case("between known probes", "the same, blended", KIT, kit, axes, _inside(known, POINTS, rng), rng),
        case("visibility", "rotated, non-cubic and overlapping volumes, walls, probes moved and inside geometry, points outside",
             KIT, kit, axes, np.concatenate([_inside(volume, POINTS // 2, rng, 1.15) for volume in hard]), rng),
        case("weights", "the eight weights of a point, three at a time as the light of probes of one colour each", KIT, kit, axes,
             weighed_points(rng), rng),
        case("scattered", "probes anywhere, by what the nodes about a point name", KIT, kit, axes,
             _inside(scattered, POINTS, np.random.default_rng(10), 1.05), np.random.default_rng(11)),
        case("bundle", "the volumes of this export", BUNDLE, field, axes, _spread(field, rng), rng),
    )


def to_json(field: ProbeField, axes: Axes) -> dict:
    """The contents of an export's conformance.json."""
    return {"schema": SCHEMA, "unit": "W/m^2", "cases": [case.to_json() for case in cases(field, axes)]}


def kit_points(rng) -> np.ndarray:
    """POINTS points in and about the kit's volumes that have walls, moved probes and blind ones."""
    _, *hard, _, _ = (grid.volume for grid in kit_field().grids())
    return np.concatenate([_inside(volume, POINTS // 2, rng, 1.15) for volume in hard])


def bundle_points(field: ProbeField, rng) -> np.ndarray:
    """POINTS points over all volumes of ``field``."""
    return _spread(field, rng)


def case(name: str, description: str, volumes: str, field: ProbeField, axes: Axes, points: np.ndarray, rng,
         below: float = 0.0, more: ProbeField | None = None) -> Case:
    """What ``field`` says at ``points`` (n, 3) of Blender's world, at normals that ``rng`` draws and others some 40 degrees off;
    ``below`` [m] is how far to move the points against their surface normals. ``more`` says how far coefficients may be off before
    they are rounded; they may then be cut, too."""
    surface_normals = unit(rng.normal(size=points.shape)).astype(np.float32)
    points = points - below * surface_normals
    normals = unit(surface_normals + 0.6 * rng.normal(size=points.shape)).astype(np.float32)
    # The engine reads float32 positions in its own axes: what is asked of ours is the very same points.
    points_engine = axes.vectors(points).astype(np.float32)
    points = points_engine.astype(np.float64) @ axes.engine_from_blender / axes.scale
    irradiance = field.irradiance(points, normals, surface_normals)
    cut = 1.0 if more is None else 2.0
    tolerance = (cut * _HALF + _FLOAT) * _magnitude(field, points, normals, surface_normals) + _LEAST * irradiance.max()
    if more is not None:
        tolerance += _magnitude(more, points, normals, surface_normals)
    return Case(name, description, volumes, points_engine, axes.directions(normals), axes.directions(surface_normals), irradiance,
                tolerance)


def _magnitude(field: ProbeField, points: np.ndarray, normals: np.ndarray, surface_normals: np.ndarray) -> np.ndarray:
    """(n, 3): the sum of the magnitudes of all terms of the irradiance, by which rounding errors are counted."""
    basis = np.abs(sh.evaluate(normals, ORDER) * sh.cosine_coefficients(ORDER))
    total = np.zeros((len(points), 3))
    for lookup, share in zip(field.lookups, field.shares(points).T, strict=True):
        index, weight = lookup.weights(points, surface_normals)
        total += share[:, None] * np.einsum("nw,nk,nwkc->nc", weight, basis, np.abs(lookup.coefficients[index]))
    return total.astype(np.float32)


def _inside(volume: ProbeVolume, count: int, rng, reach: float = 1.0) -> np.ndarray:
    """``count`` random points of the box, ``reach`` times as large."""
    return lattice.transform_points(volume.world_from_local, reach * rng.uniform(-1.0, 1.0, (count, 3)))


def _spread(field: ProbeField, rng) -> np.ndarray:
    """POINTS points over all volumes of ``field``."""
    grids = field.grids()
    shares = [POINTS // len(grids) + (number < POINTS % len(grids)) for number in range(len(grids))]
    return np.concatenate([_inside(grid.volume, count, rng) for grid, count in zip(grids, shares, strict=True)])


def _digits(array: np.ndarray) -> list:
    """Rows of numbers with the nine digits that bring a float32 back."""
    return [[float(f"{value:.9g}") for value in row] for row in np.asarray(array, np.float64)]
