"""Screen-space reflections: mirrored cameras, what is on screen in closed form, both searches against each other and a walk by
hand, furnaces, and the fallback."""

from dataclasses import replace

import numpy as np
import pytest
import scene_builders as build
from media_scenes import Uniform, box
from picture_stage import SIZE, stage, view

from rtgi_addon.effects import Chosen, get, notes_of
from rtgi_addon.effects.frame import NOWHERE
from rtgi_addon.effects.lit import draw_frame, light_context
from rtgi_addon.effects.screen_reflections import confidence_of, roughness_fade
from rtgi_addon.effects.screen_reflections.pyramid import atlas_places, min_pyramid
from rtgi_addon.effects.screen_reflections.rays import screen_rays
from rtgi_addon.effects.screen_reflections.search import MOVED, Screen, march, search
from rtgi_addon.scene import Channel, Medium, World
from rtgi_addon.transport.views.camera import CameraView

EFFECT = get("screen_reflections")
DEFAULT = EFFECT.Settings()
ROOM = box((-80, -80, -5), (80, 80, 20))


def metal(roughness=0.0, color=1.0):
    return replace(build.material("metal", color), base_color=Channel.of(color), metallic=Channel.of(1.0),
                   roughness=Channel.of(roughness))


def glowing(strength=1.0, color=0.0):
    return replace(build.material("glow", color, strength), specular=Channel.of(0.0))


def looking(position, pitch, size, field_of_view=40.0):
    """An eye that looks along +y, turned down by ``pitch`` [°]; the field of view is the picture's height."""
    angle, half = np.radians(pitch), np.tan(np.radians(field_of_view) / 2)
    back, right = np.array([0.0, -np.cos(angle), np.sin(angle)]), np.array([1.0, 0.0, 0.0])
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = np.stack([right, np.cross(back, right), back], axis=1), position
    near, far = 0.05, 100.0
    clip = np.array([[size[1] / size[0] / half, 0, 0, 0], [0, 1 / half, 0, 0],
                     [0, 0, -(far + near) / (far - near), -2 * far * near / (far - near)], [0, 0, -1, 0]])
    return CameraView(pose, clip)


def floor_and_wall(distance=6.0, size=60.0):
    """A mirror for a floor and a glowing wall ``distance`` before the eye."""
    scene = build.scene([build.plane("floor", size), build.plane("wall", size, material_index=1)], [metal(), glowing()], [], 0.0)
    upright = np.float32([[1, 0, 0, 0], [0, 0, -1, distance], [0, 1, 0, 0], [0, 0, 0, 1]])
    return replace(scene, instances=(scene.instances[0], replace(scene.instances[1], world_from_local=upright)))


def mirrored(frame):
    """Points, mirrored directions (n, 3) and rows (n,) of the pixels that show the first instance."""
    rows = np.flatnonzero(frame.gbuffer.instance.ravel() == 0)
    targets = (getattr(frame.gbuffer, name).reshape(-1, 4) for name in ("position", "geometry"))
    points, normals = (target[rows, :3].astype(np.float64) for target in targets)
    towards = frame.directions.reshape(-1, 3)[rows].astype(np.float64)
    return points, towards - 2.0 * np.sum(towards * normals, axis=1, keepdims=True) * normals, rows


def screen_of(frame):
    return Screen(min_pyramid(frame.depth), frame.gbuffer.geometry[..., :3])


@pytest.mark.parametrize("shape", [(1, 1), (7, 5), (16, 9), (13, 30)])
def test_a_pyramid_has_the_least_of_every_block_also_of_odd_sizes(shape):
    depth = np.random.default_rng(0).random(shape).astype(np.float32)
    levels = min_pyramid(depth)
    assert levels[-1].shape == (1, 1)
    for level, values in enumerate(levels):
        for y, x in np.ndindex(values.shape):
            assert values[y, x] == depth[y << level:(y + 1) << level, x << level:(x + 1) << level].min()
    places = atlas_places((shape[1], shape[0]))
    assert [(height, width) for _, width, height in places] == [values.shape for values in levels[1:]]
    assert all(left + width <= places[i + 1][0] for i, (left, width, _) in enumerate(places[:-1]))


def rough_screen(shape, seed):
    """A jagged landscape of depths, and rays through it in all directions."""
    rng = np.random.default_rng(seed)
    frame = draw_frame(build.scene([build.plane("far", 500.0)], [glowing()], [], 0.0), None,
                       looking((0.0, 0.0, 1.6), 30.0, shape[::-1]), shape[::-1])
    blocks = rng.uniform(2.0, 30.0, [-(-side // 3) for side in shape])
    depth = np.kron(blocks, np.ones((3, 3)))[:shape[0], :shape[1]].astype(np.float32)
    depth[rng.random(shape) < 0.1] = NOWHERE
    normals = rng.standard_normal((*shape, 3)).astype(np.float32)
    n = 600
    place, deep = rng.random((n, 2)), rng.uniform(1.0, 25.0, n)
    near, towards, _ = frame.view.through(place[:, 0], place[:, 1], frame.size)
    points = near + towards * (deep / (towards @ frame.view.forward))[:, None]
    directions = rng.standard_normal((n, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    return Screen(min_pyramid(depth), normals), screen_rays(frame, points, directions, 40.0), directions


@pytest.mark.parametrize("shape", [(31, 47), (32, 64), (1, 40), (45, 27)])
def test_the_hierarchical_search_finds_what_pixel_by_pixel_is_found(shape):
    screen, rays, directions = rough_screen(shape, 1)
    brute = search(screen, rays, directions, 0.5, 100000, 1)
    for levels in (2, 3, len(screen.levels)):
        found = search(screen, rays, directions, 0.5, 100000, levels)
        assert np.array_equal(found.pixel, brute.pixel)
        assert np.allclose(found.s, brute.s, atol=1e-9) and np.allclose(found.behind, brute.behind, atol=1e-6)
    assert shape[0] == 1 or brute.hit.sum() > 30
    assert found.looked.sum() < brute.looked.sum() or shape[0] == 1


def test_a_walk_by_hand_finds_the_same_pixels():
    screen, rays, directions = rough_screen((31, 47), 2)
    found = search(screen, rays, directions, 0.5, 100000, len(screen.levels))
    agreed = []
    for index in range(0, 600, 7):
        # So fine a walk that few pixels are left out; a ray's depths in one are those between the first and the last step in it.
        s = np.linspace(0.0, rays.end[index], 20001)
        many = rays.take(np.full(len(s), index))
        pixels, depths = np.clip(np.floor(many.pixels(s)).astype(int), 0, (46, 30)), many.depth(s)
        changes = np.flatnonzero(np.any(np.diff(pixels, axis=0) != 0, axis=1)) + 1
        first = (-1, -1)
        for part in np.split(np.arange(len(s)), changes) if rays.end[index] > 0 else []:
            x, y = pixels[part[0]]
            depth, apart = screen.levels[0][y, x], np.abs(pixels[part[0]] - pixels[0]).max() >= MOVED
            inside = depths[part].max() >= depth and depths[part].min() <= depth + 0.5
            if depth < NOWHERE and apart and inside and screen.normals[y, x] @ directions[index] < 0:
                first = x, y
                break
        agreed.append(tuple(found.pixel[index]) == first)
    # Corners that a ray cuts by less than a step may tell them apart.
    assert np.mean(agreed) > 0.97


def test_a_mirror_meets_the_pixel_in_which_the_mirrored_eye_sees_the_wall():
    size = (96, 54)
    frame = draw_frame(floor_and_wall(), None, looking((0.0, 0.0, 1.6), 8.0, size), size)
    points, directions, _ = mirrored(frame)
    rays = screen_rays(frame, points, directions, 100.0)
    t = (6.0 - points[:, 1]) / directions[:, 1]
    place, w = frame.view.project(points + directions * t[:, None], frame.size)
    expected = place * frame.size
    inside = (w > 0) & np.all((place > 0.02) & (place < 0.98), axis=1) & (t > 0.4)
    found = search(screen_of(frame), rays, directions, 0.25, 10000, 99)
    assert inside.sum() > 500 and found.hit[inside].mean() > 0.995
    both = inside & found.hit
    off = np.linalg.norm(rays.pixels(found.s)[both] - expected[both], axis=1)
    assert np.median(off) < 0.1 and np.quantile(off, 0.95) < 0.75


def test_steps_find_the_wall_the_better_the_more_there_are_and_halving_them_makes_them_exact():
    size = (96, 54)
    frame = draw_frame(floor_and_wall(), None, looking((0.0, 0.0, 1.6), 8.0, size), size)
    points, directions, _ = mirrored(frame)
    rays = screen_rays(frame, points, directions, 100.0)
    t = (6.0 - points[:, 1]) / directions[:, 1]
    place, _ = frame.view.project(points + directions * t[:, None], frame.size)
    inside = np.all((place > 0.02) & (place < 0.98), axis=1) & (t > 0.5)
    offs = []
    for steps in (16, 64):
        found = march(screen_of(frame), rays, directions, 0.25, steps, 1.0)
        both = inside & found.hit
        assert both.sum() > 0.98 * inside.sum()
        offs.append(np.median(np.linalg.norm(rays.pixels(found.s)[both] - (place * frame.size)[both], axis=1)))
    assert offs[0] < 0.5 and offs[1] < 0.15


@pytest.mark.parametrize(("pitch", "share"), [(0.0, 1.0), (15.0, 0.83), (30.0, 0.14), (45.0, 0.0)])
def test_as_much_of_the_floor_reflects_the_wall_as_geometry_says(pitch, share):
    """A wall 6 m away, an eye 1.6 m high, 40° across the height: what is above the picture is not there."""
    size = (8, 540)
    frame = draw_frame(floor_and_wall(), None, looking((0.0, 0.0, 1.6), pitch, size), size)
    points, directions, rows = mirrored(frame)
    found = search(screen_of(frame), screen_rays(frame, points, directions, 100.0), directions, 0.25, 10000, 99)
    column = rows % size[0] == 4
    assert found.hit[column].mean() == pytest.approx(share, abs=0.02)


@pytest.mark.parametrize("search_by", ["hierarchical", "linear"])
@pytest.mark.parametrize("roughness", [0.0, 0.3, 0.8])
def test_in_a_white_furnace_nothing_is_seen_whatever_is_met(search_by, roughness):
    """Everything sends a radiance of 1, and what is white is as bright."""
    ball = build.sphere("ball", 0.4, 3, material_index=1)
    scene = build.scene([build.plane("floor", 3.0), ball], [glowing(), metal(roughness)], [], 1.0)
    lifted = replace(scene.instances[1], world_from_local=build.transform((0, 0, 0.5)))
    scene = replace(scene, instances=(scene.instances[0], lifted))
    frame = draw_frame(scene, None, view(), (48, 32))
    frame = replace(frame, light=np.ones_like(frame.light))
    settings = replace(DEFAULT, search=search_by)
    shown = frame.gbuffer.instance == 1
    frame.light[shown, :3] = (frame.gbuffer.albedo[..., :3] * frame.irradiance[..., :3] / np.pi)[shown]
    found = EFFECT.apply(frame, None, settings)[shown][:, :3]
    assert shown.sum() > 15 and np.allclose(found, 1.0, atol=0.02)
    confidence = EFFECT.mirrored(frame, None, settings, 0).confidence
    assert (confidence > 0).any() or roughness > DEFAULT.max_roughness


def test_without_confidence_the_picture_is_the_fallback():
    scene = replace(floor_and_wall(), world=World(np.random.default_rng(0).random((8, 16, 3)).astype(np.float32)))
    frame = draw_frame(scene, None, looking((0.0, 0.0, 1.6), 8.0, (48, 27)), (48, 27))
    none = EFFECT.apply(frame, None, replace(DEFAULT, max_roughness=0.0))
    assert np.array_equal(none, EFFECT.apply(frame, None, replace(DEFAULT, distance=0.01)))
    found = EFFECT.apply(frame, None, DEFAULT)
    assert np.abs(found - none).max() > 0.3
    wall = frame.gbuffer.instance == 1
    assert np.array_equal(found[wall], frame.light[wall])


def test_reflections_fade_at_borders_behind_things_and_with_roughness():
    fade = roughness_fade(np.array([0.0, 0.44, 0.5, 0.6, 1.0]), 0.6)
    assert fade[0] == fade[1] == 1.0 and 0 < fade[2] < 1 and fade[3] == fade[4] == 0.0
    size = (96, 54)
    frame = draw_frame(floor_and_wall(), None, looking((0.0, 0.0, 1.6), 20.0, size), size)
    points, directions, _ = mirrored(frame)
    rays = screen_rays(frame, points, directions, 100.0)
    found = search(screen_of(frame), rays, directions, 0.25, 10000, 99)
    confidence = confidence_of(found, rays, size, DEFAULT)
    place = rays.pixels(found.s)[found.hit] / size
    edge = np.minimum(place, 1 - place).min(axis=1)
    assert np.all(confidence[~found.hit] == 0)
    assert np.mean(confidence[found.hit][edge > 0.05] > 0.9) > 0.9 and np.all(confidence[found.hit][edge < 0.01] < 0.2)


def test_media_dim_what_a_mirror_shows_and_an_even_light_hides_them():
    size = (48, 27)
    eye = looking((0.0, 0.0, 1.6), 8.0, size)
    haze = replace(floor_and_wall(), media=(Medium("haze", absorption=np.array([0.0, 0.1, 0.3])),))
    frame = draw_frame(haze, None, eye, size)
    found = EFFECT.mirrored(replace(frame, light=np.ones_like(frame.light)), None, DEFAULT, 0)
    sure = found.confidence > 0.5
    expected = found.confidence[sure, None] * np.exp(-found.distance[sure, None] * [0.0, 0.1, 0.3])
    assert sure.sum() > 50 and np.allclose(found.light[sure], expected, atol=1e-4)
    assert notes_of([Chosen(EFFECT, DEFAULT)], haze) == ()
    # White fog in a field of 1 sends what it takes.
    fog = replace(floor_and_wall(), media=(Medium("fog", scattering=np.full(3, 0.2), bounds=ROOM),))
    frame = draw_frame(fog, Uniform(), eye, size)
    found = EFFECT.mirrored(replace(frame, light=np.ones_like(frame.light)), Uniform(), DEFAULT, 0)
    assert np.allclose(found.light[found.confidence > 0.5], 1.0, atol=1e-3)


def test_it_is_told_when_two_effects_show_reflections():
    traced = get("ray_traced")
    both = [Chosen(EFFECT, DEFAULT), Chosen(traced, traced.Settings())]
    (note,) = notes_of(both, stage())
    assert note == "reflections are shown by each of ray_traced, screen_reflections: switch all but one off"
    assert notes_of([both[0], Chosen(traced, traced.Settings(glossy_rays=0))], stage()) == notes_of(both[:1], stage()) == ()


def test_passes_tell_how_far_a_mirror_sees_and_how_sure_it_is():
    size = (96, 54)
    frame = draw_frame(floor_and_wall(), None, looking((0.0, 0.0, 1.6), 8.0, size), size)
    EFFECT.apply(frame, None, DEFAULT)
    confidence, distance = (frame.passes[name] for name in EFFECT.passes)
    points, directions, rows = mirrored(frame)
    t = (6.0 - points[:, 1]) / directions[:, 1]
    sure = confidence[..., 0].ravel()[rows] > 0.95
    assert sure.mean() > 0.5 and np.quantile(np.abs(distance[..., 0].ravel()[rows] - t)[sure] / t[sure], 0.9) < 0.03
    assert not confidence[frame.gbuffer.instance == 1][:, :3].any() and np.all(confidence[..., 3] == 1)


def test_rays_along_the_view_make_no_hole():
    scene = replace(build.open_plane(0.5), materials=(metal(),))
    frame = draw_frame(scene, None, looking((0.0, 0.0, 1.6), 90.0, (15, 15)), (15, 15))
    assert np.all(np.isfinite(EFFECT.apply(frame, None, DEFAULT)))


def test_what_has_no_layer_is_left_as_it_is():
    scene = stage(material=replace(build.material("dull", 0.5), specular=Channel.of(0.0)))
    scene = replace(scene, materials=tuple(replace(material, specular=Channel.of(0.0)) for material in scene.materials))
    frame = draw_frame(light_context(scene), None, view(), SIZE)
    assert np.allclose(EFFECT.apply(frame, None, DEFAULT), frame.light, atol=1e-6)
