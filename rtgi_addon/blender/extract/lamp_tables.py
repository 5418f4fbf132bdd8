"""A lamp's nodes as tables, evaluated by Cycles: over directions, places on the lamp and distances, as ``scene.LampProfile`` has
them.

Each is measured where the others stand still, so that their product is the lamp wherever its nodes do not mix what they look at.
Whether it is that is tried on the lamp as it is, near and far.
"""

from dataclasses import dataclass, replace

import numpy as np

from ...numerics.sampling import r2, sobol_owen
from ...scene import LampProfile, Light
from ...scene.lamp_profile import FARTHEST, NEAREST, directions, from_angles, solid_angles
from ...transport.lights.lamps import LampTable
from ...transport.vectors import dot, luminance
from .lamp_rig import LampRig, LampSource, ratio_of
from .small_renders import small_scene

# Cells of the tables, and samples of each.
_ROWS, _COLUMNS, _SAMPLES = 256, 256, 8
# What a first look has, which tells whether a table is worth it.
_LOOK_SIDE, _LOOK_SAMPLES = 128, 2
_PLACES, _DISTANCES, _DISTANCE_SAMPLES = 256, 1024, 16
# An area lamp's middle is sampled with all of its texture: so many times as many samples, and a mean over so many distances.
_MORE, _SMOOTHED = 16, 5
# Distances [m] at which a lamp is looked at: the first at which it shines.
_REACHES = (1.0, 0.1, 10.0, 0.01, 100.0)
# What varies by less than this is constant; over distances, which are seen along directions that differ a little, by less than
# the second.
_EVEN, _EVEN_FAR = 2e-3, 1e-2
# Rows, columns, samples and our own samples of a try, which averages blocks of so many texels.
_TRIED, _TRY_SAMPLES, _OWN_SAMPLES, _BLOCK = (16, 32), 64, 256, 4
# How far from a lamp it is tried, in its own sizes.
_NEAR, _FAR = 3.0, 15.0


@dataclass(frozen=True, eq=False)
class Measured:
    """``factor`` (3,) on a lamp's strength, ``profile`` (None: it shines alike), and ``error``, the share of its light by which
    their product is off where its nodes mix what they look at."""

    factor: np.ndarray
    profile: LampProfile | None = None
    error: float = 0.0


def measure(source: LampSource, plain: Light) -> Measured:
    """What the nodes of ``source`` make of ``plain``, which is the lamp of POWER and of no nodes. Raises BakeError where Cycles
    cannot render."""
    with small_scene("rtgi lamp", f"the nodes of lamp {source.name!r}") as (scene, made):
        rig = LampRig(scene, made, source)
        if source.kind == "SUN":
            # What it sends is the same everywhere.
            return _as_one(rig, 1.0)
        found = _area(rig) if source.kind == "AREA" else _point(rig)
        if found.factor.any():
            # What is constant in the middle may not be all over the lamp.
            return _tried(rig, plain, found) if found.profile is not None or _size(plain) > 0.0 else found
        return _as_one(rig, _FAR * max(_size(plain), 0.2))


def _as_one(rig: LampRig, radius: float) -> Measured:
    """The mean over all that a lamp as large as it is sends to a sphere of ``radius`` [m] around it."""
    node, plain = rig.shell(radius, *_TRIED, np.pi, _TRY_SAMPLES, whole=True)
    factor = _mean(node, plain)
    return Measured(factor, error=min(_off(node, plain * factor), 1.0) if factor.any() else 0.0)


def _mean(node: np.ndarray, plain: np.ndarray) -> np.ndarray:
    """The share (3,) of the plain lamp's light on a sphere that nodes make."""
    weight = np.sin((np.arange(len(node)) + 0.5) / len(node) * np.pi)[:, None, None]
    return np.maximum((node * weight).sum(axis=(0, 1)) / (plain * weight).sum(axis=(0, 1)), 0.0)


def _size(light: Light) -> float:
    """How far [m] a lamp reaches from its middle."""
    return max(getattr(light, "radius", 0.0), *(float(np.linalg.norm(getattr(light, name, 0.0)))
                                                for name in ("half_u_world", "half_v_world")))


def _point(rig: LampRig) -> Measured:
    reach = _cone(rig.source)
    for radius in _REACHES:
        table, lit = ratio_of(*rig.shell(radius, _LOOK_SIDE, _LOOK_SIDE, reach, _LOOK_SAMPLES))
        if table.any():
            break
    else:
        return Measured(np.zeros(3))
    if not _is_even(table[lit], table[lit].mean(axis=0)):
        table, lit = ratio_of(*rig.shell(radius, _ROWS, _COLUMNS, reach, _SAMPLES))
    table = _filled(table, lit)
    profile = LampProfile(rig.source.rotation, table.astype(np.float32), reach)
    weight = solid_angles(profile)[:, None, None]
    mean = (table * weight).sum(axis=(0, 1)) / (weight.sum() * table.shape[1])
    by_distance = _distances(rig, profile, radius)
    if by_distance is None and _is_even(table, mean):
        return Measured(mean)
    by_direction = None if _is_even(table, mean) else _relative(table, mean)
    return Measured(mean, replace(profile, by_direction=by_direction, by_distance=by_distance))


def _area(rig: LampRig) -> Measured:
    size = max(rig.source.settings["size"], 1e-3)
    for distance in _REACHES:
        table, lit = ratio_of(*rig.place(_PLACES, _PLACES, distance * size, _SAMPLES))
        if table.any():
            break
    else:
        return Measured(np.zeros(3))
    table = _filled(table, lit)
    by_distance = _distances_of_area(rig, distance * size)
    at = _brightest_place(table)
    node, plain, seen_from = rig.hemisphere(at, _ROWS // 2, _COLUMNS, _SAMPLES)
    around, lit_around = ratio_of(node, plain)
    for row in range(1, len(around)):
        # At grazing angles the camera sees past the lamp's rim.
        around[row] = np.where(lit_around[row][:, None], around[row], around[row - 1])
    if by_distance is not None:
        around = around / np.maximum(_at_distance(by_distance, seen_from)[:, None], 1e-30)
    # What the place is, is in the other table.
    around = _relative_to(around, around[:4].mean(axis=(0, 1)))
    angle = (np.arange(len(around)) + 0.5) / len(around) * 0.5 * np.pi
    weight = (np.sin(angle) * np.cos(angle))[:, None, None]
    lit_mean, mean_around = table[lit].mean(axis=0), (around * weight).sum(axis=(0, 1)) / (weight.sum() * around.shape[1])
    flat, alike = _is_even(table[lit], lit_mean), _is_even(around, mean_around, _EVEN if by_distance is None else _EVEN_FAR)
    factor = lit_mean * (1.0 if alike else mean_around)
    if flat and alike and by_distance is None:
        return Measured(factor)
    return Measured(factor, LampProfile(
        rig.source.rotation, None if alike else _relative(around, mean_around), 0.5 * np.pi,
        by_place=None if flat else _relative(table, lit_mean), by_distance=by_distance))


def _distances(rig: LampRig, profile: LampProfile, distance: float) -> np.ndarray | None:
    """(k, 3) float32 relative to the light at ``distance`` [m]; None if it does not change. Each channel along a direction in which
    it is bright."""
    table = rig.fan(_brightest(profile, luminance(profile.by_direction)), _DISTANCES, _DISTANCE_SAMPLES)
    here = _at_distance(table, np.array([distance]))[0]
    if _is_even(_relative_to(table, here), np.ones(3), _EVEN_FAR):
        return None
    for channel in np.flatnonzero((here == 0.0) & profile.by_direction.any(axis=(0, 1))):
        along = _brightest(profile, profile.by_direction[..., channel])
        table[:, channel] = rig.fan(along, _DISTANCES, _DISTANCE_SAMPLES)[:, channel]
    return _relative_to(table, _at_distance(table, np.array([distance]))[0]).astype(np.float32)


def _distances_of_area(rig: LampRig, distance: float) -> np.ndarray | None:
    """As ``_distances``, straight below the lamp's middle."""
    means = np.array([ratio_of(*rig.place(_PLACES // 8, _PLACES // 8, times * distance, _SAMPLES))[0].mean(axis=(0, 1))
                      for times in (1.0, 0.3, 4.0)])
    if _is_even(_relative_to(means, means[0]), np.ones(3), _EVEN_FAR):
        return None
    table = rig.fan(-rig.source.rotation[:, 2], _DISTANCES, _MORE * _DISTANCE_SAMPLES)
    padded = np.pad(table, ((_SMOOTHED // 2, _SMOOTHED // 2), (0, 0)), mode="edge")
    table = np.mean([padded[i:i + len(table)] for i in range(_SMOOTHED)], axis=0)
    return _relative_to(table, _at_distance(table, np.array([distance]))[0]).astype(np.float32)


def _at_distance(table: np.ndarray, distance: np.ndarray) -> np.ndarray:
    steps = np.linspace(np.log(NEAREST), np.log(FARTHEST), len(table))
    return np.stack([np.interp(np.log(distance), steps, table[:, channel]) for channel in range(3)], axis=-1)


def _tried(rig: LampRig, plain: Light, found: Measured) -> Measured:
    """``found`` with its error; or over a sphere's normals, or but the mean of all light, where that is nearer to the lamp as it
    is."""
    candidates = [found]
    is_ball = getattr(plain, "radius", 0.0) > 0.0 and not plain.soft_falloff
    if is_ball and found.profile is not None and found.profile.by_direction is not None:
        candidates.append(replace(found, profile=replace(found.profile, of_normals=True)))
    radii = [times * max(_size(plain), 0.2) for times in (_NEAR, _FAR)]
    shells = [[rig.shell(radius, *_TRIED, np.pi, _TRY_SAMPLES, True, seed) for seed in (1, 2)] for radius in radii]
    candidates.append(Measured(_mean(*shells[-1][0])))
    errors = [max(_beyond_noise([node for node, _ in pair], _expected(rig, plain, one, radius))
                  for pair, radius in zip(shells, radii, strict=True)) for one in candidates]
    best = int(np.argmin(errors))
    return replace(candidates[best], error=errors[best])


def _expected(rig: LampRig, plain: Light, found: Measured, radius: float) -> list[np.ndarray]:
    """Two estimates of our own lamp's irradiance where ``LampRig.shell`` has Cycles'."""
    rows, columns = _TRIED
    row, column = np.divmod(np.arange(rows * columns), columns)
    # Every texel its own samples, or all would be off by the same noise.
    shift = r2(rows * columns, 0)
    lamp = replace(plain, **{plain.STRENGTH: plain.strength * found.factor}, profile=found.profile)
    table, halves = LampTable((lamp,)), np.zeros((2, rows * columns, 3))
    for number, u in enumerate(sobol_owen(_OWN_SAMPLES, 4, 1)):
        local = from_angles((row + u[2]) / rows * np.pi, (column + u[3]) / columns * 2.0 * np.pi)
        away = (local @ rig.source.rotation.T).astype(np.float32)
        points = np.float32(radius) * away + rig.source.world_from_local[:3, 3].astype(np.float32)
        sample = table.sample(0, points, np.mod(shift + u[:2], np.float32(1.0)))
        halves[number % 2] += sample.irradiance * np.maximum(-dot(away, sample.direction), 0.0)[:, None]
    return list((halves * (2.0 / _OWN_SAMPLES)).reshape(2, rows, columns, 3))


def _beyond_noise(pair: list[np.ndarray], other: list[np.ndarray]) -> float:
    """As ``_off``, of the means of two renders and of two estimates, without what the two of each differ by."""
    difference = _off(0.5 * (pair[0] + pair[1]), 0.5 * (other[0] + other[1]))
    noise = 0.25 * (_off(*pair) ** 2 + _off(*other) ** 2)
    return min(float(np.sqrt(max(difference**2 - noise, 0.0))), 1.0)


def _off(one: np.ndarray, other: np.ndarray) -> float:
    """Mean difference of blocks of two maps over a sphere by the mean light, in luminance: fine grain averages out."""
    rows, columns = one.shape[:2]
    weight = np.sin((np.arange(rows) + 0.5) / rows * np.pi)[:, None]

    def blocks(values):
        return (luminance(values) * weight).reshape(rows // _BLOCK, _BLOCK, columns // _BLOCK, _BLOCK).mean(axis=(1, 3))

    first, second = blocks(one), blocks(other)
    return float(np.abs(first - second).sum() / max(float(first.sum()), 1e-30))


def _cone(source: LampSource) -> float:
    """The angle [rad] from a lamp's axis within which it shines."""
    if source.kind != "SPOT" or source.settings["spot_size"] > 0.98 * np.pi:
        return float(np.pi)
    tangent = np.tan(0.5 * source.settings["spot_size"])
    azimuth = np.linspace(0.0, 2.0 * np.pi, 64)
    rim = np.stack([tangent * np.cos(azimuth), tangent * np.sin(azimuth), np.full(64, -1.0)])
    world = source.world_from_local[:3, :3] @ rim
    cosine = -(source.rotation[:, 2] @ world) / np.maximum(np.linalg.norm(world, axis=0), 1e-300)
    return float(np.arccos(np.clip(cosine.min(), -1.0, 1.0)))


def _filled(table: np.ndarray, lit: np.ndarray) -> np.ndarray:
    """``table`` with what the lamp does not light filled from the texels beside it, so that its rim reads right."""
    table, known = table.copy(), lit.copy()
    for _ in range(2):
        for axis in (0, 1):
            for step in (1, -1):
                beside = np.roll(known, step, axis) & ~known
                table[beside] = np.roll(table, step, axis)[beside]
                known = known | beside
    return table


def _is_even(table: np.ndarray, mean: np.ndarray, limit: float = _EVEN) -> bool:
    return bool(np.all(np.abs(table - mean) <= limit * mean.max()))


def _relative(table: np.ndarray, mean: np.ndarray) -> np.ndarray:
    return np.divide(table, mean, out=np.zeros_like(table), where=mean > 0).astype(np.float32)


def _relative_to(table: np.ndarray, one: np.ndarray) -> np.ndarray:
    """``table`` (…, 3) over ``one`` (3,); a channel that is dark there goes as all light does."""
    if not one.any():
        return np.ones_like(table)
    whole = luminance(table)[..., None] / luminance(one)
    return np.where(one > 0, table / np.where(one > 0, one, 1.0), whole)


def _brightest(profile: LampProfile, level: np.ndarray) -> np.ndarray:
    """The direction (3,) about which ``level`` (h, w) is brightest all around, if possible not at its pole, where columns crowd."""
    padded = np.pad(np.pad(level, ((1, 1), (0, 0)), mode="edge"), ((0, 0), (1, 1)), mode="wrap")
    level = np.min([padded[i:i + level.shape[0], j:j + level.shape[1]] for i in range(3) for j in range(3)], axis=0) + 1e-6 * level
    level[:len(level) // 8] *= np.float32(0.5)
    return directions(profile).reshape(-1, 3)[int(np.argmax(level))]


def _brightest_place(table: np.ndarray) -> tuple[float, float]:
    """(s, t) of the block of texels with the most light, which is no single spot."""
    rows, columns = table.shape[:2]
    blocks = luminance(table).reshape(rows // 16, 16, columns // 16, 16).min(axis=(1, 3))
    blocks = blocks + 1e-3 * luminance(table).reshape(rows // 16, 16, columns // 16, 16).mean(axis=(1, 3))
    row, column = np.unravel_index(int(np.argmax(blocks)), blocks.shape)
    return (column + 0.5) / blocks.shape[1] * 2.0 - 1.0, (row + 0.5) / blocks.shape[0] * 2.0 - 1.0


