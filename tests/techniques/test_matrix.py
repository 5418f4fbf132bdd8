"""Every technique over every scene whose irradiance is known exactly, at default settings, to the tolerance it declares."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest
import room_scenes as rooms
import scene_builders as build

from rtgi_addon import techniques
from rtgi_addon.numerics.sampling import fibonacci_sphere
from rtgi_addon.progress import Progress
from rtgi_addon.scene import Scene, World
from rtgi_addon.techniques.base import KNOWN_LIGHT


class Case(NamedTuple):
    """A scene, points with normals to ask at, the exact irradiance (n, 3) there, and that of the first bounce alone."""

    scene: Scene
    points: np.ndarray
    normals: np.ndarray
    irradiance: np.ndarray
    first_bounce: np.ndarray


def everywhere(scene, irradiance, first_bounce=None, reach=0.45, colour=(1.0, 1.0, 1.0)):
    """The same irradiance at any point within ``reach`` of the origin, in any direction."""
    normals = fibonacci_sphere(64).astype(np.float32)
    points = np.random.default_rng(0).uniform(-reach, reach, (64, 3)).astype(np.float32)
    whole, first = (np.full((64, 1), value) * np.array(colour)
                    for value in (irradiance, irradiance if first_bounce is None else first_bounce))
    return Case(scene, points, normals, whole, first)


def light_in(scene):
    """What lights ``scene``, in the words of ``Technique.knows``."""
    there = {"lamps": any(np.any(lamp.intensity > 0) for lamp in scene.lights), "world": not scene.world.is_black,
             "emissive surfaces": any(material.is_emissive for material in scene.materials)}
    return {name for name, present in there.items() if present}


def black_floor_under_a_sky():
    """Hemisphere of radiance 1: E = π·(1 + cosθ)/2."""
    scene = build.open_plane(0.0, half_size=3000.0)
    case = everywhere(scene, 1.0)
    irradiance = np.pi * (0.5 + 0.5 * case.normals[:, 2:]) * np.ones(3)
    return case._replace(points=case.points + np.float32([0, 0, 1]), irradiance=irradiance)


def grey_floor_under_a_sky():
    """The floor sends back half of what the sky gives it."""
    case = black_floor_under_a_sky()
    scene = build.open_plane(0.5, half_size=3000.0)
    return case._replace(scene=scene, irradiance=case.irradiance + 0.5 * np.pi * (0.5 - 0.5 * case.normals[:, 2:]))


CASES = {
    "furnace": lambda: everywhere(build.cube_furnace(0.5, 1.0), 2 * np.pi),
    "coloured furnace": lambda: everywhere(
        replace(build.cube_furnace(), materials=(build.material("glow", (0.9, 0.5, 0.1), (0.1, 0.5, 0.9)),)), np.pi),
    "unit sphere": lambda: everywhere(build.integrating_sphere(0.5, np.pi), np.pi, 0.5 * np.pi),
    "bright integrating sphere": lambda: everywhere(build.integrating_sphere(0.9, 1.0), 9.0, 0.9),
    "uniform sky": lambda: everywhere(replace(build.scene([rooms.moved(build.cube("far", 0.001), (0, 0, -500))]),
                                              world=World.constant((1.0, 2.0, 3.0))), np.pi, colour=(1, 2, 3)),
    "black floor under a sky": black_floor_under_a_sky,
    "grey floor under a sky": grey_floor_under_a_sky,
    "darkness": lambda: everywhere(build.closed_box(intensity=0.0), 0.0),
}

# Where a technique says itself that it is no use, and why.
BEYOND = {
    ("lpv", "uniform sky"): "light propagation volumes want geometry in them, and say so",
    ("cone_tracing", "uniform sky"): "voxels want geometry in them, and say so",
    ("voxel_march", "uniform sky"): "voxels want geometry in them, and say so",
    ("cone_tracing", "grey floor under a sky"): "the floor goes on beyond the voxels, where it is black, and the bake says so",
    ("voxel_march", "grey floor under a sky"): "the floor goes on beyond the voxels, where it is black, and the bake says so",
}


@pytest.mark.parametrize("name", techniques.names())
@pytest.mark.parametrize("case", CASES)
def test_irradiance_is_exact_within_the_declared_tolerance(name, case):
    if (name, case) in BEYOND:
        pytest.skip(BEYOND[name, case])
    technique, case = techniques.get(name), CASES[case]()
    sources = light_in(case.scene)
    if technique.knows != KNOWN_LIGHT and not (sources and sources <= technique.knows):
        pytest.skip(f"{name} does not know {', '.join(sorted(sources - technique.knows)) or 'a scene without light'}")
    exact = case.irradiance if "bounces" in technique.knows else case.first_bounce
    field = technique.bake(case.scene, technique.Settings(), np.random.default_rng(1), Progress())
    measured = field.irradiance(case.points, case.normals)
    assert measured.shape == exact.shape and measured.min() >= 0 and not field.includes_direct
    scale = exact.max(axis=0)
    if not scale.any():
        assert not measured.any()
    assert np.sqrt(np.mean((measured - exact) ** 2, axis=0)).max() <= technique.tolerance * scale.max()
    assert np.all(np.abs(measured.mean(axis=0) - exact.mean(axis=0)) <= 0.5 * technique.tolerance * scale)


@pytest.mark.parametrize("name", techniques.names())
def test_techniques_declare_themselves(name):
    technique = techniques.get(name)
    assert technique.name == name and technique.label and technique.description
    # Light volumes are a preview: their cells blur what the others resolve. Few cones see little near the horizon.
    assert 0 < technique.tolerance <= {"lpv": 0.4, "cone_tracing": 0.15}.get(name, 0.1)
    assert technique.knows and technique.knows <= KNOWN_LIGHT
    techniques.validate_settings(technique.Settings())
