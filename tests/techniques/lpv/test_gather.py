"""The gather's convention: flux through faces, point sources, uniform radiance, surfaces, self-lighting."""

from functools import cache

import numpy as np
import pytest

from rtgi_addon.numerics import sh
from rtgi_addon.numerics.sampling import fibonacci_sphere
from rtgi_addon.techniques.lpv import grid as lattice
from rtgi_addon.techniques.lpv.gather import FACE_AHEAD, FACE_TOTAL, gather, radiance_sh
from rtgi_addon.techniques.lpv.geometry_volume import CLOSED, ROWS, GeometryVolume, face_blocking, plane_shape, vacuum
from rtgi_addon.techniques.lpv.grid import LpvGrid
from rtgi_addon.techniques.lpv.injection import inject
from rtgi_addon.techniques.lpv.propagation import propagate


@cache
def point_source(steps, count=21, cell=0.25):
    """A grid and the accumulated volume of 1 W sent out evenly from its middle cell."""
    grid = LpvGrid((0.0, 0.0, 0.0), cell, (count,) * 3)
    volume = grid.empty()
    volume[0, :, count // 2, count // 2, count // 2] = lattice.PER_FLUX
    return grid, propagate(volume, vacuum(grid), steps)


def outflow(volume, low, high):
    """Net flux (W) through the border of the block of cells low … high − 1, by the gather's convention."""
    p, q = np.sqrt(0.25 / np.pi) * volume[0, 0], np.sqrt(0.75 / np.pi) * volume[:, 0]
    total = 0.0
    block = slice(low, high)
    for axis, row in enumerate((3, 1, 2)):
        def at(index, axis=axis):
            part = [block] * 3
            part[2 - axis] = index
            return tuple(part)

        for inside, outside, sign in ((high - 1, high, 1.0), (low, low - 1, -1.0)):
            total += np.sum(FACE_TOTAL * p[at(inside)] + sign * FACE_AHEAD * q[row][at(inside)], dtype=np.float64)
            total -= np.sum(FACE_TOTAL * p[at(outside)] - sign * FACE_AHEAD * q[row][at(outside)], dtype=np.float64)
    return total


def test_what_leaves_a_block_about_a_source_is_its_flux():
    _, volume = point_source(1000)
    for half in (0, 1, 3, 5):
        assert outflow(volume, 10 - half, 11 + half) == pytest.approx(1.0, abs=1e-5)
    assert outflow(volume, 3, 6) == pytest.approx(0.0, abs=1e-5)


@pytest.mark.parametrize("distance", [3.0, 4.0, 5.0])
def test_a_point_source_gives_inverse_square_irradiance_on_average(distance):
    grid, volume = point_source(800, count=31)
    directions = fibonacci_sphere(300)
    radius = distance * grid.cell
    # The surface that faces the source is met by the light of the cells before it, its back by that of the cells behind.
    points = grid.center + directions * radius
    towards, away = (radiant_irradiance(grid, volume, points + 0.5 * grid.cell * n, n) for n in (-directions, directions))
    exact = 1.0 / (4.0 * np.pi * radius**2)
    assert np.mean(towards - away) == pytest.approx(exact, rel=0.12)
    # Of order 1 the back of such a field is negative; what is gathered is not.
    assert np.mean(towards) > abs(np.mean(away))


def radiant_irradiance(grid, volume, points, normals):
    """Linear irradiance (n,) of the first channel from the projected radiance at free points."""
    coefficients = radiance_sh((grid,), (volume,), points, 1)[..., 0]
    return np.einsum("nk,nk->n", coefficients * sh.cosine_coefficients(1), sh.evaluate(np.asarray(normals), 1))


def test_uniform_and_directed_light_agree_between_gather_and_radiance():
    grid = LpvGrid((-1.0, -1.0, -1.0), 0.25, (8, 8, 8))
    volume = grid.empty()
    volume[0], volume[3] = 2.0, 0.7
    normals = fibonacci_sphere(100)
    points = np.random.default_rng(0).uniform(-0.4, 0.4, (100, 3))
    measured = gather((grid,), (volume,), points, normals)
    assert np.allclose(measured[:, 0], radiant_irradiance(grid, volume, points, normals), rtol=1e-4)
    # Light along +x, onto a plane that faces it: a·Y0·c0 + b·Y1·c1 over the area of a face.
    facing = gather((grid,), (volume,), np.zeros((1, 3)), np.array([[-1.0, 0, 0]]))
    assert np.allclose(facing, (FACE_TOTAL * 0.282095 * 2.0 + FACE_AHEAD * 0.488603 * 0.7) / 0.0625, rtol=1e-5)


def test_higher_orders_are_dark_and_order_0_is_the_mean():
    grid, volume = point_source(8)
    points = np.array([[2.0, 2.6, 2.6]])
    full = radiance_sh((grid,), (volume,), points, 2)
    assert full.shape == (1, 9, 3) and not full[:, 4:].any()
    assert np.allclose(radiance_sh((grid,), (volume,), points, 0), full[:, :1])


def test_cells_behind_the_receivers_plane_do_not_count():
    grid = LpvGrid((0.0, 0.0, 0.0), 1.0, (8, 8, 8))
    volume = grid.empty()
    volume[0, :, :, :, :4] = 1.0
    # A wall in the fourth cell that faces the dark half, wherever in the cell it lies.
    for x in (3.6, 3.9, 4.2):
        assert not gather((grid,), (volume,), np.array([[x, 4.0, 4.0]]), np.array([[1.0, 0, 0]])).any()
        assert gather((grid,), (volume,), np.array([[x, 4.0, 4.0]]), np.array([[-1.0, 0, 0]])).all()


def test_cascades_are_mixed_by_their_shares():
    fine, coarse = (LpvGrid((-cell * 4,) * 3, cell, (8, 8, 8)) for cell in (1.0, 2.0))
    volumes = tuple(np.full((4, 3, 8, 8, 8), 0.0, np.float32) for _ in range(2))
    volumes[0][0], volumes[1][0] = 1.0, 4.0 * 3.0
    points = np.array([[0.0, 0, 0], [3.0, 0, 0], [7.0, 0, 0], [99.0, 0, 0]])
    value = gather((fine, coarse), volumes, points, np.tile([0.0, 0, 1], (4, 1)))[:, 0]
    assert np.allclose(value / value[0], [1, 2, 3, 3], rtol=1e-5)


def test_a_lone_plate_hardly_lights_itself():
    grid = LpvGrid((0.0, 0.0, 0.0), 1.0, (20, 20, 20))
    x, y = np.meshgrid(np.arange(6.5, 13.5), np.arange(6.5, 13.5))
    positions = np.stack([x.ravel(), y.ravel(), np.full(x.size, 5.0)], axis=1)
    normals = np.tile([0.0, 0, 1], (len(positions), 1))
    planes = [np.zeros((ROWS, *plane_shape(grid, axis)), np.float32) for axis in range(3)]
    planes[2][CLOSED, 5, 6:14, 6:14] = 1.0
    blocking = face_blocking(GeometryVolume(grid, tuple(planes), np.zeros(grid.shape, np.float32)), bounces=False)
    lit = propagate(inject(grid, positions, normals, np.ones((len(positions), 3)), blocking.faces), blocking, 128)
    own, damped = (gather((grid,), (lit,), positions, normals, dampening, (blocking.faces,))[:, 0].mean()
                   for dampening in (False, True))
    # The exact answer is 0; the plate sends out 1 W per cell.
    assert damped <= own < 0.05
