"""Engines' axes: the same light in other coordinates."""

import numpy as np
import pytest

from rtgi_addon.exchange.engines.axes import UNITY, UNREAL, Y_UP
from rtgi_addon.numerics import sh

AXES = {"y up": Y_UP, "unity": UNITY, "unreal": UNREAL}


@pytest.mark.parametrize("axes", AXES.values(), ids=AXES)
@pytest.mark.parametrize("order", [0, 1, 2, 3, 4])
def test_harmonics_give_the_same_light_in_the_same_direction(axes, order):
    rng = np.random.default_rng(order)
    coefficients = rng.normal(size=(3, (order + 1) ** 2, 2)).astype(np.float32)
    directions = rng.normal(size=(40, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    before = sh.evaluate(directions, order) @ coefficients
    after = sh.evaluate(axes.directions(directions), order) @ axes.harmonics(coefficients)
    assert np.abs(after - before).max() < 1e-5


@pytest.mark.parametrize("axes", AXES.values(), ids=AXES)
def test_a_matrix_takes_local_points_where_the_points_go(axes):
    rng = np.random.default_rng(0)
    matrix = np.eye(4)
    matrix[:3] = rng.normal(size=(3, 4))
    local = rng.normal(size=(10, 3))
    world = local @ matrix[:3, :3].T + matrix[:3, 3]
    engine = axes.matrix(matrix)
    assert np.allclose(local @ engine[:3, :3].T + engine[:3, 3], axes.vectors(world))
    assert np.allclose(axes.directions(world) @ axes.engine_from_blender, world)


@pytest.mark.parametrize(("axes", "up", "forward", "right", "unit", "mirrored"), [
    (Y_UP, (0, 1, 0), (0, 0, -1), (1, 0, 0), 1.0, False),
    (UNITY, (0, 1, 0), (0, 0, -1), (-1, 0, 0), 1.0, True),
    (UNREAL, (0, 0, 1), (0, -1, 0), (1, 0, 0), 100.0, True),
], ids=AXES)
def test_the_axes_are_the_engines(axes, up, forward, right, unit, mirrored):
    assert np.array_equal(axes.directions(np.array([[0.0, 0, 1], [0, 1, 0], [1, 0, 0]])), [up, forward, right])
    assert np.array_equal(axes.vectors(np.array([0.0, 0, 1])), unit * np.array(up))
    assert axes.mirrored is mirrored


def test_a_swizzle_is_exact():
    """What only changes places and signs must not be blurred by the quadrature."""
    for index in range(4):
        turned = Y_UP.harmonics(np.eye(9, dtype=np.float32)[:, [index]])
        assert np.count_nonzero(turned) == 1 and abs(turned).max() == 1.0
