"""The light of lamps on a G-buffer: lamp by lamp, shadow map by shadow map, each added to one texture.

Every frame sees each lamp from another of its points, so that penumbrae and the light of wide lamps settle over frames; where there
are more lamps than a frame has shadow maps, every frame has its share of them.
"""

from collections.abc import Iterator, Mapping
from typing import NamedTuple
from weakref import WeakKeyDictionary

import gpu
import numpy as np

from ..numerics.sampling import sobol_owen
from ..scene import Light, Scene
from ..transport.lights.kinds import kind_of
from ..transport.lights.lamps import LampTable
from ..transport.surfaces.ggx import energy_table
from ..transport.views.camera import CameraView
from ..transport.views.drawn_instances import in_the_way, lit_by
from ..transport.views.gbuffer import GBUFFER
from .device import dispatch
from .lamp_choice import choose_lamps, lamp_chances
from .lamp_sample import LampSample, sample_lamp
from .lamp_tables import LampTables
from .media_textures import MediaTextures
from .packing import instance_switch
from .programs import DIRECT_LIGHT, DIRECT_LIGHT_IN_MEDIA
from .settings import PreviewSettings
from .shadow_maps import ShadowMap
from .shadow_parts import ShadowPart, shadow_parts
from .surfaces import SurfacePass
from .textures import upload

# Random numbers of a frame: three that move seams and texels, one that chooses lamps; and three of each lamp for its point.
_FRAME_SEED, _LAMP_SEED = 0x51ED, 0x1000


class LampPart(NamedTuple):
    """A lamp's point with one of its shadow maps, drawn: ``uniforms`` by the structs LAMP and SHADOW, and ``samplers``."""

    uniforms: dict
    samplers: dict[str, gpu.types.GPUTexture]


class DirectLight:
    """Lamps of one scene after another; the GPU keeps nothing of them but one shadow map."""

    def __init__(self, settings: PreviewSettings):
        self._settings = settings
        self._shadow_map = ShadowMap(settings.shadow_resolution)
        self._energy = upload(energy_table())
        self._tables = LampTables()
        self._media = MediaTextures()
        self._lights: tuple[Light, ...] | None = None
        # By lamp, as long as these instances are shown: which of them cast its shadows, and which it lights.
        self._instances, self._links = None, WeakKeyDictionary()

    def draw(self, scene: Scene, lights: tuple[Light, ...], surfaces: SurfacePass, bounds: np.ndarray, view: CameraView, frame: int,
             gbuffer: Mapping[str, gpu.types.GPUTexture], direct: gpu.types.GPUTexture) -> None:
        """Fill ``direct`` with what the light of ``lights``, of ``scene``, makes of the surfaces in ``gbuffer``, seen by ``view``:
        radiance [W·sr⁻¹·m⁻²], and the luminance of the irradiance in its fourth component. ``surfaces`` within ``bounds`` (2, 3)
        throw the shadows; ``frame`` counts the picture's samples."""
        direct.clear(format="FLOAT", value=(0.0,) * 4)
        size = direct.width, direct.height
        samplers = {"ggx_energy": self._energy, **{f"gbuffer_{name}": gbuffer[name] for name in GBUFFER}}
        program, media = DIRECT_LIGHT, {"count": 0}
        if scene.media:
            textures = self._media.of(scene.media)
            program, media["count"] = DIRECT_LIGHT_IN_MEDIA, textures.count
            samplers.update(textures.samplers)
        for lamp in self.parts(scene, lights, surfaces, bounds, view, frame):
            uniforms = {**lamp.uniforms, "camera": self.camera(view, size), "media": media}
            dispatch(program, size, uniforms=uniforms, samplers={**samplers, **lamp.samplers}, images={"direct": direct})

    @staticmethod
    def camera(view: CameraView, size: tuple[int, int]) -> dict:
        """Values of the struct CAMERA."""
        pose = np.asarray(view.world_from_camera)
        return {"position_world": pose[:3, 3], "forward_world": -pose[:3, 2], "orthographic": int(view.orthographic), "size": size}

    def parts(self, scene: Scene, lights: tuple[Light, ...], surfaces: SurfacePass | None, bounds: np.ndarray, view: CameraView,
              frame: int) -> Iterator[LampPart]:
        """What of ``lights`` a frame is lit by, shadow map by shadow map: each map is drawn when its part is asked for, and gives
        way to the next one. ``surfaces`` None throw none."""
        *jitter, choice = sobol_owen(1, 4, _FRAME_SEED, start=frame, shuffle=True)[0].tolist()
        # Nothing has no size, and lamps must be compared with one another all the same.
        bounds = bounds if surfaces is not None else bounds + np.array([[-1.0], [1.0]])
        for sample in self._samples(lights, bounds, frame, choice):
            shadowing, lit = self._concerned(scene, sample.light)
            samplers = {"shadow_map": self._shadow_map.texture, "lit_instances": lit, **self._tables.of(sample.light)}
            if surfaces is None:
                self._shadow_map.texture.clear(format="FLOAT", value=(0.0,))
                shadow = {**ShadowPart(None).uniforms, "casts_shadow": int(sample.light.casts_shadow)}
                yield LampPart({"lamp": sample.uniforms, "shadow": shadow}, samplers)
                continue
            for part in shadow_parts(sample, view, bounds, self._shadow_map.resolution, self._settings.shadow_cascades, jitter):
                if part.view is not None:
                    self._shadow_map.draw(surfaces, part.view, frame, shadowing)
                yield LampPart({"lamp": sample.uniforms, "shadow": part.uniforms}, samplers)

    def _samples(self, lights: tuple[Light, ...], bounds: np.ndarray, frame: int, choice: float) -> list[LampSample]:
        if not _same(lights, self._lights):
            self._lights = lights
            self._tables.keep(lights)
            radius = 0.5 * float(np.linalg.norm(bounds[1] - bounds[0]))
            views = np.array([self._view_count(light, bounds) for light in lights])
            self._chances = lamp_chances(LampTable(lights, radius).power_estimate, views, self._settings.shadow_views)
        # A scramble and an order of its own for every lamp: as even as one lamp's, and not in step with others.
        return [sample_lamp(lights[index], sobol_owen(1, 3, _LAMP_SEED + index, start=frame, shuffle=True)[0], gain)
                for index, gain in choose_lamps(self._chances, choice)]

    def _concerned(self, scene: Scene, light: Light) -> tuple[np.ndarray, gpu.types.GPUTexture]:
        if scene.instances is not self._instances:
            self._instances, self._links = scene.instances, WeakKeyDictionary()
        if light not in self._links:
            self._links[light] = in_the_way(scene, light), upload(instance_switch(lit_by(scene, light)))
        return self._links[light]

    def _view_count(self, light: Light, bounds: np.ndarray) -> int:
        if not light.casts_shadow:
            return 1
        if kind_of(light).is_distant:
            return self._settings.shadow_cascades
        return len(sample_lamp(light, np.full(3, 0.5)).shadow_views(bounds, self._shadow_map.resolution))


def _same(one: tuple[Light, ...], other: tuple[Light, ...] | None) -> bool:
    """True if both hold the very same lamps, which are frozen."""
    return other is not None and len(one) == len(other) and all(a is b for a, b in zip(one, other, strict=True))
