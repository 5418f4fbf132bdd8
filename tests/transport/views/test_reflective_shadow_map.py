"""Capture by rays: a map's flux is albedo times the power that falls on what it sees, for every kind of lamp."""

from dataclasses import replace

import numpy as np
import pytest
import room_scenes as rooms
import scene_builders as build
from scene_builders import cube, material, mesh, plane, sphere

from rtgi_addon.scene import AreaLight, Channel, Material, PointLight, SpotLight, SunLight
from rtgi_addon.transport.context import LightContext
from rtgi_addon.transport.views.reflective_shadow_map import capture
from rtgi_addon.transport.views.shadow_views import views_of

STRENGTH = np.array([1.0, 2.0, 3.0])
ALBEDO = np.array([0.8, 0.5, 0.1])
DOWN = np.array([0.0, 0.0, -1.0])
TILTED = np.array([0.6, 0.0, -0.8])


def maps_of(scene, resolution=128, threads=1, **options):
    """The maps of all lamps of ``scene``."""
    context = LightContext(scene, threads)
    return [capture(context, view) for lamp in range(len(scene.lights)) for view in views_of(context, lamp, resolution, **options)]


def total(scene, resolution=128, **options):
    """(3,) [W] reflected by what all lamps see."""
    return sum(item.total_flux for item in maps_of(scene, resolution, **options))


def room_with(light):
    """A closed, coloured cube of 4 m around the lamp."""
    return build.scene([cube("room", 2.0, inward=True)], [material("wall", ALBEDO)], [light])


ENCLOSED = {
    "point": (PointLight("p", np.array([0.3, -0.2, 0.5]), STRENGTH), 4 * np.pi),
    "spot": (SpotLight("s", np.zeros(3), TILTED, STRENGTH, 1.0), 2 * np.pi * (1 - np.cos(0.5))),
    "wide spot": (SpotLight("s", np.zeros(3), TILTED, STRENGTH, np.pi), 2 * np.pi),
    "rectangle": (AreaLight("a", np.zeros(3), np.array([0.3, 0, 0]), np.array([0, 0.2, 0]), DOWN, STRENGTH), np.pi * 0.24),
    "ellipse": (AreaLight("a", np.zeros(3), np.array([0.3, 0, 0]), np.array([0, 0.2, 0]), DOWN, STRENGTH, "ELLIPSE"),
                np.pi * np.pi * 0.06),
    "narrow beam": (AreaLight("a", np.zeros(3), np.array([0.3, 0, 0]), np.array([0, 0.2, 0]), DOWN, STRENGTH, spread=0.5),
                    np.pi * 0.24),
    "parallel beam": (AreaLight("a", np.zeros(3), np.array([0.3, 0, 0]), np.array([0, 0.2, 0]), DOWN, STRENGTH, spread=0.0),
                      np.pi * 0.24),
}


@pytest.mark.parametrize("name", ENCLOSED)
def test_enclosed_lamps_reflect_albedo_times_their_power(name):
    light, power = ENCLOSED[name]
    assert total(room_with(light)) == pytest.approx(ALBEDO * power * STRENGTH, rel=4e-3)


@pytest.mark.parametrize("direction", [DOWN, TILTED])
def test_a_sun_reflects_albedo_times_what_falls_on_the_ground(direction):
    scene = build.scene([plane("ground", 2.0)], [material("ground", ALBEDO)], [SunLight("sun", direction, STRENGTH)])
    assert total(scene, 512) == pytest.approx(ALBEDO * STRENGTH * 16.0 * -direction[2], rel=5e-3)


def test_part_of_a_point_lamps_power_falls_on_a_square():
    """A square of side 2h at distance h is one face of a cube around the lamp."""
    scene = build.scene([plane("ground", 1.0)], [material("ground", ALBEDO)], [build.point_light((0, 0, 1.0), STRENGTH)])
    assert total(scene, 255) == pytest.approx(ALBEDO * STRENGTH * 4 * np.pi / 6, rel=5e-3)


def test_texels_lie_on_their_triangles_and_face_the_lamp():
    scene = room_with(ENCLOSED["point"][0])
    context = LightContext(scene, 1)
    for item in (capture(context, view) for view in views_of(context, 0, 32)):
        assert item.primitive.shape == (32, 32) and item.primitive.min() >= 0
        assert np.abs(item.position).max(axis=-1) == pytest.approx(2.0, abs=1e-5)
        assert item.normal == pytest.approx(context.geometry.normals_world[item.primitive], abs=1e-6)
        assert np.all(np.sum(item.normal * (scene.lights[0].position_world - item.position), axis=-1) > 0)
        assert all(array.dtype == np.float32 for array in (item.position, item.normal, item.flux))


def test_row_0_is_the_bottom_and_positions_project_to_their_own_texels():
    context = LightContext(room_with(ENCLOSED["spot"][0]), 1)
    view, = views_of(context, 0, 16)
    item = capture(context, view)
    uv, front = view.project(item.position.reshape(-1, 3))
    assert front.all()
    assert uv == pytest.approx((np.stack(np.meshgrid(range(16), range(16)), -1).reshape(-1, 2) + 0.5) / 16, abs=1e-5)
    assert item.position[0, :, 2].mean() < item.position[-1, :, 2].mean()


def test_a_surface_lit_from_behind_turns_its_normal_to_the_lamp():
    scene = build.scene([plane("ceiling", 2.0)], lights=[build.point_light((0, 0, -1.0), 1.0)])
    lit = [item.lights() for item in maps_of(scene, 16)]
    normals = np.concatenate([part.normals for part in lit])
    assert len(normals) > 100 and np.all(normals == np.float32([0, 0, -1]))


def test_smooth_normals_are_those_of_the_shading():
    ball = sphere("ball", 1.0, 2)
    ball = replace(ball, corner_normals_local=ball.vertices_local[ball.triangles])
    lit = [item.lights() for item in maps_of(build.scene([ball], lights=[build.point_light((0, 0, 3.0), 1.0)]), 64)]
    positions, normals = (np.concatenate([getattr(part, name) for part in lit]) for name in ("positions", "normals"))
    radial = positions / np.linalg.norm(positions, axis=1, keepdims=True)
    assert np.linalg.norm(normals, axis=1) == pytest.approx(1.0, abs=1e-5)
    assert np.sum(radial * normals, axis=1).min() > 0.998


def test_light_passes_holes_and_takes_the_colour_of_textures():
    hole = Material("hole", albedo=Channel.of(1.0), alpha=Channel.of(0.0), alpha_threshold=0.5)
    sheet = mesh("sheet", plane("sheet", 1.0, 1.0).vertices_local, [[0, 1, 2], [0, 2, 3]], 1)
    lamp = [build.point_light((0, 0, 2.0), STRENGTH)]
    under = build.scene([plane("ground", 2.0), sheet], [material("ground", ALBEDO), hole], lamp)
    assert total(under) == pytest.approx(total(build.scene([plane("ground", 2.0)], [material("ground", ALBEDO)], lamp)), rel=1e-6)
    flux = np.concatenate([item.lights().flux for item in maps_of(rooms.textured_room(), 64)])
    assert flux.max(axis=1).min() > 0 and np.ptp(flux[:, 0] / flux[:, 2]) > 2


def test_what_is_not_lit_holds_nothing():
    scene = build.scene([plane("ground", 1.0)], lights=[build.point_light((0, 0, 1.0), 1.0)])
    items = maps_of(scene, 16)
    empty = [item for item in items if np.all(item.primitive < 0)]
    assert empty and all(not array.any() for item in empty for array in (item.position, item.normal, item.flux))
    assert sum(len(item.lights().flux) for item in items) == sum(np.count_nonzero(item.primitive >= 0) for item in items)
    black = build.scene([plane("ground", 1.0)], [material("black", 0.0)], [build.point_light((0, 0, 1.0), 1.0)])
    assert all(len(item.lights().flux) == 0 for item in maps_of(black, 16))


def test_a_lamp_on_a_surface_is_not_shadowed_by_it():
    panel = AreaLight("a", np.array([0.0, 0.0, 2.0]), np.array([0.3, 0, 0]), np.array([0, 0.2, 0]), DOWN, STRENGTH)
    assert total(room_with(panel)) == pytest.approx(ALBEDO * np.pi * 0.24 * STRENGTH, rel=4e-3)


def test_the_same_bytes_for_any_number_of_threads():
    one, two = (maps_of(rooms.screen_room(), 300, threads) for threads in (1, 2))
    for a, b in zip(one, two, strict=True):
        assert all(np.array_equal(getattr(a, name), getattr(b, name)) for name in ("position", "normal", "flux", "primitive"))
