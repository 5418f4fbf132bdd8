"""Virtual lights that follow moving lamps."""

from dataclasses import replace

import numpy as np
import pytest
import room_scenes as rooms
import scene_builders as build

from rtgi_addon import techniques
from rtgi_addon.errors import BakeError
from rtgi_addon.progress import Progress
from rtgi_addon.scene import AreaLight, PointLight, SpotLight, SunLight, World
from rtgi_addon.transport.context import LightContext
from rtgi_addon.transport.paths.reference import irradiance_at

VPL = techniques.get("vpl")
ONE = np.ones(3, np.float32)


def bake(scene, seed=0, **settings):
    return VPL.bake(scene, VPL.Settings(**{"lights": 512, "candidates": 4, **settings}), np.random.default_rng(seed), Progress())


def room(lamp):
    """A box with a block on its floor that hides a part of it."""
    block = rooms.moved(build.cube("block", 0.3), (0, 0, -0.6))
    return build.scene([build.cube("room", 1.0, inward=True), block], [build.material("wall", 0.6)], [lamp],
                       volumes=[build.volume(resolution=(2, 2, 1), half_size=0.8)])


def receivers():
    u = np.random.default_rng(0).uniform(-0.9, 0.9, (64, 2)).astype(np.float32)
    points = np.concatenate([np.insert(u[:32], 2, 1.0, axis=1), np.insert(u[32:], 0, 1.0, axis=1)]).astype(np.float32)
    return points, np.repeat(np.float32([[0, 0, -1], [-1, 0, 0]]), 32, axis=0)


def point_at(x):
    return build.point_light((x, 0.3, 0.4), 1.0)


MOVES = {
    "point": lambda t: point_at(0.2 + 0.3 * t),
    "sphere": lambda t: PointLight("lamp", np.float32([0.2 + 0.2 * t, 0, 0.4]), ONE, 0.1, False),
    "spot": lambda t: SpotLight("lamp", np.float32([0.2 * t, 0, 0.8]), np.float32([np.sin(t), 0, -np.cos(t)]), ONE, 1.2, 0.4),
    "area": lambda t: AreaLight("lamp", np.float32([0.3 * t, 0, 0.9]), np.float32([0.2, 0, 0]), np.float32([0, 0.2, 0]),
                                np.float32([0, 0, -1]), 5 * ONE),
}


@pytest.mark.parametrize("kind", MOVES)
def test_a_lamp_that_moves_step_by_step_ends_in_the_right_light(kind):
    points, normals = receivers()
    reference = irradiance_at(LightContext(room(MOVES[kind](1.0))), points, normals, 1024).mean
    means = []
    for seed in range(3):
        field, fractions = bake(room(MOVES[kind](0.0)), seed, lights=1024), []
        for t in np.linspace(0.05, 1.0, 12):
            field = field.relight(room(MOVES[kind](t)))
            fractions.append(field.stats["replaced_fraction"])
        measured = field.irradiance(points, normals)
        means.append(measured.mean())
        assert max(fractions) < 0.25 and sum(fractions) > 0
        assert np.median(np.abs(measured - reference) / reference) < 0.12
        assert np.all(np.isfinite(field.lights.flux)) and 600 < field.lights.count < 1600
    assert np.mean(means) == pytest.approx(reference.mean(), rel=0.05)


@pytest.mark.slow
def test_a_sun_that_turns_is_followed():
    def courtyard(angle):
        sun = SunLight("sun", np.float32([np.sin(angle), 0, -np.cos(angle)]), ONE, 0.01)
        return replace(rooms.courtyard(World.constant(0.0)), lights=(sun,))

    field = bake(courtyard(0.0), lights=1024)
    for angle in np.linspace(0.05, 0.5, 10):
        field = field.relight(courtyard(angle))
    points = np.random.default_rng(0).uniform([0.29, -0.4, 0.1], [0.29, 0.4, 0.9], (64, 3)).astype(np.float32)
    normals = np.tile(np.float32([[-1, 0, 0]]), (64, 1))
    reference = irradiance_at(LightContext(courtyard(0.5)), points, normals, 1024).mean
    assert field.irradiance(points, normals).mean() == pytest.approx(reference.mean(), rel=0.06)


def test_lights_that_stay_lit_stay_where_they_are():
    before = bake(room(point_at(0.2)))
    after = before.relight(room(point_at(0.21)))
    old = {tuple(position) for position in before.lights.positions.tolist()}
    kept = np.mean([tuple(position) in old for position in after.lights.positions.tolist()])
    assert kept > 0.95 and 0 <= after.stats["replaced_fraction"] < 0.05
    same = after.relight(room(point_at(0.21)))
    assert same.stats["replaced_fraction"] == 0 and np.array_equal(same.lights.flux, after.lights.flux)


def test_colour_alone_replaces_nothing_and_a_jump_replaces_everything():
    field = bake(room(point_at(0.2)))
    red = field.relight(room(build.point_light((0.2, 0.3, 0.4), (2.0, 1.0, 0.0))))
    assert red.stats["replaced_fraction"] == 0 and np.array_equal(red.lights.positions, field.lights.positions)
    assert np.allclose(red.lights.flux[:, 0], 2 * red.lights.flux[:, 1]) and not red.lights.flux[:, 2].any()
    spot = SpotLight("lamp", np.float32([0, 0, 0.8]), np.float32([0, 0, -1]), ONE, 1.0)
    assert field.relight(room(spot)).stats["replaced_fraction"] == 1.0


def test_added_and_removed_lamps_and_a_new_world():
    field = bake(room(point_at(0.2)))
    scene = room(point_at(0.2))
    two = replace(scene, lights=(*scene.lights, point_at(-0.2)))
    points, normals = receivers()
    more = field.relight(two)
    assert set(np.unique(more.lights.source)) == {0, 1}
    assert more.irradiance(points, normals).mean() == pytest.approx(
        irradiance_at(LightContext(two), points, normals, 512).mean.mean(), rel=0.06)
    back = more.relight(scene)
    assert set(np.unique(back.lights.source)) == {0}
    open_scene = rooms.courtyard(World.constant(1.0))
    field = bake(open_scene).relight(replace(open_scene, world=World.constant(2.0)))
    up = np.float32([[0, 0, 1]])
    assert field.irradiance(np.float32([[-1, 0, 0.01]]), up).mean() > 5.0
    with pytest.raises(BakeError, match="geometry has"):
        field.relight(scene)


def test_a_slowly_moving_lamp_flickers_less_than_fresh_lights_would():
    points, normals = receivers()
    field = bake(room(point_at(0.0)))
    followed, fresh = [], []
    for step in range(16):
        scene = room(point_at(0.005 * (step + 1)))
        field = field.relight(scene)
        followed.append(field.irradiance(points, normals).mean(axis=1))
        fresh.append(bake(scene, seed=step).irradiance(points, normals).mean(axis=1))

    def flicker(frames):
        frames = np.array(frames, np.float64)
        time = np.arange(len(frames))
        smooth = np.polynomial.polynomial.polyval(time, np.polynomial.polynomial.polyfit(time, frames, 2)).T
        return np.median((frames - smooth).std(axis=0) / frames.mean(axis=0))

    assert flicker(followed) < 0.02 and flicker(followed) < 0.5 * flicker(fresh)


def test_paths_stay_even_while_a_lamp_wanders():
    field = bake(room(point_at(0.0)), lights=256)
    for step in range(40):
        angle = 0.15 * step
        field = field.relight(room(build.point_light((0.5 * np.cos(angle), 0.5 * np.sin(angle), 0.4), 1.0)))
    power = field._set.paths.power[:, 0]
    # The cells of independent points vary by 53 % (Kiang 1966 for the plane), and counting them by 8 samples adds some 35 %.
    assert power.sum() == pytest.approx(4 * np.pi, rel=1e-3) and power.std() / power.mean() < 0.55
