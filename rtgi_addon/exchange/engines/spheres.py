"""The sphere probes of a bundle made ready for an engine, and what the engine's look-up is held to.

Maps stay in the bake's own axes, with z up: the shaders turn directions (`spheres_glsl`), for an octahedral map cannot be turned
without resampling. What says where each probe stands is in the engine's axes and units. ``shaders/include/sphere_probes.glsl``
is the same text in every engine and in the preview.
"""

from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np

from ...effects.spheres.maps import LEAST_FALLOFF, LEAST_SIDE, SphereMap, SphereProbes, level_sides
from ...effects.spheres.prefilter import prefiltered
from ...scene.sphere_probe import BOX, SPHERE, SphereProbe
from .axes import Axes
from .conformance import BUNDLE, KIT, POINTS
from .kit import unit

# Rows of the table, four numbers each, that a shader reads of a probe.
ROWS = 8
SCHEMA = "rtgi-spheres-conformance/1"
_SHARED = Path(__file__).resolve().parents[2] / "shaders" / "include" / "sphere_probes.glsl"
# Of what rounding in float32 changes in points and directions, and of what it does to sums.
_NUDGE, _FLOAT = 4e-7, 1e-4
# Where a nudge of that size changes more than this share, a point lies on an edge and asks nothing.
_EDGE = 0.02


@dataclass(frozen=True, eq=False)
class EngineSpheres:
    """``probes`` (SphereProbes) with their places in the engine's axes and units, which the look-up is asked in."""

    probes: SphereProbes
    axes: Axes

    @property
    def table(self) -> np.ndarray:
        """(p, ROWS, 4) float32: rows of the influence's and of the parallax's matrix, centre and 1/falloff, shapes."""
        return np.stack([_row(item.probe) for item in self.probes.maps])

    @property
    def slices(self) -> np.ndarray:
        """(p, height, R + 2, 4) float16: the stack of each probe's levels."""
        stacks = np.stack(self.probes.stacks)
        return np.concatenate([stacks, np.zeros((*stacks.shape[:3], 1), np.float16)], axis=-1)

    @property
    def sizes(self) -> dict[str, int]:
        """What the shaders and scripts have to know of the maps."""
        return {"side": self.probes.resolution, "levels": len(level_sides(self.probes.resolution)), "least": LEAST_SIDE}

    def radiance(self, points: np.ndarray, directions: np.ndarray, roughness: np.ndarray) -> np.ndarray:
        """(n, 4): what the engine is to find at ``points`` from unit ``directions`` (n, 3) of its own axes: radiance times share,
        and share."""
        light, share = _Turned(self.probes, self.axes).radiance(points, directions, np.square(roughness))
        return np.concatenate([light, share[:, None]], axis=1).astype(np.float64)


class _Turned(SphereProbes):
    """Probes whose places are in an engine's axes, over maps in Blender's."""

    def __init__(self, probes: SphereProbes, axes: Axes):
        super().__init__(probes.maps)
        self._axes = axes

    def _level(self, number, level, directions):
        return super()._level(number, level, directions @ self._axes.engine_from_blender)


def engine_spheres(spheres: SphereProbes | None, axes: Axes) -> EngineSpheres | None:
    """``spheres`` along ``axes``; None for none."""
    if spheres is None:
        return None
    placed = [SphereMap(replace(item.probe, world_from_local=axes.matrix(item.probe.world_from_local)), item.levels)
              for item in spheres.maps]
    return EngineSpheres(SphereProbes(placed, spheres.light), axes)


def notes_on_spheres(spheres: EngineSpheres | None, transfer) -> list[str]:
    """What a user should know of ``spheres`` beside ``transfer`` (None: light stays as it is)."""
    notes = []
    if spheres is not None and transfer is not None:
        notes.append("sphere probes keep the light of the bake: mirrors do not follow a sun or sky that changes")
    return notes


def spheres_glsl(spheres: EngineSpheres) -> str:
    """The look-up for shaders that have rtgi_octahedral, rtgi_sphere_row and rtgi_sphere_texel: numbers, axes, functions."""
    defines = {"RTGI_SPHERES": len(spheres.probes.maps), **{f"RTGI_SPHERE_{name.upper()}": value
                                                            for name, value in spheres.sizes.items()}}
    columns = spheres.axes.engine_from_blender.T
    turned = ", ".join(f"dot(direction, vec3({', '.join(f'{value:.1f}' for value in row)}))" for row in columns)
    return (f"{''.join(f'#define {name} {value}' + chr(10) for name, value in defines.items())}\n"
            f"vec3 rtgi_sphere_axes(vec3 direction)\n{{\n  return vec3({turned});\n}}\n\n{_SHARED.read_text(encoding='utf-8')}")


def _row(probe: SphereProbe) -> np.ndarray:
    row = np.zeros((ROWS, 4))
    row[0:3], row[3:6] = probe.unit_from_world[:3], probe.parallax_from_world[:3]
    row[6] = *probe.centre_world, 1.0 / max(probe.falloff, LEAST_FALLOFF)
    row[7, :2] = probe.influence_shape == BOX, probe.parallax_shape == BOX
    return row.astype(np.float32)


@cache
def kit_spheres(axes: Axes) -> EngineSpheres:
    """Four probes of every pair of shapes, turned and overlapping, whose maps are noise."""
    rng, shapes, side = np.random.default_rng(21), (SPHERE, BOX), 32
    levels = prefiltered(rng.random((4, side, side, 3)) ** 3 * 4.0)
    found = []
    for number in range(4):
        turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        matrix = np.eye(4)
        matrix[:3, :3], matrix[:3, 3] = turn @ np.diag(rng.uniform(0.6, 1.6, 3)), rng.uniform(-1.0, 1.0, 3)
        found.append(SphereMap(SphereProbe(f"Kit {number}", matrix, shapes[number % 2], 1.2 + 0.5 * number, 0.5,
                                           shapes[number // 2], 2.0 + 0.5 * number),
                               tuple(level[number].astype(np.float16) for level in levels)))
    return engine_spheres(SphereProbes(found), axes)


def conformance_json(spheres: EngineSpheres) -> dict:
    """The contents of an export's conformance file of sphere probes."""
    return {"schema": SCHEMA, "unit": "W/(sr m^2)", "cases": [
        _case("kit, sphere probes", KIT, kit_spheres(spheres.axes)), _case("bundle, sphere probes", BUNDLE, spheres)]}


def _case(name: str, probes: str, spheres: EngineSpheres) -> dict:
    """POINTS points in and about all influences, with directions and roughnesses, and what is known there."""
    rng, maps = np.random.default_rng(22), spheres.probes.maps
    local = rng.uniform(-1.1, 1.1, (2 * POINTS, 3))
    points = np.stack([np.linalg.inv(maps[number % len(maps)].probe.unit_from_world) @ [*place, 1.0]
                       for number, place in enumerate(local)])[:, :3].astype(np.float32)
    directions = unit(rng.normal(size=points.shape)).astype(np.float32)
    roughness = np.where(np.arange(len(points)) % 8 == 0, 0.0, rng.random(len(points))).astype(np.float32)
    asked = points.astype(np.float64), unit(directions.astype(np.float64)), roughness.astype(np.float64)
    found, spread = spheres.radiance(*asked), np.zeros((len(points), 4))
    for _ in range(4):
        nudged = (asked[0] + _NUDGE * np.abs(asked[0]).max() * rng.choice([-1.0, 1.0], points.shape),
                  unit(asked[1] + _NUDGE * rng.choice([-1.0, 1.0], points.shape)), asked[2])
        spread = np.maximum(spread, np.abs(spheres.radiance(*nudged) - found))
    level = np.array([*found[:, :3].max(axis=0), 1.0])
    kept = np.flatnonzero(np.all(spread <= _EDGE * np.maximum(level, 1e-9), axis=1))[:POINTS]
    tolerance = 4.0 * spread[kept] + _FLOAT * (np.abs(found[kept]) + 0.05 * level) + 1e-9
    return {"name": name, "probes": probes, **{key: _digits(values) for key, values in (
        ("points", points[kept]), ("directions", directions[kept]), ("radiance", found[kept]), ("tolerance", tolerance))},
            "roughness": [float(f"{value:.9g}") for value in roughness[kept]]}


def _digits(array: np.ndarray) -> list:
    return [[float(f"{value:.9g}") for value in row] for row in np.asarray(array, np.float64)]
