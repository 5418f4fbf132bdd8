"""Light propagation volumes in the preview: what lamps light is followed on the GPU; what blocks and reflects light where objects
have moved, and a changed world, by another bake on a worker."""

import numpy as np

from ...progress import Progress
from ...scene import Scene
from ...techniques.kernels import NUMPY
from ...techniques.lpv.bake import bake_field
from ...techniques.lpv.field import LpvField
from ...techniques.lpv.grid import LpvGrid
from ...techniques.lpv.settings import LpvSettings
from ...transport.context import LightContext, changed_surfaces, same_values
from ..capture import Drawn
from .live_volumes import LiveVolumes
from .lpv import lpv_tables
from .relighting import RelitLight
from .tables import Tables

_SEED = 0


def live_lpv_light(settings: LpvSettings) -> "LpvLight":
    """Light propagation volumes as ``settings`` have them, without any bake: dark until a worker has made the first."""
    grid = LpvGrid((0.0, 0.0, 0.0), 1.0, (1, 1, 1))
    return LpvLight(LpvField((grid,), (np.zeros((4, 3, 1, 1, 1), np.float32),), params={}, stats={}), settings)


class LpvLight(RelitLight):
    """The irradiance function of ``field``; see the module's docstring. ``settings`` (None: the field's) are those of the volumes
    that are made anew."""

    def __init__(self, field: LpvField, settings: LpvSettings | None = None):
        self._field, self._live, self._drawn = field, None, None
        self._settings = settings if field.bake is None else field.bake.settings
        # Read from files it has neither geometry volumes nor anything to make them by.
        self.captures = self._settings is not None
        super().__init__(field, lpv_tables)

    @property
    def can_follow(self) -> bool:
        """See RelitLight."""
        return self.captures

    def follow(self, scene: Scene) -> bool:
        """See FieldLight: only of what was read from files."""
        self.error = "these light propagation volumes were read from files, without their geometry volumes: bake again"
        return False

    def capture(self, drawn: Drawn) -> bool:
        """See FieldLight."""
        self._drawn, bake = drawn, self._field.bake
        known = None if bake is None else bake.context.scene
        if known is not None and drawn.surfaces is not None and same_values(known.world, drawn.scene.world):
            self._light(drawn)
            if not changed_surfaces(known, drawn.scene):
                self.forget()
                return True
        return super().follow(drawn.scene)

    def take(self, field: LpvField, tables: Tables) -> None:
        """See RelitLight; lamps are followed from here on."""
        super().take(field, tables)
        self._field, self._live = field, None
        known, scene = field.bake.context.scene, self._drawn.scene
        if scene is not known and self._drawn.surfaces is not None and same_values(known.world, scene.world):
            # The worker is behind what is drawn: that meets the light at its new places at least.
            self._light(self._drawn)

    def close(self) -> None:
        """See FieldLight."""
        super().close()
        self._live = self._drawn = None

    def relit(self, scene: Scene, progress: Progress) -> LpvField:
        """See RelitLight. A worker's kernels are numpy's: Blender's GPU works on the main thread only."""
        bake = self._field.bake
        if bake is not None and not changed_surfaces(bake.context.scene, scene):
            return bake.relight(scene, progress, NUMPY)
        seed = _SEED if bake is None else bake.seed
        return bake_field(LightContext(scene), self._settings, seed, NUMPY, progress)

    def _light(self, drawn: Drawn) -> None:
        if self._live is None:
            self._live = LiveVolumes(self._field.bake, self._field.world_volumes)
        self._live.light(drawn)
        self.samplers, self.error = self._live.textures, None
