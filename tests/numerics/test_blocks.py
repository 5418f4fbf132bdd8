"""Blocks of long arrays, and what is done to them."""

import numpy as np
import pytest

from rtgi_addon.numerics.blocks import BLOCK, blocks, cross, extent


@pytest.mark.parametrize("count", [0, 1, BLOCK, BLOCK + 1, 3 * BLOCK - 1])
def test_blocks_cover_every_row_once(count):
    rows = np.arange(count)
    parts = [rows[part] for part in blocks(count)]
    assert np.concatenate([*parts, rows[:0]]).tolist() == rows.tolist() and all(0 < len(part) <= BLOCK for part in parts)


@pytest.mark.parametrize("kind", [np.float32, np.float64])
def test_cross_products_are_numpys_to_the_bit(kind):
    first, second = np.random.default_rng(1).normal(size=(2, 1000, 3)).astype(kind)
    assert cross(first, second).tobytes() == np.cross(first, second).tobytes()


def test_the_extent_of_points_is_that_of_each_axis():
    points = np.random.default_rng(2).normal(size=(100, 3))
    low, high = extent(points)
    assert (low == points.min(axis=0)).all() and (high == points.max(axis=0)).all()
    points[7, 1] = np.nan
    assert np.isnan(extent(points)[0]).tolist() == [False, True, False]
