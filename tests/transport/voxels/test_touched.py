"""Cells that triangles touch, held to the thirteen directions one by one, and to points of triangles."""

from itertools import product

import numpy as np
import pytest

from rtgi_addon.transport.voxels.touched import touched_cells

LOW, HIGH = np.array([0, 0, 0]), np.array([7, 6, 5])


def touched(corners, low=LOW, high=HIGH):
    """Set of (triangle, x, y, z), no pair of which comes twice."""
    pairs = [(int(row), *map(int, place)) for rows, cells in touched_cells(corners, low, high) for row, place in
             zip(rows, cells, strict=True)]
    assert len(pairs) == len(set(pairs))
    return set(pairs)


def kept_apart(corners, cells):
    """By how much (c,) the best of the thirteen directions keeps a triangle off cells (c, 3); less than 0 where none does."""
    edges = np.roll(corners, -1, axis=0) - corners
    directions = [*np.eye(3), np.cross(edges[0], edges[1]), *(np.cross(edge, axis) for edge in edges for axis in np.eye(3))]
    gaps = []
    for direction in directions:
        along, reach = (corners[:, None] - (cells + 0.5)) @ direction, 0.5 * np.abs(direction).sum()
        gaps.append(np.maximum(along.min(axis=0) - reach, -reach - along.max(axis=0)))
    return np.max(gaps, axis=0)


@pytest.mark.parametrize("size", [0.05, 1.0, 6.0])
def test_cells_are_those_that_no_direction_keeps_off(size):
    rng = np.random.default_rng(4)
    corners = rng.uniform(-1, 8, (40, 1, 3)) + size * rng.normal(size=(40, 3, 3))
    cells, found = np.array(list(product(*(range(count) for count in HIGH)))), touched(corners)
    exact = {(row, *cell) for row in range(40) for cell in cells[kept_apart(corners[row], cells) <= 0].tolist()}
    assert found == exact and len(exact) > 10


def test_a_thin_rod_is_touched_all_along():
    start, end = np.array([0.3, 0.2, 0.1]), np.array([6.1, 5.4, 4.7])
    across = 1e-4 * np.array([0.5, -0.6, 0.1])
    found = touched(np.array([[start, end, end + across], [start, end + across, start + across]]))
    places = start + np.linspace(0, 1, 5001)[:, None] * (end - start)
    cells = {tuple(cell) for cell in np.floor(places).astype(int).tolist()}
    assert cells <= {pair[1:] for pair in found} and len(cells) >= 15


def test_what_lies_between_two_cells_touches_both_and_points_and_lines_count():
    between = np.array([[[0.2, 0.2, 2.0], [0.8, 0.2, 2.0], [0.2, 0.8, 2.0]]])
    assert touched(between) == {(0, 0, 0, 1), (0, 0, 0, 2)}
    point, line = np.full((1, 3, 3), 1.5), np.array([[[0.5, 0.5, 0.5], [3.5, 0.5, 0.5], [2.5, 0.5, 0.5]]])
    assert touched(point) == {(0, 1, 1, 1)} and touched(line) == {(0, x, 0, 0) for x in range(4)}
    assert touched(np.array([[[-3, 0.5, 0.5], [-2, 0.5, 0.5], [-2, 1, 1.0]]])) == set()
