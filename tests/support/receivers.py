"""Irradiance functions of the preview at receivers, against numpy."""

import time

import numpy as np


def error(made, expected, points, normals):
    """Largest difference of a channel at each receiver (n,) between ``made`` (an Indirect) and ``expected`` (n, 3), in shares of
    the largest irradiance."""
    from rtgi_addon.preview.indirect.base import irradiance
    found = irradiance(made, points, normals)
    assert np.isfinite(found).all() and (found >= 0).all() and expected.max() > 0
    return np.abs(found - expected).max(axis=1) / expected.max()


def relative_error(made, field, points, normals):
    """``error`` against ``field.irradiance``."""
    return error(made, field.irradiance(points, normals), points, normals)


def drawn(scene):
    """``scene`` as the preview has it on the GPU."""
    from rtgi_addon.preview.capture import Drawn
    from rtgi_addon.preview.gbuffer import gbuffer_surfaces
    from rtgi_addon.preview.renderer import scene_bounds
    return Drawn(scene, gbuffer_surfaces(scene) if scene.instances else None, scene_bounds(scene))


def waited(made, seconds=60.0):
    """Whether ``made`` took over anything once its worker had come to rest."""
    changed, until = False, time.monotonic() + seconds
    while made.busy and time.monotonic() < until:
        changed |= made.update()
        time.sleep(0.01)
    return made.update() or changed


def points_in(half_size, count, seed=0):
    """Random points (n, 3) float32 in the box [−half_size, half_size]."""
    return ((np.random.default_rng(seed).random((count, 3)) * 2 - 1) * half_size).astype(np.float32)


def directions(count, seed=1):
    """Random unit vectors (n, 3) float32."""
    vectors = np.random.default_rng(seed).normal(size=(count, 3))
    return (vectors / np.linalg.norm(vectors, axis=1, keepdims=True)).astype(np.float32)
