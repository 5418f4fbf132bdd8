"""Levels, rays and cones through cells whose light is known."""

import numpy as np
import pytest
import room_scenes as rooms
import scene_builders as build

from rtgi_addon.evaluate.stability.parts import moved, rotation
from rtgi_addon.numerics.sampling import about, cosine_hemisphere, fibonacci_sphere, sobol_owen
from rtgi_addon.transport.surfaces.geometry import flatten
from rtgi_addon.transport.surfaces.materials import Surfaces
from rtgi_addon.transport.voxels import VoxelGrid, Voxels, cones, grid_around, voxelize
from rtgi_addon.transport.voxels.hierarchy import build_hierarchy
from rtgi_addon.transport.voxels.rays import march
from rtgi_addon.transport.voxels.tables import pack, row_numbers, unpack
from rtgi_addon.transport.voxels.voxelize import NO_PLATE, Seen
from rtgi_addon.transport.voxels.walls import find_walls, too_wide


def lit(meshes, box, resolution, radiance=1.0):
    """The hierarchy of ``meshes``, whose first shines with ``radiance`` from its front; all else is black."""
    scene = build.scene(meshes)
    geometry = flatten(scene)
    voxels = voxelize(geometry, Surfaces(scene, geometry), grid_around(np.array(box, float), resolution))
    shines = (geometry.instance[voxels.seen.primitive] == 0) & (voxels.seen.side > 0)
    return build_hierarchy(voxels, voxels.by_face(np.where(shines[:, None], np.float32(radiance), 0) * np.ones(3, np.float32)))


def slab(layers, opacity, count=64, first=24):
    """Cells of ``opacity`` in ``layers`` of z, as wide as the grid, that glow with radiance 1."""
    grid = VoxelGrid((0.0, 0.0, 0.0), 1.0, (count, count, count))
    cells = np.arange(first * count**2, (first + layers) * count**2)
    return build_hierarchy(filled(grid, cells, np.full((len(cells), 3), opacity, np.float32), np.eye(6)[0] + np.eye(6)[1], False),
                           np.full((len(cells), 6, 3), opacity, np.float32))


def filled(grid, cells, opacity, lie, solid):
    """Voxels of which all is alike."""
    count, nothing = len(cells), np.zeros((len(cells), 3))
    return Voxels(grid, cells, opacity, np.ones(count), nothing, nothing, np.tile(lie, (count, 1)), nothing, np.full(count, solid),
                  np.full((count, 3), NO_PLATE), Seen(*(np.zeros(0, int) for _ in range(6))))


def irradiance(hierarchy, points, normals, count, beyond=0.0):
    points, normals = np.asarray(points, np.float32), np.asarray(normals, np.float32)
    return cones.irradiance(hierarchy, points, normals, cones.cone_set(count),
                            lambda points, directions, spread: np.full((len(points), 3), beyond, np.float32))


@pytest.mark.parametrize("count", [6, 16, 32, 64])
def test_weights_have_the_moments_of_the_cosine_lobe(count):
    directions, weights, _ = cones.cone_set(count)
    height = directions[:, 2]
    moments = weights @ np.stack([np.ones(count), height, 1.5 * height**2 - 0.5], axis=1)
    assert moments == pytest.approx([1.0, 2.0 / 3.0, 0.25], abs=1e-7) and weights.min() > 0
    # And nothing across: a gradient along the surface adds nothing.
    x, y, _ = directions.T
    assert np.abs(weights @ np.stack([x, y, x * height, y * height, x * y, x * x - y * y], axis=1)).max() < 1e-7
    assert count != 6 or weights == pytest.approx([1 / 3] + [2 / 15] * 5)


def test_too_few_cones_are_refused():
    with pytest.raises(ValueError, match="choose 6"):
        cones.cone_set(5)


def test_an_empty_surrounding_gives_pi_times_the_radiance_beyond():
    hierarchy = lit([build.cube(half_size=0.1)], [[-4, -4, -4], [4, 4, 4.0]], 16)
    normals = fibonacci_sphere(20)
    away = normals * 2.5
    for count in (6, 16):
        assert irradiance(hierarchy, away, normals, count, 1.0) == pytest.approx(np.pi, rel=1e-6)


@pytest.mark.parametrize("step", [0.125, 0.5, 1.0])
@pytest.mark.parametrize("slope", [(0, 0, 1.0), (0.5, 0.2, 0.84)])
def test_a_slab_lets_through_what_it_does_however_one_steps(step, slope):
    direction, hierarchy = np.array([slope]) / np.linalg.norm(slope), slab(4, 0.3)
    start = np.array([[22.0, 28.0, 9.0]])
    # Cells of this slab block along all three axes, and the way through it is longer along the others.
    exact = 4 * (1 + (abs(direction[0, 0]) + abs(direction[0, 1])) / direction[0, 2]) * -np.log(0.7)
    seen = cones.trace_cones(hierarchy, start, direction, np.zeros(1), None, step)
    assert -np.log(seen.passed) == pytest.approx([exact], rel=0.01)
    assert seen.radiance[0] == pytest.approx(1 - seen.passed[0], rel=1e-4)
    assert march(hierarchy, start, direction).passed == pytest.approx([np.exp(-exact)], rel=1e-5)


@pytest.mark.parametrize("level", range(4))
def test_every_level_of_a_slab_lets_the_same_through(level):
    made = slab(8, 0.3, first=0).levels[level]
    depth = made.depth[1:, 2] * 8 / made.size
    assert depth == pytest.approx(-8 * np.log(0.7), rel=1e-4)


def test_a_sheet_of_opacity_one_lets_nothing_through_under_any_angle():
    hierarchy = lit([build.plane(half_size=4.0)], [[-3, -3, -3], [3, 3, 3.0]], 19)
    directions = fibonacci_sphere(200).astype(np.float32)
    directions = directions[np.abs(directions[:, 2]) > 0.2]
    origins = np.float32([[0.01, 0.02, 1.3]]) * np.sign(-directions[:, 2:]) * np.float32([[1, 1, 1]])
    hit = np.abs(origins[:, :2] + directions[:, :2] * np.abs(origins[:, 2:] / directions[:, 2:])).max(axis=1) < 2.8
    assert hit.sum() > 60 and not march(hierarchy, origins[hit], directions[hit]).passed.any()


def test_a_wall_of_two_colours_keeps_them_on_every_level():
    low, high = rooms.quad("low", (-4, -4, 0.0), (8, 0, 0), (0, 8, 0)), rooms.quad("high", (-4, -4, 0.05), (8, 0, 0), (0, 8, 0))
    scene = build.scene([low, high])
    geometry = flatten(scene)
    voxels = voxelize(geometry, Surfaces(scene, geometry), grid_around(np.array([[-4, -4, -4], [4, 4, 4.0]]), 32))
    colours = np.eye(3, dtype=np.float32)[geometry.instance[voxels.seen.primitive]]
    for level in build_hierarchy(voxels, voxels.by_face(colours)).levels:
        # Both are one sheet, and its sides have one colour each, whichever way its normal points.
        up = (level.sheet[1:, 2] > 0).astype(int)
        assert np.all(level.sheet[1:, 2] != 0) and not level.depth.any()
        shown, rows = level.shown.reshape(-1, 2, 3)[1:], np.arange(len(up))
        assert not shown[rows, up, 1].any() and not shown[rows, 1 - up, 0].any()
        assert np.allclose(shown[rows, up, 0], 1) and np.allclose(shown[rows, 1 - up, 1], 1)


@pytest.mark.parametrize("height", [0.5, 1.0, 2.0, 4.0])
def test_an_endless_plane_gives_pi_times_its_radiance_at_any_height(height):
    hierarchy = lit([build.plane(half_size=40.0)], [[-40, -40, -1], [40, 40, 5.0]], 96)
    point, normal = np.float32([[0.3, 0.1, height]]), np.float32([[0, 0, -1]])
    for count in (6, 16):
        assert irradiance(hierarchy, point, normal, count) == pytest.approx(np.pi, rel=0.01)
    directions = about(np.repeat(normal, 1024, axis=0), cosine_hemisphere(sobol_owen(1024, 2, 1)))
    seen = march(hierarchy, np.repeat(point, 1024, axis=0), directions)
    assert np.pi * seen.radiance.mean(axis=0) == pytest.approx(np.pi, rel=0.015)
    # The lecture's own estimate would be 1/(5h²): with the scene twice as large it changes, this does not.


def plates(perpendicular, resolution, count=None):
    """The form factor between unit squares, opposite or with a common edge, through cells, by rays or ``count`` cones."""
    source = rooms.quad("source", (-0.5, -0.5, 0), (1, 0, 0), (0, 1, 0))
    corner, u, v, normal = ((-0.5, -0.5, 0), (0, 0, 1), (0, 1, 0), (1, 0, 0)) if perpendicular else (
        (-0.5, -0.5, 1), (1, 0, 0), (0, 1, 0), (0, 0, -1))
    hierarchy = lit([source, rooms.quad("receiver", corner, u, v)], [[-0.6, -0.6, -0.1], [0.6, 0.6, 1.1]], resolution)
    if count is not None:
        places = sobol_owen(128, 2, 7)
        points = np.float32(corner) + places[:, :1] * np.float32(u) + places[:, 1:] * np.float32(v)
        return float(irradiance(hierarchy, points, np.tile(np.float32(normal), (128, 1)), count)[:, 0].mean()) / np.pi
    places, rays = sobol_owen(1024, 4, 7), 16
    points = np.repeat(np.float32(corner) + places[:, :1] * np.float32(u) + places[:, 1:2] * np.float32(v), rays, axis=0)
    numbers = (sobol_owen(rays, 2, 5)[None] + places[:, None, 2:]) % 1.0
    normals = np.tile(np.float32(normal), (len(points), 1))
    seen = march(hierarchy, points.astype(np.float32), about(normals, cosine_hemisphere(numbers.reshape(-1, 2))), normals)
    return float(seen.radiance[:, 0].mean())


@pytest.mark.parametrize("perpendicular", [False, True])
def test_form_factors_of_plates(perpendicular):
    exact = 0.200044 if perpendicular else 0.199825
    coarse, fine = (abs(plates(perpendicular, resolution) / exact - 1) for resolution in (12, 64))
    assert fine < 0.02 and fine < coarse


@pytest.mark.parametrize("perpendicular", [False, True])
def test_form_factors_near_the_exact_ones_as_cells_shrink(perpendicular):
    """By rays, with the cell. By cones too, if there are four times as many for cells half as large; so many that are fixed stay
    off."""
    exact = 0.200044 if perpendicular else 0.199825
    by_rays = [abs(plates(perpendicular, resolution) / exact - 1) for resolution in (12, 24, 48)]
    assert by_rays[0] < 0.07 and by_rays[1] < 0.6 * by_rays[0] and by_rays[2] < 0.6 * by_rays[1]
    coarse, fine = (plates(perpendicular, resolution, count) / exact - 1 for resolution, count in ((12, 64), (24, 256)))
    assert 0 < fine < 0.7 * coarse
    fixed = [plates(perpendicular, resolution, 16) / exact - 1 for resolution in (24, 48)]
    assert fixed[1] > 0.9 * fixed[0]


@pytest.mark.parametrize(("perpendicular", "most"), [(False, 0.2), (True, 0.07)])
def test_form_factors_by_cones_near_the_exact_ones_as_cones_narrow(perpendicular, most):
    """They stay above: what ends reaches further by a part of the voxels that a cone reads."""
    exact = 0.200044 if perpendicular else 0.199825
    few, many = (plates(perpendicular, 24, count) / exact - 1 for count in (16, 256))
    assert 0 < many < most and many < 0.6 * few


@pytest.mark.parametrize("degrees", [0.0, 20.0, 45.0])
def test_a_closed_room_lets_no_cone_out_however_it_is_turned(degrees):
    turn = rotation((0.2, 0.1, 1.0), degrees)
    scene = moved(build.scene([build.cube("room", 1.0, inward=True)]), turn)
    geometry = flatten(scene)
    voxels = voxelize(geometry, Surfaces(scene, geometry), grid_around(np.array(geometry.bounds()), 48))
    light = voxels.by_face(np.where(voxels.seen.side[:, None] > 0, np.float32(1), 0) * np.ones(3, np.float32))
    directions = fibonacci_sphere(300)
    points = np.random.default_rng(1).uniform(-0.5, 0.5, (300, 3)) @ turn[:3, :3].T
    for spread in (0.02, 0.36, 0.58):
        seen = cones.trace_cones(build_hierarchy(voxels, light), points, directions, np.full(300, spread))
        assert seen.passed.mean() < 4e-3 and seen.radiance.mean() == pytest.approx(1.0, abs=0.02)


@pytest.mark.parametrize(("layers", "most"), [(1, 0.23), (3, 0.0)])
def test_walls_leak_no_more_than_anisotropic_voxels_do(layers, most):
    """A cone of 30° half angle at walls 14 cells away, at 12 places: the anisotropic column of the table in the brief."""
    count = 48
    grid = VoxelGrid((0.0, 0.0, 0.0), 1.0, (count, count, count))
    passed = []
    for phase in range(12):
        first = 20 + phase % 4
        cells = np.arange(first * count**2, (first + layers) * count**2)
        opacity = np.tile(np.float32([0, 0, 1]), (len(cells), 1))
        hierarchy = build_hierarchy(filled(grid, cells, opacity, np.eye(6)[2], True), np.zeros((len(cells), 6, 3), np.float32))
        start = np.array([[24.0 + phase / 12, 24.0, first - 14.0 - phase / 12]])
        passed.append(cones.trace_cones(hierarchy, start, np.array([[0, 0, 1.0]]), np.array([np.tan(np.pi / 6)])).passed[0])
    assert np.mean(passed) <= most


def columns(*faces):
    """Shares of fronts (n, 6) of cells in a row along x: letters of each say which way fronts look there, < or >."""
    return np.array([["<" in cell, ">" in cell, 0, 0, 0, 0] for cell in faces], float)


def test_a_wall_is_what_has_its_inside_between_its_fronts():
    place = np.array([[x, 3, 2] for x in (1, 4, 9, 11, 20)])
    # A wall from 1 to 4, a corridor up to 9, whose other wall ends at 11; at 20 both sides are in one cell.
    walls = find_walls(place, columns("<", ">", "<", ">", "<>"))
    assert sorted(zip(walls.place[:, 0], walls.thickness, strict=True)) == [(1, 4), (4, 4), (9, 3), (11, 3), (20, 1)]
    assert not len(find_walls(place, columns(">", "<", "", "", "<")).thickness)
    # What is in other columns is another's; slivers of fronts are none.
    assert not len(find_walls(place + np.arange(5)[:, None] * [0, 1, 0], columns("<", ">", "<", ">", ">")).thickness)
    assert not len(find_walls(place, 0.1 * columns("<", ">", "<", ">", "<>")).thickness)


def test_cells_are_too_wide_from_the_walls_twice_their_thickness_on():
    # A wall from 16 to 19 with a floor before it and behind it.
    place, fronts = np.array([[x, 8, 8] for x in (14, 16, 19, 22)]), columns("", "<", ">", "")
    fronts[[0, 3], 5] = 1.0
    walls = find_walls(place, fronts)
    for size, wide in ((2, False), (4, False), (8, False), (16, True)):
        count = 32 // size + 2
        found = too_wide(walls, size, (count, count, count)).reshape(count, count, count)
        assert found.any() == wide
        if wide:
            # Cell 1 along each axis, after the empty layer the second along x, and what is read with both.
            assert np.argwhere(found).tolist() == [[z, y, 1] for z in (0, 1) for y in (0, 1)]
    # With a floor on one side alone, or a ceiling on the other, no face shows both.
    for other in (0.0, [0, 0, 0, 0, 1, 0]):
        fronts[3] = other
        assert not too_wide(find_walls(place, fronts), 16, (4, 4, 4)).any()


def test_lists_keep_where_cells_are_too_wide():
    hierarchy = lit([build.cube("room", 3.0, inward=True), build.cube("block", 0.2)], [[-3, -3, -3], [3, 3, 3.0]], 40)
    tables = pack((hierarchy,))
    (again,), numbers = unpack(tables), row_numbers(tables)
    assert tables.wide.any() and np.array_equal(numbers * 4 % 2 == 1, tables.wide)
    assert all(np.array_equal(one.wide, two.wide) for one, two in zip(hierarchy.levels, again.levels, strict=True))


def test_what_lies_across_an_axis_is_met_where_it_lies():
    """A floor with a board on it in one cell: who passes above the floor and beside the board meets neither."""
    parts = rooms.quad("floor", (0, 0, 0.3), (1, 0, 0), (0, 1, 0)), rooms.quad("board", (0.2, 0, 0.3), (0, 0.2, 0), (0, 0, 0.6))
    hierarchy, voxels = black(parts, VoxelGrid((-1.0, -1.0, -1.0), 1.0, (3, 3, 3)))
    assert voxels.plates[0, [0, 2]] == pytest.approx([-0.3, -0.2], abs=1e-6) and voxels.plates[0, 1] == NO_PLATE
    assert not hierarchy.levels[0].sheet.any()
    beside, down = np.float32([[0.5, 0.6, 0.95]]), np.float32([[1.0, 0.0, -0.3]]) / np.float32(np.sqrt(1.09))
    assert march(hierarchy, beside, down).passed == pytest.approx([1.0])
    # The floor ends all that comes down on it, slowly or not; the board takes its share of all that goes by where it stands.
    slow = np.float32([[0.3, 0.1, -0.2]]) / np.float32(np.sqrt(0.14))
    for direction in (np.float32([[0, 0, -1]]), slow):
        assert march(hierarchy, np.float32([[0.5, 0.6, 0.5]]), direction).passed == pytest.approx([0.0])
    share = float(voxels.opacity[0, 0])
    assert march(hierarchy, np.float32([[0.5, 0.6, 0.8]]), np.float32([[-1, 0, 0]])).passed == pytest.approx([1.0 - share])
    assert 0.1 < share < 0.25


def test_a_sheet_and_the_plates_of_an_edge_in_it_let_nothing_through_between_them():
    """A box on a floor: rays from above, however they are slanted, end on one or the other."""
    floor, box = build.plane(half_size=4.0, z=0.13), build.cube("box", 0.71)
    hierarchy, _ = black([floor, box], VoxelGrid((-4.0, -4.0, -4.0), 0.5, (16, 16, 16)))
    rng = np.random.default_rng(3)
    directions = rng.normal(size=(400, 3)) * [1.0, 1.0, 0.3]
    directions[:, 2] = -np.abs(directions[:, 2]) - 0.2
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    goals = np.concatenate([rng.uniform(-1.5, 1.5, (400, 2)), np.full((400, 1), 0.13)], axis=1)
    origins = (goals - directions * 1.5).astype(np.float32)
    assert march(hierarchy, origins, directions.astype(np.float32)).passed.max() < 1e-3


def black(meshes, grid):
    """Hierarchy and Voxels of ``meshes`` that show nothing."""
    scene = build.scene(meshes)
    geometry = flatten(scene)
    voxels = voxelize(geometry, Surfaces(scene, geometry), grid)
    return build_hierarchy(voxels, np.zeros((len(voxels.cells), 6, 3), np.float32)), voxels
