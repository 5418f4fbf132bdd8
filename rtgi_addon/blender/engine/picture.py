"""One technique's light in a viewport: a renderer that is made anew when what it is made of is another, and its samples."""

import time
from dataclasses import replace

from ...effects import Chosen
from ...scene import Scene
from .shown import Shown, same_light

# A finished picture waits this long [s] for the worker that makes its next light: one redraw after the other would keep Python from
# the worker, and software drivers, which hold on to something of every draw, would run out of mappings.
_PAUSE = 0.02


class Picture:
    """``renderer`` (a PreviewRenderer, None before the first frame) of the field that is shown. GPU work, but for the making."""

    def __init__(self):
        self.renderer = None
        self._settings = self._effects = self._field = self._live = self._seen = None
        self._size = (0, 0)

    def frame(self, scene: Scene, shown: Shown, settings, effects: tuple[Chosen, ...], seen, size: tuple[int, int]) -> None:
        """Show ``scene`` in the light of ``shown`` as ``settings`` (PreviewSettings) and ``effects`` say, and average one sample of
        the CameraView ``seen`` in unless that would change nothing."""
        from ...preview.renderer import PreviewRenderer  # importable once there is a GPU
        if self.renderer is None or shown.field is not self._field or shown.live != self._live:
            self.close()
            baked = None if shown.baked is None else shown.baked.scene
            begun = scene
            if baked is not None and shown.live is None and not same_light(baked, begun):
                begun = replace(begun, lights=baked.lights, world=baked.world)
            self.renderer = PreviewRenderer(begun, shown.field, settings, (settings.mode,), baked, shown.live, effects)
            self._effects, self._settings, self._field, self._live, self._seen = effects, settings, shown.field, shown.live, None
        elif (settings, effects) != (self._settings, self._effects):
            self.renderer.configure(settings, (settings.mode,), effects)
            self._settings, self._effects, self._seen = settings, effects, None
        self.renderer.update(scene)
        if shown.live is not None:
            self.renderer.look_from(seen.world_from_camera[:3, 3])
        if seen.equals(self._seen) and size == self._size and self.renderer.samples >= settings.samples:
            if not self.renderer.busy:
                return
            time.sleep(_PAUSE)
            if not self.renderer.take_light():
                return
        self.renderer.frame(seen, size)
        self._seen, self._size = seen, size

    @property
    def texture(self):
        """The pass that is shown."""
        return self.renderer.textures[self._settings.mode]

    @property
    def unsettled(self) -> bool:
        """True while another frame would change the picture."""
        return self.renderer is not None and (self.renderer.busy or self.renderer.samples < self._settings.samples)

    def close(self) -> None:
        """Let go of the renderer and its workers."""
        if self.renderer is not None:
            self.renderer.close()
            self.renderer = None
