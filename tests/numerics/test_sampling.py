import warnings

import numpy as np
import pytest

from rtgi_addon.numerics import sampling, sh


@pytest.mark.parametrize("seed", [0, 1, 12345, 2**31 + 7])
@pytest.mark.parametrize("start", [0, 256])
def test_first_two_sobol_dimensions_are_a_0_2_sequence(seed, start):
    bits = 8
    points = sampling.sobol_owen(2**bits, 2, seed, start=start)
    assert points.dtype == np.float32 and points.min() >= 0 and points.max() < 1
    for a in range(bits + 1):
        columns = (points[:, 0] * 2**a).astype(int)
        rows = (points[:, 1] * 2 ** (bits - a)).astype(int)
        counts = np.bincount(columns * 2 ** (bits - a) + rows, minlength=2**bits)
        assert np.all(counts == 1)


def test_every_sobol_dimension_is_stratified():
    points = sampling.sobol_owen(1024, sampling.SOBOL_DIMENSIONS, 3)
    for d in range(sampling.SOBOL_DIMENSIONS):
        assert np.array_equal(np.sort((points[:, d] * 1024).astype(int)), np.arange(1024))


def test_unscrambled_sobol_matches_joe_and_kuo():
    """Points as scipy.stats.qmc.Sobol(16, scramble=False) gives them (its Gray-code order undone), times 1024."""
    tables = sampling.sobol_tables()
    raw = sampling._reverse_bits(tables[:, 0, 683 & 255] ^ tables[:, 1, 683 >> 8]) / 2.0**22
    assert raw.tolist() == [853, 271, 855, 841, 123, 381, 787, 29, 437, 411, 203, 505, 569, 117, 663, 671]
    assert (sampling._reverse_bits(tables[2, 0, :9]) / 2.0**28).tolist() == [0, 8, 12, 4, 6, 14, 10, 2, 9]


def test_shuffle_permutes_within_aligned_blocks():
    plain, shuffled = (sampling.sobol_owen(64, 2, 9, shuffle=s) for s in (False, True))
    assert not np.array_equal(plain, shuffled)
    for block in (shuffled[:32], shuffled[32:]):
        assert np.array_equal(np.sort((block[:, 0] * 32).astype(int)), np.arange(32))


def test_prefix_and_vector_seeds_agree():
    long = sampling.sobol_owen(100, 5, 7)
    assert np.array_equal(long[40:], sampling.sobol_owen(60, 5, 7, start=40))
    many = sampling.sobol_owen_at(np.arange(100)[None, :], 5, np.array([3, 7])[:, None])
    assert many.shape == (2, 100, 5) and np.array_equal(many[1], long)
    assert not np.array_equal(many[0], many[1])


def test_sobol_is_the_same_on_every_platform():
    assert sampling.sobol_owen(2, 3, 42).view(np.uint32).tolist() == FROZEN_SOBOL


def test_too_many_dimensions_is_refused():
    with pytest.raises(ValueError, match="dimensions"):
        sampling.sobol_owen(4, sampling.SOBOL_DIMENSIONS + 1, 0)


def _slope(points_of):
    """Log-log slope of the RMS error over 64 seeds against n for a smooth function on the square (exact mean 4/π²·…)."""
    exact = (2 / np.pi) ** 2
    sizes, errors = [64, 4096], []
    for n in sizes:
        estimates = [np.mean(np.prod(np.sin(np.pi * points_of(n, seed).astype(float)), axis=1)) for seed in range(64)]
        errors.append(np.sqrt(np.mean((np.array(estimates) - exact) ** 2)))
    return np.log(errors[1] / errors[0]) / np.log(sizes[1] / sizes[0])


def test_error_slopes_beat_random_sampling():
    assert _slope(lambda n, seed: sampling.sobol_owen(n, 2, seed)) < -1.2
    assert _slope(sampling.r2) < -0.8
    assert -0.65 < _slope(lambda n, seed: np.random.default_rng(seed).random((n, 2))) < -0.35


def test_r2_continues_and_stays_even():
    points = sampling.r2(4096, 5)
    assert np.array_equal(points[1000:], sampling.r2(3096, 5, start=1000))
    counts = np.histogram2d(points[:, 0], points[:, 1], bins=16, range=[[0, 1], [0, 1]])[0]
    assert counts.min() >= 13 and counts.max() <= 19


def test_owen_seeds_are_unbiased():
    first = np.array([sampling.sobol_owen(1, 2, seed)[0] for seed in range(2000)])
    assert np.allclose(first.mean(0), 0.5, atol=0.03) and abs(np.corrcoef(first.T)[0, 1]) < 0.08


@pytest.mark.parametrize("n", [64, 1000, 4096])
def test_fibonacci_sphere_integrates_sh(n):
    directions = sampling.fibonacci_sphere(n)
    basis = sh.evaluate(directions.astype(np.float64), 4)
    gram = basis.T @ basis * (4 * np.pi / n)
    assert np.abs(gram - np.eye(25)).max() < 12.0 / n
    assert np.allclose(np.linalg.norm(directions, axis=1), 1, atol=1e-6)


def test_sphere_from_square_is_equal_area():
    directions = sampling.sphere_from_square(sampling.sobol_owen(1 << 14, 2, 1))
    assert directions.dtype == np.float32 and np.allclose(np.linalg.norm(directions, axis=1), 1, atol=1e-6)
    octants = np.bincount((directions > 0) @ [1, 2, 4], minlength=8)
    assert np.all(octants == (1 << 14) // 8)


def test_cosine_hemisphere_density():
    directions = sampling.cosine_hemisphere(sampling.sobol_owen(1 << 14, 2, 2)).astype(np.float64)
    assert np.allclose(np.linalg.norm(directions, axis=1), 1, atol=1e-6) and directions[:, 2].min() >= 0
    assert np.allclose(directions.mean(0), [0, 0, 2 / 3], atol=1e-3)
    assert np.allclose((directions**2).mean(0), [1 / 4, 1 / 4, 1 / 2], atol=1e-3)


def test_disk_map_reaches_centre_and_rim():
    disk = sampling.disk_from_square(np.array([[0.5, 0.5], [0.0, 0.5], [0.0, 0.0], [0.5, 0.0]]))
    assert np.allclose(disk, [[0, 0], [-1, 0], [-np.sqrt(0.5), -np.sqrt(0.5)], [0, -1]])
    radius = np.linalg.norm(sampling.disk_from_square(sampling.sobol_owen(4096, 2, 0)), axis=1)
    assert radius.max() <= 1 and np.mean(radius < 0.5) == pytest.approx(0.25, abs=2e-3)


def test_frames_are_right_handed_even_at_the_poles():
    normals = np.concatenate([sampling.fibonacci_sphere(500), np.float32([[0, 0, 1], [0, 0, -1], [0, 0, -0.0 - 1]])])
    tangents, bitangents = sampling.frame(normals)
    basis = np.stack([tangents, bitangents, normals], axis=-1).astype(np.float64)
    assert tangents.dtype == np.float32
    assert np.allclose(np.swapaxes(basis, 1, 2) @ basis, np.eye(3), atol=1e-6)
    assert np.allclose(np.linalg.det(basis), 1, atol=1e-6)


def test_random_rotations_are_uniform():
    rotations = sampling.random_rotations(20000, np.random.default_rng(4))
    assert np.allclose(rotations @ np.swapaxes(rotations, 1, 2), np.eye(3), atol=1e-12)
    assert np.allclose(np.linalg.det(rotations), 1)
    assert np.abs(rotations.mean(0)).max() < 0.02
    # Over SO(3) the trace has mean square 1 and the rotated axes second moments 1/3.
    assert np.mean(np.trace(rotations, axis1=1, axis2=2) ** 2) == pytest.approx(1, abs=0.03)
    assert np.allclose((rotations**2).mean(0), 1 / 3, atol=0.02)


def test_hash_mixes_broadcasts_and_never_warns():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        grid = sampling.hash_u32(np.arange(300)[:, None], np.arange(300)[None, :])
        scalar = sampling.hash_u32(2**70 + 5, -1)
        assert sampling.sobol_owen(1, 1, -3).shape == (1, 1)
    assert grid.dtype == np.uint32 and grid.shape == (300, 300)
    assert len(np.unique(grid)) > 90000 - 5
    assert scalar == sampling.hash_u32(5, 0xFFFFFFFF) and sampling.hash_u32(1, 2) != sampling.hash_u32(2, 1)
    share_of_ones = np.mean((grid[..., None] >> np.arange(32, dtype=np.uint32)) & 1, axis=(0, 1))
    assert np.allclose(share_of_ones, 0.5, atol=0.01)
    with pytest.raises(TypeError):
        sampling.hash_u32(1.5)


FROZEN_SOBOL = [[1061183409, 1062276346, 1063506243], [1039978928, 1036707048, 1037379808]]
