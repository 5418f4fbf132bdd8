"""Transfer held to what is known exactly of it (docs/techniques/transfer.md)."""

from dataclasses import replace

import numpy as np
import pytest
import scene_builders as build

from rtgi_addon import techniques
from rtgi_addon.numerics import dome, sh
from rtgi_addon.progress import Progress
from rtgi_addon.scene import SunLight, World
from rtgi_addon.techniques.transfer.lighting import Lighting, sky_of, sun_from
from rtgi_addon.techniques.transfer.relight import relit
from rtgi_addon.transport.lights.world_sh import texel_directions

UPRIGHT = np.eye(3)
SMALL = {"rays": 4096, "sun_side": 5, "sites": 0}


def transfer_of(scene, **settings):
    """The transfer of ``scene`` and of its first volume."""
    technique = techniques.get("transfer")
    field = technique.bake(scene, technique.Settings(**{**SMALL, **settings}), np.random.default_rng(1), Progress(), threads=1)
    return field.transfer, field.transfer.grids[0]


def one_probe(scene, center=(0.0, 0.0, 0.0)):
    """``scene`` with a volume of a single probe at ``center``."""
    return replace(scene, volumes=(build.volume(resolution=(1, 1, 1), half_size=0.05, center=center),))


@pytest.fixture(scope="module")
def open_air():
    """A speck far below."""
    return transfer_of(one_probe(build.scene([build.cube("far", 0.001)]), (0, 0, 50)), sky_order=3, order=3)[1]


@pytest.fixture(scope="module")
def above_plane():
    """One probe over a black floor without an end."""
    return transfer_of(one_probe(build.open_plane(0.0, half_size=3000.0), (0, 0, 1)))[1]


def test_in_the_open_the_sky_is_transferred_as_it_is(open_air):
    assert np.allclose(open_air.sky[0, 0, 0], np.eye(16), atol=1e-5)
    assert not open_air.bounce.any() and np.all(open_air.seen == 1.0)


def test_a_closed_room_sees_no_sky():
    grid = transfer_of(one_probe(build.closed_box()))[1]
    assert not grid.sky.any() and not grid.seen.any() and not grid.suns.any()


def test_over_a_plane_half_of_the_sphere_is_seen(above_plane):
    matrix = above_plane.sky[0, 0, 0]
    assert matrix[0, 0] == pytest.approx(0.5, abs=1e-3)
    assert matrix[0, 2] == pytest.approx(np.sqrt(3.0) / 4.0, abs=1e-3)
    assert matrix[2, 2] == pytest.approx(0.5, abs=1e-3)


def test_the_trace_is_the_visible_share_of_the_sphere(above_plane):
    # Unsöld's theorem: the sum of squares of a band is the same in every direction.
    assert np.trace(above_plane.sky[0, 0, 0]) / 9.0 == pytest.approx(0.5, abs=1e-3)


def test_the_skys_matrix_is_symmetric_with_eigenvalues_of_a_share(above_plane):
    matrix = above_plane.sky[0, 0, 0]
    values = np.linalg.eigvalsh(matrix.astype(np.float64))
    assert np.abs(matrix - matrix.T).max() < 1e-6 and values.min() > -1e-5 and values.max() < 1.0 + 1e-5


@pytest.mark.parametrize("half_angle", [30.0, 60.0])
def test_through_a_round_hole(half_angle):
    # A ring in z = 1 around the hole, and all below: E_up/π = sin²a under a sky of 1, S₀₀ = 2π(1 − cos a)·Y₀₀, S₁z = π·sin²a·Y₁z.
    angle = np.radians(half_angle)
    turn = np.linspace(0.0, 2.0 * np.pi, 257)[:-1]
    ring = [np.stack([radius * np.cos(turn), radius * np.sin(turn), np.ones(256)], 1) for radius in (np.tan(angle), 3000.0)]
    index = np.arange(256)
    after = (index + 1) % 256
    triangles = np.concatenate([np.stack([index, after, index + 256], 1), np.stack([after, after + 256, index + 256], 1)])
    lid = build.mesh("lid", np.concatenate(ring), triangles)
    floor = build.plane("floor", 3000.0, z=-1.0)
    scene = build.scene([lid, floor], materials=(build.material(albedo=0.0),))
    matrix = transfer_of(one_probe(scene), rays=8192)[1].sky[0, 0, 0].astype(np.float64)
    white = np.zeros(9)
    white[0] = np.sqrt(4.0 * np.pi)
    seen = matrix @ white
    assert seen[0] == pytest.approx(2.0 * np.pi * (1.0 - np.cos(angle)) * 0.282095, rel=4e-3)
    assert seen[2] == pytest.approx(np.pi * np.sin(angle) ** 2 * 0.488603, rel=4e-3)
    up = sh.irradiance(seen[:, None], np.array([[0.0, 0.0, 1.0]]))[0, 0] / np.pi
    # Order 2 has .9922 of the lobe's energy.
    assert up == pytest.approx(np.sin(angle) ** 2, abs=0.02)


def test_the_clamped_cosine_by_bands():
    directions, solid_angles = sh.quadrature(300)
    lobe = sh.project(directions, np.maximum(directions[:, 2:], 0.0), solid_angles, 4)[:, 0]
    assert np.allclose(lobe[[0, 2, 6, 12, 20]], [0.886227, 1.023327, 0.495416, 0.0, -0.110778], atol=2e-3)
    energy = np.cumsum([np.sum(lobe[l * l:(l + 1) ** 2] ** 2) for l in range(3)]) / (2.0 * np.pi / 3.0)
    assert np.allclose(energy, [0.375, 0.875, 0.9922], atol=1e-3)


def test_at_a_wall_half_of_the_cosine_is_left():
    # T = ∫ V·(n·ω)₊·Y over x > 0: T₀₀ = √π/4, T_z = .511663, T_x = 1/√(3π) for n = z.
    wall = build.mesh("wall", [[0, -3000, -3000], [0, 3000, -3000], [0, 3000, 3000], [0, -3000, 3000]], [[0, 1, 2], [0, 2, 3]])
    scene = one_probe(build.scene([wall], materials=(build.material(albedo=0.0),)), (0.1, 0.0, 0.0))
    matrix = transfer_of(scene, sky_order=4, order=4)[1].sky[0, 0, 0].astype(np.float64)
    directions, solid_angles = sh.quadrature(60)
    lobe = sh.project(directions, np.maximum(directions[:, 2:], 0.0), solid_angles, 4)[:, 0]
    transfer = lobe @ matrix
    assert np.allclose(transfer[[0, 2, 3]], [np.sqrt(np.pi) / 4.0, 0.511663, 1.0 / np.sqrt(3.0 * np.pi)], atol=0.02)


def some_sky(rotation=UPRIGHT, height=64, order=2, seed=3):
    """A sky of SH up to ``order``, turned by ``rotation``, and its coefficients before that."""
    coefficients = np.random.default_rng(seed).uniform(-0.2, 0.2, ((order + 1) ** 2, 3))
    coefficients[0] = 2.0
    world = World(np.zeros((height, 2 * height, 3), np.float32))
    directions, _ = texel_directions(world)
    pixels = sh.evaluate(directions @ rotation, order) @ coefficients
    return replace(world, equirect=pixels.reshape(height, 2 * height, 3).astype(np.float32)), coefficients


@pytest.fixture(scope="module")
def yard():
    """Two walls on a floor, some probes between them, and a sky of order 2."""
    walls = [build.plane("floor", 2.0), build.cube("block", 0.4)]
    scene = build.scene(walls, materials=(build.material(albedo=(0.6, 0.4, 0.2)),),
                        volumes=(build.volume(resolution=(2, 2, 2), half_size=0.9, center=(0, 0, 1.2)),))
    return scene, transfer_of(scene, sun_side=6, sites=4)[0]


def test_relit_is_what_a_bake_under_that_sky_gives(yard):
    scene, transfer = yard
    world, _ = some_sky()
    fresh = transfer_of(replace(scene, world=world), sun_side=3)[1].grid.sh
    other = relit(transfer, Lighting(world=world))[0].sh
    assert np.linalg.norm(other - fresh) < 5e-3 * np.linalg.norm(fresh)


def test_a_sky_of_the_order_is_its_coefficients_alone(yard):
    world, coefficients = some_sky()
    sky = sky_of(world, yard[1])
    assert np.allclose(sky.coefficients, coefficients, atol=2e-3) and np.abs(sky.suns).sum() < 2e-2 * np.abs(coefficients[0]).sum()


def test_light_is_linear(yard):
    transfer = yard[1]
    one, other = some_sky(seed=3)[0], some_sky(seed=4)[0]
    both = replace(one, equirect=0.25 * one.equirect + 3.0 * other.equirect)
    suns = [sun_from(40.0, 50.0, 2.0), sun_from(200.0, 20.0, (1.0, 2.0, 3.0))]
    parts = [relit(transfer, Lighting(world=world, suns=()))[0].sh for world in (one, other)]
    assert np.allclose(relit(transfer, Lighting(world=both, suns=()))[0].sh, 0.25 * parts[0] + 3.0 * parts[1], atol=1e-4)
    dark = World.constant(0.0)
    lit = [relit(transfer, Lighting(world=dark, suns=(sun,)))[0].sh for sun in suns]
    assert np.allclose(relit(transfer, Lighting(world=dark, suns=tuple(suns)))[0].sh, lit[0] + lit[1], atol=1e-6)


def test_a_turned_scene_under_a_turned_sky_is_turned():
    # A quarter turn, so that texels and lattice turn into themselves.
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    wall = build.mesh("wall", [[0.8, -1, 0], [0.8, 1, 0], [0.8, 1, 2], [0.8, -1, 2]], [[0, 1, 2], [0, 2, 3]])
    coat = (build.material(albedo=(0.7, 0.5, 0.3)),)
    results = []
    for rotation in (np.eye(3), turn):
        turned = wall.vertices_local @ rotation.T
        scene = build.scene([build.plane("floor", 2.0), replace(wall, vertices_local=turned.astype(np.float32))], materials=coat)
        transfer, _ = transfer_of(one_probe(scene, (0, 0, 0.8)), rays=8192)
        results.append(relit(transfer, Lighting(world=some_sky(rotation)[0]))[0].sh[0, 0, 0])
    assert np.linalg.norm(sh.rotation_matrix(turn, 2) @ results[0] - results[1]) < 1e-2 * np.linalg.norm(results[1])


def test_the_dome_reads_its_nodes_and_gives_all_of_a_sun():
    for below in (False, True):
        nodes = dome.directions(7, below)
        index, share = dome.weights(nodes * (1.0, 1.0, 1.0), 7, below)
        upper = slice(0, 49)
        met = np.zeros((len(nodes), len(nodes)))
        np.add.at(met, (np.arange(len(nodes))[:, None], index), share)
        assert np.allclose(met[upper, upper], np.eye(49), atol=1e-9)
        some = np.random.default_rng(0).normal(size=(200, 3))
        some /= np.linalg.norm(some, axis=1, keepdims=True)
        total = dome.weights(some, 7, below)[1].sum(axis=1)
        assert np.allclose(total, 1.0 if below else some[:, 2] >= 0)


def test_nodes_that_are_fitted_read_what_is_bilinear_as_it_is():
    towards, fit = dome.samples(5, 3)
    index, share = dome.weights(towards, 5)
    nodes = np.random.default_rng(6).normal(size=(5, 5))
    read = np.sum(nodes.reshape(-1)[index] * share, axis=1).reshape(14, 14)
    assert np.allclose(fit @ read @ fit.T, nodes, atol=1e-9)
    # Of anything else, the reading leaves nothing that it could have.
    found = np.random.default_rng(7).normal(size=read.shape)
    fitted = (fit @ found @ fit.T).reshape(-1)
    left = found.reshape(-1) - np.sum(fitted[index] * share, axis=1)
    assert np.allclose(np.bincount(index.reshape(-1), (share * left[:, None]).reshape(-1), fitted.size), 0.0, atol=1e-9)
    both, same = dome.samples(5, 3, True)
    assert np.array_equal(both, np.concatenate([towards, towards * (1.0, 1.0, -1.0)])) and np.array_equal(same, fit)


def test_suns_between_the_directions_are_nearer_than_by_suns_in_them(yard):
    scene, side = yard[0], 4
    within = dome.samples(side, 2)[0].reshape(8, 8, 3)[1:-1, 1:-1].reshape(-1, 3)
    tried = np.concatenate([dome.directions(side), within[::3]])
    alone = tuple(SunLight(f"sun {number}", -way, np.ones(3, np.float32), light_group=f"{number:03}")
                  for number, way in enumerate(tried))
    _, grid = transfer_of(replace(scene, lights=alone), sun_side=side, sites=0, rays=256)
    index, share = dome.weights(tried[side**2:], side)
    right, interpolated = grid.lights[..., side**2:], np.sum(grid.lights[..., index] * share, axis=-1)
    fitted = np.sum(grid.suns[..., index] * share, axis=-1)
    off, between = (np.linalg.norm(light - right) / np.linalg.norm(right) for light in (fitted, interpolated))
    # 15.8 and 23.0 %.
    assert off < 0.18 and off < 0.75 * between, (off, between)
