"""Reflections by cones through voxels on the GPU against their numpy, on what the same renderer has drawn."""

from dataclasses import replace

import numpy as np
import pytest
import scene_builders as build
from effect_frames import drawn_frame
from picture_stage import view

from rtgi_addon import techniques
from rtgi_addon.effects import Chosen, get
from rtgi_addon.progress import Progress
from rtgi_addon.scene import Channel, World

EFFECT = get("voxel_reflections")
SIZE = (45, 31)


def scene(roughness):
    """A glowing ball and a dull one on a metal floor under a painted sky."""
    shiny = replace(build.material("shiny", (0.9, 0.7, 0.5)), base_color=Channel(np.float32([0.9, 0.7, 0.5])),
                    metallic=Channel.of(1.0), roughness=Channel.of(roughness))
    balls = [build.sphere(f"ball {index}", 0.45, 2, material_index=index) for index in (1, 2)]
    made = build.scene([build.plane("floor", 1.5), *balls], [shiny, build.material("dull", 0.5), build.material("glow", 0.2, 1.5)],
                       volumes=[build.volume(center=(0, 0, 0.5), half_size=1.0)])
    places = [made.instances[0].world_from_local, build.transform((-0.6, 0.3, 0.5)), build.transform((0.7, 0.6, 0.55))]
    world = World(np.random.default_rng(5).random((5, 9, 3)).astype(np.float32))
    return replace(made, world=world, instances=tuple(replace(item, world_from_local=place)
                                                      for item, place in zip(made.instances, places, strict=True)))


NESTED = {"cones": 6, "cascades": 2, "resolution": 44}


@pytest.mark.parametrize(("name", "settings"), [("cone_tracing", {"cones": 6}), ("cone_tracing", NESTED),
                                                ("voxel_march", {"gather": "voxels", "order": 1})])
@pytest.mark.parametrize("orthographic", [False, True])
@pytest.mark.parametrize("roughness", [0.15, 0.6])
def test_both_halves_reflect_the_same(gpu_device, name, settings, orthographic, roughness):
    from rtgi_addon.preview.renderer import PreviewRenderer
    from rtgi_addon.preview.settings import PreviewSettings
    shown, seen, technique = scene(roughness), view((0.0, -3.2, 1.2), orthographic, 2.2), techniques.get(name)
    wanted = technique.Settings(**{"resolution": 20, "light": "voxels", **settings})
    field = technique.bake(shown, wanted, np.random.default_rng(0), Progress())
    chosen, given = Chosen(EFFECT, EFFECT.Settings()), PreviewSettings(shadow_resolution=128)
    plain, result = (PreviewRenderer(shown, field, given, ("combined",), effects=effects) for effects in ((), (chosen,)))
    for item in (plain, result):
        item.frame(seen, SIZE)
    lit, found = plain.image("combined"), result.image("combined")
    expected = EFFECT.apply(drawn_frame(plain, lit, seen), field, chosen.settings)
    assert np.abs(expected - lit).max() > 0.1 and np.all(np.isfinite(found))
    off = np.abs(found - expected).max(axis=-1)
    assert np.mean(off > 0.01) < 0.02 and np.median(off) < 1e-4
    for item in (plain, result):
        item.close()


def test_voxels_of_its_own_are_numpys(gpu_device):
    from rtgi_addon.preview.renderer import PreviewRenderer
    from rtgi_addon.preview.settings import PreviewSettings
    shown, seen = scene(0.3), view((0.0, -3.2, 1.2), False, 2.2)
    chosen = Chosen(EFFECT, EFFECT.Settings(resolution=16))
    plain, result = (PreviewRenderer(shown, None, PreviewSettings(shadow_resolution=128), ("combined",), effects=effects)
                     for effects in ((), (chosen,)))
    for item in (plain, result):
        item.frame(seen, SIZE)
    assert np.abs(result.image("combined") - plain.image("combined")).max() > 0.1
