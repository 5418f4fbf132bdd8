"""Where a field has light that should not be there, and why: every receiver's excess over the path reference, with a named cause.

A receiver leaks when it gets more than ``EXCESS`` of its true light and ``LEVEL`` of the scene's mean on top of the truth, and more
than the reference's noise explains. What is to blame is found with rays from the receiver: to the eight probes that it reads, or
through the surface that it lies on.

Failures as in PHYSICS.md section 3; sources: M. Majercik et al., JCGT 8(2), 2019 (probes behind walls and inside geometry);
C. Dachsbacher and M. Stamminger, I3D 2005, section 5 (RSM without visibility); A. Kaplanyan and C. Dachsbacher, I3D 2010.
"""

from dataclasses import dataclass
from enum import IntEnum
from functools import cached_property

import numpy as np

from ..numerics import grid as lattice
from ..progress import Progress
from ..techniques import Field
from ..techniques.lpv.field import LpvField
from ..techniques.probes.field import ProbeField
from ..techniques.probes.lookup import GridLookup
from ..techniques.probes.reconstruction import reconstruct
from ..techniques.rsm.field import RsmField
from ..transport.context import LightContext
from ..transport.rays import offset_origins
from ..transport.solids import Solids
from ..transport.vectors import dot, luminance
from .receivers import Receivers, open_probes, surface_receivers
from .references import PathReference, Truth

EXCESS, LEVEL, SIGMAS = 0.25, 0.05, 3.0
# Signed errors are relative to the truth, or to this share of its mean where that is more.
FAINT = 0.1
# Noise of the reference, and the most paths of all receivers together.
NOISE, MOST_PATHS = 0.03, 1 << 23
# A cause explains a leak if at least this share of the excess came its way.
BLAMED = 0.5
# Surfaces nearer together than this share of the spacing are one sheet.
SHEET = 1e-3
# A surface within this share of a cell under a receiver is its own.
OWN = 0.05


class Cause(IntEnum):
    """Why a receiver leaks; ``text`` says it to the user."""

    NONE = 0
    THIN_WALL = 1
    INSIDE = 2
    TWO_SIDED = 3
    NO_VISIBILITY = 4
    BETWEEN = 5

    @property
    def text(self) -> str:
        """What a panel shows."""
        return _TEXTS[self]


_TEXTS = {
    Cause.NONE: "no leak", Cause.THIN_WALL: "wall thinner than the spacing", Cause.INSIDE: "probe inside geometry",
    Cause.TWO_SIDED: "two-sided material", Cause.NO_VISIBILITY: "no visibility in the technique",
    Cause.BETWEEN: "light changes between samples",
}


@dataclass(frozen=True, eq=False)
class LeakMap:
    """``found`` and ``truth.mean`` (n, 3) irradiance at ``receivers`` [W/m2]; ``cause`` (n,) int8 of Cause."""

    receivers: Receivers
    found: np.ndarray
    truth: Truth
    cause: np.ndarray

    @cached_property
    def error(self) -> np.ndarray:
        """Signed error (n,) float32 of luminance: positive is too bright."""
        found, true = luminance(self.found), luminance(self.truth.mean)
        level = FAINT * float(true.mean())
        return ((found - true) / np.maximum(true, level)).astype(np.float32) if level > 0 else found.astype(np.float32)

    @cached_property
    def radius(self) -> float:
        """Half the typical distance [m] from a receiver to the next: what each stands for on its surface."""
        points = self.receivers.points
        if len(points) < 2:
            return 0.1
        some = points[np.linspace(0, len(points) - 1, min(len(points), 256)).astype(int)]
        squares = np.square(some[:, None] - points[None]).sum(axis=2)
        return 0.5 * float(np.sqrt(np.partition(squares, 1, axis=1)[:, 1].mean()))

    def counts(self) -> dict[Cause, int]:
        """Receivers by cause, most first, only those that leak."""
        causes, counts = np.unique(self.cause[self.cause != Cause.NONE], return_counts=True)
        return {Cause(causes[index]): int(counts[index]) for index in np.argsort(-counts, kind="stable")}

    def lines(self) -> list[str]:
        """For a panel: how many leak, then a line a cause."""
        counts = self.counts()
        head = f"{sum(counts.values()):,} of {len(self.cause):,} receivers leak"
        return [head, *(f"{count:,}: {cause.text}" for cause, count in counts.items())]

    def nearest(self, point: np.ndarray) -> int | None:
        """The receiver that stands for ``point`` (3,) on a surface, or None if none is near."""
        if not len(self.receivers.points):
            return None
        distance = np.linalg.norm(self.receivers.points - np.asarray(point, np.float32), axis=1)
        row = int(distance.argmin())
        return row if distance[row] <= 4.0 * self.radius else None


def find_leaks(context: LightContext, field: Field, points: int = 2000, seed: int = 0, progress: Progress | None = None) -> LeakMap:
    """Compare ``field`` with the path reference at ``points`` points of surfaces around the scene's volumes. Raises Cancelled."""
    progress = progress or Progress()
    progress.step(0.0, "Choosing receivers")
    volumes = context.scene.volumes
    eyes = np.concatenate([lattice.lattice_points(volume.world_from_local, volume.resolution).reshape(-1, 3) for volume in volumes])
    receivers = surface_receivers(context, eyes[open_probes(context, volumes)], points, 1, seed)
    truth = PathReference(context, NOISE, MOST_PATHS, seed + 1).irradiance(receivers, progress.span(0.02, 0.9))
    progress.step(0.9, "Naming causes")
    found = np.asarray(field.irradiance(receivers.points, receivers.normals), np.float64)
    cause = name_causes(context, field, receivers, found, truth)
    progress.step(1.0, "Done")
    return LeakMap(receivers, found, truth, cause)


def name_causes(context: LightContext, field: Field, receivers: Receivers, found: np.ndarray, truth: Truth) -> np.ndarray:
    """(n,) int8 of Cause for what a field says (``found``, (n, 3)) at ``receivers`` and the ``truth``."""
    true, noise = luminance(truth.mean), np.sqrt(luminance(truth.variance))
    excess = luminance(found) - true
    rows = np.flatnonzero(excess > np.maximum(np.maximum(EXCESS * true, LEVEL * float(true.mean())), SIGMAS * noise))
    cause = np.zeros(len(found), np.int8)
    if len(rows) == 0:
        return cause
    leaking, excess = receivers.take(rows), excess[rows]
    if isinstance(field, ProbeField):
        cause[rows] = _of_probes(context, field, leaking, excess)
    elif isinstance(field, LpvField):
        cause[rows] = _of_cells(context, leaking, _cell_sides(field, leaking.points))
    elif isinstance(field, RsmField) and not field.capture.settings.visibility:
        cause[rows] = Cause.NO_VISIBILITY
    else:
        cause[rows] = Cause.BETWEEN
    return cause


def _of_probes(context: LightContext, field: ProbeField, receivers: Receivers, excess: np.ndarray) -> np.ndarray:
    """The causes (n,) where a field of probes leaks, each by the volume that has most of a say there."""
    cause = np.full(len(excess), Cause.BETWEEN, np.int8)
    solids = Solids(context.scene, context.geometry, context.surfaces)
    owner = field.shares(receivers.points).argmax(axis=1)
    for number, lookup in enumerate(field.lookups):
        rows = np.flatnonzero(owner == number)
        if len(rows):
            cause[rows] = _of_lookup(context, solids, lookup, receivers.take(rows), excess[rows])
    return cause


def _of_lookup(context: LightContext, solids: Solids, lookup: GridLookup, receivers: Receivers, excess: np.ndarray) -> np.ndarray:
    points, normals = receivers.points, receivers.normals
    index, weight = lookup.weights(points, normals)
    count, neighbours = index.shape
    flat_normals = np.repeat(normals, neighbours, axis=0)
    light = reconstruct(lookup.settings.reconstruction, lookup.coefficients[index.ravel()], flat_normals)
    brought = weight * luminance(light).reshape(index.shape)
    # From both ends: what is met first on the way to a probe, and on the way back from it.
    probes = (lookup.positions[index].astype(np.float64) + lookup.centre).reshape(-1, 3)
    origins = np.repeat(points, neighbours, axis=0).astype(np.float64)
    way = probes - origins
    length = np.maximum(np.linalg.norm(way, axis=1), 1e-9)
    directions = (way / length[:, None]).astype(np.float32)
    onward = context.tracer.intersect(origins.astype(np.float32), directions, (0.9999 * length).astype(np.float32))
    back = context.tracer.intersect(probes.astype(np.float32), -directions, (0.9999 * length).astype(np.float32))
    hidden = (onward.primitive >= 0).reshape(index.shape)
    gap = length - np.where(onward.primitive >= 0, onward.t, 0.0) - np.where(back.primitive >= 0, back.t, 0.0)
    leaves_solid = np.zeros(len(length), bool)
    met = np.flatnonzero(back.primitive >= 0)
    outward = dot(context.geometry.normals_world[back.primitive[met]], -directions[met]) > 0
    leaves_solid[met] = outward & solids.is_solid(back.primitive[met])
    inside = ~lookup.live[index] | leaves_solid.reshape(index.shape)
    spacing = lattice.cell_size(lookup.volume.world_from_local, lookup.volume.resolution).min()
    cause = np.full(count, Cause.BETWEEN, np.int8)
    behind = np.where(hidden & ~inside, brought, 0.0)
    blamed = behind.sum(axis=1) >= BLAMED * excess
    strongest = gap.reshape(index.shape)[np.arange(count), behind.argmax(axis=1)]
    walled = Cause.NO_VISIBILITY if not lookup.settings.visibility else Cause.THIN_WALL
    cause[blamed] = np.where(strongest[blamed] <= SHEET * spacing, np.int8(Cause.TWO_SIDED), np.int8(walled))
    cause[np.where(inside, brought, 0.0).sum(axis=1) >= BLAMED * excess] = Cause.INSIDE
    return cause


def _of_cells(context: LightContext, receivers: Receivers, cell: np.ndarray) -> np.ndarray:
    """The causes (n,) where light spreads from cell to cell, ``cell`` (n,) [m] wide: what lies behind each receiver's surface."""
    inward = -receivers.normals
    # Receivers lie just above their own surface.
    own = context.tracer.intersect(receivers.points, inward, (OWN * cell).astype(np.float32))
    surface = receivers.points + inward * np.where(own.primitive >= 0, own.t, 0.0).astype(np.float32)[:, None]
    hits = context.tracer.intersect(offset_origins(surface, receivers.normals, inward), inward)
    met = hits.primitive >= 0
    through = np.zeros(len(met), bool)
    through[met] = dot(context.geometry.normals_world[hits.primitive[met]], inward[met]) > 0
    # Blocking is known to half a cell on either side of a surface.
    thin = through & (hits.t < 2.0 * cell)
    return np.where(thin, np.int8(Cause.THIN_WALL), np.where(through, np.int8(Cause.BETWEEN), np.int8(Cause.TWO_SIDED)))


def _cell_sides(field: LpvField, points: np.ndarray) -> np.ndarray:
    """Side (n,) [m] of the cells of the finest cascade around each point."""
    side = np.full(len(points), max(grid.cell for grid in field.volume_grids))
    for grid in sorted(field.volume_grids, key=lambda grid: -grid.cell):
        side[grid.inside(points)] = grid.cell
    return side
