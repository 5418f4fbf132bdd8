"""The radiosity solver against dense linear algebra."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from rtgi_addon.progress import Progress
from rtgi_addon.transport.cache.form_factors import FormFactors
from rtgi_addon.transport.cache.solver import MAX_ITERATIONS, solve_radiosity
from rtgi_addon.transport.cache.texel_rows import TexelRows

ONES = np.ones((1, 3), np.float32)


def random_system(n=40, rays=24, albedo=(0.3, 0.6, 0.8), seed=0, missing=0.2):
    """Blocks of hits on n texels, some of them none, with source, first bounce and albedo; and F as a dense matrix."""
    rng = np.random.default_rng(seed)
    hits = rng.integers(0, n, (rays, n)).astype(np.int32)
    hits[rng.random((rays, n)) < missing] = -1
    dense = np.zeros((n, n))
    np.add.at(dense, (np.broadcast_to(np.arange(n), hits.shape)[hits >= 0], hits[hits >= 0]), 1.0 / rays)
    source, first = (np.append(rng.random((n, 3)), np.zeros((1, 3)), axis=0).astype(np.float32) for _ in range(2))
    reflectance = np.append(rng.random((n, 3)) * 0.4 + 0.6, np.zeros((1, 3)), axis=0) * np.array(albedo)
    cuts = [0, 7, 8, 25, n]
    blocks = [np.ascontiguousarray(hits[:, low:high]) for low, high in pairwise(cuts)]
    return blocks, source, first, reflectance.astype(np.float32), dense


def solve(system, bounces=None, tolerance=1e-7, threads=1):
    return solve_radiosity(factors(system[0]), *system[1:3], reflecting(system[3]), ONES, bounces, tolerance, threads, Progress())


def reflecting(albedo, translucency=None, opposite=None):
    """Rows of texels of this ``albedo`` (n + 1, 3), that pass nothing if not told what and from where."""
    none = np.full((len(albedo), 1), -1, np.int32)
    return replace(TexelRows.none(), albedo=albedo, translucency=np.zeros_like(albedo) if translucency is None else translucency,
                   opposite=none if opposite is None else opposite)


def factors(blocks):
    """Form factors that hit those texels, whatever the angle."""
    result = FormFactors(len(blocks[0]) if blocks else 1)
    result.hits = blocks
    return result


def exact(system):
    """received = first + F·ρ(source + received), solved directly."""
    _, source, first, albedo, dense = system
    source, first, albedo = (array[:-1].astype(np.float64) for array in (source, first, albedo))
    columns = []
    for channel in range(3):
        operator = dense * albedo[:, channel]
        right = first[:, channel] + operator @ source[:, channel]
        columns.append(np.linalg.solve(np.eye(len(dense)) - operator, right))
    return np.stack(columns, axis=1)


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("albedo", [(0.3, 0.6, 0.8), (0.95, 0.95, 0.0), (0.998, 0.5, 0.9)], ids=str)
def test_the_fixed_point_is_the_linear_systems_solution(seed, albedo):
    system = random_system(albedo=albedo, seed=seed)
    received = solve(system)
    np.testing.assert_allclose(received[:-1], exact(system), rtol=2e-5)
    assert not received[-1].any()


def test_extrapolation_converges_where_nothing_is_lost():
    """A closed room of albedo 0.95: plain iteration gains 5 % a pass, the steps taken here are fewer than a tenth of its."""
    system = random_system(n=300, albedo=(0.95, 0.95, 0.95), missing=0.0, seed=9)
    system[3][:-1] = 0.95
    steps = []

    class Counting(Progress):
        def step(self, fraction, label=""):
            steps.append(fraction)

    received = solve_radiosity(factors(system[0]), *system[1:3], reflecting(system[3]), ONES, None, 1e-6, 1, Counting())
    np.testing.assert_allclose(received[:-1], exact(system), rtol=1e-4)
    assert len(steps) < 0.1 * np.log(1e-6) / np.log(0.95) < MAX_ITERATIONS


@pytest.mark.parametrize("bounces", [0, 1, 2, 3, 7])
def test_a_number_of_bounces_is_a_partial_sum(bounces):
    """With n bounces in all, one of them the probe's own look, light passes between texels n − 1 times: what was reflected k
    times arrives as (Fρ)^(k−1)·(first bounce of lamps) and (Fρ)^k·source, k < n."""
    system = random_system(seed=4)
    _, source, first, albedo, dense = system
    expected = np.zeros((40, 3))
    for channel in range(3):
        operator = dense * albedo[:-1, channel].astype(float)
        lamps, fixed = first[:-1, channel].astype(float), operator @ source[:-1, channel].astype(float)
        for _ in range(max(0, bounces - 1)):
            expected[:, channel] += lamps + fixed
            lamps, fixed = operator @ lamps, operator @ fixed
    received = solve(system, bounces)
    np.testing.assert_allclose(received[:-1], expected, rtol=1e-5)
    assert not received[-1].any()


@pytest.mark.parametrize("bounces", [None, 4])
def test_texels_pass_on_what_their_other_sides_receive(bounces):
    """Half of the texels in pairs of sides: what leaves one is ρE of its own and τE of the other's."""
    blocks, source, first, albedo, dense = random_system(albedo=(0.4, 0.5, 0.6), seed=8)
    translucency = np.append(np.random.default_rng(1).random((40, 3)) * 0.4, np.zeros((1, 3)), axis=0).astype(np.float32)
    opposite = np.full((41, 1), -1, np.int32)
    opposite[:20, 0] = np.arange(20) ^ 1
    rows = reflecting(albedo, translucency, opposite)
    received = solve_radiosity(factors(blocks), source, first, rows, ONES, bounces, 1e-7, 1, Progress())
    swap = np.zeros((40, 40))
    swap[np.arange(20), np.arange(20) ^ 1] = 1.0
    for channel in range(3):
        leaving = np.diag(albedo[:-1, channel].astype(float)) + translucency[:-1, channel, None] * swap
        operator, fixed = dense @ leaving, source[:-1, channel].astype(float)
        if bounces is None:
            expected = np.linalg.solve(np.eye(40) - operator, first[:-1, channel] + operator @ fixed)
        else:
            terms = [first[:-1, channel] + operator @ fixed]
            for _ in range(bounces - 2):
                terms.append(operator @ terms[-1])
            expected = np.sum(terms, axis=0)
        np.testing.assert_allclose(received[:-1, channel], expected, rtol=2e-5)


def test_many_bounces_reach_the_limit():
    system = random_system(seed=2)
    np.testing.assert_allclose(solve(system, 200), solve(system), rtol=1e-5)


def test_where_it_starts_changes_the_way_and_not_the_end():
    system = random_system()
    blocks, source, first, albedo, _ = system
    expected, steps = exact(system), []
    near = np.append(1.02 * expected, np.zeros((1, 3)), axis=0).astype(np.float32)
    for start in (None, near, np.random.default_rng(3).random(source.shape).astype(np.float32) * 5):
        steps.append([])
        progress = Progress(lambda *said: steps[-1].append(said), interval=0.0)
        found = solve_radiosity(factors(blocks), source, first, reflecting(albedo), ONES, None, 1e-6, 1, progress, start=start)
        np.testing.assert_allclose(found[:-1], expected, rtol=2e-5)
    assert len(steps[1]) < len(steps[0])


def test_threads_do_not_change_a_bit():
    system = random_system(n=200, seed=3)
    results = {solve(system, threads=threads).tobytes() for threads in (1, 2, 5)}
    assert len(results) == 1


def test_nothing_lit_stays_exactly_dark_and_colours_do_not_mix():
    system = random_system(seed=6)
    for array in system[1:3]:
        array[:, 1] = 0
    received = solve(system)
    assert received[:-1, 0].min() > 0 and not received[:, 1].any() and received[:-1, 2].min() > 0


def test_black_surfaces_return_the_first_bounce():
    system = random_system(albedo=(0.0, 0.0, 0.0))
    np.testing.assert_array_equal(solve(system), system[2])


def test_a_scene_without_texels_is_solved_too():
    none = np.zeros((1, 3), np.float32)
    assert solve_radiosity(factors([]), none, none, TexelRows.none(), ONES, None, 1e-4, 1, Progress()).shape == (1, 3)
