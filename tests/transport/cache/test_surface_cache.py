"""The surface cache against closed forms and against the path reference, which shares none of its texels.

Rooms are compared by mean irradiance over points spread evenly on all surfaces, where texel size cancels. Seeds are fixed.
"""

from dataclasses import replace

import numpy as np
import pytest
import room_scenes as rooms
import scene_builders as build

from rtgi_addon.errors import BakeError
from rtgi_addon.progress import Progress
from rtgi_addon.scene import SunLight, World
from rtgi_addon.transport.cache.checkpoint import cache_state, restore_cache
from rtgi_addon.transport.cache.relighting import relit_cache
from rtgi_addon.transport.cache.surface_cache import SurfaceCache
from rtgi_addon.transport.cache.texel_table import SurfaceHits
from rtgi_addon.transport.cache.texels import Focus, TexelLayout
from rtgi_addon.transport.context import LightContext
from rtgi_addon.transport.paths import reference as path


def prepared(scene, size=0.25, rays=64, seed=1, threads=None, **options):
    context = LightContext(scene, threads)
    low, high = context.geometry.bounds()
    focus = Focus(0.5 * (low + high), float(np.linalg.norm(high - low)) / 2, size)
    return SurfaceCache(context, TexelLayout(context.geometry, focus), seed, rays, **options)


def surface_hits(cache, n=3000, seed=5, back=False):
    """Points spread evenly over the fronts (or backs) of all surfaces."""
    geometry, rng = cache.context.geometry, np.random.default_rng(seed)
    primitive = rng.choice(geometry.count, n, p=geometry.areas / geometry.areas.sum(dtype=np.float64)).astype(np.int32)
    root, second = np.sqrt(rng.random(n)), rng.random(n)
    u, v = (root * (1 - second)).astype(np.float32), (root * second).astype(np.float32)
    return SurfaceHits(primitive, u, v, cache.layout.slots(primitive, u, v, np.full(n, not back)))


def solved(cache, hits, bounces=None, bright=True):
    """Texels of the hits; afterwards the cache holds their irradiance."""
    texel = cache.reach([hits], Progress())[0]
    cache.solve(bounces, 1e-5, Progress(), bright)
    return texel


def total(cache, texel):
    return cache.irradiance_rest[texel].astype(float) + cache.rows.irradiance_direct[texel]


def reference(cache, hits, samples=32, direct=True):
    """The path reference's irradiance (n, 3) at the hits, with that of lamps or without."""
    points = cache.context.geometry.points(hits.primitive, hits.u, hits.v)
    normals = cache.context.geometry.normals_world[hits.primitive]
    return path.irradiance_at(cache.context, points, normals, samples, seed=11, direct=direct).mean.astype(float)


def agree(runs, expected, bias, noise):
    """Runs (seeds, n, 3) of the cache and the reference (n, 3) at the same points have one mean, within ``bias`` of it and four
    standard errors, which are themselves below ``noise``: of the difference over points, and over seeds."""
    runs, scale = np.asarray(runs), expected.mean(axis=0)
    difference = runs.mean(axis=0) - expected
    error = np.sqrt(difference.var(axis=0, ddof=1) / len(difference) + runs.mean(axis=1).var(axis=0, ddof=1) / len(runs))
    assert np.all(error < noise * scale), error / scale
    assert np.all(np.abs(difference.mean(axis=0)) < bias * scale + 4 * error), (difference.mean(axis=0) / scale, error / scale)


@pytest.mark.parametrize("albedo", [0.0, 0.5, 0.9])
def test_furnace_is_exact(albedo):
    """E = π·Le/(1 − ρ) in every texel, without noise."""
    cache = prepared(build.cube_furnace(albedo, emission=2.0), size=0.5)
    hits = surface_hits(cache)
    texel = solved(cache, hits)
    np.testing.assert_allclose(total(cache, texel), 2 * np.pi / (1 - albedo), rtol=3e-4)


@pytest.mark.parametrize("bounces", [1, 2, 3, 6])
def test_a_number_of_bounces_is_a_partial_sum(bounces):
    """A probe's look at the wall is one bounce, so the wall's own irradiance has been reflected bounces − 1 times."""
    cache = prepared(build.cube_furnace(0.5, emission=1.0), size=0.5)
    texel = solved(cache, surface_hits(cache), bounces)
    np.testing.assert_allclose(total(cache, texel), np.pi * (2 - 0.5 ** (bounces - 1)), rtol=1e-4)


def test_unit_sphere():
    """ρ = ½, I = π at the centre: π direct and π indirect everywhere."""
    cache = prepared(build.integrating_sphere(subdivisions=4), size=0.2)
    texel = solved(cache, surface_hits(cache))
    np.testing.assert_allclose(cache.rows.irradiance_direct[texel], np.pi, rtol=0.01)
    np.testing.assert_allclose(cache.irradiance_rest[texel], np.pi, rtol=0.02)
    assert cache.irradiance_rest[texel].mean() == pytest.approx(np.pi, rel=0.005)


@pytest.mark.parametrize("position", [(0.5, 0.3, 0.1), (-0.6, 0.0, 0.6)])
def test_integrating_sphere(position):
    """E_ind = Φ/(4πR²)·ρ/(1 − ρ) on the wall for any position of the lamp."""
    cache = prepared(build.integrating_sphere(0.8, 1.0, light_position=position), size=0.15, rays=128)
    texel = solved(cache, surface_hits(cache))
    indirect = cache.irradiance_rest[texel]
    assert indirect.mean() == pytest.approx(4.0, rel=0.01)
    assert np.sqrt(np.mean((indirect / 4.0 - 1) ** 2)) < 0.03


COMPARED = {
    "closed box": build.closed_box(0.7, light_position=(0.3, -0.2, 0.5)),
    "emissive panel": rooms.panel_room(0.7),
    "sun patch": rooms.sun_patch_room(),
    "thirty lamps": rooms.many_lamps(30),
    "textures": rooms.textured_room(),
    "cut-outs": rooms.screen_room(),
    "sky with a sun": rooms.courtyard(),
}


@pytest.mark.parametrize("scene", COMPARED.values(), ids=list(COMPARED))
def test_mean_irradiance_is_the_path_references(scene):
    """Over all fronts, averaged over four seeds, within 0.5 % and four standard errors of at most 1.5 %."""
    # The edge of the sun patch is sharper than texels, which says nothing about the light it reflects.
    direct, samples = (False, 128) if scene.name == "sun_patch_room" else (True, 32)
    runs = []
    for seed in range(4):
        cache = prepared(scene, size=0.15, seed=seed)
        hits = surface_hits(cache)
        texel = solved(cache, hits)
        runs.append(total(cache, texel) if direct else cache.irradiance_rest[texel])
    agree(runs, reference(cache, hits, samples, direct), 0.005, 0.015)


def test_a_sun_patch_is_sampled_as_a_light():
    """The patch gives most of the light: without sampling it, the same texels are many times noisier."""
    noise = []
    for bright in (True, False):
        runs = []
        for seed in range(6):
            cache = prepared(rooms.sun_patch_room(), size=0.2, rays=32, seed=seed)
            texel = solved(cache, surface_hits(cache, 2000), bright=bright)
            assert (cache.bright.count > 0) == bright
            runs.append(cache.irradiance_rest[texel, 0])
        runs = np.stack(runs).astype(float)
        noise.append(np.sqrt(runs.var(axis=0, ddof=1).mean()) / runs.mean())
    assert noise[0] < 0.5 * noise[1]


def test_smooth_normals_agree_with_the_path_reference():
    """A coarse sphere with interpolated normals in a room: rays about the shading normal, none through the face."""
    ball = build.sphere("ball", 0.6, subdivisions=1)
    ball = replace(ball, corner_normals_local=ball.vertices_local[ball.triangles])
    scene = build.scene([build.cube("room", 1.0, inward=True), ball], [build.material("wall", 0.6)],
                        [build.point_light((0.7, 0.6, 0.7), 2.0)])
    runs = []
    for seed in range(3):
        cache = prepared(scene, size=0.15, seed=seed)
        hits = surface_hits(cache)
        # The reference takes points by one normal, which on the flat walls is both.
        hits = hits.take(np.flatnonzero(hits.primitive < 12))
        runs.append(total(cache, solved(cache, hits)))
    agree(runs, reference(cache, hits), 0.005, 0.015)


def test_a_dark_room_stays_exactly_dark():
    """The floor runs on under the wall; not one texel beyond it gets any light."""
    cache = prepared(rooms.two_rooms(), size=0.3)
    hits = surface_hits(cache, 6000)
    points = cache.context.geometry.points(hits.primitive, hits.u, hits.v)
    texel = solved(cache, hits)
    dark, lit = points[:, 0] > 0.026, points[:, 0] < -0.026
    assert not total(cache, texel[dark]).any()
    assert total(cache, texel[lit]).min() > 0.1


def lit_differently(scene):
    """Other lamps and another sky over the same geometry."""
    sun = SunLight("sun", np.float32([0.6, 0, -0.8]), np.float32([3, 2, 1]), 0.02)
    return (replace(scene, lights=(build.point_light((-0.5, 0.4, 0.1), (0.2, 1.0, 2.0)), sun)),
            replace(scene, world=rooms.sunny_world(sun=100.0)), replace(scene, lights=(), world=World.constant((0.5, 0.2, 1.0))))


@pytest.mark.parametrize("bounces", [None, 2])
def test_relighting_equals_a_fresh_cache(bounces):
    """The same hits under other lamps, another sky, and both: bit for bit what a bake from scratch on the same texels gives."""
    scene = rooms.sun_patch_room()
    cache = prepared(scene)
    hits = surface_hits(cache)
    texel = solved(cache, hits, bounces)
    before = total(cache, texel).copy()
    for other in lit_differently(scene):
        relit = relit_cache(cache, cache.context.relit(other), Progress())
        relit.solve(bounces, 1e-5, Progress(), bright=False)
        fresh = prepared(other)
        assert np.array_equal(solved(fresh, hits, bounces, bright=False), texel)
        np.testing.assert_array_equal(total(relit, texel), total(fresh, texel))
        assert not np.allclose(total(relit, texel).mean(), before.mean(), rtol=0.05)
    np.testing.assert_array_equal(total(cache, texel), before)


def test_relighting_refuses_other_geometry():
    scene = rooms.sun_patch_room()
    cache = prepared(scene)
    other = replace(scene, meshes=(rooms.moved(scene.meshes[0], (0, 0, 0.1)), *scene.meshes[1:]))
    with pytest.raises(BakeError, match="geometry"):
        cache.context.relit(other)


@pytest.mark.parametrize("scene", [rooms.sun_patch_room(), rooms.panel_room(), rooms.many_lamps(12)],
                         ids=lambda scene: scene.name)
def test_a_restored_cache_goes_on_to_the_same_bytes(scene):
    results = []
    for interrupted in (False, True):
        cache = prepared(scene)
        first, second = surface_hits(cache, 300), surface_hits(cache, 3000, seed=6, back=True)
        solved(cache, first)
        if interrupted:
            state = {name: value.copy() for name, value in cache_state(cache).items()}
            cache = prepared(scene)
            restore_cache(cache, state)
        texel = solved(cache, second)
        results.append((texel.tobytes(), *(value.tobytes() for _, value in sorted(cache_state(cache).items()))))
    assert results[0] == results[1]


@pytest.mark.parametrize("scene", [rooms.sun_patch_room(), rooms.many_lamps(12), rooms.screen_room()],
                         ids=lambda scene: scene.name)
def test_threads_do_not_change_a_bit(scene):
    results = set()
    for threads in (1, 2, 5):
        cache = prepared(scene, threads=threads)
        hits = surface_hits(cache)
        texel = solved(cache, hits)
        results.add((texel.tobytes(), cache.irradiance_rest.tobytes(), cache.rows.irradiance_direct.tobytes()))
    assert len(results) == 1


def test_seeds_give_other_noise():
    values = []
    for seed in (1, 2):
        cache = prepared(build.closed_box(0.7, light_position=(0.3, -0.2, 0.5)), seed=seed)
        values.append(total(cache, solved(cache, surface_hits(cache))))
    assert not np.array_equal(*values)


def test_a_cache_that_no_ray_has_reached_is_solved_too():
    """Then it goes on as if that had not been asked."""
    scene, results = rooms.sun_patch_room(), []
    for early in (True, False):
        cache = prepared(scene)
        if early:
            cache.solve(None, 1e-5, Progress())
            assert cache.count == 0 and not cache.irradiance_rest.any()
        texel = solved(cache, surface_hits(cache))
        assert cache.bright.count > 0
        results.append(total(cache, texel))
    np.testing.assert_array_equal(*results)


def test_too_many_texels_are_refused_with_a_remedy():
    cache = prepared(build.closed_box(), size=0.05, max_texels=500)
    with pytest.raises(BakeError, match="texel size"):
        cache.reach([surface_hits(cache)], Progress())
