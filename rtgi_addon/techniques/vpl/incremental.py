"""Virtual lights that follow a moving lamp: those it still lights stay, the others are replaced where the distribution has holes.

Source: S. Laine, H. Saransaari, J. Kontkanen, J. Lehtinen and T. Aila, "Incremental Instant Radiosity for Real-Time Indirect
Illumination", EGSR 2007. A path is valid while its lamp shines at the first surface that it met and sees it. In the lamp's own
domain (directions, or places across a sun's beam) every path stands for the cell of what lies nearer to it than to any other, and
has the lamp's power over that cell, so the light stays right however uneven the paths become. Paths that crowd each other are given
up, and new ones begin in the largest holes.

Beyond the paper: any lamp type; later bounces hang on their path and follow its power; the cells' power is counted from rays that
the lamp would emit now, SAMPLES for each path, instead of from a triangulation.
"""

from dataclasses import dataclass, fields, replace

import numpy as np

from ...numerics.sampling import hash_u32, sobol_owen_at
from ...scene import Light
from ...transport.context import LightContext, same_values
from ...transport.lights.kind import Emission
from ...transport.lights.kinds import kind_of
from ...transport.lights.shaped import arriving_share, connect, emit
from ...transport.paths.from_lights import FROM_WORLD, LightPaths, join, meets_all, shading_gain, trace
from ...transport.paths.numbers import PathNumbers
from ...transport.vectors import dot, luminance
from .cells import Cells
from .sampling import LightSet, added_paths, distant_lights, path_count, paths_per_source, source_paths

# Rays a path that a lamp's power is counted with.
SAMPLES = 8
# A path with less than this share of the mean power crowds its neighbours; so many of a lamp's are given up at once.
CROWDED, GIVEN_UP = 0.4, 0.03
# With fewer valid paths than this share the lamp has jumped: it is sampled afresh.
FRESH_BELOW = 0.5
# Tells the rays that count a lamp's power apart from all other numbers of a seed: the letters in.
_COUNTED = 0x696E


@dataclass(frozen=True)
class Change:
    """What an update did: ``paths`` that met a surface, and how many of them are new."""

    paths: int
    replaced: int

    @property
    def fraction(self) -> float:
        """Share of the paths that were replaced."""
        return self.replaced / max(self.paths, 1)


def follow(lights: LightSet, before: LightContext, after: LightContext, settings, seed: int) -> tuple[LightSet, Change]:
    """``lights`` of the scene ``before`` under the lamps and world of ``after``."""
    paths, generation = lights.paths, lights.generation + 1
    new_seed = int(hash_u32(seed, generation))
    old, new = before.scene.lights, after.scene.lights
    same_world = after.environment is before.environment
    kept = np.ones(paths.count, bool)
    power = paths.power.copy()
    added: list[LightPaths] = []
    fresh = dict(paths_per_source(after, lights.beam, lights.radius, path_count(settings)))
    for lamp in range(max(len(old), len(new))):
        rows = np.flatnonzero(paths.source == lamp)
        if lamp < min(len(old), len(new)) and _same(old[lamp], new[lamp]):
            continue
        moved, there_before = None, lamp < min(len(old), len(new)) and rows.size
        ratio = _recoloured(old[lamp], new[lamp]) if there_before else None
        if ratio is not None:
            power[rows] *= ratio
            continue
        if there_before and _can_follow(old[lamp], new[lamp]) and meets_all(after, new[lamp], lamp):
            moved = _follow_lamp(lights, rows, after, lamp, settings.bounces, seed)
        if moved is None:
            kept[rows] = False
            if lamp in fresh:
                added.append(source_paths(after, lamp, rows.size or fresh[lamp], lights.beam, settings.bounces, new_seed))
            continue
        stay, power_of_rows, new_paths = moved
        kept[rows[~stay]] = False
        power[rows] = power_of_rows
        added.append(new_paths)
    if not same_world:
        rows = np.flatnonzero(paths.source == FROM_WORLD)
        kept[rows] = False
        if FROM_WORLD in fresh:
            added.append(source_paths(after, FROM_WORLD, fresh[FROM_WORLD], lights.beam, settings.bounces, new_seed))
    old_paths = replace(paths, power=power).take_paths(np.flatnonzero(kept))
    parts = [old_paths, *(added_paths(after, lights, part, new_seed) for part in added)]
    result = replace(lights, paths=join(parts), generation=generation)
    if not same_world:
        directions, irradiance = distant_lights(after, lights.pilots, settings.lights, new_seed)
        result = replace(result, directions=directions, irradiance=irradiance)
    return result, Change(int(result.paths.met.sum()), int(sum(part.met.sum() for part in added)))


def _follow_lamp(lights: LightSet, rows: np.ndarray, context: LightContext, lamp: int, bounces: int | None, seed: int):
    """For one lamp's paths ``rows`` (n,): which stay (n,) bool, the power (n, 3) of all of them, and those that take the places
    of the others. None if too few stay."""
    paths, light, beam = lights.paths, context.scene.lights[lamp], lights.beam
    first, normals, met = paths.first[rows], paths.first_normal[rows], paths.met[rows]
    origins, directions, domain, valid = connect(light, first, paths.u[rows], beam)
    valid = valid & (~met | (dot(normals, directions) < 0))
    candidates = np.flatnonzero(valid)
    passed = context.lamp_transmittance(context.lamps.is_delta[lamp], origins[candidates], first[candidates] - origins[candidates],
                                        np.ones(len(candidates), np.float32))
    valid[candidates[~passed.any(axis=1)]] = False
    if valid.sum() < FRESH_BELOW * len(rows):
        return None
    # Rays that the lamp would emit now tell each path's share of its power: the same ones after every change, or it would flicker.
    index = np.arange(SAMPLES * len(rows))
    key = hash_u32(seed, lamp, _COUNTED)
    u = sobol_owen_at(index, 4, key)
    emission, u = emit(light, u, beam)
    cells = Cells(emission.domain, domain[valid])
    brightness = luminance(emission.power)
    mass = np.bincount(cells.owner, brightness, len(cells.points))
    crowded = np.argsort(mass, kind="stable")[:int(GIVEN_UP * len(rows))]
    crowded = crowded[mass[crowded] < CROWDED * brightness.sum() / len(rows)]
    stay = valid.copy()
    stay[np.flatnonzero(valid)[crowded]] = False
    cells = Cells(emission.domain, domain[stay], cells, np.delete(np.arange(len(cells.points)), crowded))
    taken = cells.fill(len(rows) - int(stay.sum()))
    replacing = Emission(*(array[taken] for array in emission))
    numbers = PathNumbers(np.full(len(taken), key), index[taken].astype(np.uint32))
    new = trace(context, light, lamp, replacing, u[taken, 2:], numbers, bounces, beam)
    power = np.stack([np.bincount(cells.owner, emission.power[:, c], len(cells.points)) for c in range(3)], axis=1) / len(index)
    kept_gain = (shading_gain(paths.first_shading[rows[stay]], normals[stay], directions[stay])[:, None]
                 * arriving_share(light, first[stay], paths.u[rows[stay]], beam))
    power_of_rows = np.zeros((len(rows), 3), np.float32)
    count = int(stay.sum())
    power_of_rows[stay] = power[:count] * np.where(met[stay, None], kept_gain, 1.0)
    new_gain = (shading_gain(new.first_shading, new.first_normal, replacing.directions)[:, None]
                * arriving_share(light, new.first, new.u, beam))
    new = replace(new, power=(power[count:] * np.where(new.met[:, None], new_gain, 1.0)).astype(np.float32))
    return stay, power_of_rows, new


def _can_follow(old: Light, new: Light) -> bool:
    """Whether a path of ``old`` can be one of ``new``: the same kind, with shadows, rays that spread, and places on the lamp that
    all shine alike."""
    if type(old) is not type(new) or not old.casts_shadow or old.linking is not None or old.max_bounces != new.max_bounces:
        return False
    if any(light.profile is not None and (light.profile.by_place is not None or light.profile.of_normals) for light in (old, new)):
        return False
    return kind_of(new).can_follow(old, new)


def _same(old: Light, new: Light, but: tuple[str, ...] = ()) -> bool:
    return type(old) is type(new) and all(same_values(getattr(old, item.name), getattr(new, item.name)) for item in fields(old)
                                          if item.name not in ("name", *but))


def _recoloured(old: Light, new: Light) -> np.ndarray | None:
    """New over old strength (3,) of a lamp that changed in nothing else; None if it did, or was black in a channel."""
    name = old.STRENGTH
    if not _same(old, new, (name,)) or not np.all(getattr(old, name) > 0):
        return None
    return np.asarray(getattr(new, name) / getattr(old, name), np.float32)


