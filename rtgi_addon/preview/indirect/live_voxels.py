"""Lit voxels in the preview: a worker puts the scene into voxels and lights them, of what is drawn, whatever of it has changed."""

from dataclasses import replace
from functools import partial

import numpy as np

from ...progress import Progress
from ...scene import Scene
from ...scene.lights import NOT_AT_ALL
from ...techniques import get
from ...techniques.cone_tracing import ConeSettings
from ...techniques.voxel_march import CELLS
from ...techniques.voxels.field import VoxelField
from ...techniques.voxels.settings import VoxelSettings
from ...transport.context import changed_surfaces, same_values
from ...transport.parallel import thread_count
from .probes import grid_tables
from .relighting import RelitLight
from .tables import Tables
from .voxels import voxel_tables

_SEED = 0


def tables_of_field(field: VoxelField, samples: int | None) -> Tables:
    """The voxels of ``field``; where receivers read what arrives in them, harmonics of all, its probes."""
    return grid_tables(field) if getattr(field.settings, "gather", None) == CELLS else voxel_tables(field, samples)


class LiveVoxelsLight(RelitLight):
    """``field`` (None: dark until a worker has made the first, of ``scene``) and then what ``settings`` make of the scenes that are
    followed, read by ``samples`` rays a receiver at most. ``field`` is what is shown."""

    follows_surfaces = True

    def __init__(self, settings: VoxelSettings, field: VoxelField | None, scene: Scene, samples: int | None = None):
        self.field, self._settings, self._newest = field, settings, field
        super().__init__(field, partial(tables_of_field, samples=samples), self._made, holds_direct=False)
        if field is None:
            self.follow(scene)

    @property
    def notes(self) -> tuple[str, ...]:
        """What of the scene is not as it should be for what is shown: walls that are thinner than a voxel."""
        return () if self.field is None else tuple(self.field.notes)

    def take(self, field: VoxelField, tables: Tables) -> None:
        """See RelitLight."""
        super().take(field, tables)
        self.field = field

    def _made(self, scene: Scene, progress: Progress) -> VoxelField:
        """The field of ``scene``; the newest one's voxels stay as long as they hold the same surfaces. On the worker."""
        # Lamps that no bake knows shine, and nothing that they light does.
        scene = replace(scene, lights=tuple(light for light in scene.lights if light.bake != NOT_AT_ALL))
        before = self._newest
        known = None if before is None else before.context.scene
        if known is None or not same_values(known.volumes, scene.volumes) or changed_surfaces(known, scene):
            technique = get("cone_tracing" if isinstance(self._settings, ConeSettings) else "voxel_march")
            # A core is left to whoever drags what moves.
            threads, rng = max(1, thread_count() - 1), np.random.default_rng(_SEED)
            self._newest = technique.bake(scene, self._settings, rng, progress, threads=threads)
        else:
            self._newest = before.relight(scene, progress)
        return self._newest
