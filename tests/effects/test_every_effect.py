"""What every effect promises, on the small scene and where there is nothing to see."""

from dataclasses import replace

import numpy as np
import pytest
from picture_stage import SIZE, stage, view

from rtgi_addon.effects import Chosen, registry
from rtgi_addon.effects.base import apply_all
from rtgi_addon.effects.lit import draw_frame
from rtgi_addon.scene import World

NAMES = list(registry())
# What would take seconds a frame here and shows no more.
CHEAPER = {"voxel_reflections": {"resolution": 16}}


def chosen(name):
    """The effect as it is by default, but for what is CHEAPER."""
    return [Chosen(registry()[name], registry()[name].Settings(**CHEAPER.get(name, {})))]


def frozen(frame):
    """``frame`` with arrays that nobody can write to."""
    for array in (frame.light, frame.direct, frame.irradiance, *(array for _, array in frame.gbuffer.items())):
        array.flags.writeable = False
    return frame


@pytest.mark.parametrize("orthographic", [False, True])
@pytest.mark.parametrize("transparent", [False, True])
@pytest.mark.parametrize("name", NAMES)
def test_it_makes_a_picture_and_writes_to_nothing(name, orthographic, transparent):
    frame = frozen(draw_frame(stage(), None, view(orthographic=orthographic), SIZE, transparent=transparent))
    after = apply_all(frame, None, chosen(name)).light
    assert after.dtype == np.float32 and after.shape == frame.light.shape
    assert np.all(np.isfinite(after)) and np.all(after >= 0) and np.all(after[..., 3] <= 1 + 1e-6)


@pytest.mark.parametrize("name", NAMES)
def test_it_is_the_same_again_with_any_number_of_threads(name):
    found = [apply_all(draw_frame(stage(), None, view(), SIZE, threads=threads), None, chosen(name)).light for threads in (1, 3, 3)]
    assert np.array_equal(found[0], found[1]) and np.array_equal(found[1], found[2])


@pytest.mark.parametrize("name", NAMES)
def test_nothing_to_see_is_no_trouble(name):
    for scene in (replace(stage(), instances=()), replace(stage(), instances=(), world=World.constant(0.0))):
        frame = draw_frame(scene, None, view(), SIZE)
        assert np.all(np.isfinite(apply_all(frame, None, chosen(name)).light))
    tiny = apply_all(draw_frame(stage(), None, view(), (1, 1)), None, chosen(name)).light
    assert tiny.shape == (1, 1, 4) and np.all(np.isfinite(tiny))


@pytest.mark.parametrize("name", NAMES)
def test_it_goes_on_from_the_sample_before(name):
    history = None
    for index in range(3):
        frame = draw_frame(stage(), None, view((0.1 * index, -3.4, 2.2)), SIZE, index=index, history=history)
        after = apply_all(frame, None, chosen(name))
        assert np.all(np.isfinite(after.light))
        history = after.history
