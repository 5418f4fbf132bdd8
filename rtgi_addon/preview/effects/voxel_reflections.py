"""Reflections by cones through lit voxels on the GPU: the twin of effects/voxel_reflections.py, by the voxels' textures that the
indirect light reads. Where the bake has no voxels numpy makes and reads its own (`on_cpu`)."""

from functools import cache

import gpu

from ...effects import Chosen
from ...techniques.voxels.field import VoxelField
from ...transport.surfaces.ggx import energy_table
from ...transport.views.gbuffer import GBUFFER
from ..device import dispatch
from ..indirect.base import FieldLight
from ..indirect.tables import UNIFORMS
from ..indirect.voxels import TEXTURES, voxel_tables
from ..program import Image, Program
from ..textures import empty, upload
from ..uniforms import UniformStruct
from .base import GpuFrame
from .on_cpu import OnCpu
from .programs import EFFECT_FRAME, frame_values

_SURFACE = tuple(f"gbuffer_{name}" for name in GBUFFER)
_CONE = UniformStruct("MirrorCone", (("float", "step"), ("float", "near"), ("float", "max_alpha")))


@cache
def program(struct: UniformStruct, defines: tuple) -> Program:
    """The effect's program for voxels whose uniforms are of ``struct``."""
    return Program("voxel_reflections", uniforms=(("frame", EFFECT_FRAME), (UNIFORMS, struct), ("cone", _CONE)),
                   samplers=(*_SURFACE, "ggx_energy", "light", "indirect_irradiance", *TEXTURES), images=(Image("result"),),
                   local_size=(8, 8), defines=defines)


class VoxelReflectionsHalf:
    """See Half."""

    def __init__(self, chosen: Chosen):
        self.chosen = chosen
        self.passes: dict[str, gpu.types.GPUTexture] = {}
        self._energy = upload(energy_table())
        self._result: gpu.types.GPUTexture | None = None
        self._own: tuple[VoxelField, FieldLight] | None = None
        self._numpy: OnCpu | None = None

    def draw(self, frame: GpuFrame) -> gpu.types.GPUTexture:
        """See Half."""
        if not isinstance(frame.field, VoxelField):
            self._numpy = self._numpy or OnCpu(self.chosen)
            return self._numpy.draw(frame)
        if self._result is None or (self._result.width, self._result.height) != tuple(frame.size):
            self._result = empty(*frame.size)
        voxels = self._voxels(frame)
        struct = next(struct for name, struct in voxels.program.uniforms if name == UNIFORMS)
        made = program(struct, voxels.program.defines)
        settings = self.chosen.settings
        values = frame_values(frame.view, frame.size, frame.index, frame.offset, frame.transparent, frame.background.map_from_world)
        cone = {"step": settings.step, "near": settings.near, "max_alpha": settings.max_roughness**2}
        dispatch(made, frame.size, uniforms={"frame": values, UNIFORMS: voxels.uniforms[UNIFORMS], "cone": cone},
                 samplers={**{f"gbuffer_{name}": frame.gbuffer[name] for name in GBUFFER}, "ggx_energy": self._energy,
                           "light": frame.light, "indirect_irradiance": frame.irradiance,
                           **{name: voxels.samplers[name] for name in TEXTURES}}, images={"result": self._result})
        return self._result

    def _voxels(self, frame: GpuFrame):
        """What has the textures of the voxels: the indirect light, or where that reads something else of them, one of our own."""
        if all(name in frame.indirect.samplers for name in TEXTURES):
            return frame.indirect
        if self._own is None or self._own[0] is not frame.field:
            self._own = frame.field, FieldLight(voxel_tables(frame.field))
        return self._own[1]


HALF = VoxelReflectionsHalf
