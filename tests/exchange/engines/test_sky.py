"""The panorama behind a sample scene: every direction where its engine looks for it."""

import numpy as np
import pytest

from rtgi_addon.exchange.engines.axes import Y_UP
from rtgi_addon.exchange.engines.sky import SKY, write_sky
from rtgi_addon.exchange.exr import read_exr
from rtgi_addon.scene import World
from rtgi_addon.transport.lights.environment import Environment


def lobed():
    """A world that differs by direction, turned about an axis."""
    rows, columns = np.indices((32, 64))
    pixels = np.stack([1 + np.sin(columns / 64 * 2 * np.pi), 1 + rows / 32, np.full(rows.shape, 0.5)], axis=-1)
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    return World(pixels.astype(np.float32), turn)


def godot(direction):
    """As Godot's sky.glsl: atan(x, -z), acos(y), over a turn and a half."""
    return np.arctan2(direction[0], -direction[2]) / (2 * np.pi) % 1.0, np.arccos(direction[1]) / np.pi


def three(direction):
    """As three.js' common.glsl, equirectUv, whose v is 0 at the bottom."""
    return np.arctan2(direction[2], direction[0]) / (2 * np.pi) + 0.5, 0.5 - np.arcsin(direction[1]) / np.pi


@pytest.mark.parametrize(("look_up", "first"), [(godot, 0.0), (three, -0.25)])
def test_engines_find_what_blender_shows(tmp_path, look_up, first):
    world = lobed()
    scale = write_sky(tmp_path, world, Y_UP, first)
    planes, _ = read_exr(tmp_path / SKY)
    pixels = np.stack([planes[name] for name in "RGB"], axis=-1).astype(np.float64)
    blender = np.random.default_rng(3).normal(size=(50, 3))
    blender /= np.linalg.norm(blender, axis=1, keepdims=True)
    expected = Environment(world).radiance(blender.astype(np.float32))
    for direction, radiance in zip(Y_UP.directions(blender), expected, strict=True):
        u, v = look_up(direction)
        found = pixels[min(int(v * pixels.shape[0]), pixels.shape[0] - 1), int(u * pixels.shape[1]) % pixels.shape[1]]
        np.testing.assert_allclose(found * scale, radiance, atol=0.12)


def test_a_black_world_is_no_sky_and_a_plain_one_is_small(tmp_path):
    assert not write_sky(tmp_path, None, Y_UP, 0.0) and not write_sky(tmp_path, World.constant(0.0), Y_UP, 0.0)
    assert not list(tmp_path.iterdir())
    assert write_sky(tmp_path, World.constant((1.0, 2.0, 3.0)), Y_UP, 0.0)
    planes, _ = read_exr(tmp_path / SKY)
    scale = write_sky(tmp_path, World.constant((1.0, 2.0, 3.0)), Y_UP, 0.0)
    assert planes["G"].shape == (4, 8) and np.all(planes["G"] * scale == 2.0)


@pytest.mark.parametrize("brightest", [1e6, 1.0, 1e-4, 1e-8])
def test_what_godot_would_read_as_black_is_stored_over_a_scale(tmp_path, brightest):
    """Of a night's sky halves would be below 2^-14, which Godot reads as 0."""
    rows = np.geomspace(1e-6 * brightest, brightest, 32).astype(np.float32)
    world = World(np.tile(rows[:, None, None], (1, 64, 3)))
    scale = write_sky(tmp_path, world, Y_UP, 0.0)
    planes, _ = read_exr(tmp_path / SKY)
    found = np.where(np.abs(planes["G"]) < 2.0**-14, 0.0, planes["G"].astype(np.float64)) * scale
    # Samples lie in the middle of the map's rows.
    right = np.minimum(rows[::-1], 65504.0)
    assert np.log2(scale) == round(np.log2(scale)) and scale <= 1.0
    counts = right > 2e-9 * brightest
    np.testing.assert_allclose(found[counts, 0], right[counts], rtol=1e-3)
