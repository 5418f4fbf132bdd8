"""Surfaces that differ from side to side, from angle to angle, and between the rays that see, light and shadow them."""

from dataclasses import replace

import numpy as np
import pytest
import scene_builders as build
from probe_bakes import bake, coefficients, positions, rms

from rtgi_addon.scene import Channel, Material
from rtgi_addon.transport.context import LightContext
from rtgi_addon.transport.paths import reference as path
from rtgi_addon.transport.paths.from_lights import lamp_paths
from rtgi_addon.transport.surfaces.angles import AngleProfiles
from rtgi_addon.transport.views.reflective_shadow_map import capture
from rtgi_addon.transport.views.shadow_views import views_of

STEPS = 64
# Layer Weight's Facing at a blend of 1/2: 1 − cosθ, whose mean over the cosine-weighted hemisphere is 1/3.
FACING = 3.0 * (1.0 - np.sqrt((np.arange(STEPS) + 0.5) / STEPS))
RIM = np.repeat(FACING[:, None], 3, axis=1).astype(np.float32)


def rays_onto_a_plane(cosines, sides):
    """Rays that meet z = 0 near the origin, one for each pair, and the points they start from."""
    sine = np.sqrt(1.0 - np.square(cosines))
    towards = np.stack([sine, np.zeros_like(sine), np.asarray(cosines) * sides], axis=1).astype(np.float32)
    return towards, -towards


@pytest.mark.parametrize("name", ["albedo", "emission"])
def test_each_side_shows_its_own_under_each_angle(name):
    """A huge plane under a uniform sky of radiance 1: what is seen of it is its albedo there, or its emission."""
    dark = {"albedo": Channel.of(0.0), "emission": Channel.of(0.0)}
    front = Material("sides", **{**dark, name: Channel.of((0.3, 0.2, 0.1))}, **{f"{name}_by_angle": RIM})
    both = replace(front, back=Material("sides", **{**dark, name: Channel.of(0.5)}))
    scene = build.scene([build.plane("plane", 1000.0)], [both], world=1.0 if name == "albedo" else 0.0)
    cosines = np.repeat(np.array([0.2, 0.5, 0.9, 0.99]), 256)
    cosines, sides = np.tile(cosines, 2), np.repeat([1.0, -1.0], len(cosines))
    origins, directions = rays_onto_a_plane(cosines, sides)
    radiance = path.trace_radiance(LightContext(scene), origins, directions, bounces=1)
    found = radiance.reshape(8, 256, 3).mean(axis=1)
    step = (np.square(cosines[::256][:4]) * STEPS).astype(int)
    expected = [*(RIM[step] * np.float32([0.3, 0.2, 0.1])), *np.full((4, 3), 0.5)]
    np.testing.assert_allclose(found, expected, rtol=0.03)


def test_profiles_are_steps_of_the_squared_cosine():
    profiles = AngleProfiles([None, RIM, None, 2.0 * RIM[:1]])
    face, cosine = np.array([0, 1, 1, 1, 2, 3]), np.array([0.5, 0.0, -1.0, 0.5, 1.0, 0.3], np.float32)
    expected = [1.0, FACING[0], FACING[-1], FACING[STEPS // 4], 1.0, 2.0 * FACING[0]]
    np.testing.assert_allclose(profiles.of(face, cosine)[:, 0], expected, rtol=1e-6)
    assert profiles.present and not AngleProfiles([None, None]).present
    np.testing.assert_allclose(RIM.mean(axis=0), 1.0, atol=2e-3)


def test_rays_pass_the_side_and_the_kind_of_ray_that_lets_them():
    solid, clear = Channel.of(1.0), Channel.of(0.0)
    for material, seen, shadowed in (
            (Material("m", back=Material("m", alpha=clear)), [True, False], [True, False]),
            (Material("m", alpha=clear, back=Material("m")), [False, True], [False, True]),
            (Material("m", shadow_alpha=clear), [True, True], [False, False]),
            (Material("m", alpha=clear, alpha_threshold=0.5, shadow_alpha=solid), [False, False], [True, True]),
            (Material("m", shadow_alpha=clear, back=Material("m", alpha=clear)), [True, False], [False, False])):
        context = LightContext(build.scene([build.plane()], [material], world=1.0))
        origins, directions = rays_onto_a_plane(np.array([0.9, 0.9]), np.array([1.0, -1.0]))
        assert (context.tracer.intersect(origins, directions).primitive >= 0).tolist() == seen
        assert context.tracer.occluded(origins, directions).tolist() == shadowed


def test_many_tints_of_one_texture_are_looked_up_together():
    """What instances differ in by a factor or an addend costs one look-up, and gives each its own."""
    from rtgi_addon.scene import Texture
    from rtgi_addon.transport.surfaces.geometry import flatten
    from rtgi_addon.transport.surfaces.materials import Surfaces
    image = Texture("t", np.random.default_rng(1).random((4, 4, 3)).astype(np.float32))
    tints = np.random.default_rng(2).random((50, 3)).astype(np.float32)
    materials = [Material(f"m{i}", albedo=Channel(tint * 0.5, image, offset=tint * 0.1)) for i, tint in enumerate(tints)]
    uv = np.random.default_rng(3).random((2, 3, 2)).astype(np.float32)
    meshes = [replace(build.plane(f"p{i}", 1.0, i, i), uv_layers={"UV": uv}, active_uv="UV") for i in range(50)]
    scene = build.scene(meshes, materials)
    geometry = flatten(scene)
    surfaces = Surfaces(scene, geometry)
    primitive = np.arange(100, dtype=np.int32)
    third = np.full(100, 1 / 3, np.float32)
    found = surfaces.albedo(primitive, third, third, np.ones(100, np.float32))
    expected = [surfaces.channel(materials[i // 2].albedo, primitive[i:i + 1], third[:1], third[:1])[0] for i in range(100)]
    np.testing.assert_allclose(found, expected, rtol=1e-6)
    assert len(surfaces._albedo._shared) == 1


def room(wall, panel):
    """A closed room with a point light off its middle and a panel under its ceiling."""
    meshes = [build.cube("room", 1.0, inward=True), build.plane("panel", 0.4, 0.8, 1)]
    return build.scene(meshes, [wall, panel], [build.point_light((0.3, -0.2, -0.4), (1.0, 0.8, 0.6))],
                       volumes=[build.volume(half_size=0.6)])


ROOMS = {
    "albedo by angle": room(Material("wall", albedo=Channel.of((0.4, 0.3, 0.2)), albedo_by_angle=RIM),
                            build.material("panel", 0.5)),
    "sides of an emitter": room(build.material("wall", 0.6), Material(
        "panel", albedo=Channel.of(0.2), emission=Channel.of((4.0, 0.0, 0.0)), emission_by_angle=RIM,
        back=Material("panel", albedo=Channel.of(0.8), emission=Channel.of((0.0, 1.0, 2.0))))),
    "shadowless": room(build.material("wall", 0.6), Material("panel", albedo=Channel.of(0.7), shadow_alpha=Channel.of(0.0))),
    "one way": room(build.material("wall", 0.6), Material("panel", emission=Channel.of(3.0), alpha=Channel.of(0.0),
                                                          back=Material("panel", emission=Channel.of(1.0)))),
}


@pytest.mark.parametrize("name", ROOMS)
def test_probes_agree_with_the_path_reference(name):
    scene = ROOMS[name]
    result = path.probe_sh(LightContext(scene), positions(scene), 2, 4096, seed=3)
    found = coefficients(bake(scene, 1, rays=1024))
    assert rms(found - result.mean) < 0.01 * rms(result.mean) + 1.5 * rms(result.standard_error)


def test_light_paths_and_maps_take_the_side_that_they_meet():
    """One lamp above a two-sided plane, one below it: what either reflects has the colour of its side."""
    sides = Material("sides", albedo=Channel.of((0.8, 0.0, 0.0)), back=Material("sides", albedo=Channel.of((0.0, 0.4, 0.0))))
    lamps = [build.point_light((0, 0, 1), 1.0, "above"), build.point_light((0, 0, -1), 1.0, "below")]
    context = LightContext(build.scene([build.plane("plane", 50.0)], [sides], lamps))
    for lamp, channel, share in ((0, 0, 0.8), (1, 1, 0.4)):
        paths = lamp_paths(context, lamps[lamp], lamp, np.arange(512), None, 1, 0)
        assert len(paths.throughput) > 200 and np.allclose(paths.throughput[:, channel], share)
        assert not np.delete(paths.throughput, channel, axis=1).any()
        flux = sum(capture(context, view).flux.sum(axis=(0, 1)) for view in views_of(context, lamp, 32))
        assert flux[channel] > 0 and not np.delete(flux, channel).any()


def test_emitters_are_sampled_by_what_both_sides_give():
    glow = Material("glow", emission=Channel.of(1.0), back=Material("glow", emission=Channel.of(3.0)))
    alike = build.material("alike", emission=2.0)
    context = LightContext(build.scene([build.plane("two", 1.0), build.plane("one", 1.0, 2.0, 1)], [glow, alike]))
    assert np.isclose(context.emitters.total_power, 2 * np.pi * (4.0 * 2.0 + 4.0 * 2.0))
    emitted = context.emitters.sample(np.random.default_rng(0).random((400, 3)).astype(np.float32))
    down = np.tile(np.float32([[0, 0, -1]]), (400, 1))
    of_two = emitted.primitive < 2
    for directions, expected in ((down, 1.0), (-down, 3.0)):
        radiance = context.emitters.radiance(emitted, directions)[:, 0]
        assert np.allclose(radiance[of_two], expected) and np.allclose(radiance[~of_two], 2.0)
    assert 0.35 < of_two.mean() < 0.65
