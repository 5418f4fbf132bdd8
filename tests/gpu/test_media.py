"""Media on the GPU against the effect's numpy: the same frame, fog and boxes and grids, every phase function; and the light of
lamps on surfaces that stand in media."""

from dataclasses import replace

import numpy as np
import pytest
import scene_builders as build
from effect_frames import drawn_frame
from picture_stage import SIZE, stage, view

from rtgi_addon.effects import EFFECT_PASSES, Chosen, get
from rtgi_addon.effects.base import apply_all
from rtgi_addon.effects.lit import draw_frame
from rtgi_addon.numerics import sh
from rtgi_addon.scene import ClosedMesh, DensityGrid, Medium, Phase, PointLight, SunLight
from rtgi_addon.techniques.base import Field

MEDIA = get("media")
CUBE = build.cube()
LAMP = PointLight("lamp", np.float32([0.3, 1.5, 1.8]), np.float32([3, 2, 1]))
WITHIN = replace(LAMP, position_world=np.float32([0.5, 0.2, 0.9]))
SUN = SunLight("sun", np.array([0.3, 0.2, -1.0]) / np.linalg.norm([0.3, 0.2, -1.0]), np.float32([1, 2, 3]), scattered=0.5)


class Bright(Field):
    """Brighter upwards, and brighter at one end than at the other."""

    technique = "bright"
    params, stats = {}, {}

    def irradiance(self, points, normals):
        """See Field."""
        return np.full((len(points), 3), 0.4, np.float32)

    def radiance_sh(self, points, order=2):
        """See Field."""
        directions, weights = sh.quadrature(4)
        one = sh.project(directions, (1.0 + 0.5 * directions[:, 2:]) * np.float32([[0.3, 0.2, 0.1]]), weights, order)
        return (one[None] * (1.0 + 0.1 * points[:, :1, None])).astype(np.float32)

    def arrays(self):
        """See Field."""
        return {}

    def grids(self):
        """See Field."""
        return ()


def box(*matrix):
    return ClosedMesh(CUBE.vertices_local, CUBE.triangles, build.transform(*matrix))


def smoke(colored):
    rng = np.random.default_rng(4)
    matrix = build.transform((0.1, 0, 0.9), (0.8, 0.7, 0.8))
    scattering = rng.random((3, 4, 5, 3), np.float32) if colored else None
    density = np.ones((3, 4, 5), np.float32) if colored else rng.random((3, 4, 5), np.float32)
    return Medium("smoke", np.float64([1.0, 0.8, 0.5]), np.full(3, 0.3), np.full(3, 0.1), Phase(anisotropy=0.3), None,
                  DensityGrid(matrix, density, scattering, emission=scattering))


FOG = Medium("fog", np.full(3, 0.08), np.array([0.02, 0.04, 0.08]), phase=Phase(anisotropy=0.5))
HAZE = Medium("haze", np.full(3, 0.2), np.full(3, 0.1), np.array([0.0, 0.05, 0.1]), Phase("MIE", diameter=8.0),
              box((0.2, 0.1, 0.7), (0.9, 0.6, 0.7)))
CASES = {
    "fog": ([FOG], [LAMP]), "box": ([HAZE], [SUN, LAMP]), "several": ([FOG, HAZE], [LAMP]),
    "smoke": ([smoke(False)], [LAMP]), "coloured smoke": ([smoke(True)], []),
    "sea": ([replace(FOG, phase=Phase("FOURNIER_FORAND"))], [LAMP]),
    "draine": ([replace(FOG, phase=Phase("DRAINE", anisotropy=0.6, alpha=2.0))], [LAMP]),
    "lamp within": ([FOG, HAZE], [WITHIN]),
    "lamp within smoke": ([smoke(False)], [WITHIN]),
    "hidden": ([HAZE, replace(FOG, visible_camera=False)], [LAMP]),
}


def renderer(scene, field, settings=None, passes=("combined", *EFFECT_PASSES), **more):
    from rtgi_addon.preview.renderer import PreviewRenderer
    from rtgi_addon.preview.settings import PreviewSettings
    chosen = [] if settings is None else [Chosen(MEDIA, settings)]
    return PreviewRenderer(scene, field, PreviewSettings(shadow_resolution=512, **more), passes, effects=chosen)


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("orthographic", [False, True])
def test_both_halves_make_the_same_of_a_frame(gpu_device, case, orthographic):
    media, lamps = CASES[case]
    scene = replace(stage(lamps, 0.3), media=tuple(media))
    settings, seen = MEDIA.Settings(tile=3, slices=24), view(orthographic=orthographic)
    # An effect is given its field; the surfaces' light is no matter here.
    result, plain = renderer(scene, None, settings), renderer(scene, None)
    half = result._halves[0]
    half.draw = with_field(half.draw)
    for item in (result, plain):
        item.frame(seen, SIZE)
    frame = drawn_frame(plain, plain.image("combined"), seen)
    expected = MEDIA.apply(frame, Bright(), settings)
    for name, image in {"combined": expected, **frame.passes}.items():
        off = np.abs(result.image(name) - image)[..., :3].max(axis=-1)
        scale = max(float(np.abs(image[..., :3]).mean()), 1e-3)
        # Shadow maps of so many texels blur shadows' edges, and lamps' light through grids is marched.
        assert np.median(off) < 2e-3 * scale, name
        assert off.mean() < 0.02 * scale, name
    assert np.abs(expected - frame.light).max() > 0.01
    # Or the half would refer to itself.
    del half.draw


def with_field(draw):
    """``draw`` of a half, whose frames have the field Bright."""
    bright = Bright()
    return lambda frame: draw(replace(frame, field=bright))


@pytest.mark.parametrize("tile,slices", [(1, 4), (8, 64), (64, 7)])
def test_any_volume_will_do(gpu_device, tile, slices):
    scene = replace(stage([LAMP], 0.3), media=(FOG, HAZE))
    settings = MEDIA.Settings(tile=tile, slices=slices, orders="lamps")
    result, plain = renderer(scene, None, settings), renderer(scene, None)
    for _ in range(2):
        for item in (result, plain):
            item.frame(view(), SIZE)
    frame = replace(drawn_frame(plain, plain.image("combined"), view()), index=1)
    assert np.isfinite(result.image("combined")).all() and not result.image("volume_indirect")[..., :3].any()
    left = MEDIA.apply(replace(frame, index=0), None, settings) is not None and frame.passes["transmittance"]
    assert np.abs(result.image("transmittance") - left)[..., :3].mean() < 0.02


def test_a_volume_that_no_gpu_takes_has_larger_tiles(gpu_device):
    from rtgi_addon.preview.effects.media import fitting_tile
    assert fitting_tile((320, 180), 2, 64) == 2 and fitting_tile((1920, 1080), 8, 64) == 8
    assert fitting_tile((1920, 1080), 3, 96) == 5 and fitting_tile((16384, 16), 1, 64) == 10


def test_a_mesh_that_is_no_box_is_voxels(gpu_device):
    ball = build.sphere("ball", 0.7, 3)
    medium = Medium("ball", absorption=np.full(3, 1.5), bounds=ClosedMesh(ball.vertices_local, ball.triangles,
                                                                         build.transform((0, 0, 0.7))))
    scene = replace(stage([], 0.5), media=(medium,))
    settings = MEDIA.Settings(tile=1)
    result = renderer(scene, None, settings)
    result.frame(view(), SIZE)
    frame = draw_frame(scene, None, view(), SIZE)
    MEDIA.apply(frame, None, settings)
    off = np.abs(result.image("transmittance") - frame.passes["transmittance"])[..., 0]
    assert frame.passes["transmittance"][..., 0].min() < 0.35 and off.mean() < 0.01


@pytest.mark.parametrize("case", ["box", "several", "smoke"])
def test_lamps_reach_surfaces_through_what_media_leave(gpu_device, case):
    media, lamps = CASES[case]
    scene = replace(stage(lamps, 0.0), media=tuple(media))
    through, clear = renderer(scene, None, passes=("direct",)), renderer(replace(scene, media=()), None, passes=("direct",))
    for item in (through, clear):
        item.frame(view(), SIZE)
    expected = draw_frame(scene, None, view(), SIZE).direct
    off = np.abs(through.image("direct")[..., :3] - expected[..., :3]).max(axis=-1)
    assert np.abs(clear.image("direct") - through.image("direct")).max() > 0.02
    assert np.median(off) < 2e-3 and np.mean(off > 0.02) < 0.06


def test_media_come_go_and_change_without_a_new_renderer(gpu_device):
    scene = stage([LAMP], 0.3)
    result, settings = renderer(scene, None, MEDIA.Settings(), passes=("combined",)), MEDIA.Settings()
    result.frame(view(), SIZE)
    plain = result.image("combined")
    assert not result._halves
    result.update(replace(scene, media=(FOG,)))
    result.frame(view(), SIZE)
    foggy = result.image("combined")
    result.update(replace(scene, media=(replace(FOG, scattering=np.full(3, 0.5)),)))
    result.frame(view(), SIZE)
    assert np.abs(foggy - plain).max() > 0.02 and np.abs(result.image("combined") - foggy).max() > 0.02
    result.update(scene)
    result.frame(view(), SIZE)
    assert np.array_equal(result.image("combined"), plain) and settings == MEDIA.Settings()


def test_smoke_without_any_surface_is_drawn(gpu_device):
    scene = replace(stage([LAMP], 0.1), instances=(), media=(HAZE,))
    result = renderer(scene, None, MEDIA.Settings(tile=2))
    result.frame(view(), SIZE)
    frame = draw_frame(scene, None, view(), SIZE)
    MEDIA.apply(frame, None, MEDIA.Settings(tile=2))
    assert frame.passes["volume_direct"][..., :3].max() > 0.01
    assert np.allclose(result.image("volume_direct"), frame.passes["volume_direct"], atol=2e-3)


def test_a_moving_view_goes_on_from_the_light_before_in_both_halves(gpu_device):
    scene = replace(stage([LAMP], 0.3), media=(HAZE,))
    settings = MEDIA.Settings(tile=2, slices=16)
    result, plain, history = renderer(scene, None, settings), renderer(scene, None), None
    for step in range(4):
        seen = view((0.2 * step, -3.4, 2.2))
        for item in (result, plain):
            item.frame(seen, SIZE)
        frame = replace(drawn_frame(plain, plain.image("combined"), seen), history=history)
        history = apply_all(frame, None, [Chosen(MEDIA, settings)]).history
        for name in ("volume_direct", "volume_indirect"):
            expected, found = frame.passes[name][..., :3], result.image(name)[..., :3]
            assert np.abs(found - expected).mean() < 0.02 * expected.mean(), (name, step)
    alone = drawn_frame(plain, plain.image("combined"), seen)
    MEDIA.apply(alone, None, settings)
    # The sample before is in it, and a lamp that moved leaves nothing of it.
    assert np.abs(alone.passes["volume_direct"] - frame.passes["volume_direct"]).mean() > 0.02 * expected.mean()
    moved = replace(scene, lights=(replace(LAMP, position_world=np.float32([-0.3, 1.2, 1.8])),))
    result.update(moved)
    result.frame(seen, SIZE)
    fresh = renderer(moved, None, settings)
    fresh.frame(seen, SIZE)
    assert np.array_equal(fresh.image("combined"), result.image("combined"))
