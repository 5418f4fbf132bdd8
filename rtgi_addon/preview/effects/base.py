"""What a half of an effect is given on the GPU, and what is asked of it."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import gpu

from ...effects import Chosen
from ...effects.spheres.maps import SphereProbes
from ...scene import Light, Scene
from ...techniques.base import Field
from ...transport.views.camera import CameraView
from ..capture import Drawn
from ..direct_light import DirectLight
from ..film import Background
from ..indirect_pass import Indirect


class Before(NamedTuple):
    """How the sample before was seen: of which ``scene``, from where, and shifted by how many pixels."""

    scene: Scene
    view: CameraView
    offset: tuple[float, float]


@dataclass(frozen=True, eq=False)
class GpuFrame:
    """One sample of a picture on the GPU: effects.Frame, with textures (RGBA32F, row 0 at the bottom) in the place of arrays.

    ``gbuffer`` holds the targets by their names (transport.views.gbuffer.GBUFFER); ``direct``, ``irradiance`` and ``light`` as in
    effects.Frame. ``drawn`` is the scene with its surfaces, for passes of a half's own, ``background`` the world as a texture.
    ``field`` is the bake that is shown, None where there is none. ``before`` tells of the sample before, None where there was none
    of this size; textures of it are for a half to keep. ``lamps`` gives the lamps ``lamps_added``, whose light the bake does not
    hold, with their shadow maps. ``indirect`` looks the bake's light up, or the world's. ``passes`` are what the effects before
    delivered beside their picture. ``spheres`` are the bake's sphere probes, None where they hold another light than is shown.
    """

    drawn: Drawn
    field: Field | None
    view: CameraView
    size: tuple[int, int]
    gbuffer: Mapping[str, gpu.types.GPUTexture]
    direct: gpu.types.GPUTexture
    irradiance: gpu.types.GPUTexture
    light: gpu.types.GPUTexture
    background: Background
    index: int
    offset: tuple[float, float]
    transparent: bool
    before: Before | None
    lamps: DirectLight
    lamps_added: tuple[Light, ...]
    passes: Mapping[str, gpu.types.GPUTexture]
    indirect: Indirect
    spheres: SphereProbes | None = None

    @property
    def scene(self) -> Scene:
        """The scene that is drawn."""
        return self.drawn.scene


class Half(Protocol):
    """An effect with its settings on the GPU; made by its type from a Chosen. ``passes`` are what the latest ``draw`` delivered
    beside its picture, of effects.EFFECT_PASSES."""

    chosen: Chosen
    passes: Mapping[str, gpu.types.GPUTexture]

    def draw(self, frame: GpuFrame) -> gpu.types.GPUTexture:
        """What the effect makes of ``frame.light``, in a texture of its own that is good until the next call."""
