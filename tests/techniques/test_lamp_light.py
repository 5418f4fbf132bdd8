"""Lamps of which a bake holds all light, bounces only or nothing: closed forms and the path reference, in every technique."""

from dataclasses import replace

import numpy as np
import pytest
import scene_builders as build
from probe_bakes import QUICK, bake, coefficients, positions, rms

from rtgi_addon import techniques
from rtgi_addon.numerics import sh
from rtgi_addon.numerics.sampling import fibonacci_sphere
from rtgi_addon.progress import Progress
from rtgi_addon.scene import AreaLight
from rtgi_addon.scene.lights import ALL_LIGHT, BOUNCES_ONLY, NOT_AT_ALL, lamps_to_add
from rtgi_addon.techniques.lamp_light import LampLight
from rtgi_addon.transport.context import LightContext
from rtgi_addon.transport.paths.reference import irradiance_at, probe_sh

KEY, FILL = (0.3, -0.2, 0.5), (-0.5, 0.4, 0.2)


def room(key=ALL_LIGHT, fill=BOUNCES_ONLY, albedo=0.6):
    """A closed box with a white and a red lamp."""
    lamps = [replace(build.point_light(KEY, 1.0, "key"), bake=key),
             replace(build.point_light(FILL, (2.0, 0.1, 0.1), "fill"), bake=fill)]
    return build.scene([build.cube("room", 1.0, inward=True)], [build.material("wall", albedo)], lamps)


def direct_sh(scene, position, intensity, order=2):
    """Exact coefficients (p, k, 3) of a point lamp without anything in its way: E = I/r², L_lm = E·Y_lm."""
    towards = np.array(position) - positions(scene)
    distance = np.linalg.norm(towards, axis=1, keepdims=True)
    basis = sh.evaluate((towards / distance).astype(np.float32), order)
    return basis[:, :, None] * (np.broadcast_to(intensity, 3) / distance**2)[:, None, :]


def test_probes_hold_the_direct_light_of_those_lamps_alone_that_are_set_to_it():
    bounces, mixed = (bake(room(role), **QUICK) for role in (BOUNCES_ONLY, ALL_LIGHT))
    assert not bounces.includes_direct and mixed.direct_lamps == {"key"}
    np.testing.assert_allclose(coefficients(mixed) - coefficients(bounces), direct_sh(room(), KEY, 1.0), atol=2e-5)


def test_a_setting_for_all_lamps_leaves_out_those_that_no_bake_knows():
    field = bake(room(BOUNCES_ONLY, NOT_AT_ALL), direct=True, **QUICK)
    assert field.direct_lamps == {"key"}
    without = replace(room(BOUNCES_ONLY), lights=room(BOUNCES_ONLY).lights[:1])
    np.testing.assert_allclose(coefficients(field), coefficients(bake(without, direct=True, **QUICK)), atol=1e-6)


def test_the_path_reference_knows_what_probes_hold():
    """Within 2 % of it: direct light of one lamp, bounces of both."""
    scene = room()
    exact = probe_sh(LightContext(scene), positions(scene), 2, 8192, seed=3)
    measured = coefficients(bake(scene, error=0.02))
    assert rms(measured - exact.mean) < 0.02 * rms(exact.mean) + 1.3 * rms(exact.standard_error)
    # Without noise in its direct light: it is one sample a path, of a point.
    indirect = probe_sh(LightContext(room(BOUNCES_ONLY)), positions(scene), 2, 8192, seed=3)
    np.testing.assert_allclose(exact.mean - indirect.mean, direct_sh(scene, KEY, 1.0), atol=2e-3)


def test_the_path_reference_at_surfaces():
    scene, normals = room(), fibonacci_sphere(16).astype(np.float32)
    points = np.zeros_like(normals)
    both = [irradiance_at(LightContext(room(role)), points, normals, 512, seed=2).mean for role in (ALL_LIGHT, BOUNCES_ONLY)]
    towards = np.array(KEY) / np.linalg.norm(KEY)
    expected = np.maximum(normals @ towards, 0.0) / np.sum(np.square(KEY))
    np.testing.assert_allclose((both[0] - both[1])[:, 0], expected, atol=1e-3)
    assert scene.lights[0].bake == ALL_LIGHT


def test_relighting_follows_what_lamps_are_set_to():
    field = bake(room(BOUNCES_ONLY), **QUICK)
    turned = field.relight(room(ALL_LIGHT))
    assert turned.direct_lamps == {"key"}
    difference = coefficients(turned) - coefficients(field.relight(room(BOUNCES_ONLY)))
    np.testing.assert_allclose(difference, direct_sh(room(), KEY, 1.0), atol=2e-5)
    gone = field.relight(room(NOT_AT_ALL))
    alone = field.relight(replace(room(), lights=room(BOUNCES_ONLY).lights[1:]))
    np.testing.assert_allclose(coefficients(gone), coefficients(alone), atol=1e-6)


SMALL = {"probes": QUICK, "vpl": {"lights": 256}, "rsm": {"resolution": 32, "samples": 64}, "lpv": {"resolution": 8, "steps": 8}}


@pytest.mark.parametrize("name", techniques.names())
def test_every_technique_adds_it(name):
    method = techniques.get(name)
    fields = [method.bake(room(role), method.Settings(**SMALL.get(name, {})), np.random.default_rng(0), Progress())
              for role in (BOUNCES_ONLY, ALL_LIGHT)]
    assert fields[0].direct_lamps == frozenset() and fields[1].direct_lamps == {"key"}
    added = coefficients(fields[1]) - coefficients(fields[0])
    expected = direct_sh(room(), KEY, 1.0, sh.order_of(added.shape[1]))
    np.testing.assert_allclose(added, expected, atol=0.02 * rms(expected))


def test_a_wide_lamp_above_a_point_is_its_closed_form():
    """A disk of radius r and radiance L at height h gives a receiver below it E = π·L·r²/(h² + r²)."""
    disk = AreaLight("disk", np.float32([0, 0, 1]), np.float32([0.5, 0, 0]), np.float32([0, 0.5, 0]), np.float32([0, 0, -1]),
                     np.float32([1, 2, 3]), "ELLIPSE", bake=ALL_LIGHT)
    scene = build.scene([build.plane("floor", 5.0, z=-5.0)], [build.material("black", 0.0)], [disk])
    light = LampLight(LightContext(scene), False, 256, 0)
    assert light.names == {"disk"}
    point, up = np.zeros((1, 3), np.float32), np.float32([[0, 0, 1]])
    exact = np.pi * np.array([1, 2, 3]) * 0.25 / 1.25
    np.testing.assert_allclose(light.irradiance(point, up)[0], exact, rtol=2e-3)
    lobe = sh.cosine_coefficients(4) * sh.evaluate(up, 4)[0]
    np.testing.assert_allclose(light.coefficients(point, 4)[0].T @ lobe, exact, rtol=0.02)


def test_pictures_add_what_a_bake_lacks():
    lights = room(ALL_LIGHT, NOT_AT_ALL).lights
    assert [light.name for light in lamps_to_add(lights, frozenset({"key"}))] == ["fill"]
    assert lamps_to_add(lights, frozenset()) is lights
    assert [light.name for light in lamps_to_add(lights, None)] == ["fill"]
