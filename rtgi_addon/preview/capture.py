"""Reflective shadow maps by rasterization: the twin of transport/views/reflective_shadow_map.py, `capture`.

Agrees with the rays texel by texel but where a texel's centre lies on an edge, and for coverage without a threshold, where each
throws its own coins.
"""

from dataclasses import dataclass
from weakref import WeakKeyDictionary

import gpu
import numpy as np

from ..scene import Light, Medium, Scene
from ..transport.lights.kinds import kind_of
from ..transport.lights.shadow_view import ShadowView
from ..transport.media.tracer import in_shadow
from ..transport.views.camera import View
from ..transport.views.drawn_instances import lit_by, met_by
from ..transport.views.gbuffer import decode_primitive
from ..transport.views.reflective_shadow_map import ReflectiveShadowMap
from ..transport.views.shadow_views import texel_power
from .device import RenderTarget, dispatch
from .lamp_tables import LampTables
from .media_textures import MediaTextures
from .packing import instance_switch
from .programs import MAP_IN_MEDIA
from .surfaces import SurfacePass
from .textures import download, empty, upload

# The surfaces of a scene stay on the GPU as long as its geometry lives: a lamp is seen from several sides, and moves.
_passes: WeakKeyDictionary = WeakKeyDictionary()
_media = MediaTextures()


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
    size, light = view.resolution, drawn.scene.lights[view.lamp]
    power = np.empty((size, size, 4), np.float32)
    power[..., :3], power[..., 3] = texel_power(light, view), view.texel_measure()
    power, lit = upload(power), upload(instance_switch(lit_by(drawn.scene, light)))
    target = RenderTarget(size, size, ("RGBA32F",) * 3, depth=True)
    with target.drawing():
        if drawn.surfaces is not None:
            samplers = {"power": power, "lit_instances": lit, "lamp_distances": LampTables().of(light)["lamp_distances"]}
            drawn.surfaces.draw(View(view.clip_from_world, view.world_from_view, view.far, view.orthographic), samplers,
                                name="rsm_capture", among=met_by(drawn.scene, light))
    position, normal, flux = target.colors
    media = tuple(medium for medium in drawn.scene.media if in_shadow(medium))
    if light.casts_shadow and media:
        flux = _left_by_media(view, light, media, position, flux)
    return CapturedTextures(view, position, normal, flux, power)


def _left_by_media(view: ShadowView, light: Light, media: tuple[Medium, ...], position, flux) -> gpu.types.GPUTexture:
    """``flux`` after its way through ``media``."""
    textures, size = _media.of(media), (view.resolution, view.resolution)
    left = empty(*size)
    dispatch(MAP_IN_MEDIA, size, uniforms={"parameters": {
        "eye": view.position_world, "orthographic": int(view.orthographic), "forward": -view.world_from_view[:3, 2],
        "distant": int(kind_of(light).is_distant), "size": size, "media": textures.count}},
        samplers={"map_position": position, "map_flux": flux, **textures.samplers}, images={"left": left})
    return left


def capture(context, view: ShadowView) -> ReflectiveShadowMap:
    """Fill ``view`` by drawing the scene."""
    if context.geometry not in _passes:
        _passes[context.geometry] = SurfacePass(context.scene, "rsm_capture")
    bounds = np.array(context.geometry.bounds(), np.float64)
    drawn = draw_capture(Drawn(context.scene, _passes[context.geometry], bounds), view)
    position, normal, flux = (download(texture) for texture in (drawn.position, drawn.normal, drawn.flux))
    primitive = decode_primitive(position, normal)
    return ReflectiveShadowMap(view, *(np.ascontiguousarray(part[..., :3]) for part in (position, normal, flux)), primitive)
