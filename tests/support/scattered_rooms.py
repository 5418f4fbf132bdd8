"""Scenes for scattered probes, and their probes scattered."""

import numpy as np
import room_scenes
import scene_builders as build

from rtgi_addon.progress import Progress
from rtgi_addon.techniques.probes.settings import ProbeSettings
from rtgi_addon.techniques.scattered.scatter import scatter
from rtgi_addon.techniques.scattered.settings import SCATTERED, ScatterSettings

QUICK = ProbeSettings(error=0.05, max_rays=256, cache_rays=32)


def storeys(lamp=(0.3, 0.2, 1.2)):
    """A house of two storeys of 4 × 4 × 2.5 m, one above the other, with a floor of 0.2 m between them; a lamp is in the upper."""
    low, high = -2.0, 2.0
    along, across = (high - low, 0, 0), (0, high - low, 0)
    meshes = []
    for name, z in (("lower", -2.6), ("upper", 0.1)):
        top = z + 2.5
        up = (0, 0, 2.5)
        meshes += [room_scenes.quad(f"{name} floor", (low, low, z), along, across),
                   room_scenes.quad(f"{name} ceiling", (low, low, top), across, along),
                   room_scenes.quad(f"{name} south", (low, low, z), up, along),
                   room_scenes.quad(f"{name} north", (low, high, z), along, up),
                   room_scenes.quad(f"{name} west", (low, low, z), across, up),
                   room_scenes.quad(f"{name} east", (high, low, z), up, across)]
    volume = build.volume(resolution=(4, 4, 6), half_size=(2.0, 2.0, 2.6))
    return build.scene(meshes, [build.material("wall", 0.6)], [build.point_light(lamp, 4.0)], volumes=[volume], name="storeys")


def scattered(scene, seed=0, any_light=False, **settings):
    """``scene`` with its probes scattered as ``settings`` say."""
    return scatter(scene, ScatterSettings(SCATTERED, **settings), QUICK, seed, 1, Progress(), any_light).scene


def places_of(grid):
    """Where the probes of a scattered ``grid`` stand: (p, 3)."""
    from rtgi_addon.numerics.grid import lattice_points
    points = lattice_points(grid.volume.world_from_local, grid.volume.resolution) + grid.offset_world
    return points[grid.counts]


def across(start, end, count=400):
    """``count`` points on the way from ``start`` to ``end``."""
    share = np.linspace(0.0, 1.0, count)[:, None]
    return (1.0 - share) * np.asarray(start, np.float64) + share * np.asarray(end, np.float64)
