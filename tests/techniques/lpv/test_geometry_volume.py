"""What stands in the way: surfels from surfaces and views, faces from rays and from surfels, area."""

import numpy as np
import pytest
import room_scenes as rooms
import scene_builders as build

from rtgi_addon.scene import Camera
from rtgi_addon.techniques.lpv.crossings import trace_faces
from rtgi_addon.techniques.lpv.geometry_volume import (
    ABOVE,
    ALBEDO,
    BELOW,
    CLOSED,
    CROSSING,
    NORMAL,
    SPREAD,
    Surfels,
    combine,
    face_blocking,
    inject_surfels,
)
from rtgi_addon.techniques.lpv.grid import LpvGrid
from rtgi_addon.techniques.lpv.surfels import of_camera, of_map, peel
from rtgi_addon.transport.context import LightContext
from rtgi_addon.transport.views.reflective_shadow_map import capture
from rtgi_addon.transport.views.shadow_views import views_of

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


def traced(*meshes, grid=GRID, albedo=0.5):
    """The geometry volume of ``meshes`` by rays."""
    context = context_of(*meshes, albedo=albedo)
    return trace_faces(context, grid, peel(context, grid))


@pytest.mark.parametrize("x", [-0.14, 0.0, 0.1])
def test_a_wall_closes_the_nearest_faces_wherever_it_lies_in_the_cell(x):
    volume = traced(rooms.quad("wall", (x, -3, -3), (0, 6, 0), (0, 0, 6)), albedo=(0.2, 0.5, 0.8))
    across, *along = volume.planes
    # Plane 4 is at x = 0.
    assert np.flatnonzero(across[CLOSED].any(axis=(0, 1))).tolist() == [4] and np.all(across[CLOSED][..., 4] == 1)
    assert not any(plane[CLOSED].any() for plane in along)
    wall = across[..., 4]
    assert np.allclose(wall[CROSSING], x / 0.3, atol=1e-4)
    for side in (wall[BELOW], wall[ABOVE]):
        assert np.allclose(side[SPREAD], 1.0, atol=1e-5)
        assert np.allclose(side[NORMAL], np.array([1.0, 0, 0])[:, None, None], atol=1e-5)
        assert np.allclose(side[ALBEDO], np.array([0.2, 0.5, 0.8])[:, None, None])
    # One face before the wall and one behind it, of the wall's own area.
    assert volume.area.sum() == pytest.approx(2 * 64, rel=1e-5) and np.allclose(face_blocking(volume).area, 1.0)


def rooms_of(volume):
    """Number (nz, ny, nx) of the cells' room, of those that faces without a way through part: flood fill."""
    room, count = np.full(volume.grid.shape, -1), 0
    while (room < 0).any():
        grown = np.zeros(volume.grid.shape, bool)
        grown[np.unravel_index(np.argmax(room < 0), room.shape)] = True
        while True:
            before = grown.sum()
            for axis, plane in enumerate(volume.planes):
                passed = np.moveaxis(plane[CLOSED] < 1, 2 - axis, 0)[1:-1]
                cells = np.moveaxis(grown, 2 - axis, 0)
                cells[1:] |= cells[:-1] & passed
                cells[:-1] |= cells[1:] & passed
            if grown.sum() == before:
                break
        room[grown], count = count, count + 1
    return room


@pytest.mark.parametrize("mesh", [
    build.sphere("ball", 0.83, 3),
    rooms.quad("slant", (-3.1, -2.9, -2.2), (6, 0.5, 4), (0.3, 6, 0.9)),
    build.cube("thin", 1.0),
])
def test_no_light_gets_through_a_closed_surface_whatever_its_slope(mesh):
    if mesh.name == "thin":
        # A board of a millimetre that reaches through the volume, turned against its cells.
        turn = np.linalg.qr(np.random.default_rng(4).normal(size=(3, 3)))[0]
        mesh = build.mesh("thin", mesh.vertices_local * [4, 4, 5e-4] @ turn.T, mesh.triangles)
    volume = traced(mesh)
    room = rooms_of(volume)
    x, y, z = (GRID.corner[axis] + (np.arange(8) + 0.5) * GRID.cell for axis in range(3))
    centers = np.stack(np.meshgrid(x, y, z, indexing="ij"), axis=-1).transpose(2, 1, 0, 3)
    if mesh.name == "ball":
        side = np.linalg.norm(centers, axis=-1) < 0.82
    else:
        corner = mesh.vertices_local[mesh.triangles[0]]
        normal = np.cross(corner[1] - corner[0], corner[2] - corner[0]) if mesh.name == "slant" else turn[:, 2]
        side = (centers - (corner[0] if mesh.name == "slant" else 0)) @ normal > 0
    assert side.any() and not side.all()
    assert not set(room[side]) & set(room[~side])


def test_a_pole_and_the_edge_of_a_window_close_their_share_of_a_face():
    # A board 0.1 m wide before faces of 0.3 m, in their middle.
    pole = rooms.quad("pole", (0.02, 0.1, -3), (0, 0.1, 0), (0, 0, 6))
    assert np.allclose(traced(pole).planes[0][CLOSED][1:-1, 4, 4], 1 / 3)
    half = rooms.quad("half", (0.02, -3, -3), (0, 3.2, 0), (0, 0, 6))
    assert np.allclose(traced(half).planes[0][CLOSED][1:-1, :, 4], [1, 1, 1, 1, 2 / 3, 0, 0, 0])


def test_a_wall_that_ends_at_a_floor_is_closed_down_to_it():
    wall = rooms.quad("wall", (0.02, -3, -0.73), (0, 6, 0), (0, 0, 4))
    floor = rooms.quad("floor", (-3, -3, -0.73), (6, 0, 0), (0, 6, 0))
    volume = traced(wall, floor)
    # The floor stands on plane 2, at z = -0.6: the cells above it are parted, those below are not.
    assert np.all(volume.planes[0][CLOSED][2:, :, 4] == 1) and not volume.planes[0][CLOSED][:1, :, 4].any()
    assert np.all(volume.planes[2][CLOSED][2] == 1)


def test_each_face_of_a_thin_wall_has_its_own_albedo():
    up = rooms.quad("up", (-3, -3, 0.03), (6, 0, 0), (0, 6, 0), 0)
    down = rooms.quad("down", (-3, -3, -0.03), (0, 6, 0), (6, 0, 0), 1)
    context = LightContext(build.scene([up, down], [build.material("bright", 0.8), build.material("dark", 0.2)]))
    floor = trace_faces(context, GRID, peel(context, GRID)).planes[2][:, 4]
    assert np.allclose(floor[ABOVE][ALBEDO], 0.8) and np.allclose(floor[BELOW][ALBEDO], 0.2)


def test_stairs_are_as_large_as_their_surface_once_shared_out():
    tilt = np.array([0.5, 0.3, np.sqrt(1 - 0.34)])
    across = np.cross(tilt, [0, 1, 0])
    along = np.cross(tilt, across)
    plane = rooms.quad("tilted", -4 * (across + along) + [0.01, 0.02, 0.03], 8 * across, 8 * along)
    volume = traced(plane, grid=LpvGrid((-1.2,) * 3, 0.1, (24, 24, 24)))
    stairs = sum((rows[CLOSED] / np.maximum(rows[ABOVE][SPREAD], 1)).sum() for rows in volume.planes)
    assert volume.area.sum() / 2 == pytest.approx(stairs, rel=0.05)
    ratio = face_blocking(volume).area
    assert np.average(ratio, weights=volume.area.ravel()) == pytest.approx(1.0, abs=0.05)


def test_surfels_close_the_faces_nearest_to_them_by_their_cross_section():
    slope = np.array([0.6, 0.0, 0.8])
    surfels = Surfels(np.array([[0.1, 0.15, -0.16]]), slope[None], np.array([0.045]), np.array([[0.2, 0.5, 0.8]]))
    x, y, z = inject_surfels(GRID, surfels).planes
    assert x[CLOSED, 3, 4, 4] == pytest.approx(0.3) and z[CLOSED, 3, 4, 4] == pytest.approx(0.4) and not y[CLOSED].any()
    side = x[BELOW, 3, 4, 4]
    assert np.array_equal(side, x[ABOVE, 3, 4, 4])
    assert np.allclose(side[NORMAL], slope) and np.allclose(side[ALBEDO], [0.2, 0.5, 0.8])
    assert side[SPREAD] == pytest.approx(1.4) and x[CROSSING, 3, 4, 4] == pytest.approx(1 / 3)
    blocking = face_blocking(inject_surfels(GRID, surfels))
    cell = np.ravel_multi_index((3, 4, 3), GRID.shape)
    assert np.allclose(blocking.reflectance[0, 0][:, cell], [0.2, 0.5, 0.8], rtol=1e-5)
    assert np.allclose(blocking.normal[0, 0][:, cell], [0.6, 0.0, 0.8], atol=1e-5)
    assert np.allclose(blocking.blocked[0, 0][:, cell], [0.3, 1 / 1.4], rtol=1e-5)
    assert blocking.through[0, cell] == pytest.approx(0.7)


def test_of_two_views_the_one_that_sees_more_counts():
    def at(x, area):
        return inject_surfels(GRID, Surfels(np.array([[x, 0.1, 0.1]]), np.array([[1.0, 0, 0]]), np.array([area]), np.ones((1, 3))))

    both = combine([at(0.0, 0.05), at(0.0, 0.08), at(0.9, 0.02)])
    assert both.planes[0][CLOSED].sum() == pytest.approx((0.08 + 0.02) / 0.09, rel=1e-5)
    assert both.area.sum() == pytest.approx(2 * (0.08 + 0.02) / 0.09, rel=1e-5)
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
