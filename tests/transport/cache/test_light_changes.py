"""Which sources changed, the light of a cache that follows them, and that of one which finds it anew."""

from dataclasses import replace

import numpy as np
import pytest
import scene_builders as build

from rtgi_addon.progress import Progress
from rtgi_addon.scene import SunLight, World
from rtgi_addon.scene.material import Channel
from rtgi_addon.transport.cache.light_changes import changed_sources
from rtgi_addon.transport.cache.relighting import light_again, relit_cache
from rtgi_addon.transport.cache.surface_cache import SurfaceCache, Traced
from rtgi_addon.transport.cache.texel_table import SurfaceHits
from rtgi_addon.transport.cache.texels import Focus, TexelLayout
from rtgi_addon.transport.context import LightContext


def lamps(count=12):
    return tuple(build.point_light((0.8 * np.cos(i), 0.8 * np.sin(i), 0.1 * i - 0.6), 0.1 + 0.02 * i, f"lamp {i}")
                 for i in range(count))


def prepared(lit):
    """The cache of a scene, or of a context, all of whose fronts are in use."""
    context = lit if isinstance(lit, LightContext) else LightContext(lit, 1)
    cache = SurfaceCache(context, TexelLayout(context.geometry, Focus(np.zeros(3), 2.0, 0.25)), 3, rays=32)
    primitive = np.repeat(np.arange(context.geometry.count, dtype=np.int32), 200)
    u = np.random.default_rng(1).random(len(primitive), np.float32) * np.float32(0.5)
    v = np.random.default_rng(2).random(len(primitive), np.float32) * np.float32(0.5)
    cache.reach([SurfaceHits(primitive, u, v, cache.layout.slots(primitive, u, v, np.ones(len(primitive), bool)))], Progress())
    return cache


def veiled_court(color=(0.9, 0.4, 0.2)):
    """A floor and a lampshade, through which light passes, below coloured foil; nothing shines."""
    foil = replace(build.material("foil", 0.1), alpha=Channel.of(0.5), tint=Channel.of(np.array(color)))
    shade = replace(build.material("shade", 0.3), translucency=Channel.of(0.4))
    meshes = [build.plane("floor", 2.0, -1.0), build.plane("foil", 2.0, 1.0, 1), build.cube("shade", 0.4, material_index=2)]
    return build.scene(meshes, [build.material("grey", 0.6), foil, shade], name="veiled court")


SKY = World(np.random.default_rng(6).random((8, 16, 3)).astype(np.float32))


@pytest.mark.parametrize(("shown", "clear"), [
    ({"world": SKY}, False), ({"world": SKY}, True),
    ({"lights": (SunLight("sun", np.array([0.3, 0.2, -0.9]), np.full(3, 2.0, np.float32)),)}, False),
    ({"lights": (replace(lamps(1)[0], max_bounces=1), *lamps(3)[1:])}, False), ({"lights": lamps()}, False),
    ({"materials": (build.material("lava", 0.6, 2.0), *veiled_court().materials[1:])}, False),
], ids=["world", "world, nothing colours it", "sun", "some with a limit of bounces", "many", "emission"])
def test_light_found_anew_is_that_of_a_fresh_cache(shown, clear):
    """To the digit, whatever shines, through colours and from other sides: the rays are the same."""
    unlit = veiled_court((1.0, 1.0, 1.0) if clear else (0.9, 0.4, 0.2))
    dark, lit = prepared(unlit), replace(unlit, **shown)
    surfaces = None if "materials" in shown else dark.context
    context = LightContext(lit, 1, same_surfaces=surfaces)
    found, fresh = dark.under(context, Traced(dark.table, dark.form_factors, dark.rows)), prepared(context)
    light_again(found, Progress())
    arriving = fresh.rows.irradiance_sky + fresh.rows.irradiance_direct + fresh.rows.irradiance_emission
    assert fresh.rows.passing.size and np.any(arriving) and clear != any(np.any(tints != 1) for tints in fresh.form_factors.tints)
    for name, rows in fresh.rows.arrays().items():
        np.testing.assert_array_equal(found.rows.arrays()[name], rows, name)
    for cache in (found, fresh):
        cache.solve(None, 1e-4, Progress())
    np.testing.assert_array_equal(found.irradiance_rest, fresh.irradiance_rest)


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

    brighter = replace(scene.lights[5], intensity=np.float32([3.0, 1.0, 0.8]), position_world=rng.uniform(-0.5, 0.5, 3))
    other = replace(scene, lights=(*scene.lights[:5], brighter, *scene.lights[6:]))
    cache, fresh = prepared(scene), prepared(other)
    relit = relit_cache(cache, cache.context.relit(other), Progress())
    before, after, expected = (part.rows.irradiance_direct[:-1].mean(axis=0) for part in (cache, relit, fresh))
    np.testing.assert_allclose(after, expected, rtol=0.02)
    assert np.all(np.abs(before - expected) > 0.1 * expected)
    back = relit_cache(cache, cache.context.relit(replace(scene, lights=tuple(reversed(scene.lights)))), Progress())
    np.testing.assert_array_equal(back.rows.irradiance_direct, cache.rows.irradiance_direct)
