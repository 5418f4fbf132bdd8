"""Light that media scatter by rays of their own: closed forms of all orders of scattering, and no bake at all."""

from dataclasses import replace

import numpy as np
import pytest
import scene_builders as build
from media_scenes import GREY, box, eye, ray, scene_of

from rtgi_addon.effects import Chosen, get
from rtgi_addon.effects.base import apply_all
from rtgi_addon.effects.lit import draw_frame
from rtgi_addon.scene import Medium, Phase, SunLight, World


@pytest.fixture(autouse=True)
def coarse_cache(monkeypatch):
    """Surfaces here are lit evenly."""
    monkeypatch.setattr("rtgi_addon.transport.cache.look.TEXELS", 200)
    monkeypatch.setattr("rtgi_addon.transport.cache.look.RAYS", 16)


@pytest.mark.parametrize("albedo, factor", [(0.5, 1.5656), (0.9, 3.4229)])
def test_a_half_space_is_as_bright_as_chandrasekhar_says(albedo, factor):
    """Isotropic, lit and seen along its normal: H(1) squared times what the first scattering gives, albedo / 8 pi."""
    medium = Medium("half", albedo * GREY, (1 - albedo) * GREY, bounds=box((0, -500, -500), (25, 500, 500)))
    sun = SunLight("sun", np.array([1.0, 0, 0]), np.ones(3))
    found = ray(scene_of([medium], [sun]), samples=8, seen_by=eye((-5, 0, 0)), rays=2, reach=30.0)
    single = albedo / (8 * np.pi)
    assert found[2] == pytest.approx(single, rel=0.02) and found[1] == pytest.approx(0.0, abs=1e-6)
    assert found[0].mean() == pytest.approx(factor * single, rel=0.04)


@pytest.mark.parametrize("phase", [Phase(), Phase(anisotropy=0.8), Phase("MIE", diameter=10.0)])
def test_what_only_scatters_cannot_be_seen_under_an_even_sky(phase):
    """Without a bake, however far forward it scatters."""
    medium = Medium("cloud", 0.8 * np.array([0.5, 1.0, 1.5]), phase=phase, bounds=box((2, -1, -1), (4, 1, 1)))
    found = ray(scene_of([medium], world=0.5), samples=8, rays=1)
    assert found[1].max() < 0.5 and found[0] == pytest.approx([0.5] * 3, rel=0.03)


def test_a_furnace_full_of_fog_is_a_furnace():
    """Surfaces by the surface cache, between two media that scatter differently."""
    fogs = (Medium("one", 0.4 * GREY), Medium("two", 0.3 * GREY, phase=Phase(anisotropy=0.5), bounds=box((-1, -1, -1), (0, 1, 1))))
    scene = replace(build.cube_furnace(albedo=0.5, emission=1.0, resolution=(2, 2, 2)), media=fogs)
    media, found = get("media"), []
    for index in range(4):
        frame = draw_frame(scene, None, eye((0.1, 0.1, 0.1), (-1, 0.2, 0.3)), (1, 1), index=index)
        frame = replace(frame, light=np.float32([[[2, 2, 2, 1]]]))
        found.append(apply_all(frame, None, [Chosen(media, media.Settings(tile=1, rays=1))]).light[0, 0, :3])
    assert np.mean(found, axis=0) == pytest.approx([2.0] * 3, rel=0.02)


def test_any_number_of_threads_gives_the_same_and_a_gpu_leaves_it_to_rays():
    medium = Medium("cloud", 2.0 * GREY, bounds=box((2, -1, -1), (4, 1, 1)))
    scene, media = scene_of([medium], world=0.5, wall=6.0), get("media")
    settings = media.Settings(tile=1, rays=1)
    found = [media.apply(draw_frame(scene, None, eye(width=0.2), (6, 4), threads=threads), None, settings) for threads in (1, 3)]
    assert np.array_equal(*found) and media.has_gpu_half(media.Settings()) and not media.has_gpu_half(settings)
    # Where only lamps are scattered there is nothing for rays to find.
    lamps = media.apply(draw_frame(replace(scene, world=World.constant(0.5)), None, eye(width=0.2), (6, 4)), None,
                        replace(settings, orders="lamps"))
    assert lamps[..., :3].max() < found[0][..., :3].max()
