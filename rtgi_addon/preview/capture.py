"""Reflective shadow maps by rasterization: the twin of transport/reflective_shadow_map.py, `capture`.

Agrees with the rays texel by texel but where a texel's centre lies on an edge, and for coverage without a threshold, where each
throws its own coins.
"""

from dataclasses import dataclass
from weakref import WeakKeyDictionary

import gpu
import numpy as np

from ..transport.reflective_shadow_map import ReflectiveShadowMap
from ..transport.shadow_views import ShadowView, texel_power
from .device import RenderTarget
from .surfaces import SurfacePass, View, decode_primitive
from .textures import download, upload

# The surfaces of a scene stay on the GPU as long as its geometry lives: a lamp is seen from several sides, and moves.
_passes: WeakKeyDictionary = WeakKeyDictionary()


@dataclass(frozen=True, eq=False)
class CapturedTextures:
    """A reflective shadow map on the GPU, RGBA32F: ``position`` world, ``normal`` world and ``flux`` [W] as ReflectiveShadowMap has
    them, 0 where nothing is; ``power`` that the lamp sends through each texel [W], and the texel's measure."""

    view: ShadowView
    position: gpu.types.GPUTexture
    normal: gpu.types.GPUTexture
    flux: gpu.types.GPUTexture
    power: gpu.types.GPUTexture


def draw_capture(context, view: ShadowView) -> CapturedTextures:
    """Fill ``view`` by drawing the scene; the textures stay on the GPU."""
    if context.geometry not in _passes:
        _passes[context.geometry] = SurfacePass(context.scene, "rsm_capture")
    size = view.resolution
    power = np.empty((size, size, 4), np.float32)
    power[..., :3], power[..., 3] = texel_power(context.scene.lights[view.lamp], view), view.texel_measure()
    power = upload(power)
    target = RenderTarget(size, size, ("RGBA32F",) * 3, depth=True)
    with target.drawing():
        _passes[context.geometry].draw(View(view.clip_from_world, view.world_from_view, view.far, view.orthographic),
                                       {"power": power})
    return CapturedTextures(view, *target.colors, power)


def capture(context, view: ShadowView) -> ReflectiveShadowMap:
    """Fill ``view`` by drawing the scene."""
    drawn = draw_capture(context, view)
    position, normal, flux = (download(texture) for texture in (drawn.position, drawn.normal, drawn.flux))
    primitive = decode_primitive(position, normal)
    return ReflectiveShadowMap(view, *(np.ascontiguousarray(part[..., :3]) for part in (position, normal, flux)), primitive)
