"""Gathers from shadow maps and virtual lights on the GPU against numpy: relative to the largest irradiance."""

import threading

import numpy as np
import pytest
import scene_builders as build
from shadow_maps import prepared

from rtgi_addon.techniques.rsm.gather import Pattern, gather
from rtgi_addon.techniques.vpl.gather import gather_visible
from rtgi_addon.techniques.vpl.virtual_lights import VirtualLights

TOLERANCE = 1e-5


def unit(count, seed):
    vectors = np.random.default_rng(seed).normal(size=(count, 3))
    return (vectors / np.linalg.norm(vectors, axis=1, keepdims=True)).astype(np.float32)


def points_in(half_size, count, seed=0):
    return ((np.random.default_rng(seed).random((count, 3)) * 2 - 1) * half_size).astype(np.float32)


@pytest.mark.parametrize("disk_share", [0.0, 0.4, 1.0])
def test_shadow_maps(gpu_device, disk_share):
    _, maps = prepared(build.closed_box(albedo=0.6, light_position=(0.2, -0.3, 0.4)), 96)
    points, normals, pattern = points_in(0.95, 1500), unit(1500, 1), Pattern(disk_share=disk_share, seed=3)
    expected = gather(maps, points, normals, pattern)
    error = np.abs(gpu_device.rsm_gather(maps, points, normals, pattern) - expected).max(axis=1) / expected.max()
    # A sample on the border of two texels may fall either way: one of some hundred, in few receivers.
    assert np.quantile(error, 0.99) < TOLERANCE and error.max() < 0.02
    assert expected.min() >= 0 and expected.any()


def test_no_map_and_no_receiver(gpu_device):
    assert not gpu_device.rsm_gather((), np.zeros((3, 3)), unit(3, 0), Pattern()).any()
    _, maps = prepared(build.closed_box(), 16)
    assert gpu_device.rsm_gather(maps, np.zeros((0, 3)), np.zeros((0, 3)), Pattern()).shape == (0, 3)


@pytest.mark.parametrize("count", [1, 95, 97, 500])
@pytest.mark.parametrize("clamp", [None, 5.0])
@pytest.mark.parametrize("seen", [None, 0.5])
def test_virtual_lights(gpu_device, count, clamp, seen):
    rng = np.random.default_rng(count)
    lights = VirtualLights.of(points_in(2.0, count, 7), unit(count, 8), rng.random((count, 3)))
    points, normals = points_in(2.0, 800, 9), unit(800, 10)
    visibility = None if seen is None else rng.random((800, count)) < seen
    expected = gather_visible(lights, points, normals, visibility, clamp)
    assert np.abs(gpu_device.vpl_gather(lights, points, normals, visibility, clamp) - expected).max() < TOLERANCE * expected.max()


def test_blocks_of_receivers_and_lights_sum_to_the_whole(gpu_device, monkeypatch):
    from rtgi_addon.preview import gather as module
    monkeypatch.setattr(module, "_LIGHTS_AT_ONCE", 100)
    monkeypatch.setattr(module, "_VISIBILITY_TEXELS", 300)
    monkeypatch.setattr(module, "_PAIRS_PER_DISPATCH", 1)
    monkeypatch.setattr(module, "FOLD_WIDTH", 64)
    rng = np.random.default_rng(0)
    lights = VirtualLights.of(points_in(2.0, 250, 1), unit(250, 2), rng.random((250, 3)))
    points, normals, visibility = points_in(2.0, 777, 3), unit(777, 4), rng.random((777, 250)) < 0.5
    expected = gather_visible(lights, points, normals, visibility, None)
    assert np.abs(gpu_device.vpl_gather(lights, points, normals, visibility, None) - expected).max() < TOLERANCE * expected.max()


def test_another_thread_gets_numpys_answer(gpu_device):
    lights = VirtualLights.of(points_in(1.0, 20, 1), unit(20, 2), np.ones((20, 3)))
    points, normals = points_in(1.0, 30, 3), unit(30, 4)
    answers = []
    thread = threading.Thread(target=lambda: answers.append(gpu_device.vpl_gather(lights, points, normals, None, None)))
    thread.start()
    thread.join()
    assert np.array_equal(answers[0], gather_visible(lights, points, normals, None, None))
