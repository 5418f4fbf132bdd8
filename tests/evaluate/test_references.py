"""The path reference reaches the noise it was asked for, agrees with closed forms, and leaves out what it is told to."""

import numpy as np
import pytest
import scene_builders as build

from rtgi_addon.evaluate.receivers import surface_receivers
from rtgi_addon.evaluate.references import PathReference, limited
from rtgi_addon.progress import Progress
from rtgi_addon.transport.context import LightContext
from rtgi_addon.transport.paths.reference import Estimate


def reference_in(scene, noise, points=24, **options):
    context = LightContext(scene, 1)
    return PathReference(context, noise, **options), surface_receivers(context, np.zeros((1, 3)), points, 2)


def test_the_integrating_sphere_within_its_own_noise():
    reference, receivers = reference_in(build.integrating_sphere(albedo=0.5, light_position=(0.4, 0, 0)), 0.01)
    truth = reference.irradiance(receivers.take(receivers.own))
    assert truth.noise < 0.012
    # π of indirect irradiance everywhere (docs/physics.md §2); the mean over 24 points errs by some fifth of one point's noise.
    assert truth.mean.mean() == pytest.approx(np.pi, rel=0.01)


def test_more_paths_are_traced_for_less_noise():
    scene = build.closed_box(albedo=0.5, light_position=(0.5, 0.3, 0.2))
    noise = []
    for target in (0.2, 0.006):
        reference, receivers = reference_in(scene, target, most_paths=1 << 20)
        noise.append(reference.irradiance(receivers).noise)
    assert noise[1] < 0.6 * noise[0] and noise[1] < 0.009


def test_no_more_paths_than_allowed():
    counted = []
    reference, _ = reference_in(build.closed_box(), 1e-6, most_paths=4 * 2048)

    def trace(paths, seed, progress):
        counted.append(paths)
        return Estimate(np.ones((4, 3), np.float32), np.full((4, 3), 0.1, np.float32))

    truth = reference._refined(trace, 4, Progress())
    assert counted == [512, 1536]
    # Two independent means of variance 0.01, weighted by paths: ¼² + ¾² of it.
    assert truth.variance == pytest.approx(0.01 * (1 / 16 + 9 / 16))


def test_probes_in_a_furnace():
    reference, _ = reference_in(build.cube_furnace(albedo=0.5, emission=1.0), 0.02)
    truth = reference.probes(np.zeros((2, 3), np.float32), 1)
    # L = 2 everywhere: L_00 = 2·√(4π).
    assert truth.mean.shape == (2, 4, 3)
    assert truth.mean[:, 0] == pytest.approx(2 * np.sqrt(4 * np.pi), rel=0.05)


def test_limited_keeps_only_the_known_light():
    scene = build.scene([build.cube("room", inward=True)], [build.material("glow", 0.5, 1.0)], [build.point_light()], world=3.0)
    lamps = limited(scene, frozenset({"lamps"}))
    assert len(lamps.lights) == 1 and LightContext(lamps, 1).environment.is_black and LightContext(lamps, 1).emitters.count == 0
    world = limited(scene, frozenset({"world", "emissive surfaces"}))
    assert world.lights == () and world.materials == scene.materials and not LightContext(world, 1).environment.is_black
