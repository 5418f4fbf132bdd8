"""Minima that are known: of a parabola by conjugate gradients, of Rosenbrock's valley by BFGS."""

import numpy as np
import pytest

from rtgi_addon.numerics.minimize import minimize, solve


def definite(size, seed=1):
    """A symmetric matrix (size, size) whose eigenvalues are 1 … size."""
    axes = np.linalg.qr(np.random.default_rng(seed).normal(size=(size, size)))[0]
    return axes @ np.diag(np.arange(1.0, size + 1)) @ axes.T


def test_conjugate_gradients_solve_every_column_in_as_many_steps_as_there_are_unknowns():
    matrix, found = definite(9), np.random.default_rng(2).normal(size=(9, 3))
    assert np.allclose(solve(lambda x: matrix @ x, matrix @ found, 9, enough=0.0), found, atol=1e-9)


def test_they_stop_when_enough_is_found_and_leave_alone_what_nothing_asks_for():
    matrix, calls = definite(20), []

    def product(x):
        calls.append(1)
        return matrix @ x

    right = np.zeros((20, 3))
    right[:, 1] = matrix @ np.ones(20)
    found = solve(product, right, 20, enough=0.1)
    assert 0 < len(calls) < 15 and not found[:, ::2].any()
    assert np.linalg.norm(matrix @ found[:, 1] - right[:, 1]) < 0.1 * np.linalg.norm(right[:, 1])


def test_a_first_guess_is_held_to_the_whole_not_to_what_it_left():
    matrix = definite(20)
    whole, calls = matrix @ np.ones((20, 1)), []

    def product(x):
        calls.append(1)
        return matrix @ x

    left = 0.05 * whole
    assert not solve(product, left, 20, 0.1, whole).any() and not calls
    found = solve(product, left, 20, 0.01, whole)
    assert calls and np.linalg.norm(matrix @ found - left) <= 0.01 * np.linalg.norm(whole)


def valley(x):
    """Rosenbrock's function and its gradient; 0 at (1, …, 1)."""
    along, across = 1.0 - x[:-1], x[1:] - x[:-1] ** 2
    gradient = np.zeros_like(x)
    gradient[:-1] = -2.0 * along - 400.0 * x[:-1] * across
    gradient[1:] += 200.0 * across
    return float(np.sum(along**2 + 100.0 * across**2)), gradient


def test_bfgs_follows_a_bent_valley_to_its_end():
    assert np.allclose(minimize(valley, np.array([-1.2, 1.0, -1.2, 1.0]), 200, 0.1), 1.0, atol=1e-4)


@pytest.mark.parametrize("steps", [1, 3, 10])
def test_no_step_climbs(steps):
    start = np.array([-1.2, 1.0])
    assert valley(minimize(valley, start, steps, 100.0))[0] < valley(minimize(valley, start, steps - 1, 100.0))[0]


def test_what_is_no_number_is_too_far():
    def walled(x):
        with np.errstate(invalid="ignore"):
            return float(-np.log(x[0]) + x[0]), np.array([1.0 - 1.0 / x[0]])

    assert np.isclose(minimize(walled, np.array([0.01]), 30, 50.0)[0], 1.0, atol=1e-3)


def test_at_a_minimum_it_stays():
    assert np.array_equal(minimize(valley, np.ones(3), 5, 0.1), np.ones(3))
