"""The light that a bake knows where media are (effects/media/ambient.py) as a texture, for include/ambient.glsl."""

import gpu
import numpy as np

from ...effects.media.ambient import Ambient
from ..packing import fold
from ..textures import upload
from .base import GpuFrame


class AmbientTexture:
    """That of one frame after another: ``texture``, and the ``values`` of the lattice's members in a struct."""

    texture: gpu.types.GPUTexture

    def __init__(self):
        self._lit_by = self._ambient = None

    def of(self, frame: GpuFrame) -> "AmbientTexture":
        """That of ``frame``; made anew only where the light, the media or what is about them is another."""
        lit_by = frame.field, frame.scene.media, frame.scene.world, frame.scene.instances
        if self._lit_by is None or any(a is not b for a, b in zip(lit_by, self._lit_by, strict=True)):
            self._ambient, self._lit_by = Ambient.of(frame.scene, frame.field), lit_by
            coefficients = np.zeros((len(self._ambient.coefficients), 9, 4), np.float32)
            coefficients[..., :3] = self._ambient.coefficients
            self.texture = upload(fold(coefficients.reshape(len(coefficients), 36)), name="the light in media")
        return self

    @property
    def values(self) -> dict:
        """Where the lattice stands."""
        return {"ambient_from_world": np.linalg.inv(self._ambient.world_from_local),
                "ambient_resolution": self._ambient.resolution}
