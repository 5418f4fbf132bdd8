"""Normal equations that are put together by cells: the same products and solutions as the whole matrix gives."""

import numpy as np
import pytest

from rtgi_addon.techniques.lattice.normal_equations import PADDED, Cells, Equations

PROBES, TERMS = 12, 4


def drawn(points, seed=3):
    """Points of a few cells of ten probes, some of which have many points and some few; their matrix, and its parts."""
    rng = np.random.default_rng(seed)
    cells = np.stack([rng.permutation(PROBES)[:8] for _ in range(10)])
    index = cells[np.minimum(rng.geometric(0.25, points), 10) - 1]
    share, basis, weight = rng.random((points, 8)), rng.normal(size=(points, TERMS)), rng.random(points)
    weight[rng.random(points) < 0.2] = 0.0
    light = rng.normal(size=(points, 3))
    whole = np.zeros((points, PROBES, TERMS))
    np.add.at(whole, (np.arange(points)[:, None], index), share[:, :, None] * basis[:, None])
    return whole.reshape(points, -1), index, share, basis, weight, light


@pytest.mark.parametrize("points", [20, 400])
def test_products_are_those_of_the_whole_matrix(points):
    whole, index, share, basis, weight, light = drawn(points)
    counts = np.unique(index[weight > 0], axis=0, return_counts=True)[1]
    assert counts.max() > PADDED[-1] if points > 20 else counts.min() <= PADDED[0]
    equations = Cells(index, basis, PROBES, 1).weighed(share, weight, light)
    normal = whole.T @ (weight[:, None] * whole)
    asked = np.random.default_rng(1).normal(size=(PROBES, TERMS, 3))
    expected = (normal @ asked.reshape(-1, 3)).reshape(asked.shape)
    np.testing.assert_allclose(equations.product(asked), expected, atol=1e-4 * np.abs(expected).max())
    own = normal.reshape(PROBES, TERMS, PROBES, TERMS)[np.arange(PROBES), :, np.arange(PROBES)]
    np.testing.assert_allclose(equations.blocks(), own, atol=1e-4 * np.abs(own).max())
    right = (whole.T @ (weight[:, None] * light)).reshape(asked.shape)
    np.testing.assert_allclose(equations.wanted(), right, atol=1e-4 * np.abs(right).max())
    twice = Equations.join([equations, equations]).product(asked)
    np.testing.assert_allclose(twice, 2.0 * expected, atol=1e-4 * np.abs(expected).max())


def test_solutions_are_those_of_the_whole_matrix_from_anywhere():
    whole, index, share, basis, weight, light = drawn(400)
    rng, cost = np.random.default_rng(2), 0.5
    (missing, start), scale = rng.normal(size=(2, PROBES, TERMS, 3)), rng.random((PROBES, 1, 1))
    scale[3] = 0.0
    scales = np.repeat(scale.ravel(), TERMS)
    normal = scales[:, None] * (whole.T @ (weight[:, None] * whole)) * scales + cost * np.eye(len(scales))
    expected = np.linalg.solve(normal, scales[:, None] * missing.reshape(-1, 3)).reshape(missing.shape)
    found = Cells(index, basis, PROBES, 1).weighed(share, weight, light).best(missing, scale, cost, start, 60)
    np.testing.assert_allclose(found, expected, atol=0.02 * np.abs(expected).max())
    assert np.allclose(found[3], 0.0, atol=0.02)


def test_no_points_ask_nothing():
    none = Cells(np.zeros((0, 8), np.int64), np.zeros((0, TERMS)), PROBES, 1).weighed(np.zeros((0, 8)), np.zeros(0),
                                                                                                np.zeros((0, 3)))
    assert not none.product(np.ones((PROBES, TERMS, 3))).any() and not none.blocks().any() and not none.wanted().any()
