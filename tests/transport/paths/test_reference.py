"""The path reference against closed forms (docs/physics.md §2).

Statistical answers are held to six of their own standard errors (eight scrambles: about 1 in 2,000 by chance, and the seeds are
fixed), and to a bound on that error, without which a noisy wrong answer would pass.
"""

from dataclasses import replace

import numpy as np
import pytest
import scene_builders as build

from rtgi_addon.numerics.sampling import disk_from_square, sobol_owen
from rtgi_addon.scene import AreaLight, Channel, Material, SunLight, World
from rtgi_addon.transport.context import LightContext
from rtgi_addon.transport.paths.reference import irradiance_at, probe_sh, trace_radiance

Y00 = np.sqrt(0.25 / np.pi)


def agrees(estimate, expected, error, absolute=0.0):
    """Every value within six standard errors of ``expected``, and the standard errors below ``error`` relative to it."""
    mean, deviation = np.asarray(estimate.mean, float), np.asarray(estimate.standard_error, float)
    expected = np.broadcast_to(expected, mean.shape)
    assert np.all(deviation <= error * np.abs(expected).max()), f"too noisy: {deviation.max()}"
    assert np.all(np.abs(mean - expected) <= 6 * deviation + 1e-5 * np.abs(expected) + absolute), (mean, expected, deviation)


def pooled(values):
    """Mean over points and its standard error, taking points as independent."""
    return float(values.mean()), float(values.std(ddof=1) / np.sqrt(values.size))


def down(n=1):
    return np.tile(np.float32([0, 0, -1]), (n, 1))


@pytest.mark.parametrize("albedo", [0.0, 0.2, 0.5, 0.9])
def test_furnace(albedo):
    """Closed emissive walls: L = Le/(1 − ρ) from everywhere, so no band but the constant one."""
    context = LightContext(build.cube_furnace(albedo, emission=2.0))
    radiance = 2.0 / (1.0 - albedo)
    points = np.array([[0, 0, 0], [0.6, -0.3, 0.8]])
    sh = probe_sh(context, points, order=2, samples=2048)
    expected = np.zeros((2, 9, 3))
    expected[:, 0] = radiance / Y00
    agrees(sh, expected, 0.03, absolute=2e-3 * radiance)
    agrees(irradiance_at(context, [[1, 0.2, 0.1]], [[-1.0, 0, 0]], 2048), np.pi * radiance, 0.03)


def test_furnace_with_a_fixed_number_of_bounces_is_the_partial_sum():
    """L = Le·Σ ρ^k to the last bounce, without any noise from Russian roulette."""
    context = LightContext(build.cube_furnace(0.5, emission=1.0))
    for bounces in range(4):
        estimate = irradiance_at(context, [[0, 0, 1.0]], down(), 2048, bounces=bounces)
        agrees(estimate, np.pi * (2 - 0.5**bounces), 0.01)


def test_unit_sphere_with_its_light_at_the_centre():
    """ρ = ½, I = π: π direct and π indirect on the wall."""
    context = LightContext(build.integrating_sphere(subdivisions=5))
    rows = np.arange(0, context.geometry.count, context.geometry.count // 16)
    points, normals = context.geometry.triangles_world[rows].mean(axis=1), context.geometry.normals_world[rows]
    # The faceted sphere is smaller than the sphere by less than two parts in a thousand.
    agrees(irradiance_at(context, points, normals, 4096), np.pi, 0.01, absolute=0.002 * np.pi)
    agrees(irradiance_at(context, points, normals, 4096, direct=True), 2 * np.pi, 0.01, absolute=0.004 * np.pi)
    agrees(irradiance_at(context, points, normals, 512, direct=True, bounces=0), np.pi, 0.01, absolute=0.002 * np.pi)


@pytest.mark.parametrize("position", [(0.5, 0.3, 0.1), (-0.6, 0.0, 0.6)])
def test_integrating_sphere_for_any_source_position(position):
    """E_ind = Φ/(4πR²)·ρ/(1−ρ) all over the wall, wherever the lamp stands."""
    context = LightContext(build.integrating_sphere(0.8, intensity=1.0, light_position=position, subdivisions=5))
    rows = np.arange(0, context.geometry.count, context.geometry.count // 8)
    points, normals = context.geometry.triangles_world[rows].mean(axis=1), context.geometry.normals_world[rows]
    agrees(irradiance_at(context, points, normals, 8192), 4.0, 0.02, absolute=0.015)


@pytest.mark.parametrize("scene", [build.closed_box(0.5, light_position=(0.6, -0.4, 0.1)),
                                   build.integrating_sphere(0.7, 1.0, light_position=(0.2, 0, 0.6), subdivisions=1)],
                         ids=["box", "faceted sphere"])
def test_any_closed_room_keeps_its_energy(scene):
    """Mean indirect irradiance over the walls of any closed room of one albedo is Φ/A·ρ/(1 − ρ) exactly."""
    context = LightContext(scene)
    geometry = context.geometry
    albedo, intensity = float(scene.materials[0].albedo.constant[0]), float(scene.lights[0].intensity[0])
    u = sobol_owen(2048, 3, 3)
    rows = np.minimum(np.searchsorted(np.cumsum(geometry.areas) / geometry.areas.sum(), u[:, 0]), geometry.count - 1)
    root = np.sqrt(u[:, 1])
    points = geometry.points(rows, root * (1 - u[:, 2]), root * u[:, 2])
    mean, error = pooled(irradiance_at(context, points, geometry.normals_world[rows], 32).mean[:, 0])
    expected = 4 * np.pi * intensity / geometry.areas.sum() * albedo / (1 - albedo)
    assert error < 0.01 * expected and mean == pytest.approx(expected, abs=6 * error)


def emissive_to_receiver(emitter, points, normals, samples=16):
    """Mean form factor from ``points`` to an emissive mesh of radiance 1 among nothing else, and its standard error."""
    context = LightContext(build.scene([emitter], [build.material("glow", 0.0, 1.0)]))
    return pooled(irradiance_at(context, points, normals, samples).mean[:, 0] / np.pi)


@pytest.mark.parametrize(("normal", "form_factor"), [((0, 0, 1), 0.199825), ((1, 0, 0), 0.200044)], ids=["opposite", "adjacent"])
def test_form_factors_of_a_unit_cubes_faces(normal, form_factor):
    """From the face z = 0, and from the face x = 0, of the unit cube to the face z = 1."""
    ceiling = build.mesh("ceiling", [[0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]], [[0, 1, 2], [0, 2, 3]])
    uv = sobol_owen(4096, 2, 9).astype(float)
    points = np.insert(uv, 2 if normal[2] else 0, 0.0, axis=1)
    mean, error = emissive_to_receiver(ceiling, points, np.tile(np.float32(normal), (len(points), 1)))
    assert error < 0.01 * form_factor and mean == pytest.approx(form_factor, abs=min(6 * error, 0.003 * form_factor))


def test_form_factor_of_coaxial_disks():
    """Unit disks at distance 1: 0.381966 = (3 − √5)/2."""
    angle = np.arange(512) * (2 * np.pi / 512)
    rim = np.stack([np.cos(angle), np.sin(angle), np.ones(512)], axis=1)
    fan = np.stack([np.zeros(512, int), 1 + np.arange(512), 1 + (np.arange(512) + 1) % 512], axis=1)
    disk = build.mesh("disk", np.concatenate([[[0, 0, 1.0]], rim]), fan)
    points = np.concatenate([disk_from_square(sobol_owen(4096, 2, 4)), np.zeros((4096, 1), np.float32)], axis=1)
    mean, error = emissive_to_receiver(disk, points, np.tile(np.float32([0, 0, 1]), (4096, 1)))
    assert error < 0.004 and mean == pytest.approx((3 - 5**0.5) / 2, abs=min(6 * error, 0.0012))


def test_emitters_shine_from_both_faces():
    glow = build.material("glow", 0.0, 1.0)
    context = LightContext(build.scene([build.plane("disk", 1.0)], [glow]))
    both = irradiance_at(context, [[0, 0, 1.0], [0, 0, -1.0]], [[0, 0, -1.0], [0, 0, 1.0]], 512)
    assert both.mean[0, 0] == pytest.approx(both.mean[1, 0], rel=0.02) and both.mean[0, 0] > 1.0


@pytest.mark.parametrize("height", [0.1, 1.0, 10.0])
def test_one_bounce_off_an_infinite_plane(height):
    """A point lamp I at height h over albedo ρ, seen from itself: E = 2ρI/(5h²)."""
    scene = replace(build.open_plane(0.7, world=0.0, half_size=100 * height), lights=(build.point_light((0, 0, height), 3.0),))
    estimate = irradiance_at(LightContext(scene), [[0, 0, height]], down(), 1 << 14, bounces=1)
    agrees(estimate, 2 * 0.7 * 3.0 / (5 * height**2), 0.005)


def test_point_lamp_and_sun_by_distance_and_cosine_and_behind_a_wall():
    normal = np.array([0.6, 0.0, 0.8])
    wall = build.plane("wall", 1.0, 5.0)
    scene = build.scene([wall], lights=[build.point_light((0, 0, 3.0), 2.0)])
    points = np.array([[0, 0, 0], [0, 0, 10.0]])
    result = irradiance_at(LightContext(scene), points, [normal, [0, 0, -1]], 16, direct=True, bounces=0)
    np.testing.assert_allclose(result.mean[:, 0], [2.0 / 9.0 * 0.8, 0.0], rtol=1e-5)
    lamp = SunLight("sun", np.array([0, 0, -1.0]), np.float32([1, 2, 3]))
    scene = build.scene([wall], lights=[lamp])
    result = irradiance_at(LightContext(scene), [[0, 0, 0], [3.0, 0, 0], [0, 0, 6.0]], [normal] * 3, 16, direct=True, bounces=0)
    np.testing.assert_allclose(result.mean, np.outer([0, 0.8, 0.8], [1, 2, 3]), rtol=1e-5)
    scene = replace(scene, lights=(replace(lamp, casts_shadow=False),))
    result = irradiance_at(LightContext(scene), [[0, 0, 0]], [normal], 16, direct=True, bounces=0)
    np.testing.assert_allclose(result.mean, [[0.8, 1.6, 2.4]], rtol=1e-5)


def test_an_area_lamp_and_the_same_emissive_square_light_alike():
    """A rectangle lamp that faces down against an emissive mesh of its shape, over a floor that reflects once."""
    lamp = AreaLight("area", np.array([0, 0, 1.0]), np.array([0.5, 0, 0]), np.array([0, 0.5, 0]), down()[0], np.ones(3))
    floor = build.plane("floor", 3.0)
    by_lamp = LightContext(build.scene([floor], [build.material("grey", 0.6)], lights=[lamp]))
    by_mesh = LightContext(build.scene([floor, build.plane("glow", 0.5, 1.0, 1)],
                                       [build.material("grey", 0.6), build.material("glow", 0.0, 1.0)]))
    points, normals = np.float32([[1.2, 0.3, 0.5], [0.9, 0, 0.2]]), down(2)
    first = irradiance_at(by_lamp, points, normals, 8192, bounces=1)
    second = irradiance_at(by_mesh, points, normals, 8192, bounces=1)
    error = np.hypot(first.standard_error, second.standard_error)
    assert np.all(error < 0.01 * first.mean) and np.all(np.abs(first.mean - second.mean) < 6 * error)


def test_lamps_are_never_seen_themselves():
    context = LightContext(replace(build.closed_box(0.0), lights=(build.point_light(intensity=100.0),)))
    assert not probe_sh(context, [[0.2, 0, 0]], 1, 512).mean.any()


def test_many_lamps_are_chosen_without_bias():
    """A floor under 30 lamps of very different strength and distance equals the sum over lamps taken one at a time."""
    rng = np.random.default_rng(6)
    lamps = [build.point_light((*rng.uniform(-4, 4, 2), rng.uniform(0.5, 4)), rng.uniform(0.1, 5)) for _ in range(30)]
    scene = build.open_plane(0.5, world=0.0, half_size=30.0)
    points, normals = np.float32([[0, 0, 0], [3, -2, 0]]), -down(2)
    together = irradiance_at(LightContext(replace(scene, lights=tuple(lamps))), points, normals, 1 << 13, direct=True, bounces=0)
    single = sum(irradiance_at(LightContext(replace(scene, lights=(lamp,))), points, normals, 8, direct=True, bounces=0).mean
                 for lamp in lamps)
    agrees(together, single, 0.01)


def test_uniform_sky_over_a_grey_floor():
    """πL from above, ρπL from below, at L1 and beyond."""
    context = LightContext(build.open_plane(0.25, world=2.0, half_size=1000.0))
    result = irradiance_at(context, [[0, 0, 1.0]] * 2, [[0, 0, 1.0], [0, 0, -1.0]], 256)
    np.testing.assert_allclose(result.mean[:, 0], [2 * np.pi, 0.5 * np.pi], rtol=1e-3)


def test_a_sun_in_the_world_is_found_by_shadow_rays():
    """The irradiance of a map with a few blinding texels against quadrature; behind a wall only the other half is left."""
    pixels = np.full((32, 64, 3), 0.5, np.float32)
    pixels[26, 16:18] = 4000.0
    scene = replace(build.scene([build.plane("far", 0.01, -100.0)], [build.material("black", 0.0)]), world=World(pixels))
    context = LightContext(scene)
    assert 0 < context.environment.bright.count < 10
    normal = np.float32([[0, 0.6, 0.8]])
    azimuth, latitude = np.meshgrid((0.5 - (np.arange(1024) + 0.5) / 1024) * 2 * np.pi,
                                    ((np.arange(512) + 0.5) / 512 - 0.5) * np.pi)
    directions = np.stack([np.cos(latitude) * np.cos(azimuth), np.cos(latitude) * np.sin(azimuth), np.sin(latitude)], -1)
    cosine = np.maximum(directions.reshape(-1, 3) @ normal[0], 0) * (np.cos(latitude) * 2 * np.pi**2 / (512 * 1024)).ravel()
    expected = cosine @ context.environment.radiance(directions.reshape(-1, 3).astype(np.float32))
    agrees(irradiance_at(context, [[0, 0, 0]], normal, 4096), expected, 0.005, absolute=2e-3 * expected[0])
    roof = replace(scene, meshes=(build.plane("roof", 50.0, 1.0),))
    shaded = irradiance_at(LightContext(roof), [[0, 0, 0]], normal, 1024)
    assert np.all(shaded.mean < 0.5 * np.pi)


def test_probe_sees_the_whole_world_once():
    """The constant coefficient of an open probe is the map's mean, bright part included, not counted twice."""
    pixels = np.full((16, 32, 3), 0.5, np.float32)
    pixels[12, 7] = 3000.0
    scene = replace(build.scene([build.plane("far", 0.001, -100.0)], [build.material("black", 0.0)]), world=World(pixels))
    latitude = ((np.arange(16) + 0.5) / 16 - 0.5) * np.pi
    fine = LightContext(scene).environment.bright.irradiance_estimate[0]
    base = 4 * np.pi * 0.5
    assert fine == pytest.approx(3000 * np.cos(latitude[12]) * 2 * np.pi**2 / 512, rel=0.01)
    agrees(probe_sh(LightContext(scene), [[0, 0, 0]], 0, 4096), (base + fine) * Y00, 0.01, absolute=0.01 * fine * Y00)


def test_radiance_along_given_rays():
    """Emission, the world with its bright part, and one reflection of a point lamp, each exact along a single ray."""
    scene = replace(build.open_plane(0.5, world=3.0, half_size=50.0), lights=(build.point_light((0, 0, 2.0), np.pi),))
    context = LightContext(scene)
    origins = np.tile(np.float32([0, 0, 1]), (3, 1))
    result = trace_radiance(context, origins, np.float32([[0, 0, 5], [0, 0, -0.1], [1, 0, 0.5]]), bounces=1)
    # The floor below: lamp I·ρ/π/h² plus the sky's ρ·L.
    np.testing.assert_allclose(result[:, 0], [3.0, 0.5 / 4 + 0.5 * 3.0, 3.0], rtol=1e-4)
    glow = LightContext(build.scene([build.plane()], [build.material("glow", 0.3, 4.0)]))
    np.testing.assert_allclose(trace_radiance(glow, origins[:1], down(), bounces=0), [[4, 4, 4]])
    assert trace_radiance(glow, np.zeros((0, 3)), np.zeros((0, 3))).shape == (0, 3)


def test_bright_texels_are_not_counted_again_behind_a_bounce():
    """A white floor under a small blinding sky patch: what it reflects is ρ/π times the patch's irradiance, found once."""
    pixels = np.zeros((32, 64, 3), np.float32)
    pixels[28:, :] = 200.0
    scene = replace(build.open_plane(0.8, half_size=100.0), world=World(pixels))
    context = LightContext(scene)
    n = 60_000
    result = trace_radiance(context, np.tile(np.float32([0, 0, 1]), (n, 1)), down(n), bounces=1)[:, 0]
    u = (np.arange(4000) + 0.5) / 4000
    angle = u * np.pi / 2
    ring = np.stack([np.cos(angle), 0 * angle, np.sin(angle)], axis=1).astype(np.float32)
    irradiance = np.sum(context.environment.radiance(ring)[:, 0] * np.sin(angle) * np.cos(angle)) * 2 * np.pi * (np.pi / 2 / 4000)
    mean, error = pooled(result)
    assert context.environment.bright.count and mean == pytest.approx(0.8 / np.pi * irradiance, abs=6 * error)
    assert error < 0.01 * mean


def test_light_passes_through_cut_outs_and_half_through_blends():
    lamp = build.point_light((0, 0, 2.0), 1.0)
    for material, share in ((Material("cut", alpha=Channel.of(0.2), alpha_threshold=0.5), 1.0),
                            (Material("half", alpha=Channel.of(0.25)), 0.75), (Material("solid"), 0.0)):
        context = LightContext(build.scene([build.plane("sheet", 1.0, 1.0)], [replace(material, albedo=Channel.of(0.0))], [lamp]))
        points = np.zeros((4096, 3))
        points[:, :2] = np.random.default_rng(0).uniform(-0.01, 0.01, (4096, 2))
        result = irradiance_at(context, points, -down(4096), 8, direct=True, bounces=0)
        assert result.mean[:, 0].mean() == pytest.approx(0.25 * share, abs=0.006)


def test_a_room_without_a_lamp_stays_exactly_dark():
    """Two closed boxes side by side, one lit: nothing, not even rounding, gets into the other."""
    lit, dark = build.cube("lit", 1.0, inward=True), build.cube("dark", 1.0, inward=True)
    dark = replace(dark, vertices_local=dark.vertices_local + np.float32([2.0, 0, 0]))
    context = LightContext(build.scene([lit, dark], [build.material("white", 0.9)], [build.point_light((0.9, 0, 0), 10.0)]))
    points = np.float32([[2, 0, 0], [1.001, 0, 0], [1.001, 0.99, 0.99]])
    assert not probe_sh(context, points, 2, 4096).mean.any()


def test_seeds_differ_and_threads_do_not():
    scene = replace(build.cube_furnace(0.6), lights=(build.point_light(), build.point_light((0.5, 0, 0))))
    points = np.random.default_rng(0).uniform(-0.9, 0.9, (40, 3))
    results = [probe_sh(LightContext(scene, threads), points, 2, 1024, seed=5) for threads in (1, 2, 3)]
    assert len({estimate.mean.tobytes() + estimate.standard_error.tobytes() for estimate in results}) == 1
    assert probe_sh(LightContext(scene), points, 2, 1024, seed=6).mean.tobytes() != results[0].mean.tobytes()
    origins, directions = np.zeros((40_000, 3), np.float32), np.random.default_rng(1).normal(size=(40_000, 3)).astype(np.float32)
    assert len({trace_radiance(LightContext(scene, threads), origins, directions, seed=2).tobytes() for threads in (1, 3)}) == 1


def test_standard_errors_are_honest():
    """Over many points the squared z-scores average about F(1, 7)'s 7/5, and more samples mean smaller errors."""
    context = LightContext(build.closed_box(0.5))
    points = np.random.default_rng(4).uniform(-0.8, 0.8, (64, 3))
    coarse, fine = (probe_sh(context, points, 0, samples, seed=samples) for samples in (64, 2048))
    z = (coarse.mean - fine.mean)[:, 0, 0] / coarse.standard_error[:, 0, 0]
    assert 0.8 < np.mean(z**2) < 2.3
    assert fine.standard_error.mean() < 0.25 * coarse.standard_error.mean()
