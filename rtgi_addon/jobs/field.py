"""From a Scene to a Field that nobody stores: for a picture of it."""

from dataclasses import replace

import numpy as np

from .. import techniques
from ..effects.atlas.bake import bake_atlas, require_atlas, wants_atlas
from ..effects.atlas.settings import AtlasSettings
from ..effects.spheres.bake import bake_spheres
from ..effects.spheres.settings import SphereSettings
from ..progress import Progress
from ..scene import Scene
from ..scene.checks import check_scene, require
from ..techniques import Field
from .bake import ATLAS_SHARE, SPHERES_SHARE
from .ready import select_volumes
from .settings import build_settings


def bake_field(scene: Scene, technique: str, overrides: dict | None = None, *, seed: int = 0, threads: int | None = None,
               volume=None, progress: Progress | None = None, spheres: SphereSettings | None = None,
               atlas: AtlasSettings | None = None) -> Field:
    """The field of ``scene``, as `bake_scene` with the same arguments would bake it, with sphere probes and a light atlas
    only where ``spheres`` and ``atlas`` say how. Raises BakeError, Cancelled."""
    progress, overrides = progress or Progress(), overrides or {}
    method = techniques.get(technique)
    settings = build_settings(method, overrides)
    progress.step(0.0, "Checking the scene")
    scene = replace(scene, volumes=select_volumes(scene.volumes, volume, overrides))
    require(check_scene(scene, sh_order=getattr(settings, "order", 2)))
    of_spheres = spheres is not None and spheres.bake and bool(scene.spheres)
    of_atlas = atlas is not None and wants_atlas(scene)
    if of_atlas:
        require_atlas(scene, atlas)
    end = 1.0 - SPHERES_SHARE if of_spheres else 1.0
    lit = end * (1.0 - ATLAS_SHARE) if of_atlas else end
    field = method.bake(scene, settings, np.random.default_rng(seed), progress.span(0.0, lit), threads=threads)
    if of_atlas:
        sheet = bake_atlas(scene, field, atlas, seed, threads, progress.span(lit, end))
        field.atlas, field.notes = sheet.atlas, (*field.notes, *sheet.notes)
    if of_spheres:
        baked = bake_spheres(scene, field, spheres, seed, threads, progress.span(end, 1.0))
        field.spheres, field.notes = baked.probes, (*field.notes, *baked.notes)
    return field
