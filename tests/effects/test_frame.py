"""What effects are given on the CPU: the lit picture, its depth, what was seen before."""

from dataclasses import replace

import brdf
import numpy as np
import pytest
import scene_builders as build
from picture_stage import LAMP, SIZE, stage, view

from rtgi_addon.effects import Frame
from rtgi_addon.effects.frame import NOWHERE
from rtgi_addon.effects.lit import draw_frame
from rtgi_addon.progress import Progress
from rtgi_addon.scene import Channel, Material, SunLight, World
from rtgi_addon.techniques import get
from rtgi_addon.transport.context import LightContext
from rtgi_addon.transport.lights.environment import Environment


@pytest.mark.parametrize("orthographic", [False, True])
def test_the_picture_is_the_sum_of_its_light(orthographic):
    frame = draw_frame(stage(), None, view(orthographic=orthographic), SIZE)
    seen = frame.gbuffer.seen
    assert 0.1 < seen.mean() < 0.95
    # The world alone, from everywhere: what is shown where there is no bake.
    assert np.allclose(frame.irradiance[seen][:, :3], 0.3 * np.pi, rtol=1e-4)
    emission = np.where(frame.gbuffer.instance[seen] == 1, 0.25, 0.0)[:, None]
    expected = frame.direct[seen][:, :3] + frame.gbuffer.albedo[seen][:, :3] * 0.3 + emission
    assert frame.direct.max() > 0.1 and np.allclose(frame.light[seen][:, :3], expected, rtol=1e-4)
    assert np.allclose(frame.light[~seen], (0.3, 0.3, 0.3, 1.0)) and np.all(frame.light[seen][:, 3] == 1)
    assert not frame.direct[~seen].any() and not frame.irradiance[~seen].any()


@pytest.mark.parametrize(("metallic", "roughness", "specular"), [(0, 0.5, 0.0), (0, 0.3, 0.04), (1, 0.4, 0.04), (0.5, 0.7, 0.04)])
def test_surfaces_reflect_as_the_formulas_say(metallic, roughness, specular):
    base = np.float32([0.7, 0.5, 0.3])
    material = Material("glossy", Channel(base), base_color=Channel(base), metallic=Channel.of(metallic),
                        roughness=Channel.of(roughness), specular=Channel.of(specular))
    frame = draw_frame(stage(material=material), None, view(), SIZE)
    chosen = np.flatnonzero(frame.gbuffer.instance.ravel() == 0)[::13]
    assert len(chosen) > 6
    for index in chosen:
        point = frame.gbuffer.position.reshape(-1, 4)[index, :3].astype(np.float64)
        eye, light = frame.view.position - point, LAMP.position_world - point
        squared, normal = light @ light, np.array([0.0, 0.0, 1.0])
        eye, light = eye / np.linalg.norm(eye), light / np.sqrt(squared)
        expected = brdf.reflectance(base, base, metallic, roughness, specular, normal, eye, light)
        assert frame.direct.reshape(-1, 4)[index, :3] == pytest.approx(expected * LAMP.intensity / squared * light[2], rel=0.03)


def test_lamps_throw_shadows_unless_they_are_told_not_to():
    lit = {shadow: draw_frame(stage([replace(LAMP, position_world=np.float32([-0.9, 0.3, 2.2]), casts_shadow=shadow)], 0.0), None,
                              view(), SIZE).direct for shadow in (False, True)}
    dark = (lit[False].sum(axis=-1) > 0) & (lit[True].sum(axis=-1) == 0)
    assert 3 < dark.sum() < 0.5 * dark.size
    assert np.array_equal(lit[True][~dark], lit[False][~dark])


def test_wide_lamps_settle_with_points_as_with_samples():
    scene = stage([SunLight("sun", np.float32([0.6, 0, -0.8]), np.float32([1, 1, 1]), 0.5)], 0.0)
    context = LightContext(scene, 1)
    at_once = draw_frame(context, None, view(), SIZE, lamp_points=64).direct
    by_samples = np.mean([draw_frame(context, None, view(), SIZE, index=index).direct for index in range(64)], axis=0)
    assert np.allclose(at_once, by_samples, atol=1e-5)
    penumbra = draw_frame(context, None, view(), SIZE).direct
    assert np.abs(penumbra - at_once).max() > 0.05 * at_once.max()


def test_the_field_lights_it_and_lamps_that_it_holds_are_not_added_again():
    scene = replace(stage(world=0.0), volumes=(build.volume("room", half_size=(1.5, 1.5, 1.0), center=(0.0, 0.0, 1.0)),))
    method, found = get("probes"), {}
    for direct in (False, True):
        field = method.bake(scene, method.Settings(rays=64, direct=direct), np.random.default_rng(1), Progress())
        found[direct] = frame = draw_frame(scene, field, view(), SIZE)
        seen = frame.gbuffer.seen
        expected = field.irradiance(frame.gbuffer.position[seen][:, :3], frame.gbuffer.normal[seen][:, :3])
        assert np.allclose(frame.irradiance[seen][:, :3], np.maximum(expected, 0), rtol=1e-5)
    assert found[False].direct.max() > 0.1 and not found[True].direct.any()


def test_a_scene_of_nothing_is_its_world():
    turned = World(np.random.default_rng(1).random((4, 8, 3)).astype(np.float32), np.array([[0.0, 1, 0], [-1, 0, 0], [0, 0, 1]]))
    frame = draw_frame(replace(stage(), instances=(), world=turned), None, view(), SIZE)
    assert not frame.gbuffer.seen.any() and frame.context is None
    assert np.allclose(frame.light[..., :3].reshape(-1, 3), Environment(turned).radiance(frame.directions.reshape(-1, 3)))
    clear = draw_frame(replace(stage(), instances=()), None, view(), SIZE, transparent=True)
    assert not clear.light.any() and not clear.background.any()


@pytest.mark.parametrize("orthographic", [False, True])
def test_depth_distance_and_directions_meet_at_the_surface(orthographic):
    frame = draw_frame(stage(), None, view(orthographic=orthographic), SIZE)
    seen, points = frame.gbuffer.seen, frame.gbuffer.position[..., :3]
    assert np.all(frame.depth[~seen] == np.float32(NOWHERE)) and np.all(frame.distance[~seen] == np.float32(NOWHERE))
    if orthographic:
        assert np.array_equal(frame.distance, frame.depth) and np.allclose(frame.directions, frame.view.forward, atol=1e-6)
        along = (points[seen] - frame.view.position) @ frame.view.forward
        assert np.allclose(frame.depth[seen], along, rtol=1e-5)
    else:
        met = frame.view.position + frame.directions[seen] * frame.distance[seen][:, None]
        assert np.allclose(met, points[seen], atol=1e-4)
        assert np.all(frame.distance[seen] >= frame.depth[seen]) and np.all(frame.depth[seen] > 0)


def test_history_finds_what_was_seen_before():
    from rtgi_addon.effects import History
    scene = stage()
    before = draw_frame(scene, None, view(), SIZE, offset=(0.3, 0.1))
    after = draw_frame(scene, None, view((0.6, -3.2, 2.0)), SIZE, history=History(before))
    place, inside = after.history.places(after.gbuffer.position[..., :3])
    chosen = inside & after.gbuffer.seen & (after.gbuffer.instance == 0)
    column, row = np.rint(place[chosen]).astype(int).T
    assert chosen.sum() > 50
    met = before.gbuffer.position[np.clip(row, 0, SIZE[1] - 1), np.clip(column, 0, SIZE[0] - 1)]
    same = np.linalg.norm(met[:, :3] - after.gbuffer.position[chosen][:, :3], axis=1)
    # A pixel apart at most, but where the ball stood in between.
    assert np.mean(same < 0.35) > 0.85
    itself, inside = History(before).places(before.gbuffer.position[..., :3])
    y, x = np.nonzero(before.gbuffer.seen)
    assert np.all(inside[before.gbuffer.seen])
    assert np.allclose(itself[before.gbuffer.seen], np.stack([x, y], axis=1), atol=1e-3)


def test_frames_are_never_written_to():
    with pytest.raises(AttributeError):
        draw_frame(stage(), None, view(), SIZE).light = None
    assert Frame.__dataclass_params__.frozen
