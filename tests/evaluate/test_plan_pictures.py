"""What a plan says of pictures: what true rays take to an error, and which columns and slices follow media."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from dim_effect import furnace
from media_scenes import GREY, box, scene_of

from rtgi_addon.evaluate.plan.pictures import PictureLook, look_at_picture, media_detail
from rtgi_addon.jobs.plan_answer import by_rays
from rtgi_addon.scene import DensityGrid, Medium
from rtgi_addon.transport.media.table import MediaTable

LOOK = PictureLook("Eye", (100, 50), 2.0, 1e-4, 0.2)


def plan(look=LOOK, error=0.05, seconds=100.0, met=True):
    """As much of a plan as is asked."""
    chosen = SimpleNamespace(price=SimpleNamespace(seconds=seconds), error=SimpleNamespace(value=0.123))
    return SimpleNamespace(picture=look, target=SimpleNamespace(error=error), chosen=chosen, met=met)


def test_noise_falls_with_the_root_of_the_samples():
    assert LOOK.samples(0.2) == 1 and LOOK.samples(0.1) == 4 and LOOK.samples(0.05) == 16
    assert LOOK.seconds(0.05) == pytest.approx(2.0 + 1e-4 * 5000 * 16)


def test_rays_are_weighed_against_the_bake():
    assert by_rays(plan(None)) == ""
    for seconds, met, said in ((100.0, True, "faster than the bake, and exact"), (10.0, True, "faster"),
                               (9.9, True, "slower than the bake of 9.9 s, which serves every picture"),
                               (9.9, False, "slower than the bake, but exact where that stays off by 12 %")):
        line = by_rays(plan(seconds=seconds, met=met))
        assert "through 'Eye', 100 x 50, is within 5 % after about 16 samples, in some 10 s and without a bake" in line
        assert said in line


def test_a_furnace_is_without_noise(monkeypatch):
    monkeypatch.setattr("rtgi_addon.transport.cache.look.TEXELS", 200)
    scene = furnace()
    found = look_at_picture(scene, 1)
    assert found.camera == "Eye" and found.size == (320, 200) and found.noise < 0.02 and found.per_pixel > 0
    assert look_at_picture(replace(scene, cameras=()), 1) is None


def smoke(cells):
    """A cube of 2 m on a grid of ``cells`` a side, 9 m in front of the eye, that takes 4 a metre."""
    place = np.diag([1.0, 1.0, 1.0, 1.0])
    place[:3, 3] = 0.0, 10.0, 0.0
    return Medium("smoke", absorption=4.0 * GREY, grid=DensityGrid(place, np.ones((cells,) * 3, np.float32)))


def detail(medium):
    """What follows it for a camera at the origin that looks along y, 1,000 pixels over 90 degrees."""
    clip = np.array([[1.0, 0, 0, 0], [0, 2.0, 0, 0], [0, 0, -1, -0.2], [0, 0, -1, 0]])
    pose = np.array([[1.0, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])
    camera = replace(furnace().cameras[0], world_from_camera=pose, clip_from_camera=clip, resolution=(1000, 500))
    return media_detail(replace(scene_of([medium]), cameras=(camera,)), MediaTable([medium]).fillings)


def test_columns_are_as_wide_as_cells_and_slices_no_thicker():
    # 9 m away a pixel is 18 mm wide: a cell of 0.1 m covers 5 of them, one of 0.2 m 11.
    assert detail(smoke(20))[0] == 5 and detail(smoke(10))[0] == 11 and detail(smoke(400))[0] == 1
    # Between 9 m and 11.2 m, the last slice 3.6 times as thick as the mean.
    far = np.linalg.norm([1, 11, 1])
    assert detail(smoke(20))[1] == np.ceil(3.6059 * (far - 9.0) / 0.1)
    # What is the same all over is exact by any columns; slices follow its mean free path.
    even = Medium("fog", absorption=4.0 * GREY, bounds=box((-1, 9, -1), (1, 11, 1)))
    assert detail(even) == (8, np.ceil(3.6059 * (far - 9.0) / 0.25))
    assert detail(replace(even, visible_camera=False)) is None
    assert media_detail(scene_of([even]), MediaTable([even]).fillings) is None
