"""A field's irradiance function on the GPU: the textures it reads, and how it follows the scene."""

import gpu
import numpy as np

from ...scene import Scene
from ..capture import Drawn
from ..device import uniform_buffer
from ..indirect_pass import draw_indirect
from ..packing import FOLD_WIDTH
from ..program import Program
from ..textures import download, empty, upload
from .tables import UNIFORMS, Tables


class FieldLight:
    """The indirect light of one field, for ``indirect_pass.draw_indirect``: ``program``, ``uniforms`` and ``samplers`` as asked
    for there, of which each may change when the scene is followed.

    ``direct_lamps`` names the lamps whose direct light is in it already, as in Field; ``error`` says why it does not follow the
    scene, or is None. GPU objects: main thread only.
    """

    captures = False
    # Whether ``follow`` also asks what of the surfaces changed, as what they emit.
    follows_surfaces = False

    def __init__(self, tables: Tables, direct_lamps: frozenset[str] | None = frozenset()):
        self.direct_lamps = direct_lamps
        self.error: str | None = None
        self.set(tables)

    def set(self, tables: Tables) -> None:
        """Show ``tables`` from now on."""
        self.samplers: dict[str, gpu.types.GPUTexture] = {name: upload(texels) for name, texels in tables.textures.items()}
        self.program: Program = tables.program
        self.uniforms: dict[str, gpu.types.GPUUniformBuf] = {UNIFORMS: uniform_buffer(tables.struct, tables.values)}

    @property
    def busy(self) -> bool:
        """True while a worker makes what ``update`` will bring."""
        return False

    def follow(self, scene: Scene) -> bool:
        """Take the lamps and the world of ``scene``: at once where the technique does it on the GPU, else on a worker, whose light
        comes with ``update``. False if this light cannot fit the scene any more; ``error`` then says why."""
        raise NotImplementedError

    def capture(self, drawn: Drawn) -> bool:
        """Take lamps, objects and world of what is drawn, for a light that ``captures``. False if it cannot fit them."""
        raise NotImplementedError

    def update(self) -> bool:
        """Take over what a worker has finished since the last call; True if that changed the light."""
        return False

    def close(self) -> None:
        """Let go of workers, and of what is on the GPU: here, for whoever lets go of it last may be another thread. Under Vulkan
        Blender takes what another thread lets go of from under commands that it has not sent yet, and crashes. For the same reason
        no light may refer to itself: Python collects such cycles on whichever thread it happens to be."""
        self.samplers, self.uniforms = {}, {}


def irradiance(light, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Irradiance (n, 3) float32 [W·m⁻²] of ``light`` (an indirect_pass.Indirect) at ``points`` (n, 3) with unit ``normals``
    (n, 3), as the GPU has it."""
    count = len(points)
    width = max(min(count, FOLD_WIDTH), 1)
    receivers = np.zeros((2, max(-(-count // width), 1) * width, 4), np.float32)
    receivers[0, :count, :3], receivers[1, :count, :3] = points, normals
    position, normal = (upload(rows.reshape(-1, width, 4)) for rows in receivers)
    target = empty(width, position.height)
    draw_indirect(light, {"position": position, "normal": normal}, target)
    return download(target).reshape(-1, 4)[:count, :3].copy()
