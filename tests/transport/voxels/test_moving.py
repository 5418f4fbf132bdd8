"""Voxels that follow what has moved: what is taken out of them and what a camera puts in, against voxels that are made anew."""

from dataclasses import replace

import numpy as np
import pytest
import scene_builders as build

from rtgi_addon.techniques.voxels.moved import moved_since
from rtgi_addon.transport.context import LightContext
from rtgi_addon.transport.views.camera import CameraView
from rtgi_addon.transport.views.gbuffer import draw_gbuffer
from rtgi_addon.transport.voxels import VoxelGrid, voxelize
from rtgi_addon.transport.voxels.hierarchy import build_hierarchy
from rtgi_addon.transport.voxels.moving import CameraPoints, with_points, without
from rtgi_addon.transport.voxels.rays import march
from rtgi_addon.transport.voxels.voxelize import Seen

GRID = VoxelGrid((-2.0, -2.0, -0.5), 0.125, (32, 32, 32))
# A cell holds a row of pixels more or less than it should: a part in eight of them, here.
PIXELS = 400


def scene(at=(0.6, 0.0, 1.0), floor=True):
    """A box in the air, off the lattice, above a floor."""
    meshes = [build.cube("box", 0.4), *([build.plane("floor", 1.9)] if floor else [])]
    made = build.scene(meshes)
    return replace(made, instances=(replace(made.instances[0], world_from_local=build.transform(at)), *made.instances[1:]))


def voxels_of(made, grid=GRID):
    context = LightContext(made)
    return context, voxelize(context.geometry, context.surfaces, grid)


def camera(orthographic=False, height=6.0):
    """From above, down; 5 m wide where the floor is."""
    pose, near, far, width = np.eye(4), 0.1, 20.0, 5.0
    pose[2, 3] = height
    if orthographic:
        return CameraView(pose, np.array([[2 / width, 0, 0, 0], [0, 2 / width, 0, 0],
                                          [0, 0, -2 / (far - near), -(far + near) / (far - near)], [0, 0, 0, 1.0]]))
    scale = 2 * height / width
    return CameraView(pose, np.array([[scale, 0, 0, 0], [0, scale, 0, 0],
                                      [0, 0, -(far + near) / (far - near), -2 * far * near / (far - near)], [0, 0, -1, 0.0]]))


def seen_by(context, view, pixels=PIXELS, radiance=1.0):
    drawn = draw_gbuffer(context, view, (pixels, pixels))
    points, normals = (part[drawn.seen][:, :3].astype(np.float64) for part in (drawn.position, drawn.geometry))
    areas = view.footprint(points, normals, 0.05) / pixels**2
    return CameraPoints(points, normals, areas, np.full(points.shape, radiance), drawn.albedo[drawn.seen][:, :3].astype(np.float64),
                        drawn.instance[drawn.seen])


@pytest.mark.parametrize("orthographic", [False, True])
def test_footprints_are_the_areas_that_are_seen(orthographic):
    context = LightContext(scene(floor=False))
    points = seen_by(context, camera(orthographic), 500)
    top = points.normals[:, 2] > 0.9
    # The box's upper side; a parallel projection sees no other.
    assert points.areas[top].sum() == pytest.approx(0.8**2, rel=0.02)
    assert orthographic == top.all()
    turn = np.linalg.qr(np.random.default_rng(2).normal(size=(3, 3)))[0]
    slanted = scene(floor=False)
    turned = build.transform((0.3, -0.2, 0.4))
    turned[:3, :3] = turn * np.linalg.det(turn)
    slanted = replace(slanted, instances=(replace(slanted.instances[0], world_from_local=turned),))
    points = seen_by(LightContext(slanted), camera(orthographic), 800)
    for side in turned[:3, :3].T:
        for normal in (side, -side):
            of_side = points.normals @ normal > 0.99
            towards = camera().position - points.positions[of_side].mean(axis=0) if of_side.any() else np.zeros(3)
            if of_side.any() and normal @ towards > 0.3 * np.linalg.norm(towards):
                assert points.areas[of_side].sum() == pytest.approx(0.8**2, rel=0.02)


def test_what_is_taken_out_leaves_what_there_would_be_without_it():
    context, voxels = voxels_of(scene())
    _, floor = voxels_of(replace(scene(), instances=scene().instances[1:]))
    gone = np.array([True, False])[context.geometry.instance]
    shown = np.random.default_rng(0).random((len(voxels.seen.face), 3)).astype(np.float32)
    left, radiance = without(voxels, shown, gone, context.geometry)
    assert np.array_equal(left.cells, floor.cells) and np.array_equal(left.opacity, floor.opacity)
    assert np.array_equal(left.lie, floor.lie) and np.array_equal(left.middle, floor.middle)
    assert not gone[left.seen.primitive].any()
    known = np.searchsorted(voxels.cells, left.cells)
    assert np.array_equal(radiance, voxels.by_face(shown)[known])
    again, same = without(voxels, shown, np.zeros(len(gone), bool), context.geometry)
    assert again is voxels and np.array_equal(same, voxels.by_face(shown))


def test_cells_that_held_both_keep_what_stays():
    # The box stands in the floor: cells hold its sides and the floor.
    context, voxels = voxels_of(scene((0.6, 0.0, 0.3)))
    _, floor = voxels_of(replace(scene(), instances=scene().instances[1:]))
    gone = np.array([True, False])[context.geometry.instance]
    left, _ = without(voxels, np.ones((len(voxels.seen.face), 3), np.float32), gone, context.geometry)
    both = np.isin(left.cells, floor.cells)
    assert both.all() and len(left.cells) == len(floor.cells)
    # Under the box the floor is seen from below.
    assert np.allclose(left.opacity, floor.opacity, atol=0.26) and np.allclose(left.opacity.mean(), floor.opacity.mean(), rtol=0.01)
    assert np.allclose(left.lie, floor.lie, atol=1e-9) and np.allclose(left.middle[:, 2], floor.middle[:, 2], atol=0.02)


def test_a_camera_puts_in_what_lines_find():
    context, voxels = voxels_of(scene(floor=False))
    nothing = replace(voxels, cells=voxels.cells[:0], opacity=voxels.opacity[:0], area=voxels.area[:0],
                      normal=voxels.normal[:0], albedo=voxels.albedo[:0], lie=voxels.lie[:0], middle=voxels.middle[:0],
                      solid=voxels.solid[:0], plates=voxels.plates[:0],
                      seen=Seen(*(part[:0] for part in vars(voxels.seen).values())))
    put, radiance = with_points(nothing, np.zeros((0, 6, 3), np.float32), seen_by(context, camera(), radiance=2.0))
    _, top = voxels_of(scene(floor=False))
    known = {int(cell): row for row, cell in enumerate(top.cells)}
    # Its upper side is there as lines find it, and shows its light to who looks down on it; nothing else does.
    level = GRID.cells_of(np.array([[0.6, 0.0, 1.4]]))[0, 2]
    upper = np.flatnonzero(put.cells // (32 * 32) == int(level))
    rows = np.array([known[int(cell)] for cell in put.cells[upper]])
    assert len(upper) >= 36 and np.abs(put.opacity[upper, 2] - top.opacity[rows, 2]).mean() < 0.05
    assert np.allclose(put.opacity[upper, 2].sum(), top.opacity[rows, 2].sum(), rtol=0.05)
    assert np.allclose(radiance[upper, 5], 2.0 * put.opacity[upper, 2, None], atol=1e-6) and radiance[upper, 4].max() == 0
    # A ray from above meets its light, and nothing passes.
    start = np.array([[0.55, 0.05, 3.0], [0.3, -0.2, 3.0], [-1.0, 0.0, 3.0]])
    met = march(build_hierarchy(put, radiance), start, np.tile([0.0, 0.0, -1.0], (3, 1)))
    assert met.passed == pytest.approx([0, 0, 1], abs=1e-3)
    assert met.radiance[:2] == pytest.approx(2.0, abs=1e-2) and met.radiance[2].max() == 0


def test_what_is_known_is_not_put_in_twice():
    context, voxels = voxels_of(scene())
    radiance = voxels.by_face(np.full((len(voxels.seen.face), 3), 3.0, np.float32))
    put, light = with_points(voxels, radiance, seen_by(context, camera(), radiance=3.0))
    known = np.searchsorted(put.cells, voxels.cells)
    assert np.array_equal(put.cells[known], voxels.cells) and len(put.cells) <= 1.01 * len(voxels.cells)
    added = put.opacity[known] - voxels.opacity
    # What is seen, and with it walls, stays with its cells.
    assert np.array_equal(put.by_face(np.ones((len(put.seen.face), 1)))[known],
                          voxels.by_face(np.ones((len(voxels.seen.face), 1))))
    assert {tuple(row) for row in put.walls.place} == {tuple(row) for row in voxels.walls.place}
    # Noise of the lattice of pixels, and no sum of both.
    assert added.min() >= 0 and added.mean() < 0.01
    assert light.sum() == pytest.approx(radiance.sum(), rel=0.03)


def test_whole_cells_of_translation_move_what_is_put_in_and_nothing_else():
    context, voxels = voxels_of(scene())
    points, radiance = seen_by(context, camera()), voxels.by_face(np.ones((len(voxels.seen.face), 3), np.float32))
    shift = np.array([3, -2, 1]) * GRID.cell
    grid = VoxelGrid(tuple(np.asarray(GRID.corner) + shift), GRID.cell, GRID.resolution)
    near, light = with_points(voxels, radiance, points)
    far, same = with_points(replace(voxels, grid=grid), radiance, replace(points, positions=points.positions + shift))
    assert np.array_equal(near.cells, far.cells) and np.allclose(light, same, atol=1e-6)
    assert np.allclose(near.opacity, far.opacity, atol=1e-6) and np.allclose(near.middle, far.middle, atol=1e-6)


def test_points_beyond_the_grid_are_left_out():
    context, voxels = voxels_of(scene())
    points = seen_by(context, camera())
    radiance = voxels.by_face(np.ones((len(voxels.seen.face), 3), np.float32))
    away = replace(points, positions=points.positions + 100.0)
    assert with_points(voxels, radiance, away)[0] is voxels


def test_what_has_moved_is_told_by_name():
    known = scene()
    box, floor = known.instances
    moved = replace(box, world_from_local=build.transform((0, 0, 2)))
    found = moved_since(known, replace(known, instances=(moved, floor)))
    assert found.unknown.tolist() == [True, False] and found.gone.tolist() == [True, False]
    # Another order, a new one, and one that is gone.
    found = moved_since(known, replace(known, instances=(floor, replace(box, name="another"))))
    assert found.unknown.tolist() == [False, True] and found.gone.tolist() == [True, False]
    copied = replace(known, instances=tuple(replace(item) for item in known.instances))
    assert not moved_since(known, copied).any
    # Copies of one name are told apart by their order.
    twice = replace(known, instances=(box, moved, floor))
    assert moved_since(known, twice).unknown.tolist() == [False, True, False]
    # What bakes do not know is not put in, nor what diffuse rays do not meet.
    for hidden in (replace(moved, bake="DYNAMIC"), replace(moved, visible_diffuse=False)):
        found = moved_since(known, replace(known, instances=(hidden, floor)))
        assert not found.unknown.any() and found.gone.tolist() == [True, False]
    painted = replace(known, materials=(build.material("wall", (0.9, 0.1, 0.1)),) * len(known.materials))
    assert moved_since(known, painted).unknown.all()
