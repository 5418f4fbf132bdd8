"""Slices, light given along rays and points drawn along them, held to closed forms."""

import numpy as np
import pytest
from scene_builders import cube, sphere, transform

from rtgi_addon.numerics.sampling import disk_from_square, sobol_owen
from rtgi_addon.scene import ClosedMesh, DensityGrid, Medium
from rtgi_addon.transport.media.passage import slice_integral
from rtgi_addon.transport.media.table import MediaTable


def slab(scattering=0.0, absorption=0.0, emission=0.0, at=0.0, half=1.0):
    box = ClosedMesh(cube().vertices_local, cube().triangles, transform((at, 0, 0), (half, 50, 50)))
    return Medium("slab", *(np.broadcast_to(part, 3).astype(float) for part in (scattering, absorption, emission)), bounds=box)


ORIGIN, AHEAD = np.array([[-3.0, 0.1, 0.2]]), np.array([[1.0, 0, 0]])


def test_a_slice_is_no_product():
    ratios = [depth / (slice_integral(depth, 1.0) * depth) for depth in (0.1, 0.5, 1, 2, 5)]
    assert ratios == pytest.approx([1.051, 1.271, 1.582, 2.313, 5.034], abs=5e-4)
    assert slice_integral(0.0, 3.0) == 3.0 and slice_integral(1e-12, 3.0) == pytest.approx(3.0)
    assert slice_integral(2.0, np.inf) == 0.5 and slice_integral(0.0, np.inf) == np.inf


def test_a_column_of_constant_source():
    column = MediaTable([slab(0, [0.5, 0, 2], 0.3)]).emitted(ORIGIN, AHEAD)[0]
    assert column == pytest.approx([0.37927, 0.6, 0.15 * (1 - np.exp(-4))], rel=1e-5)
    # Cut short by a surface, and seen from within.
    assert MediaTable([slab(0, 0, 0.3)]).emitted(ORIGIN, AHEAD, np.array([3.0]))[0] == pytest.approx([0.3] * 3)
    assert MediaTable([slab(0, 0, 0.3)]).emitted(ORIGIN * 0, AHEAD)[0] == pytest.approx([0.3] * 3)


def test_a_glow_behind_a_veil_and_one_within_it():
    veil, glow = slab(0, 1.0, at=-1, half=0.5), slab(0, 0, 2.0, at=1, half=0.5)
    assert MediaTable([veil, glow]).emitted(ORIGIN, AHEAD)[0, 0] == pytest.approx(2 * np.exp(-1), rel=1e-5)
    together = MediaTable([slab(0, 1.0), slab(0, 0, 2.0)])
    assert together.emitted(ORIGIN, AHEAD)[0, 0] == pytest.approx(2 * (1 - np.exp(-2)), rel=1e-5)
    assert together.transmittance(ORIGIN, AHEAD)[0, 0] == pytest.approx(np.exp(-2), rel=1e-5)


def test_an_endless_fog_hides_what_is_behind_it():
    fog = MediaTable([Medium("world", np.array([0.1, 0.1, 0]), np.array([0.1, 0, 0]), np.array([0.4, 0, 0]))])
    assert fog.transmittance(ORIGIN, AHEAD)[0].tolist() == [0, 0, 1]
    assert fog.emitted(ORIGIN, AHEAD)[0] == pytest.approx([2.0, 0, 0])


@pytest.mark.parametrize(("radius", "mean"), [(0.1, 0.876155), (1.0, 0.296997), (3.0, 0.054592)])
def test_a_sphere_lets_through_what_its_chords_do(radius, mean):
    ball = sphere(subdivisions=5)
    bounds = ClosedMesh(ball.vertices_local, ball.triangles, np.eye(4))
    table = MediaTable([Medium("ball", absorption=np.full(3, radius), bounds=bounds)])
    disk = disk_from_square(sobol_owen(1 << 13, 2, 1))
    origins = np.concatenate([disk, np.full((len(disk), 1), -2.0)], axis=1)
    through = table.transmittance(origins, np.broadcast_to([0.0, 0, 1], origins.shape))[:, 0].mean()
    assert (1 - (1 + 2 * radius) * np.exp(-2 * radius)) / (2 * radius**2) == pytest.approx(mean, abs=1e-6)
    # The mesh lies within the sphere: its rim, where light comes through, is 0.07 % wider.
    assert through == pytest.approx(mean, rel=4e-3, abs=7e-4)


def test_points_are_drawn_where_light_reaches_the_origin():
    """The mean of weights is ∫T·σ_s dt, and that of weight times any function of the distance its integral."""
    table = MediaTable([slab([0.5, 0.2, 0], [0.1, 0.4, 1]), slab(0.3, 0, at=1.5, half=0.5)])
    n = 1 << 14
    origins, directions = np.repeat(ORIGIN, n, axis=0), np.repeat(AHEAD, n, axis=0)
    point = table.passage(origins, directions).scatter(sobol_owen(n, 2, 5))
    t = np.linspace(0, 6, 60001)[:-1] + 5e-5
    on = ((t > 2) & (t < 4))[:, None], ((t > 4) & (t < 5))[:, None]
    scattering = on[0] * [0.5, 0.2, 0] + on[1] * 0.3
    depth = np.cumsum(scattering + on[0] * [0.1, 0.4, 1], axis=0) * 1e-4
    for function in (np.ones_like, np.sqrt, lambda x: (x > 4) * 1.0):
        expected = np.sum(np.exp(-depth) * scattering * function(t)[:, None], axis=0) * 1e-4
        assert np.mean(point.weight * function(point.distance)[:, None], axis=0) == pytest.approx(expected, rel=4e-3, abs=1e-5)


def test_points_in_endless_fog_and_where_there_is_none():
    fog = MediaTable([Medium("world", np.full(3, 0.5), np.full(3, 0.5))])
    point = fog.passage(np.repeat(ORIGIN, 4096, axis=0), np.repeat(AHEAD, 4096, axis=0)).scatter(sobol_owen(4096, 2, 1))
    assert point.weight == pytest.approx(np.full((4096, 3), 0.5)) and point.distance.mean() == pytest.approx(1.0, rel=5e-3)
    beside = MediaTable([slab(1.0, at=10)]).passage(ORIGIN, -AHEAD).scatter(np.array([[0.3, 0.4]]))
    assert np.all(beside.weight == 0) and np.isfinite(beside.distance).all()


def test_steps_through_a_grid_do_not_change_a_slab():
    """The same slab as one homogeneous box and as grids of 3 to 40 cells gives the same."""
    truth = MediaTable([slab(0.4, 0.3, 0.5)])
    for cells in (3, 11, 40):
        grid = DensityGrid(transform(scale=(1, 50, 50)), np.ones((1, 1, cells), np.float32))
        table = MediaTable([Medium("slab", np.full(3, 0.4), np.full(3, 0.3), np.full(3, 0.5), grid=grid)])
        assert table.transmittance(ORIGIN, AHEAD) == pytest.approx(truth.transmittance(ORIGIN, AHEAD), rel=1e-6)
        assert table.emitted(ORIGIN, AHEAD) == pytest.approx(truth.emitted(ORIGIN, AHEAD), rel=1e-6)
