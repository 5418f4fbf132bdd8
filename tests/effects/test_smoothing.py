"""Light that neighbouring pixels share: an even change of it stays, to the edge of what they show, and noise goes."""

from types import SimpleNamespace

import numpy as np
import pytest

from rtgi_addon.effects.ray_traced.smoothing import smoothed

SHAPE, CORNER = (30, 40), 17


def corner():
    """A frame of a floor and a wall that meet in a column of pixels, a metre a pixel."""
    rows, columns = np.indices(SHAPE).astype(np.float32)
    wall = columns >= CORNER
    position = np.stack([np.minimum(columns, CORNER), rows, np.maximum(columns - CORNER, 0), 0 * rows], axis=-1)
    normal = np.where(wall[..., None], np.float32([-1, 0, 0, 0]), np.float32([0, 0, 1, 0]))
    gbuffer = SimpleNamespace(seen=np.ones(SHAPE, bool), position=position, normal=normal)
    return SimpleNamespace(gbuffer=gbuffer, footprint=np.ones(SHAPE, np.float32), irradiance=np.zeros((*SHAPE, 4), np.float32),
                           samples=None, index=0, bare=False)


def shared(light, known=None, spacing=1, nearness=0.01):
    """``light`` (h, w) after sharing, where what lights the pixels is 1/``nearness`` metres away."""
    gathered = np.concatenate([np.repeat(light[..., None], 3, axis=-1), np.full((*SHAPE, 1), nearness)], axis=-1).astype(np.float32)
    known = np.ones(SHAPE, bool) if known is None else known
    return smoothed(corner(), gathered, known, spacing).reshape(*SHAPE, 3)[..., 0]


def test_light_that_changes_evenly_stays_at_corners_and_borders():
    rows, columns = np.indices(SHAPE)
    light = np.where(columns >= CORNER, 50.0 + 2.0 * (columns - CORNER) - rows, 5.0 + (CORNER - columns) + rows)
    assert np.abs(shared(light) - light).max() < 0.1


def test_noise_goes_where_light_comes_from_afar_and_stays_where_it_is_near():
    noise = np.random.default_rng(3).normal(10.0, 1.0, SHAPE)
    inner = slice(8, -8), slice(0, CORNER - 8)
    assert shared(noise)[inner].std() < 0.15
    assert shared(noise, nearness=10.0)[inner].std() == pytest.approx(noise[inner].std(), rel=1e-3)


def test_pixels_without_rays_are_filled_from_their_own_surface():
    rows, columns = np.indices(SHAPE)
    light = np.where(columns >= CORNER, 3.0, 7.0)
    known = (rows % 3 == 1) & (columns % 3 == 1)
    np.testing.assert_allclose(shared(np.where(known, light, 0.0), known, 3), light, rtol=1e-5)
