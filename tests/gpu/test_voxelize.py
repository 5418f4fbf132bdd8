"""Triangles into voxels by rasterization, against numpy: crossing by crossing but for edges."""

from dataclasses import replace

import numpy as np
import pytest
import room_scenes as rooms
import scene_builders as build

from rtgi_addon import techniques
from rtgi_addon.progress import Progress
from rtgi_addon.transport.surfaces.geometry import flatten
from rtgi_addon.transport.surfaces.materials import Surfaces
from rtgi_addon.transport.voxels import grid_around, voxelize

TILTED = build.transform((0.3, 0.2, 0.1), 1.0, np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0])


def turned(scene):
    return replace(scene, instances=tuple(replace(instance, world_from_local=TILTED) for instance in scene.instances))


SCENES = {"ball and cube": build.scene([build.sphere(subdivisions=4), build.cube(half_size=0.4)]),
          "tilted": turned(build.scene([build.sphere(subdivisions=3), build.cube(half_size=0.4)])), "rooms": rooms.two_rooms(),
          # One hides the other, and covers whole tiles of a rasterizer's picture.
          "sheets": build.scene([rooms.quad(f"{z}", (-1, -1, z), (2, 0, 0), (0, 2, 0)) for z in (-0.3, 0.4)])}


@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("resolution", [9, 64])
def test_cells_hold_what_numpy_finds(gpu_device, name, resolution):
    scene = SCENES[name]
    geometry = flatten(scene)
    grid = grid_around(np.array(geometry.bounds()), resolution)
    surfaces = Surfaces(scene, geometry)
    expected = voxelize(geometry, surfaces, grid)
    made = voxelize(geometry, surfaces, grid, meet=gpu_device.voxel_crossings)
    both, here, there = np.intersect1d(expected.cells, made.cells, return_indices=True)
    assert len(both) >= 0.99 * max(len(expected.cells), len(made.cells))
    # A line more or less of sixteen where it meets an edge.
    off = np.abs(made.opacity[there] - expected.opacity[here])
    assert off.max() <= 3 / 16 and np.mean(off > 1e-6) < 0.02
    assert made.area.sum() == pytest.approx(expected.area.sum(), rel=1e-6)
    alike = (off < 1e-6).all(axis=1)
    turn = np.abs(made.normal[there] - expected.normal[here]).max(axis=1)
    assert np.mean(turn[alike] > 0.02) < 0.02


def test_a_sheet_of_many_triangles_has_no_holes(gpu_device):
    scene = build.scene([rooms.quad(f"{i} {j}", (0.37 * i, 0.41 * j, 0.2), (0.37, 0, 0.11), (0, 0.41, 0)) for i in range(1)
                         for j in range(7)])
    geometry = flatten(scene)
    grid = grid_around(np.array(geometry.bounds()), 24)
    one, two = (voxelize(geometry, Surfaces(scene, geometry), grid, meet=meet) for meet in (None, gpu_device.voxel_crossings))
    assert two.opacity[:, 2].sum() == pytest.approx(one.opacity[:, 2].sum(), rel=0.02)


@pytest.mark.parametrize("name", ["cone_tracing", "voxel_march"])
def test_a_bake_on_the_gpu_is_that_of_numpy(gpu_device, name):
    technique, scene = techniques.get(name), SCENES["rooms"]
    settings = technique.Settings(resolution=24, light="voxels")
    one, two = (technique.bake(scene, settings, np.random.default_rng(0), Progress(), **device)
                for device in ({}, {"kernels": gpu_device}))
    points = np.random.default_rng(1).uniform(-0.9, 0.9, (100, 3)).astype(np.float32) - np.float32([1, 0, 0])
    up = np.tile(np.float32([0, 0, 1]), (100, 1))
    expected, found = one.irradiance(points, up), two.irradiance(points, up)
    assert np.sqrt(np.square(found - expected).mean()) < 0.01 * expected.mean()
