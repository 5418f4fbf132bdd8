"""The irradiance function of light propagation volumes on the GPU against ``LpvField.irradiance``, relative to the largest
irradiance, and volumes that follow a lamp there."""

import numpy as np
import pytest
import scene_builders as build
from receivers import directions, points_in, relative_error

from rtgi_addon.techniques.lpv.field import LpvField
from rtgi_addon.techniques.lpv.grid import LpvGrid

TOLERANCE = 1e-5


@pytest.fixture(scope="module")
def indirect(gpu_device):
    from rtgi_addon.preview import indirect
    return indirect


def random_field(cascades, resolution=(8, 9, 10), **params):
    """Cascades of any light, nested about (1, 1, 1)."""
    rng = np.random.default_rng(5)
    grids = tuple(LpvGrid(tuple(1.0 - 0.5 * 0.25 * 2**level * np.array(resolution)), 0.25 * 2**level, resolution)
                  for level in range(cascades))
    return LpvField(grids, tuple(rng.normal(size=(4, 3, *resolution[::-1])).astype(np.float32) for _ in grids), params=params,
                    stats={})


@pytest.mark.parametrize("dampening", [True, False])
@pytest.mark.parametrize("cascades", [1, 2, 3])
def test_cascades(indirect, cascades, dampening):
    field = random_field(cascades, dampening=dampening)
    points = points_in(4.0, 4000) + np.float32(1.0)
    assert relative_error(indirect.make_indirect(field, build.closed_box()), field, points, directions(4000)).max() < TOLERANCE


@pytest.mark.parametrize("resolution", [(1, 1, 1), (5, 1, 3), (33, 2, 40)])
def test_every_shape(indirect, resolution):
    field = random_field(2, resolution)
    points = points_in(4.0, 1000) + np.float32(1.0)
    assert relative_error(indirect.make_indirect(field, build.closed_box()), field, points, directions(1000)).max() < TOLERANCE
