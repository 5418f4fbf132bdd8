"""Pictures on the CPU: averaged as the preview's, pass by pass, and after effects."""

from dataclasses import replace

import numpy as np
import pytest
from picture_stage import SIZE, stage, view

from rtgi_addon.effects import Chosen, get
from rtgi_addon.effects.frame import NOWHERE
from rtgi_addon.effects.lit import draw_frame
from rtgi_addon.effects.passes import NOT_AVERAGED, pass_of
from rtgi_addon.effects.picture import draw_picture
from rtgi_addon.preview.settings import PASSES
from rtgi_addon.scene import Mist

MIST = get("mist")


@pytest.mark.parametrize("orthographic", [False, True])
def test_passes_fit_together(orthographic):
    frame = draw_frame(stage(), None, view(orthographic=orthographic), SIZE)
    image, seen = {name: pass_of(frame, name) for name in PASSES}, frame.gbuffer.seen
    emission = np.where(image["object"][..., :1] == 2, 0.25, 0.0)
    total = image["direct"] + image["indirect"]
    assert np.allclose(image["combined"][seen][:, :3], (total[..., :3] + emission)[seen], atol=1e-6)
    assert np.allclose(image["indirect"][..., :3], image["albedo"][..., :3] * image["irradiance"][..., :3] / np.pi, atol=1e-6)
    assert set(np.unique(image["object"][..., 0])) == {0, 1, 2}
    assert np.all(image["depth"][~seen][:, 0] == np.float32(NOWHERE)) and not image["normal"][~seen].any()
    for name in set(PASSES) - {"combined", "depth"}:
        assert np.array_equal(image[name][..., 3], seen.astype(np.float32)), name


def test_edges_settle_to_coverage():
    scene = replace(stage([], 0.0), materials=(stage().materials[0], replace(stage().materials[1])))
    coarse = draw_picture(scene, None, view(), SIZE, samples=64)[..., 0]
    fine = draw_picture(scene, None, view(), (SIZE[0] * 8, SIZE[1] * 8), samples=1)[..., 0]
    assert 0.01 < np.mean((coarse > 0.02) & (coarse < 0.23))
    assert coarse.mean() == pytest.approx(fine.mean(), rel=0.03)


def test_it_is_the_mean_of_its_samples_after_their_effects():
    scene, chosen = replace(stage(), mist=Mist(2.0, 3.0)), [Chosen(MIST, MIST.Settings())]
    one, two = (draw_picture(scene, None, view(), SIZE, samples=samples, effects=chosen) for samples in (1, 2))
    plain = draw_picture(scene, None, view(), SIZE, samples=1)
    first = draw_frame(scene, None, view(), SIZE)
    assert np.allclose(one, MIST.apply(first, None, MIST.Settings()), atol=1e-6) and np.abs(one - plain).max() > 0.05
    assert np.abs(two - one).max() > 0.01 and np.abs(two - one).mean() < 0.05


@pytest.mark.parametrize("name", sorted(NOT_AVERAGED))
def test_passes_without_a_mean_are_those_of_the_first_sample(name):
    assert np.array_equal(draw_picture(stage(), None, view(), SIZE, shown=name, samples=9),
                          pass_of(draw_frame(stage(), None, view(), SIZE), name))


def test_threads_change_nothing():
    one, many = (draw_picture(stage(), None, view(), SIZE, samples=3, threads=threads) for threads in (1, 3))
    assert np.array_equal(one, many)
