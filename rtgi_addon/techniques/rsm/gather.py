"""The gather: irradiance, or SH of radiance, at receivers from the texels of reflective shadow maps.

Source: C. Dachsbacher and M. Stamminger, "Reflective Shadow Maps", I3D 2005, eq. 1 and section 3.2. A texel p of flux Φ gives

    E = Φ/π · ⟨n_p, x − x_p⟩₊ · ⟨n, x_p − x⟩₊ / (|x − x_p|² · (|x − x_p|² + A/π))

which is the paper's eq. 1 with the 1/π that it leaves out, and with the texel taken as a disk of its area A: irradiance then never
exceeds the texel's exitance Φ/A, where the paper's point has a pole.

Sampling: the paper's disk lies around the receiver's projection into the map, at radius R·ξ₁ with weight ξ₁². That weight belongs
to the density 1/ξ₁², while its radii have 1/ξ₁, so its sum is biased towards far texels. Here the radius is R·ξ₁^(3/2): its density
over the map is 1/(3πR²ξ₁²), and weights proportional to ξ₁² are then exact. The other samples follow the texels' flux over the
whole map, and both are weighted by the balance heuristic (Veach and Guibas 1995), so that the mean is the sum over all texels; with
no such samples what lies outside the disk is lost, as in the paper. One low-discrepancy pattern serves all, shifted on the torus
for each receiver (Cranley and Patterson 1976), which turns the disk and shuffles its radii.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...numerics import sh
from ...numerics.sampling import hash_u32, r2, unit_interval, wrapped
from ...progress import Progress
from ...transport.parallel import CHUNK, chunks, parallel_for
from ...transport.rays.tracer import attenuate, offset_origins, short_of
from ...transport.vectors import dot, luminance
from ...transport.views.reflective_shadow_map import ReflectiveShadowMap

# Columns of a texel's row, of COLUMNS.
POSITION, NORMAL, FLUX, AREA, DENSITY, COLUMNS = slice(0, 3), slice(3, 6), slice(6, 9), 9, 10, 12
# Receivers × texels held at once: their temporaries stay in cache.
PAIRS = CHUNK
# What is added to the pattern's seed for the samples that follow the flux.
_BY_FLUX = 1
# Flux is quantized to integers of this many bits in all, so that float32 finds the very texel that the density belongs to.
FLUX_BITS = 24
# A texel seen at a slant reaches far; as a disk it is taken to be at most this many times as large as one seen head-on.
MAX_SLANT = 10.0
# Of a lamp's samples this share goes to its maps alike (one may lie right beside a receiver), the rest by flux; no map gets fewer
# than so many.
EVEN_SHARE, MIN_SAMPLES = 0.5, 4


@dataclass(frozen=True)
class Pattern:
    """How receivers choose texels: ``samples`` a lamp, ``disk_share`` of them within ``disk_radius`` [sides of the map]."""

    samples: int = 400
    disk_radius: float = 0.3
    disk_share: float = 0.4
    seed: int = 0


class GatherMap:
    """A reflective shadow map as rows that a gather reads, with the density by which it samples them.

    ``rows`` (texels, 12) float32: POSITION, NORMAL, FLUX/π, AREA/π, DENSITY over the unit square of samples that follow the flux,
    and 0. ``cumulative`` (texels,) int64: running sum of the quantized flux, row by row; ``samples`` is this
    map's part of its lamp's, which come after the ``first`` ones of the maps before it.
    """

    def __init__(self, shadow_map: ReflectiveShadowMap, samples: int, first: int = 0):
        self.map, self.samples, self._first = shadow_map, samples, first
        self.view = shadow_map.view
        flux = shadow_map.flux.reshape(-1, 3)
        self.rows = np.zeros((len(flux), COLUMNS), np.float32)
        self.rows[:, POSITION] = shadow_map.position.reshape(-1, 3)
        self.rows[:, NORMAL] = shadow_map.normal.reshape(-1, 3)
        self.rows[:, FLUX] = flux * np.float32(1.0 / np.pi)
        self.rows[:, AREA] = self._areas() * np.float32(1.0 / np.pi)
        strength = luminance(flux).astype(np.float64)
        lit = strength > 0
        quantized = np.where(lit, np.floor(strength / strength.sum() * (2**FLUX_BITS - lit.sum())) + 1, 0).astype(np.int64)
        self.cumulative = np.cumsum(quantized)
        self.rows[:, DENSITY] = quantized * (len(flux) / self.cumulative[-1])

    @cached_property
    def lit(self) -> np.ndarray:
        """The rows whose flux is not zero."""
        return self.rows[np.any(self.rows[:, FLUX] > 0, axis=1)]

    def places(self, pattern: Pattern) -> tuple[np.ndarray, np.ndarray]:
        """This map's points of the pattern (see ``places``)."""
        return places(pattern, self.samples, self._first)

    def centres(self, points: np.ndarray) -> np.ndarray:
        """Where receivers (n, 3) project into the unit square (n, 2) float32: the nearest point of it for those outside."""
        return np.clip(self.view.project(points)[0], 0.0, 1.0).astype(np.float32)

    def by_flux(self, across: np.ndarray, up: np.ndarray) -> tuple[np.ndarray, tuple[np.ndarray, np.ndarray]]:
        """Texels (n, s) that follow the flux, and places within them, x and y (n, s) float32 in the unit square.

        ``up`` (n, s) chooses a row by what it holds, ``across`` a texel of it: the points' evenness in two dimensions is kept.
        """
        size, last = self.view.resolution, self.cumulative[self.view.resolution - 1::self.view.resolution]
        target = up.astype(np.float64) * last[-1]
        row = np.searchsorted(last, target, side="right")
        low = np.where(row > 0, last[row - 1], 0)
        total = last[row] - low
        y = row + (target - low) / total
        target = low + across.astype(np.float64) * total
        index = np.searchsorted(self.cumulative, target, side="right")
        low = np.where(index > 0, self.cumulative[index - 1], 0)
        x = index - row * size + (target - low) / (self.cumulative[index] - low)
        return index, ((x / size).astype(np.float32), (y / size).astype(np.float32))

    def _areas(self) -> np.ndarray:
        """Surface (texels,) [m²] that each texel covers."""
        offset = self.rows[:, POSITION].astype(np.float64) - self.view.position_world
        measure = self.view.texel_measure().ravel()
        head_on = measure if self.view.orthographic else measure * np.sum(offset**2, axis=1)
        cosine = np.abs(np.sum(self.view.directions() * self.rows[:, NORMAL], axis=1))
        return head_on / np.maximum(cosine, 1.0 / MAX_SLANT)


def places(pattern: Pattern, samples: int, first: int) -> tuple[np.ndarray, np.ndarray]:
    """A map's points (s, 2) float32 of the pattern in [0, 1)² before they are turned: for the disk, and for what follows the flux.

    A lamp's maps take turns with one sequence, so that maps that see the same do not read the same texels: ``first`` is how many
    the others before it have taken.
    """
    in_disk = round(samples * pattern.disk_share)
    return r2(in_disk, pattern.seed, first), r2(samples - in_disk, pattern.seed + _BY_FLUX, first)


def shared_samples(strength: np.ndarray, lamp: np.ndarray, samples: int,
                   least: int = MIN_SAMPLES) -> tuple[list[int], list[int]]:
    """How many of each lamp's ``samples`` its maps of ``strength`` (n,), indexed by ``lamp`` (n,), take, ``least`` or more each,
    and how many those before them have taken."""
    if not len(strength):
        return [], []
    share = EVEN_SHARE / np.maximum(np.bincount(lamp)[lamp], 1) + (1.0 - EVEN_SHARE) * strength / np.bincount(lamp, strength)[lamp]
    counts = [max(least, round(samples * of_map)) for of_map in share]
    before = [sum(count for other, count in zip(lamp[:i], counts, strict=False) if other == same) for i, same in enumerate(lamp)]
    return counts, before


def prepare(maps: tuple[ReflectiveShadowMap, ...], samples: int,
            least: int = MIN_SAMPLES) -> tuple[GatherMap, ...]:
    """Maps ready to be gathered from, each with its part of the ``samples`` of its lamp, ``least`` or more. Those without flux are
    left out."""
    strength = np.array([float(luminance(item.total_flux)) for item in maps])
    maps, strength = [item for item, flux in zip(maps, strength, strict=True) if flux > 0], strength[strength > 0]
    counts, before = shared_samples(strength, np.array([item.view.lamp for item in maps], np.intp), samples, least)
    return tuple(GatherMap(*each) for each in zip(maps, counts, before, strict=True))


def gather(maps: tuple[GatherMap, ...], points: np.ndarray, normals: np.ndarray, pattern: Pattern, *, tracer=None,
           threads: int | None = None) -> np.ndarray:
    """Irradiance (n, 3) float32 [W·m⁻²] at ``points`` (n, 3) with unit ``normals`` (n, 3) from sampled texels.

    Without a ``tracer`` nothing is in the way, as in the paper; with one a shadow ray decides for every sample.
    """
    def estimate(rows):
        return sum(_irradiance(*_sample(item, points[rows], pattern), points[rows], normals[rows], tracer) for item in maps)

    points, normals = (np.ascontiguousarray(part, np.float32) for part in (points, normals))
    return _over_receivers(estimate, maps, len(points), 1, max((item.samples for item in maps), default=1), threads)[:, 0]


def gather_sh(maps: tuple[GatherMap, ...], points: np.ndarray, order: int, pattern: Pattern, *, tracer=None,
              threads: int | None = None, progress: Progress | None = None) -> np.ndarray:
    """SH coefficients (n, (order + 1)², 3) float32 of the radiance that arrives at free ``points`` (n, 3) from sampled texels.

    ``progress`` is asked for the wish to stop only: raises Cancelled.
    """
    def estimate(rows):
        return sum(_projection(*_sample(item, points[rows], pattern), points[rows], order, tracer) for item in maps)

    points = np.ascontiguousarray(points, np.float32)
    most = max((item.samples for item in maps), default=1)
    return _over_receivers(estimate, maps, len(points), sh.coefficient_count(order), most, threads, progress)


def gather_every_texel(maps: tuple[GatherMap, ...], points: np.ndarray, normals: np.ndarray | None, *, order: int = 0,
                       tracer=None, threads: int | None = None, progress: Progress | None = None) -> np.ndarray:
    """The sum that ``gather`` estimates, over all texels: (n, 3), or without ``normals`` the one of ``gather_sh``.

    ``progress`` is asked for the wish to stop only: raises Cancelled.
    """
    def estimate(rows):
        total = 0
        for item in maps:
            for span in chunks(len(item.lit), PAIRS):
                texels = item.lit[span][None]
                weight = np.ones((1, texels.shape[1]), np.float32)
                total = total + (_projection(texels, weight, points[rows], order, tracer) if normals is None
                                 else _irradiance(texels, weight, points[rows], normals[rows], tracer))
        return total

    points = np.ascontiguousarray(points, np.float32)
    width = 1
    if normals is None:
        width = sh.coefficient_count(order)
    else:
        normals = np.ascontiguousarray(normals, np.float32)
    most = min(max((len(item.lit) for item in maps), default=1), PAIRS)
    result = _over_receivers(estimate, maps, len(points), width, most, threads, progress)
    return result if normals is None else result[:, 0]


def rotations(points: np.ndarray, seed: int) -> np.ndarray:
    """The shift (n, 2) float32 in [0, 1) of the pattern at each of ``points`` (n, 3) float32: a hash of the seed and position."""
    # Adding zero makes −0 the same place as 0.
    bits = (np.ascontiguousarray(points, np.float32) + np.float32(0.0)).view(np.uint32)
    state = hash_u32(seed, bits[:, 0], bits[:, 1], bits[:, 2])
    return unit_interval(np.stack([hash_u32(state, d) for d in range(2)], axis=-1))


def _over_receivers(estimate, maps, count: int, width: int, pairs: int, threads, progress: Progress | None = None) -> np.ndarray:
    def work(i):
        if progress is not None:
            progress.check()
        return estimate(spans[i])

    result = np.zeros((count, width, 3), np.float32)
    if not maps:
        return result
    spans = chunks(count, max(1, PAIRS // pairs))
    for span, part in zip(spans, parallel_for(work, len(spans), threads), strict=True):
        result[span] = part
    return result


def _sample(item: GatherMap, points: np.ndarray, pattern: Pattern) -> tuple[np.ndarray, np.ndarray]:
    """Texels (n, s, 12) for receivers (n, 3), and how many texels each sample stands for (n, s)."""
    size, radius = item.view.resolution, np.float32(pattern.disk_radius)
    disk_xi, flux_xi = item.places(pattern)
    in_disk, by_flux = len(disk_xi), len(flux_xi)
    centre, shift = item.centres(points), rotations(points, pattern.seed)
    places, indices = [], []
    if in_disk:
        xi = _turned(disk_xi, shift)
        angle, reach = xi[1] * np.float32(2.0 * np.pi), radius * xi[0] * np.sqrt(xi[0])
        place = centre[:, :1] + reach * np.cos(angle), centre[:, 1:] + reach * np.sin(angle)
        column, row = (np.floor(coordinate * size).astype(np.int32) for coordinate in place)
        # Negative numbers are large as unsigned ones.
        inside = (column.view(np.uint32) < size) & (row.view(np.uint32) < size)
        places.append(place)
        indices.append(np.where(inside, row * size + column, -1))
    if by_flux:
        index, place = item.by_flux(*_turned(flux_xi, shift))
        places.append(place)
        indices.append(index)
    index = np.concatenate(indices, axis=1)
    across, up = (np.concatenate(parts, axis=1) - middle for parts, middle in zip(zip(*places, strict=True), np.hsplit(centre, 2),
                                                                                strict=True))
    texels = np.take(item.rows, np.maximum(index, 0), axis=0)
    squared = (across * across + up * up) / (radius * radius)
    disk = (squared < 1) * np.maximum(squared, np.float32(1e-12)) ** np.float32(-2.0 / 3.0)
    density = disk * np.float32(in_disk / (3.0 * np.pi * pattern.disk_radius**2)) + texels[..., DENSITY] * np.float32(by_flux)
    return texels, ((index >= 0) & (density > 0)) * (np.float32(size * size) / np.maximum(density, np.float32(1e-30)))


def _turned(places: np.ndarray, shift: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Both coordinates (n, s) of the pattern's points (s, 2) after each receiver's ``shift`` (n, 2) on the torus."""
    return tuple(wrapped(places[None, :, axis] + shift[:, axis, None]) for axis in range(2))


def _arrival(texels, points):
    """Unit directions (n, s, 3) from receivers (n, 3) to ``texels`` (n or 1, s, 12), distances (n, s), and irradiance (n, s) on a
    facing plane per flux/π."""
    towards = texels[..., POSITION] - points[:, None]
    squared = dot(towards, towards)
    distance = np.sqrt(np.maximum(squared, np.finfo(np.float32).tiny))
    direction = towards / distance[..., None]
    leaving = -dot(texels[..., NORMAL], direction)
    # A texel right at the receiver, or one with nothing in it, has no area to be regular by.
    return direction, distance, np.maximum(leaving, 0.0) / np.maximum(squared + texels[..., AREA], np.float32(1e-20))


def _irradiance(texels, weight, points, normals, tracer) -> np.ndarray:
    """(n, 1, 3) from ``texels`` (n or 1, s, 12), each counted ``weight`` times."""
    direction, distance, strength = _arrival(texels, points)
    cosine = dot(normals[:, None], direction)
    strength = strength * np.maximum(cosine, 0.0) * weight
    tint = None
    if tracer is not None:
        tint = _shadow(strength, texels, offset_origins(points, normals, normals), direction, distance, tracer)
    flux = texels[..., FLUX] if tint is None else texels[..., FLUX] * tint
    return np.stack([(strength * flux[..., channel]).sum(axis=1) for channel in range(3)], axis=-1)[:, None]


def _projection(texels, weight, points, order, tracer) -> np.ndarray:
    """(n, (order + 1)², 3): radiance from ``texels`` (n or 1, s, 12) as SH, each counted ``weight`` times."""
    direction, distance, strength = _arrival(texels, points)
    strength = strength * weight
    tint = None
    if tracer is not None:
        tint = _shadow(strength, texels, points, direction, distance, tracer)
    basis = sh.evaluate(direction, order)
    coloured = strength[..., None] * texels[..., FLUX]
    return np.matmul(basis.swapaxes(1, 2), coloured if tint is None else coloured * tint)


def _shadow(strength, texels, origins, direction, distance, tracer) -> np.ndarray | None:
    """Multiply ``strength`` (n, s) by what passes between receivers and texels; where that is coloured, return it (n, s, 3)."""
    receiver, sample = np.nonzero(strength > 0)
    origins, direction = origins[receiver], direction[receiver, sample]
    targets = texels[receiver if len(texels) > 1 else 0, sample, POSITION]
    passed = tracer.transmittance(origins, direction, short_of(distance[receiver, sample], origins, targets))
    return attenuate(strength, (receiver, sample), passed)
