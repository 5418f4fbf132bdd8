"""Light that the first samples of a picture gathered, for those that refine it."""

from types import SimpleNamespace

import numpy as np
import pytest

from rtgi_addon.effects import kept_light
from rtgi_addon.effects.frame import GATHERED
from rtgi_addon.effects.kept_light import KeptLight

SHAPE = 24, 40


def shown(light, height=0.0, normal=(0.0, 0.0, 1.0), albedo=0.5):
    """A sample of a level plane ``height`` above the ground, a metre a pixel, that gathered ``light`` (h, w) or a number."""
    rows, columns = np.indices(SHAPE)
    position = np.stack([columns, rows, np.full(SHAPE, height), np.zeros(SHAPE)], axis=-1).astype(np.float32)
    tiled = [np.broadcast_to(np.float32([*part, 0.0]), (*SHAPE, 4)) for part in (normal, [albedo] * 3)]
    gathered = np.broadcast_to(np.asarray(light, np.float32)[..., None], (*SHAPE, 4))
    gbuffer = SimpleNamespace(position=position, normal=tiled[0], albedo=tiled[1])
    return SimpleNamespace(kept={GATHERED: gathered}, gbuffer=gbuffer, pixel=np.arange(position[..., 0].size).reshape(SHAPE),
                           footprint=np.ones(SHAPE, np.float32))


def asked(light, height=0.0, normal=(0.0, 0.0, 1.0)):
    """What ``light`` knows of all pixels on such a plane."""
    frame = shown(0.0, height, normal)
    points, normals = (part[..., :3].reshape(-1, 3) for part in (frame.gbuffer.position, frame.gbuffer.normal))
    return light.at(frame.pixel.reshape(-1), points, normals, frame.footprint.reshape(-1))


def test_light_is_that_of_samples_of_the_same_surface():
    light = KeptLight()
    for value, height in ((1.0, 0.0), (7.0, 5.0), (3.0, 0.0), (7.0, 5.0)):
        light.add(shown(value, height))
    light.settle(shown(0.0), 1.0)
    near, found = asked(light)
    assert found.all() and near == pytest.approx(2.0)
    above, found = asked(light, 5.0)
    assert found.all() and above == pytest.approx(7.0)
    # Nobody saw what lies between, or what faces elsewhere.
    assert not asked(light, 2.5)[1].any() and not asked(light, 0.0, (1.0, 0.0, 0.0))[1].any()


def test_what_light_is_off_by_is_that_of_the_mean():
    light, rng = KeptLight(), np.random.default_rng(0)
    for _ in range(6):
        light.add(shown(2.0 + 0.4 * rng.standard_normal(SHAPE)))
    held, enough = light.settle(shown(0.0), 1.0)
    off = 0.5 * (asked(light)[0][:, 0] - 2.0) / np.pi
    assert enough and held.mean() == pytest.approx(np.square(off).mean(), rel=0.15)
    # Too noisy for all together, and for every single one.
    assert not light.settle(shown(0.0), 2.0 * held.mean())[1] and asked(light)[1].all()
    noisy, _ = light.settle(shown(0.0), 1e-3 * held.mean())
    assert not asked(light)[1].any() and not noisy.any()


def test_samples_of_more_rays_count_more():
    light, rng, weights = KeptLight(), np.random.default_rng(1), (0.5, 0.5, 0.5, 0.5, 2.0, 2.0)
    for weight in weights:
        light.add(shown(2.0 + 0.4 / np.sqrt(weight) * rng.standard_normal(SHAPE)), weight)
    held, _ = light.settle(shown(0.0), 1.0)
    off = np.square(asked(light)[0][:, 0] - 2.0)
    # Noise of weight 1 is 0.4, and all together weigh 6.
    assert off.mean() == pytest.approx(0.4**2 / sum(weights), rel=0.15)
    assert held.mean() == pytest.approx((0.5 / np.pi) ** 2 * off.mean(), rel=0.15)
    # A single one knows the place, however little it weighs.
    faint = KeptLight()
    faint.add(shown(3.0), 0.1)
    faint.settle(shown(0.0), 1e9)
    assert asked(faint)[0] == pytest.approx(3.0)


def test_memory_is_bounded(monkeypatch):
    light = KeptLight()
    light.add(shown(1.0))
    assert light.fits(12) and KeptLight().fits(12)
    monkeypatch.setattr(kept_light, "_MOST_BYTES", 400 * SHAPE[0] * SHAPE[1])
    assert light.fits(11) and not light.fits(12)


def test_effects_that_gather_nothing_leave_nothing():
    light = KeptLight()
    frame = shown(1.0)
    frame.kept.clear()
    light.add(frame)
    held, enough = light.settle(frame, 1.0)
    assert enough and not held.any() and not asked(light)[1].any()
