"""Probes as coloured triangles for other engines' viewports: a ball in uniform light shows it from every side."""

import numpy as np
from scene_builders import volume

from rtgi_addon.preview.overlay_colours import sphere_colours
from rtgi_addon.preview.settings import OverlaySettings
from rtgi_addon.techniques.base import ProbeGrid


def uniform_grid(radiance):
    """A grid of 2 × 2 × 2 usable probes in the same ``radiance`` from everywhere."""
    sh = np.zeros((2, 2, 2, 9, 3), np.float32)
    sh[..., 0, :] = np.sqrt(4.0 * np.pi) * np.float32(radiance)
    shape = (2, 2, 2)
    return ProbeGrid(volume(), sh, np.ones(shape, np.float32), np.ones((*shape, 8, 8, 2), np.float32),
                     np.zeros((*shape, 3), np.float32), np.zeros(shape, np.float32))


def test_balls_show_their_probes_light_and_state():
    grid = uniform_grid(radiance=(0.2, 0.4, 0.8))
    positions, colours = sphere_colours([grid], OverlaySettings(probes="light"))
    assert len(positions) == len(colours) and len(positions) % (grid.validity.size * 3) == 0
    np.testing.assert_allclose(colours[:, :3], np.broadcast_to((0.2, 0.4, 0.8), colours[:, :3].shape), rtol=1e-3)
    state = sphere_colours([grid], OverlaySettings(probes="validity"))[1]
    assert np.all(state[:, 1] > state[:, 0]) and np.all(state[:, 3] == 1.0)


def test_balls_are_as_large_as_asked():
    grid = uniform_grid(radiance=(1, 1, 1))
    small, large = (sphere_colours([grid], OverlaySettings(probes="light", probe_size=size))[0] for size in (0.5, 1.0))
    assert np.ptp(large[:, 0]) > np.ptp(small[:, 0])
