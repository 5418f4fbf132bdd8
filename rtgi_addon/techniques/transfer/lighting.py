"""The light that probes are to be relit by, and what of it goes which way.

A sky is taken apart: its first bands go by the exact matrices, and what is left of it, residue and hot spots alike, as suns from
the table's directions, which share it among them as they share a sun. SH of a sky with a sun in it would be the worst of all ways
(docs/techniques/transfer.md).
"""

from dataclasses import dataclass, field, replace

import numpy as np

from ...numerics import dome, sh
from ...scene import World
from ...transport.lights.world_sh import texel_directions, world_sh
from .data import Transfer

# Texels that are looked at at a time, and the most rows of a map that a bundle keeps of the world.
_TEXELS, WORLD_ROWS = 1 << 17, 128


@dataclass(frozen=True, eq=False)
class Sky:
    """A world as transfer takes it: SH ``coefficients`` (S, 3) of its radiance, and what those leave as irradiances ``suns`` (K, 3)
    [W·m⁻²] from the directions of suns."""

    coefficients: np.ndarray
    suns: np.ndarray


@dataclass(frozen=True, eq=False)
class DistantSun:
    """A sun in the direction ``towards`` (3,), unit, of ``irradiance`` (3,) on a facing plane [W·m⁻²]."""

    towards: np.ndarray
    irradiance: np.ndarray


@dataclass(frozen=True, eq=False)
class NewLamp:
    """A lamp that no bake knows: a point at ``position`` (3,) of ``watts`` (3,)."""

    position: np.ndarray
    watts: np.ndarray


@dataclass(frozen=True, eq=False)
class Lighting:
    """Other light; what is not given stays as it was baked. ``world`` replaces the world; ``suns`` (None: the file's) those of the
    file; ``groups`` are factors (3,) by the names of groups; ``lamps`` come on top."""

    world: World | None = None
    suns: tuple[DistantSun, ...] | None = None
    groups: dict[str, np.ndarray] = field(default_factory=dict)
    lamps: tuple[NewLamp, ...] = ()


def sky_of(world: World, transfer: Transfer) -> Sky:
    """``world`` as ``transfer`` takes it."""
    coefficients, nodes = world_sh(world, transfer.sky_order), len(transfer.sun_directions)
    suns = np.zeros((nodes, 3))
    pixels = np.asarray(world.equirect, np.float64)
    if not np.all(pixels == pixels[:1, :1]):
        directions, solid_angles = texel_directions(world)
        flat = pixels.reshape(-1, 3)
        for start in range(0, len(flat), _TEXELS):
            part = slice(start, start + _TEXELS)
            left = (flat[part] - sh.evaluate(directions[part], transfer.sky_order) @ coefficients) * solid_angles[part, None]
            index, share = dome.weights(directions[part], transfer.sun_side, transfer.sun_below)
            for channel in range(3):
                suns[:, channel] += np.bincount(index.ravel(), (share * left[:, channel:channel + 1]).ravel(), nodes)
    return Sky(coefficients.astype(np.float32), suns.astype(np.float32))


def turned(world: World, degrees: float) -> World:
    """``world`` turned about +Z, counterclockwise as seen from above."""
    angle = np.radians(degrees)
    cosine, sine = np.cos(angle), np.sin(angle)
    back = np.array([[cosine, sine, 0.0], [-sine, cosine, 0.0], [0.0, 0.0, 1.0]])
    return replace(world, map_from_world=np.asarray(world.map_from_world, np.float64) @ back)


def sun_from(azimuth: float, elevation: float, irradiance) -> DistantSun:
    """A sun at ``azimuth`` degrees from +Y (north) towards +X (east) and ``elevation`` degrees above the horizon."""
    a, e = np.radians(azimuth), np.radians(elevation)
    return DistantSun(np.array([np.sin(a) * np.cos(e), np.cos(a) * np.cos(e), np.sin(e)]),
                      np.broadcast_to(np.asarray(irradiance, np.float64), (3,)))


def coarse(world: World, rows: int = WORLD_ROWS) -> World:
    """``world`` with a map of no more than ``rows`` rows and twice as many columns, texels the mean of those they replace by solid
    angle: no light is lost."""
    pixels = np.asarray(world.equirect, np.float64)
    height, width = pixels.shape[:2]
    down, across = -(-height // rows), -(-width // (2 * rows))
    if down == across == 1 or height % down or width % across:
        down, across = _divisor(height, down), _divisor(width, across)
    if down == across == 1:
        return world
    edges = np.sin((np.arange(height + 1) / height - 0.5) * np.pi)
    weight = np.diff(edges)[:, None, None]
    sums = (pixels * weight).reshape(height // down, down, width // across, across, 3).sum(axis=(1, 3))
    total = across * weight.reshape(height // down, down).sum(axis=1)[:, None, None]
    return replace(world, equirect=(sums / total).astype(np.float32))


def _divisor(count: int, least: int) -> int:
    """The smallest divisor of ``count`` that is at least ``least``."""
    return next(step for step in range(least, count + 1) if count % step == 0)
