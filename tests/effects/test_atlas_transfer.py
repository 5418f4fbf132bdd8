"""A light atlas that knows what its texels make of any light, against bakes under the light in question."""

from dataclasses import replace

import numpy as np
import pytest
from atlas_scenes import in_atlas
from scene_builders import material, mesh, plane, point_light, scene, volume

from rtgi_addon.effects.atlas.bake import bake_atlas
from rtgi_addon.effects.atlas.relight import relit_atlas
from rtgi_addon.effects.atlas.settings import AtlasSettings
from rtgi_addon.errors import UsageError
from rtgi_addon.numerics import dome
from rtgi_addon.progress import Progress
from rtgi_addon.scene import SunLight, World
from rtgi_addon.techniques.transfer import TECHNIQUE
from rtgi_addon.techniques.transfer.lighting import DistantSun, Lighting
from rtgi_addon.techniques.transfer.settings import TransferSettings

FEW = AtlasSettings(density=4.0, rays=256, suns=4)


def court(world=0.5, lights=()):
    """A floor in the atlas beside a coloured wall, under a uniform sky, with a lamp of the group `lamp`."""
    wall = mesh("wall", [[1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [1.0, 1.0, 1.5], [1.0, -1.0, 1.5]], [[0, 2, 1], [0, 3, 2]], 1)
    lamp = replace(point_light((0.0, 0.0, 1.0), 3.0), light_group="lamp")
    built = scene([plane("floor", 1.0), wall], [material("grey", 0.6), material("red", np.array([0.8, 0.3, 0.2]))], [lamp, *lights],
                  world=world, volumes=[volume(half_size=0.3, center=(0.0, 0.0, 0.8), resolution=(2, 2, 2))], name="court")
    return in_atlas(built, 0, [[(0, 0), (1, 0), (1, 1)], [(0, 0), (1, 1), (0, 1)]])


@pytest.fixture(scope="module")
def baked():
    """The field of the court's transfer, and the atlas beside it."""
    settings = TransferSettings(rays=64, sun_side=3, sites=0, cache_rays=32)
    field = TECHNIQUE.bake(court(), settings, np.random.default_rng(0), Progress())
    return field, bake_atlas(court(), field, FEW).atlas


def under(baked, lighting):
    field, atlas = baked
    return relit_atlas(atlas, field.transfer, lighting)


def off(found, expected):
    light, truth = found.irradiance[expected.known], expected.irradiance[expected.known]
    return np.linalg.norm(light - truth) / np.linalg.norm(truth)


def test_the_bake_s_own_light_is_the_atlas(baked):
    same = under(baked, Lighting())
    assert np.allclose(same.coefficients, baked[1].coefficients, atol=1e-5)
    assert off(baked[1], bake_atlas(court(), None, FEW).atlas) < 0.01


def test_groups_are_exact(baked):
    dimmed = under(baked, Lighting(groups={"lamp": np.full(3, 0.25)}))
    none = under(baked, Lighting(groups={"lamp": np.zeros(3)}))
    full = baked[1].coefficients
    assert np.allclose(dimmed.coefficients, 0.25 * full + 0.75 * none.coefficients, atol=1e-5)
    with pytest.raises(UsageError, match="no light group 'lanterns'"):
        under(baked, Lighting(groups={"lanterns": np.ones(3)}))


def test_another_sky_is_as_a_bake_under_it(baked):
    rows = np.linspace(0.2, 1.4, 32, dtype=np.float32)[:, None, None]
    sky = World(np.tile(rows * np.array([1.0, 0.9, 0.7], np.float32), (1, 64, 1)))
    fresh = bake_atlas(replace(court(), world=sky), None, FEW).atlas
    assert off(under(baked, Lighting(world=sky)), fresh) < 0.02


def test_a_sun_of_the_table_is_as_a_bake_under_it(baked):
    towards = dome.directions(4, False)[6]
    sun = SunLight("sun", -towards, np.full(3, 4.0, np.float32))
    fresh, dark = (bake_atlas(court(lights=lights), None, FEW).atlas for lights in ([sun], []))
    found = under(baked, Lighting(suns=(DistantSun(towards, np.full(3, 4.0)),)))
    bounce = np.linalg.norm((fresh.irradiance - dark.irradiance)[fresh.known])
    assert np.linalg.norm((found.irradiance - fresh.irradiance)[fresh.known]) < 0.06 * bounce


def test_colour_of_the_wall_is_in_what_it_reflects(baked):
    atlas = baked[1]
    bounce = atlas.transfer.bounce[..., 4, 0][:, atlas.known].mean(axis=1)
    assert bounce[0] > 2.0 * bounce[1] > 2.0 * bounce[2] > 0.0
    assert np.all(atlas.transfer.sky[..., 4, 0][atlas.known] > 0.0)


def test_without_suns_none_are_followed():
    settings = TransferSettings(rays=64, sun_side=3, sites=0, cache_rays=32)
    field = TECHNIQUE.bake(court(), settings, np.random.default_rng(0), Progress())
    atlas = bake_atlas(court(), field, AtlasSettings(density=2.0, rays=16, suns=0)).atlas
    assert not atlas.transfer.follows_suns and atlas.transfer.suns.shape[-1] == 0
    lit = relit_atlas(atlas, field.transfer, Lighting(world=World.constant(1.0), suns=(DistantSun(
        np.array([0.0, 0.0, 1.0]), np.ones(3)),)))
    assert np.isfinite(lit.coefficients).all()
