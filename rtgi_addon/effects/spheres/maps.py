"""What sphere probes saw, and how it is read: by direction, by roughness, corrected for where on its way a ray meets what was seen.

A map of resolution R has levels k = 0, 1, … whose texels are radiance averaged by the GGX lobe of α = 2^(k + 1)/R, down to α = 1;
level 0 is as it was seen. Between levels, log₂ α is interpolated. Probes about a point are laid over one another, the smallest
first: each takes the share of what is left that its falloff gives it, as EEVEE chooses among them
(`eevee_lightprobe_sphere_eval_lib.glsl`), but by weights instead of chance. What they all leave is for the caller: shares are
weights, and never added to.

Parallax: K. Behc, "Box Projected Cubemap Environment Mapping", 2010; of a lobe that meets the volume at another distance from the
probe than from the surface, the width changes by the ratio of the two (S. Lagarde and C. de Rousiers, "Moving Frostbite to
Physically Based Rendering", SIGGRAPH 2014, §4.9). ``shaders/include/sphere_probes.glsl`` is the same on GPUs.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...numerics import octahedral
from ...numerics.grid import transform_points
from ...scene.sphere_probe import BOX, SphereProbe

# Levels have no fewer texels along a side.
LEAST_SIDE = 32
# A ray of a glossy lobe that is drawn by chance reads the map with this share of the lobe's α: the mean over many is 3 % wider than
# the lobe, and far less noisy than points of a sharp map.
RAY_SHARE = 0.25
# Falloffs are no steeper, as in EEVEE.
LEAST_FALLOFF = 1e-8
_TINY = 1e-12


def level_sides(resolution: int) -> list[int]:
    """Texels along a side of every level of maps of ``resolution``, a power of two."""
    return [max(resolution >> max(level - 2, min(level, 1)), LEAST_SIDE) for level in range(int(resolution).bit_length() - 1)]


def level_alpha(resolution: int, level: int) -> float:
    """α of the lobe that ``level`` is averaged by."""
    return 2.0**(level + 1) / resolution


@dataclass(frozen=True, eq=False)
class SphereMap:
    """What ``probe`` saw: ``levels`` (side, side, 3) float16 of radiance [W·sr⁻¹·m⁻²], octahedral, world axes (numerics.octahedral:
    row = y of the map)."""

    probe: SphereProbe
    levels: tuple[np.ndarray, ...]

    @property
    def resolution(self) -> int:
        """Texels along a side of level 0."""
        return len(self.levels[0])


class SphereProbes:
    """The sphere probes of a bake, all of one resolution. ``light`` is a hash of the lamps and the world that they were baked with
    ("": not known), by which they are known to be out of date."""

    def __init__(self, maps: Iterable[SphereMap], light: str = ""):
        maps = tuple(sorted(maps, key=lambda item: item.probe.extent))
        if len({item.resolution for item in maps}) > 1:
            raise ValueError("sphere probes of one bake have one resolution")
        self.maps, self.light = maps, light

    @property
    def resolution(self) -> int:
        """Texels along a side of their level 0."""
        return self.maps[0].resolution if self.maps else 0

    @cached_property
    def stacks(self) -> list[np.ndarray]:
        """Of each probe all levels one below the other, with octahedral borders: (rows, R + 2, 3) float16, the rest 0."""
        stacks = []
        for item in self.maps:
            stack = np.zeros((sum(len(level) + 2 for level in item.levels), self.resolution + 2, 3), np.float16)
            row = 0
            for level in item.levels:
                bordered = octahedral.add_border(level)
                stack[row:row + len(bordered), :len(bordered)] = bordered
                row += len(bordered)
            stacks.append(stack)
        return stacks

    def radiance(self, points: np.ndarray, directions: np.ndarray, alpha: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Radiance (n, 3) float32 that comes to world ``points`` from unit ``directions`` (n, 3), averaged by lobes of ``alpha``
        (n,), times the share (n,) float32 that the probes know of it: the caller adds 1 − share of what it falls back on."""
        points, directions = np.asarray(points, np.float64), np.asarray(directions, np.float64)
        alpha = np.broadcast_to(np.asarray(alpha, np.float64), len(points))
        total, left = np.zeros((len(points), 3)), np.ones(len(points))
        for number, item in enumerate(self.maps):
            share = left * influence(item.probe, points)
            rows = np.flatnonzero(share > 0)
            if rows.size:
                towards, width = parallax(item.probe, points[rows], directions[rows], alpha[rows])
                total[rows] += share[rows, None] * self._read(number, towards, width)
                left[rows] -= share[rows]
        return total.astype(np.float32), (1.0 - left).astype(np.float32)

    def seen(self, number: int, directions: np.ndarray) -> np.ndarray:
        """(n, 3): what the probe saw in ``directions`` (n, 3) from its centre, as it is held."""
        return self._level(number, np.zeros(len(directions), np.int64), np.asarray(directions, np.float64))

    def _read(self, number: int, directions: np.ndarray, alpha: np.ndarray) -> np.ndarray:
        """(n, 3): the map of a probe in ``directions`` (n, 3), between its two levels nearest to ``alpha`` (n,)."""
        sides = level_sides(self.resolution)
        level = np.clip(np.log2(np.maximum(alpha, _TINY) * (0.5 * self.resolution)), 0.0, len(sides) - 1.0)
        low = np.minimum(level.astype(np.int64), len(sides) - 2)
        part = (level - low)[:, None]
        return self._level(number, low, directions) * (1.0 - part) + self._level(number, low + 1, directions) * part

    def _level(self, number: int, level: np.ndarray, directions: np.ndarray) -> np.ndarray:
        result, stack, row = np.zeros((len(level), 3)), self.stacks[number], 0
        for index, side in enumerate(level_sides(self.resolution)):
            rows = np.flatnonzero(level == index)
            tile = stack[row:row + side + 2, :side + 2].astype(np.float64).reshape(-1, 3)
            row += side + 2
            if not rows.size:
                continue
            first, f = octahedral.bilinear(directions[rows], side)
            x, y = f[:, :1], f[:, 1:]
            below = tile[first] * (1 - x) + tile[first + 1] * x
            above = tile[first + side + 2] * (1 - x) + tile[first + side + 3] * x
            result[rows] = below * (1 - y) + above * y
        return result


def influence(probe: SphereProbe, points: np.ndarray) -> np.ndarray:
    """Share (n,) in [0, 1] of ``probe`` at world ``points`` (n, 3): 1 inside, falling to 0 at the border of its influence."""
    unit = transform_points(probe.unit_from_world, points)
    reach = np.abs(unit).max(axis=1) if probe.influence_shape == BOX else np.sqrt(np.sum(unit * unit, axis=1))
    return np.clip((1.0 - reach) / max(probe.falloff, LEAST_FALLOFF), 0.0, 1.0)


def parallax(probe: SphereProbe, points: np.ndarray, directions: np.ndarray, alpha: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Directions (n, 3), not of unit length, from the centre of ``probe`` to where rays from ``points`` along unit ``directions``
    (n, 3) leave its parallax volume, and how wide (n,) lobes of ``alpha`` (n,) are seen from there. Rays that never meet it come
    from infinitely far."""
    matrix = probe.parallax_from_world
    start, along = transform_points(matrix, points), directions @ matrix[:3, :3].T
    if probe.parallax_shape == BOX:
        with np.errstate(divide="ignore", invalid="ignore"):
            inverse = np.where(along != 0, 1.0 / along, np.inf)
            ends = np.stack([(-1.0 - start) * inverse, (1.0 - start) * inverse])
        # A ray along a pair of faces is between them or never in the box.
        beside = (along == 0) & (np.abs(start) > 1)
        near = np.where(along == 0, -np.inf, ends.min(axis=0)).max(axis=1)
        reach = np.where(along == 0, np.inf, ends.max(axis=0)).min(axis=1)
        met = (near <= reach) & (reach > 0) & ~beside.any(axis=1)
    else:
        a, b = np.sum(along * along, axis=1), np.sum(start * along, axis=1)
        root = b * b - a * (np.sum(start * start, axis=1) - 1.0)
        reach = (-b + np.sqrt(np.maximum(root, 0.0))) / a
        met = (root > 0) & (reach > 0)
    reach = np.where(met, reach, 1.0)
    towards = np.where(met[:, None], points + directions * reach[:, None] - probe.centre_world, directions)
    away = np.sqrt(np.sum(towards * towards, axis=1))
    # The centre itself is met by rays alone that leave a volume of no thickness.
    towards = np.where((away > _TINY)[:, None], towards, directions)
    width = np.where(met, alpha * np.minimum(reach / np.maximum(away, _TINY), 1.0 / _TINY), alpha)
    return towards, np.clip(width, 0.0, 1.0)
