"""Receivers lie on surfaces that usable probes see, under normals that spread as they say."""

import numpy as np
import pytest
import scene_builders as build

from rtgi_addon.evaluate.receivers import open_probes, surface_receivers
from rtgi_addon.transport.context import LightContext


def test_receivers_lie_on_the_walls_and_face_the_room():
    context = LightContext(build.closed_box(), 1)
    found = surface_receivers(context, np.zeros((1, 3)), 200, 3, seed=4)
    assert found.points.shape == found.normals.shape == (600, 3) and found.own.sum() == 200
    assert np.abs(found.points).max(axis=1) == pytest.approx(1.0, abs=1e-4)
    # Normals of their own point along one axis, from the wall to the eye; the others leave the wall too.
    own = found.take(found.own)
    assert np.abs(own.normals).max(axis=1) == pytest.approx(1.0) and np.all(np.sum(own.normals * own.points, axis=1) < -0.99)
    surface = np.repeat(own.normals, 3, axis=0)
    cosine = np.sum(surface * found.normals, axis=1)[~found.own]
    assert np.all(cosine > -1e-6) and np.linalg.norm(found.normals, axis=1) == pytest.approx(1.0, abs=1e-5)
    # Cosine-distributed: the mean cosine is 2/3, its standard deviation over 400 is √(1/18)/20.
    assert cosine.mean() == pytest.approx(2 / 3, abs=5 * np.sqrt(1 / 18 / 400))


def test_another_seed_gives_other_points():
    context = LightContext(build.closed_box(), 1)
    one, same, other = (surface_receivers(context, np.zeros((1, 3)), 16, 2, seed) for seed in (0, 0, 1))
    assert np.array_equal(one.points, same.points) and np.array_equal(one.normals, same.normals)
    assert not np.isin(one.points, other.points).all(axis=1).any()


def test_an_open_scene_gives_what_can_be_seen():
    context = LightContext(build.open_plane(half_size=1.0), 1)
    found = surface_receivers(context, np.array([[0.0, 0.0, 1.0]]), 50, 1)
    assert len(found.points) == 50 and np.all(found.normals[:, 2] == 1.0)
    nothing = surface_receivers(context, np.array([[0.0, 0.0, 1e7]]), 4, 1)
    assert len(nothing.points) == 0


def test_probes_inside_solids_are_not_usable():
    scene = build.scene([build.cube("block", 0.5)], lights=[build.point_light((2.0, 0.0, 0.0))],
                        volumes=[build.volume(resolution=(5, 1, 1), half_size=(2.0, 0.1, 0.1))])
    assert open_probes(LightContext(scene, 1), scene.volumes).tolist() == [0, 1, 3, 4]
