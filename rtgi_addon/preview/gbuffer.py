"""What a camera sees, as textures without any light in them: the same surfaces and pass as for shadow maps (see `surfaces`)."""

import gpu

from ..scene import Scene
from .camera_view import View
from .device import RenderTarget
from .materials import Images
from .programs import OUTPUTS
from .surfaces import SurfacePass


class GBuffer:
    """Targets of ``width`` × ``height`` texels, row 0 at the bottom.

    ``textures`` by name, all RGBA32F, zero where nothing is seen: ``position`` world and ``normal`` world on the side that is seen,
    with the triangle in their fourth components (`surfaces.decode_primitive`); ``albedo`` of diffuse transport and the instance's
    index; ``base_color`` and metallic; ``emission`` [W·sr⁻¹·m⁻²] and roughness; ``geometry`` the triangle's own normal on that
    side and the reflectance of its dielectric layer at normal incidence.
    """

    def __init__(self, width: int, height: int):
        self._target = RenderTarget(width, height, ("RGBA32F",) * len(OUTPUTS), depth=True)

    @property
    def textures(self) -> dict[str, gpu.types.GPUTexture]:
        """The targets by name."""
        return dict(zip(OUTPUTS, self._target.colors, strict=True))

    def draw(self, surfaces: SurfacePass | None, view: View) -> None:
        """Fill the targets, with nothing for None; backs of materials that cull them are left out."""
        with self._target.drawing():
            if surfaces is not None:
                surfaces.draw(view, cull=True)


def gbuffer_surfaces(scene: Scene, images: Images | None = None, before: SurfacePass | None = None) -> SurfacePass:
    """``scene`` ready to be drawn into G-buffers and shadow maps; ``images`` may be shared with other passes;
    vertices that were sent for ``before`` are not sent again."""
    return SurfacePass(scene, "gbuffer", images, before)
