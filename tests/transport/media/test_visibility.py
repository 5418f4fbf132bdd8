"""Media hidden from some kinds of rays: as Cycles has it, one hidden from shadow rays leaves the light of lamps alone, one hidden
from diffuse rays the world's and the surfaces'."""

from dataclasses import replace

import numpy as np
import pytest
from scene_builders import cube, material, open_plane, scene, transform

from rtgi_addon.scene import Channel, ClosedMesh, Medium
from rtgi_addon.scene.checks import check_scene
from rtgi_addon.transport.context import LightContext

UP = np.array([[0.0, 0.0, 1.0]], np.float32)
FLOOR = np.array([[0.1, 0.2, 1e-3]], np.float32)


def context(**hidden):
    """An open plane under an absorbing slab of optical depth 1."""
    bounds = ClosedMesh(cube().vertices_local, cube().triangles, transform((0, 0, 3), (50, 50, 0.5)))
    return LightContext(replace(open_plane(), media=(Medium("fog", absorption=np.ones(3), bounds=bounds, **hidden),)))


def seen(context):
    """What is left of a lamp's light, of what a surface sees and of what a probe sees."""
    lamp = context.lamp_transmittance(True, FLOOR, UP, np.array([10.0]))[0, 0]
    looks = [1.0 if (hits := tracer.intersect(FLOOR, UP)).tint is None else float(hits.tint[0, 0])
             for tracer in (context.tracers.diffuse, context.tracers.view)]
    return [float(lamp), *looks]


@pytest.mark.parametrize(("hidden", "left"), [
    ({}, (0, 0, 0)), ({"visible_shadow": False}, (1, 0, 0)), ({"visible_diffuse": False}, (0, 1, 1)),
    ({"visible_camera": False}, (0, 0, 0)), ({"visible_shadow": False, "visible_diffuse": False}, (1, 1, 1))],
    ids=["none", "shadow", "diffuse", "camera", "both"])
def test_each_kind_of_ray_meets_what_it_may(hidden, left):
    made = context(**hidden)
    expected = np.where(left, 1.0, np.exp(-1.0))
    assert seen(made) == pytest.approx(expected, rel=1e-5)
    assert seen(made.relit(made.scene)) == pytest.approx(expected, rel=1e-5)
    assert len(made.all_media.fillings) == 1 and made.media.is_empty == ("visible_diffuse" in hidden)


def test_a_world_that_glows_and_takes_nothing_is_refused_by_name():
    glow = Medium("world 'Sky'", np.array([0.1, 0.0, 0.0]), emission=np.array([1.0, 0.5, 0.0]))
    said = [finding for finding in check_scene(replace(open_plane(), media=(glow,))) if finding.object == "world 'Sky'"]
    assert [finding.severity for finding in said] == ["error"] and "never ends" in said[0].message
    sound = replace(glow, absorption=np.array([0.0, 0.1, 0.0]))
    assert not [finding for finding in check_scene(replace(open_plane(), media=(sound,))) if finding.object == "world 'Sky'"]


def test_a_wall_flush_with_a_medium_is_met():
    """The walls of a medium have no surface; a ray that passed one went on behind what stands in the same place."""
    clear = replace(material("medium", 0.0), alpha=Channel.of(0.0))
    inner, room = cube("medium", 1.0, material_index=1), cube("room", 1.0, inward=True)
    origins = np.zeros((64, 3), np.float32)
    directions = np.float32(np.random.default_rng(0).normal(size=(64, 3)))
    far = scene([inner, room, cube("behind", 1.5, inward=True)], [material(), clear])
    hits = LightContext(far).bare.view.intersect(origins, directions)
    assert np.all(np.abs(directions * hits.t[:, None]).max(axis=1) == pytest.approx(1.0, rel=1e-5))
    alone = LightContext(scene([inner], [material(), clear])).bare
    assert np.all(alone.view.intersect(origins, directions).primitive < 0) and not alone.shadow.occluded(origins, directions).any()
