"""docs/physics.md: its tables computed again, its cases those of the suite, its constants those of the code."""

import re
from math import atan, log, pi, sqrt
from pathlib import Path

import numpy as np
import pytest
import scene_builders as build

from rtgi_addon.numerics import sampling, sh
from rtgi_addon.techniques.lattice import reconstruction

TEXT = (Path(__file__).resolve().parents[2] / "docs/physics.md").read_text(encoding="utf-8")
NUMBER = re.compile(r"−?\d*\.\d+|−?\d+")


def rows(first):
    """Cells of the table whose head begins with ``first``, row by row."""
    table = re.search(rf"^\| {re.escape(first)} .*?(?=\n\n)", TEXT, re.MULTILINE | re.DOTALL)[0]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in table.splitlines()[2:]]


def value(text):
    return float(NUMBER.search(text)[0].replace("−", "-"))


def test_the_constants_of_spherical_harmonics():
    names, factors = rows("index")[0][1:], [value(cell) for cell in rows("index")[1][1:]]
    directions = sampling.fibonacci_sphere(16).astype(np.float64)
    x, y, z = directions.T
    basis = sh.evaluate(directions, 2)
    polynomials = {"1": 1 + 0 * x, "y": y, "z": z, "x": x, "xy": x * y, "yz": y * z, "3z² − 1": 3 * z * z - 1, "xz": x * z,
                   "x² − y²": x * x - y * y}
    for index, (name, factor) in enumerate(zip(names, factors, strict=True)):
        assert np.allclose(basis[:, index], factor * polynomials[name], atol=1e-6), name
    assert np.allclose(sh.cosine_coefficients(4)[[0, 1, 4, 9, 16]], [pi, 2 * pi / 3, pi / 4, 0, -pi / 24], atol=1e-6)


def test_ringing():
    normals, axis = sampling.fibonacci_sphere(50_000).astype(np.float64), np.array([[0.0, 0.0, 1.0]])
    true = np.maximum(normals[:, 2], 0)
    methods = {"linear": reconstruction.linear, "Geomerics": reconstruction.geomerics, "ZH3": reconstruction.zh3}
    seen = 0
    for name, *cells in rows("reconstruction"):
        light = sh.evaluate(axis, int(re.search(r"order (\d)", name)[1]))[0][:, None]
        if "deringed" in name:
            light = reconstruction.dering(light[None].astype(np.float32))[0]
        method = next((method for word, method in methods.items() if word in name), reconstruction.linear)
        found = method(light, normals)[:, 0]
        computed = np.sqrt(np.mean((found - true) ** 2)), found.min(), method(light, axis)[0, 0]
        assert computed == pytest.approx([value(cell) for cell in cells], abs=6e-4), name
        seen += 1
    assert seen == 6
    # Of the last row, against the linear one above it, as the text rounds them.
    assert "up to 10 % at order 2" in TEXT and 1 - computed[2] / 1.063 == pytest.approx(0.1, abs=0.01)


def test_a_cosine_sky_by_order():
    directions = sampling.fibonacci_sphere(20_000).astype(np.float64)
    angle = np.arccos(np.clip(directions[:, 2], -1, 1))
    true = 2 / 3 * (np.sin(angle) + (pi - angle) * np.cos(angle))
    radiance = np.maximum(directions[:, 2:], 0)
    stated = [float(text) for text in re.search(r"at most\s+([\d.]+) %, ([\d.]+) % and ([\d.]+) % of the peak", TEXT).groups()]
    for order, expected in zip((1, 2, 4), stated, strict=True):
        light = sh.project(directions, radiance, 4 * pi / len(directions), order)
        off = np.abs(sh.irradiance(light, directions)[:, 0] - true).max() / true.max()
        assert 100 * off == pytest.approx(expected, abs=0.01)


def test_form_factors_and_losses():
    opposite = 2 / pi * (log(sqrt(4 / 3)) + 2 * sqrt(2) * atan(1 / sqrt(2)) - 2 * atan(1))
    disks = 0.5 * (3 - sqrt(5))
    for number in (opposite, (1 - opposite) / 4, disks):
        assert f"{number:.6f}".lstrip("0") in TEXT
    assert f"{100 * (1 - 0.1 * sqrt(10)) ** 2:.1f} %" in TEXT


def test_the_constants_of_light_propagation():
    from rtgi_addon.techniques.lpv import grid
    assert f"({grid.COSINE_0:.6f}, {grid.COSINE_1:.6f})".replace("0.", ".", 1) in TEXT
    # Before an endless plane: what the cells beside each other keep of flux and vector flux, and what comes back of it.
    flux, vector = 1.0 / (1.0 - 4.0 * grid.FLUX_OUT), grid.LOBE_VECTOR / (1.0 - 4.0 * grid.VECTOR_ACROSS)
    assert flux == pytest.approx(3.0) and vector == pytest.approx(1.5) and "P = 3 W and F = 3/2 W" in TEXT
    assert grid.FLUX_OUT * flux - grid.VECTOR_OUT * vector == pytest.approx(0.0, abs=1e-12)
    assert grid.direction_kept((16, 16, 16)) == pytest.approx(1.0 - 1.0 / 15.875) and "2/3 of the volume's side" in TEXT


def test_constants_that_are_settings_of_the_code():
    from rtgi_addon.evaluate import metrics
    from rtgi_addon.techniques.base import BACKFACE_THRESHOLD
    from rtgi_addon.techniques.lattice import placement, weights
    from rtgi_addon.transport.surfaces.materials import MAX_ALBEDO
    assert f"capped at {MAX_ALBEDO}" in TEXT and BACKFACE_THRESHOLD == 0.25 and "more than a quarter" in TEXT
    assert weights.CRUSH_BELOW == weights.SIDE_FLOOR == 0.2 and "below 0.2 are crushed" in TEXT
    assert weights.UNSEEN_FLOOR == 1e-6 and "one of 10⁻⁶" in TEXT
    assert placement.MAX_OFFSET == 0.45 and "45 % of a cell" in TEXT and placement.CLEARANCE == 0.05 and "5 % of a cell" in TEXT
    assert metrics.relmse.__defaults__ == (1e-2,) and "ε = 10⁻²" in TEXT


def test_the_failures_are_the_cases_of_the_suite():
    from rtgi_addon.evaluate.stability.suite import CASES
    named = [name for row in rows("case") for name in re.findall(r"`([\w-]+)`", row[0])]
    assert sorted(named) == sorted(CASES) and len(named) == len(set(named))


def test_rays_converge_as_fast_as_it_says():
    from rtgi_addon.transport.context import LightContext
    from rtgi_addon.transport.paths.reference import trace_radiance
    context = LightContext(build.closed_box(albedo=0.6, light_position=(0.3, -0.4, 0.5)), 1)

    def light(directions):
        origins = np.broadcast_to(np.float32([-0.2, 0.1, -0.1]), directions.shape).copy()
        radiance = trace_radiance(context, origins, directions, bounces=1).astype(np.float64)
        return sh.project(directions.astype(np.float64), radiance, 4 * pi / len(directions), 2)

    def slope(draw):
        sizes, errors = (64, 4096), []
        for count in sizes:
            found = [light(sampling.sphere_from_square(draw(count, seed))) for seed in range(8)]
            errors.append(np.sqrt(np.mean([(one - truth) ** 2 for one in found])))
        return np.log(errors[1] / errors[0]) / np.log(sizes[1] / sizes[0])

    truth = light(sampling.fibonacci_sphere(1 << 18))
    assert slope(lambda count, seed: sampling.sobol_owen(count, 2, seed)) < -0.85
    assert -0.65 < slope(lambda count, seed: np.random.default_rng(seed).random((count, 2)).astype(np.float32)) < -0.4
