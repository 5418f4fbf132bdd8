"""Why a field of probes leaks: rays between a receiver and the eight probes that it reads tell.

Failures as in docs/physics.md §3; source: M. Majercik et al., JCGT 8(2), 2019 (probes behind walls and inside geometry).
"""

import numpy as np

from ...numerics import grid as lattice
from ...transport.context import LightContext
from ...transport.vectors import dot, luminance
from ..base import Cause
from .lookup import GridLookup
from .reconstruction import reconstruct

# A cause explains a leak if at least this share of the excess came its way.
BLAMED = 0.5
# Surfaces nearer together than this share of the spacing are one sheet.
SHEET = 1e-3
# Rays between a receiver and a probe end this share of the way before the other end: what lies there is not in between.
_SHORT_OF = 0.9999


def causes_of_probes(context: LightContext, lookups: tuple[GridLookup, ...], shares: np.ndarray, points: np.ndarray,
                     normals: np.ndarray, excess: np.ndarray) -> np.ndarray:
    """The causes (n,) int8 of ``excess`` luminance (n,) at ``points`` (n, 3) under ``normals`` (n, 3), in which each of ``lookups``
    has its ``shares`` (n, volumes): by the volume that has most of a say there."""
    cause = np.full(len(excess), Cause.BETWEEN, np.int8)
    owner = shares.argmax(axis=1)
    for number, lookup in enumerate(lookups):
        rows = np.flatnonzero(owner == number)
        if len(rows):
            cause[rows] = _of_lookup(context, lookup, points[rows], normals[rows], excess[rows])
    return cause


def _of_lookup(context: LightContext, lookup: GridLookup, points: np.ndarray, normals: np.ndarray,
               excess: np.ndarray) -> np.ndarray:
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
    limit = (_SHORT_OF * length).astype(np.float32)
    directions = (way / length[:, None]).astype(np.float32)
    onward = context.tracer.intersect(origins.astype(np.float32), directions, limit)
    back = context.tracer.intersect(probes.astype(np.float32), -directions, limit)
    hidden = (onward.primitive >= 0).reshape(index.shape)
    gap = length - np.where(onward.primitive >= 0, onward.t, 0.0) - np.where(back.primitive >= 0, back.t, 0.0)
    leaves_solid = np.zeros(len(length), bool)
    met = np.flatnonzero(back.primitive >= 0)
    outward = dot(context.geometry.normals_world[back.primitive[met]], -directions[met]) > 0
    leaves_solid[met] = outward & context.solids.is_solid(back.primitive[met])
    inside = ~lookup.live[index] | leaves_solid.reshape(index.shape)
    spacing = lattice.cell_size(lookup.volume.world_from_local, lookup.volume.nodes).min()
    cause = np.full(count, Cause.BETWEEN, np.int8)
    behind = np.where(hidden & ~inside, brought, 0.0)
    blamed = behind.sum(axis=1) >= BLAMED * excess
    strongest = gap.reshape(index.shape)[np.arange(count), behind.argmax(axis=1)]
    walled = Cause.NO_VISIBILITY if not lookup.settings.visibility else Cause.THIN_WALL
    cause[blamed] = np.where(strongest[blamed] <= SHEET * spacing, np.int8(Cause.TWO_SIDED), np.int8(walled))
    cause[np.where(inside, brought, 0.0).sum(axis=1) >= BLAMED * excess] = Cause.INSIDE
    return cause
