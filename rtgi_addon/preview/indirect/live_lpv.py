"""Light propagation volumes in the preview: lamps are followed on the GPU, a changed world by tracing it again on a worker."""

from ...errors import BakeError
from ...scene import Scene
from ...techniques.kernels import NUMPY
from ...techniques.lpv.field import LpvField
from .live_volumes import LiveVolumes
from .lpv import lpv_tables
from .relighting import RelitLight
from .tables import Tables


class LpvLight(RelitLight):
    """The irradiance function of ``field``; see the module's docstring."""

    def __init__(self, field: LpvField):
        self._field, self._live = field, None
        # A worker's kernels are numpy's: Blender's GPU works on the main thread only.
        relight = None if field.bake is None else lambda scene, progress: field.bake.relight(scene, progress, NUMPY)
        super().__init__(field, lpv_tables, relight)

    def follow(self, scene: Scene) -> bool:
        """See FieldLight."""
        bake = self._field.bake
        if bake is None:
            self.error = "these light propagation volumes were read from files, without their geometry volumes: bake again"
            return False
        try:
            context = bake.context.relit(scene)
        except BakeError as error:
            self.error = str(error)
            return False
        if context.environment is not bake.context.environment:
            return super().follow(scene)
        self.forget()
        if self._live is None:
            self._live = LiveVolumes(bake, self._field.world_volumes)
        self._live.light(context)
        self.samplers, self.error = self._live.textures, None
        return True

    def take(self, field: LpvField, tables: Tables) -> None:
        """See RelitLight; lamps are followed from here on."""
        super().take(field, tables)
        self._field, self._live = field, None
