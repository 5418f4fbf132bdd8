"""Light paths: the power that each kind of source sends, where, and what bounces leave of it."""

from dataclasses import replace

import numpy as np
import pytest
import scene_builders as build

from rtgi_addon.numerics.sampling import sobol_owen
from rtgi_addon.scene import AreaLight, PointLight, SpotLight, SunLight
from rtgi_addon.transport.context import LightContext
from rtgi_addon.transport.lights.beam import Beam
from rtgi_addon.transport.lights.kinds import kind_of
from rtgi_addon.transport.lights.lamps import LampTable
from rtgi_addon.transport.paths.from_lights import emitter_paths, join, lamp_paths, world_paths
from rtgi_addon.transport.vectors import dot

DOWN, ONE = np.float32([0, 0, -1]), np.ones(3, np.float32)
HERE, U, V = np.float32([0.1, -0.2, 0.3]), np.float32([0.2, 0, 0]), np.float32([0, 0.1, 0])
LAMPS = {
    "point": PointLight("lamp", HERE, ONE),
    "sphere": PointLight("lamp", HERE, ONE, 0.1, False),
    "soft": PointLight("lamp", HERE, ONE, 0.1, True),
    "spot": SpotLight("lamp", HERE, DOWN, ONE, 1.0, 0.5),
    "sharp spot": SpotLight("lamp", HERE, DOWN, ONE, 1.0, 0.0),
    "wide spot": SpotLight("lamp", HERE, DOWN, ONE, 3.0, 1.0),
    "elliptical spot": SpotLight("lamp", HERE, DOWN, ONE, 1.0, 0.5, world_from_local=np.diag([2.0, 1.0, 1.0])),
    "rectangle": AreaLight("lamp", HERE, U, V, DOWN, ONE),
    "spread": AreaLight("lamp", HERE, U, V, DOWN, ONE, spread=1.0),
    "ellipse": AreaLight("lamp", HERE, U, V, DOWN, ONE, "ELLIPSE", 2.0),
    "parallel": AreaLight("lamp", HERE, U, V, DOWN, ONE, spread=0.0),
}


def beam_of(context, radius=0.5):
    return Beam(np.array(context.geometry.bounds()), np.zeros(3), radius)


def power_on_walls(lamp, samples=1 << 15):
    """What the walls of a cube of half size 1 receive, by integrating the lamp's irradiance over them."""
    u, table, total = sobol_owen(samples, 4, 5), LampTable((lamp,)), 0.0
    for axis in range(3):
        for side in (-1.0, 1.0):
            points = np.insert(2 * u[:, :2] - 1, axis, side, axis=1).astype(np.float32)
            sample = table.sample(0, points, u[:, 2:])
            total += 4.0 * np.mean(sample.irradiance[:, 0] * np.maximum(-side * sample.direction[:, axis], 0))
    return total


@pytest.mark.parametrize("name", LAMPS)
def test_every_lamp_sends_the_power_that_its_irradiance_adds_up_to(name):
    context = LightContext(build.closed_box(0.5))
    paths = lamp_paths(context, LAMPS[name], 0, np.arange(4096), beam_of(context), 1, 0)
    assert paths.met.all()
    assert paths.power[:, 0].mean() == pytest.approx(power_on_walls(LAMPS[name]), rel=5e-3)
    assert paths.flux[:, 0].sum() == pytest.approx(0.5 * paths.power[:, 0].sum(), rel=1e-5)


@pytest.mark.parametrize("name", LAMPS)
def test_irradiance_by_lamp_paths_is_that_of_the_lamp(name):
    # Paths that fall on small patches of the floor against the irradiance there.
    context = LightContext(build.closed_box(0.5))
    paths = lamp_paths(context, LAMPS[name], 0, np.arange(1 << 16), beam_of(context), 1, 0)
    side, table = 0.5, LampTable((LAMPS[name],))
    for x, y in ((0.1, -0.2), (0.4, -0.2), (0.1, 0.25)):
        inside = (paths.first[:, 2] < -0.999) & np.all(np.abs(paths.first[:, :2] - [x, y]) < side / 2, axis=1)
        measured = paths.power[inside, 0].sum(dtype=np.float64) / paths.count
        u = sobol_owen(1 << 14, 4, 3)
        points = np.insert(np.float32([x, y]) + np.float32(side) * (u[:, :2] - np.float32(0.5)), 2, -1.0, axis=1)
        sample = table.sample(0, points, u[:, 2:])
        exact = side**2 * np.mean(sample.irradiance[:, 0] * np.maximum(sample.direction[:, 2], 0))
        assert measured == pytest.approx(exact, rel=0.03, abs=2e-4 * float(power_on_walls(LAMPS[name], 1 << 12)))


def test_spots_and_suns_stay_within_their_cones():
    u = sobol_owen(4096, 4, 1)
    spot = SpotLight("lamp", HERE, DOWN, ONE, 0.7, 0.3)
    beam = Beam(np.array([[-1, -1, -1], [1, 1, 1]]), np.zeros(3), 0.3)
    cosine = -kind_of(spot).emit(spot, u, beam).directions[:, 2]
    assert cosine.min() >= np.cos(0.35) - 1e-6 and cosine.min() < np.cos(0.34)
    sun = SunLight("sun", DOWN, ONE, 0.2)
    angle = np.arccos(np.clip(-kind_of(sun).emit(sun, u, beam).directions[:, 2], -1, 1))
    assert angle.max() <= 0.1 + 1e-3 and angle.max() > 0.099
    assert np.mean(angle < 0.1 / np.sqrt(2)) == pytest.approx(0.5, abs=0.01)


def test_a_sun_lights_a_cube_by_its_silhouette_however_small_the_focus():
    sun = SunLight("sun", DOWN, ONE, 0.0)
    context = LightContext(build.scene([build.cube()], [build.material("grey", 0.5)], [sun]))
    for radius in (0.02, 5.0):
        paths = lamp_paths(context, sun, 0, np.arange(1 << 14), beam_of(context, radius), 1, 0)
        assert paths.flux[:, 0].sum() / paths.count == pytest.approx(0.5 * 4.0, rel=0.01)


@pytest.mark.parametrize("bounces", [0, 1, 2, 5])
def test_n_bounces_miss_the_nth_power_of_the_albedo(bounces):
    context = LightContext(build.closed_box(0.6))
    paths = lamp_paths(context, LAMPS["point"], 0, np.arange(1 << 14), beam_of(context), bounces, 3)
    expected = 4 * np.pi * sum(0.6**k for k in range(1, bounces + 1))
    assert paths.flux[:, 0].sum() / paths.count == pytest.approx(expected, rel=0.01)
    assert paths.bounce.size == 0 or paths.bounce.max() == bounces


def test_a_closed_furnace_and_a_block_under_the_sky_get_their_power():
    furnace = LightContext(build.cube_furnace(0.5, 1.0))
    paths = emitter_paths(furnace, np.arange(8192), None, 0)
    by_bounce = np.bincount(paths.bounce, paths.flux[:, 0])[:4] / paths.count
    # Both faces emit, and what leaves outwards meets nothing.
    inside = 24 * np.pi
    assert np.allclose(by_bounce, inside * np.array([2, 0.5, 0.25, 0.125]), rtol=0.03)
    block = LightContext(build.scene([build.cube()], [build.material("grey", 0.5)], world=2.0))
    paths = world_paths(block, np.arange(1 << 14), beam_of(block), 1, 0)
    assert paths.flux[:, 1].sum() / paths.count == pytest.approx(0.5 * 2 * np.pi * 24, rel=0.01)


def test_a_lamp_without_shadows_lights_what_lies_behind():
    sheets = [build.plane("near", 1.0, z=0.0), build.plane("far", 1.0, z=-1e-3)]
    lamp = SpotLight("lamp", np.float32([0, 0, 1]), DOWN, ONE, 0.5, casts_shadow=False)
    context = LightContext(build.scene(sheets, [build.material("grey", 0.5)], [lamp]))
    both = lamp_paths(context, lamp, 0, np.arange(512), beam_of(context), 1, 0)
    one = lamp_paths(context, replace(lamp, casts_shadow=True), 0, np.arange(512), beam_of(context), 1, 0)
    assert both.flux.sum() == pytest.approx(2 * one.flux.sum(), rel=1e-5)


@pytest.mark.parametrize("name", [name for name in LAMPS if name != "parallel"])
def test_the_ray_to_a_point_is_the_one_that_found_it(name):
    context = LightContext(build.closed_box(0.5))
    beam = beam_of(context)
    paths = lamp_paths(context, LAMPS[name], 0, np.arange(256), beam, 1, 0)
    origins, directions, domain, shines = kind_of(LAMPS[name]).connect(LAMPS[name], paths.first, paths.u, beam)
    assert shines.mean() > 0.99
    towards = paths.first - origins
    assert np.allclose(towards / np.linalg.norm(towards, axis=1, keepdims=True), directions, atol=1e-2)
    # Where the frame about a direction flips, a wide lamp's place on it does too.
    assert np.mean(np.abs(domain - paths.domain).max(axis=1) < 1e-3) > 0.97
    assert np.all(dot(paths.first_normal, directions) < 0)


def test_joining_and_taking_paths_keeps_their_lights():
    context = LightContext(build.closed_box(0.6))
    a = lamp_paths(context, LAMPS["point"], 0, np.arange(64), beam_of(context), None, 3)
    b = lamp_paths(context, LAMPS["spot"], 1, np.arange(32), beam_of(context), None, 3)
    both = join([a, b])
    back = both.take_paths(np.arange(64, 96))
    assert both.count == 96 and np.array_equal(back.flux, b.flux) and np.array_equal(back.path, b.path)
    assert np.array_equal(back.source, np.full(32, 1))
