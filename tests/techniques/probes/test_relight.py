"""Relighting a probe bake from its kept hits against fresh bakes, and where it must refuse."""

from dataclasses import replace

import numpy as np
import pytest
import room_scenes as rooms
import scene_builders as build
from probe_bakes import QUICK, Memory, bake, bytes_of, coefficients, rms

from rtgi_addon.errors import BakeError
from rtgi_addon.techniques.probes.relight import _multiply


def relit_and_fresh(scene, other, **settings):
    field = bake(scene, **settings)
    return coefficients(field), coefficients(field.relight(other)), coefficients(bake(other, seed=9, **settings))


def under_other_lamps(scene):
    return replace(scene, lights=(build.point_light((-0.4, 0.5, 0.6), (0.3, 1.5, 2.0)),))


@pytest.mark.parametrize("scene", [build.closed_box(0.6, light_position=(0.3, -0.2, 0.5)), rooms.textured_room(),
                                   rooms.screen_room(),
                                   replace(rooms.panel_room(emission=2.0), lights=(build.point_light(),))],
                         ids=["box", "textures", "cut-outs", "with a panel"])
def test_relighting_under_a_moved_and_recoloured_lamp(scene):
    """A few per cent from a fresh bake of another seed, both at 2 %."""
    before, relit, fresh = relit_and_fresh(scene, under_other_lamps(scene), error=0.02)
    assert rms(relit - fresh) < 0.04 * rms(fresh) < rms(before - fresh)


def test_relighting_under_another_world():
    scene = rooms.courtyard()
    before, relit, fresh = relit_and_fresh(scene, replace(scene, world=rooms.sunny_world(sun=50.0)), error=0.02)
    assert rms(relit - fresh) < 0.04 * rms(fresh) < rms(before - fresh)


def test_relighting_under_the_same_light_changes_little_and_nothing_of_the_first_field():
    scene = rooms.panel_room()
    field = bake(scene, error=0.03)
    before = bytes_of(field)
    assert rms(coefficients(field.relight(scene)) - coefficients(field)) < 0.01 * rms(coefficients(field))
    assert bytes_of(field) == before


def test_relighting_keeps_direct_light_and_bounces():
    scene = build.closed_box(0.6, light_position=(0.3, -0.2, 0.5))
    for settings in ({"direct": True}, {"bounces": 1}):
        _, relit, fresh = relit_and_fresh(scene, under_other_lamps(scene), error=0.02, **settings)
        assert rms(relit - fresh) < 0.04 * rms(fresh)


def test_relighting_refuses_what_it_cannot_do():
    scene = build.closed_box()
    field = bake(scene, **QUICK)
    moved = replace(scene, meshes=(rooms.moved(scene.meshes[0], (0.1, 0, 0)),))
    with pytest.raises(BakeError, match="geometry"):
        field.relight(moved)
    painted = replace(scene, materials=(build.material("wall", 0.1),))
    with pytest.raises(BakeError, match="material"):
        field.relight(painted)
    broken = Memory(stop=1)
    with pytest.raises(KeyboardInterrupt):
        bake(scene, checkpoint=broken, **QUICK)
    with pytest.raises(BakeError, match="no hits"):
        bake(scene, checkpoint=Memory(broken.stored), **QUICK).relight(scene)


def test_what_is_kept_in_halves_multiplies_as_numpy_would():
    factors = np.arange(1 << 16, dtype=np.uint16).view(np.float16)
    factors = factors[np.isfinite(factors)][:60000].reshape(4, -1, 3)
    radiance = np.random.default_rng(0).random((*factors.shape[:2], 4)).astype(np.float32)
    expected = radiance.copy()
    expected[..., :3] *= factors
    _multiply(radiance, factors)
    assert np.array_equal(radiance, expected)
