"""Flat pieces of emissive surfaces: closed forms, and samples whose mean they are."""

import numpy as np
import pytest
import scene_builders as build

from rtgi_addon.transport.lights.pane_faces import flat_faces
from rtgi_addon.transport.lights.panes import Panes, sample_triangle, solid_angle
from rtgi_addon.transport.surfaces.geometry import flatten

# Facing down at height 1, from the origin's foot to (a, b).
A, B = 0.8, 1.7
QUARTER = np.array([[0.0, 0.0, 1.0], [0.0, B, 1.0], [A, B, 1.0], [A, 0.0, 1.0]])


def panes(*corners, radiance=1.0):
    return Panes(np.array(corners), np.full((len(corners), 3), radiance))


def receivers(count=400, seed=3):
    rng = np.random.default_rng(seed)
    normals = rng.normal(size=(count, 3))
    return rng.uniform(-1.5, 0.9, (count, 3)), normals / np.linalg.norm(normals, axis=1)[:, None]


def test_a_parallel_rectangle_gives_what_tables_say():
    found = panes(QUARTER, radiance=2.0).irradiance(np.zeros((2, 3)), np.array([[0, 0, 1.0], [0, 0, -1.0]]))
    across, along = np.sqrt(1 + A * A), np.sqrt(1 + B * B)
    factor = (A / across * np.arctan(B / across) + B / along * np.arctan(A / along)) / (2 * np.pi)
    assert found == pytest.approx(2.0 * np.pi * np.array([[factor] * 3, [0.0] * 3]), abs=1e-12)


def test_the_side_that_does_not_shine_is_dark():
    assert not panes(QUARTER).factors(np.array([[0.2, 0.3, 1.5]]), np.array([[0, 0, -1.0]])).any()


def test_the_horizon_cuts_it_as_a_sum_over_its_area_does():
    points, normals = receivers()
    x, y = ((np.arange(300) + 0.5) / 300 * side for side in (A, B))
    grid = np.stack([*(part.ravel() for part in np.meshgrid(x, y)), np.ones(90_000)], axis=1)
    found = panes(QUARTER).factors(points, normals)[0]
    for row in range(0, 400, 40):
        towards = grid - points[row]
        squared = np.sum(towards**2, axis=1)
        cosines = np.maximum(towards @ normals[row], 0) * towards[:, 2]
        assert found[row] == pytest.approx(A * B * np.mean(cosines / squared**2), abs=2e-4)


def test_a_corner_given_twice_is_a_triangle():
    points, normals = receivers()
    halves = panes(QUARTER[[0, 1, 2, 2]], QUARTER[[0, 2, 3, 3]])
    assert np.allclose(halves.factors(points, normals).sum(axis=0), panes(QUARTER).factors(points, normals)[0], atol=1e-9)
    assert np.allclose(halves.normals, panes(QUARTER).normals.repeat(2, axis=0))


def test_samples_have_the_closed_form_as_their_mean():
    points, normals = receivers()
    both, rng = panes(QUARTER, QUARTER + np.array([-1.5, -0.5, 0.4])), np.random.default_rng(5)
    both.radiance[1] = 3.0, 2.0, 1.0
    factors, count = both.factors(points, normals), 600
    drawn = np.array([both.sample(points, normals, rng.random((400, 3)), factors).weight[:, 1] for _ in range(count)])
    true, error = both.irradiance(points, normals)[:, 1], drawn.std(axis=0) / np.sqrt(count)
    lit = true > 1e-3
    assert np.abs((drawn.mean(axis=0) - true)[lit] / np.maximum(error[lit], 1e-4)).max() < 5.0
    assert drawn.mean() == pytest.approx(true.mean(), rel=0.003)


def test_samples_lie_on_the_pane():
    points, normals = receivers()
    one = panes(QUARTER)
    sample = one.sample(points, normals, np.random.default_rng(7).random((400, 3)), one.factors(points, normals))
    there = (points + sample.direction * sample.distance[:, None])[sample.weight[:, 0] > 0]
    assert len(there) > 100 and np.abs(there[:, 2] - 1).max() < 1e-6
    assert np.all((there[:, :2] > -1e-6) & (there[:, :2] < np.array([A, B]) + 1e-6))


@pytest.mark.parametrize("size", [1.0, 1e-4])
def test_directions_are_even_over_the_solid_angle(size):
    corners = np.array([[0.3, 0.1, 1.0], [1.1, 0.2, 0.9], [0.2, 0.9, 1.2]]) * [size, size, 1.0]
    area = 0.5 * np.linalg.norm(np.cross(corners[1] - corners[0], corners[2] - corners[0]))
    u = np.random.default_rng(2).random((20_000, 2))
    direction, _, weight = sample_triangle(np.repeat(corners[None], len(u), axis=0), np.full(len(u), area), u)
    true = abs(solid_angle(corners[None])[0])
    assert weight.mean() == pytest.approx(true, rel=1e-5)
    # The flux through a small area is the vector sum, which Lambert's formula has.
    flux = panes(corners[[0, 2, 1, 1]]).factors(np.zeros((3, 3)), np.eye(3))[0]
    assert (direction * weight[:, None]).mean(axis=0) == pytest.approx(flux, rel=0.01)


def test_triangles_become_the_faces_that_they_were():
    geometry = flatten(build.scene([build.cube()]))
    faces = flat_faces(geometry.triangles_world, geometry.normals_world)
    assert faces.shape == (6, 4, 3)
    cube = Panes(faces, np.ones((6, 3)))
    assert np.allclose(cube.areas.sum(axis=1), 4.0) and np.all(np.einsum("ij,ij->i", cube.normals, faces.mean(axis=1)) > 0.99)


def test_faces_that_would_not_be_flat_and_convex_stay_triangles():
    ball = flatten(build.scene([build.sphere(subdivisions=1)]))
    assert len(flat_faces(ball.triangles_world, ball.normals_world)) == 80
    # Two triangles that make an arrowhead.
    dart = np.array([[[0, 0, 0], [2, 0, 0], [0.5, 0.5, 0]], [[0, 0, 0], [0.5, 0.5, 0], [0, 2, 0]]], float)
    faces = flat_faces(dart, np.tile([0, 0, 1.0], (2, 1)))
    assert len(faces) == 2 and np.array_equal(faces[:, 2], faces[:, 3])
