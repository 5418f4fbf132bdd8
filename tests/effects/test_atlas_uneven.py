"""Where light is uneven, and how many texels of an object's map that gives its islands."""

from dataclasses import replace

import numpy as np
import pytest
import scene_builders as build
from atlas_scenes import room

from rtgi_addon.effects.atlas.settings import AtlasSettings
from rtgi_addon.effects.atlas.uneven import LEAST, MOST, shares, uneven
from rtgi_addon.scene.lights import ALL_LIGHT


def test_even_light_asks_for_nothing():
    found = uneven(room(build.cube_furnace(0.5, 1.0)), AtlasSettings())
    known = np.isfinite(found.need)
    assert known.sum() > 200 and np.abs(found.need[known]).max() < 1e-4


def test_light_that_bends_is_where_it_bends():
    """A lamp near the ceiling: light there falls off within a texel, on the floor it does not."""
    built = room(build.closed_box(0.2, 2.0, light_position=(0.3, 0.2, 0.8)))
    built = replace(built, lights=(replace(built.lights[0], bake=ALL_LIGHT),))
    found, mesh = uneven(built, AtlasSettings()), built.meshes[0]
    uv, corners = mesh.uv_layers["Lightmap"], mesh.vertices_local[mesh.triangles]
    middle = np.einsum("kc,tcx->tkx", np.random.default_rng(1).dirichlet(np.ones(3), 200), uv)
    need = np.array([np.nanmean(found.of("room", places)) for places in middle])
    height = corners[..., 2].mean(axis=1)
    ceiling, floor = need[height == height.max()].mean(), need[height == height.min()].mean()
    assert ceiling > 10.0 * abs(floor)


@pytest.mark.parametrize("need", [[1.0, 1.0, 1.0], [1.0, 2.0, 16.0], [np.nan, 0.5, 3.0], [-0.1, 1e-9, 2.0]])
def test_shares_keep_the_number_of_texels(need):
    area = np.array([2.0, 3.0, 1.5])
    found = shares(np.array(need), area)
    assert found.min() >= LEAST and found.max() <= MOST
    assert abs(np.sum(area * found**2) / area.sum() - 1.0) < 1e-6
    assert np.all(np.diff(found[np.argsort(np.nan_to_num(need))]) >= 0)


def test_a_sixteenth_of_the_need_makes_texels_twice_as_large():
    found = shares(np.array([1.0, 16.0]), np.array([1.0, 1.0]))
    assert np.isclose(found[1] / found[0], 2.0)


def test_nothing_known_leaves_islands_even():
    assert np.all(shares(np.array([np.nan, 0.0]), np.ones(2)) == 1.0)
