"""The irradiance function of reflective shadow maps on the GPU against ``RsmField.irradiance``, relative to the largest irradiance,
and maps that are captured there when a lamp moves."""

from dataclasses import replace

import numpy as np
import pytest
import scene_builders as build
from receivers import directions, drawn, points_in, relative_error, waited

from rtgi_addon.progress import Progress
from rtgi_addon.scene import AreaLight, Instance, Medium, SpotLight, SunLight
from rtgi_addon.techniques.rsm import TECHNIQUE, RsmSettings

# Float sums in another order. A sample on the border of two texels may fall either way: one of some hundred, in few receivers.
TYPICAL, WORST = 2e-5, 0.03
QUICK = {"resolution": 96, "order": 1}
BOX = build.closed_box(albedo=0.6, light_position=(0.2, -0.3, 0.4))
BALL = build.sphere("ball", radius=0.25)
SUN = SunLight("sun", np.float32([0.6, 0.0, -0.8]), np.float32([3.0, 2.0, 1.0]), angle=0.0)


@pytest.fixture(scope="module")
def indirect(gpu_device):
    from rtgi_addon.preview import indirect
    return indirect


def bake(scene, **settings):
    return TECHNIQUE.bake(scene, RsmSettings(**(QUICK | settings)), np.random.default_rng(0), Progress())


def ball_in_the_box(x):
    """BOX with a ball at ``x``."""
    instance = Instance("ball", len(BOX.meshes), build.transform((x, 0.1, 0.3)))
    return replace(BOX, meshes=(*BOX.meshes, BALL), instances=(*BOX.instances, instance))


def lit_by(*lights):
    return replace(build.open_plane(world=0.0, half_size=3.0), lights=lights)


@pytest.mark.parametrize("disk_share", [0.0, 0.4, 1.0])
def test_a_cube_of_maps(indirect, disk_share):
    field = bake(BOX, disk_share=disk_share)
    found = relative_error(indirect.make_indirect(field, BOX), field, points_in(0.95, 2000), directions(2000))
    assert np.quantile(found, 0.98) < TYPICAL and found.max() < WORST


def test_maps_of_several_lamps_and_sizes(indirect):
    scene = lit_by(SUN, build.point_light((0.5, 0.0, 1.0)), build.point_light((20.0, 0.0, 30.0), 50.0))
    field = bake(scene)
    assert len({item.view.resolution for item in field.maps}) > 1
    points = points_in(2.0, 2000) + np.float32([0, 0, 2.1])
    found = relative_error(indirect.make_indirect(field, scene), field, points, directions(2000))
    assert np.quantile(found, 0.98) < TYPICAL and found.max() < WORST


def test_fewer_samples_have_the_same_mean(indirect):
    field = bake(BOX)
    points, normals = points_in(0.9, 4000), directions(4000)
    made = indirect.make_indirect(field, BOX, samples=32)
    from rtgi_addon.preview.indirect.base import irradiance
    found, expected = irradiance(made, points, normals), field.irradiance(points, normals)
    assert not np.allclose(found, expected, rtol=1e-3)
    assert found.mean() == pytest.approx(expected.mean(), rel=0.02)


def test_shadow_rays_are_left_to_the_grids(indirect):
    field = bake(BOX, visibility=True, resolution=32, samples=64)
    made = indirect.make_indirect(field, BOX)
    assert made.program.name == "indirect_probes"


def test_more_maps_than_a_row_of_the_sheet_holds():
    from rtgi_addon.preview.indirect.rsm import Sheet
    sheet = Sheet([2048, 1024, 2048, 512, 2048, 2048])
    assert sheet.places == [(0, 0), (2048, 0), (3072, 0), (0, 2048), (512, 2048), (2560, 2048)]
    assert sheet.size == (5120, 4096)


AREA = AreaLight("area", np.float32([0, 0, 2]), np.float32([0.3, 0, 0]), np.float32([0, 0.2, 0]), np.float32([0, 0, -1]),
                 np.float32([4, 5, 6]))
SPOT = SpotLight("spot", np.float32([-1, 0, 1.5]), np.float32([0.3, 0, -1]) / np.float32(1.0440307), np.float32([5, 5, 5]),
                 cone_angle=1.0, blend=0.2)


@pytest.mark.parametrize("lights", [(build.point_light((0.4, 0.2, -0.3), (1, 2, 3)),), (SUN,), (AREA,), (SPOT, SUN)],
                         ids=["point", "sun", "area", "spot and sun"])
def test_moved_lamps_are_captured_on_the_gpu(indirect, lights):
    from rtgi_addon.preview.indirect.base import irradiance
    before = BOX if isinstance(lights[0], type(BOX.lights[0])) else lit_by(build.point_light((0.0, 0.0, 1.0)))
    after = replace(before, lights=lights)
    field = bake(before)
    made = indirect.make_indirect(field, before, samples=2000)
    assert made.capture(drawn(after)) and made.error is None
    points = points_in(0.9, 2000) + np.float32([0, 0, 0.0 if before is BOX else 0.95])
    normals = directions(2000)
    # All texels, of maps traced by rays: the samples' mean, but for noise and for texels on edges.
    expected = bake(after, every_texel=True).irradiance(points, normals)
    found = irradiance(made, points, normals)
    assert found.mean(axis=0) == pytest.approx(expected.mean(axis=0), rel=2e-3)
    assert np.sqrt(np.mean((found - expected) ** 2)) < 0.05 * expected.mean()


FOG = Medium("fog", np.full(3, 0.1), np.array([0.2, 0.4, 0.8]))


def test_media_take_of_the_light_between_maps_and_receivers(indirect):
    scene = replace(BOX, media=(FOG,))
    field, clear = bake(scene), bake(BOX)
    points, normals = points_in(0.95, 2000), directions(2000)
    made = indirect.make_indirect(field, scene)
    found = relative_error(made, field, points, normals)
    assert np.quantile(found, 0.98) < TYPICAL and found.max() < WORST
    assert field.irradiance(points, normals).mean() < 0.7 * clear.irradiance(points, normals).mean()
    # Captured, as live maps are, they come and go with the scene.
    from rtgi_addon.preview.indirect.base import irradiance
    for shown, expected in ((scene, field), (BOX, clear), (scene, field)):
        assert made.capture(drawn(shown)) and made.error is None
        assert irradiance(made, points, normals).mean(axis=0) == pytest.approx(expected.irradiance(points, normals).mean(axis=0),
                                                                               rel=0.01)


def test_lamps_that_light_nothing_are_dark(indirect):
    from rtgi_addon.preview.indirect.base import irradiance
    scene = lit_by(build.point_light((0.0, 0.0, 1.0)))
    made = indirect.make_indirect(bake(scene), scene)
    points, normals = points_in(1.0, 100), directions(100)
    assert made.capture(drawn(replace(scene, instances=()))) and not irradiance(made, points, normals).any()
    # A sun along the plane, and no lamp at all.
    for lights in ((), (replace(SUN, direction_world=np.float32([1.0, 0.0, 0.0])),)):
        assert made.capture(drawn(replace(scene, lights=lights)))
        assert not irradiance(made, points, normals).any()


def test_moved_objects_are_captured_on_the_gpu(indirect):
    """A ball off the floor: light falls on it elsewhere, which no relighting of the bake knows."""
    from rtgi_addon.preview.indirect.base import irradiance
    before, after = ball_in_the_box(-0.5), ball_in_the_box(0.5)
    made = indirect.make_indirect(bake(before), before, samples=2000)
    assert made.captures and made.capture(drawn(after))
    points, normals = points_in((0.3, 0.9, 0.9), 2000), directions(2000)
    expected = bake(after, every_texel=True).irradiance(points, normals)
    found = irradiance(made, points, normals)
    assert np.sqrt(np.mean((found - expected) ** 2)) < 0.05 * expected.mean()
    stale = bake(before, every_texel=True).irradiance(points, normals)
    assert np.sqrt(np.mean((stale - expected) ** 2)) > 0.1 * expected.mean()


def test_maps_need_no_bake(indirect):
    from rtgi_addon.preview.indirect.base import irradiance
    settings = RsmSettings(**QUICK)
    assert indirect.needs_no_bake(settings) and not indirect.needs_no_bake(replace(settings, visibility=True))
    made = indirect.make_indirect(None, BOX, live=replace(settings, samples=2000))
    points, normals = points_in(0.9, 2000), directions(2000)
    assert not irradiance(made, points, normals).any()
    assert made.capture(drawn(BOX))
    expected = bake(BOX, every_texel=True).irradiance(points, normals)
    found = irradiance(made, points, normals)
    assert found.mean() == pytest.approx(expected.mean(), rel=2e-3)
    assert np.sqrt(np.mean((found - expected) ** 2)) < 0.05 * expected.mean()


def test_grids_with_shadow_rays_follow_on_a_worker(indirect):
    field = bake(BOX, visibility=True, resolution=32, samples=64)
    moved = replace(BOX, lights=(build.point_light((-0.4, 0.2, 0.1)),))
    made = indirect.make_indirect(field, BOX)
    assert made.follow(moved) and waited(made)
    made.close()
