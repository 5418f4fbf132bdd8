"""Texels split by walls: what is lit on one side must never be read on the other."""

from itertools import pairwise

import numpy as np
import pytest
import scene_builders as build

from rtgi_addon.numerics.sampling import random_rotations
from rtgi_addon.progress import Progress
from rtgi_addon.transport.cache.surface_cache import SurfaceCache
from rtgi_addon.transport.cache.texel_table import MAX_PARTS, SurfaceHits
from rtgi_addon.transport.cache.texels import Focus, TexelLayout
from rtgi_addon.transport.context import LightContext

SIZE = 0.5


def wall(phase, angle, thickness=0.0):
    """A tall wall through (phase, 0) that stands on, and reaches below, more than the whole floor."""
    corners = build.CUBE_CORNERS * np.float32([0.5 * thickness, 20, 2])
    turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    if thickness == 0:
        corners = np.float32([[0, -20, -2], [0, 20, -2], [0, 20, 2], [0, -20, 2]])
    triangles = build.CUBE_TRIANGLES if thickness else [[0, 1, 2], [0, 2, 3]]
    return build.mesh("wall", corners @ turn.T + np.array([phase, 0, 0]), triangles)


def in_rotated_space(meshes, seed):
    """The meshes under one random rotation and shift (none for seed 0), and that map."""
    rng = np.random.default_rng(seed)
    rotation, shift = (random_rotations(1, rng)[0], rng.normal(size=3)) if seed else (np.eye(3), np.zeros(3))
    moved = [build.mesh(mesh.name, mesh.vertices_local @ rotation.T + shift, mesh.triangles, mesh.triangle_material[0])
             for mesh in meshes]
    return moved, rotation, shift


def prepared(meshes, threads=1, size=SIZE, materials=None, world=0.0):
    context = LightContext(build.scene(meshes, materials, world=world), threads)
    cache = SurfaceCache(context, TexelLayout(context.geometry, Focus(np.zeros(3), 8.0, size)), seed=3)
    return context, cache


def floor_hits(context, cache, n=20_000, seed=5, triangles=2, both_sides=False):
    rng = np.random.default_rng(seed)
    primitive = rng.integers(0, triangles, n).astype(np.int32)
    root, second = np.sqrt(rng.random(n)), rng.random(n)
    u, v = (root * (1 - second)).astype(np.float32), (root * second).astype(np.float32)
    front = rng.random(n) < 0.5 if both_sides else np.ones(n, bool)
    return SurfaceHits(primitive, u, v, cache.layout.slots(primitive, u, v, front))


@pytest.mark.parametrize("thickness", [0.0, 0.02, 0.2], ids=["sheet", "thin", "thick"])
@pytest.mark.parametrize("turned", [0, 1, 2])
def test_hits_on_the_two_sides_of_a_wall_never_share_a_texel(thickness, turned):
    """In any phase and direction of the wall to the floor's grid, above the floor and below it."""
    rng = np.random.default_rng(10 + turned)
    # The first wall stands on the edges of cells, where there is nothing to split.
    for phase, angle in [(0.0, 0.0), *zip(rng.uniform(-1, 1, 8), rng.uniform(0, np.pi, 8), strict=True)]:
        meshes, rotation, shift = in_rotated_space([build.plane(half_size=4.0), wall(phase, angle, thickness)], turned)
        context, cache = prepared(meshes)
        hits = floor_hits(context, cache, both_sides=True)
        points = (context.geometry.points(hits.primitive, hits.u, hits.v) - shift) @ rotation
        across = (points[:, 0] - phase) * np.cos(angle) + points[:, 1] * np.sin(angle)
        texel = cache.table.resolve([hits])[0]
        left, right = across < -0.5 * thickness - 1e-4, across > 0.5 * thickness + 1e-4
        assert left.any() and right.any()
        shared = np.intersect1d(texel[left], texel[right])
        assert shared.size == 0, (phase, angle, shared.size)
        # Only what the wall crosses was split.
        assert np.array_equal(cache.table.slots[texel], hits.slots)
        split = np.flatnonzero(np.bincount(cache.table.slots, minlength=1) > 1)
        assert split.size < 0.5 * len(np.unique(hits.slots)) and (split.size > 0 or phase == 0)


def test_an_open_floor_is_not_split():
    context, cache = prepared([build.plane(half_size=4.0)])
    hits = floor_hits(context, cache)
    texel = cache.table.resolve([hits])[0]
    assert not cache.table.mixed.any() and cache.table.accepted.all()
    assert cache.table.count == len(np.unique(hits.slots)) and np.array_equal(cache.table.slots[texel], hits.slots)


def test_a_smooth_sphere_of_small_triangles_is_not_split():
    """Neighbours on a gently curved surface see each other: splitting there would waste texels."""
    context, cache = prepared([build.sphere(radius=2.0, subdivisions=5)], size=0.25)
    hits = floor_hits(context, cache, triangles=context.geometry.count)
    cache.table.resolve([hits])
    assert np.mean(np.bincount(cache.table.slots) > 1) < 0.02


def test_sample_points_of_a_split_texel_stay_on_its_side():
    context, cache = prepared([build.plane(half_size=4.0), wall(0.07, 0.3)])
    hits = floor_hits(context, cache)
    texels = np.unique(cache.table.resolve([hits])[0])
    points = cache.sampler.on_texels(texels, cache.points).points.reshape(cache.points, -1, 3)
    across = (points[..., 0] - 0.07) * np.cos(0.3) + points[..., 1] * np.sin(0.3)
    assert np.all((across > -1e-4).all(axis=0) | (across < 1e-4).all(axis=0))


def many_walls():
    return [build.plane(half_size=4.0), *(wall(phase, angle) for phase, angle in ((0.1, 0.2), (-0.6, 1.1), (0.3, 2.0)))]


def test_a_slot_is_split_into_a_few_texels_at_most():
    context, cache = prepared(many_walls(), size=2.0)
    cache.table.resolve([floor_hits(context, cache)])
    parts = np.bincount(cache.table.slots)
    assert parts.max() == MAX_PARTS


@pytest.mark.parametrize("threads", [2, 5])
def test_threads_do_not_matter(threads):
    results = []
    for count in (1, threads):
        context, cache = prepared(many_walls(), count)
        hits = floor_hits(context, cache)
        parts = [hits.take(slice(start, start + 3000)) for start in range(0, len(hits.slots), 3000)]
        results.append((np.concatenate(cache.table.resolve(parts)), cache.table))
    (one, table), (other, other_table) = results
    assert np.array_equal(one, other)
    assert all(np.array_equal(value, other_table.state()[name]) for name, value in table.state().items())


def test_cutting_hits_into_parts_does_not_matter():
    texels = []
    for cuts in ((), (7,), (100, 100, 5000, 12_345)):
        context, cache = prepared(many_walls())
        hits = floor_hits(context, cache)
        edges = [0, *cuts, len(hits.slots)]
        parts = [hits.take(slice(low, high)) for low, high in pairwise(edges)]
        texels.append(np.concatenate(cache.table.resolve(parts)))
    assert np.array_equal(texels[0], texels[1]) and np.array_equal(texels[0], texels[2])


def test_a_restored_table_goes_on_as_before():
    context, cache = prepared(many_walls())
    first, second = floor_hits(context, cache, 3000), floor_hits(context, cache, 20_000, seed=6)
    cache.table.resolve([first])
    state = {name: value.copy() for name, value in cache.table.state().items()}
    expected = cache.table.resolve([second])[0]
    _, other = prepared(many_walls())
    other.table.restore(state)
    assert np.array_equal(other.table.resolve([second])[0], expected)
    assert all(np.array_equal(value, other.table.state()[name]) for name, value in cache.table.state().items())


@pytest.mark.parametrize(("height", "emission"), [(0.002, 0.0), (0.1, 0.0), (0.002, 1.0), (0.05, 1.0), (0.2, 1.0)],
                         ids=["lid below the lift", "lid", "lamp below the lift", "lamp", "lamp almost half a texel above"])
@pytest.mark.parametrize("turned", [0, 1])
def test_a_panel_close_above_a_floor_parts_what_it_covers_from_the_rest(height, turned, emission):
    """In any phase to the floor's texels: neither a lamp's light may spread beside it, nor the darkness beneath a lid."""
    panel = build.mesh("panel", np.float32([[-0.9, -0.7, height], [1.1, -0.7, height], [1.1, 0.8, height], [-0.9, 0.8, height]]),
                       [[0, 1, 2], [0, 2, 3]], material_index=1)
    meshes, rotation, shift = in_rotated_space([build.plane(half_size=4.0), panel], turned)
    context, cache = prepared(meshes, materials=[build.material(), build.material(emission=emission)])
    hits = floor_hits(context, cache)
    points = (context.geometry.points(hits.primitive, hits.u, hits.v) - shift) @ rotation
    inside = np.minimum(np.minimum(points[:, 0] + 0.9, 1.1 - points[:, 0]), np.minimum(points[:, 1] + 0.7, 0.8 - points[:, 1]))
    texel = cache.table.resolve([hits])[0]
    under, beside = inside > 1e-4, inside < -1e-4
    assert under.any() and np.intersect1d(texel[under], texel[beside]).size == 0
    # What the sample points of a texel stand for is covered as its hits are.
    texels = np.unique(texel[under])
    sampled = (cache.sampler.on_texels(texels, cache.points).points - shift) @ rotation
    assert np.all((sampled > np.array([-0.9, -0.7, -1]) - 1e-4) & (sampled < np.array([1.1, 0.8, 1]) + 1e-4))


@pytest.mark.parametrize(("height", "emission"), [(0.4, 0.0), (1.5, 0.0), (1.5, 1.0)], ids=["lid", "high lid", "high lamp"])
def test_a_panel_far_above_parts_nothing(height, emission):
    panel = build.plane("panel", half_size=0.9, z=height * SIZE, material_index=1)
    materials = [build.material(), build.material(emission=emission)]
    context, cache = prepared([build.plane(half_size=4.0), panel], materials=materials)
    cache.table.resolve([floor_hits(context, cache)])
    assert not cache.table.mixed.any()


@pytest.mark.parametrize("turned", [0, 1])
def test_the_floor_beside_a_lid_that_hovers_over_it_sees_the_whole_sky(turned):
    """Texels that the lid's edge cuts must hold what is seen beside it, not the mean with the darkness in the gap beneath."""
    lid = build.mesh("lid", np.float32([[-0.9, -0.7, 0.002], [1.1, -0.7, 0.002], [1.1, 0.8, 0.002], [-0.9, 0.8, 0.002]]),
                     [[0, 1, 2], [0, 2, 3]])
    meshes, rotation, shift = in_rotated_space([build.plane(half_size=4.0), lid], turned)
    context, cache = prepared(meshes, world=1.0)
    hits = floor_hits(context, cache)
    points = (context.geometry.points(hits.primitive, hits.u, hits.v) - shift) @ rotation
    beyond = np.maximum(np.abs(points[:, 0] - 0.1) - 1.0, np.abs(points[:, 1] - 0.05) - 0.75)
    texel = cache.reach([hits], Progress())[0]
    irradiance = cache.rows.irradiance_sky[texel[(beyond > 1e-3) & (beyond < 0.2 * SIZE)]]
    # A point within millimetres of the edge does see the lid, so single texels may be a little darker.
    assert irradiance.min() > 0.9 * np.pi and irradiance.mean() > 0.99 * np.pi
