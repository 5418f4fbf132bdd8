"""Rays that go where light is uneven: every cell has its own number, nothing is counted twice, and the mean is without bias."""

import numpy as np
import pytest
import room_scenes as rooms
import scene_builders as build
from probe_bakes import Memory, bake, bytes_of, coefficients, rms

from rtgi_addon.numerics.sampling import hash_u32, sobol_owen_at
from rtgi_addon.techniques.probes.bake import ProbeBake
from rtgi_addon.techniques.probes.relight import relit_sums
from rtgi_addon.techniques.probes.strata import CELLS, REFINED, SIDE, Strata

SEED = 3


def points(groups, order):
    return sobol_owen_at(order, 2, hash_u32(SEED, groups)[:, None])


def window(points, spot=0.0):
    """Bright within a slanting window of the unit square, and in a ``spot`` smaller than a cell."""
    x, y = points[..., 0].astype(float), points[..., 1].astype(float)
    inside = (np.abs(x - 0.45 + 0.2 * (y - 0.5)) < 0.15) & (np.abs(y - 0.55) < 0.15)
    return 1.0 + 8.0 * inside + spot * ((np.abs(x - 0.9) < 0.02) & (np.abs(y - 0.13) < 0.015))


def refined(groups, light=window):
    """Strata of so many groups of one probe under ``light``."""
    strata, every = Strata(groups, SEED), np.arange(groups)
    strata.refine(every, light(points(every, np.arange(CELLS)[None]))[:, None].astype(np.float32))
    return strata


def rays_of(strata, groups, most):
    """The points (g, most, 2) and weights of all rays."""
    order, before = [np.broadcast_to(np.arange(CELLS), (len(groups), CELLS))], CELLS
    while before < most:
        order.append(strata.spread(groups, before, 2 * before).order)
        before *= 2
    found = points(groups, np.concatenate(order, axis=1))
    return np.concatenate(order, axis=1), found, strata.weights(groups, found)


def test_every_cell_has_its_number_of_the_sequence_each_once():
    strata, groups = refined(20), np.arange(20)
    for most in (REFINED, 4 * REFINED):
        order, found, weights = rays_of(strata, groups, most)
        cell = (found * SIDE).astype(int) @ [SIDE, 1]
        for group in groups:
            assert len(np.unique(order[group])) == most
            count = np.bincount(cell[group], minlength=CELLS)
            np.testing.assert_array_equal(count, 2 ** strata.doubled[group].astype(int) * (most // REFINED))
            # The first of those that lie there: each run of the sequence has one in every cell.
            np.testing.assert_array_equal(np.bincount(cell[group], order[group] // CELLS + 1, CELLS), count * (count + 1) / 2)
            np.testing.assert_allclose(np.bincount(cell[group], weights[group], CELLS), most / CELLS, rtol=1e-6)
    spread = strata.spread(groups, REFINED, 2 * REFINED)
    np.testing.assert_array_equal(spread.weights, strata.weights(groups, points(groups, spread.order)))


@pytest.mark.parametrize("spot", [0.0, 40.0], ids=["edges", "a spot smaller than a cell"])
def test_means_are_without_bias_and_nearer_where_there_are_edges(spot):
    groups, grid = np.arange(1500), (np.arange(2000) + 0.5) / 2000
    truth = window(np.stack(np.meshgrid(grid, grid, indexing="ij"), axis=-1), spot).mean()
    _, found, weights = rays_of(refined(len(groups), lambda at: window(at, spot)), groups, REFINED)
    means = (window(found, spot) * weights).mean(axis=1)
    assert abs(means.mean() - truth) < 3.0 * means.std() / np.sqrt(len(groups))
    even = window(points(groups, np.arange(REFINED)[None]), spot).mean(axis=1)
    # What nothing about it tells of has half the rays.
    assert means.std() < (2.0 if spot else 0.7) * even.std()


@pytest.mark.parametrize("light", [lambda at: np.ones(at.shape[:-1]), lambda at: np.zeros(at.shape[:-1]),
                                   lambda at: np.random.default_rng(1).random(at.shape[:-1])], ids=["even", "dark", "noise"])
def test_light_that_no_place_of_is_special_is_left_alone(light):
    strata = refined(5, light)
    assert not strata.refined(np.arange(5)).any()
    np.testing.assert_array_equal(strata.spread(np.arange(5), 256, 1024).order, np.tile(np.arange(256, 1024), (5, 1)))


def under_a_sky(resolution=(4, 4, 2)):
    scene = build.scene([build.plane(half_size=4.0, z=-0.7), build.cube(half_size=0.3)], world=1.0,
                        volumes=(build.volume(resolution=resolution, half_size=0.6),))
    return scene


def spread_bake(monkeypatch, scene, **settings):
    """The field of a bake, and the ProbeBake that it comes from."""
    bakes, run = [], ProbeBake.run
    monkeypatch.setattr(ProbeBake, "run", lambda self: bakes.append(self) or run(self))
    return bake(scene, **settings), bakes[0]


def test_rays_that_are_spread_are_what_is_kept_of_them_and_agree_with_others(monkeypatch):
    field, made = spread_bake(monkeypatch, under_a_sky(), error=0.005)
    assert np.any(made.model.turned == CELLS) and made.model.rays.max() >= 2 * REFINED
    # The first rays were weighed anew: all together are the sums that the same rays make when they are weighed for the first time.
    sums = relit_sums(made.memory, made.gatherer, np.zeros_like(made.model.total), None, made._progress)
    np.testing.assert_allclose(sums, made.model.total, rtol=1e-4, atol=1e-4 * np.abs(made.model.total).max())
    others = coefficients(bake(under_a_sky(), seed=5, rays=8192))
    assert rms(coefficients(field) - others) < 0.008 * rms(others)
    # Distances are means over directions, not over rays.
    even = np.concatenate([grid.visibility.reshape(-1, 64, 2) for grid in bake(under_a_sky(), seed=5, rays=8192).grids()])
    spread = np.concatenate([grid.visibility.reshape(-1, 64, 2) for grid in field.grids()])
    assert rms(spread[..., 0] - even[..., 0]) < 0.1 * rms(even[..., 0])
    assert abs(np.mean(spread[..., 0]) - np.mean(even[..., 0])) < 0.005 * np.mean(even[..., 0])


def test_lamps_that_glow_are_weighed_alike(monkeypatch):
    scene = rooms.panel_room(resolution=(4, 2, 1), half_size=0.7)
    field, made = spread_bake(monkeypatch, scene, error=0.006)
    others = coefficients(bake(scene, seed=5, rays=4096, cache_rays=64))
    assert made.emitted is not None and rms(coefficients(field) - others) < 0.01 * rms(others)


def test_a_bake_that_breaks_off_ends_with_the_same_bytes():
    scene = under_a_sky((4, 2, 2))
    expected = bytes_of(bake(scene, error=0.006))
    for stop in (2, 4):
        broken = Memory(stop=stop)
        with pytest.raises(KeyboardInterrupt):
            bake(scene, error=0.006, checkpoint=broken)
        assert bytes_of(bake(scene, error=0.006, checkpoint=Memory(broken.stored), threads=1)) == expected
