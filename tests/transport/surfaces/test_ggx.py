"""The table of what a GGX layer reflects, against sums over half vectors and what Cycles was measured to reflect."""

import brdf
import numpy as np
import pytest

from rtgi_addon.numerics.sampling import sobol_owen
from rtgi_addon.transport.surfaces.ggx import (
    SIZE,
    dielectric_fresnel,
    energy_table,
    index_of,
    reflectance,
    reflection_density,
    sample_reflection,
    surface_look,
)


@pytest.mark.parametrize("row", [2, 9, 20, 31])
@pytest.mark.parametrize("column", [4, 15, 30])
def test_energy_is_that_of_another_integration(row, column):
    roughness, cosine = (row + 0.5) / SIZE, (column + 0.5) / SIZE
    one, none = np.ones(3), np.zeros(3)
    a, b = energy_table()[row, column, :2]
    assert a + b == pytest.approx(brdf.ggx_energy(cosine, roughness, one, one)[0], abs=0.01)
    assert b == pytest.approx(brdf.ggx_energy(cosine, roughness, none, one)[0], abs=0.01)


@pytest.mark.parametrize(("roughness", "measured"), [(0.25, 0.990), (0.5, 0.885), (0.75, 0.664)])
def test_a_white_metal_keeps_what_cycles_keeps_of_a_uniform_sky(roughness, measured):
    position = roughness * SIZE - 0.5
    means = energy_table()[:SIZE, 0, 2] + energy_table()[:SIZE, 0, 3]
    assert np.interp(position, np.arange(SIZE), means) == pytest.approx(measured, abs=0.01)


@pytest.mark.parametrize("roughness", [0.1, 0.4, 0.9])
@pytest.mark.parametrize("cosine", [1.0, 0.7, 0.2])
def test_sampled_reflections_weigh_what_the_table_says(roughness, cosine):
    count = 4096
    normals = np.tile(np.float32([0.6, 0.0, 0.8]), (count, 1))
    tangent = np.float32([0.8, 0.0, -0.6])
    eye = (cosine * normals + np.sqrt(1 - cosine**2) * tangent).astype(np.float32)
    half = np.full(count, 0.5, np.float32)
    look = surface_look(np.zeros((count, 3)), np.tile([0.9, 0.5, 0.2], (count, 1)), np.ones(count), np.full(count, roughness), half,
                        np.full(count, cosine))
    directions, weights = sample_reflection(look, normals, eye, sobol_owen(count, 2, 5))
    assert np.allclose(np.linalg.norm(directions, axis=1), 1.0, atol=1e-5)
    assert np.allclose(weights.mean(axis=0), look.layer.mean(axis=0), atol=0.015)
    assert np.all(np.einsum("ij,ij->i", directions, normals)[weights.any(axis=1)] > 0)


# Cycles 5.2, Principled on a plane under a uniform sky of radiance 1: metallic, base colour, roughness; radiance (red and blue) at
# cosines of the view of 1, 0.7, 0.5, 0.3 and 0.15.
_CYCLES = [
    (1.0, (0.9, 0.6, 0.2), 0.6, [0.8821, 0.8792, 0.8791, 0.8838, 0.8930], [0.1720, 0.1704, 0.1784, 0.2031, 0.2400]),
    (1.0, (0.9, 0.6, 0.2), 1.0, [0.7724, 0.7857, 0.7992, 0.8201, 0.8456], [0.0771, 0.0907, 0.1053, 0.1294, 0.1611]),
    (1.0, (0.5, 0.5, 0.5), 1.0, [0.2610, 0.2865, 0.3126, 0.3535, 0.4049], [0.2610, 0.2865, 0.3126, 0.3535, 0.4049]),
    (0.0, (0.0, 0.0, 0.0), 0.05, [0.0400, 0.0509, 0.0892, 0.2077, 0.4380], [0.0400, 0.0509, 0.0892, 0.2077, 0.4380]),
    (0.0, (0.0, 0.0, 0.0), 0.3, [0.0397, 0.0515, 0.0869, 0.1769, 0.2914], [0.0397, 0.0515, 0.0869, 0.1769, 0.2914]),
    (0.0, (0.0, 0.0, 0.0), 1.0, [0.0138, 0.0186, 0.0245, 0.0353, 0.0509], [0.0138, 0.0186, 0.0245, 0.0353, 0.0509]),
    (0.0, (0.05, 0.02, 0.3), 0.3, [0.0878, 0.0989, 0.1326, 0.2180, 0.3268], [0.3278, 0.3360, 0.3608, 0.4238, 0.5036]),
]


@pytest.mark.parametrize(("metallic", "base", "roughness", "red", "blue"), _CYCLES)
def test_metal_and_lacquer_reflect_what_cycles_reflects(metallic, base, roughness, red, blue):
    cosine = np.float32([1.0, 0.7, 0.5, 0.3, 0.15])
    base, every = np.tile(np.float32(base), (5, 1)), np.ones(5, np.float32)
    # What the reader takes for the albedo: a table of Cycles' own.
    coat = np.interp(roughness, [0.0, 0.25, 0.5, 0.75, 1.0], [0.0921, 0.0842, 0.0599, 0.0377, 0.0219])
    albedo = np.zeros((5, 3)) if metallic else coat + base * (1 - coat)
    look = surface_look(albedo, base, metallic * every, roughness * every, 0.04 * every, cosine)
    found = look.layer + look.diffuse
    assert np.allclose(found[:, 0], red, rtol=0.025, atol=5e-4)
    assert np.allclose(found[:, 2], blue, rtol=0.025, atol=5e-4)


def test_a_dielectric_reflects_as_fresnel_says():
    # Straight on ((n-1)/(n+1))², along the surface all, and no light in the plane at Brewster's angle: half of what is across it.
    index = index_of(np.float32([0.04]))
    assert index[0] == pytest.approx(1.5, rel=1e-4)
    brewster = 1 / np.sqrt(1 + 1.5**2)
    assert dielectric_fresnel(np.float32([1.0, 0.0]), index) == pytest.approx([0.04, 1.0], rel=1e-4)
    across = ((1.5**2 - 1) / (1.5**2 + 1)) ** 2
    assert dielectric_fresnel(np.float32([brewster]), index)[0] == pytest.approx(0.5 * across, rel=1e-4)


@pytest.mark.parametrize("metallic", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("roughness", [0.05, 0.5, 1.0])
def test_a_white_furnace_stays_one(metallic, roughness):
    cosine = np.float32([0.1, 0.3, 0.6, 1.0])
    every, white = np.ones(4, np.float32), np.ones((4, 3), np.float32)
    look = surface_look(white, white, metallic * every, roughness * every, 0.04 * every, cosine)
    assert np.allclose(look.layer + look.diffuse, 1.0, atol=0.01)


def test_reflectance_is_that_of_the_formulas():
    normal, view, light = np.float32([[0, 0, 1]]), np.float32([[0.6, 0, 0.8]]), np.float32([[-0.48, 0.36, 0.8]])
    for metallic, roughness in ((0.0, 0.3), (1.0, 0.9), (0.5, 0.6)):
        given = np.float32([[0.4, 0.3, 0.2]]), np.float32([[0.7, 0.5, 0.1]]), np.float32([metallic]), np.float32([roughness])
        look = surface_look(*given, np.float32([0.04]), np.float32([0.8]))
        true = brdf.reflectance(given[0][0], given[1][0], metallic, roughness, 0.04, normal[0], view[0], light[0])
        assert np.allclose(reflectance(look, normal, view, light)[0], true, rtol=0.02)


def test_a_layer_too_smooth_for_a_lobe_mirrors_as_a_plane():
    count, cosine = 64, np.float32(0.6)
    normals = np.tile(np.float32([0.0, 0.0, 1.0]), (count, 1))
    eye = np.tile(np.float32([0.8, 0.0, cosine]), (count, 1))
    base, ones = np.tile(np.float32([0.9, 0.5, 0.2]), (count, 1)), np.ones(count, np.float32)
    look = surface_look(0 * base, base, ones, 0.02 * ones, 0.5 * ones, cosine * ones)
    directions, weights = sample_reflection(look, normals, eye, sobol_owen(count, 2, 5))
    assert np.allclose(directions, [-0.8, 0.0, 0.6], atol=1e-6)
    # Schlick's term, whose edge is white.
    assert np.allclose(weights, base + (1 - base) * (1 - cosine) ** 5, atol=2e-3)
    # No point on a lamp stands for what such rays find.
    assert np.all(reflection_density(look, normals, eye, directions) > 1e12)
