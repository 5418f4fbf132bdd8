"""Which sources changed, and the light of a cache that follows them."""

from dataclasses import replace

import numpy as np
import scene_builders as build

from rtgi_addon.progress import Progress
from rtgi_addon.transport.cache.light_changes import changed_sources
from rtgi_addon.transport.cache.relighting import relit_cache
from rtgi_addon.transport.cache.surface_cache import SurfaceCache
from rtgi_addon.transport.cache.texel_table import SurfaceHits
from rtgi_addon.transport.cache.texels import Focus, TexelLayout
from rtgi_addon.transport.context import LightContext


def lamps(count=12):
    return tuple(build.point_light((0.8 * np.cos(i), 0.8 * np.sin(i), 0.1 * i - 0.6), 0.1 + 0.02 * i, f"lamp {i}")
                 for i in range(count))


def test_only_what_differs_in_light_counts():
    scene = replace(build.closed_box(), lights=lamps(4))
    context = LightContext(scene, 1)

    def changes(lights):
        return changed_sources(context, context.relit(replace(scene, lights=tuple(lights))))

    first, second, third, fourth = scene.lights
    assert changes(scene.lights) == changes([fourth, third, second, first]) == ([], [])
    assert changes([replace(first, name="renamed"), second, third, fourth]) == ([], [])
    assert changes([second, third, fourth]) == ([0], [])
    assert changes([first, second, third, fourth, fourth]) == ([], [4])
    assert changes([first, replace(second, intensity=second.intensity * 2), third, fourth]) == ([1], [1])
    assert changes([first, second, replace(third, casts_shadow=False), fourth]) == ([2], [2])


def test_one_of_many_lamps_changes_as_in_a_fresh_cache():
    """Means over all texels agree within the noise of one choice of sources; the other lamps' light is not sampled again."""
    scene = replace(build.closed_box(0.5), lights=lamps())
    rng = np.random.default_rng(0)

    def prepared(lit):
        context = LightContext(lit, 1)
        cache = SurfaceCache(context, TexelLayout(context.geometry, Focus(np.zeros(3), 2.0, 0.25)), 3, rays=32)
        primitive = np.repeat(np.arange(context.geometry.count, dtype=np.int32), 200)
        u = np.random.default_rng(1).random(len(primitive), np.float32) * np.float32(0.5)
        v = np.random.default_rng(2).random(len(primitive), np.float32) * np.float32(0.5)
        cache.reach([SurfaceHits(primitive, u, v, cache.layout.slots(primitive, u, v, np.ones(len(primitive), bool)))], Progress())
        return cache

    brighter = replace(scene.lights[5], intensity=np.float32([3.0, 1.0, 0.8]), position_world=rng.uniform(-0.5, 0.5, 3))
    other = replace(scene, lights=(*scene.lights[:5], brighter, *scene.lights[6:]))
    cache, fresh = prepared(scene), prepared(other)
    relit = relit_cache(cache, cache.context.relit(other), Progress())
    before, after, expected = (part.rows.irradiance_direct[:-1].mean(axis=0) for part in (cache, relit, fresh))
    np.testing.assert_allclose(after, expected, rtol=0.02)
    assert np.all(np.abs(before - expected) > 0.1 * expected)
    back = relit_cache(cache, cache.context.relit(replace(scene, lights=tuple(reversed(scene.lights)))), Progress())
    np.testing.assert_array_equal(back.rows.irradiance_direct, cache.rows.irradiance_direct)
