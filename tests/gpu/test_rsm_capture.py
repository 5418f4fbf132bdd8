"""Shadow maps by rasterization against those by rays: texel by texel, but for edges and coincident surfaces."""

from dataclasses import replace

import lamp_profiles
import numpy as np
import pytest
import scene_builders as build
from room_scenes import quad

from rtgi_addon.scene import (
    AreaLight,
    Channel,
    ClosedMesh,
    Instance,
    Linking,
    Material,
    Medium,
    PointLight,
    SpotLight,
    SunLight,
    Texture,
)
from rtgi_addon.transport.context import LightContext
from rtgi_addon.transport.views.reflective_shadow_map import capture
from rtgi_addon.transport.views.shadow_views import views_of

# Of the scene's extent, of a unit vector, of the largest flux; at grazing angles a float of a texel's place is many of a point's.
POSITION, NORMAL, FLUX = 1e-5, 1e-4, 1e-4
# Texels whose centres lie so near an edge that ray and raster decide differently.
EDGES = 0.004

DOWN = np.float32([0, 0, -1])
LAMPS = {
    "sun": SunLight("sun", np.float32([0.3, 0.2, -1]) / np.float32(np.sqrt(1.13)), np.float32([3, 2, 1])),
    "point": PointLight("point", np.float32([0.1, -0.2, 2.4]), np.float32([3, 2, 1])),
    "spot": SpotLight("spot", np.float32([0.1, -0.2, 2.9]), DOWN, np.float32([3, 2, 1]), 1.2, 0.3),
    # Off the middle, so that no row of texels lies along the floor's edge.
    "area": AreaLight("area", np.float32([0.03, 0.017, 2.8]), np.float32([0.4, 0, 0]), np.float32([0, 0.3, 0]), DOWN,
                      np.float32([3, 2, 1])),
}
# Lamps with nodes: the distance to what is lit is known to the shader only.
LAMPS["fading gobo"] = replace(LAMPS["spot"], profile=replace(lamp_profiles.by_direction(LAMPS["spot"], 0.7),
                                                              by_distance=lamp_profiles.linear().by_distance))
LAMPS["fading beam"] = replace(LAMPS["area"], spread=0.0, profile=replace(lamp_profiles.by_place(),
                                                                          by_distance=lamp_profiles.linear().by_distance))


SMOKE = Medium("smoke", np.float64([0.1, 0.2, 0.3]), np.full(3, 0.2), bounds=ClosedMesh(
    build.cube().vertices_local, build.cube().triangles, build.transform((0.1, 0.0, 1.4), (1.5, 1.4, 0.6))))


def texture(channels=4, extension="REPEAT", interpolation="Linear", srgb=True, dtype=np.uint8, seed=0):
    """Noise, so that a texel taken from the wrong place is seen."""
    pixels = np.random.default_rng(seed).integers(0, 256, (13, 7, channels))
    return Texture("noise", (pixels if dtype == np.uint8 else pixels / 100.0).astype(dtype), srgb, extension, interpolation)


def compare(kernels, scene, resolution=96, edges=EDGES):
    """Capture every view of every lamp both ways, and hold them together; the number of texels that saw something."""
    context = LightContext(scene, 1)
    extent = float(np.linalg.norm(np.ptp(np.array(context.geometry.bounds()), axis=0)))
    seen = 0
    for lamp in range(len(scene.lights)):
        for view in views_of(context, lamp, resolution):
            drawn, traced = kernels.capture(context, view), capture(context, view)
            assert drawn.view is view and drawn.primitive.dtype == np.int32
            same = drawn.primitive == traced.primitive
            both = (drawn.primitive >= 0) & (traced.primitive >= 0)
            # Surfaces that touch are one place: which of them a texel names is nobody's business.
            touching = both & (np.linalg.norm(drawn.position - traced.position, axis=-1) < POSITION * extent)
            assert np.mean(~(same | touching)) <= edges
            hit = same & both
            assert np.abs(drawn.position - traced.position)[hit].max(initial=0) < POSITION * extent
            assert np.abs(drawn.normal - traced.normal)[hit].max(initial=0) < NORMAL
            assert np.abs(drawn.flux - traced.flux)[hit].max(initial=0) <= FLUX * traced.flux.max()
            assert not drawn.flux[drawn.primitive < 0].any() and not drawn.position[drawn.primitive < 0].any()
            seen += int(hit.sum())
    return seen


def room(**replaced):
    """A floor, a smooth sphere and cubes: moved, sheared and mirrored."""
    floor, ball = build.plane("floor", 3.0), build.sphere("ball", 0.5, 2, material_index=1)
    box = build.cube("box", 0.3, material_index=2)
    normals = ball.vertices_local[ball.triangles] / 0.5
    ball = replace(ball, corner_normals_local=normals.astype(np.float32))
    sheared = build.transform((-1.2, 0.8, 0.4), (1.0, 1.5, 0.7))
    sheared[0, 2] = 0.4
    placed = (Instance("floor", 0, np.eye(4)), Instance("ball", 1, build.transform((0.2, 0.1, 1.2), (1.2, 0.8, 1.0))),
              Instance("box", 2, build.transform((1.1, -0.9, 0.5))), Instance("sheared", 2, sheared),
              Instance("mirrored", 2, build.transform((-1.0, -1.1, 0.6), (-1.0, 1.0, 1.0)), {2: 1}))
    scene = build.scene([floor, ball, box], [build.material("a", 0.8), build.material("b", (0.7, 0.2, 0.1)),
                                             build.material("c", (0.1, 0.6, 0.9))])
    return replace(scene, instances=placed, **replaced)


@pytest.mark.parametrize("lamp", LAMPS)
def test_instances_and_smooth_normals_agree_for_every_lamp(gpu_device, lamp):
    assert compare(gpu_device, room(lights=(LAMPS[lamp],))) > 1000


ROLES = {  # fields of the ball, and of the lamp
    "ball casts no shadow": ({"visible_shadow": False}, {}),
    "no ray meets the ball": ({f"visible_{kind}": False for kind in ("camera", "diffuse", "shadow")}, {"casts_shadow": False}),
    "ball is not lit": ({}, {"linking": Linking(receivers=np.arange(5) != 1)}),
    "boxes are not in the way": ({}, {"linking": Linking(blockers=np.arange(5) < 2)}),
    "ball moves in the game": ({"bake": "DYNAMIC"}, {}),
}


@pytest.mark.parametrize("name", ROLES)
def test_maps_show_what_light_meets(gpu_device, name):
    ball, lamp = ROLES[name]
    scene = room(lights=(replace(LAMPS["spot"], **lamp),))
    instances = list(scene.instances)
    instances[1] = replace(instances[1], **ball)
    scene = replace(scene, instances=tuple(instances))
    assert compare(gpu_device, scene) > 1000
    plain, changed = (LightContext(shown, 1) for shown in (room(lights=(LAMPS["spot"],)), scene))
    view = views_of(plain, 0, 64)[0]
    assert np.mean(np.any(capture(plain, view).flux != capture(changed, view).flux, axis=-1)) > 0.01


@pytest.mark.parametrize("extension", ["REPEAT", "EXTEND", "CLIP", "MIRROR"])
@pytest.mark.parametrize("interpolation", ["Linear", "Closest"])
def test_textures_are_read_as_by_cycles(gpu_device, extension, interpolation):
    floor = quad("floor", (-2, -2, 0), (4, 0, 0), (0, 4, 0))
    channel = Channel(np.float32([0.9, 0.8, 0.7]), texture(extension=extension, interpolation=interpolation),
                      uv_transform=np.float32([[1.7, 0.4, -0.6], [-0.3, 2.1, -0.4]]), offset=np.float32([0.05, 0, 0.02]))
    scene = build.scene([floor], [Material("tiles", albedo=channel)], [LAMPS["spot"]])
    # A texel of the map on the border of two texels of a nearest-neighbour image may fall either way.
    if interpolation == "Closest":
        context = LightContext(scene, 1)
        view = views_of(context, 0, 96)[0]
        drawn, traced = gpu_device.capture(context, view), capture(context, view)
        assert np.mean(np.abs(drawn.flux - traced.flux).max(axis=-1) > FLUX * traced.flux.max()) < EDGES
    else:
        assert compare(gpu_device, scene) > 1000


@pytest.mark.parametrize("options", [
    {"channels": 1, "srgb": False}, {"channels": 3}, {"dtype": np.float32, "srgb": False, "channels": 3}])
def test_images_of_every_kind(gpu_device, options):
    floor = quad("floor", (-2, -2, 0), (4, 0, 0), (0, 4, 0))
    scene = build.scene([floor], [Material("tiles", albedo=Channel(texture=texture(**options)))], [LAMPS["spot"]])
    assert compare(gpu_device, scene) > 1000


def test_two_uv_maps_and_vertex_colours(gpu_device):
    floor = quad("floor", (-2, -2, 0), (4, 0, 0), (0, 4, 0))
    rng = np.random.default_rng(2)
    floor = replace(floor, uv_layers={**floor.uv_layers, "second": rng.random((2, 3, 2)).astype(np.float32)},
                    attributes={"paint": rng.random((2, 3, 4)).astype(np.float32)})
    tiles = Material("tiles", albedo=Channel(texture=texture(), uv_layer="second", attribute="paint", texture_channel="g"),
                     alpha=Channel(texture=texture(seed=1), texture_channel="a"), alpha_threshold=0.4)
    under = quad("under", (-3, -3, -1), (6, 0, 0), (0, 6, 0), 1)
    scene = build.scene([floor, under], [tiles, build.material("under", 0.3)], [LAMPS["spot"]])
    assert compare(gpu_device, scene, edges=0.01) > 1000


def test_a_cut_out_lets_light_through_and_coverage_does_on_average(gpu_device):
    leaf, ground = quad("leaf", (-1, -1, 1), (2, 0, 0), (0, 2, 0)), quad("ground", (-4, -4, 0), (8, 0, 0), (0, 8, 0), 1)
    thin = Material("thin", alpha=Channel.of(0.3))
    context = LightContext(build.scene([leaf, ground], [thin, build.material("ground")], [LAMPS["spot"]]), 1)
    view = views_of(context, 0, 128)[0]
    drawn, traced = gpu_device.capture(context, view), capture(context, view)
    share = [np.mean(item.primitive < 2) for item in (drawn, traced)]
    assert 0.05 < share[1] < 0.3
    assert share[0] == pytest.approx(share[1], abs=0.02)
    assert np.mean(drawn.primitive == traced.primitive) < 0.99


def test_both_faces_are_seen_and_turned_to_the_lamp(gpu_device):
    ceiling = quad("ceiling", (-2, -2, 0), (0, 4, 0), (4, 0, 0))
    flipped = Material("flipped", backface_culling=True)
    context = LightContext(build.scene([ceiling], [flipped], [LAMPS["spot"]]), 1)
    drawn = gpu_device.capture(context, views_of(context, 0, 32)[0])
    assert np.all(drawn.primitive[8:24, 8:24] >= 0)
    assert np.allclose(drawn.normal[8:24, 8:24], [0, 0, 1])


def test_a_triangle_beyond_16_bits_keeps_its_number(gpu_device):
    count = 260
    x, y = np.meshgrid(np.arange(count), np.arange(count))
    vertices = np.stack([x / count * 2 - 1, y / count * 2 - 1, np.zeros_like(x)], axis=-1).reshape(-1, 3)
    low = (y[:-1, :-1] * count + x[:-1, :-1]).reshape(-1)
    triangles = np.concatenate([np.stack([low, low + 1, low + count + 1], 1), np.stack([low, low + count + 1, low + count], 1)])
    assert len(triangles) > 2 * 65536
    scene = build.scene([build.mesh("grid", vertices, triangles)], lights=[LAMPS["spot"]])
    assert compare(gpu_device, scene, edges=0.06) > 500


@pytest.mark.parametrize("lamp", LAMPS)
def test_media_take_of_the_light_on_its_way(gpu_device, lamp):
    scene = replace(room(lights=(LAMPS[lamp],)), media=(SMOKE,))
    assert compare(gpu_device, scene) > 1000
    view = views_of(LightContext(scene, 1), 0, 96)[0]
    thick, clear = (capture(LightContext(one, 1), view).flux.sum() for one in (scene, replace(scene, media=())))
    assert 0 < thick < 0.95 * clear
    # A lamp that casts no shadow is not shadowed by them either.
    bright = replace(scene, lights=(replace(LAMPS[lamp], casts_shadow=False),))
    assert compare(gpu_device, bright) > 1000


def test_relit_contexts_share_their_surfaces(gpu_device):
    scene = room(lights=(LAMPS["spot"],))
    context = LightContext(scene, 1)
    first = gpu_device.capture(context, views_of(context, 0, 32)[0])
    moved = context.relit(replace(scene, lights=(replace(LAMPS["spot"], intensity=np.float32([6, 4, 2])),)))
    second = gpu_device.capture(moved, views_of(moved, 0, 32)[0])
    assert np.allclose(second.flux, 2 * first.flux) and first.flux.any()
