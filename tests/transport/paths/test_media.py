"""Paths and walks through media, held to closed forms: single scattering, all orders (Chandrasekhar), uniform fields, grids."""

import numpy as np
import pytest
from scene_builders import cube, material, plane, point_light, transform, volume

from rtgi_addon.numerics.sampling import fibonacci_sphere
from rtgi_addon.scene import ClosedMesh, DensityGrid, Instance, Medium, Phase, Scene, SunLight, World
from rtgi_addon.transport.context import LightContext
from rtgi_addon.transport.media.table import MediaTable
from rtgi_addon.transport.paths.reference import trace_radiance
from rtgi_addon.transport.paths.scattering import walk
from rtgi_addon.transport.paths.sources import Sources
from rtgi_addon.transport.paths.tracking import collide, glow

SUN = SunLight("sun", np.array([0.0, 0, -1]), np.ones(3))
DEEP = ClosedMesh(cube().vertices_local, cube().triangles, transform((0, 0, -500), (3e4, 3e4, 500)))
# H(1) of isotropic scattering by albedo (S. Chandrasekhar, "Radiative Transfer", 1950, table XI).
CHANDRASEKHAR = {0.5: 1.25126, 0.9: 1.85010, 0.99: 2.47279}


def context_of(media, lights=(), world=0.0):
    """Media in empty space, with lamps, before a world; a speck far away makes it a scene."""
    far = plane("far", 0.01, z=-2000)
    return LightContext(Scene("media", (far,), (Instance("far", 0, np.eye(4)),), (material(),), tuple(lights),
                              World.constant(world), (volume(),), media=tuple(media)))


def seen(context, origin, direction, paths=1 << 12, bounces=None):
    """Mean radiance of one ray and its standard error, from independent paths."""
    rays = np.tile(np.float32(origin), (paths, 1)), np.tile(np.float32(direction), (paths, 1))
    radiance = trace_radiance(context, *rays, bounces=bounces, seed=3)[:, 0].astype(np.float64)
    return radiance.mean(), radiance.std() / np.sqrt(paths)


def test_a_point_light_in_a_thin_medium():
    """σ_s·I/(4h) by one scattering along an infinite ray at the distance h; of its middle 10 m, 2·atan(5/h)/π of that."""
    haze = context_of([Medium("haze", np.full(3, 1e-4))], [point_light()])
    n = 1 << 14
    rays = np.tile(np.float32([-5, 0.5, 0]), (n, 1)), np.tile(np.float32([1, 0, 0]), (n, 1))
    walks = walk(haze, Sources(haze), *rays, np.full(n, 10.0), np.arange(n, dtype=np.uint32), most_turns=1)
    expected = 1e-4 / (4 * 0.5) * 2 * np.arctan(5 / 0.5) / np.pi
    assert walks.gained[:, 0].mean() == pytest.approx(expected, rel=0.04)


def test_a_point_light_in_fog():
    """B. Sun et al., "A Practical Analytic Single Scattering Model for Real Time Rendering", 2005: β 0.4, lamp at 3 m under the
    angle 0.7 to the ray, 6 m of it."""
    lamp = point_light((3 * np.cos(0.7), 3 * np.sin(0.7), 0))
    fog = context_of([Medium("fog", np.full(3, 0.4))], [lamp])
    n = 1 << 13
    rays = np.zeros((n, 3), np.float32), np.tile(np.float32([1, 0, 0]), (n, 1))
    walks = walk(fog, Sources(fog), *rays, np.full(n, 6.0), np.arange(n, dtype=np.uint32), most_turns=1)
    assert walks.gained[:, 0].mean() == pytest.approx(0.0052979277, rel=0.02)


def test_a_shaft_of_sun():
    """(σ_s/σ_t)·p·E·(1 − e^(−σ_t·d)) of a lit stretch of d, at right angles to the sun: Rayleigh sends 3/16π there."""
    box = ClosedMesh(cube().vertices_local, cube().triangles, transform((0, 0, 0), (1, 1, 1e-3)))
    for phase, value in ((Phase(), 1 / (4 * np.pi)), (Phase("RAYLEIGH"), 3 / (16 * np.pi))):
        medium = Medium("shaft", np.array([0.5] * 3), np.array([0.3] * 3), phase=phase, bounds=box)
        mean, error = seen(context_of([medium], [SUN]), (-3, 0, 0), (1, 0, 0), 1 << 12, bounces=1)
        assert mean == pytest.approx(0.5 / 0.8 * value * (1 - np.exp(-1.6)), abs=4 * error + 2e-4 * value)


def test_forward_scattering_is_brighter_towards_the_lamp():
    fog = Medium("fog", np.full(3, 0.1), phase=Phase(anisotropy=0.6))
    context = context_of([fog], [point_light((5, 0, 0))])
    towards, away = (seen(context, (0, 0.5, 0), (side, 0, 0), 1 << 11, bounces=1)[0] for side in (1, -1))
    assert towards > 2 * away


@pytest.mark.parametrize("albedo", [pytest.param(0.5), *(pytest.param(value, marks=pytest.mark.slow) for value in (0.9, 0.99))])
def test_a_deep_slab_reflects_what_chandrasekhar_says(albedo):
    """Straight down and up again: ϖ/8π·H(1)² of the sun's irradiance with all orders, ϖ/8π with one; of a white sky
    1 − H(1)√(1−ϖ)."""
    medium = Medium("slab", np.full(3, albedo), np.full(3, 1 - albedo), bounds=DEEP)
    lit, h = context_of([medium], [SUN]), CHANDRASEKHAR[albedo]
    for bounces, factor in ((1, 1.0), (None, h * h)):
        mean, error = seen(lit, (0, 0, 5), (0, 0, -1), bounces=bounces)
        assert error < 0.03 * mean and mean == pytest.approx(albedo / (8 * np.pi) * factor, abs=4 * error)
    mean, error = seen(context_of([medium], world=1.0), (0, 0, 5), (0, 0, -1))
    assert mean == pytest.approx(1 - h * np.sqrt(1 - albedo), abs=4 * error)


@pytest.mark.slow
def test_a_deep_slab_that_takes_nothing_reflects_what_chandrasekhar_says():
    """H(1) = 2.90781 where nothing is absorbed. Of a slab of the optical depth τ light is missing by 1/(τ + 1.4209), the depth and
    twice Milne's extrapolation: two depths tell what an endless one reflects."""
    depths, found = (5.0, 15.0), []
    for depth in depths:
        bounds = ClosedMesh(cube().vertices_local, cube().triangles, transform((0, 0, -0.5 * depth), (3e4, 3e4, 0.5 * depth)))
        lit = context_of([Medium("slab", np.ones(3), np.zeros(3), bounds=bounds)], [SUN])
        found.append(seen(lit, (0, 0, 5), (0, 0, -1), paths=1 << 13))
    whole = np.array(depths) + 1.4209
    mean, error = ([part[0] for part in found], [part[1] for part in found])
    endless = (mean[1] * whole[1] - mean[0] * whole[0]) / (whole[1] - whole[0])
    error = np.hypot(error[1] * whole[1], error[0] * whole[0]) / (whole[1] - whole[0])
    expected = 2.90781**2 / (8 * np.pi)
    assert error < 0.03 * expected and endless == pytest.approx(expected, abs=4 * error)


@pytest.mark.parametrize("albedo, first", [(0.5, 0.07671), (1.0, 0.15343)])
def test_one_scattering_reflects_its_share_of_a_sky(albedo, first):
    """ϖ(1 − ln 2)/2 of a white sky, seen straight down."""
    medium = Medium("slab", np.full(3, albedo), np.full(3, 1 - albedo), bounds=DEEP)
    mean, error = seen(context_of([medium], world=1.0), (0, 0, 5), (0, 0, -1), paths=1 << 15, bounces=1)
    assert error < 0.03 * mean and mean == pytest.approx(first, abs=4 * error)


def test_what_only_scatters_cannot_be_seen_in_a_uniform_field():
    box = ClosedMesh(cube().vertices_local, cube().triangles, np.eye(4))
    cloud = Medium("cloud", np.array([0.5, 1.0, 2.0]), phase=Phase(anisotropy=0.4), bounds=box)
    context = context_of([cloud], world=1.0)
    n = 1 << 12
    origins, directions = np.full((n, 3), 0.1, np.float32), fibonacci_sphere(n)
    assert trace_radiance(context, origins, directions).mean(axis=0) == pytest.approx(1.0, abs=0.03)
    # And so for walks: what comes unscattered, and what walks that leave see of the world.
    walks = walk(context, Sources(context), origins, directions, np.full(n, np.inf, np.float32), np.arange(n, dtype=np.uint32))
    assert np.all(walks.primitive < 0)
    scattered = np.zeros((n, 3))
    np.add.at(scattered, walks.rows, walks.tint)
    seen_by_walks = context.media.transmittance(origins, directions) + scattered
    assert np.all(np.abs(seen_by_walks.mean(axis=0) - 1.0) < 4 * scattered.std(axis=0) / np.sqrt(n))


def test_collisions_in_a_grid_follow_its_optical_depth():
    rng = np.random.default_rng(3)
    grid = DensityGrid(transform(scale=(1, 1, 1)), rng.uniform(0, 1, (4, 4, 4)).astype(np.float32),
                       emission=rng.uniform(0, 1, (4, 4, 4, 3)).astype(np.float32))
    table = MediaTable([Medium("smoke", np.array([0.7, 0.2, 0.1]), np.array([0.1, 0.6, 0.0]), np.ones(3), grid=grid)])
    n = 1 << 14
    origins, directions = np.tile([[-2.0, 0.2, -0.3]], (n, 1)), np.tile([[1.0, 0, 0]], (n, 1))
    key = np.arange(n, dtype=np.uint32)
    found = collide(table, origins, directions, np.full(n, np.inf), key)
    expected = table.transmittance(origins[:1], directions[:1])[0]
    through = np.where(np.isinf(found.distance)[:, None], found.weight, 0.0)
    assert np.all(np.abs(through.mean(axis=0) - expected) < 4 * through.std(axis=0) / np.sqrt(n) + 1e-4)
    light = glow(table, origins, directions, np.full(n, np.inf), key)
    t = np.linspace(1, 3, 2001)[:-1] + 5e-4
    points = origins[0] + directions[0] * t[:, None]
    left = table.transmittance(np.tile(origins[:1], (2000, 1)), np.tile(directions[:1], (2000, 1)), t)
    expected = np.mean(table.fillings[0].coefficients(points).emission * left, axis=0) * 2.0
    assert np.all(np.abs(light.mean(axis=0) - expected) < 4 * light.std(axis=0) / np.sqrt(n))


def test_without_media_nothing_is_asked_of_them():
    context = context_of([], [SUN])
    assert context.media.is_empty and context.tracers is context.bare


def test_scattered_rays_pass_what_is_hidden_from_them():
    """A glowing plate beside fog, hidden from what media scatter, is seen through the fog and lights none of it: what comes from
    anywhere but the plate is the fog's, and of that there is none. Walks of bakes find the same."""
    plate = plane("plate", 1.0, z=-1.5, material_index=0)
    fog = Medium("fog", np.full(3, 0.8), np.full(3, 0.05), bounds=ClosedMesh(cube().vertices_local, cube().triangles, np.eye(4)))
    lit = {}
    for shown in (True, False):
        scene = Scene("glow", (plate,), (Instance("plate", 0, np.eye(4), visible_scatter=shown),), (material(emission=1.0),), (),
                      World.constant(0.0), (volume(),), media=(fog,))
        context = LightContext(scene)
        up, down = (seen(context, (0, 0, 0), (0, 0, way)) for way in (1, -1))
        n = 1 << 12
        rays = np.zeros((n, 3), np.float32), np.tile(np.float32([0, 0, 1]), (n, 1))
        walks = walk(context, Sources(context), *rays, np.full(n, np.inf), np.arange(n, dtype=np.uint32))
        lit[shown] = up, down, np.sum(walks.tint[walks.primitive >= 0, 0]) / n
    through = np.exp(-0.85)
    assert lit[False][0][0] == 0 and lit[False][2] == 0
    assert lit[False][1][0] == pytest.approx(through, abs=3 * lit[False][1][1])
    assert lit[True][0][0] > 0.02 and lit[True][2] == pytest.approx(lit[True][0][0], rel=0.1)
    assert lit[True][1][0] > through + 0.02


def test_nothing_is_told_apart_by_scattered_rays_without_media():
    plates = tuple(Instance(name, 0, np.eye(4), visible_scatter=name == "shown") for name in ("shown", "hidden"))
    scene = Scene("plain", (plane("plate"),), plates, (material(),), (), World.constant(1.0), (volume(),))
    tracers = LightContext(scene).bare
    assert tracers.scatter is tracers.view is tracers.diffuse
