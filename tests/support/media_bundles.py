"""Bundles with media for tests of exports."""

from dataclasses import replace
from pathlib import Path

import numpy as np
from scene_builders import transform as moved

from rtgi_addon.exchange.bundle import Bundle
from rtgi_addon.exchange.engines.kit import kit_field
from rtgi_addon.scene import DensityGrid, Medium, Phase, ProbeVolume
from rtgi_addon.techniques import ProbeGrid


def smoke(shape=(3, 4, 5), **more):
    """Uneven smoke, whose emission is uneven as well."""
    rng = np.random.default_rng(4)
    grid = DensityGrid(moved((0.3, 0.0, 0.2), (1.5, 1.0, 0.8)), rng.random(shape, np.float32),
                       emission=rng.random((*shape, 3), np.float32))
    return Medium("Smoke", np.full(3, 0.8), np.full(3, 0.3), np.array([0.2, 0.1, 0.05]), Phase("RAYLEIGH"), grid=grid, **more)


def box(name="Box", matrix=None):
    """One density in a box."""
    grid = DensityGrid(moved((1.0, 0.5, 0.0), (0.5, 0.7, 0.9)) if matrix is None else matrix, np.ones((1, 1, 1), np.float32))
    return Medium(name, np.array([0.4, 0.5, 0.6]), np.array([0.1, 0.2, 0.2]), phase=Phase(anisotropy=0.3), grid=grid)


def fog(density=0.05, emission=0.0):
    """A world's grey fog."""
    return Medium("World", np.full(3, 0.9 * density), np.full(3, 0.1 * density), np.full(3, emission), Phase(anisotropy=0.5))


def media_bundle(*media, grids=None):
    """The conformance kit's probes as a bundle with ``media`` (none given: fog, a box and smoke)."""
    bundle = Bundle(Path("kit"), {"scene": "kit", "includes_direct": False}, kit_field().grids() if grids is None else grids)
    return replace(bundle, media=media or (fog(), box(), smoke()))


def even_light(radiance):
    """Probes about the origin that see ``radiance`` from everywhere."""
    shape = (2, 2, 2)
    light = np.zeros((*shape, 9, 3), np.float32)
    light[..., 0, :] = radiance * np.sqrt(4.0 * np.pi)
    visibility = np.empty((*shape, 8, 8, 2), np.float32)
    visibility[...] = (50.0, 2501.0)
    volume = ProbeVolume("Room", moved(scale=(15.0, 15.0, 15.0)), shape)
    return (ProbeGrid(volume, light, np.ones(shape, np.float32), visibility, np.zeros((*shape, 3), np.float32),
                      np.full(shape, np.nan, np.float32)),)
