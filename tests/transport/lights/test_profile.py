"""Profiles of lamps: what they send, what arrives, what maps carry and what paths begin with are the same light."""

from dataclasses import replace

import numpy as np
import pytest

from rtgi_addon.numerics.sampling import fibonacci_sphere, sobol_owen, sphere_from_square
from rtgi_addon.scene import AreaLight, LampProfile, PointLight, SpotLight
from rtgi_addon.scene.lamp_profile import directions, distances, solid_angles
from rtgi_addon.transport.lights.beam import Beam
from rtgi_addon.transport.lights.lamps import LampTable
from rtgi_addon.transport.lights.profile import Density, profile_of
from rtgi_addon.transport.lights.shaped import arriving_share, connect, emit
from rtgi_addon.transport.vectors import dot
from rtgi_addon.transport.views.shadow_views import lit_views, texel_power

BOUNDS = np.array([[-2.0, -2.0, -2.0], [2.0, 2.0, 2.0]])
HERE, DOWN, COLOR = np.float32([0.2, -0.1, 0.4]), np.float32([0.0, 0.6, -0.8]), np.float32([1.0, 2.0, 0.5])
SIDE = np.float32([1.0, 0.0, 0.0])
FRAME = np.stack([SIDE, np.cross(-DOWN, SIDE), -DOWN], axis=1).astype(np.float64)


def by_direction(function, reach=np.pi, size=(96, 96), **more):
    """A profile whose factor at the cosine to DOWN and the azimuth about it is ``function``."""
    empty = LampProfile(FRAME, np.zeros((*size, 3), np.float32), reach, **more)
    local = directions(empty) @ FRAME
    values = function(-local[..., 2], np.arctan2(local[..., 1], local[..., 0]))
    return replace(empty, by_direction=np.float32(values[..., None] * [1.0, 0.5, 2.0]))


def beam_like(cosine, azimuth):
    """Narrow, and brighter on one side."""
    return np.maximum(cosine, 0.0) ** 8 * (1.0 + 0.8 * np.cos(azimuth))


def spot_of_places(s, t):
    """A bright corner on a dim lamp."""
    return 0.1 + 5.0 * ((s > 0.3) & (t < -0.2))


def by_place(size=(80, 64)):
    t, s = np.meshgrid(*((np.arange(count) + 0.5) / count * 2.0 - 1.0 for count in size), indexing="ij")
    return np.float32(spot_of_places(s, t)[..., None] * [1.0, 1.0, 0.3])


AREA = AreaLight("area", HERE, 0.3 * SIDE, 0.2 * np.cross(SIDE, DOWN), DOWN, COLOR, "ELLIPSE", np.pi)
LAMPS = {
    "point": PointLight("point", HERE, COLOR, profile=by_direction(beam_like)),
    "disk": PointLight("disk", HERE, COLOR, 0.05, True, profile=by_direction(beam_like)),
    "sphere": PointLight("sphere", HERE, COLOR, 0.05, False, profile=by_direction(beam_like)),
    "sphere by normals": PointLight("sphere", HERE, COLOR, 0.05, False, profile=by_direction(beam_like, of_normals=True)),
    "spot": SpotLight("spot", HERE, DOWN, COLOR, 1.2, 0.3, 0.0, profile=by_direction(beam_like, 0.6)),
    "stretched spot": SpotLight("spot", HERE, DOWN, COLOR, 1.2, 0.3, 0.0, world_from_local=FRAME * [2.0, 1.0, 1.0],
                                profile=by_direction(beam_like)),
    "area": replace(AREA, profile=by_direction(beam_like, 0.5 * np.pi)),
    "textured area": replace(AREA, profile=LampProfile(by_place=by_place())),
    "textured rectangle": replace(AREA, shape="RECTANGLE", spread=1.0, profile=LampProfile(by_place=by_place())),
    "both": replace(AREA, profile=replace(by_direction(beam_like, 0.5 * np.pi), by_place=by_place())),
}


def received(light, radius=20.0, count=1 << 15):
    """(3,) [W] through a sphere around the lamp, by samples from points on it."""
    away = fibonacci_sphere(count).astype(np.float32)
    points = (HERE + np.float32(radius) * away).astype(np.float32)
    sample = LampTable((light,)).sample(0, points, sobol_owen(count, 2, 5))
    arriving = sample.irradiance * np.maximum(-dot(away, sample.direction), 0.0)[:, None]
    return arriving.mean(axis=0) * 4.0 * np.pi * radius**2


@pytest.mark.parametrize("name", LAMPS)
def test_what_leaves_a_lamp_arrives_and_is_in_its_maps(name):
    light = LAMPS[name]
    emission, u = emit(light, sobol_owen(1 << 14, 4, 3), Beam(BOUNDS, np.zeros(3), 1.0))
    sent = emission.power.mean(axis=0)
    assert u.min() >= 0.0 and u.max() < 1.0
    np.testing.assert_allclose(received(light), sent, rtol=0.012)
    mapped = sum(texel_power(light, view).sum(axis=(0, 1), dtype=np.float64) for view in lit_views(light, BOUNDS, 128, 0))
    np.testing.assert_allclose(mapped, sent, rtol=0.012)


def test_a_point_lamp_sends_the_integral_of_its_profile():
    """∫ cosⁿ over a hemisphere is 2π/(n + 1), and the cosine of the azimuth has no mean."""
    emission, _ = emit(LAMPS["point"], sobol_owen(1 << 14, 4, 3), Beam(BOUNDS, np.zeros(3), 1.0))
    np.testing.assert_allclose(emission.power.mean(axis=0), 2.0 * np.pi / 9.0 * COLOR * [1.0, 0.5, 2.0], rtol=0.01)
    profile = LAMPS["point"].profile
    assert np.sum(solid_angles(profile)) * profile.by_direction.shape[1] == pytest.approx(4.0 * np.pi)


def test_a_sphere_with_a_bright_cap_sends_what_its_surface_does():
    """Radiance L·f(n) over a sphere: π·L·∫f dA, with I = π·r²·L."""
    light = LAMPS["sphere by normals"]
    expected = np.pi * (COLOR / np.pi) * 2.0 * np.pi / 9.0 * np.array([1.0, 0.5, 2.0])
    np.testing.assert_allclose(received(light), expected, rtol=0.01)
    # Far away, light goes on all round the bright side: ∫cos⁸·cos over the hemisphere, 2π/10, over ∫cos = π.
    facing = profile_of(light).to_far(DOWN[None])[0] / light.profile.by_direction.max(axis=(0, 1))
    np.testing.assert_allclose(facing * 1.8, 0.2, rtol=0.03)


def test_a_gobo_of_stripes_sends_half():
    light = PointLight("gobo", HERE, COLOR, profile=by_direction(lambda cosine, azimuth: 1.0 * (np.sin(8 * azimuth) > 0)))
    np.testing.assert_allclose(received(light), 2.0 * np.pi * COLOR * [1.0, 0.5, 2.0], rtol=0.01)


@pytest.mark.parametrize("name", LAMPS)
def test_samples_go_where_the_light_is(name):
    """Far fewer of the rays are wasted than if they went everywhere alike."""
    light, u, beam = LAMPS[name], sobol_owen(1 << 13, 4, 3), Beam(BOUNDS, np.zeros(3), 1.0)
    shaped = emit(light, u, beam)[0].power[:, 0]
    plain, _ = emit(replace(light, profile=None), u, beam)
    even = (plain.power * profile_of(light).factor(plain.origins, plain.directions))[:, 0]
    assert np.std(shaped) / shaped.mean() < 0.75 * np.std(even) / even.mean()
    # Where on a sphere a ray begins, which its direction leaves open, is drawn evenly.
    assert np.std(shaped) / shaped.mean() < (3.0 if light.profile.of_normals else 1.2)


def test_distances_are_followed_from_where_light_leaves_the_lamp():
    linear = np.repeat(np.float32(distances(1024))[:, None], 3, axis=1)
    points = (HERE + np.float32([[0.0, 0.0, -0.5], [0.0, 0.3, -2.0], [3.0, 1.0, 0.0]])).astype(np.float32)
    for light in (PointLight("lamp", HERE, COLOR, 0.1, False), replace(AREA, half_u_world=0.01 * SIDE)):
        shaped = replace(light, profile=LampProfile(by_distance=linear))
        uv = np.full((3, 2), 0.3, np.float32)
        plain, found = LampTable((light,)).sample(0, points, uv), LampTable((shaped,)).sample(0, points, uv)
        np.testing.assert_allclose(found.irradiance, plain.irradiance * plain.distance[:, None], rtol=1e-3)
        place = np.full((3, 2), 0.5, np.float32)
        origins = connect(shaped, points, place, Beam(BOUNDS, np.zeros(3), 1.0))[0]
        share = arriving_share(shaped, points, place, Beam(BOUNDS, np.zeros(3), 1.0))
        np.testing.assert_allclose(share, np.repeat(np.linalg.norm(points - origins, axis=1)[:, None], 3, axis=1), rtol=1e-3)


def test_a_parallel_beam_carries_its_picture():
    light = replace(AREA, shape="RECTANGLE", spread=0.0, profile=LampProfile(by_place=by_place()))
    points = HERE + np.float32(1.5) * DOWN + np.float32([[0.6], [-0.6]]) * light.half_u_world - 0.5 * light.half_v_world
    sample = LampTable((light,)).sample(0, points.astype(np.float32), np.full((2, 2), 0.9, np.float32))
    np.testing.assert_allclose(sample.irradiance, np.pi * COLOR * [[5.1, 5.1, 1.53], [0.1, 0.1, 0.03]], rtol=1e-5)
    emission, _ = emit(light, sobol_owen(1 << 13, 4, 3), Beam(BOUNDS, np.zeros(3), 1.0))
    np.testing.assert_allclose(emission.power.mean(axis=0), np.pi * light.area * COLOR * by_place().mean(axis=(0, 1)), rtol=0.01)


@pytest.mark.parametrize("name", LAMPS)
def test_estimates_are_positive_where_light_arrives(name):
    light, points = LAMPS[name], (HERE + sphere_from_square(sobol_owen(2048, 2, 1)) * np.float32(0.8)).astype(np.float32)
    table, normals = LampTable((light,)), -(points - HERE) / np.float32(0.8)
    sample = table.sample(0, points, sobol_owen(2048, 2, 2))
    lit = np.any(sample.irradiance * np.maximum(dot(normals, sample.direction), 0.0)[:, None] > 0, axis=1)
    assert lit.any() and np.all(table.irradiance_unshadowed(0, points, normals)[lit] > 0)


def test_lamps_with_and_without_profiles_share_a_table():
    lights = (LAMPS["point"], replace(LAMPS["point"], profile=None), LAMPS["textured area"])
    points = (HERE + fibonacci_sphere(300) * np.float32(0.7)).astype(np.float32)
    uv, chosen = sobol_owen(300, 2, 1), np.arange(300) % 3
    mixed = LampTable(lights).sample(chosen, points, uv)
    for index, light in enumerate(lights):
        alone = LampTable((light,)).sample(0, points, uv)
        np.testing.assert_array_equal(mixed.irradiance[chosen == index], alone.irradiance[chosen == index])


def test_a_density_counts_what_it_moves():
    rng = np.random.default_rng(1)
    brightness = np.zeros((32, 32))
    brightness[4:9, 20:22] = 7.0
    u = rng.random((1 << 16, 2)).astype(np.float32)
    warped, weight = Density(brightness).warp(u)
    assert weight.mean() == pytest.approx(1.0, abs=0.02)
    np.testing.assert_allclose((warped * weight[:, None]).mean(axis=0), 0.5, atol=0.02)
    inside = (warped[:, 0] * 32 >= 19) & (warped[:, 0] * 32 < 23) & (warped[:, 1] * 32 >= 3) & (warped[:, 1] * 32 < 10)
    assert inside.mean() > 0.85
    assert np.all(Density(np.zeros((4, 4))).warp(u)[1] == 1.0)
