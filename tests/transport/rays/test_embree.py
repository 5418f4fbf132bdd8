"""Embree against the numpy twin: the same hits on soups, edges and grazing rays; alpha; offsets; any number of threads."""

from dataclasses import replace

import numpy as np
import pytest
import scene_builders as build
from triangle_soups import assert_same_hits, rays, soup

from rtgi_addon.errors import BakeError
from rtgi_addon.numerics.sampling import fibonacci_sphere
from rtgi_addon.scene import Channel, Instance, Material, Scene, Texture
from rtgi_addon.transport.rays.alpha import AlphaTracer
from rtgi_addon.transport.rays.brute_force import BruteForceTracer
from rtgi_addon.transport.rays.choose import make_tracer
from rtgi_addon.transport.rays.embree import EmbreeTracer
from rtgi_addon.transport.rays.tracer import offset_origins
from rtgi_addon.transport.surfaces.geometry import flatten
from rtgi_addon.transport.surfaces.materials import Surfaces

embreex = pytest.importorskip("embreex", reason="there is no Embree wheel for this platform")


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e4])
def test_embree_and_the_numpy_twin_agree_on_triangle_soups(seed, scale):
    geometry = flatten(soup(seed=seed, scale=scale))
    origins, directions = rays(1500, seed, scale)
    embree, oracle = EmbreeTracer(geometry), BruteForceTracer(geometry)
    hits = embree.intersect(origins, directions)
    assert 0.2 < np.mean(hits.primitive >= 0) < 0.99
    assert_same_hits(hits, oracle.intersect(origins, directions), scale)
    assert np.array_equal(embree.occluded(origins, directions), oracle.occluded(origins, directions))


def test_barycentrics_rebuild_the_hit_point():
    geometry = flatten(soup())
    origins, directions = rays(2000)
    hits = EmbreeTracer(geometry).intersect(origins, directions)
    found = np.flatnonzero(hits.primitive >= 0)
    points = geometry.points(hits.primitive[found], hits.u[found], hits.v[found])
    np.testing.assert_allclose(points, origins[found] + directions[found] * hits.t[found, None], atol=5e-6)


@pytest.mark.parametrize("backend", [EmbreeTracer, BruteForceTracer])
def test_no_ray_slips_through_edges_or_corners(backend):
    scene = build.scene([build.sphere(subdivisions=2)])
    corners = scene.meshes[0].vertices_local[scene.meshes[0].triangles]
    middles = 0.5 * (corners + np.roll(corners, 1, axis=1)).reshape(-1, 3)
    third = (0.3 * corners + 0.7 * np.roll(corners, 1, axis=1)).reshape(-1, 3)
    targets = np.concatenate([corners.reshape(-1, 3), middles, third]).astype(np.float32)
    tracer = backend(flatten(scene))
    for origin in ([0, 0, 0], [0.31, -0.2, 0.17]):
        origins = np.tile(np.float32(origin), (len(targets), 1))
        assert np.all(tracer.intersect(origins, targets - origins).primitive >= 0)
        assert tracer.occluded(origins, targets - origins).all()


def test_grazing_rays_agree():
    """Rays that skim a large triangle at 1e-3 rad and less."""
    geometry = flatten(build.scene([build.plane(half_size=10.0)]))
    rng = np.random.default_rng(3)
    angle = 10.0 ** rng.uniform(-5, -2, 1000)
    azimuth = rng.uniform(0, 2 * np.pi, 1000)
    directions = np.stack([np.cos(azimuth), np.sin(azimuth), -angle], axis=1).astype(np.float32)
    origins = np.concatenate([rng.uniform(-5, 5, (1000, 2)), rng.uniform(0.001, 0.01, (1000, 1))], axis=1).astype(np.float32)
    hits, oracle = (tracer(geometry).intersect(origins, directions) for tracer in (EmbreeTracer, BruteForceTracer))
    np.testing.assert_array_equal(hits.primitive >= 0, oracle.primitive >= 0)
    found = oracle.primitive >= 0
    assert 0.2 < found.mean() < 0.9
    np.testing.assert_allclose(hits.t[found], oracle.t[found], rtol=1e-4)


@pytest.mark.parametrize("backend", [EmbreeTracer, BruteForceTracer])
def test_limits_are_in_units_of_the_direction(backend):
    tracer = backend(flatten(build.scene([build.plane(half_size=1.0)])))
    origins, directions = np.full((4, 3), [0.1, 0.2, 2.0], np.float32), np.full((4, 3), [0, 0, -0.5], np.float32)
    limits = np.array([3.9, 4.1, np.inf, 0.0], np.float32)
    assert (tracer.intersect(origins, directions, limits).primitive >= 0).tolist() == [False, True, True, False]
    assert tracer.occluded(origins, directions, limits).tolist() == [False, True, True, False]
    assert limits.tolist() == pytest.approx([3.9, 4.1, np.inf, 0.0]), "the caller's limits were overwritten"
    assert tracer.intersect(origins, directions).t[0] == pytest.approx(4.0)


@pytest.mark.parametrize("backend", [EmbreeTracer, BruteForceTracer])
def test_misses_are_marked_and_empty_calls_are_empty(backend):
    tracer = backend(flatten(build.scene([build.plane()])))
    hits = tracer.intersect(np.tile(np.float32([0, 0, 1]), (3, 1)), np.float32([[0, 0, 1], [1, 0, 0], [0, 1, 0.01]]))
    assert hits.primitive.tolist() == [-1, -1, -1] and np.all(np.isinf(hits.t))
    assert not hits.u.any() and not hits.v.any(), "what stood in the memory before"
    none = tracer.intersect(np.zeros((0, 3), np.float32), np.zeros((0, 3), np.float32))
    assert none.primitive.shape == none.t.shape == (0,)
    assert tracer.occluded(np.zeros((0, 3), np.float32), np.zeros((0, 3), np.float32)).shape == (0,)


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e4])
@pytest.mark.parametrize("shift", [0.0, 3.0])
def test_offset_rays_neither_hit_their_own_surface_nor_leave_a_closed_room(scale, shift):
    """From the walls of a rotated closed cube, at any size and away from the origin: the next hit is another wall."""
    turn, _ = np.linalg.qr(np.random.default_rng(8).normal(size=(3, 3)))
    turn *= np.sign(np.linalg.det(turn))
    scene = build.scene([build.cube(inward=True)])
    scene = replace(scene, instances=(Instance("room", 0, build.transform(np.full(3, shift * scale), scale, turn)),))
    geometry = flatten(scene)
    tracer = EmbreeTracer(geometry)
    directions = fibonacci_sphere(20_000)
    origins = np.full((len(directions), 3), shift * scale, np.float32)
    hits = tracer.intersect(origins, directions)
    assert np.all(hits.primitive >= 0)
    normals = geometry.normals_world[hits.primitive]
    for points in (geometry.points(hits.primitive, hits.u, hits.v), origins + directions * hits.t[:, None]):
        rng = np.random.default_rng(1)
        onward = rng.normal(size=points.shape).astype(np.float32)
        onward /= np.linalg.norm(onward, axis=1, keepdims=True)
        onward *= np.sign(np.sum(onward * normals, axis=1, keepdims=True))
        started = offset_origins(points, normals, onward, hits.t)
        assert np.abs(started - points).max() < 1e-4 * scale * (1 + shift)
        again = tracer.intersect(started, onward)
        # Within a hair of an edge a ray may start outside of the neighbouring wall; everywhere else it stays in the room.
        edge = np.sort(np.abs((points - shift * scale) @ turn.astype(np.float32)) / scale, axis=1)[:, 1] > 1 - 1e-3
        assert np.all(again.primitive[~edge] >= 0)
        assert not np.any(np.all(geometry.normals_world[again.primitive[~edge]] == normals[~edge], axis=1))


def layers(count, alpha, threshold=None, size=1.0):
    """``count`` parallel squares facing +Z, one below the other, over an opaque floor at z = −10."""
    sheets = [build.plane(f"sheet {i}", size, -float(i)) for i in range(count)]
    floor = build.plane("floor", size, -10.0, material_index=1)
    return build.scene([*sheets, floor], [Material("film", alpha=alpha, alpha_threshold=threshold), build.material("floor")])


def test_cut_outs_follow_the_texture():
    """A checkerboard alpha cut at ½: rays through its holes reach the floor, the others stop, and both tracers say so."""
    checker = Texture("checker", np.repeat((np.indices((4, 4)).sum(axis=0) % 2).astype(np.float32)[..., None], 3, axis=2),
                      interpolation="Closest")
    scene = layers(3, Channel(texture=checker, texture_channel="r"), threshold=0.5)
    uv = np.array([[[0, 0], [1, 0], [1, 1]], [[0, 0], [1, 1], [0, 1]]], np.float32)
    scene = replace(scene, meshes=tuple(replace(mesh, uv_layers={"UV": uv}, active_uv="UV") for mesh in scene.meshes))
    geometry = flatten(scene)
    surfaces = Surfaces(scene, geometry)
    xy = np.random.default_rng(0).uniform(-1, 1, (4000, 2)).astype(np.float32)
    origins = np.concatenate([xy, np.full((4000, 1), 1.0, np.float32)], axis=1)
    down = np.tile(np.float32([0, 0, -1]), (4000, 1))
    cells = np.floor((xy + 1) * 2).astype(int)
    hole = cells.sum(axis=1) % 2 == 0
    for tracer in (make_tracer(geometry, surfaces), AlphaTracer(BruteForceTracer(geometry), geometry, surfaces)):
        hits = tracer.intersect(origins, down)
        np.testing.assert_array_equal(hits.t > 10.0, hole)
        np.testing.assert_allclose(hits.t, np.where(hole, 11.0, 1.0), rtol=1e-5)
        np.testing.assert_array_equal(tracer.occluded(origins, down, np.full(4000, 5.0, np.float32)), ~hole)


@pytest.mark.parametrize("count", [1, 2, 5])
def test_blended_alpha_lets_the_right_share_through(count):
    """(1 − α)^layers within six binomial standard deviations, alike for nearest hits and shadow rays and on any backend."""
    alpha, n = 0.3, 20_000
    scene = layers(count, Channel.of(alpha))
    geometry = flatten(scene)
    surfaces = Surfaces(scene, geometry)
    tracer = make_tracer(geometry, surfaces)
    xy = np.random.default_rng(5).uniform(-0.99, 0.99, (n, 2)).astype(np.float32)
    origins = np.concatenate([xy, np.full((n, 1), 1.0, np.float32)], axis=1)
    down = np.tile(np.float32([0, 0, -1]), (n, 1))
    through = tracer.intersect(origins, down).t > 10
    expected = (1 - alpha) ** count
    assert abs(through.mean() - expected) < 6 * np.sqrt(expected * (1 - expected) / n)
    np.testing.assert_array_equal(~tracer.occluded(origins, down, np.full(n, 8.0, np.float32)), through)
    twin = AlphaTracer(BruteForceTracer(geometry), geometry, surfaces).intersect(origins, down)
    np.testing.assert_array_equal(twin.t > 10, through)


def test_opaque_scenes_pay_nothing_for_alpha():
    scene = build.closed_box()
    geometry = flatten(scene)
    assert isinstance(make_tracer(geometry, Surfaces(scene, geometry)), EmbreeTracer)


def test_any_number_of_threads_gives_the_same_bytes():
    geometry = flatten(soup())
    origins, directions = rays(150_000)
    results = [EmbreeTracer(geometry, threads) for threads in (1, 2, 3)]
    hits = [tracer.intersect(origins, directions) for tracer in results]
    shadows = [tracer.occluded(origins, directions).tobytes() for tracer in results]
    for other in hits[1:]:
        for name in ("primitive", "u", "v", "t"):
            assert getattr(other, name).tobytes() == getattr(hits[0], name).tobytes()
    assert len(set(shadows)) == 1


def test_instances_are_mirrored_and_sheared_right():
    """Normals stay on the mesh's front under mirroring and shear; areas are those of the world."""
    shear = np.eye(4)
    shear[0, 2] = 0.7
    mirror = np.diag([-1.0, 2.0, 1.0, 1.0])
    scene = Scene("s", (build.cube(),), (Instance("a", 0, shear), Instance("b", 0, mirror)), (build.material(),))
    geometry = flatten(scene)
    centres = geometry.triangles_world.mean(axis=1)
    assert np.all(np.sum(centres * geometry.normals_world, axis=1) > 0)
    np.testing.assert_allclose(np.linalg.norm(geometry.normals_world, axis=1), 1.0, atol=1e-6)
    assert geometry.areas[geometry.instance == 1].sum() == pytest.approx(2 * 8 + 2 * 8 + 2 * 4)
    assert geometry.local_triangle[12:].tolist() == list(range(12))


def test_an_empty_scene_is_named():
    with pytest.raises(BakeError, match="no geometry"):
        flatten(Scene("empty"))
