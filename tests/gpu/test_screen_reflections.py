"""Screen-space reflections on the GPU against their numpy, on what the same renderer has drawn."""

from dataclasses import replace

import numpy as np
import pytest
import scene_builders as build
from effect_frames import drawn_frame
from picture_stage import view

from rtgi_addon.effects import Chosen, get
from rtgi_addon.scene import Channel, ClosedMesh, Medium, Phase, PointLight, World
from rtgi_addon.transport.context import LightContext

EFFECT = get("screen_reflections")
SIZE = (45, 31)


def shiny(roughness, metallic=1.0):
    base = Channel(np.float32([0.9, 0.7, 0.5]))
    return replace(build.material("shiny", (0.9, 0.7, 0.5)), base_color=base, metallic=Channel.of(metallic),
                   roughness=Channel.of(roughness), specular=Channel.of(0.04))


def scene(roughness):
    """Two balls, one of which glows, on a shiny floor in a painted world."""
    dull, glowing = replace(build.material("dull", (0.3, 0.6, 0.8)), specular=Channel.of(0.0)), build.material("glow", 0.2, 1.5)
    balls = [build.sphere(f"ball {index}", 0.45, 2, material_index=index) for index in (1, 2)]
    lamp = PointLight("lamp", np.float32([0.3, -1.5, 2.4]), np.float32([6, 5, 4]), casts_shadow=False)
    made = build.scene([build.plane("floor", 3.0), *balls], [shiny(roughness), dull, glowing], [lamp], 0.0)
    places = [made.instances[0].world_from_local, build.transform((-0.6, 0.3, 0.5)), build.transform((0.7, 0.6, 0.55))]
    world = World(np.random.default_rng(5).random((5, 9, 3)).astype(np.float32))
    return replace(made, world=world, instances=tuple(replace(item, world_from_local=place)
                                                      for item, place in zip(made.instances, places, strict=True)))


@pytest.mark.parametrize("orthographic", [False, True])
@pytest.mark.parametrize("search", ["hierarchical", "linear"])
@pytest.mark.parametrize("roughness", [0.0, 0.4])
def test_both_halves_reflect_the_same(gpu_device, orthographic, search, roughness):
    from rtgi_addon.preview.renderer import PreviewRenderer
    from rtgi_addon.preview.settings import PreviewSettings
    shown, seen = scene(roughness), view((0.0, -3.2, 1.2), orthographic, 2.2)
    chosen = Chosen(EFFECT, EFFECT.Settings(search=search, rays=2, steps=64))
    settings = PreviewSettings(shadow_resolution=128)
    passes = ("combined", *EFFECT.passes)
    plain, result = (PreviewRenderer(shown, None, settings, passes, effects=effects) for effects in ((), (chosen,)))
    for item in (plain, result):
        item.frame(seen, SIZE)
    lit, found = plain.image("combined"), result.image("combined")
    frame = drawn_frame(plain, lit, seen)
    expected = EFFECT.apply(frame, None, chosen.settings)
    fallback = EFFECT.apply(replace(frame, passes={}), None, replace(chosen.settings, max_roughness=0.0))
    assert np.abs(expected - fallback).max() > 0.2 and np.all(np.isfinite(found))
    off = np.abs(found - expected).max(axis=-1)
    # Rays that graze an edge may fall on either side of it.
    assert np.mean(off > 0.01) < 0.02 and np.median(off) < 1e-4
    for name in EFFECT.passes:
        off = np.abs(result.image(name) - frame.passes[name]).max(axis=-1)
        assert frame.passes[name].max() > 0.5 and np.mean(off > 0.01) < 0.02
        assert np.array_equal(plain.image(name)[..., :3], np.zeros_like(lit[..., :3]))


@pytest.mark.parametrize("medium", ["fog", "box"])
def test_both_halves_reflect_through_media(gpu_device, medium):
    """What mirrors show through fog, on the mean over samples and pixels: numpy draws one point a ray, the GPU walks in steps."""
    from rtgi_addon.preview.renderer import PreviewRenderer
    from rtgi_addon.preview.settings import PreviewSettings
    fog = Medium("fog", np.float64([0.2, 0.3, 0.4]), np.array([0.1, 0.2, 0.1]), np.array([0.02, 0.0, 0.05]), Phase(anisotropy=0.4))
    if medium == "box":
        fog = replace(fog, bounds=ClosedMesh(build.cube().vertices_local, build.cube().triangles,
                                             build.transform((0.1, 0.2, 0.6), (1.4, 1.2, 0.6))))
    made, seen = scene(0.0), view((0.0, -3.2, 1.2), False, 2.2)
    shown = replace(made, media=(fog,), lights=tuple(replace(light, casts_shadow=medium == "box") for light in made.lights))
    chosen = Chosen(EFFECT, EFFECT.Settings(rays=2, steps=64))
    settings, passes = PreviewSettings(shadow_resolution=128), ("combined", *EFFECT.passes)
    plain, result = (PreviewRenderer(shown, None, settings, passes, effects=effects) for effects in ((), (chosen,)))
    for item in (plain, result):
        item.frame(seen, SIZE)
    lit, found = plain.image("combined"), result.image("combined")
    frame, empty = drawn_frame(plain, lit, seen), LightContext(replace(shown, media=()), 1)
    clear = EFFECT.apply(replace(frame, open_context=lambda: empty, passes={}), None, chosen.settings)
    expected = np.mean([EFFECT.apply(replace(frame, index=index, passes={}), None, chosen.settings) for index in range(24)], axis=0)
    met = result.image("mirror_confidence")[..., 0] > 0.5
    assert met.sum() > 50 and np.abs(expected - clear)[met].mean() > 0.02
    assert found[met][:, :3].mean(axis=0) == pytest.approx(expected[met][:, :3].mean(axis=0), rel=0.02)
    assert np.abs(found - expected)[met].mean() < 0.25 * np.abs(expected - clear)[met].mean()


def test_without_a_search_both_halves_show_the_fallback(gpu_device):
    from rtgi_addon.preview.renderer import PreviewRenderer
    shown, seen = scene(0.3), view((0.0, -3.2, 1.2), False, 2.2)
    chosen = Chosen(EFFECT, EFFECT.Settings(max_roughness=0.0))
    plain, result = (PreviewRenderer(shown, None, None, ("combined",), effects=effects) for effects in ((), (chosen,)))
    for item in (plain, result):
        item.frame(seen, SIZE)
    expected = EFFECT.apply(drawn_frame(plain, plain.image("combined"), seen), None, chosen.settings)
    assert np.abs(result.image("combined") - expected).max() < 2e-3
