"""What a camera sees, as textures without any light in them: the same surfaces and pass as for shadow maps (see `surfaces`), and
the same names and meanings as by rays (transport/views/gbuffer.py)."""

import gpu
import numpy as np

from ..scene import Scene
from ..transport.views.camera import View
from ..transport.views.gbuffer import GBUFFER
from .device import RenderTarget
from .materials import Images
from .surfaces import SurfacePass


class GBuffer:
    """Targets of ``width`` × ``height`` texels, row 0 at the bottom.

    ``textures`` by name (transport.views.gbuffer.GBUFFER, which says what each holds), all RGBA32F, zero where nothing is seen.
    """

    def __init__(self, width: int, height: int):
        self._target = RenderTarget(width, height, ("RGBA32F",) * len(GBUFFER), depth=True)

    @property
    def textures(self) -> dict[str, gpu.types.GPUTexture]:
        """The targets by name."""
        return dict(zip(GBUFFER, self._target.colors, strict=True))

    def draw(self, surfaces: SurfacePass | None, view: View, among: np.ndarray | None = None) -> None:
        """Fill the targets with the instances ``among`` (i,) bool (None: all), with nothing for no ``surfaces``; backs of materials
        that cull them are left out."""
        with self._target.drawing():
            if surfaces is not None:
                surfaces.draw(view, cull=True, among=among)


def gbuffer_surfaces(scene: Scene, images: Images | None = None, before: SurfacePass | None = None) -> SurfacePass:
    """``scene`` ready to be drawn into G-buffers and shadow maps; ``images`` may be shared with other passes;
    vertices that were sent for ``before`` are not sent again."""
    return SurfacePass(scene, "gbuffer", images, before)
