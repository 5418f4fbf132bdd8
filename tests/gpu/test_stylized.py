"""The stylized effect on the GPU makes what its numpy makes of the same frame, part by part."""

from dataclasses import replace

import numpy as np
import pytest
from effect_frames import drawn_frame
from picture_stage import SIZE, stage, view

from rtgi_addon.effects import Chosen, get
from rtgi_addon.scene import World

STYLE = get("stylized")
PLAIN = {"shading": "as_lit", "highlights": "as_lit", "lines": False}
CASES = {
    "default": {},
    "bands": {"lines": False, "bands": 4, "softness": 3.0, "shadow_amount": 0.6, "bleeding": 2.0},
    "channels": {"lines": False, "per_channel": True, "highlights": "none"},
    "ramps": {"lines": False, "shading": "ramp", "ramp": "constant 0:0.1,0.1,0.4 0.2:0.5 0.6:1,0.9,0.7", "ramp_tint": 0.5,
              "highlights": "ramp", "highlight_ramp": "0:0 0.5:0.2 1:1"},
    "rim": {**PLAIN, "rim_strength": 0.7, "rim_light": 0.5, "rim_width": 0.6, "rim_softness": 0.3},
    "stipple": {**PLAIN, "pattern": "stipple"},
    "hatching": {**PLAIN, "pattern": "hatching", "pattern_strength": 0.8, "pattern_tone": 0.6},
    "paper": {"shading": "paper", "paper_background": True, "rim_strength": 0.1},
    "grading": {**PLAIN, "contrast": 1.6, "saturation": 1.4, "tint": (1.0, 0.9, 0.7), "strength": 0.7},
    "lines": {**PLAIN, "lines": True, "line_width": 4.0, "line_by_material": True, "line_opacity": 0.8},
    "gradients": {**PLAIN, "lines": True, "depth_edges": "gradient", "normal_edges": "components"},
    "curvature": {**PLAIN, "lines": True, "depth_edges": "inverse_depth", "curvature_edges": "both", "curvature_threshold": 4.0},
    "marked": {**PLAIN, "lines": True, "line_width": 5.0, "depth_edges": "none", "normal_edges": "none", "object_edges": False,
               "material_edges": False},
    "world": {**PLAIN, "lines": True, "line_world_width": 0.03, "line_thinning": 3.0},
    "excluded": {**PLAIN, "lines": True, "exclude_pass_index": 3},
    "collection": {**PLAIN, "lines": True, "exclude_collection": "x"},
}


def scene():
    """The stage with all that lines look up: colours, indices, a marked edge of the floor and some of the ball's."""
    found = stage(world=0.2)
    materials = tuple(replace(item, line_color=color) for item, color in zip(
        found.materials, ((0.6, 0.1, 0.0, 1.0), (0.0, 0.2, 0.9, 0.5)), strict=True))
    floor, ball = found.meshes
    meshes = (replace(floor, marked_edges=np.int32([[0, 1], [1, 2], [0, 2]])),
              replace(ball, marked_edges=ball.triangles[::5, :2].astype(np.int32)))
    instances = found.instances[0], replace(found.instances[1], pass_index=3, collections=("x",))
    return replace(found, meshes=meshes, materials=materials, instances=instances, world=World.constant((0.2, 0.3, 0.5)))


def drawn(shown, seen, size, *chosen, **settings):
    from rtgi_addon.preview.renderer import PreviewRenderer
    from rtgi_addon.preview.settings import PreviewSettings
    result = PreviewRenderer(shown, None, PreviewSettings(shadow_resolution=128, **settings), ("combined",), effects=chosen)
    result.frame(seen, size)
    return result


@pytest.mark.parametrize("orthographic", [False, True])
@pytest.mark.parametrize("name", CASES)
def test_both_halves_make_the_same_picture(gpu_device, name, orthographic):
    shown, seen, size = scene(), view(orthographic=orthographic), (3 * SIZE[0], 3 * SIZE[1])
    settings = STYLE.Settings(**CASES[name])
    plain = drawn(shown, seen, size)
    lit = plain.image("combined")
    found = drawn(shown, seen, size, Chosen(STYLE, settings)).image("combined")
    expected = STYLE.apply(drawn_frame(plain, lit, seen), None, settings)
    off = np.abs(found - expected).max(axis=-1)
    assert np.abs(found - lit).max() > 0.02
    # A threshold may fall on the other side by a rounding.
    assert np.mean(off > 2e-3) < 0.002 and np.median(off) < 1e-5


@pytest.mark.parametrize("orthographic", [False, True])
def test_both_halves_thin_the_same_bends(gpu_device, orthographic):
    found = scene()
    ball = found.instances[1]
    rod = ball.world_from_local @ np.diag([2.0, 0.3, 0.3, 1.0])
    shown = replace(found, instances=(found.instances[0], replace(ball, world_from_local=rod)))
    seen, size = view(orthographic=orthographic), (8 * SIZE[0], 8 * SIZE[1])
    settings = STYLE.Settings(**PLAIN | {"lines": True, "depth_edges": "none", "normal_edges": "none", "object_edges": False,
                                         "material_edges": False, "marked_edges": False, "curvature_edges": "both",
                                         "curvature_threshold": 2.0})
    plain = drawn(shown, seen, size)
    lit = plain.image("combined")
    expected = STYLE.apply(drawn_frame(plain, lit, seen), None, settings)
    changed = np.abs(expected - lit).max(axis=-1) > 0.02
    assert 30 < np.count_nonzero(changed) < 0.02 * changed.size
    off = np.abs(drawn(shown, seen, size, Chosen(STYLE, settings)).image("combined") - expected).max(axis=-1)
    assert np.mean(off > 2e-3) < 5e-4


def test_no_strength_is_the_lit_picture(gpu_device):
    plain, off = (drawn(stage(), view(), SIZE, *chosen).image("combined") for chosen in (
        (), (Chosen(STYLE, STYLE.Settings(strength=0.0)),)))
    assert np.array_equal(plain, off)


def test_the_lamps_irradiance_is_that_of_rays(gpu_device):
    from rtgi_addon.effects.lit import draw_frame
    from rtgi_addon.preview.textures import download
    found = download(drawn(stage(), view(), SIZE)._direct)
    expected = draw_frame(stage(), None, view(), SIZE).direct
    assert expected[..., 3].max() > 0.3
    off = np.abs(found - expected).max(axis=-1)
    assert np.mean(off > 0.02) < 0.03 and np.median(off) < 1e-3


def test_nothing_to_see_is_no_trouble(gpu_device):
    empty = replace(stage(), instances=())
    image = drawn(empty, view(), SIZE, Chosen(STYLE, STYLE.Settings())).image("combined")
    assert np.all(np.isfinite(image))


@pytest.mark.parametrize("name", ["bands", "hatching", "lines"])
def test_media_lie_over_the_style_in_both_halves(gpu_device, name):
    from rtgi_addon.preview.renderer import PreviewRenderer
    from rtgi_addon.preview.settings import PreviewSettings
    from rtgi_addon.scene import Medium
    shown, seen, size = replace(scene(), media=(Medium("Soot", absorption=np.float64([0.1, 0.2, 0.4])),)), view(), (48, 32)
    media, settings = Chosen(get("media"), get("media").Settings()), STYLE.Settings(**CASES[name])
    plain, styled = (PreviewRenderer(shown, None, PreviewSettings(shadow_resolution=128), ("combined", "transmittance"),
                                     effects=effects) for effects in ((media,), (media, Chosen(STYLE, settings))))
    for result in (plain, styled):
        result.frame(seen, size)
    left = plain.image("transmittance")
    of_surfaces = left[drawn_frame(plain, left, seen).gbuffer.seen]
    assert 0.05 < of_surfaces[:, :3].min() < of_surfaces[:, :3].max() < 0.95
    frame = replace(drawn_frame(plain, plain.image("combined"), seen), passes={"transmittance": left})
    expected, found = STYLE.apply(frame, None, settings), styled.image("combined")
    off = np.abs(found - expected).max(axis=-1)
    assert np.mean(off > 2e-3) < 0.005 and np.median(off) < 1e-5
    clear = STYLE.apply(replace(frame, passes={}), None, settings)
    assert np.abs(clear - expected).max() > 0.02


@pytest.mark.parametrize("name", ["bands", "hatching", "lines", "marked"])
@pytest.mark.parametrize("media", [False, True])
def test_styles_fade_with_mist_in_both_halves(gpu_device, name, media):
    from rtgi_addon.preview.renderer import PreviewRenderer
    from rtgi_addon.preview.settings import PreviewSettings
    from rtgi_addon.scene import Medium
    shown, seen, size = scene(), view(), (48, 32)
    effects = [Chosen(get("mist"), get("mist").Settings(start=2.0, depth=4.0, fade_to="color", color=(0.9, 0.1, 0.1)))]
    if media:
        shown = replace(shown, media=(Medium("Soot", absorption=np.float64([0.1, 0.2, 0.4])),))
        effects.insert(0, Chosen(get("media"), get("media").Settings()))
    settings = STYLE.Settings(**CASES[name])
    plain, styled = (PreviewRenderer(shown, None, PreviewSettings(shadow_resolution=128), ("combined", "transmittance"),
                                     effects=chosen) for chosen in (effects, (*effects, Chosen(STYLE, settings))))
    for result in (plain, styled):
        result.frame(seen, size)
    frame = drawn_frame(plain, plain.image("combined"), seen)
    effects[-1].effect.apply(frame, None, effects[-1].settings)
    left = frame.passes["left_by_mist"][frame.gbuffer.seen]
    assert 0.001 < left.min() < 0.3 and 0.8 < left.max() < 0.999
    passes = {**frame.passes, **({"transmittance": plain.image("transmittance")} if media else {})}
    expected, found = STYLE.apply(replace(frame, passes=passes), None, settings), styled.image("combined")
    off = np.abs(found - expected).max(axis=-1)
    assert np.mean(off > 2e-3) < 0.005 and np.median(off) < 1e-5
    clear = STYLE.apply(replace(frame, passes={}), None, settings)
    assert np.abs(clear - expected).max() > 0.02
