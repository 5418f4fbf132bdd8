"""Effects on the GPU: every half against the effect's own numpy, and where it stands in a picture."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from effect_frames import drawn_frame
from picture_stage import SIZE, stage, view

from rtgi_addon.effects import Chosen, Effect, registry, setting
from rtgi_addon.effects.base import apply_all
from rtgi_addon.effects.lit import draw_frame
from rtgi_addon.scene import Mist, World

MIST = registry()["mist"]


def scene():
    """The stage in a painted world, with mist that begins within it."""
    painted = World(np.random.default_rng(3).random((7, 12, 3)).astype(np.float32))
    return replace(stage(), world=painted, mist=Mist(2.0, 3.0, "quadratic"))


def renderer(*chosen, shown=None, passes=("combined",), **settings):
    from rtgi_addon.preview.renderer import PreviewRenderer
    from rtgi_addon.preview.settings import PreviewSettings
    return PreviewRenderer(shown or scene(), None, PreviewSettings(shadow_resolution=128, **settings), passes, effects=chosen)


SETTINGS = [MIST.Settings(), MIST.Settings(fade_to="color", color=(0.9, 0.2, 0.4)), MIST.Settings(strength=0.5, falloff="linear"),
            MIST.Settings(fade_to="color", over_world=False, start=1.0, depth=2.0, falloff="inverse_quadratic")]


@pytest.mark.parametrize("orthographic", [False, True])
@pytest.mark.parametrize("transparent", [False, True])
@pytest.mark.parametrize("settings", SETTINGS)
def test_mist_is_the_same_in_both_halves(gpu_device, orthographic, transparent, settings):
    shown, seen = scene(), view(orthographic=orthographic)
    plain, misty = (renderer(*chosen, shown=shown, film_transparent=transparent) for chosen in ((), (Chosen(MIST, settings),)))
    for result in (plain, misty):
        result.frame(seen, SIZE)
    lit = plain.image("combined")
    expected = MIST.apply(drawn_frame(plain, lit, seen, transparent), None, settings)
    found = misty.image("combined")
    assert np.abs(found - lit).max() > 0.05
    assert np.abs(found - expected).max() < 2e-3 and np.abs(found - expected).mean() < 1e-5


def test_the_pictures_of_both_paths_are_one(gpu_device):
    """Rays, numpy and Embree against raster, GLSL and shadow maps, from the scene to the finished picture."""
    chosen = (Chosen(MIST, MIST.Settings(fade_to="color")),)
    result = renderer(*chosen)
    result.frame(view(), SIZE)
    expected = apply_all(draw_frame(scene(), None, view(), SIZE), None, chosen).light
    off = np.abs(result.image("combined") - expected).max(axis=-1)
    assert np.mean(off > 0.02) < 0.03 and np.median(off) < 1e-3


def test_no_effect_changes_nothing_and_other_passes_are_left_alone(gpu_device):
    plain = renderer(passes=("combined", "direct", "albedo", "depth"))
    misty = renderer(Chosen(MIST, MIST.Settings()), passes=("combined", "direct", "albedo", "depth"))
    none = renderer(Chosen(MIST, MIST.Settings(strength=0.0)), passes=("combined",))
    for _ in range(3):
        for result in (plain, misty, none):
            result.frame(view(), SIZE)
    for name in ("direct", "albedo", "depth"):
        assert np.array_equal(plain.image(name), misty.image(name))
    assert np.abs(plain.image("combined") - misty.image("combined")).max() > 0.05
    assert np.allclose(plain.image("combined"), none.image("combined"), atol=1e-6)


def test_effects_are_switched_without_a_new_renderer(gpu_device):
    result = renderer(passes=("combined",))
    result.frame(view(), SIZE)
    plain, chosen = result.image("combined"), Chosen(MIST, MIST.Settings())
    result.configure(result.settings, ("combined",), [chosen])
    halves = result._halves
    result.frame(view(), SIZE)
    assert result.samples == 1 and np.abs(result.image("combined") - plain).max() > 0.05
    result.configure(result.settings, ("combined",), [chosen])
    assert result._halves is halves
    result.configure(result.settings, ("combined",))
    result.frame(view(), SIZE)
    assert np.array_equal(result.image("combined"), plain)


@dataclass(frozen=True)
class Gain:
    """One number."""

    gain: float = setting(2.0, "Gain", "How much", "", 0.0, 10.0)


class Trail(Effect):
    """What was there before stays for a while: an effect without a half on the GPU, which asks for all that a frame has."""

    name, label, description, stage = "trail", "Trail", "For tests", "style"
    Settings = Gain

    def __init__(self):
        self.frames = []

    def apply(self, frame, field, settings):
        """See Effect.apply."""
        self.frames.append(frame)
        assert frame.context.geometry.count > 0 and frame.context is frame.context
        before = 0.0 if frame.history is None else frame.history.images["trail"]
        return frame.light * np.float32(settings.gain) + before


def test_an_effect_without_a_half_runs_on_what_was_drawn(gpu_device):
    trail = Trail()
    chosen = Chosen(MIST, MIST.Settings()), Chosen(trail, Gain(3.0))
    result, misty = renderer(*chosen[::-1]), renderer(chosen[0])
    for item in (result, misty):
        item.frame(view(), SIZE)
    # After the mist, whatever the order they were given in.
    assert np.allclose(result.image("combined"), 3 * misty.image("combined"), rtol=1e-5)
    result.frame(view(), SIZE)
    first, second = trail.frames
    assert first.history is None and second.history.frame.index == 0 and second.index == 1
    assert second.offset != first.offset and np.all(np.isfinite(second.distance))
    assert np.array_equal(second.gbuffer.instance >= 0, second.gbuffer.seen)
    # Another size has no history.
    result.frame(view(), (SIZE[0] + 2, SIZE[1]))
    assert trail.frames[2].history is None


@pytest.mark.parametrize("name", ["combined", "direct", "indirect", "irradiance", "albedo", "normal", "depth", "object"])
def test_every_pass_is_the_one_by_rays(gpu_device, name):
    from rtgi_addon.effects.picture import draw_picture
    result = renderer(passes=(name,))
    for _ in range(4):
        result.frame(view(), SIZE)
    expected = draw_picture(scene(), None, view(), SIZE, shown=name, samples=4)
    off = np.abs(result.image(name) - expected).max(axis=-1) / max(np.median(np.abs(expected)), 1e-3)
    # But at edges, where a pixel is of one surface or of the other.
    assert np.mean(off > 0.02) < 0.06 and np.median(off) < 2e-3
