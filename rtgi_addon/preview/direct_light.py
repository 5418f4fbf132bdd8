"""The light of lamps on a G-buffer: lamp by lamp, shadow map by shadow map, each added to one texture.

Every frame sees each lamp from another of its points, so that penumbrae and the light of wide lamps settle over frames; where there
are more lamps than a frame has shadow maps, every frame has its share of them.
"""

from collections.abc import Mapping

import gpu
import numpy as np

from ..numerics.sampling import sobol_owen
from ..scene import Light, Scene, SunLight
from ..transport.lamps import LampTable
from .camera_view import CameraView
from .device import dispatch
from .ggx import energy_table
from .lamp_choice import choose_lamps, lamp_chances
from .lamp_sample import LampSample, sample_lamp
from .programs import DIRECT_LIGHT, OUTPUTS
from .settings import PreviewSettings
from .shadow_maps import ShadowMap
from .shadow_parts import shadow_parts
from .surfaces import SurfacePass
from .textures import upload

# Random numbers of a frame: three that move seams and texels, one that chooses lamps; and three of each lamp for its point.
_FRAME_SEED, _LAMP_SEED = 0x51ED, 0x1000


class DirectLight:
    """Lamps of one scene after another; the GPU keeps nothing of them but one shadow map."""

    def __init__(self, settings: PreviewSettings):
        self._settings = settings
        self._shadow_map = ShadowMap(settings.shadow_resolution)
        self._energy = upload(energy_table())
        self._lights: tuple[Light, ...] | None = None

    def draw(self, scene: Scene, surfaces: SurfacePass, bounds: np.ndarray, view: CameraView, frame: int,
             gbuffer: Mapping[str, gpu.types.GPUTexture], direct: gpu.types.GPUTexture) -> None:
        """Fill ``direct`` with what the lamps' light makes of the surfaces in ``gbuffer``, seen by ``view``: radiance
        [W·sr⁻¹·m⁻²]. ``surfaces`` within ``bounds`` (2, 3) throw the shadows; ``frame`` counts the picture's samples."""
        direct.clear(format="FLOAT", value=(0.0,) * 4)
        size = direct.width, direct.height
        pose = np.asarray(view.world_from_camera)
        camera = {"position_world": pose[:3, 3], "forward_world": -pose[:3, 2], "orthographic": int(view.orthographic),
                  "size": size}
        samplers = {"shadow_map": self._shadow_map.texture, "ggx_energy": self._energy,
                    **{f"gbuffer_{name}": gbuffer[name] for name in OUTPUTS}}
        *jitter, choice = sobol_owen(1, 4, _FRAME_SEED, start=frame, shuffle=True)[0].tolist()
        for sample in self._samples(scene, bounds, frame, choice):
            for part in shadow_parts(sample, view, bounds, self._shadow_map.resolution, self._settings.shadow_cascades, jitter):
                if part.view is not None:
                    self._shadow_map.draw(surfaces, part.view, frame)
                dispatch(DIRECT_LIGHT, size, uniforms={"lamp": sample.uniforms, "shadow": part.uniforms, "camera": camera},
                         samplers=samplers, images={"direct": direct})

    def _samples(self, scene: Scene, bounds: np.ndarray, frame: int, choice: float) -> list[LampSample]:
        if scene.lights is not self._lights:
            self._lights = scene.lights
            radius = 0.5 * float(np.linalg.norm(bounds[1] - bounds[0]))
            views = np.array([self._view_count(light, bounds) for light in scene.lights])
            self._chances = lamp_chances(LampTable(scene.lights, radius).power_estimate, views, self._settings.shadow_views)
        # A scramble and an order of its own for every lamp: as even as one lamp's, and not in step with others.
        return [sample_lamp(scene.lights[index], sobol_owen(1, 3, _LAMP_SEED + index, start=frame, shuffle=True)[0], gain)
                for index, gain in choose_lamps(self._chances, choice)]

    def _view_count(self, light: Light, bounds: np.ndarray) -> int:
        if not light.casts_shadow:
            return 1
        if isinstance(light, SunLight):
            return self._settings.shadow_cascades
        return len(sample_lamp(light, np.full(3, 0.5)).shadow_views(bounds, self._shadow_map.resolution))
