"""Which lamps light a frame, from which of their points, through which shadow maps."""

import numpy as np
import pytest

from rtgi_addon.numerics.sampling import sobol_owen
from rtgi_addon.preview.lamp_choice import choose_lamps, lamp_chances
from rtgi_addon.preview.lamp_sample import sample_lamp
from rtgi_addon.preview.shadow_parts import cascade_splits, shadow_parts
from rtgi_addon.scene import AreaLight, PointLight, SpotLight, SunLight
from rtgi_addon.transport.lights.point import ball_point
from rtgi_addon.transport.views.camera import CameraView

BOUNDS = np.array([[-3.0, -3.0, 0.0], [3.0, 3.0, 4.0]])
DOWN = np.float32([0, 0, -1])
WHITE = np.ones(3, np.float32)


def camera():
    """From the side, level, 60 degrees wide."""
    pose = np.eye(4)
    pose[:3, :3] = np.array([(0, -1, 0), (0, 0, 1), (-1, 0, 0)]).T
    pose[:3, 3] = -5, 0, 1
    half, near, far = np.tan(np.radians(30)), 0.1, 100.0
    return CameraView(pose, np.array([[1 / half, 0, 0, 0], [0, 1 / half, 0, 0],
                                      [0, 0, -(far + near) / (far - near), -2 * far * near / (far - near)], [0, 0, -1, 0]]))


def test_every_lamp_is_taken_where_there_is_room():
    chances = lamp_chances(np.array([1.0, 0.0, 5.0]), np.array([6, 1, 3]), 10)
    assert choose_lamps(chances, 0.3) == [(0, 1.0), (1, 1.0), (2, 1.0)]


def test_the_budget_is_kept_and_the_mean_is_right():
    rng = np.random.default_rng(0)
    power, views = rng.random(50) ** 4, rng.integers(1, 7, 50)
    chances = lamp_chances(power, views, 40)
    assert np.sum(chances * views) == pytest.approx(40, rel=1e-6)
    assert np.all(chances > 0) and np.all(chances <= 1)
    total, drawn = np.zeros(50), 0
    for u in (np.arange(1000) + 0.5) / 1000:
        for index, gain in choose_lamps(chances, u):
            total[index] += gain
            drawn += views[index]
    assert total / 1000 == pytest.approx(np.ones(50), abs=0.05)
    assert drawn / 1000 == pytest.approx(40, rel=0.02)


def test_no_lamps_are_chosen_of_none():
    assert choose_lamps(lamp_chances(np.zeros(0), np.zeros(0), 8), 0.5) == []


@pytest.mark.parametrize("axis", [(0, 0, 1), (0.6, 0, 0.8), (1, 0, 0)])
def test_a_ball_of_points_is_an_even_disk_from_everywhere(axis):
    points = np.array([ball_point(u) for u in sobol_owen(4096, 3, 1)])
    assert np.linalg.norm(points, axis=1).max() < 1.0 + 1e-6
    across = points - np.outer(points @ axis, axis)
    radius = np.linalg.norm(across, axis=1)
    # Evenly over the disk: the share within a radius is its square.
    for share in (0.25, 0.5, 0.75, 0.9):
        assert np.mean(radius < np.sqrt(share)) == pytest.approx(share, abs=0.01)


@pytest.mark.parametrize(("light", "count"), [
    (SunLight("sun", np.float32([0.6, 0, -0.8]), WHITE, 0.1), 3),
    (PointLight("point", np.float32([0, 0, 2]), WHITE, 0.2), 6),
    (PointLight("far", np.float32([0, 0, 90]), WHITE, 0.2), 1),
    (SpotLight("spot", np.float32([0, 0, 3]), DOWN, WHITE, 1.0), 1),
    (SpotLight("wide", np.float32([0, 0, 3]), DOWN, WHITE, 3.0), 6),
    (AreaLight("area", np.float32([0, 0, 3]), np.float32([1, 0, 0]), np.float32([0, 1, 0]), DOWN, WHITE), 5),
    (AreaLight("narrow", np.float32([0, 0, 3]), np.float32([1, 0, 0]), np.float32([0, 1, 0]), DOWN, WHITE, spread=0.5), 1),
])
def test_every_visible_point_before_a_lamp_is_in_exactly_one_of_its_maps(light, count):
    sample = sample_lamp(light, np.array([0.3, 0.7, 0.4]))
    parts = list(shadow_parts(sample, camera(), BOUNDS, 64, 3, np.array([0.2, 0.9, 0.6])))
    assert len(parts) == count
    rng = np.random.default_rng(1)
    points = rng.uniform(*BOUNDS, (2000, 3))
    clip = np.c_[points, np.ones(2000)] @ camera().drawn((4, 4)).clip_from_world.T
    points = points[np.all(np.abs(clip[:, :2]) < clip[:, 3:], axis=1)]
    if not isinstance(light, (SunLight, PointLight)):
        below = sample.placed.position_world - points
        slope = np.linalg.norm(below[:, :2], axis=1) / np.maximum(below[:, 2], 1e-9)
        points = points[(below[:, 2] > 0.05) & (slope < (0.25 if count == 1 else 100))]
    if light.name in ("spot", "narrow"):
        assert len(points) > 3
    depth = (points - camera().world_from_camera[:3, 3]) @ -camera().world_from_camera[:3, 2]
    covered = np.zeros(len(points), int)
    for part in parts:
        place, front = part.view.project(points)
        inside = np.all((place > 0) & (place < 1), axis=1) & front
        if isinstance(light, SunLight):
            wanted = (depth >= part.depths[0]) & (depth < part.depths[1])
            assert np.all(inside[wanted])
            covered += wanted
        else:
            covered += inside
    assert np.all(covered == 1)


def test_a_lamp_without_shadow_needs_no_map():
    light = PointLight("lamp", np.float32([0, 0, 2]), WHITE, casts_shadow=False)
    part, = shadow_parts(sample_lamp(light, np.zeros(3)), camera(), BOUNDS, 64, 3, np.zeros(3))
    assert part.view is None and part.uniforms["casts_shadow"] == 0


def test_cascades_reach_from_the_camera_to_the_end_of_the_scene():
    splits = cascade_splits(camera(), BOUNDS, 4)
    assert len(splits) == 5 and np.all(np.diff(splits) > 0)
    assert splits[-1] == pytest.approx(8.0)
    moved = cascade_splits(camera(), BOUNDS, 4, jitter=0.9)
    assert moved[0] == splits[0] and moved[-1] == splits[-1] and np.all(np.diff(moved) > 0)
    assert not np.allclose(moved[1:-1], splits[1:-1])
