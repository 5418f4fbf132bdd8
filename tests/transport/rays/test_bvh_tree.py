"""Blender's BVH in Embree's place: the same hits as the numpy twin, the same light from a bake, and a word to the user."""

import sys

import numpy as np
import pytest
import scene_builders as build
from probe_bakes import bake, coefficients, rms
from triangle_soups import assert_same_hits, rays, soup

pytest.importorskip("bpy", reason="mathutils comes with Blender")

from rtgi_addon.jobs.bake import bake_scene
from rtgi_addon.scene import Channel, Material
from rtgi_addon.transport.rays import embree as tracing
from rtgi_addon.transport.rays.alpha import AlphaTracer
from rtgi_addon.transport.rays.brute_force import BruteForceTracer
from rtgi_addon.transport.rays.bvh_tree import BVHTreeTracer
from rtgi_addon.transport.rays.choose import make_tracer, slow_rays_warning
from rtgi_addon.transport.surfaces.geometry import flatten
from rtgi_addon.transport.surfaces.materials import Surfaces


@pytest.fixture
def no_embree(monkeypatch):
    monkeypatch.setattr(tracing, "rtcore_scene", None)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("scale", [1e-2, 1.0, 1e3])
def test_it_agrees_with_the_numpy_twin_on_triangle_soups(seed, scale):
    geometry = flatten(soup(seed=seed, scale=scale))
    origins, directions = rays(1500, seed, scale)
    tracer, oracle = BVHTreeTracer(geometry), BruteForceTracer(geometry)
    hits, expected = tracer.intersect(origins, directions), oracle.intersect(origins, directions)
    assert 0.2 < np.mean(hits.primitive >= 0) < 0.99
    assert_same_hits(hits, expected, scale)
    assert hits.primitive.dtype == np.int32 and {hits.u.dtype, hits.v.dtype, hits.t.dtype} == {np.dtype(np.float32)}
    limits = np.random.default_rng(seed).uniform(0, 2, len(origins)).astype(np.float32) * np.float32(scale)
    np.testing.assert_array_equal(tracer.occluded(origins, directions, limits), oracle.occluded(origins, directions, limits))
    assert_same_hits(tracer.intersect(origins, directions, limits), oracle.intersect(origins, directions, limits), scale)


def test_barycentrics_rebuild_the_hit_point():
    geometry = flatten(soup())
    origins, directions = rays(2000)
    hits = BVHTreeTracer(geometry).intersect(origins, directions)
    found = np.flatnonzero(hits.primitive >= 0)
    points = geometry.points(hits.primitive[found], hits.u[found], hits.v[found])
    np.testing.assert_allclose(points, origins[found] + directions[found] * hits.t[found, None], atol=5e-6)
    assert np.all(hits.u >= 0) and np.all(hits.v >= 0) and np.all(hits.u + hits.v <= 1 + 1e-6)


def test_no_ray_slips_through_edges_or_corners():
    scene = build.scene([build.sphere(subdivisions=2)])
    corners = scene.meshes[0].vertices_local[scene.meshes[0].triangles]
    targets = np.concatenate([corners, 0.5 * (corners + np.roll(corners, 1, axis=1))]).reshape(-1, 3).astype(np.float32)
    tracer = BVHTreeTracer(flatten(scene))
    for origin in ([0, 0, 0], [0.31, -0.2, 0.17]):
        origins = np.tile(np.float32(origin), (len(targets), 1))
        assert np.all(tracer.intersect(origins, targets - origins).primitive >= 0)
        assert tracer.occluded(origins, targets - origins).all()


def test_limits_are_in_units_of_the_direction_and_stay_as_they_were():
    tracer = BVHTreeTracer(flatten(build.scene([build.plane(half_size=1.0)])))
    origins, directions = np.full((4, 3), [0.1, 0.2, 2.0], np.float32), np.full((4, 3), [0, 0, -0.5], np.float32)
    limits = np.array([3.9, 4.1, np.inf, 0.0], np.float32)
    assert (tracer.intersect(origins, directions, limits).primitive >= 0).tolist() == [False, True, True, False]
    assert tracer.occluded(origins, directions, limits).tolist() == [False, True, True, False]
    assert limits.tolist() == pytest.approx([3.9, 4.1, np.inf, 0.0])
    assert tracer.intersect(origins, directions).t[0] == pytest.approx(4.0)
    nothing = np.zeros((0, 3), np.float32)
    assert len(tracer.intersect(nothing, nothing).t) == len(tracer.occluded(nothing, nothing)) == 0


def test_it_is_taken_without_embree_and_the_numpy_twin_without_blender(no_embree, monkeypatch):
    scene = build.closed_box()
    geometry = flatten(scene)
    assert isinstance(make_tracer(geometry, Surfaces(scene, geometry)), BVHTreeTracer)
    clear = build.scene([build.plane()], [Material("glass", alpha=Channel.of(0.3))])
    clear_geometry = flatten(clear)
    assert isinstance(make_tracer(clear_geometry, Surfaces(clear, clear_geometry)), AlphaTracer)
    monkeypatch.setitem(sys.modules, "mathutils.bvhtree", None)
    assert isinstance(make_tracer(geometry), BruteForceTracer)


def test_a_bake_gives_the_light_of_embree_on_any_number_of_threads(no_embree, monkeypatch):
    scene = build.closed_box(0.6, light_position=(0.3, -0.2, 0.5))
    options = {"rays": 64, "texel_size": 0.5}
    without = coefficients(bake(scene, threads=1, **options))
    np.testing.assert_array_equal(coefficients(bake(scene, threads=3, **options)), without)
    monkeypatch.undo()
    if tracing.rtcore_scene is None:
        pytest.skip("there is no Embree wheel for this platform to compare with")
    assert rms(coefficients(bake(scene, threads=1, **options)) - without) < 1e-3 * rms(without)


def test_the_user_is_told(no_embree, tmp_path):
    summary = bake_scene(build.closed_box(), "probes", {"rays": 32, "texel_size": 1.0}, tmp_path / "bake")
    assert any("no Embree" in warning and "slower" in warning for warning in summary.warnings)
    assert "no Embree" in summary.to_text()


def test_with_embree_there_is_nothing_to_tell():
    pytest.importorskip("embreex", reason="there is no Embree wheel for this platform")
    said = slow_rays_warning()
    assert said is None or "no compiled kernels" in said
