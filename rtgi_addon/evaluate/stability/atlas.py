"""Where a light atlas may fail over time and across its map: suns that move between the directions it knows, and islands' borders.

Sources: P.-P. Sloan, J. Kautz and J. Snyder, SIGGRAPH 2002 (transfer on surfaces); M. Iwanicki, "Lighting Technology of The Last of
Us", SIGGRAPH 2013 (seams).
"""

from dataclasses import replace

import numpy as np

from ...effects.atlas.bake import bake_atlas
from ...effects.atlas.borders import seams_of
from ...effects.atlas.relight import relit_atlas
from ...effects.atlas.settings import AtlasSettings
from ...effects.atlas.sheet import LightAtlas, bilinear
from ...scene import Scene
from ...techniques.transfer.follow import lighting_in
from .case import Bench, Case, Sample
from .motion import SWEEP, yard
from .parts import grey, mesh, point, quad, scene, volume

# Texels along a metre, and rays of each.
_DENSITY, _RAYS = 4.0, 128
# Frames of the sun's way: each is a bake.
_FRAMES = 6
# Of the probes beside an atlas, which nothing here is read from.
_FEW = {"rays": 64, "cache_rays": 32, "sites": 0, "sun_side": 3}
_MAP = "Lightmap"


def unwrapped(built: Scene, maps: dict[str, np.ndarray]) -> Scene:
    """``built`` with the objects that ``maps`` names in the atlas, by the map (t, 3, 2) of each."""
    meshes, instances = list(built.meshes), list(built.instances)
    for index, instance in enumerate(instances):
        if instance.name in maps:
            uv = {_MAP: np.float32(maps[instance.name])}
            meshes[instance.mesh] = replace(meshes[instance.mesh], uv_layers=uv, active_uv=_MAP)
            instances[index] = replace(instance, atlas=_MAP)
    return replace(built, meshes=tuple(meshes), instances=tuple(instances))


def _quad_map(across: float, up: float) -> np.ndarray:
    """The map of a `quad` of those sides [m]."""
    corners = np.array([[0, 0], [across, 0], [across, up], [0, up]]) / max(across, up)
    return corners[[[0, 1, 2], [0, 2, 3]]]


def _yard(degrees: float) -> Scene:
    return unwrapped(yard(degrees), {"ground": _quad_map(3.0, 3.0), "wall": _quad_map(1.5, 3.0)})


def _baked(bench: Bench, built: Scene, **settings) -> tuple:
    """The field of ``built`` and its atlas."""
    field = bench.bake(built, **_FEW)
    settings = AtlasSettings(density=_DENSITY, rays=_RAYS, **settings)
    return field, bake_atlas(built, field, settings, bench.seed, bench.threads, bench.progress.span(0.0, 0.0)).atlas


def _light(atlas: LightAtlas) -> np.ndarray:
    """Irradiance (n,) at the texels that are known."""
    return atlas.irradiance[atlas.known].mean(axis=1).astype(np.float64)


def _sun_sweep(bench: Bench) -> list[Sample]:
    """The error's change over time, against atlases of the same rays that were baked under the very sun: a constant error is
    none."""
    field, atlas = _baked(bench, _yard(0.0))
    errors, light = [], []
    for step in range(_FRAMES):
        bench.progress.check()
        built = _yard(step * SWEEP)
        exact = bake_atlas(built, None, AtlasSettings(density=_DENSITY, rays=_RAYS), bench.seed, bench.threads,
                           bench.progress.span(0.0, 0.0)).atlas
        light.append(_light(exact))
        errors.append(_light(relit_atlas(atlas, field.transfer, lighting_in(field.transfer, built))) - light[-1])
    moved = np.array(errors) - np.mean(errors, axis=0)
    return [Sample(f"{_FRAMES} frames of {SWEEP:.0f}°", float(np.sqrt(np.mean(moved**2)) / np.mean(light)), built, field)]


def _cut_floor() -> Scene:
    """A floor whose map is cut beside its middle into two islands, one of them turned and both apart, a lamp near the cut, and a
    wall."""
    x = np.array([-2.0, -0.03, 2.0])
    floor = mesh("floor", [[a, b, 0.0] for b in (-1.0, 1.0) for a in x], [[0, 1, 4], [0, 4, 3], [1, 2, 5], [1, 5, 4]])
    left, right = [(0.03, 0.03), (0.43, 0.03), (0.43, 0.44), (0.03, 0.44)], [(0.9, 0.52), (0.9, 0.94), (0.5, 0.94), (0.5, 0.52)]
    built = scene("cut floor", [floor, quad("wall", (2.0, -1.5, 0.0), (0.0, 0.0, 2.0), (0.0, 3.0, 0.0))], [grey(0.7)],
                  [point((0.5, 0.0, 1.0), 5.0)], 0.2, [volume((-0.4, -0.4, 0.3), (0.4, 0.4, 1.1), (2, 2, 2))])
    halves = [[side[corner] for corner in corners] for side in (left, right) for corners in ((0, 1, 2), (0, 2, 3))]
    return unwrapped(built, {"floor": np.array(halves)})


def _border(bench: Bench) -> list[Sample]:
    """The largest step across the cut, over the largest between places a texel apart inside islands."""
    built, samples = _cut_floor(), []
    field, atlas = _baked(bench, built, suns=4)
    sheets = {"as baked": atlas}
    if atlas.transfer is not None:
        sun = replace(yard(0.0).lights[0], name="another sun")
        sheets["under a sun"] = relit_atlas(atlas, field.transfer, lighting_in(field.transfer, replace(
            built, lights=(*built.lights, sun))))
    here, there = seams_of(atlas.sheet.parts[0], built)
    for name, sheet in sheets.items():
        image, known, size = sheet.irradiance.mean(axis=2), sheet.known.astype(np.float64), sheet.sheet.size
        grid = np.meshgrid(np.arange(1, size[1], 0.25), np.arange(1, size[0], 0.25))
        places, steps = np.stack([axis.ravel() for axis in grid], axis=1), []
        for half in (np.array([0.5, 0.0]), np.array([0.0, 0.5])):
            inside = np.all([bilinear(known, places + way * 2 * half) > 0.999 for way in (-1, 1)], axis=0)
            steps.append(np.abs(bilinear(image, places[inside] + half) - bilinear(image, places[inside] - half)).max())
        across = np.abs(bilinear(image, here) - bilinear(image, there)).max()
        samples.append(Sample(name, float(across / max(steps)), built, field))
    return samples


CASES = (
    Case("atlas-sun-sweep", "a light atlas flickers while the sun moves between its directions",
         "a yard whose ground and wall are in the light atlas, under a sun that turns",
         "standard deviation over time of the error of texels, against an atlas baked under each sun, over the mean",
         "the sun, a degree a frame", 0.01, _sun_sweep),
    Case("atlas-border", "a seam shows where islands of a light atlas meet",
         "a floor whose map is cut into two islands beside a lamp",
         "largest step of light across the cut, over the largest of a texel inside islands", "the light", 0.02, _border),
)
