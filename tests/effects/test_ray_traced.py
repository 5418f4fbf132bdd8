"""Ray-traced light: furnaces and open skies in closed form, the path-traced reference, mirrors, and pixels that take turns."""

import gc
import weakref
from dataclasses import replace

import numpy as np
import pytest
import room_scenes as rooms
import scene_builders as build
from picture_stage import SIZE, stage, view

from rtgi_addon.effects import Chosen, get
from rtgi_addon.effects.lit import SeenSurfaces, draw_frame, lamps_on, light_context, seen_surfaces
from rtgi_addon.effects.picture import draw_pictures
from rtgi_addon.effects.ray_traced import spacing_of
from rtgi_addon.effects.ray_traced.receivers import Pixels, _in_turn
from rtgi_addon.scene import AreaLight, Channel, ClosedMesh, Medium, PointLight, SunLight, World
from rtgi_addon.transport.lights.lamps import LampTable
from rtgi_addon.transport.paths.reference import irradiance_at
from rtgi_addon.transport.surfaces.ggx import surface_look
from rtgi_addon.transport.vectors import dot

EFFECT = get("ray_traced")
INSIDE = (0.0, -0.8, 0.5)


def traced(frame, **settings):
    return EFFECT.apply(frame, None, EFFECT.Settings(**settings))[..., :3]


def dull(material):
    """The material without a glossy layer."""
    return replace(material, specular=Channel.of(0.0))


def metal(roughness=0.0, color=1.0):
    return replace(build.material("metal", color), base_color=Channel.of(color), metallic=Channel.of(1.0),
                   roughness=Channel.of(roughness))


def shown(scene, materials, size=SIZE, position=INSIDE, index=0):
    return draw_frame(replace(scene, materials=tuple(materials)), None, view(position), size, index=index)


@pytest.mark.parametrize("share", [False, True])
def test_in_a_furnace_every_pixel_shows_the_same(share):
    furnace = build.cube_furnace(0.5, 1.0)
    found = traced(shown(furnace, map(dull, furnace.materials)), share=share)
    assert np.allclose(found, 1.0 / (1.0 - 0.5), rtol=0.01)


@pytest.mark.parametrize("roughness", [0.0, 0.4, 0.8])
def test_a_white_metal_in_a_furnace_cannot_be_seen(roughness):
    furnace = build.cube_furnace(0.5, 1.0)
    ball = build.sphere("ball", 0.3, 3, material_index=1)
    scene = build.scene([*furnace.meshes, ball], [*map(dull, furnace.materials), metal(roughness)])
    found = traced(draw_frame(scene, None, view(INSIDE), SIZE), glossy_rays=256, diffuse_rays=1)
    assert found.min() > 1.9 and found.max() < 2.1
    assert found.mean() == pytest.approx(2.0, rel=0.015)


def test_lacquer_that_reflects_too_little_for_rays_loses_none_of_it():
    """Black lacquer of roughness 1 under a uniform sky: all that it shows is its layer, 1.4 % of the light where it is seen
    straight on, 5 % at its rim."""
    black = replace(build.material("lacquer", 0.0), base_color=Channel.of(0.0), roughness=Channel.of(1.0),
                    specular=Channel.of(0.04))
    frame = draw_frame(build.scene([build.sphere("ball", 0.4, 3)], [black], world=1.0), None, view(INSIDE), SIZE)
    seen = frame.gbuffer.seen
    found, look = traced(frame, glossy_rays=64, diffuse_rays=4)[seen], seen_surfaces(frame.gbuffer, frame.view).look
    faint = look.layer[:, 0] < 0.02
    assert 0.2 < faint.mean() < 0.9
    assert np.allclose(found[faint], (look.diffuse + look.layer)[faint], rtol=0.01)
    assert found.mean() == pytest.approx((look.diffuse + look.layer).mean(), rel=0.02)


def test_a_mirror_shows_the_world_behind_the_eye():
    world = np.zeros((64, 128, 3), np.float32)
    world[40:, :, 0], world[:40, :, 1] = 2.0, 0.5
    scene = replace(build.open_plane(0.5), materials=(metal(),), world=World(world))
    frame = draw_frame(scene, None, view(), SIZE)
    seen, found = frame.gbuffer.seen, traced(frame, reflections=1)
    up = frame.directions[seen] * np.float32([1, 1, -1])
    high = up[:, 2] > np.sin((41 / 64 - 0.5) * np.pi)
    assert high.any() and np.allclose(found[seen][high], [2.0, 0.0, 0.0], atol=0.02)


def test_mirrors_in_mirrors_end_after_so_many_reflections():
    furnace = build.cube_furnace(0.5, 1.0)
    scene = replace(furnace, materials=(replace(metal(color=0.5), emission=Channel.of(1.0)),))
    frame = draw_frame(scene, None, view(INSIDE), SIZE)
    # What the last mirror reflects is its mean over all directions: 0.5 head on, and by Schlick's term 0.52 on average.
    for reflections in (1, 3):
        assert 2.0 < traced(frame, reflections=reflections, glossy_rays=64).mean() < 1.0 / (1.0 - (0.5 + 0.5 / 21)) + 0.01


def test_irradiance_is_the_path_references():
    scene = rooms.panel_room(0.5)
    scene = replace(scene, materials=tuple(map(dull, scene.materials)))
    context = light_context(scene)
    frame = draw_frame(context, None, view((0.0, -0.9, 0.2)), SIZE)
    seen = frame.gbuffer.seen
    points, normals = frame.gbuffer.position[seen][:, :3], frame.gbuffer.normal[seen][:, :3]
    expected = irradiance_at(context, points, normals, 512)
    albedo = frame.gbuffer.albedo[seen][:, :3]
    found = traced(frame, diffuse_rays=256, share=False)[seen] - frame.gbuffer.emission[seen][:, :3]
    off = np.sqrt(np.mean((found - albedo * expected.mean / np.pi) ** 2) / np.mean((albedo * expected.mean / np.pi) ** 2))
    assert off < 0.06
    assert found.mean() == pytest.approx((albedo * expected.mean / np.pi).mean(), rel=0.01)


def test_sharing_lowers_noise_and_changes_no_mean():
    scene = build.closed_box(0.7, light_position=(0.0, 0.0, 0.6))
    frame = draw_frame(replace(scene, materials=tuple(map(dull, scene.materials))), None, view((0.0, -0.9, 0.2)), (48, 32))
    exact = traced(frame, diffuse_rays=256, share=False)
    raw, shared = (traced(frame, diffuse_rays=4, share=share) for share in (False, True))
    assert np.square(shared - exact).mean() < 0.4 * np.square(raw - exact).mean()
    assert shared.mean() == pytest.approx(exact.mean(), rel=0.02)


def test_pixels_take_turns_where_rays_are_few():
    frame = draw_frame(replace(build.open_plane(0.5), materials=(dull(build.material()),)), None, view(), (48, 32))
    seen = frame.gbuffer.seen
    found = traced(frame, budget=0.001, diffuse_rays=8)
    assert np.allclose(found[seen], 0.5, rtol=1e-3)
    turns = [Pixels.of(replace(frame, index=index), _Surfaces(), 1, 3).chosen for index in range(9)]
    assert np.array_equal(np.sort(np.concatenate(turns)), np.arange(seen.sum()))


class _Surfaces:
    def take(self, rows):
        return self


@pytest.mark.parametrize("spacing", range(1, 9))
def test_every_pixel_of_a_block_has_its_turn(spacing):
    assert sorted(_in_turn(spacing)) == list(range(spacing**2))


def test_a_budget_sets_how_far_apart_rays_are():
    settings = EFFECT.Settings(budget=1.0)
    assert [spacing_of(rays, settings) for rays in (1, 10**6, 4 * 10**6, 5 * 10**6, 10**12)] == [1, 1, 2, 3, 8]
    assert spacing_of(10**12, replace(settings, share=False)) == 1


def test_without_rays_the_picture_is_as_it_was():
    frame = draw_frame(stage(), None, view(), SIZE)
    assert np.array_equal(EFFECT.apply(frame, None, EFFECT.Settings(diffuse_rays=0, glossy_rays=0)), frame.light)


def test_what_media_give_arrives_at_surfaces_and_in_mirrors():
    """A slab of air without end that glows gives 2π·ε·d to what lies below it, and a mirror shows ε·d by the cosine."""
    cube = build.cube()
    slab = Medium("glow", emission=np.array([0.4, 0.2, 0.1]), bounds=ClosedMesh(
        cube.vertices_local, cube.triangles, build.transform((0, 0, 3.5), (400, 400, 0.5))))
    dark = replace(stage([], 0.0), media=(slab,), materials=(stage().materials[0], build.material("ball", 0.0)))
    frame = draw_frame(dark, None, view(), SIZE)
    light = EFFECT.apply(frame, None, EFFECT.Settings(diffuse_rays=64, glossy_rays=0))
    floor = frame.gbuffer.instance == 0
    # The ball hides some of it.
    found = np.quantile(light[floor][:, :3] / frame.gbuffer.albedo[floor][:, :3] * np.pi, 0.8, axis=0)
    assert found == pytest.approx(2 * np.pi * np.array([0.4, 0.2, 0.1]), rel=0.1)
    metal = replace(dark.materials[0], metallic=Channel.of(1.0), roughness=Channel.of(0.0), base_color=Channel.of((1.0, 1.0, 1.0)),
                    albedo=Channel.of((0.0, 0.0, 0.0)))
    mirror = draw_frame(replace(dark, materials=(metal, dark.materials[1])), None, view(), SIZE)
    shown = EFFECT.apply(mirror, None, EFFECT.Settings(diffuse_rays=0, glossy_rays=1))
    rows = (mirror.gbuffer.instance == 0) & (shown[..., 0] > 0)
    cosine = -mirror.directions[rows][:, 2]
    assert np.median(shown[rows][:, 0] * cosine) == pytest.approx(0.4, rel=0.02)


def test_what_is_kept_of_a_scene_goes_with_it():
    context = light_context(stage())
    frame = draw_frame(context, None, view(), SIZE)
    traced(frame, diffuse_rays=1, glossy_rays=0)
    held = weakref.ref(context)
    del context, frame
    gc.collect()
    assert held() is None


DARK = World(np.zeros((1, 1, 3), np.float32))
LAMPS_IN_MIRRORS = [
    AreaLight("panel", np.float32([0.0, 1.6, 0.8]), np.float32([0.8, 0, 0]), np.float32([0, 0, 0.5]), np.float32([0, -1, 0]),
              np.float32([6, 4, 2])),
    PointLight("ball", np.float32([0.2, 1.6, 0.8]), np.float32([2, 2, 1]), 0.5, False),
    SunLight("sun", np.float32([0.1, -0.87, -0.48]) / np.float32(np.linalg.norm([0.1, -0.87, -0.48])), np.float32([3, 3, 3]), 0.5),
]


@pytest.mark.parametrize("lamp", LAMPS_IN_MIRRORS, ids=lambda lamp: lamp.name)
def test_a_mirror_shows_a_wide_lamp_as_it_shines(lamp):
    """In a smooth metal a lamp is its own radiance at every pixel whose mirrored ray meets it, without single bright pixels."""
    frame = draw_frame(replace(build.open_plane(0.5), materials=(metal(),), lights=(lamp,), world=DARK), None, view(), (48, 32))
    seen = frame.gbuffer.seen
    found = traced(frame, reflections=1, glossy_rays=8, diffuse_rays=0)[seen]
    up = (frame.directions * np.float32([1, 1, -1]))[seen]
    met = LampTable((lamp,)).meet(0, frame.gbuffer.position[seen][:, :3], up)
    level, inside = float(met.radiance.max()), met.density > 0
    assert 10 < inside.sum() < 0.5 * inside.size
    # Nothing is blurred but what rounding moves across the lamp's outline.
    off = np.abs(found - met.radiance).max(axis=1) / level
    assert np.mean(off < 1e-3) > 0.99
    assert found.max() < 1.001 * level


@pytest.mark.parametrize("roughness", [0.15, 0.35])
def test_what_is_met_and_what_is_sampled_of_lamps_add_up(roughness):
    """Many points on the lamp say what rough mirrors reflect of it, too: the means agree."""
    scene = replace(build.open_plane(0.5), materials=(metal(roughness),), lights=tuple(LAMPS_IN_MIRRORS), world=DARK)
    context = light_context(scene)
    expected = draw_frame(context, None, view(), (16, 12), lamp_points=512).direct[..., :3]
    frames = [draw_frame(context, None, view(), (16, 12), index=index) for index in range(16)]
    found = np.mean([traced(frame, glossy_rays=8, reflections=1, diffuse_rays=0) for frame in frames], axis=0)
    assert found.mean() == pytest.approx(expected.mean(), rel=0.02)
    # By points on lamps alone single samples are far off where the metal is smooth.
    once = traced(frames[0], glossy_rays=8, reflections=1, diffuse_rays=0)
    if roughness < 0.2:
        assert np.square(once - expected).mean() < 0.2 * np.square(frames[0].direct[..., :3] - expected).mean()


@pytest.mark.parametrize("diffuse_rays, budget", [(2, 0.5), (8, 0.001), (0, 0.5)])
def test_a_picture_for_it_alone_is_the_same(diffuse_rays, budget):
    """Frames that nobody else asks for lack what it replaces: light of lamps that mirrored rays meet, and the field's."""
    scene = replace(build.open_plane(0.5), materials=(metal(0.1),), lights=tuple(LAMPS_IN_MIRRORS))
    chosen = [Chosen(EFFECT, EFFECT.Settings(diffuse_rays=diffuse_rays, budget=budget))]
    alone, beside = (draw_pictures(scene, None, view(), (24, 16), shown=shown, samples=2, effects=chosen).pictures["combined"]
                     for shown in (("combined",), ("combined", "direct")))
    np.testing.assert_allclose(alone, beside, rtol=1e-5, atol=1e-6)
    assert alone[..., :3].max() > 1.0


def test_mirrors_in_mirrors_show_highlights_of_lamps():
    """A mirror opposite a rough metal: what it shows of that is what the metal looks like from the mirrored eye."""
    floor = build.plane("floor", 4.0)
    wall = build.plane("wall", 4.0, material_index=1)
    lamp = PointLight("lamp", np.float32([0.4, -0.2, 1.0]), np.float32([2, 2, 2]), 0.1)
    scene = build.scene([floor, wall], [metal(0.45), metal()], [lamp], 0.0)
    upright = np.float32([[1, 0, 0, 0], [0, 0, -1, 1.5], [0, 1, 0, 0], [0, 0, 0, 1]])
    scene = replace(scene, instances=(scene.instances[0], replace(scene.instances[1], world_from_local=upright)))
    eye = view((0.0, -1.2, 1.2))
    frame = draw_frame(scene, None, eye, (24, 16))
    found = traced(frame, glossy_rays=256, diffuse_rays=0, reflections=2)
    shown = frame.gbuffer.instance == 1
    towards = frame.directions * np.float32([1, -1, 1])
    # Follow the mirrored rays to the floor by hand.
    start = frame.gbuffer.position[..., :3]
    with np.errstate(divide="ignore", invalid="ignore"):
        places = start - towards * (start[..., 2:] / towards[..., 2:])
    rows = shown & (towards[..., 2] < -0.1) & np.all(np.abs(places[..., :2]) < 1.4, axis=-1)
    assert rows.sum() > 10
    points, back = places[rows], -towards[rows]
    normals = np.tile(np.float32([0, 0, 1]), (len(points), 1))
    color = np.ones_like(points)
    ones = np.ones(len(points), np.float32)
    look = surface_look(0 * color, color, ones, 0.45 * ones, 0.04 * ones, dot(normals, back))
    surfaces = SeenSurfaces(points, normals, normals, back, look)
    expected = lamps_on(light_context(scene), surfaces, np.zeros(len(points), np.int64), 0, 256, frozenset())[:, :3]
    assert found[rows].mean() == pytest.approx(expected.mean(), rel=0.05)
