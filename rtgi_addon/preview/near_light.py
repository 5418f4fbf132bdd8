"""What emissive surfaces give others close by, pixel by pixel: the GPU's half of techniques/lattice/near_light.py.

Irradiance of a pane is its closed form, as far as one of its points sees the pixel, another in every frame; in penumbrae of things
that stand close to a large pane this is not quite what rays find, for all its points count alike.
"""

from collections.abc import Mapping

import gpu
import numpy as np

from ..numerics.sampling import sobol_owen
from ..scene import Scene
from ..techniques.lattice.near_light import NearLight
from ..transport.lights.shadow_view import Placed, ShadowView, look_along, pinhole, side_views
from ..transport.vectors import luminance
from .device import dispatch
from .lamp_choice import choose_lamps, lamp_chances
from .programs import NEAR_LIGHT
from .settings import PreviewSettings
from .shadow_maps import ShadowMap
from .shadow_parts import ShadowPart
from .surfaces import SurfacePass

# Random numbers of a frame, of which one chooses panes, and of each pane for its point.
_FRAME_SEED, _PANE_SEED = 0x51EE, 0x4000
# Shadow maps of a pane: all that is before its plane.
_VIEWS = 5
_TARGETS = ("position", "normal", "geometry")


class NearPass:
    """The panes of ``near`` on a G-buffer, frame by frame. Main thread only."""

    def __init__(self, near: NearLight, settings: PreviewSettings):
        self.near, self._shadow_map = near, ShadowMap(settings.shadow_resolution)
        panes = near.panes
        power = panes.areas.sum(axis=1) * luminance(panes.radiance)
        self._chances = lamp_chances(power, np.full(panes.count, _VIEWS), settings.shadow_views)

    def draw(self, scene: Scene, surfaces: SurfacePass, bounds: np.ndarray, frame: int,
             gbuffer: Mapping[str, gpu.types.GPUTexture], irradiance: gpu.types.GPUTexture) -> None:
        """Add to ``irradiance`` [W·m⁻²] what the panes give the surfaces in ``gbuffer``. ``surfaces`` of ``scene`` within
        ``bounds`` (2, 3) throw the shadows; ``frame`` counts the picture's samples."""
        choice = sobol_owen(1, 1, _FRAME_SEED, start=frame, shuffle=True)[0, 0]
        among = np.array([instance.visible_shadow for instance in scene.instances], bool)
        samplers = {"shadow_map": self._shadow_map.texture, **{f"gbuffer_{name}": gbuffer[name] for name in _TARGETS}}
        for index, gain in choose_lamps(self._chances, float(choice)):
            u = sobol_owen(1, 3, _PANE_SEED + index, start=frame, shuffle=True)[0]
            pane, views = pane_views(self.near, index, u, bounds, self._shadow_map.resolution)
            pane = {**pane, "radiance": gain * pane["radiance"], "width": irradiance.width, "height": irradiance.height}
            for view in views:
                self._shadow_map.draw(surfaces, view, frame, among)
                dispatch(NEAR_LIGHT, (irradiance.width, irradiance.height), samplers=samplers, images={"irradiance": irradiance},
                         uniforms={"pane": pane, "shadow": ShadowPart(view, outside_lit=False).uniforms})


def pane_views(near: NearLight, index: int, u: np.ndarray, bounds: np.ndarray, resolution: int) -> tuple[dict, list[ShadowView]]:
    """Values of the struct of a pane with its point for ``u`` (3,) in [0, 1), and the views from there."""
    panes = near.panes
    areas = panes.areas[index]
    half = int(u[0] * areas.sum() >= areas[0] and areas[1] > 0)
    a, b, c = panes.triangles[index, half]
    root = np.sqrt(u[1])
    point = a * (1.0 - root) + b * (root * (1.0 - u[2])) + c * (root * u[2])
    front = look_along(panes.normals[index], panes.corners[index, 1] - panes.corners[index, 0])
    placed: list[Placed] = [pinhole(front, point, bounds), *side_views(front, point, bounds)]
    corners = np.zeros((4, 4))
    corners[:, :3] = panes.corners[index]
    values = {"corners": corners, "normal": panes.normals[index], "area": areas.sum(), "radiance": panes.radiance[index],
              "point": point}
    return values, [ShadowView(0, face, view.world_from_view, view.clip_from_view, view.orthographic, resolution, view.near,
                               view.far, view.share) for face, view in enumerate(placed)]
