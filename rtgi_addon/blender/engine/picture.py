"""One technique's light in a viewport: a renderer that is made anew when what it is made of is another, and its samples."""

from dataclasses import replace

from ...scene import Scene
from .shown import Shown, same_light


class Picture:
    """``renderer`` (a PreviewRenderer, None before the first frame) of the field that is shown. GPU work, but for the making."""

    def __init__(self):
        self.renderer = None
        self._settings = self._field = self._live = self._seen = None
        self._size = (0, 0)

    def frame(self, scene: Scene, shown: Shown, settings, seen, size: tuple[int, int]) -> None:
        """Show ``scene`` in the light of ``shown`` as ``settings`` (PreviewSettings) say, and average one sample of the CameraView
        ``seen`` in unless that would change nothing."""
        from ...preview.renderer import PreviewRenderer  # importable once there is a GPU
        if self.renderer is None or shown.field is not self._field or shown.live != self._live:
            self.close()
            baked = None if shown.baked is None else shown.baked.scene
            begun = scene
            if baked is not None and shown.live is None and not same_light(baked, begun):
                begun = replace(begun, lights=baked.lights, world=baked.world)
            self.renderer = PreviewRenderer(begun, shown.field, settings, (settings.mode,), baked, shown.live)
            self._settings, self._field, self._live, self._seen = settings, shown.field, shown.live, None
        elif settings != self._settings:
            self.renderer.configure(settings, (settings.mode,))
            self._settings, self._seen = settings, None
        self.renderer.update(scene)
        if not seen.equals(self._seen) or size != self._size or self.unsettled:
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
