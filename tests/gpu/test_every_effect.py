"""Every effect in the preview: its half on the GPU makes the picture that its numpy makes of the same frame."""

import numpy as np
import pytest
from effect_frames import drawn_frame
from picture_stage import SIZE, stage, view

from rtgi_addon.effects import Chosen, registry
from rtgi_addon.preview.effects import has_shader, make_halves


@pytest.mark.parametrize("name", list(registry()))
def test_the_preview_shows_what_numpy_makes_of_the_same_frame(gpu_device, name):
    from rtgi_addon.preview.effects.on_cpu import OnCpu
    from rtgi_addon.preview.effects.pixel import PixelHalf
    from rtgi_addon.preview.renderer import PreviewRenderer
    effect = registry()[name]
    if not effect.concerns(stage()):
        pytest.skip("what has nothing to do on the stage is tested where it is")
    chosen = Chosen(effect, effect.Settings())
    kind = type(make_halves((chosen,))[0])
    if kind not in (OnCpu, PixelHalf):
        pytest.skip("a half with passes of its own is tested where it is")
    assert (kind is PixelHalf) == has_shader(name)
    plain, result = (PreviewRenderer(stage(), passes=("combined",), effects=effects) for effects in ((), (chosen,)))
    for item in (plain, result):
        item.frame(view(), SIZE)
    expected = effect.apply(drawn_frame(plain, plain.image("combined"), view()), None, chosen.settings)
    assert np.abs(result.image("combined") - expected).max() < 2e-3
