"""Where cascades lie: nested, snapped, centred, blended."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
import scene_builders as build

from rtgi_addon.errors import BakeError, UsageError
from rtgi_addon.scene import Camera
from rtgi_addon.techniques.lpv.cascades import place_cascades, shares
from rtgi_addon.techniques.lpv.settings import LpvSettings

BOUNDS = np.array([[-1.0, -1, -1], [1, 1, 1]])


def with_camera(x):
    pose = np.eye(4)
    pose[0, 3] = x
    return replace(build.closed_box(), cameras=(Camera("camera", pose, np.eye(4), (4, 4)),))


def test_a_fitted_cascade_holds_the_room_and_outer_ones_double():
    grids = place_cascades(build.closed_box(half_size=1.0), LpvSettings(cascades=3), BOUNDS)
    assert [grid.resolution for grid in grids] == [(16, 16, 16)] * 3
    assert np.allclose([grid.cell for grid in grids], np.array([1, 2, 4]) * grids[0].cell)
    for inner, outer in pairwise(grids):
        assert np.all(np.asarray(outer.corner) <= inner.corner) and np.all(outer.high >= inner.high)
    assert np.all(np.asarray(grids[0].corner) < -1) and np.all(grids[0].high > 1) and grids[0].cell < 0.16


def test_far_walls_do_not_blow_the_finest_cascade_up():
    grid, = place_cascades(build.closed_box(), LpvSettings(), np.array([[-900.0] * 3, [900.0] * 3]))
    assert np.prod(grid.high - grid.corner) ** (1 / 3) == pytest.approx(2.0 * 16 / 14, rel=1e-6)


def test_moving_the_centre_moves_volumes_by_whole_cells():
    settings = LpvSettings(center="camera", cell_size=0.1, cascades=2)
    steps = set()
    for x in np.linspace(0.0, 1.0, 37):
        for level, grid in enumerate(place_cascades(with_camera(x), settings, BOUNDS)):
            cells = np.asarray(grid.corner) / grid.cell
            assert np.allclose(cells, np.round(cells), atol=1e-9)
            assert np.all(np.abs(grid.center - [x, 0, 0]) <= 0.5 * grid.cell + 1e-9)
            steps.add((level, round(float(cells[0]))))
    assert len(steps) == 11 + 6


def test_cascades_centre_on_an_object_by_name():
    scene = build.scene([build.cube("far", 0.5)], volumes=[build.volume()])
    scene = replace(scene, instances=(replace(scene.instances[0], world_from_local=build.transform((3.0, 2.0, 1.0))),))
    grid, = place_cascades(scene, LpvSettings(center="far", cell_size=0.25), BOUNDS)
    assert np.all(np.abs(grid.center - [3, 2, 1]) <= 0.125 + 1e-9)
    with pytest.raises(UsageError, match="center is 'near'"):
        place_cascades(scene, LpvSettings(center="near"), BOUNDS)
    with pytest.raises(BakeError, match="camera"):
        place_cascades(scene, LpvSettings(center="camera"), BOUNDS)


def test_a_volume_above_the_texture_limit_is_refused():
    with pytest.raises(BakeError, match="larger than a texture of 16384 pixels"):
        place_cascades(build.closed_box(), LpvSettings(resolution=700), BOUNDS)
    assert place_cascades(build.closed_box(), LpvSettings(resolution=512), BOUNDS)[0].count == 512**3


def test_shares_blend_over_the_border_and_sum_to_one():
    grids = place_cascades(build.closed_box(), LpvSettings(cascades=3), BOUNDS)
    points = np.random.default_rng(0).uniform(-12, 12, (2000, 3))
    share = shares(grids, points)
    assert np.allclose(share.sum(axis=1), 1.0) and share.min() >= 0
    assert np.all(share[grids[1].inside(points) ^ True, :2] == 0)
    middle = shares(grids, np.zeros((1, 3)))
    assert middle.tolist() == [[1, 0, 0]]
    # From outside to inside nothing jumps.
    line = np.linspace([0, 0, 0], [12, 0, 0], 4000)
    assert np.abs(np.diff(shares(grids, line), axis=0)).max() < 0.02
