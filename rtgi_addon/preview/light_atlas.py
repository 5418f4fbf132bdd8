"""The light atlas on the GPU: the pass that lays what its texels hold over a field's irradiance, where surfaces are in it."""

from collections.abc import Mapping

import gpu
import numpy as np

from ..effects.atlas.sheet import LightAtlas
from ..effects.atlas.surfaces import AtlasSurfaces, surfaces_in
from ..scene import Scene
from .device import dispatch
from .packing import fold
from .programs import INDIRECT_ATLAS
from .surfaces import LOW_INDICES
from .textures import upload

_TARGETS = ("position", "normal", "albedo", "geometry")


class AtlasLight:
    """A light atlas on surfaces of a scene; what of the two stays stays on the GPU. Main thread only."""

    def __init__(self):
        self._atlas: LightAtlas | None = None
        self._surfaces: AtlasSurfaces | None = None
        self._samplers: dict[str, gpu.types.GPUTexture] = {}

    def draw(self, atlas: LightAtlas | None, scene: Scene, gbuffer: Mapping[str, gpu.types.GPUTexture],
             irradiance: gpu.types.GPUTexture) -> None:
        """Write to ``irradiance`` [W·m⁻²] what ``atlas`` holds where the G-buffer of ``scene`` shows surfaces in it. Raises
        BakeError for a sheet that fits no texture of this GPU."""
        surfaces = None if atlas is None else surfaces_in(scene, atlas)
        if surfaces is None:
            return
        if atlas is not self._atlas:
            self._samplers["atlas_texels"] = upload(atlas_texels(atlas), name="the light atlas")
        if surfaces is not self._surfaces:
            self._samplers["atlas_instances"] = upload(fold(instance_rows(surfaces)))
            self._samplers["atlas_triangles"] = upload(fold(triangle_rows(surfaces)))
        self._atlas, self._surfaces = atlas, surfaces
        size, (height, width) = (irradiance.width, irradiance.height), atlas.sheet.size
        dispatch(INDIRECT_ATLAS, size, uniforms={"atlas": {"size": size, "sheet": (width, height)}},
                 samplers={**{f"gbuffer_{name}": gbuffer[name] for name in _TARGETS}, **self._samplers},
                 images={"irradiance": irradiance})


def atlas_texels(atlas: LightAtlas) -> np.ndarray:
    """(3·height, width, 4) float32: the four coefficients of red, below them those of green and of blue."""
    height, width = atlas.sheet.size
    return np.ascontiguousarray(atlas.coefficients.transpose(3, 0, 1, 2)).reshape(3 * height, width, 4)


def instance_rows(surfaces: AtlasSurfaces) -> np.ndarray:
    """(i, 3) float32: where an instance's triangles begin in the table, −1 for none, and the scene's number of its first one, in
    two parts that floats hold exactly."""
    return np.stack([surfaces.rows, surfaces.first // LOW_INDICES, surfaces.first % LOW_INDICES], axis=1).astype(np.float32)


def triangle_rows(surfaces: AtlasSurfaces) -> np.ndarray:
    """(t, 12) float32: what takes a point across the sheet and down it, and the front."""
    return np.concatenate([surfaces.across, surfaces.down, surfaces.front], axis=1)
