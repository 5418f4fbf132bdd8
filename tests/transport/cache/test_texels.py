"""Texels on triangles of every shape: hits, slots, points and areas must tell one story."""

import numpy as np
import pytest
import scene_builders as build

from rtgi_addon.numerics.sampling import random_rotations
from rtgi_addon.transport.cache import texels
from rtgi_addon.transport.cache.texels import Focus, TexelLayout, clipped_square
from rtgi_addon.transport.surfaces.geometry import flatten


def turned(mesh, seed=0, move=(0.3, -0.2, 0.1)):
    """The mesh in a random position: grids must not lean on axes."""
    rotation = random_rotations(1, np.random.default_rng(seed))[0]
    return build.mesh(mesh.name, mesh.vertices_local @ rotation.T + np.array(move), mesh.triangles)


def ribbon(length=8.0, width=0.004):
    """Two slivers, two thousand times as long as wide."""
    return build.mesh("ribbon", [[0, 0, 0], [length, 0, 0], [length, width, 0], [0, width, 0]], [[0, 1, 2], [0, 2, 3]])


def obtuse():
    """One triangle whose grid runs along the edges of a 150° corner."""
    return build.mesh("obtuse", [[0, 0, 0], [2.0, 0, 0], [-1.8, 1.0, 0]], [[0, 1, 2]])


MESHES = {
    "cube of large faces": turned(build.cube(half_size=2.0)),
    "slivers": turned(ribbon()),
    "obtuse": turned(obtuse()),
    "sphere of tiny faces": turned(build.sphere(radius=1.0, subdivisions=4)),
    "a kilometre of ground": turned(build.plane(half_size=500.0), move=(3.0, 2.0, 1.0)),
}


def layout_of(mesh, size=0.3, radius=1.0, center=(0.0, 0.0, 0.0)):
    geometry = flatten(build.scene([mesh]))
    return geometry, TexelLayout(geometry, Focus(np.array(center), radius, size))


def random_hits(geometry, n, seed=1):
    """Points spread evenly over the surface, on either side."""
    rng = np.random.default_rng(seed)
    primitive = rng.choice(geometry.count, n, p=geometry.areas / geometry.areas.sum(dtype=np.float64)).astype(np.int32)
    root, second = np.sqrt(rng.random(n)), rng.random(n)
    return (primitive, (root * (1 - second)).astype(np.float32), (root * second).astype(np.float32), rng.random(n) < 0.5)


@pytest.mark.parametrize("mesh", MESHES.values(), ids=MESHES)
def test_points_sampled_on_a_hits_slot_lie_in_that_slot(mesh):
    geometry, layout = layout_of(mesh)
    hits = random_hits(geometry, 20_000)
    slots = layout.slots(*hits)
    assert np.array_equal(slots & 1, hits[3])
    xi = np.random.default_rng(2).random((4, len(slots), 2)).astype(np.float32)
    primitive, u, v = (part.reshape(-1) for part in layout.sample(slots, xi))
    assert u.min() >= 0 and v.min() >= 0 and (u + v).max() <= 1 + 1e-6
    again = layout.slots(primitive, u, v, np.tile(hits[3], 4))
    different = np.flatnonzero(again != np.tile(slots, 4))
    # A point within rounding of a cell's edge may fall to the neighbour.
    assert len(different) <= 1e-3 * len(again)
    points = geometry.points(primitive, u, v).reshape(4, -1, 3)
    assert np.all(np.isfinite(points))


@pytest.mark.parametrize("mesh", MESHES.values(), ids=MESHES)
def test_areas_of_one_sides_slots_sum_to_the_mesh(mesh):
    geometry, layout = layout_of(mesh)
    total = geometry.areas.sum(dtype=np.float64)
    for side in (0, 1):
        areas = layout.areas(np.arange(side, layout.slot_count, 2))
        assert areas.min() >= 0 and areas.sum() == pytest.approx(total, rel=1e-4)


@pytest.mark.parametrize("mesh", MESHES.values(), ids=MESHES)
def test_points_cover_the_surface_evenly(mesh):
    """Area-weighted moments of the sampled points are those of the mesh: ∫x and ∫x·xᵀ over triangles in closed form."""
    geometry, layout = layout_of(mesh)
    slots = np.arange(0, layout.slot_count, 2)
    areas = layout.areas(slots)
    slots, areas = slots[areas > 1e-9 * areas.max()], areas[areas > 1e-9 * areas.max()]
    rng, side, points = np.random.default_rng(4), 8 if len(slots) < 5000 else 3, []
    grid = np.stack(np.meshgrid(np.arange(side), np.arange(side)), axis=-1).reshape(-1, 1, 2)
    for _ in range(8):
        xi = (grid + rng.random((side * side, len(slots), 2))) / side
        points.append(geometry.points(*(part.reshape(-1) for part in layout.sample(slots, xi))).reshape(side * side, -1, 3))
    points, share = np.stack(points).astype(float), areas / areas.sum()
    corners, weight = geometry.triangles_world.astype(float), geometry.areas / geometry.areas.sum(dtype=float)
    center, extent = corners.mean(axis=1), np.abs(corners).max()
    # Over a triangle, the mean of x·xᵀ is (Σ v·vᵀ + 9·c·cᵀ)/12.
    second = np.einsum("t,tix,tiy->xy", weight, corners, corners) / 12 + np.einsum("t,tx,ty->xy", weight, center, center) * 0.75
    for measured, exact, scale in ((np.einsum("n,rsnx->rx", share, points) / side**2, weight @ center, extent),
                                   (np.einsum("n,rsnx,rsny->rxy", share, points, points) / side**2, second, extent**2)):
        error = measured.std(axis=0, ddof=1) / np.sqrt(8)
        assert error.max() < 4e-3 * scale
        assert np.all(np.abs(measured.mean(axis=0) - exact) < 6 * error + 2e-4 * scale)


def test_a_clipped_cell_is_sampled_uniformly():
    """Against rejection: mean and covariance of 200,000 points in cells cut by the long edge, and no point beyond it."""
    rng = np.random.default_rng(3)
    for width, height, limit in ((0.3, 0.3, 0.3), (0.3, 0.3, 0.5), (0.2, 0.5, 0.35), (0.5, 0.2, 0.65), (0.1, 0.1, 5.0)):
        x, y = clipped_square(*(np.float64(value) for value in (width, height, limit)), rng.random((200_000, 2)))
        assert np.all(x * width + y * height <= limit + 1e-9)
        free = rng.random((400_000, 2))
        kept = free[free @ (width, height) <= limit]
        np.testing.assert_allclose([x.mean(), y.mean()], kept.mean(axis=0), atol=0.005)
        np.testing.assert_allclose(np.cov(x, y), np.cov(kept.T), atol=0.002)


def test_texels_are_as_large_as_asked_near_the_focus_and_grow_with_distance():
    geometry, layout = layout_of(build.plane(half_size=500.0), size=0.3)
    assert layout.size == 0.3
    hits = random_hits(geometry, 20_000)
    points, areas = geometry.points(*hits[:3]), layout.areas(layout.slots(*hits))
    distance = np.linalg.norm(points, axis=1)
    assert np.sqrt(areas[distance > 200].mean()) > 20 * layout.size
    near = np.random.default_rng(5).uniform(-1, 1, (1000, 2)).astype(np.float32)
    x, y = (near.T + 500) / 1000
    lower = y <= x
    slots = layout.slots(np.where(lower, 0, 1).astype(np.int32), np.where(lower, x - y, x), np.where(lower, y, y - x), lower)
    assert 0.5 * layout.size < np.sqrt(np.median(layout.areas(slots))) < 1.2 * layout.size
    assert layout.slot_count < 100_000


def test_small_triangles_share_a_texel_only_if_they_face_alike_and_lie_together():
    geometry, layout = layout_of(MESHES["sphere of tiny faces"], size=0.3)
    third = np.full(geometry.count, 1 / 3, np.float32)
    slots = layout.slots(np.arange(geometry.count, dtype=np.int32), third, third, np.ones(geometry.count, bool))
    unique, group = np.unique(slots, return_inverse=True)
    assert len(unique) < geometry.count / 4
    centers = geometry.triangles_world.mean(axis=1)
    for member in range(len(unique)):
        rows = np.flatnonzero(group.reshape(-1) == member)
        assert np.ptp(centers[rows], axis=0).max() <= 0.3 + 1e-5
        assert (geometry.normals_world[rows] @ geometry.normals_world[rows].T).min() > 0


def test_shared_texels_are_numbered_along_a_curve_through_space():
    geometry, layout = layout_of(turned(build.sphere(radius=1.0, subdivisions=5)), size=0.15, radius=5.0)
    everywhere = np.arange(geometry.count, dtype=np.int32)
    third = np.full(geometry.count, 1 / 3, np.float32)
    group = layout.slots(everywhere, third, third, np.ones(geometry.count, bool)) >> 1
    counts = np.bincount(group)
    middle = np.stack([np.bincount(group, geometry.triangles_world.mean(axis=1)[:, axis]) for axis in range(3)], axis=1)
    middle /= counts[:, None]
    steps = np.linalg.norm(np.diff(middle, axis=0), axis=1)
    # In any order neighbouring numbers would lie some 1.3 apart, as points on a sphere do.
    assert len(counts) > 400 and counts.min() > 0 and steps.mean() < 0.25


def test_materials_do_not_share_texels():
    mesh = build.sphere(subdivisions=4)
    material = (np.arange(len(mesh.triangles)) % 2).astype(np.int32)
    mesh = type(mesh)(mesh.name, mesh.vertices_local, mesh.triangles, material)
    geometry = flatten(build.scene([mesh], [build.material("a"), build.material("b")]))
    layout = TexelLayout(geometry, Focus(np.zeros(3), 1.0, 0.4))
    zero = np.zeros(geometry.count, np.float32)
    slots = layout.slots(np.arange(geometry.count, dtype=np.int32), zero, zero, np.ones(geometry.count, bool))
    assert not set(slots[material == 0]) & set(slots[material == 1])


@pytest.mark.parametrize("mesh", [MESHES["cube of large faces"], MESHES["obtuse"], MESHES["a kilometre of ground"]],
                         ids=["cube", "obtuse", "ground"])
def test_a_rim_encloses_its_cell(mesh):
    """All five corners lie in the slot's own cell, and the polygon they make has nearly its area, cut by the long edge or not."""
    geometry, layout = layout_of(mesh)
    slots = np.unique(layout.slots(*random_hits(geometry, 5000)))
    rows, triangle, corners = layout.rim(slots)
    assert np.array_equal(rows, np.arange(len(slots))) and corners.shape == (len(slots), 5, 3)
    corners, areas = corners.astype(float), layout.areas(slots)
    origin = geometry.triangles_world[triangle, 0].astype(float)
    edges = geometry.triangles_world[triangle, 1:].astype(float) - origin[:, None]
    uv = np.einsum("nij,nkj->nki", np.linalg.pinv(np.swapaxes(edges, 1, 2)), corners - origin[:, None])
    again = layout.slots(np.repeat(triangle, 5), *uv.astype(np.float32).reshape(-1, 2).T, np.repeat(slots & 1, 5).astype(bool))
    large = areas > 1e-3 * areas.max()
    assert np.all((again.reshape(-1, 5) == slots[:, None])[large])
    fan = corners[:, 1:] - corners[:, :1]
    covered = 0.5 * np.linalg.norm(np.cross(fan[:, :-1], fan[:, 1:]).sum(axis=1), axis=1)
    np.testing.assert_allclose(covered[large], areas[large], rtol=4e-3)


def test_texels_double_until_they_fit(monkeypatch):
    monkeypatch.setattr(texels, "MAX_SLOTS", 1 << 12)
    geometry, layout = layout_of(build.cube(half_size=2.0), size=0.01)
    assert layout.slot_count <= 1 << 12
    steps = np.log2(layout.size / 0.01)
    assert steps == pytest.approx(round(steps)) and steps >= 1
    assert layout.areas(np.arange(0, layout.slot_count, 2)).sum() == pytest.approx(geometry.areas.sum(), rel=1e-4)
    before = layout_of(build.cube(half_size=2.0), size=layout.size / 2)
    assert before[1].size == layout.size
