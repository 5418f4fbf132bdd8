"""Bundles with lit voxels, for exports."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import room_scenes as rooms

from rtgi_addon import techniques
from rtgi_addon.exchange.bundle import Bundle
from rtgi_addon.exchange.engines.kit import kit_field
from rtgi_addon.progress import Progress
from rtgi_addon.scene import World


@cache
def lit_voxels(cascades=1):
    """Those of two rooms without a roof's worth of resolution, under a grey sky; in so many nested grids."""
    scene = replace(rooms.two_rooms(resolution=(2, 2, 2), half_size=(2.0, 0.95, 0.95)), world=World.constant(0.3))
    technique = techniques.get("cone_tracing")
    settings = technique.Settings(resolution=20 if cascades == 1 else 48, cones=12, light="voxels", cascades=cascades)
    return technique.bake(scene, settings, np.random.default_rng(1), Progress()).lit_voxels()


def voxel_bundle():
    """The kit's probes with lit voxels beside them."""
    return replace(Bundle(Path("kit"), {"scene": "kit", "includes_direct": False}, kit_field().grids()), voxels=lit_voxels())
