"""Many lamps: weighed together as one by one, in memory that does not grow with their number, and each of them numbered."""

import tracemalloc

import numpy as np
import pytest
from room_scenes import many_lamps

from rtgi_addon.transport.cache import texel_light
from rtgi_addon.transport.context import LightContext
from rtgi_addon.transport.paths import direct
from rtgi_addon.transport.paths.sources import Sources
from rtgi_addon.transport.vectors import luminance


def receivers(n):
    """Points (n, 3) and unit normals (n, 3)."""
    rng = np.random.default_rng(4)
    normals = rng.normal(size=(n, 3)).astype(np.float32)
    return rng.uniform(-1, 1, (n, 3)).astype(np.float32), normals / np.linalg.norm(normals, axis=1, keepdims=True)


@pytest.mark.parametrize("n", [0, 1, 7, 500, 9000])
def test_lamps_weighed_together_are_those_weighed_one_by_one(n):
    lamps = LightContext(many_lamps(100)).lamps
    points, normals = receivers(n)
    together = lamps.luminance_unshadowed(points, normals)
    assert together.shape == (100, n)
    for lamp in range(100):
        assert np.array_equal(together[lamp], luminance(lamps.irradiance_unshadowed(lamp, points, normals)))


def test_blocks_choose_the_lamps_that_all_points_at_once_choose(monkeypatch):
    context = LightContext(many_lamps(50))
    points, normals = receivers(300)
    u, facing = np.random.default_rng(1).random((300, 3)).astype(np.float32), direct.Receiver(normals, normals)
    light = texel_light.TexelLight(Sources(context), context.surfaces, type("Numbers", (), {"seed": 3}), 8, 0.1)
    whole = light._choose(np.arange(300), points, normals), direct.lamp_irradiance(context, points, facing, u)
    monkeypatch.setattr(texel_light, "PAIRS", 700)
    monkeypatch.setattr(direct, "PAIRS", 700)
    blocks = light._choose(np.arange(300), points, normals), direct.lamp_irradiance(context, points, facing, u)
    assert all(np.array_equal(one, other) for one, other in zip(whole[0], blocks[0], strict=True))
    assert np.array_equal(whole[1], blocks[1])


def test_more_lamps_than_16_bits_number_are_all_chosen():
    count = 40_000
    alike = {"count": count, "limited": lambda _: {},
             "importances": lambda _, points, normals: np.ones((count, len(points)), np.float32)}
    sources = type("Sources", (), alike)
    light = texel_light.TexelLight(sources(), None, type("Numbers", (), {"seed": 3}), 8, 0.1)
    choices, weights = light._choose(np.arange(20), *receivers(20))
    assert choices.min() >= 0 and choices.max() > 39_000 and np.allclose(weights, count)


def test_memory_does_not_grow_with_the_lamps():
    """2,000 lamps took 2.2 GiB, 66 bytes for each of them at each of 32,768 points of the bright surfaces."""
    context = LightContext(many_lamps(400))
    light = texel_light.TexelLight(Sources(context), context.surfaces, type("Numbers", (), {"seed": 3}), 8, 0.1)
    points, normals = receivers(8000)
    tracemalloc.start()
    light._choose(np.arange(8000), points, normals)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 60 * 2**20
