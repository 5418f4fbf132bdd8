"""Light through surfaces: straight on with a colour, diffusely to the other side, through glass; in every estimator."""

from dataclasses import replace

import numpy as np
import pytest
import room_scenes as rooms
import scene_builders as build
from probe_bakes import Memory, bake, bytes_of, coefficients, positions, rms

from rtgi_addon import techniques
from rtgi_addon.progress import Progress
from rtgi_addon.scene import Channel, Material, PointLight, Texture
from rtgi_addon.transport.context import LightContext
from rtgi_addon.transport.paths import reference as path
from rtgi_addon.transport.surfaces.solids import Solids
from rtgi_addon.transport.views.reflective_shadow_map import capture
from rtgi_addon.transport.views.shadow_views import views_of

Y00 = np.sqrt(0.25 / np.pi)
RED, GREEN = (0.9, 0.3, 0.1), (0.2, 0.8, 0.5)
UP = np.float32([[0, 0, 1]])


def pane(tint, alpha=0.0, **more):
    """A material that light passes straight on."""
    return Material("pane", albedo=Channel.of(0.0), alpha=Channel.of(alpha), tint=Channel.of(tint), **more)


def cloth(albedo=(0.1, 0.3, 0.2), translucency=(0.6, 0.4, 0.2), **more):
    """A material that light passes diffusely."""
    return Material("cloth", albedo=Channel.of(albedo), translucency=Channel.of(translucency), **more)


def lantern(radius=0.5, intensity=2.0, **volume_options):
    """A lamp in the middle of a sphere of cloth in empty space."""
    shell = build.sphere("shell", radius, subdivisions=3)
    return build.scene([shell], [cloth()], [build.point_light((0, 0, 0), intensity)], volumes=[build.volume(**volume_options)])


def radiance_of_lantern(radius=0.5, intensity=2.0):
    """What it shows from outside, and its inner wall: τE and ρE over π, E = I/r²·(1 + ρ + ρ² + …)."""
    irradiance = intensity / radius**2 / (1.0 - np.array([0.1, 0.3, 0.2]))
    return np.array([0.6, 0.4, 0.2]) * irradiance / np.pi, np.array([0.1, 0.3, 0.2]) * irradiance / np.pi


def half_room(material, lamps=(), **volume_options):
    """A closed box in two storeys, parted by a sheet of ``material`` that faces up; probes below."""
    lamps = lamps or (build.point_light((0.2, 0.1, 0.7), 1.0),)
    sheet = rooms.quad("sheet", (-1, -1, 0.3), (2, 0, 0), (0, 2, 0), 1)
    options = {"resolution": (2, 2, 2), "center": (0, 0, -0.4), "half_size": 0.4, **volume_options}
    return build.scene([build.cube("room", 1.0, inward=True), sheet], [build.material("wall", 0.6), material], lamps,
                       volumes=[build.volume(**options)])


def test_a_tint_colours_what_passes_layer_by_layer():
    """Two panes over each other under a sky of radiance 1: what is seen up there is the product of their colours."""
    checks = np.float32([[RED, GREEN], [GREEN, RED]])
    uneven = Material("uneven", albedo=Channel.of(0.0), alpha=Channel.of(0.0),
                      tint=Channel(texture=Texture("checks", checks, interpolation="Closest")))
    sheets = [rooms.quad("one", (-9, -9, 1), (18, 0, 0), (0, 18, 0), 0), rooms.quad("two", (-9, -9, 2), (18, 0, 0), (0, 18, 0), 1)]
    context = LightContext(build.scene(sheets, [pane(RED), uneven], world=1.0))
    origins = np.float32([[-1, -1, 0], [1, -1, 0], [-1, -1, 1.5], [-1, -1, 3]])
    seen = path.trace_radiance(context, origins, np.repeat(UP, 4, axis=0))
    np.testing.assert_allclose(seen, [np.multiply(RED, RED), np.multiply(RED, GREEN), RED, (1, 1, 1)], rtol=1e-5)
    passed = context.tracer.transmittance(origins, np.repeat(UP, 4, axis=0))
    np.testing.assert_allclose(passed, seen, rtol=1e-5)
    assert not context.tracer.occluded(origins, np.repeat(UP, 4, axis=0)).any()
    assert context.surfaces.has_tint and not LightContext(build.scene(sheets, [pane(1.0)] * 2)).surfaces.has_tint


def test_light_between_two_points_takes_the_mean_of_coverage_and_nothing_comes_through_a_wall():
    scene = build.scene([build.plane("half", 9.0, 1.0, 0), build.plane("wall", 9.0, 2.0, 1)],
                        [pane(GREEN, alpha=0.25), build.material()])
    tracer = LightContext(scene).tracer
    origins, up = np.zeros((3, 3), np.float32), np.repeat(UP, 3, axis=0)
    passed = tracer.transmittance(origins, up, np.float32([0.5, 1.5, 2.5]))
    np.testing.assert_allclose(passed, [(1, 1, 1), 0.75 * np.array(GREEN), (0, 0, 0)], rtol=1e-6)


def test_glass_is_left_as_it_was_entered_and_blocks_lamps_without_a_size():
    """From within 60 % are reflected totally, but not of what came in through the front."""
    inside = pane(RED, alpha=0.6, glass=True, point_alpha=Channel.of(1.0))
    glass = pane(RED, alpha=0.1, glass=True, point_alpha=Channel.of(1.0), back=inside)
    box = build.scene([build.cube("box", 0.5)], [glass])
    sheet = build.scene([build.plane("sheet", 9.0)], [glass])
    below, origin = np.float32([[0.1, 0.2, -2]]), np.float32([[0.1, 0.2, 0.1]])
    for scene, start, expected in ((box, below, 0.81 * np.square(RED)), (box, origin, 0.4 * np.array(RED)),
                                   (sheet, below, 0.4 * np.array(RED)), (sheet, -below, 0.9 * np.array(RED))):
        context = LightContext(scene)
        towards = UP if start[0, 2] < 1 else -UP
        np.testing.assert_allclose(context.tracer.transmittance(start, towards), [expected], rtol=1e-5)
        assert context.point_tracer.occluded(start, towards).all()
        assert not context.point_tracer.transmittance(start, towards).any()


def test_a_lantern_shows_what_its_cloth_passes():
    """Path tracing and probes, inside and out, against the closed form; and cloth around a probe is no wall that it lies in."""
    scene = lantern(resolution=(2, 2, 2), half_size=1.6)
    outside, inside = radiance_of_lantern()
    points = positions(scene)
    solid_angle = 2.0 * np.pi * (1.0 - np.sqrt(1.0 - 0.25 / np.square(points).sum(axis=1)))
    expected = solid_angle[:, None] * outside * Y00
    rays = np.repeat(points.astype(np.float32), 512, axis=0)
    seen = path.trace_radiance(LightContext(scene), rays, -rays)
    np.testing.assert_allclose(seen.mean(axis=0), outside, rtol=0.02)
    np.testing.assert_allclose(coefficients(bake(scene, error=0.02))[:, 0].mean(axis=0), expected.mean(axis=0), rtol=0.015)
    within = bake(lantern(resolution=(2, 2, 2), half_size=0.2), error=0.02)
    assert all((grid.validity == 1.0).all() and not grid.offset_world.any() for grid in within.grids())
    np.testing.assert_allclose(coefficients(within)[:, 0].mean(axis=0), inside / Y00, rtol=0.01)


def test_virtual_lights_pass_cloth_too():
    scene = lantern(resolution=(2, 2, 2), half_size=1.6)
    method = techniques.get("vpl")
    field = method.bake(scene, method.Settings(lights=1024), np.random.default_rng(0), Progress())
    points = np.float32([[2, 0, 0], [0, -3, 0], [0, 0, 1.5]])
    normals = -points / np.linalg.norm(points, axis=1, keepdims=True)
    expected = np.pi * radiance_of_lantern()[0] * (0.25 / np.square(points).sum(axis=1))[:, None]
    np.testing.assert_allclose(field.irradiance(points, normals), expected, rtol=0.08)


SHEETS = {
    "tint": pane(RED), "half": replace(pane(GREEN, alpha=0.5), albedo=Channel.of((0.5, 0.2, 0.6))), "cloth": cloth(),
    "two sides": cloth(back=cloth((0.3, 0.1, 0.1), (0.1, 0.5, 0.3))),
    "holes": replace(cloth(), alpha=Channel(texture=Texture("holes", np.float32([[[1, 1, 1, 1], [1, 1, 1, 0.2]]]),
                                                           interpolation="Closest"), texture_channel="a"))}


@pytest.mark.parametrize("sheet", SHEETS.values(), ids=SHEETS.keys())
def test_light_that_passes_a_sheet_is_that_of_the_path_reference(sheet):
    scene = half_room(sheet)
    expected = path.probe_sh(LightContext(scene), positions(scene), 1, 2048)
    for technique, settings, within in (("probes", {"error": 0.03}, 0.02), ("vpl", {"lights": 768}, 0.05)):
        method = techniques.get(technique)
        found = coefficients(method.bake(scene, method.Settings(**settings), np.random.default_rng(2), Progress()))[:, :4]
        assert rms(found - expected.mean) < 2.0 * within * rms(expected.mean) + 2.0 * rms(expected.standard_error)
        mean, true = found[:, 0].mean(axis=0), expected.mean[:, 0].mean(axis=0)
        np.testing.assert_allclose(mean, true, rtol=within, atol=3.0 * expected.standard_error[:, 0].max() / np.sqrt(len(found)))


def test_many_lamps_pass_cloth_as_one_does():
    lamps = tuple(build.point_light((x, y, 0.8), 0.2) for x in (-0.5, 0.0, 0.5) for y in (-0.4, 0.4))
    scene = half_room(cloth(), lamps)
    expected = path.probe_sh(LightContext(scene), positions(scene), 0, 2048).mean[:, 0].mean(axis=0)
    np.testing.assert_allclose(coefficients(bake(scene, error=0.03))[:, 0].mean(axis=0), expected, rtol=0.03)


@pytest.mark.parametrize("sheet", [SHEETS["half"], SHEETS["two sides"]], ids=["half", "two sides"])
def test_what_passes_is_relit_and_resumed(sheet):
    scene = replace(half_room(sheet), world=build.scene([], world=0.3).world)
    moved = replace(scene, lights=(PointLight("lamp", np.float32([-0.3, 0.2, 0.6]), np.float32([0.5, 2.0, 1.0])),))
    whole = bake(scene, error=0.05)
    fresh, relit = coefficients(bake(moved, error=0.05)), coefficients(whole.relight(moved))
    assert rms(relit - fresh) < 0.05 * rms(fresh)
    stopped = Memory(stop=1)
    with pytest.raises(KeyboardInterrupt):
        bake(scene, checkpoint=stopped, error=0.05)
    assert bytes_of(bake(scene, checkpoint=Memory(stopped.stored), error=0.05)) == bytes_of(whole)
    assert bytes_of(bake(scene, threads=1, error=0.05)) == bytes_of(whole)


def test_what_lets_light_through_bounds_no_solid():
    for material, solid in ((build.material(), True), (cloth(), False), (pane(0.5), False), (pane(0.0), True),
                            (replace(build.material(), alpha=Channel.of(0.999)), True)):
        context = LightContext(build.scene([build.cube()], [material]))
        assert Solids(context.scene, context.geometry, context.surfaces).is_solid(np.arange(12)).all() == solid


def test_a_shadow_map_holds_what_a_tint_leaves():
    scene = build.scene([build.plane("floor", 5.0, 0.0, 0), build.plane("pane", 5.0, 1.0, 1)],
                        [build.material("floor", 0.5), pane(RED)], [build.point_light((0, 0, 2.0), 1.0)])
    plain = replace(scene, instances=scene.instances[:1])
    flux = []
    for shown in (scene, plain):
        context = LightContext(shown)
        flux.append(sum(capture(context, view).total_flux for view in views_of(context, 0, 32)))
    np.testing.assert_allclose(flux[0], flux[1] * np.array(RED), rtol=1e-4)
