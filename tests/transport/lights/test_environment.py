"""The world's radiance: layout, the split into bright and smooth, and the sampling of what is bright."""

import numpy as np
import pytest

from rtgi_addon.numerics.sampling import fibonacci_sphere
from rtgi_addon.scene import World
from rtgi_addon.transport.lights.environment import Environment


def sunny_sky(height=32, seed=4):
    """A noisy sky with a small sun, a bright texel at each edge of the map, and its own rotation."""
    rng = np.random.default_rng(seed)
    pixels = (0.4 + 0.3 * rng.random((height, 2 * height, 3))).astype(np.float32)
    pixels[20:22, 11:13] = [900, 800, 700]
    pixels[9, 0], pixels[12, -1] = [0, 500, 0], [300, 0, 0]
    pixels[0, 5], pixels[-1, 30] = [400, 300, 900], [800, 800, 10]
    rotation, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    return World(pixels, rotation * np.sign(np.linalg.det(rotation)))


def dense_directions(world, oversampling=12):
    """Directions (world space) and solid angles of a fine grid over the map."""
    height, width = (size * oversampling for size in world.equirect.shape[:2])
    azimuth, latitude = np.meshgrid((0.5 - (np.arange(width) + 0.5) / width) * 2 * np.pi,
                                    ((np.arange(height) + 0.5) / height - 0.5) * np.pi)
    local = np.stack([np.cos(latitude) * np.cos(azimuth), np.cos(latitude) * np.sin(azimuth), np.sin(latitude)], axis=-1)
    weight = (np.cos(latitude) * 2 * np.pi**2 / (width * height)).ravel()
    return (local.reshape(-1, 3) @ world.map_from_world).astype(np.float32), weight


def test_layout_is_blenders():
    """u falls with azimuth from ½ at +X: +Y is at ¼, −Y at ¾, −X at the seam; rows rise to +Z."""
    pixels = np.zeros((9, 8, 3), np.float32)
    pixels[4, :, 0] = np.arange(8)
    pixels[-1, :, 1] = 1.0
    pixels[0, :, 2] = 1.0
    look = Environment(World(pixels)).radiance(np.array([[1, 0, 0], [0, 1, 0], [0, -3, 0], [0, 0, 1], [0, 0, -1]], np.float32))
    np.testing.assert_allclose(look[:3, 0], [3.5, 1.5, 5.5], atol=1e-4)
    np.testing.assert_allclose(look[3:, 1:], [[1, 0], [0, 1]], atol=1e-5)


def test_rotation_maps_world_to_map():
    pixels = sunny_sky().equirect
    turn = np.array([[0.0, 1, 0], [-1, 0, 0], [0, 0, 1]])
    directions = fibonacci_sphere(500)
    np.testing.assert_allclose(Environment(World(pixels, turn)).radiance(directions),
                               Environment(World(pixels)).radiance(directions @ turn.T.astype(np.float32)), rtol=1e-3, atol=1e-2)


def test_lookup_is_exact_at_texel_centres_and_wraps():
    world = World(sunny_sky().equirect)
    directions, _ = dense_directions(world, 1)
    np.testing.assert_allclose(Environment(world).radiance(directions), world.equirect.reshape(-1, 3), rtol=2e-3, atol=0.02)


def test_base_and_bright_add_up_everywhere():
    world = sunny_sky()
    environment = Environment(world)
    directions = fibonacci_sphere(200_000)
    total = environment.base_radiance(directions) + environment.bright.radiance(directions)
    np.testing.assert_allclose(total, environment.radiance(directions), rtol=1e-5, atol=1e-5)


def test_what_remains_is_smooth_and_the_sun_is_in_the_bright_part():
    environment = Environment(sunny_sky())
    assert environment.bright.count < 20
    assert environment.base_radiance(fibonacci_sphere(20_000)).max() < 20.0
    assert environment.bright.irradiance_estimate[0] > 20.0


@pytest.mark.parametrize("world", [
    World.constant(2.0), World.constant(0.0), World(np.repeat(np.eye(2)[1], 16 * 32).reshape(32, 32, 1) * np.ones(3, np.float32)),
    World((0.5 + 0.5 * np.random.default_rng(0).random((16, 32, 3))).astype(np.float32)),
], ids=["constant", "black", "half sky", "noise"])
def test_nothing_concentrated_means_no_bright_part(world):
    environment = Environment(world)
    assert environment.bright.count == 0
    directions = fibonacci_sphere(100)
    assert environment.base_radiance(directions).tobytes() == environment.radiance(directions).tobytes()
    assert not environment.bright.radiance(directions).any()


def test_constant_worlds_are_constant():
    environment = Environment(World.constant([1.0, 2.0, 3.0]))
    assert environment.is_constant and not environment.is_black
    assert np.array_equal(environment.radiance(fibonacci_sphere(10)), np.tile(np.float32([1, 2, 3]), (10, 1)))
    assert Environment(World.constant(0)).is_black


def test_a_lone_patch_in_the_dark_goes_wholly_into_the_bright_part():
    pixels = np.zeros((32, 64, 3), np.float32)
    pixels[20:24, 30:36] = 1.0
    environment = Environment(World(pixels))
    assert environment.bright.count == 24
    assert environment.base_radiance(fibonacci_sphere(5000)).max() < 1e-3


@pytest.mark.parametrize("weighting", ["all", "+x", "+z", "-z"])
def test_sampled_bright_part_has_the_right_integral(weighting):
    """The mean of radiance over density times a cosine against a fine quadrature of the lookup, within six standard errors."""
    world = sunny_sky()
    bright = Environment(world).bright
    axis = {"all": None, "+x": [1, 0, 0], "+z": [0, 0, 1], "-z": [0, 0, -1]}[weighting]

    def lobe(d):
        return np.ones(len(d)) if axis is None else np.maximum(d @ np.asarray(axis, np.float32), 0)

    directions, weights = dense_directions(world)
    expected = (bright.radiance(directions) * (weights * lobe(directions))[:, None]).sum(axis=0)
    sampled, value = bright.sample(np.random.default_rng(1).random((1 << 17, 2)).astype(np.float32))
    np.testing.assert_allclose(np.linalg.norm(sampled, axis=1), 1.0, atol=1e-5)
    values = value * lobe(sampled)[:, None]
    error = values.std(axis=0) / np.sqrt(len(values))
    assert np.all(np.abs(values.mean(axis=0) - expected) < 6 * error + 2e-3 * expected)
    if weighting == "all":
        np.testing.assert_allclose(bright.irradiance_estimate, expected, rtol=5e-3)


def test_bright_poles_and_seam_are_sampled_in_full():
    """Texels whose footprint is cut by a pole or wraps around the seam, where they are all the light there is."""
    pixels = np.full((8, 16, 3), 1e-3, np.float32)
    pixels[0, 3], pixels[-1, 9], pixels[4, 0], pixels[4, -1] = 100.0, 50.0, 20.0, 10.0
    world = World(pixels)
    bright = Environment(world).bright
    directions, weights = dense_directions(world, 32)
    sampled, value = bright.sample(np.random.default_rng(7).random((1 << 18, 2)).astype(np.float32))
    for axis in ([0, 0, 1], [0, 0, -1], [-1, 0, 0]):
        lobe = np.float32(axis)
        expected = (bright.radiance(directions)[:, 0] * weights) @ np.maximum(directions @ lobe, 0)
        values = value[:, 0] * np.maximum(sampled @ lobe, 0)
        assert values.mean() == pytest.approx(expected, abs=6 * values.std() / np.sqrt(len(values)) + 1e-3 * expected)


def test_sampling_is_nearly_free_of_noise_for_one_sun():
    pixels = np.full((64, 128, 3), 0.2, np.float32)
    pixels[50, 20] = 5000.0
    directions, value = Environment(World(pixels)).bright.sample(np.random.default_rng(0).random((4096, 2)).astype(np.float32))
    assert value.std() < 0.04 * value.mean()
    assert np.min(directions @ directions.mean(axis=0)) > 0.99


def test_lookup_rows_do_not_depend_on_their_neighbours():
    environment = Environment(sunny_sky())
    directions = fibonacci_sphere(1001)
    whole = environment.radiance(directions)
    assert whole[3:10].tobytes() == environment.radiance(directions[3:10]).tobytes()
