"""Emissive surfaces that stand nearer to others than probes are apart: their own light at each point, instead of from probes.

Between probes light is interpolated, so what a glowing thing gives a wall a hand's breadth away is lost. It is known in closed
form, as that of lamps is. Here is which surfaces it is worth it for, what probes hold of their direct light, and a field without
that; what they give by way of other surfaces stays in the probes.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ...numerics import sh
from ...numerics.grid import box_distance, cell_size, lattice_points
from ...numerics.sampling import about, cosine_hemisphere, hash_u32, sobol_owen, sobol_owen_at, unit_interval, wrapped
from ...scene import Material, ProbeVolume, Scene, baked_part
from ...transport.context import LightContext
from ...transport.lights.pane_faces import flat_faces
from ...transport.lights.panes import Panes, sample_triangle
from ...transport.parallel import chunks, parallel_for
from ...transport.rays.tracer import offset_origins, short_of
from ...transport.vectors import dot, largest, luminance
from ..base import Field, ProbeGrid
from .field import ProbeField

# Panes of all surfaces together, and triangles of one that are looked at.
MOST_PANES, MOST_TRIANGLES = 64, 256
# A surface is worth it if this share of its own light falls on others within a cell, and that is this share of what all surfaces
# emit.
NEAR_SHARE, WORTH = 0.05, 1e-3
# Rays that tell that share; samples of each triangle at a probe, and of one that is farther away than so many of its longest sides.
_RAYS, _SAMPLES, _FEW, _FAR = 256, 128, 16, 4.0
# Pairs of probes and samples at a time.
_PAIRS = 1 << 18
# What is taken from probes may be this share more than they hold: beyond, it is not the light that they were baked in.
_STALE = 0.02
_TINY, _ROUNDED = 1e-30, 1e-3
_SEED, _PROBE_SEED, _SHARE_SEED = 0x3000, 0x3100, 0x3200


@dataclass(frozen=True, eq=False)
class NearLight:
    """``panes`` of the emissive surfaces of the objects ``names``, and the SH ``held`` (p, k, 3) of their direct light at the
    probes of each grid of a field; ``left`` is that field without it."""

    panes: Panes
    names: tuple[str, ...]
    held: tuple[np.ndarray, ...]
    left: ProbeField

    def left_of(self, field: ProbeField) -> ProbeField:
        """``field``, of the same probes in the light of other lamps or another world, without the direct light of the panes."""
        return left_of(field, self.held)

    def irradiance(self, context: LightContext, points: np.ndarray, normals: np.ndarray, faces: np.ndarray,
                   index: int | np.ndarray) -> np.ndarray:
        """Irradiance (n, 3) float32 [W·m⁻²] of the panes at ``points`` with unit ``normals`` of triangles with ``faces`` (n, 3) on
        the side that is lit, with what stands in the way in ``context``: the sample number ``index``, or (n,) each its own, of a
        mean."""
        result = np.zeros((len(points), 3), np.float32)
        factors = self.panes.factors(points, normals)
        rows = np.flatnonzero(factors.max(axis=0, initial=0.0) > 0)
        if not rows.size:
            return result
        u = np.broadcast_to(sobol_owen_at(np.atleast_1d(index), 3, _SEED, shuffle=True), (len(points), 3))[rows]
        sample = self.panes.sample(points[rows], normals[rows], u.astype(np.float64), factors[:, rows])
        directions, faces, points = sample.direction.astype(np.float32), faces[rows], np.asarray(points, np.float32)
        weight = np.where((dot(faces, directions) > 0)[:, None], sample.weight, 0.0).astype(np.float32)
        lit = np.flatnonzero(largest(weight) > 0)
        directions, faces, distance = directions[lit], faces[lit], sample.distance[lit].astype(np.float32)
        targets = points[rows[lit]] + directions * distance[:, None]
        starts = offset_origins(points[rows[lit]], faces, directions)
        # Panes may be so close that the step off the surface is a share of the way that counts.
        towards = targets - starts
        distance = np.sqrt(dot(towards, towards))
        limits = short_of(distance, starts, targets)
        directions = towards / np.maximum(distance, np.finfo(np.float32).tiny)[:, None]
        result[rows[lit]] = weight[lit] * context.lamp_transmittance(False, starts, directions, limits)
        return result


class NearEmitter(NamedTuple):
    """An ``instance``'s surfaces of one ``material`` (indices): their panes, and what of their light falls close by [W]."""

    name: str
    instance: int
    material: int
    panes: Panes
    near: float


def near_light(context: LightContext, field: Field | None) -> NearLight | None:
    """What of the scene of ``context`` is lit better at each point than from the probes of ``field``; None where that is nothing,
    or not known: fields of other techniques, probes that were fitted to surfaces, or that do not capture all light, media, linked
    light. Kept with ``context``."""
    if field is None:
        return None
    known = context.kept.get("near_light")
    if known is None or known[0] is not field:
        known = context.kept["near_light"] = field, _near_light(context, field)
    return known[1]


def may_have_near_light(scene: Scene, field: Field | None) -> bool:
    """Whether ``near_light`` need be asked at all: a look at what is known without rays."""
    if type(field) is not ProbeField:
        return False
    volumes = (*scene.volumes, *(grid.volume for grid in field.grids()))
    if why_not(scene, volumes, any(grid.fitted for grid in field.grids())):
        return False
    even = np.flatnonzero([_is_even(material) for material in scene.materials])
    if not even.size:
        return False
    few = [0 < np.count_nonzero(np.isin(mesh.triangle_material, even)) for mesh in scene.meshes]
    return any(few[item.mesh] or item.material_override for item in scene.instances)


def why_not(scene: Scene, volumes: Sequence[ProbeVolume], fitted: bool) -> str:
    """Why nothing in ``scene`` is lit so beside probes of ``volumes`` that are ``fitted`` or not; "" where something may be."""
    if fitted:
        return "probes are fitted"
    if scene.media:
        return "the scene has media"
    if any(item.linking is not None for item in scene.instances):
        return "light is linked to objects"
    return "" if all(volume.captures_all for volume in volumes) else "a volume does not capture all light"


def _near_light(context: LightContext, field: Field) -> NearLight | None:
    if not may_have_near_light(context.scene, field):
        return None
    baked = context
    if baked_part(context.scene) is not context.scene:
        baked = LightContext(context.scene, context.threads)
    chosen = near_emitters(baked, [lookup.volume for lookup in field.lookups])
    if not chosen:
        return None
    panes = Panes(np.concatenate([item.panes.corners for item in chosen]), np.concatenate([item.panes.radiance for item in chosen]))
    held = tuple(_held(baked, grid, panes) for grid in field.grids())
    if not _is_held(field, held):
        return None
    return NearLight(panes, tuple(dict.fromkeys(item.name for item in chosen)), held, left_of(field, held))


def near_emitters(context: LightContext, volumes: Sequence[ProbeVolume]) -> list[NearEmitter]:
    """Emitters worth it beside probes of ``volumes``, finest cells first, by what they give close by, as many as MOST_PANES
    allows."""
    found = sorted((item for item in _emitters(context, volumes) if item.near >= WORTH * context.emitters.total_power),
                   key=lambda item: -item.near)
    kept, count = [], 0
    for item in found:
        if count + item.panes.count <= MOST_PANES:
            kept.append(item)
            count += item.panes.count
    return kept


def _emitters(context: LightContext, volumes: Sequence[ProbeVolume]) -> Iterator[NearEmitter]:
    geometry, surfaces, scene = context.geometry, context.surfaces, context.scene
    even = np.array([_is_even(material) for material in scene.materials], bool)
    emissive = np.flatnonzero((surfaces.emissive & even)[geometry.material] & (geometry.areas > 0)).astype(np.int32)
    owners, row = np.unique(np.stack([geometry.instance[emissive], geometry.material[emissive]]), axis=1, return_inverse=True)
    order = np.argsort(row.reshape(-1), kind="stable")
    ends, least = np.cumsum(np.bincount(row.reshape(-1), minlength=owners.shape[1])), WORTH * context.emitters.total_power
    # With the insides of solids: of many small emitters most need no closer look.
    most = np.bincount(row.reshape(-1), np.pi * geometry.areas[emissive] * _both_sides(context, emissive), owners.shape[1])
    for number in np.flatnonzero(most >= (1.0 - _ROUNDED) * least):
        (instance, material), first = owners[:, number], ends[number - 1] if number else 0
        item, primitive = scene.instances[instance], emissive[order[first:ends[number]]]
        if not (item.visible_diffuse and item.visible_shadow):
            continue
        if len(primitive) > MOST_TRIANGLES:
            continue
        panes = _panes(context, primitive)
        power = np.pi * float(panes.areas.sum(axis=1) @ luminance(panes.radiance))
        if not power >= max(least, _TINY):
            continue
        share = _near_share(context, panes, instance, spacings(volumes, panes.corners.mean(axis=(0, 1))[None])[0])
        if share >= NEAR_SHARE:
            yield NearEmitter(item.name, int(instance), int(material), panes, share * power)


def _both_sides(context: LightContext, primitive: np.ndarray) -> np.ndarray:
    """Luminance (t,) of what both sides of even triangles (t,) emit."""
    middle = np.full(len(primitive), np.float32(1 / 3))
    return sum(luminance(context.surfaces.emission_of_side(primitive, middle, middle, np.full(len(primitive), side, np.float32)))
               for side in (1.0, -1.0))


def _panes(context: LightContext, primitive: np.ndarray) -> Panes:
    """Both sides of the triangles ``primitive`` (t,), as far as they shine and are not within a solid."""
    geometry, surfaces = context.geometry, context.surfaces
    primitive = primitive.astype(np.int32)
    middle, closed = np.full(len(primitive), np.float32(1 / 3)), context.solids.is_solid(primitive)
    corners, radiance = [np.zeros((0, 4, 3))], [np.zeros((0, 3))]
    for side in (1.0, -1.0):
        emitted = surfaces.emission_of_side(primitive, middle, middle, np.full(len(primitive), side, np.float32))
        shining = (luminance(emitted) > 0) & ~(closed & (side < 0))
        if shining.any():
            rows = primitive[shining]
            corners.append(flat_faces(geometry.triangles_world[rows], side * geometry.normals_world[rows].astype(np.float64)))
            radiance.append(np.repeat(emitted[shining][:1].astype(np.float64), len(corners[-1]), axis=0))
    return Panes(np.concatenate(corners), np.concatenate(radiance))


def _near_share(context: LightContext, panes: Panes, instance: int, reach: float) -> float:
    """Share of what ``panes`` of ``instance`` emit that falls on others within ``reach`` [m]."""
    power = (panes.areas * luminance(panes.radiance)[:, None]).reshape(-1)
    u = sobol_owen(_RAYS, 5, _SHARE_SEED)
    chosen = np.minimum(np.searchsorted(np.cumsum(power) / power.sum(), u[:, 0], side="right"), len(power) - 1)
    a, b, c = np.moveaxis(panes.triangles.reshape(-1, 3, 3)[chosen], 1, 0)
    root = np.sqrt(u[:, 1:2])
    points = (a * (1.0 - root) + b * (root * (1.0 - u[:, 2:3])) + c * (root * u[:, 2:3])).astype(np.float32)
    normals = panes.normals[chosen // 2].astype(np.float32)
    directions = about(normals, cosine_hemisphere(u[:, 3:]))
    hits = context.tracer.intersect(offset_origins(points, normals, normals), directions)
    met = (hits.primitive >= 0) & (hits.t < reach)
    return float(np.mean(met & (context.geometry.instance[np.maximum(hits.primitive, 0)] != instance)))


def spacings(volumes: Sequence[ProbeVolume], places: np.ndarray) -> np.ndarray:
    """How far (n,) [m] probes are apart around ``places`` (n, 3): of the first of ``volumes``, finest cells first, that reaches
    there, else of the last."""
    result, reached = np.zeros(len(places)), np.zeros(len(places), bool)
    for volume in volumes:
        own = float(cell_size(volume.world_from_local, volume.nodes).max())
        result[~reached] = own
        reached |= box_distance(volume.world_from_local, places) <= own
    return result


def _is_even(material: Material) -> bool:
    """Whether the material shines everywhere alike, and lets nothing through."""
    sides = [side for side in (material, material.back) if side is not None]
    if not (material.is_emissive and material.is_opaque) or material.is_translucent or material.glass:
        return False
    return all(side.emission.is_constant and side.emission_by_angle is None for side in sides)


def left_of(field: ProbeField, held: tuple[np.ndarray, ...]) -> ProbeField:
    """``field`` without the SH ``held`` (p, k, 3) of each of its grids."""
    grids = []
    for grid, own in zip(field.grids(), held, strict=True):
        left = grid.sh.reshape(own.shape) - own
        # Noise of a probe that has hardly any other light.
        left = np.where(left[:, :1] > 0, left, 0.0)
        grids.append(replace(grid, sh=left.reshape(grid.sh.shape).astype(np.float32)))
    return ProbeField(grids, direct_lamps=field.direct_lamps, params=field.params, stats=field.stats, lookup=field.lookup)


def _held(context: LightContext, grid: ProbeGrid, panes: Panes) -> np.ndarray:
    """SH (p, k, 3) of the panes' direct light at the probes of ``grid``, 0 at those that are nowhere."""
    positions = (lattice_points(grid.volume.world_from_local, grid.volume.resolution) + grid.offset_world).reshape(-1, 3)
    rows = np.flatnonzero(grid.counts.ravel() & (grid.validity.ravel() > 0))
    held = np.zeros((len(positions), *grid.sh.shape[3:]))
    held[rows] = direct_coefficients(context, panes, positions[rows], grid.order)
    return held


def _is_held(field: ProbeField, held: tuple[np.ndarray, ...]) -> bool:
    """Whether that much light is in the probes of ``field``: they may have been baked while surfaces shone otherwise."""
    taken = beyond = 0.0
    for grid, own in zip(field.grids(), held, strict=True):
        measured = np.flatnonzero(grid.in_the_open.ravel())
        mean, stored = own[measured, 0], grid.sh.reshape(own.shape)[measured, 0]
        taken += float(mean.sum())
        beyond += float(np.maximum(mean - stored, 0.0).sum())
    return beyond <= _STALE * taken


def direct_coefficients(context: LightContext, panes: Panes, positions: np.ndarray, order: int) -> np.ndarray:
    """SH (n, (order + 1)², 3) of the radiance that arrives at ``positions`` (n, 3) from ``panes``, past what stands in the way."""
    triangles, areas = panes.triangles.reshape(-1, 3, 3), panes.areas.reshape(-1)
    radiance, normals = np.repeat(panes.radiance, 2, axis=0), np.repeat(panes.normals, 2, axis=0)

    def work(which: int) -> np.ndarray:
        points = positions[parts[which]]
        result = np.zeros((len(points), sh.coefficient_count(order), 3))
        for number in np.flatnonzero(areas > 0):
            front = np.flatnonzero(dot(points - triangles[number, 0], normals[number]) > 0)
            side = np.linalg.norm(triangles[number] - np.roll(triangles[number], 1, axis=0), axis=1).max()
            far = np.linalg.norm(triangles[number].mean(axis=0) - points[front], axis=1) > _FAR * side
            for count, rows in ((_SAMPLES, front[~far]), (_FEW, front[far])):
                if rows.size:
                    result[rows] += _samples(context, triangles[number], areas[number], points[rows], count, order,
                                             hash_u32(parts[which].start + rows, number, _PROBE_SEED)) * radiance[number]
        return result

    parts = chunks(len(positions), _PAIRS // _SAMPLES)
    return np.concatenate([np.zeros((0, sh.coefficient_count(order), 3)), *parallel_for(work, len(parts), context.threads)])


def _samples(context: LightContext, triangle: np.ndarray, area: float, points: np.ndarray, count: int, order: int,
             seeds: np.ndarray) -> np.ndarray:
    """SH (n, k, 1) or (n, k, 3) of a triangle of radiance 1 at ``points`` (n, 3), by ``count`` samples."""
    shift = unit_interval(np.stack([hash_u32(seeds, axis) for axis in range(2)], axis=1))
    u = wrapped(sobol_owen(count, 2, _PROBE_SEED)[None] + shift[:, None]).reshape(-1, 2).astype(np.float64)
    starts = np.repeat(points, count, axis=0)
    direction, distance, weight = sample_triangle(triangle - starts[:, None], np.full(len(starts), area), u)
    direction, starts = direction.astype(np.float32), starts.astype(np.float32)
    limits = short_of(distance.astype(np.float32), starts, starts + direction * distance[:, None]).astype(np.float32)
    left = context.tracer.transmittance(starts, direction, limits) * (weight / count)[:, None]
    basis = sh.evaluate_rows(direction, order)
    return np.einsum("nsk,nsc->nkc", basis.reshape(len(points), count, -1), left.reshape(len(points), count, -1))
