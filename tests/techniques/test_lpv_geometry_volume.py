"""What stands in the way: surfels from surfaces and views, coverage at the corners, faces."""

import numpy as np
import pytest
import room_scenes as rooms
import scene_builders as build

from rtgi_addon.scene import Camera
from rtgi_addon.techniques.lpv.geometry_volume import Surfels, combine, face_blocking, inject_surfels
from rtgi_addon.techniques.lpv.grid import FRONT_SOLID_ANGLE, SIDE_SOLID_ANGLE, LpvGrid
from rtgi_addon.techniques.lpv.surfels import of_camera, of_map, peel
from rtgi_addon.transport.context import LightContext
from rtgi_addon.transport.reflective_shadow_map import capture
from rtgi_addon.transport.shadow_views import views_of

GRID = LpvGrid((-1.2, -1.2, -1.2), 0.3, (8, 8, 8))


def context_of(*meshes, lights=(), albedo=0.5):
    return LightContext(build.scene(meshes, [build.material("m", albedo)], lights))


@pytest.mark.parametrize(("mesh", "area"), [
    (build.cube("cube", 0.8), 6 * 1.6**2), (build.plane("plane", 1.0), 4.0), (build.sphere("ball", 0.9, 4), 4 * np.pi * 0.81),
    (rooms.quad("slant", (-0.9, -0.9, -0.4), (1.8, 0, 0.8), (0, 1.8, 0.3)), np.linalg.norm(np.cross([1.8, 0, 0.8], [0, 1.8, 0.3]))),
])
def test_peeling_finds_all_surface(mesh, area):
    surfels = peel(context_of(mesh, albedo=(0.2, 0.4, 0.6)), GRID)
    assert surfels.area.sum() == pytest.approx(area, rel=0.08)
    assert np.allclose(np.linalg.norm(surfels.normals, axis=1), 1.0, atol=1e-5)
    assert np.allclose(surfels.albedo, [0.2, 0.4, 0.6])


def test_surface_that_reaches_far_beyond_the_volume_costs_nothing():
    surfels = peel(context_of(build.plane("ground", 3000.0)), GRID)
    assert surfels.area.sum() == pytest.approx((9 * 0.3) ** 2, rel=1e-5)


def test_layers_close_together_are_all_found():
    planes = [build.plane(f"p{i}", 1.0, z=0.01 * i) for i in range(5)]
    assert peel(context_of(*planes), GRID).area.sum() == pytest.approx(5 * 4.0, rel=0.05)


def test_a_wall_covers_its_faces_wherever_it_lies_in_the_cell():
    for x in (-0.14, 0.0, 0.1):
        wall = rooms.quad("wall", (x, -3, -3), (0, 6, 0), (0, 0, 6))
        volume = inject_surfels(GRID, peel(context_of(wall), GRID))
        through = face_blocking(volume, bounces=False).through[0].reshape(4, *GRID.shape)
        closed = np.flatnonzero(np.all(through[0] < 1e-6, axis=(0, 1)))
        # Cell 3 ends at x = 0; the last cell ends at the border.
        assert closed.tolist() == [3, 7]
        assert np.all(np.abs(through[1:, :, :, 3]) < 1e-6)
        assert np.allclose(through[0][:, :, :3], FRONT_SOLID_ANGLE / (4 * np.pi))
        along = face_blocking(volume, bounces=False).through[1].reshape(4, *GRID.shape)
        assert np.allclose(along[0][:, :-1], FRONT_SOLID_ANGLE / (4 * np.pi))


def test_blockers_reflect_their_albedo_about_their_normal():
    slope = np.array([0.6, 0.0, 0.8])
    surfels = Surfels(np.array([[0.0, 0.0, 0.0]]), slope[None], np.array([0.09]), np.array([[0.2, 0.5, 0.8]]))
    blocking = face_blocking(inject_surfels(GRID, surfels))
    cell = np.ravel_multi_index((4, 4, 3), GRID.shape)
    assert np.allclose(blocking.reflectance[0, 0][:, cell], [0.2, 0.5, 0.8], rtol=1e-5)
    assert np.allclose(blocking.normal[0, 0][:, cell], [0.6, 0.0, 0.8], atol=1e-5)
    # A quarter of the corner's 0.6 is the face's.
    assert blocking.blocked[0, 0, 0, cell] == pytest.approx(0.15 * FRONT_SOLID_ANGLE / (4 * np.pi), rel=1e-5)
    sides = 2 * (0.15 + 0.5 * np.array([0.0, 0.2])).sum() * SIDE_SOLID_ANGLE / (4 * np.pi)
    assert blocking.blocked[0, 0, 1, cell] == pytest.approx(sides, rel=1e-5)


def test_of_two_views_the_one_that_sees_more_counts():
    def at(x, area):
        return inject_surfels(GRID, Surfels(np.array([[x, 0.0, 0.0]]), np.array([[1.0, 0, 0]]), np.array([area]), np.ones((1, 3))))

    both = combine([at(0.0, 0.05), at(0.0, 0.08), at(0.9, 0.02)])
    assert both.coverage.sum() == pytest.approx((0.08 + 0.02) / 0.09, rel=1e-5)
    assert not both.is_empty and inject_surfels(GRID, Surfels(*(np.zeros(s) for s in ((0, 3), (0, 3), 0, (0, 3))))).is_empty


def test_shadow_maps_and_cameras_see_the_area_that_there_is():
    context = context_of(build.cube("room", 1.0, inward=True), lights=[build.point_light((0.2, -0.1, 0.3))], albedo=0.4)
    parts = [of_map(context, capture(context, view)) for view in views_of(context, 0, 96)]
    assert sum(part.area.sum() for part in parts) == pytest.approx(24.0, rel=0.02)
    assert all(np.allclose(part.albedo, 0.4) for part in parts)
    # A camera 2 m above the ground that looks down on it under 90 degrees sees 4 m by 4 m.
    pose = np.eye(4)
    pose[2, 3] = 2.0
    projection = np.array([[1.0, 0, 0, 0], [0, 1.0, 0, 0], [0, 0, -1.002, -0.2002], [0, 0, -1.0, 0]])
    seen = of_camera(context_of(build.plane("ground", 50.0)), Camera("camera", pose, projection, (640, 640)))
    assert seen.area.sum() == pytest.approx(16.0, rel=1e-3)
    assert np.allclose(seen.normals, [0, 0, 1]) and np.allclose(seen.positions[:, 2], 0.0, atol=1e-5)
