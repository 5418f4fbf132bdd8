"""How far what is read from probes is off on surfaces: what a player sees, where noise at the probes is a small part of it.

A few points are held to rays of their own, which end in the bake's surface cache; their noise is taken out by the two halves of
each sequence. The interval is meant to cover what as many other points would say (`numerics/heavy_tail.py`): a few points may hold
most of the error.
"""

from dataclasses import asdict, dataclass
from typing import NamedTuple

import numpy as np

from ...numerics.grid import box_distance, cell_volume
from ...numerics.heavy_tail import interval_of_another_draw, root_ratio
from ...numerics.sampling import hash_u32, sobol_owen, sphere_from_square
from ...progress import Progress
from ...scene import ProbeVolume
from ...transport.cache.surface_cache import SurfaceCache
from ...transport.context import LightContext
from ...transport.vectors import faced
from ..base import Field
from ..lamp_light import LampLight
from ..lattice.field import ProbeField
from ..lattice.placement import Placement
from .gathering import light_at_receivers
from .settings import ProbeSettings

# Points, and the rays of each (an even number of blocks).
POINTS, RAYS = 384, 128
# The share of other draws that the interval is meant to cover.
CONFIDENCE = 0.95
# Points further outside the volumes than this share of a cell are none that probes are for.
OUTSIDE = 0.5
_PURPOSE = 0x737266


@dataclass(frozen=True)
class SurfaceError:
    """Relative RMSE of irradiance at ``points`` points on surfaces under their own normals, and its 95 % interval over other draws
    of points."""

    value: float
    low: float
    high: float
    points: int

    def to_json(self) -> dict:
        """As a bake's statistics have it."""
        return asdict(self)


class Truth(NamedTuple):
    """What there is to be read: irradiance ``light`` (n, 3), with its ``variance`` (n, 3), at ``points`` (n, 3) on surfaces under
    their ``normals`` (n, 3)."""

    points: np.ndarray
    normals: np.ndarray
    light: np.ndarray
    variance: np.ndarray

    @staticmethod
    def join(parts: "list[Truth]") -> "Truth":
        """Several sets end to end."""
        return Truth(*map(np.concatenate, zip(*parts, strict=True))) if parts else Truth(*np.zeros((4, 0, 3), np.float32))


def error_on_surfaces(bakes, field: ProbeField, progress: Progress) -> SurfaceError | None:
    """The error of ``field`` on the surfaces that probes of ``bakes`` (finished ProbeBakes) see inside the volumes; None where they
    see none, or nothing but darkness. Raises Cancelled."""
    volumes = tuple(grid.volume for grid in field.grids())
    return error_against(Truth.join([
        light_on_surfaces(bake.context, bake.cache, bake.settings, bake.placement, bake.lamp_light, volumes,
                          max(1, POINTS // len(bakes)), progress.span(number / len(bakes), (number + 1) / len(bakes)))
        for number, bake in enumerate(bakes)]), field)


def error_against(truth: Truth, field: Field) -> SurfaceError | None:
    """The error of ``field`` against ``truth``; None where nothing is known, or all of it is darkness."""
    power = np.sum(truth.light**2 - truth.variance, axis=1)
    if power.sum() <= 0:
        return None
    off = np.sum((field.irradiance(truth.points, truth.normals) - truth.light) ** 2 - truth.variance, axis=1)
    return SurfaceError(root_ratio(off, power), *interval_of_another_draw(off, power, CONFIDENCE), len(power))


def light_on_surfaces(context: LightContext, cache: SurfaceCache, settings: ProbeSettings, placement: Placement,
                      lamp_light: LampLight, volumes: tuple[ProbeVolume, ...], count: int, progress: Progress) -> Truth:
    """The light at up to ``count`` points on surfaces that the probes of ``placement`` see, inside or beside ``volumes``, by rays
    that end in ``cache``. Raises Cancelled."""
    seed = int(hash_u32(cache.numbers.seed, _PURPOSE))
    points, normals = _seen_points(context, placement, volumes, count, seed)
    if not len(points):
        return Truth.join([])
    light, variance = light_at_receivers(context, cache, settings, points, normals, lamp_light, RAYS, seed + 1, progress)
    return Truth(points, normals, light, variance)


def _seen_points(context: LightContext, placement: Placement, volumes: tuple[ProbeVolume, ...], count: int,
                 seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, 3) where rays from measured probes meet surfaces, and the normals (n, 3) there."""
    probes = np.flatnonzero(placement.measured)
    # Half of the rays may end outside, or nowhere.
    numbers = sobol_owen(2 * count, 3, seed)
    origins = placement.positions[probes[(numbers[:, 2] * len(probes)).astype(np.int64)]]
    directions = sphere_from_square(numbers[:, :2])
    hits = context.tracer.intersect(origins, directions)
    rows = np.flatnonzero(hits.primitive >= 0)
    points = context.geometry.points(hits.primitive[rows], hits.u[rows], hits.v[rows])
    near = np.zeros(len(points), bool)
    for volume in volumes:
        side = cell_volume(volume.world_from_local, volume.nodes) ** (1 / 3)
        near |= box_distance(volume.world_from_local, points) <= OUTSIDE * side
    rows, points = rows[near][:count], points[near][:count]
    return points, faced(context.geometry.normals_world[hits.primitive[rows]], directions[rows])
