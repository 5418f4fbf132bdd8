"""The pass that writes indirect irradiance for every pixel of a G-buffer, whichever technique it comes from.

A technique brings ``shaders/indirect_NAME.comp.glsl``, which includes its own ``vec3 indirect_irradiance(vec3 position_world, vec3
normal_world)`` and then include/indirect_frame.glsl; ``indirect_program`` adds what the frame reads and writes to its resources.
"""

from collections.abc import Mapping
from typing import Protocol

import gpu
import numpy as np

from ..numerics import sh
from ..scene import Scene
from ..transport.lights.world_sh import world_sh
from .capture import Drawn
from .device import dispatch
from .program import Program
from .programs import indirect_program
from .uniforms import UniformStruct


class Indirect(Protocol):
    """One technique's indirect light on the GPU: ``program`` made by ``indirect_program``, and the ``uniforms`` and ``samplers`` of
    the names that were given to it. ``direct_lamps`` names the lamps whose direct light is in it (see Field); ``error`` says why it
    does not follow the scene, or is None. ``captures`` says that it is made of what is drawn: then it is followed with ``capture``,
    also when objects move, else with ``follow``."""

    program: Program
    direct_lamps: frozenset[str] | None
    captures: bool
    error: str | None

    @property
    def uniforms(self) -> Mapping[str, object]:
        """Values (or buffers) of the program's uniform buffers but the frame's, by name."""

    @property
    def samplers(self) -> Mapping[str, gpu.types.GPUTexture]:
        """Textures of the program's samplers but the G-buffer's, by name."""

    def follow(self, scene: Scene) -> bool:
        """Take in that ``scene`` has changed (lamps moved, the world turned) as far as the technique can without a new bake; what
        of it runs on the GPU runs here. False if its light does not fit the scene any more."""

    def capture(self, drawn: Drawn) -> bool:
        """Take in lamps, objects and world of what is drawn. False if its light does not fit the scene any more."""

    @property
    def busy(self) -> bool:
        """True while a worker makes what ``update`` will bring."""

    def update(self) -> bool:
        """Take over what a worker has made since the last call; True if that changed the light."""

    def close(self) -> None:
        """Let go of workers."""


def draw_indirect(indirect: Indirect, gbuffer: Mapping[str, gpu.types.GPUTexture], irradiance: gpu.types.GPUTexture) -> None:
    """Write ``irradiance`` [W·m⁻²] for the G-buffer's textures ``position`` and ``normal``."""
    size = irradiance.width, irradiance.height
    dispatch(indirect.program, size, uniforms={"frame": {"size": size}, **indirect.uniforms},
             samplers={"gbuffer_position": gbuffer["position"], "gbuffer_normal": gbuffer["normal"], **indirect.samplers},
             images={"irradiance": irradiance})


class WorldLight:
    """The light of the world alone, as if nothing stood in its way: what is shown where there is no bake."""

    direct_lamps, captures, error = frozenset(), False, None
    program = indirect_program("indirect_world", (("world_light", UniformStruct("WorldLight", (("vec4", "cosine_sh", 9),))),))

    def __init__(self, scene: Scene):
        self.follow(scene)

    @property
    def uniforms(self) -> dict:
        """See Indirect."""
        return {"world_light": {"cosine_sh": self._cosine_sh}}

    @property
    def samplers(self) -> dict:
        """See Indirect."""
        return {}

    def follow(self, scene: Scene) -> bool:
        """See Indirect."""
        self._cosine_sh = np.zeros((9, 4), np.float32)
        self._cosine_sh[:, :3] = sh.cosine_coefficients(2)[:, None] * world_sh(scene.world, 2)
        return True

    @property
    def busy(self) -> bool:
        """See Indirect."""
        return False

    def update(self) -> bool:
        """See Indirect."""
        return False

    def close(self) -> None:
        """See Indirect."""
