"""Volumes of one bake that capture different light: right values by linearity, and relighting that keeps to them."""

from dataclasses import replace

import numpy as np
import pytest
import room_scenes as rooms
import scene_builders as build
from probe_bakes import QUICK, bake, coefficients

from rtgi_addon import techniques
from rtgi_addon.errors import BakeError, UsageError
from rtgi_addon.evaluate.leaks import find_leaks
from rtgi_addon.evaluate.plan import Target
from rtgi_addon.jobs.plan import bake_planned
from rtgi_addon.progress import Progress
from rtgi_addon.scene import World
from rtgi_addon.scene.lights import ALL_LIGHT
from rtgi_addon.transport.context import LightContext


def lit_room():
    """A box with a glowing panel and a lamp, open to a sky through a hole, and one volume."""
    scene = rooms.sun_patch_room(0.5)
    panel = rooms.quad("panel", (-0.2, -0.2, 0.9), (0, 0.4, 0), (0.4, 0, 0), 1)
    return build.scene([*scene.meshes, panel], [scene.materials[0], build.material("glow", 0.2, 10.0)],
                       [build.point_light((0.3, -0.2, 0.4), 0.5)], world=0.5)


def with_volumes(scene, **changes):
    """``scene`` with its volume as it is, and one of the same place with ``changes``."""
    volume = scene.volumes[0]
    return replace(scene, volumes=(volume, replace(volume, name="other", **changes)))


def halves(field):
    """Coefficients of the first and of the second volume."""
    values = coefficients(field)
    return values[:len(values) // 2], values[len(values) // 2:]


PARTS = {  # what the changed volume holds of lamps, emission and world
    "emission off": ({"capture_emission": False}, (1, 0, 1)), "bounces off": ({"capture_bounces": False}, (0, 1, 1)),
    "twice, world apart": ({"intensity": 2.0, "capture_world": False}, (2, 2, 1)), "twice": ({"intensity": 2.0}, (2, 2, 2)),
    "half of emission": ({"intensity": 0.5, "capture_bounces": False, "capture_world": False}, (0, 0.5, 1)),
}


@pytest.mark.parametrize("name", PARTS)
def test_each_volume_holds_the_light_it_captures(name):
    """Light is linear: a volume's coefficients are the sum of lamps', emission's and the world's, each as strong as it says."""
    scene, (changes, factors) = lit_room(), PARTS[name]
    dark = replace(scene, lights=(), world=World.constant(0.0), materials=tuple(m.shining(0.0) for m in scene.materials))
    alone = (replace(dark, lights=scene.lights), replace(dark, materials=scene.materials), replace(dark, world=scene.world))
    options = {"rays": 4096, "cache_rays": 256, "texel_size": 0.2}
    parts = [coefficients(bake(one, **options)) for one in alone]
    first, second = halves(bake(with_volumes(scene, **changes), **options))
    scale = np.abs(first).max()
    np.testing.assert_allclose(first, sum(parts), atol=0.012 * scale)
    np.testing.assert_allclose(second, sum(factor * part for factor, part in zip(factors, parts, strict=True)), atol=0.024 * scale)


def test_intensity_is_a_factor_to_the_digit():
    """With the world's light captured all is multiplied alike."""
    first, second = halves(bake(with_volumes(lit_room(), intensity=3.0), **QUICK))
    np.testing.assert_allclose(second, 3.0 * first, rtol=1e-4, atol=1e-4)


def test_relighting_keeps_to_what_is_captured():
    scene = with_volumes(lit_room(), intensity=2.0)
    brighter = replace(scene, lights=(replace(scene.lights[0], intensity=3.0 * scene.lights[0].intensity),))
    first, second = halves(bake(scene, **QUICK).relight(brighter))
    np.testing.assert_allclose(second, 2.0 * first, rtol=1e-3, atol=1e-3)


def test_direct_light_in_a_volume_is_as_strong_as_it_says():
    scene = with_volumes(lit_room(), intensity=2.0, capture_bounces=False)
    held = replace(scene, lights=(replace(scene.lights[0], bake=ALL_LIGHT),))
    with_lamp, without = (halves(bake(one, **QUICK)) for one in (held, scene))
    np.testing.assert_allclose(with_lamp[1] - without[1], 2.0 * (with_lamp[0] - without[0]), atol=1e-4)
    assert np.abs(with_lamp[0] - without[0]).max() > 0.5


@pytest.mark.parametrize(("name", "settings"), [
    ("vpl", {"lights": 64}), ("rsm", {"resolution": 16}), ("lpv", {"resolution": 6, "steps": 4})])
def test_techniques_that_give_all_light_say_so(name, settings):
    method, scene = techniques.get(name), with_volumes(lit_room(), intensity=2.0)
    field = method.bake(scene, method.Settings(**settings), np.random.default_rng(0), Progress())
    said, = [omission for omission in field.omissions if "Capture and Intensity" in omission.text]
    assert said.objects == ("other",) and said.boxes_world.shape == (1, 2, 3)


def test_what_compares_with_all_light_refuses(tmp_path):
    scene = with_volumes(lit_room(), intensity=2.0)
    with pytest.raises(BakeError, match="volume other captures other light"):
        find_leaks(LightContext(scene), bake(scene, **QUICK))
    with pytest.raises(UsageError, match="volume other captures other light"):
        bake_planned(scene, Target(), tmp_path / "out")
