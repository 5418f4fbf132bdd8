"""Points of maps put into cells, against what they must give exactly."""

import numpy as np
import pytest
import room_scenes as rooms
import scene_builders as build

from rtgi_addon.transport.context import LightContext
from rtgi_addon.transport.surfaces.geometry import flatten
from rtgi_addon.transport.views.camera import CameraView
from rtgi_addon.transport.views.gbuffer import draw_gbuffer
from rtgi_addon.transport.views.reflective_shadow_map import capture
from rtgi_addon.transport.views.shadow_views import views_of
from rtgi_addon.transport.voxels import VoxelGrid, grid_around, voxelize
from rtgi_addon.transport.voxels.injection import inject

RADIUS, AWAY, PIXELS = 1.0, 4.0, 400
# A pixel this grazing would stand for more of the surface than it sees.
GRAZING = 0.05


def rows_of(voxels):
    row = np.full(voxels.grid.count, -1, np.int32)
    row[voxels.cells] = np.arange(len(voxels.cells))
    return row


def camera_points(context):
    """Positions, normals and footprints t²·dΩ/cos of what a camera on the z axis sees."""
    extent = RADIUS / (AWAY**2 - RADIUS**2) ** 0.5 * 1.01
    near, far = 0.1, 20.0
    clip = np.diag([1 / extent, 1 / extent, -(far + near) / (far - near), 0.0])
    clip[2, 3], clip[3, 2] = -2 * far * near / (far - near), -1.0
    camera = np.eye(4)
    camera[2, 3] = AWAY
    drawn = draw_gbuffer(context, CameraView(camera, clip), (PIXELS, PIXELS))
    points, normals = drawn.position[drawn.seen][:, :3].astype(np.float64), drawn.geometry[drawn.seen][:, :3].astype(np.float64)
    to_eye = camera[:3, 3] - points
    distance = np.linalg.norm(to_eye, axis=1)
    solid_angle = (to_eye[:, 2] / distance) ** 3 * (2 * extent / PIXELS) ** 2
    facing = (to_eye * normals).sum(axis=1) / distance
    return points, normals, distance**2 * solid_angle / np.maximum(facing, GRAZING)


@pytest.fixture(scope="module")
def ball():
    context = LightContext(build.scene([build.sphere(radius=RADIUS, subdivisions=5)], lights=[build.point_light((0, 0, AWAY))]))
    grid = grid_around(np.array(context.geometry.bounds()), 32)
    return context, voxelize(context.geometry, context.surfaces, grid)


def test_a_camera_puts_in_the_cap_of_a_sphere_that_it_sees(ball):
    context, voxels = ball
    points, normals, areas = camera_points(context)
    # What grazing pixels miss is a few hundredths.
    cap = 2 * np.pi * RADIUS**2 * (1 - RADIUS / AWAY)
    assert 0.94 * cap < areas.sum() < cap
    filled = inject(voxels.grid, rows_of(voxels), points, normals, areas[:, None])[..., 0] * voxels.grid.cell**2
    # All of it arrives; the cap's shadow along the axis is a disc, less what grazing pixels miss.
    assert filled[:, 5].sum() == pytest.approx((areas * normals[:, 2]).sum(), rel=1e-3)
    assert filled[:, 5].sum() == pytest.approx(np.pi * (RADIUS**2 - (RADIUS**2 / AWAY) ** 2), rel=0.02)
    assert filled[:, 4].sum() == 0.0
    # Opposite sides alike, and faces of cells that are seen in full are as full as their lines say.
    assert filled[:, 0].sum() == pytest.approx(filled[:, 1].sum(), rel=0.02)
    top = voxels.grid.centers_of(voxels.cells)[:, 2] > 0.6 * RADIUS
    assert filled[top, 5] / voxels.grid.cell**2 == pytest.approx(voxels.opacity[top, 2], abs=0.2)
    assert filled[top, 5].sum() / voxels.grid.cell**2 == pytest.approx(voxels.opacity[top, 2].sum(), rel=0.01)


def test_a_lamp_lights_a_sphere_with_all_that_it_sends_there(ball):
    context, voxels = ball
    shown, flux = 0.0, np.zeros(3)
    for view in views_of(context, 0, 512):
        texels = capture(context, view).lights()
        normals = context.geometry.normals_world[texels.primitive]
        shown = shown + inject(voxels.grid, rows_of(voxels), texels.positions, normals, texels.flux)
        flux += (np.abs(normals).sum(axis=1)[:, None] * texels.flux).sum(axis=0)
    # Each face takes what its normal's component says.
    assert shown.sum(axis=(0, 1)) * voxels.grid.cell**2 == pytest.approx(flux, rel=1e-5)
    albedo = context.surfaces.albedo_of_side(np.zeros(1, np.int32), *np.zeros((2, 1), np.float32), np.ones(1, np.float32))[0]
    # 1 W/sr over the sphere's solid angle.
    sent = 2 * np.pi * (1 - (1 - (RADIUS / AWAY) ** 2) ** 0.5)
    total = sum(capture(context, view).total_flux for view in views_of(context, 0, 512))
    assert total == pytest.approx(sent * albedo, rel=0.01)


def test_whole_cells_of_translation_move_what_is_put_in_and_nothing_else():
    grid, rng = VoxelGrid((0.0, 0.0, 0.0), 0.5, (8, 8, 8)), np.random.default_rng(1)
    points, row = rng.uniform(0.6, 1.9, (200, 3)), np.arange(grid.count, dtype=np.int32)
    normals = rng.normal(size=(200, 3))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    near, far = (inject(grid, row, points + shift, normals, np.ones((200, 2))).reshape(8, 8, 8, 6, 2)
                 for shift in (np.zeros(3), np.array([1.0, 0.5, 1.5])))
    assert np.allclose(np.roll(near, (3, 1, 2), axis=(0, 1, 2)), far, atol=1e-12)


def test_points_that_rounding_puts_into_empty_cells_are_found():
    floor = flatten(build.scene([rooms.quad("floor", (0, 0, 3.0), (8, 0, 0), (0, 8, 0))]))
    grid, row = VoxelGrid((0.0, 0.0, 0.0), 1.0, (8, 8, 8)), np.full(512, -1, np.int32)
    row[3 * 64:4 * 64] = np.arange(64)
    assert floor.count == 2
    points = np.array([[1.5, 1.5, 3.0 - 3e-5], [1.5, 1.5, 4.1], [1.5, 1.5, 5.5], [9.0, 0.0, 3.0]])
    shown = inject(grid, row, points, np.tile([0.0, 0.0, 1.0], (4, 1)), np.ones((4, 1)))
    # Two of them, one beside its cell; the others are where nothing takes them in.
    assert shown[9, 5] == 2.0 and shown.sum() == 2.0
