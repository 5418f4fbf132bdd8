"""Emissive triangles: densities that add up, power, textures and coverage."""

from dataclasses import replace

import numpy as np
import pytest
import scene_builders as build

from rtgi_addon.numerics.sampling import sobol_owen
from rtgi_addon.scene import Channel, Material, Texture
from rtgi_addon.transport.emitters import EmitterTable
from rtgi_addon.transport.geometry import flatten
from rtgi_addon.transport.surfaces import Surfaces


def table_of(scene):
    geometry = flatten(scene)
    return EmitterTable(geometry, Surfaces(scene, geometry)), geometry


def lamps_scene():
    """A dim large square, a bright small one, and a grey one that does not emit."""
    return build.scene([build.plane("grey", 1.0, 0.0, 0), build.plane("dim", 2.0, 1.0, 1), build.plane("bright", 0.5, 2.0, 2)],
                       [build.material(), build.material("dim", 0.5, 1.0), build.material("bright", 0.5, 8.0)])


def test_only_emissive_triangles_are_in_the_table_with_their_power():
    table, geometry = table_of(lamps_scene())
    assert table.count == 4 and set(geometry.material[table.primitive]) == {1, 2}
    assert table.total_power == pytest.approx(2 * np.pi * (16 * 1.0 + 1 * 8.0))


def test_density_integrates_to_one_and_is_zero_elsewhere():
    table, geometry = table_of(lamps_scene())
    density = table.pdf_area(np.arange(geometry.count))
    assert np.sum(density * geometry.areas) == pytest.approx(1.0, rel=1e-6)
    assert not density[geometry.material == 0].any()
    assert table.pdf_area(np.array([-1])).tolist() == [0.0]


def test_samples_lie_on_their_triangles_in_proportion_to_power():
    table, geometry = table_of(lamps_scene())
    points, normals, radiance, pdf, primitive = table.sample(sobol_owen(8192, 3, 1))
    material = geometry.material[primitive]
    np.testing.assert_allclose(points[:, 2], np.where(material == 1, 1.0, 2.0), atol=1e-6)
    np.testing.assert_allclose(radiance[:, 0], np.where(material == 1, 1.0, 8.0))
    np.testing.assert_array_equal(normals, geometry.normals_world[primitive])
    assert np.mean(material == 2) == pytest.approx(8 / 24, abs=2e-3)
    np.testing.assert_allclose(pdf, np.where(material == 1, 1 / 24, 8 / 24), rtol=1e-5)
    # Uniform over each square: mean and mean square of x.
    x = points[material == 1, 0]
    assert abs(x.mean()) < 0.02 and np.mean(x**2) == pytest.approx(4 / 3, rel=0.02)


def test_estimated_radiosity_is_unbiased():
    """Σ L/pdf is the integral of L over the area, for a texture that is bright in one corner only."""
    pixels = np.zeros((8, 8, 3), np.float32)
    pixels[6:, 6:] = 5.0
    glow = Material("glow", emission=Channel(texture=Texture("corner", pixels)))
    uv = np.array([[[0, 0], [1, 0], [1, 1]], [[0, 0], [1, 1], [0, 1]]], np.float32)
    scene = build.scene([build.plane()], [glow])
    scene = replace(scene, meshes=(replace(scene.meshes[0], uv_layers={"UV": uv}, active_uv="UV"),))
    table, _ = table_of(scene)
    _, _, radiance, pdf, _ = table.sample(sobol_owen(1 << 15, 3, 2))
    # Texture bilinear with REPEAT: the mean over the square is the mean of its texels.
    assert np.mean(radiance[:, 0] / pdf) == pytest.approx(4.0 * pixels.mean(), rel=0.01)


def test_a_triangle_that_looks_black_may_still_be_chosen():
    """Every triangle of a textured emissive material keeps some probability."""
    pixels = np.zeros((2, 2, 3), np.float32)
    pixels[0, 1] = 1.0
    glow = Material("glow", emission=Channel(texture=Texture("half", pixels, extension="EXTEND", interpolation="Closest")))
    scene = build.scene([build.plane()], [glow])
    uv = np.array([[[0, 0], [1, 0], [1, 1]], [[0, 0], [0.4, 0.4], [0, 0.4]]], np.float32)
    scene = replace(scene, meshes=(replace(scene.meshes[0], uv_layers={"UV": uv}, active_uv="UV"),))
    table, _ = table_of(scene)
    density = table.pdf_area(np.array([0, 1]))
    assert density[0] > 10 * density[1] > 0


def test_coverage_dims_an_emitter():
    half = Material("half", emission=Channel.of(2.0), alpha=Channel.of(0.25))
    cut = Material("cut", emission=Channel.of(2.0), alpha=Channel.of(0.25), alpha_threshold=0.5)
    table, _ = table_of(build.scene([build.plane()], [half]))
    assert np.all(table.sample(sobol_owen(8, 3, 0))[2] == 0.5)
    assert table.total_power == pytest.approx(2 * np.pi * 4 * 0.5)
    assert table_of(build.scene([build.plane()], [cut]))[0].count == 0


def test_nothing_emits():
    table, geometry = table_of(build.closed_box())
    assert table.count == 0 and table.total_power == 0.0
    assert not table.pdf_area(np.arange(geometry.count)).any()
