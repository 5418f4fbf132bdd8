"""Where rays are inside closed meshes, held to closed forms and to the winding number by solid angles."""

import numpy as np
import pytest
from scene_builders import cube, sphere, transform

from rtgi_addon.numerics.sampling import fibonacci_sphere
from rtgi_addon.scene import ClosedMesh
from rtgi_addon.transport.media.inside import Convex, Everywhere, Winding, inside_of

TURN = np.linalg.qr(np.random.default_rng(2).normal(size=(3, 3)))[0]


def closed(*meshes, matrix=None):
    """Several meshes as one closed surface."""
    counts = np.cumsum([0, *(len(mesh.vertices_local) for mesh in meshes)])
    return ClosedMesh(np.concatenate([mesh.vertices_local for mesh in meshes]),
                      np.concatenate([mesh.triangles + count for mesh, count in zip(meshes, counts, strict=False)]),
                      np.eye(4) if matrix is None else matrix)


def rays(n, reach=3.0, seed=0):
    """n rays in all directions from points in a cube of half size ``reach``."""
    return np.random.default_rng(seed).uniform(-reach, reach, (n, 3)), fibonacci_sphere(n).astype(np.float64)


def length(inside, origins, directions, t_max=np.inf):
    spans = inside.spans(origins, directions, np.full(len(origins), t_max))
    assert np.all(spans.leave >= spans.enter) and np.all(spans.enter >= 0) and np.all(spans.leave <= np.maximum(t_max, 0))
    return np.sum(spans.leave - spans.enter, axis=1)


def chord(origins, directions, radius=1.0, t_max=np.inf):
    """How long rays run inside a sphere about 0."""
    middle = -np.sum(origins * directions, axis=1)
    half = np.sqrt(np.maximum(radius**2 - np.sum(origins**2, axis=1) + middle**2, 0.0))
    return np.maximum(np.minimum(middle + half, t_max) - np.clip(middle - half, 0.0, None), 0.0)


def solid_angle_winding(mesh, points):
    """Winding number (n,): the signed solid angles of all triangles over 4π (A. van Oosterom and J. Strackee 1983)."""
    a, b, c = np.moveaxis(mesh.vertices_local[mesh.triangles].astype(np.float64)[None] - points[:, None, None], 2, 0)
    la, lb, lc = (np.linalg.norm(corner, axis=2) for corner in (a, b, c))
    below = la * lb * lc + np.sum(a * b, 2) * lc + np.sum(b * c, 2) * la + np.sum(c * a, 2) * lb
    return np.sum(2 * np.arctan2(np.sum(a * np.cross(b, c), 2), below), axis=1) / (4 * np.pi)


def test_all_space_has_no_end():
    assert np.all(np.isinf(length(Everywhere(), *rays(4)))) and np.all(length(Everywhere(), *rays(4), 2.0) == 2.0)


@pytest.mark.parametrize("matrix", [np.eye(4), transform((0.3, -0.2, 1), (0.5, 1, -2), TURN)], ids=["unit", "mirrored"])
def test_a_box_by_planes_and_by_crossings_is_the_same(matrix):
    planes, crossings = inside_of(closed(cube(), matrix=matrix)), Winding(closed(cube(), matrix=matrix))
    assert isinstance(planes, Convex)
    for t_max in (np.inf, 2.0):
        assert length(planes, *rays(4000), t_max) == pytest.approx(length(crossings, *rays(4000), t_max), abs=2e-5)
    assert length(Convex.box(matrix), *rays(4000)) == pytest.approx(length(planes, *rays(4000)), abs=1e-6)


def test_a_sphere_is_left_where_its_chord_ends():
    ball = inside_of(closed(sphere(subdivisions=4)))
    assert isinstance(ball, Winding)
    assert length(ball, *rays(3000)) == pytest.approx(chord(*rays(3000)), abs=0.12)
    assert length(ball, *rays(3000)).mean() == pytest.approx(chord(*rays(3000)).mean(), rel=5e-3)


@pytest.mark.parametrize("inward", [False, True], ids=["outward", "inward"])
def test_parts_that_overlap_fill_space_once_however_their_faces_point(inward):
    parts = [cube(inward=inward), sphere(radius=1.3, subdivisions=2, inward=inward)]
    both, points = Winding(closed(*parts)), rays(2000, 1.5, 3)[0]
    inside = solid_angle_winding(closed(*parts), points)
    assert np.array_equal(both.contains(points), np.abs(inside) > 0.5)
    # Along rays as well: what is inside at the middle of every piece.
    origins, directions = rays(500, 2.0, 5)
    spans = both.spans(origins, directions, np.full(500, 4.0))
    t = np.linspace(0.013, 3.97, 40)
    within = np.any((spans.enter[:, None] < t[None, :, None]) & (t[None, :, None] < spans.leave[:, None]), axis=2)
    at = (origins[:, None] + directions[:, None] * t[None, :, None]).reshape(-1, 3)
    wrong = within.ravel() != (np.abs(solid_angle_winding(closed(*parts), at)) > 0.5)
    assert wrong.mean() < 1e-3


def test_a_hollow_is_outside():
    hollow = inside_of(closed(cube(half_size=2.0), cube(half_size=1.0, inward=True)))
    origins = np.array([[0, 0, 0.1], [1.5, 0.2, 0.1], [-5, 0.3, 0.2]])
    assert hollow.contains(origins).tolist() == [False, True, False]
    assert length(hollow, origins, np.tile([[1.0, 0, 0]], (3, 1))) == pytest.approx([1.0, 0.5, 2.0], abs=1e-5)
