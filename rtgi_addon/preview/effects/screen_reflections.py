"""Screen-space reflections on the GPU: the twin of effects/screen_reflections, pass by pass. The fallback is the technique's own
look-up, asked about surfaces that face each mirrored ray."""

import gpu

from ...effects import Chosen
from ...effects.frame import NOWHERE
from ...effects.screen_reflections import LEAST_WEIGHT, SEARCHES
from ...effects.screen_reflections.pyramid import atlas_places
from ...effects.screen_reflections.rays import shift_of
from ...effects.screen_reflections.search import BISECTIONS
from ...transport.surfaces.ggx import energy_table
from ...transport.views.gbuffer import GBUFFER
from ..device import dispatch
from ..indirect_pass import draw_indirect
from ..program import Image, Program
from ..textures import empty, upload
from ..uniforms import UniformStruct
from .base import GpuFrame
from .mirrors_in_media import MirrorsInMedia, through_media
from .programs import EFFECT_FRAME, frame_values
from .sphere_fallback import SphereFallback

_GROUP = (8, 8)
_SURFACE = tuple(f"gbuffer_{name}" for name in GBUFFER)
_NOWHERE = ("NOWHERE", repr(NOWHERE))
_LEAST = ("LEAST_WEIGHT", repr(float(LEAST_WEIGHT)))
# Left edges of the pyramid's levels, four a vector: enough for textures of 65,536 pixels.
_VECTORS = 4
_MIRRORS = UniformStruct("ScreenMirrors", (
    ("ivec4", "lefts", _VECTORS), ("float", "near"), ("float", "distance"), ("float", "thickness"), ("float", "border"),
    ("float", "max_roughness"), ("float", "jitter"), ("int", "steps"), ("int", "top"), ("int", "search"), ("int", "first")))

RAYS = Program("mirror_rays", uniforms=(("frame", EFFECT_FRAME), ("ray", UniformStruct("MirrorRay", (("vec2", "shift"),)))),
               samplers=(*_SURFACE, "ggx_energy"), images=(Image("directions"), Image("weights")), local_size=_GROUP,
               defines=(_LEAST,))
DEPTH = Program("view_depth", uniforms=(("frame", EFFECT_FRAME),), samplers=("gbuffer_position", "gbuffer_normal"),
                images=(Image("depth", "R32F"),), local_size=_GROUP, defines=(_NOWHERE,))
LEAST = Program("least_depth", samplers=("below",), images=(Image("level", "R32F"),), local_size=_GROUP, defines=(_NOWHERE,))
PLACE = Program("place_level", uniforms=(("place", UniformStruct("LevelPlace", (("int", "left"),))),), samplers=("level",),
                images=(Image("atlas", "R32F"),), local_size=_GROUP)
SEARCH = Program("mirror_search", uniforms=(("frame", EFFECT_FRAME), ("mirrors", _MIRRORS)),
                 samplers=("gbuffer_position", "gbuffer_geometry", "directions", "weights", "fallback", "light", "depth",
                           "pyramid"),
                 images=(Image("gathered", access="READ_WRITE"), Image("carrying", access="READ_WRITE")), local_size=_GROUP,
                 defines=(_NOWHERE, _LEAST, ("BISECTIONS", str(BISECTIONS))))
SEARCH_IN_MEDIA = through_media(SEARCH)
PICTURE = Program("mirror_picture",
                  uniforms=(("frame", EFFECT_FRAME), ("picture", UniformStruct("MirrorPicture", (("int", "rays"),)))),
                  samplers=(*_SURFACE, "ggx_energy", "gathered", "carrying", "light", "indirect_irradiance"),
                  images=(Image("result"), Image("mirror_confidence"), Image("mirror_distance")), local_size=_GROUP)


class ScreenReflectionsHalf:
    """See Half. Textures are kept for pictures of the same size."""

    def __init__(self, chosen: Chosen):
        self.chosen = chosen
        self.passes: dict[str, gpu.types.GPUTexture] = {}
        self._size: tuple[int, int] | None = None
        self._energy = upload(energy_table())
        self._spheres: SphereFallback | None = None

    def draw(self, frame: GpuFrame) -> gpu.types.GPUTexture:
        """See Half."""
        if self._size != tuple(frame.size):
            self._allocate(tuple(frame.size))
        settings, size = self.chosen.settings, self._size
        values = frame_values(frame.view, size, frame.index, frame.offset, frame.transparent, frame.background.map_from_world)
        surface = {f"gbuffer_{name}": frame.gbuffer[name] for name in GBUFFER}
        shared = {**surface, "ggx_energy": self._energy, "light": frame.light}
        self._draw_pyramid(values, surface)
        search, media = (SEARCH_IN_MEDIA, self._in_media) if frame.scene.media else (SEARCH, None)
        for ray in range(settings.rays):
            shift = shift_of(frame.index, ray, settings.rays)
            uniforms, samplers, images = ({}, {}, {}) if media is None else media.ray(frame, ray)
            kept = {"directions": self._directions, "weights": self._weights} if media is None else media.textures(ray)
            dispatch(RAYS, size, uniforms={"frame": values, "ray": {"shift": shift}},
                     samplers={name: shared[name] for name in RAYS.samplers},
                     images={image.name: kept[image.name] for image in RAYS.images})
            draw_indirect(frame.indirect, {"position": frame.gbuffer["position"], "normal": kept["directions"]}, self._fallback)
            given = {**shared, **kept, **samplers, "fallback": self._behind(frame, kept), "depth": self._depth,
                     "pyramid": self._pyramid}
            dispatch(search, size, uniforms={"frame": values, "mirrors": self._mirrors(frame, ray, shift), **uniforms},
                     samplers={name: given[name] for name in search.samplers},
                     images={"gathered": self._gathered, "carrying": self._carrying, **images})
        if media is not None:
            media.add_lamps(frame, values, settings.rays, self._gathered)
        given = {**shared, "gathered": self._gathered, "carrying": self._carrying, "indirect_irradiance": frame.irradiance}
        dispatch(PICTURE, size, uniforms={"frame": values, "picture": {"rays": settings.rays}},
                 samplers={name: given[name] for name in PICTURE.samplers}, images={"result": self._result, **self.passes})
        return self._result

    def _behind(self, frame: GpuFrame, kept: dict) -> gpu.types.GPUTexture:
        """The fallback of the rays that are ``kept``: the bake's light, under what sphere probes saw."""
        if frame.spheres is None:
            return self._fallback
        if self._spheres is None or self._spheres.spheres is not frame.spheres:
            self._spheres = SphereFallback(frame.spheres)
        self._spheres.draw(frame.gbuffer["position"], kept["directions"], kept["weights"], self._fallback, self._under)
        return self._under

    def _mirrors(self, frame: GpuFrame, ray: int, shift) -> dict:
        settings, lefts = self.chosen.settings, [left for left, _, _ in self._places]
        lefts = lefts + [0] * (4 * _VECTORS - len(lefts))
        return {"lefts": [lefts[4 * i:4 * i + 4] for i in range(_VECTORS)], "near": frame.view.depths[0],
                "distance": settings.distance, "thickness": settings.thickness, "border": settings.border,
                "max_roughness": settings.max_roughness, "jitter": 1.0 - float(shift[0]), "steps": settings.steps,
                "top": len(self._places), "search": SEARCHES.index(settings.search), "first": int(ray == 0)}

    def _draw_pyramid(self, values: dict, surface: dict) -> None:
        dispatch(DEPTH, self._size, uniforms={"frame": values}, samplers={name: surface[name] for name in DEPTH.samplers},
                 images={"depth": self._depth})
        below = self._depth
        for (left, width, height), level in zip(self._places, self._levels, strict=True):
            dispatch(LEAST, (width, height), uniforms={}, samplers={"below": below}, images={"level": level})
            dispatch(PLACE, (width, height), uniforms={"place": {"left": left}}, samplers={"level": level},
                     images={"atlas": self._pyramid})
            below = level

    def _allocate(self, size: tuple[int, int]) -> None:
        self._size, self._places = size, atlas_places(size)
        self._depth = empty(*size, "R32F")
        self._levels = [empty(width, height, "R32F") for _, width, height in self._places]
        across = sum(width for _, width, _ in self._places)
        self._pyramid = empty(max(across, 1), (size[1] + 1) // 2, "R32F")
        self._directions, self._weights, self._fallback, self._under, self._gathered, self._carrying, self._result = (
            empty(*size) for _ in range(7))
        self._in_media = MirrorsInMedia(size)
        self.passes = {name: empty(*size) for name in self.chosen.effect.passes}


HALF = ScreenReflectionsHalf
