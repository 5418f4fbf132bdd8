"""Probes whose first rays were traced before their bake: the bake is the same, and takes the rest."""

from dataclasses import replace

import numpy as np
import pytest
import room_scenes as rooms
import scene_builders as build

from rtgi_addon import techniques
from rtgi_addon.progress import Progress
from rtgi_addon.techniques.base import seed_of
from rtgi_addon.techniques.lattice.placement import place
from rtgi_addon.techniques.probes.bake import Begun, surface_cache
from rtgi_addon.techniques.probes.gather import GROUP
from rtgi_addon.techniques.probes.settings import ProbeSettings
from rtgi_addon.techniques.probes.started import PROBE_RAYS, lattice_key, rounded_out, start_probes, that_fit
from rtgi_addon.transport.context import LightContext

COARSE, SEED = ProbeSettings(error=0.1), seed_of(np.random.default_rng(0))


@pytest.fixture(scope="module")
def scene():
    """A room with a glowing panel and a lamp, and an odd lattice: its last group is a part of one."""
    room = replace(rooms.panel_room(emission=2.0), lights=(build.point_light((0.3, -0.2, 0.4)),))
    return replace(room, volumes=(build.volume(resolution=(5, 4, 3), half_size=0.9),))


def begun(scene, rows, context=None):
    """What a bake of ``scene`` may go on with where the probes ``rows`` were started, some before the others."""
    context = context or LightContext(scene, 1)
    volume, cache = scene.volumes[0], surface_cache(context, scene.volumes, COARSE, SEED)
    every = place(context, scene.volumes, True, Progress())
    parts = [start_probes(context, cache, COARSE, volume, 0, SEED, np.sort(some), every.take(np.sort(some)), Progress())
             for some in (rows[::2], rows[1::2])]
    return Begun(context, cache, COARSE.target, (parts[0].joined(parts[1]),))


def bake(scene, settings, lent):
    return techniques.get("probes").bake(scene, settings, np.random.default_rng(0), Progress(), threads=1, begun=lent)


def same(one, other):
    for mine, its in zip(one.grids(), other.grids(), strict=True):
        for name in ("sh", "validity", "visibility", "offset_world"):
            assert np.array_equal(getattr(mine, name), getattr(its, name)), name


@pytest.mark.parametrize("order", [1, 2])
def test_a_bake_that_goes_on_ends_where_it_would_have(scene, order):
    """To the last bit, with what it takes to relight it; a cache that was begun alike is lent to both."""
    rows, settings = np.array([0, 1, 2, 3, 4, 5, 6, 7, 11, 17, 40, 41, 59]), replace(COARSE, order=order)
    lent = begun(scene, rows)
    alone, on = bake(scene, settings, replace(lent, started=())), bake(scene, settings, begun(scene, rows))
    same(alone, on)
    assert alone.stats["probe_rays"] == on.stats["probe_rays"]
    moved = replace(scene, lights=(build.point_light((-0.4, 0.5, 0.6)),))
    before, after = (field.relight(moved).irradiance(np.zeros((1, 3)), np.eye(3)[2:]) for field in (alone, on))
    assert before.any() and np.allclose(before, after, rtol=1e-5)


def test_probes_that_nobody_wants_stay_dark(scene):
    lent = begun(scene, np.arange(16))
    wanted = np.ones((3, 4, 5), bool)
    wanted.reshape(-1)[:4] = False
    some = replace(scene, volumes=(replace(scene.volumes[0], wanted=wanted),))
    alone, on = (bake(some, COARSE, one) for one in (replace(begun(scene, np.arange(16)), started=()), lent))
    same(alone, on)
    assert not on.grids()[0].validity.reshape(-1)[:4].any()
    same(alone.relight(some), on.relight(some))


def test_only_the_probes_of_that_very_bake_are_taken(scene):
    lent, (volume,) = begun(scene, np.arange(8)).started, scene.volumes
    assert len(that_fit(lent, (volume,), COARSE, SEED)) == 1 and lattice_key(volume) == lattice_key(lent[0].volume)
    other = replace(volume, resolution=(5, 4, 4))
    for volumes, settings, seed in (((other,), COARSE, SEED), ((other, volume), COARSE, SEED), ((volume,), COARSE, SEED + 1),
                                    ((volume,), replace(COARSE, order=3), SEED), ((volume,), replace(COARSE, rays=64), SEED),
                                    ((volume,), replace(COARSE, bounces=1), SEED),
                                    ((volume,), replace(COARSE, virtual_offset=False), SEED)):
        assert not that_fit(lent, volumes, settings, seed)


def test_groups_that_are_half_there_are_made_whole(scene):
    volume = scene.volumes[0]
    assert list(rounded_out(volume, 0, np.array([0, 2, 4, 6, 9]))) == [*range(GROUP), 9]
    # Numbers of the bake make the groups, not those of the volume; and none lies beyond its ends.
    assert list(rounded_out(volume, 4, np.array([0, 1, 2, 3]))) == [0, 1, 2, 3]
    assert list(rounded_out(volume, 0, np.array([56, 57, 58, 59]))) == [56, 57, 58, 59]
    assert PROBE_RAYS < 256


def test_places_that_are_known_are_taken(scene):
    context, rows = LightContext(scene, 1), np.array([3, 30, 31])
    every = place(context, scene.volumes, True, Progress())
    shifted = replace(every.take(rows), positions=every.positions[rows] + 0.25)
    told = place(context, scene.volumes, True, Progress(), [(rows, shifted)])
    assert np.array_equal(told.positions[rows], shifted.positions)
    rest = np.setdiff1d(np.arange(60), rows)
    assert np.array_equal(told.positions[rest], every.positions[rest])
