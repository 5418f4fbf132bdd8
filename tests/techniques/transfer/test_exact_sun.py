"""Suns followed by rays: as a bake under them, whatever the table of directions says."""

from dataclasses import replace

import numpy as np
import pytest
import scene_builders as build
from transfer_scenes import bake

from rtgi_addon.errors import Cancelled
from rtgi_addon.progress import Progress
from rtgi_addon.scene import SunLight, World
from rtgi_addon.techniques.transfer.controls import LightControls, controlled


def court(towards, strength=3.0):
    """A block on a floor beside a wall, under a sun and a little sky."""
    towards = np.asarray(towards, np.float64) / np.linalg.norm(towards)
    sun = SunLight("sun", -towards, np.full(3, strength, np.float32))
    wall = build.mesh("wall", [[1.5, -1.5, 0], [1.5, 1.5, 0], [1.5, 1.5, 2], [1.5, -1.5, 2]], [[0, 2, 1], [0, 3, 2]])
    scene = build.scene([build.plane("floor", 1.5), wall, build.cube("block", 0.4)], [build.material("grey", 0.6)], [sun],
                        volumes=(build.volume(resolution=(3, 3, 2), half_size=0.9, center=(0.0, 0.0, 1.0)),))
    return replace(scene, world=World.constant(0.2))


BEFORE, AFTER = (0.2, 0.3, 1.0), (-0.8, 0.35, 0.4)


@pytest.fixture(scope="module")
def field():
    return bake(court(BEFORE), sites=0, rays=4096, cache_rays=256)


def sh_of(field):
    return field.grids()[0].sh.astype(np.float64)


def test_a_sun_between_the_table_s_directions_is_as_in_a_bake_under_it(field):
    fresh, none = (sh_of(bake(court(AFTER, strength), sites=0, rays=4096, cache_rays=256)) for strength in (3.0, 0.0))
    bounce = np.linalg.norm(fresh - none)
    exact = np.linalg.norm(sh_of(field.relight_exactly(court(AFTER))) - fresh) / bounce
    table = np.linalg.norm(sh_of(field.relight(court(AFTER))) - fresh) / bounce
    assert exact < 0.02 < 0.1 < table


def test_sky_and_groups_go_their_usual_way(field):
    other = replace(court(AFTER), world=World.constant(0.6))
    both, sky = sh_of(field.relight_exactly(other)), sh_of(field.relight(replace(court(BEFORE), world=World.constant(0.6))))
    suns = sh_of(field.relight_exactly(court(AFTER))) - sh_of(field.relight(court(BEFORE, 0.0)))
    bounced = sky - sh_of(field.relight(replace(court(BEFORE, 0.0), world=World.constant(0.6))))
    assert np.allclose(both, sky - bounced + suns, atol=1e-4)


def test_the_bake_s_own_sun_asks_for_no_ray(field, monkeypatch):
    monkeypatch.setattr("rtgi_addon.techniques.transfer.field.exact_suns", None)
    assert np.allclose(sh_of(field.relight_exactly(court(BEFORE))), sh_of(field))


def test_it_can_be_broken_off(field):
    progress = Progress()
    progress.cancel()
    with pytest.raises(Cancelled):
        field.relight_exactly(court(AFTER), progress)


def test_wanting_it_changes_no_light():
    scene = court(BEFORE)
    assert controlled(scene, LightControls(exact_sun=True)) is scene
