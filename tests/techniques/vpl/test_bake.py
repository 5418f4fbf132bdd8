"""Instant radiosity: closed forms of clamp and bounces, which lights are kept, the shared gather, and what goes wrong."""

from dataclasses import replace

import numpy as np
import pytest
import room_scenes as rooms
import scene_builders as build

from rtgi_addon import techniques
from rtgi_addon.errors import BakeError
from rtgi_addon.numerics import sh
from rtgi_addon.numerics.sampling import sobol_owen
from rtgi_addon.progress import Progress
from rtgi_addon.scene import Material
from rtgi_addon.techniques.kernels import NUMPY
from rtgi_addon.techniques.vpl.cells import nearest
from rtgi_addon.techniques.vpl.gather import gather, gather_sh, gather_visible, visibility
from rtgi_addon.techniques.vpl.sampling import systematic
from rtgi_addon.techniques.vpl.virtual_lights import VirtualLights, concatenate
from rtgi_addon.transport.context import LightContext
from rtgi_addon.transport.paths.reference import irradiance_at
from rtgi_addon.transport.views.reflective_shadow_map import capture
from rtgi_addon.transport.views.shadow_views import views_of

VPL = techniques.get("vpl")


def bake(scene, seed=0, threads=None, **settings):
    return VPL.bake(scene, VPL.Settings(**settings), np.random.default_rng(seed), Progress(), threads=threads)


def on_walls(scene, count=128, seed=1):
    """Points on what is seen from about the origin, with normals towards it."""
    context = LightContext(scene)
    directions = np.random.default_rng(seed).normal(size=(count, 3)).astype(np.float32)
    hits = context.tracer.intersect(np.full((count, 3), 0.01, np.float32), directions)
    normals = context.geometry.normals_world[hits.primitive]
    points = context.geometry.points(hits.primitive, hits.u, hits.v)
    return points, normals * -np.sign(np.sum(normals * directions, axis=1, keepdims=True))


def glowing_plane(count=1 << 16, half_size=20.0):
    """VPLs that make up a plane z = 0 of radiosity π, denser towards the origin."""
    u = sobol_owen(count, 2, 1).astype(np.float64)
    radius, angle = half_size * u[:, 0] ** 2, 2 * np.pi * u[:, 1]
    area = np.pi * 4 * half_size**2 * u[:, 0] ** 3 / count
    positions = np.stack([radius * np.cos(angle), radius * np.sin(angle), np.zeros(count)], axis=1)
    return VirtualLights.of(positions, np.tile([[0, 0, 1]], (count, 1)), np.repeat(np.pi * area[:, None], 3, axis=1))


@pytest.mark.parametrize("height, bound, loss", [(0.1, 10.0, 0.4676), (0.2, 4.0, 0.36), (0.5, 1.0, 0.25), (1.0, 2.0, 0.0)])
def test_a_clamp_takes_from_a_plane_what_the_closed_form_says(height, bound, loss):
    lights, points, normals = glowing_plane(), np.float32([[0, 0, height]]), np.float32([[0, 0, -1]])
    whole = gather_visible(lights, points, normals, None, None)
    assert whole[0, 0] == pytest.approx(np.pi, rel=4e-3)
    cut = gather_visible(lights, points, normals, None, bound)
    assert 1 - cut[0, 0] / whole[0, 0] == pytest.approx(loss, abs=3e-3)


def test_gathers_agree_and_see_only_what_is_not_hidden():
    context = LightContext(rooms.two_rooms())
    rng = np.random.default_rng(0)
    points = rng.uniform([0.1, -0.9, -1], [1.9, 0.9, -1], (64, 3)).astype(np.float32)
    points[::2, 0] *= -1
    normals = np.tile(np.float32([[0, 0, 1]]), (64, 1))
    positions = rng.uniform([0.1, -0.9, -0.9], [1.9, 0.9, 0.9], (3000, 3))
    positions[::2, 0] *= -1
    directions = rng.normal(size=(3000, 3))
    lights = VirtualLights.of(positions, directions / np.linalg.norm(directions, axis=1, keepdims=True), rng.random((3000, 3)))
    seen = visibility(context, lights, points, normals)
    traced = gather(context, lights, points, normals, clamp=50.0)
    assert np.allclose(NUMPY.vpl_gather(lights, points, normals, seen, 50.0), traced, rtol=1e-3, atol=1e-4)
    assert np.all(gather_visible(lights, points, normals, None, 50.0) >= traced * (1 - 1e-3))
    across = np.sign(points[:, None, 0]) != np.sign(lights.positions[None, :, 0])
    assert seen.any() and not seen[across].any()


def test_sh_at_a_free_point_is_the_radiance_that_the_irradiance_is_made_of():
    context = LightContext(build.closed_box())
    rng = np.random.default_rng(0)
    positions = 0.9 * np.sign(rng.normal(size=(500, 3))) * rng.random((500, 3))
    lights = VirtualLights.of(positions, -positions / np.linalg.norm(positions, axis=1, keepdims=True), rng.random((500, 3)))
    lights = lights.with_distant([[0, 0.6, 0.8]], [[1, 2, 3]])
    point, normals = np.zeros((1, 3), np.float32), sh.quadrature(6)[0].astype(np.float32)
    coefficients = gather_sh(context, lights, point, 8)
    irradiance = gather(context, lights, np.tile(point, (len(normals), 1)), normals, shadows=True)
    assert np.allclose(sh.irradiance(coefficients[0], normals), irradiance, atol=0.02 * irradiance.max())
    # The room is closed: nothing arrives from afar.
    assert not gather(context, lights.take(slice(0, 0)), point, normals[:1]).any()


def test_compensation_gives_back_what_a_strong_clamp_took():
    corner = build.closed_box(0.6, 1.0)
    points = np.float32([[0.9, y, -1] for y in np.linspace(-0.8, 0.8, 32)])
    normals = np.tile(np.float32([[0, 0, 1]]), (32, 1))
    exact = irradiance_at(LightContext(corner), points, normals, 4096).mean.mean()
    cut = bake(corner, clamp=2.0, compensation=False)
    mended = bake(corner, clamp=2.0, compensation=True, compensation_rays=256)
    loss = 1 - cut.irradiance(points, normals).mean() / exact
    assert loss > 0.1 and abs(1 - mended.irradiance(points, normals).mean() / exact) < 0.15 * loss
    assert cut.stats["clamp_loss"] > 0.02 and cut.stats["clamp"] == 2.0
    probes = [np.mean([grid.sh[..., 0, :] for grid in field.grids()]) for field in (cut, mended, bake(corner, clamp=0.0))]
    assert abs(probes[1] - probes[2]) < 0.5 * abs(probes[0] - probes[2]) + 0.01 * probes[2]


@pytest.mark.slow
def test_each_kind_of_light_agrees_with_the_path_reference():
    for scene in (rooms.panel_room(), rooms.courtyard(), rooms.many_lamps(), rooms.textured_room()):
        points, normals = on_walls(scene) if scene.name != "courtyard" else (
            np.random.default_rng(0).uniform([-1, -1, 0], [0.2, 1, 0], (128, 3)).astype(np.float32),
            np.tile(np.float32([[0, 0, 1]]), (128, 1)))
        reference = irradiance_at(LightContext(scene), points, normals, 1024)
        measured = bake(scene).irradiance(points, normals)
        error = np.abs(measured - reference.mean).sum(axis=1) / reference.mean.sum(axis=1)
        assert np.median(error) < 0.06, scene.name
        assert measured.mean() == pytest.approx(reference.mean.mean(), rel=0.03), scene.name


def test_a_dark_room_next_door_stays_exactly_black():
    scene = rooms.two_rooms()
    field = bake(scene)
    grid, = field.grids()
    assert grid.sh[..., :2, :, :].any() and not grid.sh[:, :, 2:].any()
    assert field.lights.positions[:, 0].max() < 0


def test_texels_of_a_shadow_map_serve_as_virtual_lights():
    scene = build.closed_box(0.5)
    context = LightContext(scene)
    points, normals = on_walls(scene, 64)
    parts = []
    for view in views_of(context, 0, 48):
        texels = capture(context, view).lights()
        parts.append(VirtualLights.of(texels.positions + 1e-5 * texels.normals, texels.normals, texels.flux))
    measured = gather(context, concatenate(parts), points, normals, clamp=100.0)
    field = bake(scene, bounces=1)
    assert np.median(np.abs(measured / field.irradiance(points, normals) - 1)) < 0.03
    assert measured.mean() == pytest.approx(field.irradiance(points, normals).mean(), rel=0.02)


def test_the_number_of_lights_is_kept_and_error_falls_with_it():
    scene = rooms.panel_room()
    points, normals = on_walls(scene)
    reference = irradiance_at(LightContext(scene), points, normals, 2048).mean
    errors = []
    for lights in (128, 4096):
        field = bake(scene, lights=lights)
        assert abs(field.stats["lights"] - lights) <= 1
        errors.append(np.median(np.abs(field.irradiance(points, normals) - reference) / reference))
    assert errors[1] < 0.5 * errors[0]


def test_the_same_seed_gives_the_same_bytes_for_any_number_of_threads():
    scene = rooms.sun_patch_room()
    points, normals = on_walls(scene, 50)
    one, three = bake(scene, threads=1), bake(scene, threads=3)
    assert all(np.array_equal(a, b) for a, b in zip(one.arrays().values(), three.arrays().values(), strict=True))
    assert np.array_equal(one.irradiance(points, normals), three.irradiance(points, normals))
    assert np.array_equal(one.grids()[0].sh, three.grids()[0].sh)
    assert not np.array_equal(one.lights.positions, bake(scene, seed=1).lights.positions)


def test_direct_light_is_added_on_demand():
    scene = build.integrating_sphere(0.5, np.pi, subdivisions=3)
    points, normals = on_walls(scene, 32)
    field = bake(scene, direct=True)
    assert field.includes_direct
    assert field.irradiance(points, normals).mean() == pytest.approx(2 * np.pi, rel=0.03)
    # Eight probes at a distance of √3/4 from the lamp.
    added = field.grids()[0].sh[..., 0, :].mean() - bake(scene).grids()[0].sh[..., 0, :].mean()
    assert added == pytest.approx(np.pi / (3 / 16) * 0.282095, rel=1e-3)


def test_kernels_take_over_the_gather():
    scene = build.closed_box()
    points, normals = on_walls(scene, 40)
    calls = []

    class Recorder:
        def vpl_gather(self, lights, points, normals, visibility, clamp):
            calls.append(visibility.shape)
            return NUMPY.vpl_gather(lights, points, normals, visibility, clamp)

    field = VPL.bake(scene, VPL.Settings(lights=256), np.random.default_rng(0), Progress(), kernels=Recorder())
    expected = bake(scene, lights=256).irradiance(points, normals)
    assert np.allclose(field.irradiance(points, normals), expected, rtol=1e-3) and calls == [(40, field.lights.count)]


def test_no_surviving_light_is_one_clear_error():
    black = replace(build.closed_box(), materials=(build.material("black", 0.0),))
    with pytest.raises(BakeError, match="no virtual light survived"):
        bake(black)
    with pytest.raises(BakeError, match="no virtual light survived"):
        bake(build.closed_box(), bounces=0)
    dark = build.scene([build.plane()], [Material("grey")], [build.point_light((0, 0, 1), 0.0)])
    assert not bake(dark).irradiance(np.zeros((1, 3)), np.float32([[0, 0, 1]])).any()


def test_systematic_choice_keeps_chances_and_counts():
    rng = np.random.default_rng(0)
    chance = rng.random(1000) ** 2
    counts = np.zeros(1000)
    for seed in range(400):
        rows = systematic(chance, rng.permutation(1000), seed)
        assert abs(len(rows) - chance.sum()) <= 1 and np.all(np.diff(rows) > 0)
        counts[rows] += 1
    assert np.abs(counts / 400 - chance).max() < 0.12


@pytest.mark.parametrize("flat", [False, True])
def test_nearest_points_are_those_of_brute_force(flat):
    rng = np.random.default_rng(2)
    points, samples = (rng.normal(size=(n, 3)).astype(np.float32) for n in (700, 2000))
    for array in (points, samples):
        array /= np.linalg.norm(array, axis=1, keepdims=True)
        array[:, 2] *= 0 if flat else 1
    owner, squared = nearest(samples, points)
    exact = ((samples[:, None] - points) ** 2).sum(axis=2)
    assert np.allclose(squared, exact.min(axis=1), atol=1e-6) and np.mean(owner == exact.argmin(axis=1)) > 0.999
