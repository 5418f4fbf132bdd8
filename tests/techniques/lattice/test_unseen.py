"""Which probes a surface reads, held to asking every probe; and a bake without the others."""

from dataclasses import replace

import numpy as np
import pytest
import scene_builders as build

from rtgi_addon import techniques
from rtgi_addon.evaluate.plan.sample import draw_sample
from rtgi_addon.evaluate.plan.sparse import positions_of, probes_read
from rtgi_addon.numerics.grid import lattice_points
from rtgi_addon.progress import Progress
from rtgi_addon.scene import NearSurfaces
from rtgi_addon.techniques.lattice.unseen import wanted_probes, worth_rays
from rtgi_addon.transport.context import LightContext


def test_all_that_surfaces_read_is_wanted_and_the_middle_of_the_air_is_not():
    scene = build.closed_box()
    scene = replace(scene, volumes=(build.volume(resolution=(12, 10, 9), half_size=0.97),))
    context = LightContext(scene, 1)
    volume = scene.volumes[0]
    wanted = wanted_probes(context.geometry, volume)
    sample = draw_sample(context, scene.volumes, 400, 0)
    own = sample.receivers.take(sample.receivers.own)
    assert wanted.ravel()[probes_read(volume, own.points, own.normals)].all()
    assert not wanted[4, 5, 6] and wanted[0].all() and wanted[:, :, -1].all() and 0.3 < wanted.mean() < 0.95


def test_small_and_slanted_triangles_are_not_missed():
    rotation = np.linalg.qr(np.random.default_rng(2).normal(size=(3, 3)))[0]
    tiny = build.mesh("tiny", 1e-3 * build.CUBE_CORNERS @ rotation.T + [0.31, -0.22, 0.13], build.CUBE_TRIANGLES)
    leaf = build.mesh("leaf", [[-0.8, -0.7, -0.6], [0.7, 0.8, -0.2], [-0.1, 0.2, 0.8]], [[0, 1, 2]])
    scene = build.scene([tiny, leaf], volumes=[build.volume(resolution=(16, 16, 16), half_size=1.0)])
    geometry = LightContext(scene, 1).geometry
    wanted = wanted_probes(geometry, scene.volumes[0])
    corners = geometry.triangles_world
    weights = np.random.default_rng(0).dirichlet(np.ones(3), 4000)
    for points in (corners[0], (weights[:, :, None] * corners[-1]).sum(axis=1)):
        for side in (-1.0, 1.0):
            normals = np.broadcast_to(side * geometry.normals_world[-1], points.shape)
            assert wanted.ravel()[probes_read(scene.volumes[0], points, normals)].all()
    assert wanted.mean() < 0.4


def test_surfaces_outside_count_for_the_probes_that_they_read():
    scene = build.closed_box()
    scene = replace(scene, volumes=(build.volume(resolution=(8, 8, 8), half_size=0.7),))
    context = LightContext(scene, 1)
    volume = scene.volumes[0]
    near = wanted_probes(context.geometry, volume, margin=0.5)
    outermost = wanted_probes(context.geometry, volume, outermost=True)
    layer = np.ones((8, 8, 8), bool)
    layer[1:-1, 1:-1, 1:-1] = False
    assert not wanted_probes(context.geometry, volume).any() and near[layer].all() and np.array_equal(outermost, layer)
    assert wanted_probes(context.geometry, replace(volume, resolution=(1, 1, 1)), margin=1.0).shape == (1, 1, 1)


def test_positions_of_rows_are_the_lattices():
    volume = build.volume(resolution=(3, 4, 5), half_size=(1, 2, 3))
    everywhere = lattice_points(volume.world_from_local, volume.resolution).reshape(-1, 3)
    assert positions_of(volume, np.arange(60)) == pytest.approx(everywhere)


def test_probes_that_nobody_wants_get_no_rays_and_hold_their_neighbours_light():
    scene = replace(build.closed_box(albedo=0.6), volumes=(build.volume(resolution=(5, 5, 5), half_size=0.9),))
    wanted = np.ones((5, 5, 5), bool)
    wanted[1:-1, 1:-1, 1:-1] = False
    probes = techniques.get("probes")

    def bake(mask):
        volume = replace(scene.volumes[0], wanted=mask)
        return probes.bake(replace(scene, volumes=(volume,)), probes.Settings(rays=64), np.random.default_rng(0), Progress(),
                           threads=1)

    whole, part = bake(None), bake(wanted)
    grid = part.grids()[0]
    assert np.array_equal(grid.validity > 0, wanted) and not np.any(grid.offset_world[~wanted])
    assert part.stats["probe_rays"] == whole.stats["probe_rays"] * wanted.sum() // wanted.size
    light = np.linalg.norm(grid.sh[..., 0, :], axis=-1)
    assert light[~wanted].min() > 0.5 * light[wanted].min() > 0
    assert grid.sh[wanted] == pytest.approx(whole.grids()[0].sh[wanted], rel=0.3, abs=0.05)


def test_a_volume_leaves_to_finer_ones_what_they_cover_and_a_bake_looks_where_surfaces_are():
    scene = build.closed_box(albedo=0.6)
    coarse = build.volume("coarse", (10, 10, 10), 0.97)
    half = build.volume("fine", (12, 22, 22), (0.5, 1.1, 1.1), (0.6, 0.0, 0.0))
    near = replace(coarse, near=NearSurfaces(outermost=False))
    geometry = LightContext(scene, 1).geometry
    alone, = worth_rays(geometry, (near,))
    beside, all_of_it = worth_rays(geometry, (near, half))
    assert all_of_it is None and worth_rays(geometry, (coarse,)) == [None]
    assert not alone[4:6, 4:6, 4:6].any() and alone[0].all() and alone[:, :, -1].all()
    # Its left is read as before, its right by what is finer, but for the cell over which that fades.
    assert np.array_equal(beside[:, :, :4], alone[:, :, :4]) and not beside[:, :, 8:].any()
    wanted = replace(coarse, wanted=np.ones((10, 10, 10), bool), near=near.near)
    assert worth_rays(geometry, (wanted,))[0].all()
    probes = techniques.get("probes")
    field = probes.bake(replace(scene, volumes=(near,)), probes.Settings(rays=64), np.random.default_rng(0), Progress(), threads=1)
    assert np.array_equal(field.grids()[0].validity > 0, alone)
