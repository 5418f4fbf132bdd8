"""Lamps against closed forms and quadrature. Statistical tolerances are six standard errors (about 1 in 5·10⁸ by chance)."""

from dataclasses import replace

import numpy as np
import pytest

from rtgi_addon.numerics.sampling import sobol_owen
from rtgi_addon.scene import AreaLight, PointLight, SpotLight, SunLight
from rtgi_addon.transport.lights.lamps import LampTable

ONE = np.ones(3, np.float32)
UP = np.array([[0.0, 0.0, 1.0]], np.float32)
SAMPLES = 1 << 14


def sun(angle=0.0, direction=(0.0, 0.0, -1.0)):
    return SunLight("sun", np.asarray(direction, np.float32), ONE * 3.0, angle)


def point(position=(0.0, 0.0, 2.0), radius=0.0, soft=True):
    return PointLight("point", np.asarray(position, np.float32), ONE, radius, soft)


def spot(position=(0.0, 0.0, 2.0), cone=1.0, blend=0.0, **options):
    return SpotLight("spot", np.asarray(position, np.float32), np.array([0, 0, -1.0], np.float32), ONE, cone, blend, **options)


def area(position=(0.0, 0.0, 2.0), half_u=(0.5, 0, 0), half_v=(0, 0.25, 0), **options):
    return AreaLight("area", np.asarray(position, np.float32), np.asarray(half_u, np.float32), np.asarray(half_v, np.float32),
                     np.array([0, 0, -1.0], np.float32), ONE, **options)


def irradiance(light, receiver=(0.0, 0.0, 0.0), normal=(0.0, 0.0, 1.0), samples=SAMPLES):
    """Mean and standard error of the irradiance's red channel, over independent random numbers."""
    uv = np.random.default_rng(3).random((samples, 2)).astype(np.float32)
    points = np.repeat(np.array([receiver], np.float32), samples, axis=0)
    sample = LampTable((light,)).sample(0, points, uv)
    np.testing.assert_allclose(np.linalg.norm(sample.direction, axis=1), 1.0, atol=1e-5)
    values = sample.irradiance[:, 0].astype(float) * np.maximum(sample.direction @ np.asarray(normal, np.float32), 0.0)
    return values.mean(), values.std() / np.sqrt(samples)


def agrees(light, expected, **receiver):
    mean, error = irradiance(light, **receiver)
    assert error < 0.03 * max(expected, 1e-9), "too noisy to tell anything"
    assert mean == pytest.approx(expected, abs=6 * error + 2e-5 * expected)


def patch_irradiance(light, spread=np.pi, steps=1500):
    """Irradiance at the origin, facing +Z, of an area light in a plane z = const by the midpoint rule."""
    s, t = np.meshgrid(*[(np.arange(steps) + 0.5) / steps * 2 - 1] * 2)
    x, y = (light.position_world[i] + s * light.half_u_world[i] + t * light.half_v_world[i] for i in (0, 1))
    z = light.position_world[2]
    inside = s * s + t * t <= 1 if light.shape == "ELLIPSE" else np.ones_like(s, bool)
    half = spread / 2
    slats = 1.0 if spread >= np.pi else np.maximum(np.tan(half) - np.hypot(x, y) / z, 0) / (np.tan(half) - half)
    parallelogram = 4 * np.linalg.norm(np.cross(light.half_u_world, light.half_v_world))
    return float((inside * slats * z**2 / (x * x + y * y + z * z) ** 2).mean() * parallelogram)


def test_point_lamp_follows_the_inverse_square_and_the_cosine():
    mean, _ = irradiance(point((3.0, 0.0, 4.0)))
    assert mean == pytest.approx(4.0 / 5.0 / 25.0, rel=1e-6)


def test_soft_falloff_is_a_disk_that_faces_the_receiver():
    agrees(point((0, 0, 2), radius=0.75), 1.0 / (4.0 + 0.75**2))


@pytest.mark.parametrize("distance", [1.01, 2.0, 1000.0])
def test_sphere_lamp_shines_like_its_centre_from_outside(distance):
    agrees(point((0, 0, distance), radius=1.0, soft=False), 1.0 / distance**2)


def test_inside_a_sphere_lamp_radiance_is_the_same_from_everywhere():
    mean, error = irradiance(point((0, 0, 0.3), radius=1.0, soft=False))
    assert mean == pytest.approx(1.0, abs=6 * error)


@pytest.mark.parametrize("angle", [0.0, 0.00918, 1.0, np.pi])
def test_sun_of_any_angle_gives_its_strength_to_a_facing_plane(angle):
    agrees(sun(angle), 3.0)


def test_sun_goes_by_the_cosine_and_comes_from_infinity():
    direction = np.array([1.0, 0.0, -1.0]) / np.sqrt(2)
    mean, _ = irradiance(sun(direction=direction))
    assert mean == pytest.approx(3.0 / np.sqrt(2), rel=1e-6)
    sample = LampTable((sun(direction=direction),)).sample(0, np.zeros((2, 3), np.float32), np.zeros((2, 2), np.float32))
    assert np.all(np.isinf(sample.distance))
    np.testing.assert_allclose(sample.direction, np.repeat([-direction], 2, axis=0), atol=1e-7)


def test_spot_is_a_point_lamp_within_a_smooth_cone():
    cone, blend = 1.0, 0.4
    light = spot(cone=cone, blend=blend)
    inner = np.cos(cone / 2)
    for angle in (0.0, 0.2, 0.35, 0.45, 0.49):
        x = 2.0 * np.tan(angle)
        t = np.clip((np.cos(angle) - inner) / (blend * (1 - inner)), 0, 1)
        expected = (3 - 2 * t) * t * t * np.cos(angle) / (4.0 + x * x)
        assert irradiance(light, (x, 0, 0))[0] == pytest.approx(expected, rel=1e-4)
    assert irradiance(light, (2.0 * np.tan(0.51), 0, 0))[0] == 0.0


def test_spot_without_blend_is_cut_hard_and_scale_makes_its_cone_elliptic():
    light = spot(cone=1.0)
    assert irradiance(light, (2 * np.tan(0.499), 0, 0))[0] > 0 and irradiance(light, (2 * np.tan(0.501), 0, 0))[0] == 0
    wide = spot(cone=1.0, world_from_local=np.diag([2.0, 1.0, 1.0]))
    reach = 2 * np.tan(0.5)
    assert irradiance(wide, (1.99 * reach, 0, 0))[0] > 0 and irradiance(wide, (2.01 * reach, 0, 0))[0] == 0
    assert irradiance(wide, (0, 0.99 * reach, 0))[0] > 0 and irradiance(wide, (0, 1.01 * reach, 0))[0] == 0


def test_spot_cone_does_not_apply_inside_its_own_sphere():
    light = spot((0, 0, -0.2), cone=0.5, radius=1.0, soft_falloff=False)
    mean, error = irradiance(light)
    assert mean == pytest.approx(1.0, abs=6 * error)


def element_to_rectangle(a, b, c):
    """Form factor from an element to a parallel rectangle a × b at distance c whose corner is straight above it."""
    x, y = a / c, b / c
    return (x / np.hypot(1, x) * np.arctan(y / np.hypot(1, x)) + y / np.hypot(1, y) * np.arctan(x / np.hypot(1, y))) / (2 * np.pi)


@pytest.mark.parametrize("height", [0.05, 0.5, 2.0, 30.0])
def test_rectangle_has_the_form_factor_of_a_rectangle(height):
    light = area((0, 0, height), (0.5, 0, 0), (0, 0.25, 0))
    agrees(light, np.pi * 4 * element_to_rectangle(0.5, 0.25, height))


def test_near_rectangles_are_sampled_with_little_noise():
    mean, error = irradiance(area((0, 0, 0.25)))
    assert error * np.sqrt(SAMPLES) < 0.4 * mean


@pytest.mark.parametrize("shape", ["RECTANGLE", "ELLIPSE"])
@pytest.mark.parametrize("position", [(0, 0, 0.6), (1.3, -0.4, 0.7), (0.2, 0.1, 12.0)])
@pytest.mark.parametrize("spread", [np.pi, 2.2, 1.0])
def test_area_shapes_and_spread_match_quadrature(shape, position, spread):
    light = area(position, shape=shape, spread=spread)
    expected = patch_irradiance(light, spread)
    mean, error = irradiance(light)
    assert mean == pytest.approx(expected, abs=6 * error + 1e-3 * expected)
    assert (mean > 0) == (expected > 0)


def test_sheared_area_lamp_is_its_parallelogram():
    light = area((0.3, 0, 1.0), (0.5, 0, 0), (0.4, 0.5, 0))
    agrees(light, patch_irradiance(light))


def test_spread_keeps_the_flux():
    """The far field of any spread carries π·A·L: integrate E·d² over the hemisphere in front."""
    distance, steps = 500.0, 4000
    angle = (np.arange(steps) + 0.5) / steps * np.pi / 2
    points = np.stack([np.sin(angle), 0 * angle, -np.cos(angle)], axis=1).astype(np.float32) * distance
    uv = sobol_owen(steps, 2, 5)
    for spread in (np.pi, 2.0, 0.7, 0.08):
        light = area((0, 0, 0), spread=spread)
        sample = LampTable((light,)).sample(0, points, uv)
        flux = np.sum(sample.irradiance[:, 0] * distance**2 * 2 * np.pi * np.sin(angle)) * (np.pi / 2 / steps)
        assert flux == pytest.approx(np.pi * light.area, rel=5e-3), spread


def test_spread_zero_is_a_parallel_beam():
    light = area(spread=0.0)
    assert irradiance(light, (0.45, 0.2, 0))[0] == pytest.approx(np.pi, rel=1e-6)
    assert irradiance(light, (0.55, 0.0, 0))[0] == 0.0
    assert irradiance(replace(light, shape="ELLIPSE"), (0.45, 0.2, 0))[0] == 0.0
    assert LampTable((light,)).is_delta[0]


def test_area_lamps_shine_to_one_side():
    assert irradiance(area(), (0, 0, 4.0), normal=(0, 0, -1))[0] == 0.0


LIGHTS = (sun(), sun(0.3), point(), point(radius=0.4), point(radius=0.4, soft=False), spot(blend=0.3),
          spot(radius=0.2, blend=1.0), area(), area((0, 0, 0.3)), area(shape="ELLIPSE"), area(spread=0.9),
          area((0, 0, 1), (0.5, 0, 0), (0.2, 0.5, 0)), area(spread=0.0))


def receivers(n=4096):
    rng = np.random.default_rng(11)
    points = rng.uniform(-2, 2, (n, 3)).astype(np.float32)
    normals = rng.normal(size=(n, 3)).astype(np.float32)
    return points, normals / np.linalg.norm(normals, axis=1, keepdims=True), rng.random((n, 2)).astype(np.float32)


def test_importance_is_positive_wherever_light_arrives():
    points, normals, uv = receivers()
    table = LampTable(LIGHTS)
    for index in range(table.count):
        sample = table.sample(index, points, uv)
        arrives = sample.irradiance[:, 0] * np.maximum(np.sum(sample.direction * normals, axis=1), 0) > 1e-6
        estimate = table.irradiance_unshadowed(index, points, normals)[:, 0]
        assert arrives.any() and np.all(estimate[arrives] > 0), LIGHTS[index]
        assert np.all(np.isfinite(estimate))


def test_importance_is_the_irradiance_of_a_small_lamp():
    points, normals = np.zeros((1, 3), np.float32), UP
    for light in (sun(), point(), spot(), area((0, 0, 30.0))):
        estimate = LampTable((light,)).irradiance_unshadowed(0, points, normals)[0, 0]
        assert estimate == pytest.approx(irradiance(light)[0], rel=0.02)


def test_a_row_depends_on_itself_alone():
    """The same bytes one lamp at a time, mixed, and in pieces."""
    points, normals, uv = receivers(999)
    table = LampTable(LIGHTS)
    lamp = np.random.default_rng(2).integers(0, table.count, len(points))
    mixed = table.sample(lamp, points, uv)
    importance = table.irradiance_unshadowed(lamp, points, normals)
    for index in range(table.count):
        rows = np.flatnonzero(lamp == index)
        alone = table.sample(index, points[rows], uv[rows])
        pieces = table.sample(index, points[rows[:7]], uv[rows[:7]])
        for name in ("direction", "distance", "irradiance"):
            assert getattr(mixed, name)[rows].tobytes() == getattr(alone, name).tobytes(), (LIGHTS[index], name)
            assert getattr(pieces, name).tobytes() == getattr(alone, name)[:7].tobytes()
        assert importance[rows].tobytes() == table.irradiance_unshadowed(index, points[rows], normals[rows]).tobytes()


def test_table_tells_kinds_shadows_and_power():
    lights = (replace(sun(), casts_shadow=False), point(), area())
    table = LampTable(lights, scene_radius=2.0)
    assert table.count == 3
    assert table.casts_shadow.tolist() == [False, True, True] and table.is_delta.tolist() == [True, True, False]
    np.testing.assert_allclose(table.power_estimate, [3 * 4 * np.pi, 4 * np.pi, np.pi * 0.5], rtol=1e-6)
    empty = LampTable(())
    assert empty.count == 0 and empty.power_estimate.shape == (0,)


def test_a_point_on_the_lamp_stays_finite():
    points = np.array([[0, 0, 2.0]], np.float32)
    for light in (point(), spot(), point(radius=0.1), point(radius=0.1, soft=False), area(), area(shape="ELLIPSE")):
        sample = LampTable((light,)).sample(0, points, np.full((1, 2), 0.3, np.float32))
        assert np.all(np.isfinite(sample.irradiance)) and np.all(np.isfinite(sample.direction)), light
