"""The light atlas among the techniques of a chart: what it costs at each density, and how far it is off where it is read.

It is held to the receivers on surfaces that are in it, under their own normals (the place "atlas" of `measure.py`), where
techniques are measured as well. It is no technique: it has no light for anything else.
"""

from dataclasses import dataclass
from time import perf_counter
from typing import NamedTuple

import numpy as np

from ..effects.atlas.bake import bake_atlas, wants_atlas
from ..effects.atlas.settings import ATLAS, AtlasSettings
from ..effects.atlas.surfaces import surfaces_in
from ..progress import Progress
from ..scene import Scene
from ..techniques.base import KNOWN_LIGHT
from ..transport.context import LightContext
from .costs import Costs, metered
from .receivers import Receivers

# Texels a metre that are measured, as shares of the default, and rays that are at the default.
_DENSITIES, _RAYS = (0.25, 0.5, 1.0, 2.0), (4,)


class OnAtlas(NamedTuple):
    """Receivers on the fronts of surfaces that are to be in the atlas: their ``rows`` (m,) among all, and of each the triangle of
    the scene, ``primitive`` (m,), and its ``normals`` (m, 3) towards the receiver."""

    rows: np.ndarray
    primitive: np.ndarray
    normals: np.ndarray


def on_atlas(context: LightContext, receivers: Receivers) -> OnAtlas | None:
    """Which of ``receivers``, made in ``context``, read the atlas of its scene; None where none does."""
    scene, geometry = context.scene, context.geometry
    if not wants_atlas(scene):
        return None
    rows = np.flatnonzero(receivers.own)
    # They stand as little above their surface as rays that leave it begin.
    primitive = context.tracer.intersect(receivers.points[rows], -receivers.normals[rows]).primitive
    chosen = np.array([instance.atlas is not None for instance in scene.instances])[geometry.instance[np.maximum(primitive, 0)]]
    front = np.einsum("ij,ij->i", geometry.normals_world[np.maximum(primitive, 0)], receivers.normals[rows]) > 0
    met = (primitive >= 0) & chosen & front
    return OnAtlas(rows[met], primitive[met], receivers.normals[rows][met]) if met.any() else None


@dataclass(frozen=True)
class AtlasSweep:
    """What a chart asks of a technique, for the light atlas."""

    name: str = ATLAS.name
    label: str = ATLAS.label
    Settings: type = AtlasSettings
    knows: frozenset = KNOWN_LIGHT
    lattices: tuple = ()

    def sweep(self) -> list[AtlasSettings]:
        """Settings from coarse to fine, the defaults among them."""
        usual = AtlasSettings()
        return [*(AtlasSettings(density=share * usual.density) for share in _DENSITIES),
                *(AtlasSettings(rays=times * usual.rays) for times in _RAYS)]


ATLAS_SWEEP = AtlasSweep()


def bake_and_read(scene: Scene, context: LightContext, receivers: Receivers, on: OnAtlas, settings: AtlasSettings, seed: int,
                  threads: int | None, progress: Progress) -> tuple[Costs, float, int, np.ndarray]:
    """Bake the atlas of ``scene`` and read it at the receivers ``on`` it: what the bake cost, seconds of a look-up, bytes of what
    engines read, and irradiance (m, 3). Raises BakeError, Cancelled."""
    with metered() as costs:
        atlas = bake_atlas(scene, None, settings, seed, threads, progress).atlas
    surfaces, instance = surfaces_in(context.scene, atlas), context.geometry.instance[on.primitive]
    started = perf_counter()
    _, places = surfaces.find(on.primitive, instance, receivers.points[on.rows], on.normals)
    light = atlas.read(places, on.normals)
    return costs, (perf_counter() - started) / len(light), atlas.coefficients.nbytes, light
