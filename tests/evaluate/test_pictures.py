"""Pictures of effects held to a reference: figures against known ones, by an effect that is wrong by a known amount in a furnace of
which every pixel is known."""

import numpy as np
import pytest
from dim_effect import LEVEL, SIZE, Dim, DimSettings, field_of, furnace, truth

from rtgi_addon import effects
from rtgi_addon.effects import validate_settings
from rtgi_addon.effects.base import STAGES
from rtgi_addon.evaluate.pictures import (
    LOOKED_AT,
    WITHOUT,
    PictureYard,
    charted,
    fitted,
    picture_error,
    picture_noise,
    picture_size,
    sweep_of,
)


@pytest.fixture
def dim(monkeypatch):
    """The stand-in, known under its name."""
    effect = Dim()
    monkeypatch.setattr(effects, "registry", lambda: {"dim": effect})
    monkeypatch.setattr("rtgi_addon.evaluate.pictures.registry", lambda: {"dim": effect})
    return effect


def test_the_references_noise_is_in_no_error():
    exact = np.full((120, 160, 3), LEVEL)
    noisy = exact + 0.5 * np.random.default_rng(1).standard_normal((2, *exact.shape))
    for share in (1.3, 0.8):
        error, bias = picture_error(share * exact, noisy)
        assert error == pytest.approx(abs(share - 1), abs=0.01) and bias == pytest.approx(share - 1, abs=0.005)
    # Of none there is no more left than the square of the noise over the root of the number of values.
    assert picture_error(exact, noisy)[0] < 2 * 0.25 / exact.size**0.25
    assert picture_noise(noisy) == pytest.approx(0.25 / np.sqrt(2), rel=0.02)


def test_error_bias_and_noise_are_those_of_the_effect(dim):
    scene = furnace()
    yard = PictureYard(scene, truth(0.0), SIZE, "exact", 1)
    points = [yard.measure(dim, settings, field_of(scene)) for settings in sweep_of(dim, 640)]
    assert [point.label for point in points] == [WITHOUT, "share 0.5", "defaults", "share 1, noise 0.4"]
    assert [point.default for point in points] == [False, False, True, False]
    for point, share in zip(points, (1.0, 0.5, 0.9), strict=False):
        assert [step.samples for step in point.steps] == list(LOOKED_AT)
        for step in point.steps:
            assert step.error == pytest.approx(1 - share, abs=1e-3) and step.bias == pytest.approx(share - 1, abs=1e-3)
        assert point.coarse == pytest.approx(1 - share, abs=1e-3)
        assert all(0 < first.seconds < second.seconds for first, second in zip(point.steps, point.steps[1:], strict=False))
    for step in points[-1].steps:
        assert step.error == pytest.approx(0.2 / np.sqrt(step.samples), rel=0.1)
    assert points[-1].coarse == pytest.approx(points[-1].last.error / 4, rel=0.2)


def test_what_lights_surfaces_itself_has_no_bake(dim):
    scene = furnace()
    dim.stage = "light"
    yard, field = PictureYard(scene, truth(0.1), SIZE, "noisy", 1), field_of(scene)
    assert yard.measure(dim, None, field).last.error < 0.02 and not dim.fields
    # Without a bake surfaces show what they give alone, half of the light.
    assert yard.measure(dim, DimSettings(share=1.0), field).last.error == pytest.approx(0.5, abs=0.01)
    assert set(dim.fields) == {None}
    reference = yard.reference()
    assert reference["noise"] == pytest.approx(0.05 / np.sqrt(2), rel=0.1) and reference["floor"] < reference["noise"]


def test_sizes_keep_the_cameras_proportions():
    assert fitted((1920, 1080), 160) == (160, 90) and fitted((50, 400), 160) == (20, 160) and fitted((1, 4000), 160) == (1, 160)
    assert picture_size(furnace().cameras[0]) == (160, 100)


@pytest.mark.parametrize("name", list(effects.registry()))
def test_sweeps_are_of_what_a_user_may_set_with_the_defaults_among_them(name):
    effect = effects.get(name)
    for pixels in (1, 160 * 90, 4000 * 3000):
        sweep = effect.sweep(pixels)
        for settings in sweep:
            validate_settings(settings)
        assert len(set(sweep)) == len(sweep) and (not sweep or effect.Settings() in sweep)
    # What makes a picture another on purpose has no right picture to be held to.
    assert bool(sweep) == (name not in {"mist", "stylized"}) and effect.stage in STAGES


def test_only_effects_with_something_to_do_are_charted():
    assert [effect.name for effect in charted(furnace())] == ["ray_traced", "screen_reflections", "voxel_reflections"]
    assert charted(furnace(), ["media", "mist"]) == []
