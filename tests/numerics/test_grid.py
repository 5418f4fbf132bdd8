import numpy as np
import pytest

from rtgi_addon.numerics import grid, sampling


def _oblique(seed=0):
    matrix = np.eye(4)
    rotation = sampling.random_rotations(1, np.random.default_rng(seed))[0]
    matrix[:3, :3] = rotation @ np.diag([2.0, 3.0, 0.5]) @ np.array([[1, 0.2, 0], [0, 1, 0], [0, 0, -1]])
    matrix[:3, 3] = [10, -4, 2]
    return matrix


def test_samples_are_cell_centred_as_in_eevee():
    points = grid.lattice_points(np.eye(4), (4, 2, 1))
    assert points.shape == (1, 2, 4, 3) and points.dtype == np.float64
    assert np.allclose(points[0, 0, :, 0], [-0.75, -0.25, 0.25, 0.75])
    assert np.allclose(points[0, :, 0, 1], [-0.5, 0.5]) and np.allclose(points[..., 2], 0)


def test_lattice_matches_the_formula_under_any_matrix():
    matrix, resolution = _oblique(), (3, 4, 5)
    points = grid.lattice_points(matrix, resolution)
    i = np.array([2, 1, 3])
    local = (i + 0.5) / np.array(resolution) * 2 - 1
    assert np.allclose(points[3, 1, 2], matrix[:3, :3] @ local + matrix[:3, 3])


def test_coordinates_round_trip():
    matrix, resolution = _oblique(1), (3, 4, 5)
    lattice = np.random.default_rng(0).uniform(-2, 6, (50, 3))
    local = grid.local_from_lattice(lattice, resolution)
    world = grid.transform_points(matrix, local)
    assert np.allclose(grid.local_from_world(matrix, world), local)
    assert np.allclose(grid.lattice_from_world(matrix, resolution, world), lattice)
    assert np.allclose(grid.lattice_from_local(np.array([[-1.0, 1, 0]]), resolution), [[-0.5, 3.5, 2.0]])


def test_cells():
    matrix = np.diag([2.0, 3.0, 4.0, 1.0])
    assert np.allclose(grid.cell_size(matrix, (4, 6, 2)), [1, 1, 4])
    assert grid.cell_volume(matrix, (4, 6, 2)) == pytest.approx(4)
    points = grid.lattice_points(_oblique(), (3, 4, 5))
    assert np.allclose(grid.cell_axes(_oblique(), (3, 4, 5))[2], points[1, 0, 0] - points[0, 0, 0])


@pytest.mark.parametrize("resolution", [(3, 4, 5), (1, 4, 2), (1, 1, 1)])
def test_trilinear_reproduces_linear_functions_and_clamps(resolution):
    lattice = np.random.default_rng(1).uniform(-2, 7, (500, 3))
    indices, weights = grid.trilinear(lattice, resolution)
    assert weights.dtype == np.float32 and weights.min() >= 0 and np.allclose(weights.sum(1), 1)
    samples = grid.local_from_lattice(np.stack(np.meshgrid(*[np.arange(n) for n in resolution[::-1]], indexing="ij")[::-1], -1),
                                      resolution).reshape(-1, 3)
    clamped = np.clip(lattice, 0, np.array(resolution) - 1)
    assert np.allclose((samples[indices] * weights[..., None]).sum(1), grid.local_from_lattice(clamped, resolution), atol=1e-6)


def test_trilinear_at_a_sample_picks_it_alone():
    indices, weights = grid.trilinear(np.array([[1.0, 2, 0], [2, 3, 4]]), (3, 4, 5))
    chosen = [indices[row][weights[row] > 0].tolist() for row in range(2)]
    assert chosen == [[2 * 3 + 1], [4 * 12 + 3 * 3 + 2]]


def test_a_z_order_code_interleaves_the_bits_of_its_cells():
    rng = np.random.default_rng(0)
    for axes in (2, 3):
        cells = rng.integers(0, 1 << grid.CURVE_BITS, (50, axes))
        expected = [sum((int(cell[axis]) >> bit & 1) << 3 * bit + axis for bit in range(grid.CURVE_BITS) for axis in range(axes))
                    for cell in cells]
        assert grid.z_order(cells).tolist() == expected
