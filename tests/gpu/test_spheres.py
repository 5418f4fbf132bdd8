"""Sphere probes on the GPU against their numpy: the look-up by itself, and behind reflections."""

from dataclasses import replace

import numpy as np
import scene_builders as build
from effect_frames import drawn_frame
from offset_technique import constant_grid
from picture_stage import view

from rtgi_addon.effects import Chosen, get
from rtgi_addon.effects.spheres.maps import RAY_SHARE, SphereMap, SphereProbes
from rtgi_addon.effects.spheres.prefilter import prefiltered
from rtgi_addon.scene import Channel, PointLight
from rtgi_addon.scene.sphere_probe import SphereProbe
from rtgi_addon.techniques.lattice.field import ProbeField

TURN = np.array([[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]])


def spheres(count=3, side=32):
    """Probes of every shape with maps of noise, influences that overlap, one of them turned."""
    rng = np.random.default_rng(7)
    levels = prefiltered(rng.random((count, side, side, 3)) ** 3 * 4.0)
    shapes = ("sphere", "box")
    return SphereProbes([SphereMap(
        SphereProbe(f"probe {number}", build.transform(rng.uniform(-1, 1, 3), (1.0, 1.5, 0.8), TURN if number % 2 else None),
                    shapes[number % 2], 1.5 + number, 0.4, shapes[number // 2 % 2], 2.0 + number),
        tuple(level[number].astype(np.float16) for level in levels)) for number in range(count)])


def test_both_halves_look_up_the_same(gpu_device):
    from rtgi_addon.preview.effects.sphere_fallback import SphereFallback
    from rtgi_addon.preview.textures import download, empty, upload
    rng, (width, height) = np.random.default_rng(2), (40, 10)
    points, directions = rng.uniform(-3, 3, (height, width, 4)), rng.normal(size=(height, width, 4))
    directions /= np.linalg.norm(directions[..., :3], axis=-1, keepdims=True)
    directions[..., 3] = 1.0
    directions[0, :3] = [[1, 0, 0, 1], [0, 1, 0, 1], [0, 0, -1, 1]]
    directions[0, 3, 3] = 0.0
    weights = rng.random((height, width, 4))
    light = rng.random((height, width, 4))
    for count in (1, 3, 4):
        found, result = spheres(count), empty(width, height)
        SphereFallback(found).draw(*(upload(part.astype(np.float32)) for part in (points, directions, weights, light)), result)
        flat = [part.reshape(-1, 4).astype(np.float32) for part in (points, directions, weights, light)]
        seen, share = found.radiance(flat[0][:, :3], flat[1][:, :3], RAY_SHARE * flat[2][:, 3]**2)
        expected = np.pi * seen + flat[3][:, :3] * (1 - share)[:, None]
        expected[3] = flat[3][3, :3]
        off = np.abs(download(result).reshape(-1, 4)[:, :3] - expected).max(axis=1)
        assert off.max() < 2e-3 and np.ptp(share) == 1.0 and np.ptp(expected) > 1.0


def test_reflections_fall_back_on_them(gpu_device):
    from rtgi_addon.preview.renderer import STALE_SPHERES, PreviewRenderer
    base = Channel.of(np.float32([0.9, 0.7, 0.5]))
    shiny = replace(build.material("shiny", (0.9, 0.7, 0.5)), base_color=base, metallic=Channel.of(1.0), roughness=Channel.of(0.3))
    lamp = PointLight("lamp", np.float32([0.3, -1.5, 2.4]), np.float32([6, 5, 4]), casts_shadow=False)
    shown = build.scene([build.plane("floor", 3.0), build.sphere("ball", 0.45, 2)], [shiny], [lamp], 0.3)
    field = ProbeField([constant_grid(build.volume(), 0.3)])
    seen, effect = view((0.0, -3.2, 1.2), False, 2.2), get("screen_reflections")
    chosen = Chosen(effect, effect.Settings(max_roughness=0.0))
    plain = PreviewRenderer(shown, field, None, ("combined",))
    plain.frame(seen, (24, 17))
    frame = drawn_frame(plain, plain.image("combined"), seen)
    bare = effect.apply(replace(frame, passes={}), field, chosen.settings)
    field.spheres = spheres()
    result = PreviewRenderer(shown, field, None, ("combined",), effects=(chosen,))
    result.frame(seen, (24, 17))
    expected = effect.apply(replace(frame, passes={}), field, chosen.settings)
    assert np.abs(expected - bare).max() > 0.2
    assert np.abs(result.image("combined") - expected).max() < 4e-3 and not result.error
    # Under other lamps they say nothing any more, and that is told.
    result.update(replace(shown, lights=(replace(lamp, intensity=lamp.intensity * 2),)))
    result.frame(seen, (24, 17))
    assert STALE_SPHERES in result.notes
