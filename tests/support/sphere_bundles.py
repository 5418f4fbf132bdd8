"""Bundles with sphere probes, for exports."""

from dataclasses import replace
from pathlib import Path

import numpy as np
from scene_builders import transform

from rtgi_addon.effects.spheres.maps import SphereMap, SphereProbes
from rtgi_addon.effects.spheres.prefilter import prefiltered
from rtgi_addon.exchange.bundle import Bundle
from rtgi_addon.exchange.engines.kit import kit_field
from rtgi_addon.scene.sphere_probe import SphereProbe


def sphere_probes(*probes, side=32):
    """Maps of noise for ``probes``, by default a hall as a box and a ball in it."""
    probes = probes or (SphereProbe("Hall", transform((1, 2, 0.5), (3, 2, 1)), "box", 1.0, 0.2, "box", 1.0),
                        SphereProbe("Ball", transform((0.5, 2, 0.5)), influence_distance=0.8, parallax_distance=2.0))
    levels = prefiltered(np.random.default_rng(5).random((len(probes), side, side, 3)) ** 2 * 3.0)
    return SphereProbes([SphereMap(probe, tuple(level[number].astype(np.float16) for level in levels))
                         for number, probe in enumerate(probes)])


def sphere_bundle(*probes):
    """The kit's probes with sphere probes beside them."""
    return replace(Bundle(Path("kit"), {"scene": "kit", "includes_direct": False}, kit_field().grids()),
                   spheres=sphere_probes(*probes))
