import numpy as np
import pytest

from rtgi_addon.numerics import octahedral, sampling


def test_round_trip():
    directions = np.concatenate([sampling.fibonacci_sphere(3000), np.float32([[0, 0, 1], [0, 0, -1], [1, 0, 0], [0, -1, 0]])])
    square = octahedral.encode(directions)
    assert square.dtype == np.float32 and np.abs(square).max() <= 1 + 1e-6
    assert np.allclose(octahedral.decode(square), directions, atol=1e-6)
    assert np.allclose(octahedral.encode(directions * 7.5), square, atol=1e-6)


def test_hemispheres_and_axes():
    axes = np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0], [0, -1, 0]])
    assert np.allclose(octahedral.encode(axes), [[0, 0], [1, 0], [0, 1], [0, -1]])
    below = octahedral.encode(np.array([[0.1, 0.2, -0.9]]))
    assert np.abs(below).sum() > 1 and np.all(below > 0)
    assert np.allclose(octahedral.decode(np.array([[1.0, 1], [-1, 1], [1, -1], [-1, -1]])), [0, 0, -1])


def test_border_points_meet_their_mirror():
    t = np.linspace(-1, 1, 41)
    right = octahedral.decode(np.stack([np.ones_like(t), t], axis=1))
    assert np.allclose(right, octahedral.decode(np.stack([np.ones_like(t), -t], axis=1)), atol=1e-12)


@pytest.mark.parametrize("resolution", [1, 2, 3, 8, 9, 16])
def test_texels(resolution):
    solid_angles = octahedral.texel_solid_angles(resolution)
    assert solid_angles.shape == (resolution**2,)
    assert solid_angles.sum() == pytest.approx(4 * np.pi, rel=1e-12) and solid_angles.min() > 0
    centres = octahedral.texel_directions(resolution)
    assert np.array_equal(octahedral.texel_index(centres, resolution), np.arange(resolution**2))


@pytest.mark.parametrize("resolution", [5, 8])
def test_solid_angles_match_the_share_of_directions(resolution):
    directions = sampling.fibonacci_sphere(400_000)
    counts = np.bincount(octahedral.texel_index(directions, resolution), minlength=resolution**2)
    assert np.allclose(counts / 400_000 * 4 * np.pi, octahedral.texel_solid_angles(resolution), rtol=6e-3)


def test_texel_order_is_row_times_resolution_plus_column():
    assert octahedral.texel_index(np.array([[0.9, -0.3, 0.4]]), 8)[0] == 3 * 8 + 6


def _interpolated(values, directions, resolution):
    bordered = octahedral.add_border(values.reshape(resolution, resolution, 1)).ravel()
    index, fraction = octahedral.bilinear(directions, resolution)
    assert index.min() >= 0 and index.max() + resolution + 3 < bordered.size
    assert fraction.min() >= 0 and fraction.max() <= 1
    x, y = fraction[:, 0], fraction[:, 1]
    lower = bordered[index] * (1 - x) + bordered[index + 1] * x
    upper = bordered[index + resolution + 2] * (1 - x) + bordered[index + resolution + 3] * x
    return lower * (1 - y) + upper * y


@pytest.mark.parametrize("resolution", [2, 7, 8])
def test_bilinear_is_continuous_over_seams_and_exact_at_centres(resolution):
    values = np.random.default_rng(0).random(resolution**2)
    centres = octahedral.texel_directions(resolution).astype(np.float64)
    assert np.allclose(_interpolated(values, centres, resolution), values, atol=1e-5)
    angle = np.linspace(0, 2 * np.pi, 20001)
    around = np.stack([np.cos(angle), np.zeros_like(angle) + 0.3, np.sin(angle)], axis=1)
    below = np.stack([np.cos(angle) * 0.4, np.sin(angle) * 0.4, -np.ones_like(angle)], axis=1)
    for path in (around, below):
        assert np.abs(np.diff(_interpolated(values, path, resolution))).max() < 0.005 * resolution


def test_border_repeats_the_texel_across_the_seam():
    bordered = octahedral.add_border(np.arange(16.0).reshape(4, 4, 1))[..., 0]
    assert bordered.tolist() == [
        [15, 3, 2, 1, 0, 12],
        [12, 0, 1, 2, 3, 15],
        [8, 4, 5, 6, 7, 11],
        [4, 8, 9, 10, 11, 7],
        [0, 12, 13, 14, 15, 3],
        [3, 15, 14, 13, 12, 0],
    ]
