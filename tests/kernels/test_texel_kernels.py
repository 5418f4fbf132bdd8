"""The kernels of the surface cache's texels against numpy: the same points, the same rays, and the same hits on the same texels.

Tolerances: points within 2e-6 of the scene's size; directions within 1e-4, since the cosine of a grazing one is the root of a
difference; what a ray meets may differ where it grazes an edge, in fewer than one of a thousand.
"""

from dataclasses import replace

import numpy as np
import pytest
import room_scenes as rooms
import scene_builders as build

from rtgi_addon import kernels
from rtgi_addon.progress import Progress
from rtgi_addon.transport.cache import texel_kernels
from rtgi_addon.transport.cache.surface_cache import SurfaceCache
from rtgi_addon.transport.cache.texel_table import SurfaceHits
from rtgi_addon.transport.cache.texels import Focus, TexelLayout
from rtgi_addon.transport.context import LightContext
from rtgi_addon.transport.rays import embree, embree_scene

pytestmark = pytest.mark.skipif(embree_scene.missing() is not None or not embree.is_available(),
                                reason="no kernels, or no Embree for them")


def rounded():
    """Small triangles that share texels, smooth normals, a floor whose cells grow with the distance, and a wall across it."""
    ball = build.sphere(radius=0.4, subdivisions=3)
    corners = ball.vertices_local[ball.triangles]
    ball = replace(ball, corner_normals_local=corners / np.linalg.norm(corners, axis=-1, keepdims=True))
    wall = build.mesh("wall", np.float32([[0.11, -2, -2], [0.11, 2, -2], [0.11, 2, 2], [0.11, -2, 2]]), [[0, 1, 2], [0, 2, 3]])
    return build.scene([ball, build.plane(half_size=40.0, z=-0.5), wall], lights=[build.point_light((0.5, 0.5, 1.0))], world=0.3)


SCENES = {"rounded": rounded(), "emissive": rooms.panel_room(0.6), "two rooms": rooms.two_rooms(), "sun": rooms.sun_patch_room()}


def grown(scene, threads=1):
    """A surface cache that has met what rays from the middle look at, and those hits."""
    context = LightContext(scene, threads)
    cache = SurfaceCache(context, TexelLayout(context.geometry, Focus(np.zeros(3), 0.5, 0.08)), 3, rays=16)
    rng = np.random.default_rng(5)
    origins = rng.uniform(-0.3, 0.3, (4000, 3)).astype(np.float32)
    directions = rng.normal(size=(4000, 3)).astype(np.float32)
    hits = context.tracer.intersect(origins, directions)
    rows = np.flatnonzero(hits.primitive >= 0)
    primitive, u, v = hits.primitive[rows], hits.u[rows], hits.v[rows]
    front = (context.geometry.normals_world[primitive] * directions[rows]).sum(axis=1) < 0
    met = SurfaceHits(primitive, u, v, cache.layout.slots(primitive, u, v, front))
    return context, cache, met, cache.reach([met], Progress())[0]


@pytest.fixture(scope="module", params=SCENES)
def both(request):
    """``grown`` by kernels and by numpy."""
    ours = grown(SCENES[request.param])
    with kernels.switched_off():
        return ours, grown(SCENES[request.param])


def test_hits_lie_on_the_same_texels(both):
    (_, ours, _, texel), (_, numpys, _, other) = both
    assert ours.count == numpys.count and np.array_equal(texel, other)
    for name in ("slots", "mixed", "covered", "accepted"):
        a, b = getattr(ours.table, name), getattr(numpys.table, name)
        assert np.mean(a != b) < 1e-3, name
    assert ours.table.mixed.any() or not numpys.table.mixed.any()


def test_points_and_rays_of_texels(both):
    (_, ours, _, _), (_, numpys, _, _) = both
    # The same table for both, so that nothing but the code differs.
    texels = np.arange(numpys.count)
    slots = numpys.table.slots
    surface = numpys.sampler.on_texels(texels, numpys.points)
    with kernels.switched_off():
        expected = numpys.sampler.on_texels(texels, numpys.points)
    assert np.mean(surface.primitive != expected.primitive) < 1e-3
    same = surface.primitive == expected.primitive
    for name, tolerance in (("u", 2e-5), ("v", 2e-5), ("shading", 2e-6), ("face", 2e-6)):
        np.testing.assert_allclose(getattr(surface, name)[same], getattr(expected, name)[same], atol=tolerance)
    np.testing.assert_allclose(surface.points[same], expected.points[same], atol=2e-6 * np.abs(expected.points).max())
    # Rays through the kernels' tracer from one set of points.
    rays, _ = ours._rays(slots, expected)
    with kernels.switched_off():
        others, _ = numpys._rays(slots, expected)
    facing = np.einsum("ij,ij->i", np.tile(expected.face, (4, 1)), others.directions) > 1e-6
    np.testing.assert_allclose(rays.directions, others.directions, atol=1e-4)
    met, expected_met = (np.full(len(facing), -1) for _ in range(2))
    met[rays.found], expected_met[others.found] = rays.primitive, others.primitive
    assert np.mean(met[facing] != expected_met[facing]) < 1e-3
    escaped, expected_escaped = (np.isin(np.arange(len(facing)), part.escaped) for part in (rays, others))
    assert np.mean(escaped[facing] != expected_escaped[facing]) < 1e-3
    alike = np.flatnonzero((met == expected_met) & (met >= 0))
    row, other_row = (np.searchsorted(part.found, alike) for part in (rays, others))
    np.testing.assert_allclose(rays.cosine[row], others.cosine[other_row], atol=5e-6)
    np.testing.assert_allclose(rays.density[alike], others.density[alike], rtol=2e-3, atol=1e-6)
    assert np.mean(rays.slots[row] != others.slots[other_row]) < 2e-3


def test_a_cache_is_the_same_for_any_number_of_threads():
    one, three = (grown(SCENES["rounded"], threads) for threads in (1, 3))
    assert one[3].tobytes() == three[3].tobytes()
    for name, values in one[1].rows.arrays().items():
        assert values.tobytes() == getattr(three[1].rows, name).tobytes(), name


def test_arrays_that_do_not_fit_are_refused():
    context, cache, met, _ = grown(SCENES["sun"])
    numbers, shifts = cache.numbers.shared((0, 2), 4), cache.numbers.shifts(met.slots, (0, 2))
    with pytest.raises(ValueError, match="shifts of"):
        texel_kernels.texel_points(cache.layout.tables, numbers, shifts[:-1], met.slots)
    with pytest.raises(ValueError, match="normals of"):
        texel_kernels.texel_rays(context.tracer.kernel, cache.layout.tables, numbers, shifts[:8], np.zeros((9, 3), np.float32),
                                 np.zeros((9, 3), np.float32), np.zeros((9, 3), np.float32))
    with pytest.raises(ValueError, match="hits are expected"):
        texel_kernels.HitTable(SurfaceHits(met.primitive, met.u[1:], met.v, met.slots))
