"""An effect that has no half on the GPU: the frame comes back as arrays, and its picture goes up again."""

from functools import partial

import gpu

from ...effects import Chosen, Frame, History
from ...effects.base import apply_all
from ...effects.lit import light_context
from ...scene import Scene
from ...transport.context import LightContext
from ...transport.views.gbuffer import GBuffer
from ..textures import download, upload
from .base import GpuFrame


class OnCpu:
    """Runs ``Effect.apply`` on what was drawn; see Half. Rays, if it asks for them, go through a LightContext that is kept as long
    as the scene is the same."""

    def __init__(self, chosen: Chosen):
        self.chosen = chosen
        self.passes: dict[str, gpu.types.GPUTexture] = {}
        self._history: History | None = None
        self._contexts = _KeptContext()

    def draw(self, frame: GpuFrame) -> gpu.types.GPUTexture:
        """See Half."""
        gbuffer = GBuffer(**{name: download(texture) for name, texture in frame.gbuffer.items()})
        drawn = Frame(frame.scene, frame.view, gbuffer, download(frame.direct), download(frame.irradiance), download(frame.light),
                      frame.index, tuple(frame.offset), frame.transparent, None if frame.before is None else self._history,
                      partial(self._contexts.of, frame.scene))
        after = apply_all(drawn, frame.field, [self.chosen])
        self._history = after.history
        self.passes = {name: upload(image) for name, image in after.passes.items()}
        return upload(after.light)


class _KeptContext:
    """The context of the scene that was asked for last: apart from the half, whose history would else refer to it (see
    FieldLight.close)."""

    def __init__(self):
        self._kept: tuple[Scene, LightContext | None] | None = None

    def of(self, scene: Scene) -> LightContext | None:
        """Rays through ``scene``."""
        if self._kept is None or self._kept[0] is not scene:
            self._kept = scene, light_context(scene)
        return self._kept[1]
