"""Views of lamps: exact texel measures, closed forms of the power in view, and a lattice that does not swim."""

import numpy as np
import pytest
import scene_builders as build

from rtgi_addon.numerics.sampling import fibonacci_sphere
from rtgi_addon.scene import AreaLight, PointLight, SpotLight, SunLight
from rtgi_addon.transport.context import LightContext
from rtgi_addon.transport.lights.spot import spot_attenuation
from rtgi_addon.transport.views.reflective_shadow_map import capture
from rtgi_addon.transport.views.shadow_views import texel_power, views_of

INTENSITY = np.array([1.0, 2.0, 3.0])


def spot(cone=1.2, blend=0.0, **options):
    """A spot that looks down at a slant."""
    direction = np.array([0.3, -0.2, -1.0]) / np.linalg.norm([0.3, -0.2, -1.0])
    return SpotLight("spot", np.array([0.1, 0.2, 0.3]), direction, INTENSITY, cone, blend, **options)


def area(spread=np.pi, shape="RECTANGLE", shear=0.0):
    """A small lamp that looks along +X; ``shear`` tilts its second half axis."""
    return AreaLight("area", np.zeros(3), np.array([0.0, 0.2, 0.0]), np.array([0.0, 0.1 * shear, 0.1]), np.array([1.0, 0.0, 0.0]),
                     INTENSITY, shape, spread)


def sun(direction=(0.3, 0.2, -1.0)):
    """A sun along ``direction``."""
    return SunLight("sun", np.array(direction) / np.linalg.norm(direction), INTENSITY)


def context_with(light, half_size=2.0):
    """A closed room around the lamp."""
    return LightContext(build.scene([build.cube("room", half_size, inward=True)], lights=[light]), threads=1)


def power_in_view(light, resolution=256, **options):
    """(3,) [W] through all views."""
    views = views_of(context_with(light), 0, resolution, **options)
    return sum(texel_power(light, view).sum(axis=(0, 1), dtype=np.float64) for view in views)


def spot_power(light):
    """2π ∫ I(z) dz over the cone by the midpoint rule."""
    cosine = np.cos(0.5 * light.cone_angle)
    z = cosine + (np.arange(100000) + 0.5) / 100000 * (1 - cosine)
    t = np.clip((z - cosine) / max((1 - cosine) * light.blend, 1e-7), 0, 1)
    return 2 * np.pi * (1 - cosine) * np.mean(t * t * (3 - 2 * t)) * INTENSITY


def test_texels_of_a_cube_sum_to_the_whole_sphere():
    light = PointLight("lamp", np.array([0.1, 0.2, -0.3]), INTENSITY)
    views = views_of(context_with(light), 0, 33)
    assert len(views) == 6 and [view.face for view in views] == list(range(6))
    assert sum(view.texel_measure().sum() for view in views) == pytest.approx(4 * np.pi, rel=1e-12)
    corner, middle = views[0].texel_measure()[0, 0], views[0].texel_measure()[16, 16]
    assert corner / middle == pytest.approx((1 + 2 * (32 / 33) ** 2) ** -1.5, rel=0.01)


def test_a_point_lamp_sends_its_whole_power():
    assert power_in_view(PointLight("lamp", np.zeros(3), INTENSITY), 8) == pytest.approx(4 * np.pi * INTENSITY, rel=1e-6)


@pytest.mark.parametrize("cone", [0.3, 1.2, 2.0, 2.6, np.pi])
@pytest.mark.parametrize("blend", [0.0, 0.4, 1.0])
def test_a_spot_sends_the_power_of_its_cone(cone, blend):
    light = spot(cone, blend)
    assert power_in_view(light) == pytest.approx(spot_power(light), rel=2e-3 if blend == 0 else 2e-4)


def test_a_narrow_spot_takes_one_view_and_a_wide_one_only_the_faces_it_reaches():
    assert len(views_of(context_with(spot(1.2)), 0, 32)) == 1
    assert 1 < len(views_of(context_with(spot(2.8)), 0, 32)) < 6


def test_an_elliptical_cone_lies_within_its_view():
    light = spot(1.0, 0.0, world_from_local=np.diag([2.0, 0.5, 1.0]))
    light = SpotLight(**{**vars(light), "direction_world": np.array([0.0, 0.0, -1.0])})
    view, = views_of(context_with(light), 0, 128)
    power = texel_power(light, view)
    directions = fibonacci_sphere(1 << 18)
    everywhere = spot_attenuation(light, directions).mean(dtype=np.float64) * 4 * np.pi * INTENSITY
    assert power.sum(axis=(0, 1)) == pytest.approx(everywhere, rel=5e-3)
    lit = np.argwhere(power[..., 0] > 0)
    assert np.ptp(lit[:, 1]) > 120 and np.ptp(lit[:, 1]) == pytest.approx(4 * np.ptp(lit[:, 0]), rel=0.1)


@pytest.mark.parametrize("spread", [np.pi, 2.4, 1.2, 0.3])
@pytest.mark.parametrize("shape", ["RECTANGLE", "ELLIPSE"])
def test_an_area_lamp_sends_pi_a_l_however_narrow_its_beam(spread, shape):
    light = area(spread, shape)
    assert power_in_view(light, 128, area_points=3) == pytest.approx(np.pi * light.area * INTENSITY, rel=1e-3)


@pytest.mark.parametrize("shape", ["RECTANGLE", "ELLIPSE"])
@pytest.mark.parametrize("shear", [0.0, 1.0])
def test_a_parallel_beam_sends_pi_a_l(shape, shear):
    light = area(0.0, shape, shear)
    assert power_in_view(light, 512) == pytest.approx(np.pi * light.area * INTENSITY, rel=5e-3)


def test_views_of_an_area_lamp_stand_on_it_and_share_it():
    light = area(shape="ELLIPSE")
    views = views_of(context_with(light), 0, 8, area_points=5)
    places = {tuple(view.position_world) for view in views}
    assert len(places) == 5 and sum(view.share for view in views[::5]) == pytest.approx(1.0)
    offsets = np.array(sorted(places)) / [1.0, 0.2, 0.1]
    assert np.all(np.sum(offsets**2, axis=1) < 1.0) and np.ptp(offsets[:, 1]) > 0.8
    for count in range(1, 65):
        offsets = np.array([view.position_world for view in views_of(context_with(area(0.3, "ELLIPSE")), 0, 8, area_points=count)])
        offsets = offsets[:, 1:] / [0.2, 0.1]
        assert offsets.mean(axis=0) == pytest.approx(0.0, abs=1e-12) and np.all(np.sum(offsets**2, axis=1) <= 1 + 1e-9)
    middle, = {tuple(view.position_world) for view in views_of(context_with(light), 0, 8, area_points=1)}
    assert middle == (0.0, 0.0, 0.0)


@pytest.mark.parametrize("distance", [8.0, 300.0, 1e6])
def test_a_point_lamp_far_outside_takes_one_view_around_the_scene(distance):
    """It holds all that falls on the room's outside: each face's solid angle."""
    light = PointLight("lamp", np.array([0.0, 0.0, distance]), INTENSITY)
    context = context_with(light, 2.0)
    view, = views_of(context, 0, 256)
    item = capture(context, view)
    edge = 2.0 / (distance - 2.0)
    seen = 4 * np.arctan2(edge * edge, np.sqrt(2 * edge * edge + 1)) * INTENSITY
    assert item.total_flux == pytest.approx(0.5 * seen, rel=0.02)
    assert np.abs(item.position[item.primitive >= 0][:, 2] - 2.0).max() < 1e-5
    assert len(views_of(context_with(PointLight("lamp", np.array([0.0, 0.0, 3.0]), INTENSITY)), 0, 8)) == 6


def test_rays_run_from_the_near_plane_to_the_far_plane_along_the_light():
    for light in (spot(), sun(), area(), PointLight("lamp", np.zeros(3), INTENSITY)):
        for view in views_of(context_with(light), 0, 5):
            origins, directions = (part.astype(np.float64) for part in view.rays())
            unit = directions / np.linalg.norm(directions, axis=1, keepdims=True)
            assert unit == pytest.approx(view.directions(), abs=2e-6)
            depth = -((origins - view.position_world) @ view.world_from_view[:3, 2])
            assert depth == pytest.approx(view.near, rel=1e-2, abs=1e-6)
            assert directions @ -view.world_from_view[:3, 2] == pytest.approx(view.far - view.near, rel=1e-5)
            uv, front = view.project(origins + 0.4 * directions)
            assert front.all()
            assert uv == pytest.approx((np.stack(np.meshgrid(range(5), range(5)), -1).reshape(-1, 2) + 0.5) / 5, abs=1e-4)


def test_a_sun_sees_the_whole_focus_and_every_caster_before_it():
    light = sun()
    context = context_with(light)
    focus = np.array([[-0.5, -0.25, -0.5], [0.5, 0.25, 0.5]])
    for box in (None, focus):
        view, = views_of(context, 0, 64, focus=box)
        corners = np.stack(np.meshgrid(*(np.array([[-2.0] * 3, [2.0] * 3]) if box is None else box).T), -1).reshape(-1, 3)
        uv, front = view.project(corners)
        assert front.all() and uv.min() > 0 and uv.max() < 1
        depth = (view.position_world - context.geometry.triangles_world.reshape(-1, 3)) @ view.world_from_view[:3, 2]
        assert depth.min() > view.near and depth.max() < view.far


def test_a_moving_focus_keeps_the_suns_texels_where_they_are():
    context = context_with(sun())
    focus = np.array([[-0.5, -0.25, -0.5], [0.5, 0.25, 0.5]])
    view, = views_of(context, 0, 64, focus=focus)
    texel = 2.0 / view.clip_from_view[0, 0] / 64
    for step in (0.013, 0.2, 0.37):
        moved, = views_of(context, 0, 64, focus=focus + step)
        shift = (moved.position_world - view.position_world) @ view.world_from_view[:3, :2] / texel
        assert shift == pytest.approx(np.round(shift), abs=1e-9)
        assert moved.clip_from_view[0, 0] == view.clip_from_view[0, 0]


def test_a_turning_sun_moves_its_texels_without_jumps():
    focus = np.array([[-0.5, -0.25, -0.5], [0.5, 0.25, 0.5]])
    before, texel, steps = None, 0.0, []
    for angle in np.linspace(0.2, 0.21, 101):
        view, = views_of(context_with(sun((np.sin(angle), 0.3, -np.cos(angle)))), 0, 64, focus=focus)
        texel = 2.0 / view.clip_from_view[0, 0] / 64
        phase = (view.position_world @ view.world_from_view[:3, :2]) / texel
        steps.append(np.abs(phase - np.round(phase)).max())
        assert before is None or view.clip_from_view[0, 0] == pytest.approx(before, rel=1e-12)
        before = view.clip_from_view[0, 0]
    assert max(steps) < 1e-9


def test_a_dark_lamp_has_no_views():
    assert views_of(context_with(PointLight("lamp", np.zeros(3), np.zeros(3))), 0, 8) == ()
