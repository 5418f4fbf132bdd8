"""What a camera's matrices say, and where in a pixel frames are sampled."""

import numpy as np
import pytest

from rtgi_addon.transport.views.camera import CameraView
from rtgi_addon.transport.views.pixel_filter import WIDTH, filter_offset

SIZE = 40, 20
PERSPECTIVE = np.array([[1.5, 0, 0.1, 0], [0, 3.0, -0.2, 0], [0, 0, -(50 + 0.5) / 49.5, -2 * 50 * 0.5 / 49.5], [0, 0, -1, 0]])
PARALLEL = np.array([[0.5, 0, 0, 0.1], [0, 1.0, 0, -0.2], [0, 0, -2 / 49.5, -50.5 / 49.5], [0, 0, 0, 1]])


def pose():
    """Looking along +X from (1, 2, 3), Z up."""
    matrix = np.eye(4)
    matrix[:3, :3] = np.array([(0, -1, 0), (0, 0, 1), (-1, 0, 0)]).T
    matrix[:3, 3] = 1, 2, 3
    return matrix


@pytest.mark.parametrize("clip", [PERSPECTIVE, PARALLEL])
def test_near_and_far_come_out_of_the_matrix(clip):
    view = CameraView(pose(), clip)
    assert view.depths == pytest.approx((0.5, 50.0))
    assert view.orthographic == (clip is PARALLEL)
    assert view.drawn(SIZE).far == pytest.approx(50.0)


@pytest.mark.parametrize("clip", [PERSPECTIVE, PARALLEL])
@pytest.mark.parametrize("offset", [(0.0, 0.0), (0.3, -0.8)])
def test_background_rays_are_where_points_are_drawn(clip, offset):
    view = CameraView(pose(), clip)
    base, across, up = view.rays(SIZE, offset)
    place = np.array([0.7, 0.2])
    direction = base + place[0] * across + place[1] * up
    # Far along the ray, wherever it starts, a point is drawn at the place it came from.
    start = view.world_from_camera[:3, 3]
    if view.orthographic:
        origin = np.linalg.inv(view.drawn(SIZE, offset).clip_from_world) @ [*(2 * place - 1), -1, 1]
        start = origin[:3]
    clipped = view.drawn(SIZE, offset).clip_from_world @ [*(start + 10.0 * direction / np.linalg.norm(direction)), 1]
    assert clipped[:2] / clipped[3] == pytest.approx(2 * place - 1, abs=1e-9)


def test_an_offset_moves_the_picture_by_so_many_pixels():
    view = CameraView(pose(), PERSPECTIVE)
    point = np.array([9.0, 2.5, 3.5, 1.0])
    places = []
    for offset in ((0, 0), (1, -2)):
        clipped = view.drawn(SIZE, offset).clip_from_world @ point
        places.append((clipped[:2] / clipped[3] * 0.5 + 0.5) * SIZE)
    assert places[1] - places[0] == pytest.approx([1, -2])


@pytest.mark.parametrize("clip", [PERSPECTIVE, PARALLEL])
def test_corners_enclose_what_is_seen_between_two_depths(clip):
    view = CameraView(pose(), clip)
    corners = view.corners(2.0, 4.0)
    assert corners.shape == (8, 3)
    assert np.sort(corners[:, 0] - 1.0) == pytest.approx([2.0] * 4 + [4.0] * 4)
    clipped = np.c_[corners, np.ones(8)] @ view.drawn(SIZE).clip_from_world.T
    assert np.abs(clipped[:, :2] / clipped[:, 3:]) == pytest.approx(np.ones((8, 2)))


def test_views_are_equal_by_what_they_show():
    view = CameraView(pose(), PERSPECTIVE)
    assert view.equals(CameraView(pose().copy(), PERSPECTIVE.copy()))
    assert not view.equals(CameraView(pose(), PARALLEL)) and not view.equals(None)


def test_offsets_follow_the_blackman_harris_window():
    u = (np.arange(512) + 0.5) / 512
    offsets = np.array([filter_offset(np.array([value, 0.5]))[0] for value in u])
    x = np.linspace(-0.5, 0.5, 10001)
    window = (0.35875 + 0.48829 * np.cos(2 * np.pi * x) + 0.14128 * np.cos(4 * np.pi * x) + 0.01168 * np.cos(6 * np.pi * x))
    assert offsets.mean() == pytest.approx(0, abs=1e-6)
    assert offsets.var() == pytest.approx(WIDTH**2 * np.sum(window * x**2) / window.sum(), rel=0.01)
    assert np.abs(offsets).max() < 0.5 * WIDTH
