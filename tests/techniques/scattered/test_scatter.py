"""Scattered probes: where they stand, what is left out, what nodes name; light is read without a step, and not through floors."""

from dataclasses import replace

import numpy as np
import pytest
import room_scenes
import scene_builders as build
from probe_bakes import bake
from scattered_rooms import QUICK, across, places_of, scattered, storeys

from rtgi_addon.errors import BakeError, UsageError
from rtgi_addon.numerics.grid import lattice_points
from rtgi_addon.progress import Progress
from rtgi_addon.scene.scattered import SHARES, named, packed, words
from rtgi_addon.techniques.lattice.field import ProbeField
from rtgi_addon.techniques.scattered.blending import shares
from rtgi_addon.techniques.scattered.floors import candidates
from rtgi_addon.transport.context import LightContext
from rtgi_addon.transport.rays.tracer import SEGMENT


def baked(scene, **settings):
    """The field of ``scene`` by a quick bake."""
    return bake(scene, **{"error": QUICK.error, "max_rays": 512, "cache_rays": 32, **settings})


@pytest.fixture(scope="module")
def house():
    scene = scattered(storeys())
    return scene, baked(scene)


def test_words_hold_the_largest_shares_and_nothing_gets_lost():
    rng = np.random.default_rng(0)
    probes, share = np.argsort(rng.random((200, 40)), axis=1)[:, :7], rng.random((200, 7)) ** 3
    found, of = named(words(probes, share))
    assert np.allclose(of.sum(axis=1), 1.0, atol=1e-6) and np.all(of[:, :-1] >= of[:, 1:] - 1.1 / SHARES)
    largest = np.sort(share, axis=1)[:, :-5:-1]
    assert np.abs(of - largest / largest.sum(axis=1, keepdims=True)).max() <= 1.0 / SHARES
    assert np.all((of == 0) | (np.take_along_axis(probes, np.argsort(-share, axis=1)[:, :4], axis=1) == found))


def test_a_word_is_a_float_without_rounding():
    index = words(np.array([[65535, 1, 2, 3]]), np.ones((1, 4)))
    assert np.array_equal(index.astype(np.float32).astype(np.int64), index)


@pytest.mark.parametrize("count", [1, 37, 128, 129, 1000, 16384, 16385, 65535])
def test_lists_are_packed_with_little_left_over(count):
    nx, ny, nz = packed(count)
    assert count <= nx * ny * nz <= count + ny * nz and max(nx, ny, nz) <= 128


def test_shares_read_what_changes_evenly_as_it_is():
    rng = np.random.default_rng(1)
    probes, places = rng.uniform(-1, 1, (60, 3)), rng.uniform(-0.4, 0.4, (50, 3))
    rows = np.argsort(np.linalg.norm(probes[None] - places[:, None], axis=2), axis=1)
    of, weight = shares(places, probes, rows, np.ones(rows.shape, bool))
    assert np.allclose(weight.sum(axis=1), 1.0)
    off = np.linalg.norm(np.einsum("nk,nkx->nx", weight, probes[of]) - places, axis=1)
    assert np.quantile(off, 0.9) < 0.05


def test_places_are_in_every_storey_and_in_no_floor():
    scene = storeys()
    places = candidates(LightContext(scene, 1), scene.volumes[0], Progress())
    lower, upper = (places[:, 2] < -0.2).sum(), (places[:, 2] > 0.2).sum()
    assert lower >= 32 and upper >= 32 and lower + upper == len(places)
    assert np.abs(places[:, :2]).max() < 2.0


def test_a_table_has_a_place_below_and_above_it():
    table = replace(build.cube("table"), vertices_local=build.cube("table").vertices_local * np.float32([0.8, 0.8, 0.05]))
    scene = build.scene([build.cube("room", 2.0, inward=True), table], [build.material()], [build.point_light((0, 0, 1.5))],
                        volumes=[build.volume(resolution=(5, 5, 4), half_size=2.0)])
    places = candidates(LightContext(scene, 1), scene.volumes[0], Progress())
    over = places[np.all(np.abs(places[:, :2]) < 0.7, axis=1)]
    assert (over[:, 2] > 0.05).any() and (over[:, 2] < -0.05).any() and np.abs(over[:, 2]).min() > 0.05


def test_light_that_is_the_same_everywhere_takes_few_probes():
    furnace = build.cube_furnace(resolution=(6, 6, 6), half_size=0.9)
    chosen = scattered(furnace, error=0.05)
    places = candidates(LightContext(furnace, 1), furnace.volumes[0], Progress())
    assert 1 <= len(chosen.volumes[0].scattered.points_world) <= len(places) // 8


def test_a_smaller_error_takes_more_probes():
    scene = room_scenes.sun_patch_room(resolution=(6, 6, 6), half_size=0.9)
    counts = [len(scattered(scene, error=error).volumes[0].scattered.points_world) for error in (0.3, 0.05, 0.01)]
    assert counts[0] < counts[1] < counts[2]


def test_places_that_are_asked_for_are_probes():
    wanted = np.array([[0.21, -0.37, 0.11], [5.0, 5.0, 5.0]])
    scene = replace(build.cube_furnace(resolution=(4, 4, 4), half_size=0.9), probe_points={"Mine": wanted, "Other": wanted[1:]})
    points = scattered(scene, points="Mine").volumes[0].scattered.points_world
    assert np.abs(points - wanted[0]).max(axis=1).min() < 1e-6
    with pytest.raises(UsageError, match="'Yours' has no Empties"):
        scattered(scene, points="Yours")


def test_without_a_floor_it_says_so():
    with pytest.raises(BakeError, match="no place for scattered probes"):
        scattered(build.scene([build.plane(half_size=2.0, z=3.0)], [build.material()], [build.point_light()],
                              volumes=[build.volume(half_size=1.0)]))


def test_nodes_name_probes_that_see_them(house):
    scene, _ = house
    volume, context = scene.volumes[0], LightContext(scene, 1)
    index = volume.scattered.index.reshape(-1, 4)
    nodes = lattice_points(volume.world_from_local, volume.nodes).reshape(-1, 3)
    # Those in the floor between the storeys see no probe.
    clear = np.flatnonzero((index[:, 0] > 0) & (np.abs(nodes[:, 2]) > 0.3))
    probes, share = named(index[clear])
    for slot in range(4):
        rows = np.flatnonzero(share[:, slot] > 0)
        way = volume.scattered.points_world[probes[rows, slot]] - nodes[clear[rows]]
        blocked = context.tracer.occluded(nodes[clear[rows]].astype(np.float32), way.astype(np.float32),
                                          np.full(len(rows), SEGMENT, np.float32))
        assert blocked.mean() < 0.02


def test_light_of_one_storey_stays_there(house):
    _, field = house
    points = np.random.default_rng(0).uniform((-1.9, -1.9, -2.5), (1.9, 1.9, -0.2), (500, 3))
    points[:250, 2] = -2.6 + 1e-3
    above = points + np.array([0.0, 0.0, 2.7])
    up = np.tile(np.float32([0, 0, 1]), (500, 1))
    below, above = (field.irradiance(places, up) for places in (points, above))
    assert below[:250].mean() < 1e-4 * above[:250].mean()
    # In the air, under normals that face the other storey, nothing but distances tells the two apart.
    assert below[250:].mean() < 0.03 * above[250:].mean()


def test_light_stays_on_its_side_of_a_wall():
    scene = scattered(room_scenes.two_rooms(resolution=(8, 4, 4), half_size=(2.0, 0.95, 0.95)))
    field = baked(scene)
    y, z = np.random.default_rng(0).uniform(-0.9, 0.9, (2, 300))
    dark, lit = (field.irradiance(np.column_stack([np.full(300, x), y, z]), np.tile(np.float32([n, 0, 0]), (300, 1)))
                 for x, n in ((0.026, 1), (-0.026, -1)))
    assert dark.mean() < 1e-2 * lit.mean()


def test_light_has_no_step_where_cells_meet(house):
    _, field = house
    way = across((-1.7, 0.3, 1.3), (1.7, -0.4, 0.9), 4001)
    light = field.irradiance(way, np.tile(np.float32([0, 0, 1]), (len(way), 1)))
    steps = np.abs(np.diff(light, axis=0)).max(axis=1)
    # A step of a thousandth of the way, whatever cells it crosses.
    assert steps.max() < 0.01 * light.mean()


def test_a_field_comes_back_from_its_arrays(house):
    _, field = house
    again = ProbeField.from_arrays(field.arrays())
    points = across((-1, -1, 1), (1, 1, 2), 50)
    up = np.tile(np.float32([0, 0, 1]), (50, 1))
    assert np.array_equal(field.irradiance(points, up), again.irradiance(points, up))


def test_probes_stand_where_they_were_placed(house):
    scene, field = house
    grid, = field.grids()
    assert np.allclose(places_of(grid), scene.volumes[0].scattered.points_world, atol=1e-5)
    assert grid.usable.sum() == grid.counts.sum() == len(scene.volumes[0].scattered.points_world) and not grid.moved.any()
