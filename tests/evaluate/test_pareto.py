"""The front is what nothing else beats; equal-time and equal-error picks are settings that were measured."""

import numpy as np
import pytest

from rtgi_addon.evaluate.pareto import best_within, cheapest_within, pareto_front, round_steps


def test_the_front_by_exhaustive_comparison():
    rng = np.random.default_rng(1)
    for _ in range(20):
        cost, error = rng.integers(0, 12, 30).astype(float), rng.integers(0, 12, 30).astype(float)
        front = pareto_front(cost, error)
        beaten = [any((cost[j] <= cost[i] and error[j] <= error[i]) and (cost[j] < cost[i] or error[j] < error[i])
                      for j in range(30)) for i in range(30)]
        assert set(zip(cost[front], error[front], strict=True)) == {
            (cost[i], error[i]) for i in range(30) if not beaten[i]}
        assert np.all(np.diff(cost[front]) > 0) and np.all(np.diff(error[front]) < 0)


def test_points_that_are_not_finite_are_never_on_it():
    assert pareto_front([1.0, 0.5, np.nan], [1.0, np.inf, 0.1]).tolist() == [0]


def test_picks():
    cost, error = [1.0, 2.0, 4.0], [0.3, 0.1, 0.2]
    assert best_within(cost, error, 0.5) is None and best_within(cost, error, 1.0) == 0 and best_within(cost, error, 9.0) == 1
    assert cheapest_within(cost, error, 0.05) is None and cheapest_within(cost, error, 0.25) == 1


@pytest.mark.parametrize(("low", "high", "expected"), [
    (0.03, 0.3, [0.05, 0.1, 0.2, 0.5]), (1.0, 5.0, [1, 2, 5]), (7.0, 7.0, [10.0]), (0.2, 0.2, [0.2])])
def test_round_steps(low, high, expected):
    assert round_steps(low, high) == pytest.approx(expected)
