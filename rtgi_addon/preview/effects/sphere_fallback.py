"""Sphere probes behind screen-space reflections: the pass that lays what they saw over the fallback of mirrored rays."""

from functools import cache

import gpu

from ...effects.spheres.maps import RAY_SHARE, SphereProbes
from ..device import dispatch
from ..program import Image, Program
from ..sphere_textures import MEMBERS, SAMPLERS, SphereTextures, sphere_constants
from ..uniforms import UniformStruct

_SPHERES = UniformStruct("SphereFallback", (("ivec2", "size"), *MEMBERS, ("float", "ray_share")))


@cache
def sphere_program(defines: tuple[tuple[str, str], ...]) -> Program:
    """The program for as many probes of such maps as ``defines`` (sphere_textures.sphere_constants) say."""
    return Program("mirror_spheres", uniforms=(("spheres", _SPHERES),),
                   samplers=("gbuffer_position", "directions", "weights", "fallback", *SAMPLERS),
                   images=(Image("result"),), local_size=(8, 8), defines=defines)


class SphereFallback:
    """``spheres`` on the GPU: main thread only."""

    def __init__(self, spheres: SphereProbes):
        self.spheres = spheres
        self._program, self._textures = sphere_program(sphere_constants(spheres)), SphereTextures(spheres)

    def draw(self, position: gpu.types.GPUTexture, directions: gpu.types.GPUTexture, weights: gpu.types.GPUTexture,
             fallback: gpu.types.GPUTexture, result: gpu.types.GPUTexture) -> None:
        """Write to ``result`` what ``fallback`` [W·m⁻² across the rays] becomes for rays from ``position`` along ``directions``."""
        size = result.width, result.height
        dispatch(self._program, size, uniforms={"spheres": {"size": size, **self._textures.values, "ray_share": RAY_SHARE}},
                 samplers={"gbuffer_position": position, "directions": directions, "weights": weights, "fallback": fallback,
                           **self._textures.samplers}, images={"result": result})
