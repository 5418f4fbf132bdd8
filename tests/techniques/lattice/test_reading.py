"""The look-up with derivatives: the same light as the look-up itself, and derivatives that differences bear out."""

from dataclasses import replace

import numpy as np
import pytest

from rtgi_addon.numerics import octahedral, sh
from rtgi_addon.numerics.sampling import fibonacci_sphere
from rtgi_addon.scene import ProbeVolume
from rtgi_addon.techniques.base import ProbeGrid
from rtgi_addon.techniques.lattice.field import ProbeField
from rtgi_addon.techniques.lattice.fitting import measured_by
from rtgi_addon.techniques.lattice.lookup import LookupSettings
from rtgi_addon.techniques.lattice.reading import FieldReading

TILE = 8


def grid(name, resolution, half_size, seed, order=2):
    """Random light and distances in a box about the origin; one probe is dead."""
    rng, shape = np.random.default_rng(seed), tuple(reversed(resolution))
    coefficients = rng.normal(size=(*shape, sh.coefficient_count(order), 3)).astype(np.float32)
    coefficients[..., 0, :] = 4.0 + np.abs(coefficients[..., 0, :])
    mean = rng.uniform(0.3, 2.0, (*shape, TILE, TILE)).astype(np.float32)
    visibility = np.stack([mean, mean**2 * rng.uniform(1.05, 1.5, mean.shape).astype(np.float32)], axis=-1)
    validity = np.ones(shape, np.float32)
    validity[0, 0, 0] = 0.0
    volume = ProbeVolume(name, np.diag([half_size] * 3 + [1.0]), resolution)
    return ProbeGrid(volume, coefficients, validity, visibility, np.zeros((*shape, 3), np.float32), np.zeros(shape, np.float32))


def nested(order=2):
    grids = grid("wide", (3, 4, 3), 2.0, 1, order), grid("narrow", (4, 3, 4), 0.9, 2, order)
    return ProbeField(grids, lookup=LookupSettings("linear"))


def read_of(reading, stored):
    """What the points of ``reading`` receive by what is ``stored``, and how they weigh it."""
    weighed = reading.weigh(stored)
    return reading.read(weighed, stored.coefficients), weighed


def receivers(count=400):
    rng = np.random.default_rng(3)
    return rng.uniform(-2.2, 2.2, (count, 3)).astype(np.float32), fibonacci_sphere(count)


@pytest.mark.parametrize("order", [0, 1, 2, 4])
def test_it_reads_what_the_field_reads(order):
    field, (points, normals) = nested(order), receivers()
    reading = FieldReading(field, points, normals)
    read, _ = read_of(reading, measured_by(field))
    expected = field.irradiance(points, normals)
    # Beyond the dead probe's corner nothing else is read; what rings is cut off by the look-up alone.
    assert 0.99 < reading.known.mean() < 1.0 and not read.irradiance[~reading.known].any()
    lit = reading.known & np.all(expected > 0, axis=1)
    assert lit.mean() > 0.9 and np.allclose(read.irradiance[lit], expected[lit], rtol=1e-4, atol=1e-4)


def test_points_with_no_live_probe_beside_them_are_not_known():
    field = nested()
    dead = ProbeField([replace(one, validity=np.zeros_like(one.validity)) for one in field.grids()], lookup=field.lookup)
    reading = FieldReading(dead, *receivers())
    assert not reading.known.any() and not read_of(reading, measured_by(field))[0].irradiance.any()


@pytest.mark.parametrize(("number", "part"), [(0, "mean"), (1, "variance")])
def test_derivatives_are_those_of_differences(number, part):
    field, (points, normals) = nested(), receivers()
    reading, stored = FieldReading(field, points, normals), measured_by(field)
    asked = np.random.default_rng(5).normal(size=(len(points), 3))
    read, weighed = read_of(reading, stored)
    slopes = reading.by_distances(stored, weighed, read, asked)[number]
    # Along the slopes, where rounding to float32 is small against what changes.
    step = 1e-3 * np.abs(getattr(stored, part)) * np.sign(slopes)

    def value(sign):
        moved = replace(stored, **{part: getattr(stored, part) + sign * step})
        return float(np.sum(asked * read_of(reading, moved)[0].irradiance))

    assert np.isclose(np.sum(slopes * step), 0.5 * (value(1.0) - value(-1.0)), rtol=0.01)


def test_the_transpose_is_the_transpose():
    field, (points, normals) = nested(), receivers()
    reading = FieldReading(field, points, normals)
    weighed, rng = reading.weigh(measured_by(field)), np.random.default_rng(6)
    coefficients, light = rng.normal(size=measured_by(field).coefficients.shape), rng.normal(size=(len(points), 3))
    forth, back = reading.read(weighed, coefficients).irradiance, reading.by_coefficients(weighed, light)
    assert np.isclose(np.sum(forth * light), np.sum(back * coefficients), rtol=1e-4)


def test_the_normal_equations_are_those_of_what_is_read():
    """Where lattices overlap as well: AᵀWA is the transpose of reading, of what is read, weighed."""
    field, (points, normals) = nested(), receivers()
    reading = FieldReading(field, points, normals)
    weighed, rng = reading.weigh(measured_by(field)), np.random.default_rng(8)
    coefficients, weight = rng.normal(size=measured_by(field).coefficients.shape), rng.random(len(points))
    expected = reading.by_coefficients(weighed, weight[:, None] * reading.read(weighed, coefficients).irradiance)
    light = rng.normal(size=(len(points), 3))
    equations = reading.equations(weighed, weight, light)
    np.testing.assert_allclose(equations.product(coefficients), expected, atol=1e-4 * np.abs(expected).max())
    right = reading.by_coefficients(weighed, weight[:, None] * light)
    np.testing.assert_allclose(equations.wanted(), right, atol=1e-4 * np.abs(right).max())


def test_curvature_is_the_square_of_what_each_number_moves():
    field, (points, normals) = nested(), receivers(60)
    reading, stored = FieldReading(field, points, normals), measured_by(field)
    weight = np.linspace(0.5, 2.0, len(points))
    read, weighed = read_of(reading, stored)
    curvature = dict(zip(("mean", "variance"), reading.curvature(stored, weighed, read, weight), strict=True))
    for part, step in (("mean", 1e-3), ("variance", 1e-2)):
        place = np.unravel_index(int(np.argmax(curvature[part])), curvature[part].shape)
        moved = []
        for sign in (1.0, -1.0):
            values = np.array(getattr(stored, part))
            values[place] = values[place] * np.exp(sign * step)
            moved.append(read_of(reading, replace(stored, **{part: values}))[0].irradiance)
        change = (moved[0] - moved[1]) / (2.0 * step)
        assert np.isclose(np.sum(weight[:, None] * change**2), curvature[part][place], rtol=0.05), part


def test_threads_change_nothing():
    field, (points, normals) = nested(), receivers(3000)
    stored = measured_by(field)
    found = []
    for threads in (1, 4):
        reading = FieldReading(field, points, normals, threads)
        read, weighed = read_of(reading, stored)
        found.append([read.irradiance, *reading.by_distances(stored, weighed, read, read.irradiance),
                      reading.by_coefficients(weighed, read.irradiance),
                      reading.equations(weighed, np.ones(len(points)), read.irradiance).product(stored.coefficients)])
    assert all(np.array_equal(one, other) for one, other in zip(*found, strict=True))


def test_stored_is_what_probes_store():
    field = nested()
    stored = measured_by(field)
    assert len(stored.mean) == 36 + 48
    # Finest cells first.
    assert np.allclose(stored.mean[:48], field.grids()[1].visibility[..., 0].reshape(48, -1))
    taken = stored.take(slice(48, None))
    assert np.array_equal(taken.mean, stored.mean[48:]) and np.array_equal(taken.coefficients, stored.coefficients[48:])
    assert octahedral.add_border(field.grids()[0].visibility).shape[-2] == TILE + 2
