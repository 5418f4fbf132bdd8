"""Points on rays that lamps' falloff draws: they find the same light as points drawn by what reaches the eye, with less noise."""

import numpy as np
import pytest
from scene_builders import cube, material, plane, point_light, transform, volume

from rtgi_addon.numerics.sampling import fibonacci_sphere
from rtgi_addon.scene import ClosedMesh, DensityGrid, Instance, Medium, Phase, PointLight, Scene, SpotLight, SunLight, World
from rtgi_addon.transport.context import LightContext
from rtgi_addon.transport.paths.reference import trace_radiance
from rtgi_addon.transport.paths.scattering import walk
from rtgi_addon.transport.paths.sources import Sources

BALL = PointLight("ball", np.array([0.5, 0.5, 0.5]), np.array([3.0, 2, 1]), 0.1)
SPOT = SpotLight("spot", np.array([0.0, 0, 1.5]), np.array([0.0, 0, -1]), np.full(3, 50.0), 0.6, 0.2, 0.1)
SUN = SunLight("sun", np.array([0.0, 0.3, -1]), np.ones(3))
MANY = [BALL, SPOT, SUN, *(PointLight(f"lamp {i}", np.array([x, y, 0.0]), np.ones(3), 0.05)
                           for i, (x, y) in enumerate([(-1.5, 0.2), (1.2, -1.3), (0.4, 1.6)]))]


def context_of(media, lights):
    far = plane("far", 0.01, z=-2000)
    return LightContext(Scene("media", (far,), (Instance("far", 0, np.eye(4)),), (material(),), tuple(lights),
                              World.constant(0.0), (volume(),), media=tuple(media)))


def mist():
    """Thin, with a dense grid in it."""
    box = ClosedMesh(cube().vertices_local, cube().triangles, transform((0, 0, 0), (3, 3, 2)))
    grid = DensityGrid(transform(scale=(2, 2, 1)), np.random.default_rng(3).uniform(0, 1, (4, 4, 4)).astype(np.float32) ** 3)
    return [Medium("mist", np.array([0.3, 0.2, 0.1]), np.full(3, 0.05), phase=Phase(anisotropy=0.5), bounds=box),
            Medium("smoke", np.full(3, 0.8), np.full(3, 0.4), grid=grid)]


def gained(context, seed, most_turns=None, count=1 << 11):
    """What walks along fixed rays from one point gain (n,), the mean of their colours."""
    rays = np.tile(np.float32([[1.0, -1.2, 0.3]]), (count, 1)), fibonacci_sphere(count).astype(np.float32)
    key = np.arange(count, dtype=np.uint32) + np.uint32(seed * count)
    walks = walk(context, Sources(context), *rays, np.full(count, np.inf), key, most_turns=most_turns)
    return walks.gained.mean(axis=1).astype(np.float64)


def test_a_lamp_by_a_ray_in_thin_haze_hardly_has_noise():
    """σ_s·I/(4h), of the middle 10 m 2·atan(5/h)/π, where all points of a ray weigh nearly the same."""
    haze = context_of([Medium("haze", np.full(3, 1e-4))], [point_light()])
    n = 1 << 12
    rays = np.tile(np.float32([-5, 0.05, 0]), (n, 1)), np.tile(np.float32([1, 0, 0]), (n, 1))
    light = walk(haze, Sources(haze), *rays, np.full(n, 10.0), np.arange(n, dtype=np.uint32), most_turns=1).gained[:, 0]
    assert light.mean() == pytest.approx(1e-4 / (4 * 0.05) * 2 * np.arctan(5 / 0.05) / np.pi, rel=0.015)
    assert light.std() < 0.6 * light.mean()


@pytest.mark.parametrize("lights, falls", [([BALL], 3.0), ([SPOT], 3.0), (MANY, 2.0)], ids=["ball", "spot", "many"])
def test_lamps_draw_their_points_without_bias_and_with_less_noise(monkeypatch, lights, falls):
    """The mean is that of points which lamps do not draw, and of paths; ``falls`` is how often the variance is smaller at least."""
    context = context_of(mist(), lights)
    drawn = np.stack([gained(context, seed, 1) for seed in range(8)])
    paths = np.tile(np.float32([[1.0, -1.2, 0.3]]), (1 << 15, 1)), fibonacci_sphere(1 << 15).astype(np.float32)
    by_paths = trace_radiance(context, *paths, bounces=1, seed=4).mean(axis=1).astype(np.float64)
    monkeypatch.setattr(Sources, "standing", {})
    plain = np.stack([gained(context, seed, 1) for seed in range(8)])
    error = [part.std(axis=0, ddof=1).astype(float) for part in (drawn, plain)]
    variances = [np.mean(part**2) for part in error]
    standard = np.sqrt(np.array(variances) / drawn.size)
    assert abs(drawn.mean() - plain.mean()) < 4 * np.hypot(*standard)
    assert abs(drawn.mean() - by_paths.mean()) < 4 * np.hypot(standard[0], by_paths.std() / np.sqrt(len(by_paths)))
    assert variances[0] * falls < variances[1]


def test_all_orders_are_the_same_by_both(monkeypatch):
    context = context_of(mist(), MANY)
    drawn = np.array([gained(context, seed, count=1 << 10).mean() for seed in range(8)])
    monkeypatch.setattr(Sources, "standing", {})
    plain = np.array([gained(context, seed + 8).mean() for seed in range(6)])
    assert abs(drawn.mean() - plain.mean()) < 4 * np.hypot(drawn.std(ddof=1), plain.std(ddof=1)) / np.sqrt(6)


def test_suns_alone_are_met_where_walks_turn():
    sources = Sources(context_of(mist(), [SUN]))
    assert sources.standing == {}
