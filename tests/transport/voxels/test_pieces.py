"""What lies of triangles in cells that lines hardly meet: all of it, and no more."""

import numpy as np
import pytest
import scene_builders as build

from rtgi_addon.transport.surfaces.geometry import flatten
from rtgi_addon.transport.surfaces.materials import Surfaces
from rtgi_addon.transport.voxels import VoxelGrid, voxelize
from rtgi_addon.transport.voxels.pieces import cut, find_sparse, undivided
from rtgi_addon.transport.voxels.touched import touched_cells

GRID = VoxelGrid((0.0, 0.0, 0.0), 1.0, (12, 12, 12))


def rod(rng, thick, sides=3):
    """A rod of 8 cells any way in GRID, with so many of its three sides: one is a strip."""
    axes = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    size = np.array([8.0, thick, thick])[:, None]
    corners = rng.uniform(5.5, 6.5, 3) + build.CUBE_CORNERS * 0.5 @ (size * axes)
    return build.mesh("rod", corners, build.CUBE_TRIANGLES if sides == 3 else build.CUBE_TRIANGLES[:2])


def in_voxels(mesh):
    scene = build.scene([mesh])
    geometry = flatten(scene)
    return geometry, voxelize(geometry, Surfaces(scene, geometry), GRID, 1)


@pytest.mark.parametrize("thick", [0.02, 0.1, 0.4])
def test_every_cell_that_a_rod_touches_is_found_and_its_area_stays(thick):
    rng = np.random.default_rng(4)
    for _ in range(4):
        geometry, voxels = in_voxels(rod(rng, thick))
        corners = geometry.triangles_world.astype(np.float64)
        cells = np.concatenate([found for _, found in touched_cells(corners, (0, 0, 0), GRID.resolution)])
        touched = np.unique((cells[:, 2] * 12 + cells[:, 1]) * 12 + cells[:, 0])
        assert np.isin(voxels.cells, touched).all() and np.isin(touched, voxels.cells).mean() > 0.97
        assert voxels.area.sum() == pytest.approx(geometry.areas.sum(dtype=np.float64), rel=1e-6)
        shown = voxels.by_face(np.ones((len(voxels.seen.face), 1)))[..., 0]
        assert shown == pytest.approx(np.repeat(voxels.opacity, 2, axis=1), abs=1e-5)


def test_a_thin_strip_blocks_as_much_as_its_shadow():
    rng = np.random.default_rng(5)
    for _ in range(4):
        geometry, voxels = in_voxels(rod(rng, 0.03, sides=1))
        shadow = np.abs(geometry.normals_world * geometry.areas[:, None]).sum(axis=0)
        assert voxels.opacity.sum(axis=0) == pytest.approx(shadow, rel=1e-3, abs=1e-4)


def test_pieces_are_all_of_a_triangle_and_lie_in_their_cells():
    rng = np.random.default_rng(6)
    corners, names = rng.uniform(0.5, 11.5, (3, 3, 40)), np.arange(40, dtype=np.int32) + 7
    nothing = np.zeros(GRID.count, bool)
    touching = find_sparse(GRID, corners, nothing, nothing, 0.25)
    pieces = cut(GRID, corners, names, touching, np.zeros(40, bool))
    assert (np.abs(pieces.place) <= 0.5 + 1e-9).all()
    assert np.bincount(pieces.primitive - 7, pieces.share) == pytest.approx(np.ones(40), abs=1e-12)
    # Places and barycentrics say the same, and are the triangle's middle in the mean.
    place = GRID.centers_of(pieces.cell) + pieces.place
    a, b, c = (corners[:, corner, pieces.primitive - 7].T for corner in range(3))
    assert place == pytest.approx(a + pieces.u[:, None] * (b - a) + pieces.v[:, None] * (c - a), abs=1e-5)
    for axis in range(3):
        mean = np.bincount(pieces.primitive - 7, pieces.share * place[:, axis])
        assert mean == pytest.approx(corners[axis].mean(axis=0), abs=1e-3)
    whole = undivided(GRID, corners, names)
    assert len(whole.cell) == 40 and (np.abs(whole.place) <= 0.5).all()


def test_where_lines_tell_enough_nothing_is_cut():
    corners = np.array([[0.5, 11.5, 0.5], [0.5, 0.5, 11.5], [3.3, 3.3, 3.3]])[:, :, None]
    all_met, none = np.ones(GRID.count, bool), np.zeros(GRID.count, bool)
    assert not find_sparse(GRID, corners, all_met, none, 0.25).sparse.any()
    # Few lines that met a large triangle's corner tell enough of that.
    assert not find_sparse(GRID, corners, all_met, all_met, 0.25).sparse.any()
    assert find_sparse(GRID, corners[:, :, :] * [[[1.0], [1.0], [0.51]], [[1.0], [1.0], [0.051]], [[1.0], [1.0], [1.0]]], all_met,
                       all_met, 0.25).sparse.any()
