"""Reflective shadow maps by rasterization: the twin of transport/reflective_shadow_map.py, `capture`.

Agrees with the rays texel by texel but where a texel's centre lies on an edge, and for coverage without a threshold, where each
throws its own coins.
"""

from dataclasses import dataclass
from weakref import WeakKeyDictionary

import gpu
import numpy as np

from ..scene import Scene
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


@dataclass(frozen=True, eq=False)
class Drawn:
    """A scene as it is on the GPU: its ``surfaces`` (None if it has none), of a pass that reads at least what "rsm_capture" does,
    within ``bounds`` (2, 3) float64."""

    scene: Scene
    surfaces: SurfacePass | None
    bounds: np.ndarray


def draw_capture(drawn: Drawn, view: ShadowView) -> CapturedTextures:
    """Fill ``view`` by drawing the scene; the textures stay on the GPU."""
    size = view.resolution
    power = np.empty((size, size, 4), np.float32)
    power[..., :3], power[..., 3] = texel_power(drawn.scene.lights[view.lamp], view), view.texel_measure()
    power = upload(power)
    target = RenderTarget(size, size, ("RGBA32F",) * 3, depth=True)
    with target.drawing():
        if drawn.surfaces is not None:
            drawn.surfaces.draw(View(view.clip_from_world, view.world_from_view, view.far, view.orthographic), {"power": power},
                                name="rsm_capture")
    return CapturedTextures(view, *target.colors, power)


def capture(context, view: ShadowView) -> ReflectiveShadowMap:
    """Fill ``view`` by drawing the scene."""
    if context.geometry not in _passes:
        _passes[context.geometry] = SurfacePass(context.scene, "rsm_capture")
    bounds = np.array(context.geometry.bounds(), np.float64)
    drawn = draw_capture(Drawn(context.scene, _passes[context.geometry], bounds), view)
    position, normal, flux = (download(texture) for texture in (drawn.position, drawn.normal, drawn.flux))
    primitive = decode_primitive(position, normal)
    return ReflectiveShadowMap(view, *(np.ascontiguousarray(part[..., :3]) for part in (position, normal, flux)), primitive)
