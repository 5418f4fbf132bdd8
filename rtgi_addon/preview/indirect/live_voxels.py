"""Lit voxels in the preview: a worker puts the scene into voxels and lights them, of what is drawn, whatever of it has changed.

Until it has, what moved is taken out of the voxels where it was, and what the camera sees of it is put in (``put_in``).
"""

from dataclasses import replace
from functools import partial

import numpy as np

from ...progress import Progress
from ...scene import Camera, Scene
from ...scene.lights import NOT_AT_ALL
from ...techniques import get
from ...techniques.cone_tracing import ConeSettings
from ...techniques.voxel_march import CELLS
from ...techniques.voxels.field import VoxelField
from ...techniques.voxels.moved import FollowedVoxels, Moved, moved_since
from ...techniques.voxels.place import place_grids
from ...techniques.voxels.settings import CAMERA, VoxelSettings
from ...transport.context import changed_surfaces, same_values
from ...transport.parallel import thread_count
from ...transport.voxels.moving import CameraPoints
from .probes import grid_tables
from .relighting import RelitLight
from .tables import Tables
from .voxels import LitVoxels, tables_of, voxel_tables

_SEED = 0
# Finest voxels that an eye may be from where nested grids lie: putting a scene into voxels takes a worker longer than a step does.
STRAY = 4.0


def tables_of_field(field: VoxelField, samples: int | None) -> Tables:
    """The voxels of ``field``; where receivers read what arrives in them, harmonics of all, its probes."""
    return grid_tables(field) if getattr(field.settings, "gather", None) == CELLS else voxel_tables(field, samples)


class LiveVoxelsLight(RelitLight):
    """``field`` (None: dark until a worker has made the first, of ``scene``) and then what ``settings`` make of the scenes that are
    followed, read by ``samples`` rays a receiver at most. ``field`` is what is shown."""

    follows_surfaces = True

    def __init__(self, settings: VoxelSettings, field: VoxelField | None, scene: Scene, samples: int | None = None):
        self.field, self._settings, self._newest = field, settings, field
        self._samples, self._drawn, self._moved, self._followed = samples, scene, None, None
        self._eye: np.ndarray | None = None
        super().__init__(field, partial(tables_of_field, samples=samples), holds_direct=False)
        if field is None:
            self.follow(scene)

    @property
    def can_follow(self) -> bool:
        """See RelitLight."""
        return True

    @property
    def notes(self) -> tuple[str, ...]:
        """What of the scene is not as it should be for what is shown: walls that are thinner than a voxel."""
        return () if self.field is None else tuple(self.field.notes)

    @property
    def moved(self) -> Moved | None:
        """What of the scene that is drawn the voxels do not know and a camera can put in, None for nothing."""
        return self._moved

    def put_in(self, points: CameraPoints | None) -> None:
        """Show the voxels without what moved, and with what of it is among ``points`` that a camera sees (None: nothing is)."""
        field = self.field
        if self._followed is None:
            self._followed = FollowedVoxels(field, self._moved)
        shown = LitVoxels(field.context, field.settings, field.seed, self._followed.with_points(points))
        self.set(tables_of(shown, self._samples))

    def look_from(self, eye: np.ndarray) -> None:
        """Have nested grids that lie about the camera lie about ``eye`` (3,) [m] instead, once it is more than STRAY of the finest
        voxels from what they lie about."""
        if self._settings.cascades == 1 or self._settings.center != CAMERA:
            return
        if self._eye is not None:
            if self._newest is None or np.abs(eye - self._eye).max() <= STRAY * self._newest.voxels.grid.cell:
                return
        self._eye = np.array(eye, np.float64)
        self.follow(self._drawn)

    def follow(self, scene: Scene) -> bool:
        """See FieldLight."""
        self._drawn = scene
        self._compare()
        if self._eye is not None:
            place = np.eye(4)
            place[:3, 3] = self._eye
            scene = replace(scene, cameras=(Camera("eye", place, np.eye(4), (1, 1)), *scene.cameras))
        return super().follow(scene)

    def take(self, field: VoxelField, tables: Tables) -> None:
        """See RelitLight."""
        super().take(field, tables)
        self.field = field
        # The worker may be behind what is drawn.
        self._compare()

    def _compare(self) -> None:
        self._moved = self._followed = None
        # What arrives in cells is shown through probes, which know no surfaces.
        if self.field is not None and getattr(self._settings, "gather", None) != CELLS:
            moved = moved_since(self.field.context.scene, self._drawn)
            self._moved = moved if moved.any else None

    def relit(self, scene: Scene, progress: Progress) -> VoxelField:
        """See RelitLight; the newest field's voxels stay as long as they hold the same surfaces."""
        # Lamps that no bake knows shine, and nothing that they light does.
        scene = replace(scene, lights=tuple(light for light in scene.lights if light.bake != NOT_AT_ALL))
        before = self._newest
        known = None if before is None else before.context.scene
        if known is None or not same_values(known.volumes, scene.volumes) or changed_surfaces(known, scene) or self._aside(scene):
            technique = get("cone_tracing" if isinstance(self._settings, ConeSettings) else "voxel_march")
            # A core is left to whoever drags what moves.
            threads, rng = max(1, thread_count() - 1), np.random.default_rng(_SEED)
            self._newest = technique.bake(scene, self._settings, rng, progress, threads=threads)
        else:
            self._newest = before.relight(scene, progress)
        return self._newest

    def _aside(self, scene: Scene) -> bool:
        """Whether grids of ``scene``, whose surfaces are those of the newest field, lie elsewhere than that one's."""
        context = self._newest.context
        bounds = np.array(context.geometry.bounds(), np.float64)
        return place_grids(scene, bounds, self._settings) != place_grids(context.scene, bounds, self._settings)
