"""From a Scene to a Field that nobody stores: for a picture of it."""

from dataclasses import replace

import numpy as np

from .. import techniques
from ..progress import Progress
from ..scene import Scene
from ..scene.checks import check_scene, require
from ..techniques import Field
from .bake import select_volumes
from .settings import build_settings


def bake_field(scene: Scene, technique: str, overrides: dict | None = None, *, seed: int = 0, threads: int | None = None,
               volume=None, progress: Progress | None = None) -> Field:
    """The field of ``scene``, as `bake_scene` with the same arguments would bake it. Raises BakeError, Cancelled."""
    progress, overrides = progress or Progress(), overrides or {}
    method = techniques.get(technique)
    settings = build_settings(method, overrides)
    progress.step(0.0, "Checking the scene")
    scene = replace(scene, volumes=select_volumes(scene.volumes, volume, overrides))
    require(check_scene(scene, sh_order=getattr(settings, "order", 2)))
    return method.bake(scene, settings, np.random.default_rng(seed), progress, threads=threads)
