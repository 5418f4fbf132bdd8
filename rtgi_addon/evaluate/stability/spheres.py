"""What mirrors show of sphere probes alone: lobes of any roughness, and rooms behind walls.

Sources: S. Lagarde, C. de Rousiers, "Moving Frostbite to Physically Based Rendering", SIGGRAPH 2014, 4.9 (local probes, their lobes
and where they leak).
"""

from dataclasses import replace

import numpy as np

from ... import effects
from ...effects.lit import draw_frame, light_context, seen_surfaces
from ...effects.spheres.bake import bake_spheres
from ...effects.spheres.settings import SphereSettings
from ...scene import Scene
from ...scene.sphere_probe import BOX, SPHERE, SphereProbe
from ...techniques.base import Field
from ...transport.context import LightContext
from ...transport.surfaces.ggx import sample_reflection
from ...transport.vectors import dot
from .case import Bench, Case, Sample, Variant
from .parts import box, quad, scene
from .reflections import eye, glow, mirror

ROUGHNESSES = 0.0, 0.1, 0.25, 0.5, 1.0
# Rays of a pixel that the truth is the mean of, and that the effect takes.
_TRUE, _RAYS, _SAMPLES = 256, 16, 8
_SIZE = 32, 18
# The half sides of the room, and of the floor in it, which is clear of the walls.
_ROOM = np.array([2.0, 3.0, 1.5])
# What a variant says of probes, and not of the effect.
_REACH = "reach"


class _Dark(Field):
    """No light but that of sphere probes."""

    technique, direct_lamps = "dark", frozenset()

    def __init__(self, spheres):
        self.params, self.stats, self.spheres = {}, {}, spheres

    def irradiance(self, points, normals):
        """See Field."""
        return np.zeros(points.shape, np.float32)

    def arrays(self):
        """See Field."""
        return {}


def _room(roughness: float) -> Scene:
    """A room whose walls are painted with light, and a mirror for a floor in it; a probe in its middle, and its box."""
    walls = box("walls", -_ROOM, _ROOM, 1, inward=True)
    colours = [glow(strength) for strength in (0.2, 1.6, 0.5, 1.0, 0.3, 2.0)]
    walls = replace(walls, triangle_material=(1 + np.arange(len(walls.triangles)) // 2).astype(np.int32))
    floor = quad("floor", (-1.9, -2.9, -1.45), (3.8, 0.0, 0.0), (0.0, 5.8, 0.0))
    matrix = np.diag([*_ROOM, 1.0])
    made = scene("room", [floor, walls], [mirror(roughness), *colours], [])
    return replace(made, spheres=(SphereProbe("room", matrix, BOX, 1.2, 0.1, BOX, 1.0, 0.01, 100.0),))


def _painted(points: np.ndarray, directions: np.ndarray, context: LightContext) -> np.ndarray:
    """What rays (n,) find of the walls (n, 3)."""
    hits = context.tracers.view.intersect(points.astype(np.float32), directions.astype(np.float32))
    found, rows = np.zeros(directions.shape), np.flatnonzero(hits.primitive >= 0)
    primitive = hits.primitive[rows]
    cosine = -dot(context.geometry.normals_world[primitive], directions[rows].astype(np.float32))
    found[rows] = context.surfaces.emission(primitive, hits.u[rows], hits.v[rows], cosine)
    return found


def _mirrored(bench: Bench, built: Scene, view) -> tuple[np.ndarray, np.ndarray]:
    """What the first mesh shows (n, 3) of sphere probes alone, and what its lobes find (n, 3)."""
    bench.progress.check()
    effect, context = effects.get(bench.technique), light_context(built, bench.threads)
    probes = bake_spheres(built, None, SphereSettings(rays=4, reflections=0), bench.seed, bench.threads).probes
    field = _Dark(probes)
    frames = [draw_frame(context, field, view, _SIZE, index=index) for index in range(_SAMPLES)]
    frame, seen = frames[0], frames[0].gbuffer.seen
    wanted = {name: value for name, value in bench.settings.items() if name != _REACH}
    settings = effect.Settings(**{"rays": _RAYS, "max_roughness": 0.0, **wanted})
    picture = np.mean([effect.apply(sample, field, settings) for sample in frames], axis=0)
    floor = frame.gbuffer.instance[seen] == 0
    surfaces = seen_surfaces(frame.gbuffer, view).take(np.flatnonzero(floor))
    total, weights = np.zeros((len(surfaces.points), 3)), np.zeros((len(surfaces.points), 3))
    rng = np.random.default_rng(bench.seed)
    for _ in range(_TRUE):
        directions, weight = sample_reflection(surfaces.look, surfaces.normals, surfaces.towards_eye,
                                               rng.random((len(surfaces.points), 2)).astype(np.float32))
        starts = surfaces.points + 1e-4 * surfaces.faces
        total += weight * _painted(starts, directions, context)
        weights += weight
    true = surfaces.look.layer * total / np.maximum(weights, 1e-9)
    return picture[seen][floor][:, :3].astype(np.float64), true


def _roughness(bench: Bench) -> list[Sample]:
    samples = []
    for roughness in ROUGHNESSES:
        found, true = _mirrored(bench, _room(roughness), eye(0.0, 30.0, (0.0, -2.6, 0.6)))
        samples.append(Sample(f"roughness {roughness:g}", float(np.abs(found - true).mean() / true.mean())))
    return samples


def _wall(bench: Bench) -> list[Sample]:
    """A bright room beside a dark one with a mirror in it."""
    reach = bench.settings.get(_REACH, BOX)
    bright = box("bright", (-4.2, -2.0, -1.5), (-0.2, 2.0, 1.5), 1, inward=True)
    dark = box("dark", (0.2, -2.0, -1.5), (4.2, 2.0, 1.5), 2, inward=True)
    floor = quad("floor", (0.3, -1.9, -1.45), (3.8, 0.0, 0.0), (0.0, 3.8, 0.0))
    matrix = np.eye(4)
    matrix[:3, 3] = -2.2, 0.0, 0.0
    if reach == BOX:
        matrix[:3, :3] = np.diag([2.0, 2.0, 1.5])
    distances = (1.1, 1.0) if reach == BOX else (5.0, 5.0)
    probe = SphereProbe("bright", matrix, reach, distances[0], 0.1, reach, distances[1], 0.01, 100.0)
    built = replace(scene("rooms", [floor, bright, dark], [mirror(), glow(), glow(0.0)], []), spheres=(probe,))
    found, _ = _mirrored(bench, built, eye(0.0, 30.0, (2.2, -1.8, 0.4)))
    return [Sample(f"influence as a {reach}", float(found.mean()))]


CASES = (
    Case("sphere-roughness", "Mirrors are too sharp or too soft",
         "a mirror in a box room of painted light, a sphere probe in its middle",
         "mean difference of the mirror from what its lobes find, relative", "roughness", 0.05, _roughness),
    Case("sphere-wall", "Mirrors show the room behind a wall", "a dark room with a mirror beside a bright one with a sphere probe",
         "light in the mirror, relative to the bright room's", "influence of the probe", 0.001, _wall,
         {"screen_reflections": (Variant("an influence that reaches through the wall", {_REACH: SPHERE}),)}),
)
