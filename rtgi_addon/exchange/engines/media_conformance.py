"""What an export's media are held to inside the engine: points and rays with the answers of ``EngineMedia``, their numpy twin.

Two sets: the ``kit``, whose content is of every kind, and the bundle's own. The tolerance is what rounding can change: filters of
GPUs weigh neighbouring cells in steps of 1/256, and float32 counts for the rest; it is found by asking the twin again, of cells
that are off by as much.
"""

from dataclasses import replace
from functools import cache

import numpy as np

from ...numerics import grid as lattice
from ...scene import DensityGrid, Medium, Phase
from ...techniques.lattice.field import ProbeField
from .axes import Axes
from .conformance import BUNDLE, KIT, POINTS
from .kit import kit_field, unit
from .media import EngineMedia, engine_media

STEPS = 32
# A step of a GPU's filter, and what float32 leaves of sums.
_FILTER, _FLOAT = 1.0 / 256.0, 2e-5
# How close to a box's face a point may not lie, of the box: there it is inside for one and outside for the other.
_CLEAR = 1e-4


@cache
def kit_media(axes: Axes) -> EngineMedia:
    """Fog of two phase functions everywhere, a turned box, smoke, and a fire of three colours, in the light of the probes' kit."""
    rng = np.random.default_rng(11)
    smoke = rng.random((4, 3, 5), np.float32) ** 2
    fire = {kind: rng.random((3, 4, 2, 3), np.float32) for kind in ("scattering", "absorption", "emission")}
    one = np.ones((1, 1, 1), np.float32)
    media = (
        Medium("Fog", np.array([0.06, 0.05, 0.04]), np.array([0.0, 0.01, 0.02]), phase=Phase(anisotropy=0.6)),
        Medium("Haze", np.array([0.01, 0.02, 0.04]), emission=np.array([0.02, 0.01, 0.0]), phase=Phase("RAYLEIGH")),
        Medium("Box", np.array([0.5, 0.4, 0.3]), np.array([0.2, 0.3, 0.4]), phase=Phase(anisotropy=-0.4),
               grid=DensityGrid(_turned((7.0, -2.8, 1.6), (1.4, 0.7, 1.1), rng), one)),
        Medium("Smoke", np.array([1.2, 1.0, 0.8]), np.array([0.1, 0.1, 0.3]), phase=Phase("DRAINE", 0.5, 1.0),
               grid=DensityGrid(_turned((8.0, -3.0, 1.5), (2.0, 1.5, 1.0), rng), smoke)),
        Medium("Fire", np.array([0.3, 0.3, 0.3]), np.array([0.5, 0.6, 0.9]), np.array([4.0, 2.0, 0.5]),
               grid=DensityGrid(_turned((9.0, -4.0, 2.0), (1.0, 1.0, 2.0), rng), 0.5 + rng.random((3, 4, 2), np.float32), **fire)),
    )
    # Of the kit's volumes one that is turned, with probes that were moved and walls about them.
    return engine_media(media, ProbeField(kit_field().grids()[1:2]), axes)


def to_json(media: EngineMedia, axes: Axes) -> dict:
    """The ``media`` part of an export's conformance.json."""
    return {"steps": STEPS, "cases": [*_kit_cases(axes), *_cases(BUNDLE, media)]}


@cache
def _kit_cases(axes: Axes) -> list[dict]:
    return _cases(KIT, kit_media(axes))


def _cases(name: str, media: EngineMedia) -> list[dict]:
    rng = np.random.default_rng(12)
    return [_points_case(name, media, rng), _rays_case(name, media, rng)]


def _points_case(name: str, media: EngineMedia, rng) -> dict:
    """Extinction and source at points of and about every medium, along random directions."""
    points = _points(media, rng)
    directions = unit(rng.normal(size=points.shape)).astype(np.float32).astype(np.float64)
    found = np.stack(media.source(points, directions), axis=1)
    return _case(f"{name}, media at points", name, "points", found,
                 _tolerance(media, found, lambda other: np.stack(other.source(points, directions), axis=1)),
                 points=points, directions=directions)


def _rays_case(name: str, media: EngineMedia, rng) -> dict:
    """Transmittance and radiance along rays that begin anywhere and end elsewhere."""
    origins = _points(media, rng)
    ends = _points(media, rng)
    ends = ends[rng.permutation(len(ends))]
    lengths = np.linalg.norm(ends - origins, axis=1).astype(np.float32).astype(np.float64)
    directions = unit(ends - origins).astype(np.float32).astype(np.float64)
    # Within a step a ray enters or leaves a box: such a step's middle must be clear of its faces.
    kept = np.flatnonzero((lengths > 1e-3) & _clear(media, origins, directions, lengths))
    origins, directions, lengths = (values[kept] for values in (origins, directions, lengths))
    found = np.stack(media.march(origins, directions, lengths, STEPS), axis=1)
    return _case(f"{name}, media along rays", name, "rays", found,
                 _tolerance(media, found, lambda other: np.stack(other.march(origins, directions, lengths, STEPS), axis=1)),
                 points=origins, directions=directions, lengths=lengths)


def _case(label: str, media: str, kind: str, found: np.ndarray, tolerance: np.ndarray, **asked) -> dict:
    arrays = {**asked, "first": found[:, 0], "second": found[:, 1], "first_tolerance": tolerance[:, 0],
              "second_tolerance": tolerance[:, 1]}
    return {"name": label, "media": media, "kind": kind, **{key: _digits(values) for key, values in arrays.items()}}


def _tolerance(media: EngineMedia, found: np.ndarray, ask) -> np.ndarray:
    """(n, 2, 3): see the module's docstring."""
    spread = sum(np.abs(ask(_shaken(media, sign)) - found) for sign in (-1.0, 1.0))
    return spread + _FLOAT * np.abs(found) + _FLOAT * np.abs(found).max(axis=(0, 2))[None, :, None]


def _shaken(media: EngineMedia, sign: float) -> EngineMedia:
    """``media`` whose cells are off by a step of a filter, of what their neighbours differ by: three such steps, one an axis."""
    def shaken(cells: np.ndarray, axes) -> np.ndarray:
        cells = cells.astype(np.float32)
        change = sum(_spread(cells, axis) for axis in axes)
        return cells + sign * _FILTER * change

    boxes = tuple(replace(box, cells=shaken(box.cells, (1, 2, 3))) for box in media.boxes)
    return replace(media, boxes=boxes, ambient=shaken(media.ambient, (0, 1, 2)))


def _spread(cells: np.ndarray, axis: int) -> np.ndarray:
    """The larger difference of each cell to its two neighbours along ``axis``."""
    steps = np.abs(np.diff(cells, axis=axis))
    edge = np.zeros_like(np.take(cells, [0], axis=axis))
    return np.maximum(np.concatenate([steps, edge], axis=axis), np.concatenate([edge, steps], axis=axis))


def _points(media: EngineMedia, rng) -> np.ndarray:
    """POINTS points, float32, of boxes half as large again, of the ambient light's box among them, clear of their faces."""
    places = [box.world_from_unit for box in media.boxes] + [np.linalg.inv(media.ambient_from_world)]
    found = []
    for number, place in enumerate(places):
        wanted = POINTS // len(places) + (number < POINTS % len(places))
        local = rng.uniform(-0.25, 1.25, (2 * wanted, 3))
        points = lattice.transform_points(place, local).astype(np.float32).astype(np.float64)
        found.append(points[_clear_points(media, points)][:wanted])
    return np.concatenate(found)


def _clear_points(media: EngineMedia, points: np.ndarray) -> np.ndarray:
    """(n,) whether points are clear of the boxes' faces."""
    clear = np.ones(len(points), bool)
    for box in media.boxes:
        unit_points = lattice.transform_points(box.unit_from_world, points)
        clear &= np.all(np.minimum(np.abs(unit_points), np.abs(unit_points - 1.0)) > _CLEAR, axis=1)
    return clear


def _clear(media: EngineMedia, origins, directions, lengths) -> np.ndarray:
    """(n,) whether the middles of all steps along rays are."""
    first, length = media.span(origins, directions, lengths)
    middles = first[:, None] + length[:, None] * ((np.arange(STEPS) + 0.5) / STEPS)
    points = origins[:, None] + directions[:, None] * middles[..., None]
    return _clear_points(media, points.reshape(-1, 3)).reshape(middles.shape).all(axis=1)


def _turned(centre, half_sides, rng) -> np.ndarray:
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = turn * np.asarray(half_sides), centre
    return matrix


def _digits(values: np.ndarray) -> list:
    rounded = np.asarray(values, np.float64)
    return [float(f"{value:.9g}") if np.ndim(value) == 0 else [float(f"{part:.9g}") for part in value] for value in rounded]


