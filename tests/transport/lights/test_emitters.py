"""Emissive triangles: densities that add up, power, textures and coverage."""

from dataclasses import replace

import numpy as np
import pytest
import scene_builders as build

from rtgi_addon.numerics.sampling import sobol_owen
from rtgi_addon.scene import Channel, Material, Texture
from rtgi_addon.transport.lights.emitters import EmitterTable
from rtgi_addon.transport.surfaces.geometry import flatten
from rtgi_addon.transport.surfaces.materials import Surfaces


def table_of(scene):
    geometry = flatten(scene)
    return EmitterTable(geometry, Surfaces(scene, geometry)), geometry


def shone(table, emitted):
    """Radiance (n, 3) of emitted points towards where their front faces."""
    return table.radiance(emitted, -emitted.normals)


def at_middles(table, primitive):
    """The table's density at the middle of each triangle."""
    third = np.full(len(primitive), 1 / 3, np.float32)
    return table.pdf_area(primitive, third, third)


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
    density = at_middles(table, np.arange(geometry.count))
    assert np.sum(density * geometry.areas) == pytest.approx(1.0, rel=1e-6)
    assert not density[geometry.material == 0].any()
    assert at_middles(table, np.array([-1])).tolist() == [0.0]


def test_samples_lie_on_their_triangles_in_proportion_to_power():
    table, geometry = table_of(lamps_scene())
    emitted = table.sample(sobol_owen(8192, 3, 1))
    points, normals, pdf, primitive = emitted[:4]
    radiance = shone(table, emitted)
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
    emitted = table.sample(sobol_owen(1 << 15, 3, 2))
    radiance, pdf = shone(table, emitted), emitted.pdf_area
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
    density = at_middles(table, np.array([0, 1]))
    assert density[0] > 10 * density[1] > 0


WHOLE_SQUARE = np.array([[[0, 0], [1, 0], [1, 1]], [[0, 0], [1, 1], [0, 1]]], np.float32)


def textured(pixels, uv=WHOLE_SQUARE, **texture):
    """A square of side 2 that glows by ``pixels``."""
    glow = Material("glow", emission=Channel(texture=Texture("pixels", pixels, **texture)))
    scene = build.scene([build.plane()], [glow])
    return replace(scene, meshes=(replace(scene.meshes[0], uv_layers={"UV": uv}, active_uv="UV"),))


def one_texel(side=256, value=1000.0):
    pixels = np.zeros((side, side, 3), np.float32)
    pixels[37 * side // 256, 200 * side // 256] = value
    return pixels


@pytest.mark.parametrize("side, scale, texture", [
    (256, 1, {}), (256, 1, {"interpolation": "Closest"}), (64, 8, {}), (64, 4, {"extension": "MIRROR"}),
    (64, 1, {"extension": "CLIP"}), (64, 1, {"extension": "EXTEND"}), (4096, 1, {})])
def test_a_bright_texel_is_sampled_by_its_power(side, scale, texture):
    """One texel of many shines: chosen by area, one sample in 65,536 would find it; here nearly all do."""
    pixels = one_texel(side)
    table, _ = table_of(textured(pixels, WHOLE_SQUARE * scale, **texture))
    emitted = table.sample(sobol_owen(2048, 3, 2))
    estimates = shone(table, emitted)[:, 0] / emitted.pdf_area
    assert estimates.mean() == pytest.approx(4.0 * pixels.mean(dtype=np.float64), rel=0.02)
    assert estimates.std() < 0.8 * estimates.mean()
    assert table.effective_area < 30.0 * 4.0 * scale**2 / side**2 / scale**2


def test_a_bright_texel_among_noise_is_not_lost():
    pixels = np.random.default_rng(0).random((512, 512, 3)).astype(np.float32)
    pixels[100, 77] = 512.0 * 512.0
    table, _ = table_of(textured(pixels))
    emitted = table.sample(sobol_owen(4096, 3, 2))
    estimates = shone(table, emitted)[:, 0] / emitted.pdf_area
    assert estimates.mean() == pytest.approx(4.0 * pixels[..., 0].mean(dtype=np.float64), rel=0.03)
    assert estimates.std() < estimates.mean()


def test_bytes_are_decoded_as_they_are_when_they_shine():
    pixels = np.zeros((64, 64, 3), np.uint8)
    pixels[5, 7], pixels[40, 40] = 255, 128
    table, _ = table_of(textured(pixels, srgb=True))
    emitted = table.sample(sobol_owen(4096, 3, 2))
    # The decoded spot of half the code has a fifth of the light; filtered as stored its skirt has somewhat less.
    low = emitted.points[:, 0] < -0.5
    share = (shone(table, emitted)[:, 0] / emitted.pdf_area)[low].sum() / (shone(table, emitted)[:, 0] / emitted.pdf_area).sum()
    assert share == pytest.approx(1.0 / (1.0 + 0.2159), abs=0.03)


@pytest.mark.parametrize("pixels", [one_texel(64), np.random.default_rng(1).random((64, 64, 3)).astype(np.float32)],
                         ids=["spot", "noise"])
def test_a_hit_has_the_density_of_the_samples_around_it(pixels):
    """What balances rays against samples must be the very density of the samples, in every cell and beside all of them."""
    scene = textured(pixels)
    table, geometry = table_of(scene)
    emitted = table.sample(sobol_owen(4096, 3, 5))
    corners = geometry.triangles_world[emitted.primitive].astype(np.float64)
    edges = np.stack([corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]], axis=2)[:, :2]
    barycentrics = np.linalg.solve(edges, (emitted.points - corners[:, 0])[:, :2, None])[..., 0]
    found = table.pdf_area(emitted.primitive, *barycentrics.T.astype(np.float32))
    assert np.mean(np.isclose(found, emitted.pdf_area, rtol=1e-5)) > 0.99  # some lie on the edge of a cell
    # Evenly over both triangles: the density integrates to one, and there is light nowhere without it.
    u, v = (part.ravel().astype(np.float32) for part in np.meshgrid(*[(np.arange(1024) + 0.5) / 1024] * 2))
    u, v = u[u + v < 1], v[u + v < 1]
    density = np.stack([table.pdf_area(np.full(len(u), triangle), u, v) for triangle in (0, 1)])
    assert density.sum() * 4.0 / 1024**2 == pytest.approx(1.0, rel=0.02)
    surfaces = Surfaces(scene, geometry)
    assert all(density[triangle][surfaces.mean_emission(np.full(len(u), triangle), u, v)[:, 0] > 0].all() for triangle in (0, 1))


def test_coverage_dims_an_emitter():
    half = Material("half", emission=Channel.of(2.0), alpha=Channel.of(0.25))
    cut = Material("cut", emission=Channel.of(2.0), alpha=Channel.of(0.25), alpha_threshold=0.5)
    table, _ = table_of(build.scene([build.plane()], [half]))
    assert np.all(shone(table, table.sample(sobol_owen(8, 3, 0))) == 0.5)
    assert table.total_power == pytest.approx(2 * np.pi * 4 * 0.5)
    assert table_of(build.scene([build.plane()], [cut]))[0].count == 0


def test_nothing_emits():
    table, geometry = table_of(build.closed_box())
    assert table.count == 0 and table.total_power == 0.0
    assert not at_middles(table, np.arange(geometry.count)).any()
