"""The voxelizer against what it must give exactly."""

from dataclasses import replace

import numpy as np
import pytest
import room_scenes as rooms
import scene_builders as build

from rtgi_addon.errors import BakeError
from rtgi_addon.scene import Channel, Texture
from rtgi_addon.transport.surfaces.geometry import flatten
from rtgi_addon.transport.surfaces.materials import Surfaces
from rtgi_addon.transport.voxels import VoxelGrid, grid_around, voxelize
from rtgi_addon.transport.voxels.grid import MAX_CELLS

UNIT = VoxelGrid((0.0, 0.0, 0.0), 1.0, (8, 8, 8))
TILTED = build.transform((0.3, 0.2, 0.1), 1.0, np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0])


def made(meshes, grid=None, resolution=24, materials=None, lines=4, matrix=None):
    """Geometry and Voxels of ``meshes``, in a grid around them unless one is given."""
    scene = build.scene(meshes, materials)
    if matrix is not None:
        scene = replace(scene, instances=tuple(replace(instance, world_from_local=matrix) for instance in scene.instances))
    geometry = flatten(scene)
    grid = grid or grid_around(np.array(geometry.bounds()), resolution)
    return geometry, voxelize(geometry, Surfaces(scene, geometry), grid, lines=lines)


def sheet(height, corner=(0.0, 0.0), size=(8.0, 8.0), material_index=0, parts=1):
    """Squares in z = ``height``, ``parts`` by ``parts`` of them."""
    u, v = size[0] / parts, size[1] / parts
    return [rooms.quad(f"{height} {i} {j}", (corner[0] + i * u, corner[1] + j * v, height), (u, 0, 0), (0, v, 0), material_index)
            for i in range(parts) for j in range(parts)]


@pytest.mark.parametrize("subdivisions", [1, 5])
def test_areas_add_up_and_normals_of_closed_meshes_cancel(subdivisions):
    geometry, voxels = made([build.sphere(subdivisions=subdivisions), build.cube(half_size=0.4)], matrix=TILTED)
    area = geometry.areas.sum(dtype=np.float64)
    assert voxels.area.sum() == pytest.approx(area, rel=1e-7)
    assert np.abs((voxels.area[:, None] * voxels.normal).sum(axis=0)).max() < 1e-6 * area
    assert np.all(np.linalg.norm(voxels.normal, axis=1) <= 1 + 1e-6) and np.all(np.diff(voxels.cells) > 0)


@pytest.mark.parametrize("normal", [(0, 0, 1), (1, 0, 0.83), (1, 0.9, 0.83), (0.3, -0.5, 0.8)])
def test_crossings_and_cells_of_a_plane_are_those_of_its_l1_norm(normal):
    normal = np.array(normal, float) / np.linalg.norm(normal)
    rotation = np.linalg.svd(normal[None])[2].T[:, [1, 2, 0]]
    _, voxels = made([build.plane(half_size=1.0)], resolution=64, lines=16,
                     matrix=build.transform((0.013, 0.017, 0.011), 1.0, rotation))
    faces = 4.0 / voxels.grid.cell**2
    assert voxels.opacity.sum(axis=0) == pytest.approx(np.abs(normal) * faces, rel=0.01, abs=1)
    # Cells that are cut at a corner only may be between the lines.
    assert len(voxels.cells) == pytest.approx(np.abs(normal).sum() * faces, rel=0.05)


@pytest.mark.parametrize("parts", [1, 3, 24])
def test_an_opaque_sheet_blocks_all_however_it_is_divided(parts):
    _, voxels = made(sheet(3.4, parts=parts), UNIT)
    assert len(voxels.cells) == 64 and np.all(voxels.opacity[:, 2] == 1.0)
    assert np.all(voxels.opacity[:, :2] == 0.0)


@pytest.mark.parametrize("height", [0.0, 3.0, 7.0])
def test_a_sheet_between_two_cells_lies_in_one(height):
    _, voxels = made(sheet(height, parts=3), UNIT)
    assert np.all(voxels.opacity[:, 2] == 1.0) and len(voxels.cells) == 64


def test_half_a_sheet_blocks_half_and_two_halves_of_one_do_not_add_to_two():
    _, half = made(sheet(3.4, size=(0.5, 1.0)), UNIT)
    assert half.opacity[:, 2] == pytest.approx([0.5])
    _, both = made(sheet(3.4, size=(0.5, 1.0)) + sheet(3.4, (0.5, 0.0), (0.5, 1.0)), UNIT)
    assert both.opacity[:, 2] == pytest.approx([1.0])
    _, above = made(sheet(3.4, size=(0.5, 1.0)) + sheet(3.6, size=(0.5, 1.0)), UNIT)
    assert above.opacity[:, 2] == pytest.approx([0.5])


@pytest.mark.parametrize("count", [1, 2, 5])
def test_sheets_of_coverage_one_behind_another(count):
    veil = replace(build.material("veil"), alpha=Channel.of(0.3))
    meshes = [quad for height in np.linspace(3.1, 3.9, count) for quad in sheet(height)]
    _, voxels = made(meshes, UNIT, materials=[veil])
    assert voxels.opacity[:, 2] == pytest.approx(1 - 0.7**count, abs=1e-6)
    # What each face shows adds up to what it blocks.
    assert voxels.by_face(np.ones((len(voxels.seen.face), 1)))[:, 4:, 0] == pytest.approx(1 - 0.7**count, abs=1e-6)


def test_coverage_is_read_from_the_texture_at_every_crossing():
    pixels = np.zeros((1, 2, 4), np.float32)
    pixels[:, 1] = 1.0
    texture = Texture("half", pixels, interpolation="Closest")
    leaf = replace(build.material("leaf"), alpha=Channel(texture=texture, texture_channel="a", uv_layer="UVMap"))
    quad, = sheet(3.4, size=(1.0, 1.0))
    uv = np.float32([[0, 0], [1, 0], [1, 1], [0, 1]])
    quad = replace(quad, uv_layers={"UVMap": uv[quad.triangles]}, active_uv="UVMap")
    _, voxels = made([quad], UNIT, materials=[leaf])
    assert voxels.opacity[:, 2] == pytest.approx([0.5])


def test_each_face_of_a_thin_wall_shows_its_own_side():
    red, green = build.material("red", (1, 0, 0)), build.material("green", (0, 1, 0))
    low, high = sheet(3.4), sheet(3.6, material_index=1)
    geometry, voxels = made(low + high, UNIT, materials=[red, green])
    colours = np.array([[1, 0], [0, 1]], np.float32)[geometry.material[voxels.seen.primitive]]
    # Looking up one meets the low sheet, looking down the high one.
    assert voxels.by_face(colours)[:, 4] == pytest.approx(np.array([[1, 0]] * 64))
    assert voxels.by_face(colours)[:, 5] == pytest.approx(np.array([[0, 1]] * 64))
    up = voxels.seen.face % 6 == 4
    assert np.all(voxels.seen.side[up] == -1) and np.all(voxels.seen.side[~up] == 1)


def test_albedo_is_that_of_the_surfaces_by_area():
    floors = sheet(3.4, size=(0.75, 1.0)) + sheet(3.4, (0.75, 0.0), (0.25, 1.0), 1)
    _, voxels = made(floors, UNIT, materials=[build.material("a", (1.0, 0.0, 0.5)), build.material("b", 0.2)])
    capped = 0.998
    assert voxels.albedo[0] == pytest.approx([0.75 * capped + 0.05, 0.05, 0.75 * 0.5 + 0.05], abs=1e-5)
    assert voxels.normal[0] == pytest.approx([0, 0, 1], abs=1e-6)


def test_whole_cells_of_translation_move_cells_and_nothing_else():
    ball = build.sphere(radius=1.7, subdivisions=3)
    near = made([rooms.moved(ball, (2.25, 2.5, 2.125))], UNIT)[1]
    far = made([rooms.moved(ball, (5.25, 3.5, 4.125))], UNIT)[1]
    assert np.array_equal(near.cells + 3 + 8 + 2 * 64, far.cells)
    assert np.allclose(near.opacity, far.opacity, atol=1e-6) and np.allclose(near.area, far.area, rtol=1e-5)


def test_a_turn_by_a_right_angle_turns_the_axes():
    turned = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1.0]])
    corner, center = sheet(3.4, (1.25, 2.5), (3.0, 2.0)), np.array([4.0, 4.0, 0.0])
    straight = made(corner, UNIT)[1]
    matrix = build.transform(center - turned @ center, 1.0, turned)
    across = made(corner, UNIT, matrix=matrix)[1]
    dense = straight.dense(straight.opacity[:, 2])
    assert np.allclose(across.dense(across.opacity[:, 2]), np.rot90(dense, 1, axes=(2, 1)), atol=1e-6)


def test_what_the_border_cuts_counts_as_far_as_it_is_inside():
    _, voxels = made(sheet(3.4, (-8.0, -8.0), (24.0, 24.0)), UNIT)
    assert voxels.area.sum() == pytest.approx(64.0, rel=1e-6) and np.all(voxels.opacity[:, 2] == 1.0)


def test_grids_are_of_cubes_and_within_limits():
    grid = grid_around(np.array([[0, 0, 0], [4.0, 1.0, 2.0]]), 43)
    assert grid.cell == pytest.approx(0.1) and grid.resolution == (43, 13, 23)
    with pytest.raises(BakeError, match=f"voxel grid of .* cells of 1e-06 m is beyond {MAX_CELLS:,} cells"):
        grid_around(np.array([[0, 0, 0], [4.0, 1.0, 2.0]]), 43, 1e-6)
    with pytest.raises(BakeError, match="no extent"):
        grid_around(np.zeros((2, 3)), 43)
    with pytest.raises(BakeError, match="holds no geometry"):
        made([build.cube()], VoxelGrid((50.0, 0.0, 0.0), 1.0, (4, 4, 4)))


def test_any_number_of_threads_gives_the_same():
    geometry, one = made([build.sphere(subdivisions=3)])
    scene = build.scene([build.sphere(subdivisions=3)])
    other = voxelize(geometry, Surfaces(scene, geometry), one.grid, threads=1)
    assert np.array_equal(one.opacity, other.opacity) and np.array_equal(one.seen.weight, other.seen.weight)
