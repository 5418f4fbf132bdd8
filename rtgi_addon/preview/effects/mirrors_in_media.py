"""Media along mirrored rays on the GPU: what they take, give and scatter between a mirror and what it shows.

The rays' search does it for all light but that of lamps, and leaves where each ray ended; lamps are added shadow map by shadow map,
after all rays, so that each map is drawn once. In eight steps where numpy draws one point a ray (effects/media/along.py): the means
agree.
"""

from dataclasses import replace

import gpu

from ...transport.lights.kinds import DEFINES as LAMP_KINDS
from ..device import dispatch, uniform_buffer
from ..media_textures import MediaTextures
from ..program import Image, Program
from ..programs import CAMERA, LAMP, PROFILE_DEFINES, PROFILE_TABLES, SHADOW
from ..textures import empty
from ..uniforms import UniformStruct
from .ambient_texture import AmbientTexture
from .base import GpuFrame
from .programs import EFFECT_FRAME

_PASSED = UniformStruct("PassedMedia", (("int", "media"), ("int", "ray"), ("mat4", "ambient_from_world"),
                                        ("ivec3", "ambient_resolution")))
_MEDIA = "media_table", "media_cells"

LIGHT = Program(
    "mirror_media_light",
    uniforms=(("lamp", LAMP), ("shadow", SHADOW), ("camera", CAMERA), ("frame", EFFECT_FRAME), ("passed", _PASSED)),
    samplers=("shadow_map", "gbuffer_position", "directions", "weights", "met", *_MEDIA, *PROFILE_TABLES),
    defines=(*LAMP_KINDS, *PROFILE_DEFINES), images=(Image("gathered", access="READ_WRITE"),), local_size=(8, 8))


def through_media(search: Program) -> Program:
    """The ``search`` of mirrored rays that follows media."""
    return replace(search, uniforms=(*search.uniforms, ("passed", _PASSED)), samplers=(*search.samplers, *_MEDIA, "ambient"),
                   images=(*search.images, Image("met")), defines=(*search.defines, ("IN_MEDIA", "1")))


class MirrorsInMedia:
    """Media along the rays of one picture after another, of ``size``."""

    def __init__(self, size: tuple[int, int]):
        self._size, self._media, self._ambient = size, MediaTextures(), AmbientTexture()
        self._rays: list[dict[str, gpu.types.GPUTexture]] = []

    def ray(self, frame: GpuFrame, ray: int) -> tuple[dict, dict, dict]:
        """Uniforms, samplers and images that the search for ray number ``ray`` takes besides its own, which are to hold
        ``directions`` and ``weights`` of that ray alone (see ``textures``)."""
        media, ambient = self._media.of(frame.scene.media), self._ambient.of(frame)
        passed = {"media": media.count, "ray": ray, **ambient.values}
        return {"passed": passed}, {**media.samplers, "ambient": ambient.texture}, {"met": self.textures(ray)["met"]}

    def textures(self, ray: int) -> dict[str, gpu.types.GPUTexture]:
        """``directions``, ``weights`` and ``met`` of ray number ``ray``."""
        while len(self._rays) <= ray:
            self._rays.append({name: empty(*self._size) for name in ("directions", "weights", "met")})
        return self._rays[ray]

    def add_lamps(self, frame: GpuFrame, values: dict, rays: int, gathered: gpu.types.GPUTexture) -> None:
        """Add what media scatter of lamps into each of so many ``rays`` to ``gathered``; ``values`` are those of EFFECT_FRAME."""
        media, camera = self._media.of(frame.scene.media), frame.lamps.camera(frame.view, self._size)
        passed = [uniform_buffer(_PASSED, {"media": media.count, "ray": ray, **self._ambient.values}) for ray in range(rays)]
        for lamp in frame.lamps.parts(frame.scene, frame.lamps_added, frame.drawn.surfaces, frame.drawn.bounds, frame.view,
                                      frame.index):
            for ray in range(rays):
                given = {**lamp.samplers, **media.samplers, "gbuffer_position": frame.gbuffer["position"], **self.textures(ray)}
                dispatch(LIGHT, self._size, uniforms={**lamp.uniforms, "camera": camera, "frame": values, "passed": passed[ray]},
                         samplers={name: given[name] for name in LIGHT.samplers}, images={"gathered": gathered})
