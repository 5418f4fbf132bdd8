"""The gather from reflective shadow maps: closed forms, the sampled sum against the whole, and what lies behind a baffle."""

from dataclasses import replace

import numpy as np
import pytest
import room_scenes as rooms
import scene_builders as build
from shadow_maps import prepared

from rtgi_addon.numerics import sh
from rtgi_addon.scene import AreaLight, Medium, SpotLight, SunLight
from rtgi_addon.techniques.rsm.gather import Pattern, _sample, gather, gather_every_texel, gather_sh, rotations
from rtgi_addon.transport.media.tracer import MediaAlone
from rtgi_addon.transport.paths.reference import irradiance_at

STRENGTH = np.array([1.0, 2.0, 3.0], np.float32)
DOWN = np.array([0.0, 0.0, -1.0])
HEIGHT, ALBEDO = 0.7, 0.5


def over_a_plane(light):
    """A plane too large to see its end, and a lamp."""
    return build.scene([build.plane("ground", 400.0)], [build.material("ground", ALBEDO)], [light])


def facing_down(height=HEIGHT):
    """One receiver at the lamps' place that looks down."""
    return np.float32([[0, 0, height]]), np.float32([[0, 0, -1]])


SPOT = SpotLight("spot", np.array([0, 0, HEIGHT]), DOWN, STRENGTH, 1.6)
PANEL = AreaLight("panel", np.array([0, 0, HEIGHT]), np.array([0.01, 0, 0]), np.array([0, 0.01, 0]), DOWN, STRENGTH)
# ∫ cos^n over what the lamp reaches: radiance ρE/π seen by a receiver at the lamp that faces the plane.
EXACT = {
    "point": (build.point_light((0, 0, HEIGHT), STRENGTH), 2 * ALBEDO / (5 * HEIGHT**2)),
    "spot": (SPOT, 2 * ALBEDO / (5 * HEIGHT**2) * (1 - np.cos(0.8) ** 5)),
    "small area lamp": (PANEL, ALBEDO * PANEL.area / (3 * HEIGHT**2)),
}


@pytest.mark.parametrize("name", EXACT)
def test_a_lamp_over_a_plane(name):
    light, factor = EXACT[name]
    context, maps = prepared(over_a_plane(light), 128 if name != "spot" else 512)
    exact = factor * STRENGTH
    points, normals = facing_down()
    assert gather_every_texel(maps, points, normals)[0] == pytest.approx(exact, rel=3e-3)
    assert gather_every_texel(maps, points, normals, tracer=context.tracer)[0] == pytest.approx(exact, rel=3e-3)
    sampled = [gather(maps, points, normals, Pattern(seed=seed))[0] for seed in range(16)]
    assert np.mean(sampled, axis=0) == pytest.approx(exact, rel=0.02)
    assert np.all(np.std(sampled, axis=0) < 0.08 * exact)


def test_a_sun_over_a_plane():
    """E = ρ·S·cosθ below nothing but a plane; it ends where little is missing at this height."""
    direction = np.array([0.6, 0.0, -0.8])
    scene = build.scene([build.plane("ground", 50.0)], [build.material("ground", ALBEDO)], [SunLight("sun", direction, STRENGTH)])
    _, maps = prepared(scene, 512)
    points, normals = facing_down(2.0)
    assert gather_every_texel(maps, points, normals)[0] == pytest.approx(ALBEDO * 0.8 * STRENGTH, rel=8e-3)


def test_no_texel_gives_more_than_its_exitance():
    """Right on a lit plane's texels a receiver sees no more than the plane's exitance ρ·S, where points would have a pole."""
    scene = build.scene([build.plane("ground", 1.0)], [build.material("ground", ALBEDO)], [SunLight("sun", DOWN, STRENGTH)])
    _, maps = prepared(scene, 64)
    rng = np.random.default_rng(0)
    points = np.concatenate([rng.uniform(-0.5, 0.5, (200, 2)), 10.0 ** rng.uniform(-6, -2, (200, 1))], axis=1).astype(np.float32)
    irradiance = gather_every_texel(maps, points, np.tile(np.float32([[0, 0, -1]]), (200, 1)))
    assert np.all(irradiance <= 1.3 * ALBEDO * STRENGTH) and np.isfinite(irradiance).all()


@pytest.fixture(scope="module")
def room():
    """A box with a block in it: context, maps, and receivers on all surfaces."""
    context, maps = prepared(rooms.many_lamps(2), 128, 200)
    rng = np.random.default_rng(3)
    primitive = rng.integers(0, context.geometry.count, 96)
    uv = rng.random((96, 2))
    uv = np.where(uv.sum(axis=1, keepdims=True) > 1, 1 - uv, uv).astype(np.float32)
    return context, maps, context.geometry.points(primitive, *uv.T), context.geometry.normals_world[primitive]


@pytest.mark.parametrize("settings", [{}, {"disk_share": 0.0}, {"disk_share": 1.0, "disk_radius": 1.5}, {"disk_radius": 0.05}])
def test_the_sampled_gather_has_the_mean_of_the_whole(room, settings):
    _, maps, points, normals = room
    exact = gather_every_texel(maps, points, normals).astype(np.float64)
    sampled = np.stack([gather(maps, points, normals, Pattern(seed=seed, **settings)) for seed in range(24)]).astype(np.float64)
    mean, error = sampled.mean(axis=(1, 2)), sampled.mean(axis=(1, 2)).std(ddof=1) / np.sqrt(24)
    assert abs(mean.mean() - exact.mean()) < 4 * error + 1e-4 * exact.mean()
    assert error < 0.02 * exact.mean()


def test_more_samples_err_less(room):
    context, _, points, normals = room
    errors = []
    for samples in (64, 4096):
        _, maps = prepared(context.scene, 128, samples)
        exact = gather_every_texel(maps, points, normals)
        errors.append(np.sqrt(np.mean((gather(maps, points, normals, Pattern(samples)) - exact) ** 2)) / exact.mean())
    assert errors[1] < 0.25 * errors[0]


def test_the_papers_disk_alone_misses_what_lies_outside_it(room):
    _, maps, points, normals = room
    exact = gather_every_texel(maps, points, normals).mean()
    assert gather(maps, points, normals, Pattern(disk_share=1.0, disk_radius=0.3)).mean() < 0.9 * exact


def test_weights_in_the_disk_are_proportional_to_xi_squared(room):
    points = room[2]
    _, maps = prepared(room[0].scene, 128, 4000)
    pattern = Pattern(disk_share=1.0, disk_radius=1.5)
    texels, weight = _sample(maps[0], points[:1], pattern)
    size = maps[0].view.resolution
    uv, _ = maps[0].view.project(texels[0, :, :3])
    radius = np.linalg.norm(uv - maps[0].centres(points[:1]), axis=1)
    far = (weight[0] > 0) & (radius > 20 / size)
    assert far.sum() > 10
    expected = 3 * np.pi * 1.5**2 * (radius[far] / 1.5) ** (4 / 3) * size**2 / maps[0].samples
    assert weight[0, far] == pytest.approx(expected, rel=0.1)


def test_behind_a_baffle_only_the_visibility_test_gives_nothing():
    """The dark one of two rooms: the exact answer is 0, and the paper's gather has no way to know (docs/physics.md §2)."""
    context, maps = prepared(rooms.two_rooms(), 128)
    points = np.float32([[1.0, 0, 0], [1.5, 0.5, 0.3], [0.5, -0.5, -0.5]])
    normals = np.float32([[-1, 0, 0], [0, 0, 1], [-1, 0, 0]])
    for seed in range(3):
        assert gather(maps, points, normals, Pattern(seed=seed)).min() > 0.01
        assert not gather(maps, points, normals, Pattern(seed=seed), tracer=context.tracer).any()
    assert gather_every_texel(maps, points, normals).min() > 0.01
    assert not gather_every_texel(maps, points, normals, tracer=context.tracer).any()
    assert not gather_sh(maps, points, 2, Pattern(), tracer=context.tracer).any()


def test_with_visibility_it_is_the_paths_first_bounce(room):
    context, maps, points, normals = room
    reference = irradiance_at(context, points, normals, 2048, bounces=1)
    whole = gather_every_texel(maps, points, normals, tracer=context.tracer)
    mean = reference.mean.mean()
    noise = np.sqrt(np.mean(reference.standard_error**2))
    assert np.sqrt(np.mean((whole - reference.mean) ** 2)) < 0.05 * mean + 2 * noise
    assert whole.mean() == pytest.approx(mean, rel=0.01)
    assert gather_every_texel(maps, points, normals).mean() > 1.005 * mean


def test_in_a_convex_room_nothing_is_hidden():
    context, maps = prepared(build.closed_box(light_position=(0.3, 0.2, 0.4)), 64)
    rng = np.random.default_rng(0)
    points, normals = rng.uniform(-0.8, 0.8, (40, 3)).astype(np.float32), rng.normal(size=(40, 3))
    normals = (normals / np.linalg.norm(normals, axis=1, keepdims=True)).astype(np.float32)
    free, tested = (gather(maps, points, normals, Pattern(), tracer=tracer) for tracer in (None, context.tracer))
    assert tested == pytest.approx(free, rel=1e-5)


def test_sh_holds_the_bands_of_irradiance(room):
    """E_lm = A_l · L_lm: the projection of irradiance over many normals against the one of radiance."""
    _, maps = prepared(room[0].scene, 48, 200)
    points = np.float32([[0.2, 0.1, 0.1], [-0.4, 0.3, -0.2]])
    normals, solid_angles = sh.quadrature(24)
    flat = np.repeat(points, len(normals), axis=0), np.tile(normals.astype(np.float32), (2, 1))
    for whole in (True, False):
        if whole:
            irradiance, radiance = gather_every_texel(maps, *flat), gather_every_texel(maps, points, None, order=2)
        else:
            irradiance, radiance = gather(maps, *flat, Pattern()), gather_sh(maps, points, 2, Pattern())
        measured = np.einsum("pnc,nk,n->pkc", irradiance.reshape(2, -1, 3), sh.evaluate(normals, 2), solid_angles)
        exact = radiance * sh.cosine_coefficients(2)[:, None]
        assert measured == pytest.approx(exact, abs=float(5e-3 * np.abs(exact).max()))


def test_rows_do_not_depend_on_each_other_or_on_threads(room):
    context, maps, points, normals = room
    for tracer in (None, context.tracer):
        one = gather(maps, points, normals, Pattern(), tracer=tracer, threads=1)
        assert np.array_equal(one, gather(maps, np.tile(points, (9, 1)), np.tile(normals, (9, 1)), Pattern(), tracer=tracer,
                                          threads=2)[-96:])
        assert np.array_equal(one[7:9], gather(maps, points[7:9], normals[7:9], Pattern(), tracer=tracer))


def test_every_receiver_turns_the_pattern_by_its_own_place():
    points = np.float32([[0.0, 1.0, 2.0], [-0.0, 1.0, 2.0], [0.0, 1.0, 2.0001]])
    turned = rotations(points, 5)
    assert np.array_equal(turned[0], turned[1]) and not np.any(turned[0] == turned[2])
    assert not np.array_equal(turned, rotations(points, 6))
    many = rotations(np.random.default_rng(0).random((4096, 3)).astype(np.float32), 1)
    assert many.min() >= 0 and many.max() < 1 and many.mean(axis=0) == pytest.approx(0.5, abs=0.03)


def test_receivers_in_odd_places_get_finite_numbers(room):
    """On a lamp, on a texel, behind a spot, far away: no NaN and nothing negative."""
    context, maps, _, _ = room
    points = np.concatenate([[light.position_world for light in context.scene.lights], maps[0].rows[:3, :3],
                             [[0, 0, 0], [1e6, 0, 0], [1, 1, 1]]]).astype(np.float32)
    normals = np.tile(np.float32([[0, 0, 1]]), (len(points), 1))
    for tracer in (None, context.tracer):
        irradiance = gather(maps, points, normals, Pattern(), tracer=tracer)
        assert np.isfinite(irradiance).all() and irradiance.min() >= 0
    _, behind = prepared(over_a_plane(SPOT), 32)
    assert np.isfinite(gather(behind, *facing_down(5.0), Pattern())).all()


def test_without_maps_there_is_no_light():
    points, normals = facing_down()
    assert not gather((), points, normals, Pattern()).any() and gather_sh((), points, 2, Pattern()).shape == (1, 9, 3)
    assert gather_every_texel((), points, normals).shape == (1, 3)


def test_media_take_of_the_light_on_both_its_ways():
    """A lamp over a plane in fog that absorbs: out and back, the integral of the closed form over rings of the plane."""
    absorption = np.array([0.2, 0.5, 1.0])
    fog = Medium("fog", absorption=absorption)
    context, maps = prepared(replace(over_a_plane(build.point_light((0, 0, HEIGHT), STRENGTH)), media=(fog,)), 256)
    cosine = (np.arange(20000) + 0.5) / 20000
    # E = ∫ L·cos dω with L = ρ/π·I·cos/d² and d = h/cos, dω = 2π·dcos.
    exact = np.mean(2 * ALBEDO / HEIGHT**2 * cosine[:, None] ** 4 * np.exp(-2 * absorption * HEIGHT / cosine[:, None]), axis=0)
    points, normals = facing_down()
    found = gather_every_texel(maps, points, normals, tracer=MediaAlone(context.media))[0]
    assert found == pytest.approx(exact * STRENGTH, rel=5e-3)
