"""The preview's pictures: G-buffer, direct light through shadow maps, indirect light of a field, averaged over jittered frames."""

import gpu
import numpy as np

from ..numerics.sampling import sobol_owen
from ..scene import Instance, Light, Mesh, Scene
from ..techniques.base import Field, validate_settings
from .camera_view import CameraView
from .device import dispatch
from .film import Background, Film
from .gbuffer import GBuffer, gbuffer_surfaces
from .ggx import energy_table
from .indirect import make_indirect
from .indirect_pass import Indirect, draw_indirect
from .lamp_sample import sample_lamp
from .materials import Images
from .pixel_filter import filter_offset
from .programs import DIRECT_LIGHT, OUTPUTS
from .settings import PASSES, PreviewSettings
from .shadow_maps import ShadowMap, shadow_parts
from .surfaces import SurfacePass
from .textures import download, empty, upload

# Dimensions of a frame's random numbers: two of the pixel filter, three of a shadow map's place; then three for every lamp.
_FRAME_DIMENSIONS, _LAMP_DIMENSIONS = 5, 3


class PreviewRenderer:
    """Renders ``scene`` with the indirect light of ``field`` (None: the world's own, unshadowed). All of it is GPU work: main
    thread only. ``passes`` of PASSES are what frames are kept of.
    """

    def __init__(self, scene: Scene, field: Field | None = None, settings: PreviewSettings | None = None,
                 passes: tuple[str, ...] = PASSES):
        self.settings = settings or PreviewSettings()
        validate_settings(self.settings)
        self.scene, self.field, self._passes = scene, field, tuple(passes)
        self._images = Images()
        self._surfaces = _surfaces(scene, self._images)
        self._bounds = scene_bounds(scene)
        self._background = Background(scene.world)
        self._ggx_energy = upload(energy_table())
        self._indirect: Indirect = make_indirect(field, scene)
        self._gbuffer: GBuffer | None = None
        self._film: Film | None = None
        self._shadow_map: ShadowMap | None = None
        self._view: CameraView | None = None

    @property
    def samples(self) -> int:
        """How many frames the picture is the mean of."""
        return 0 if self._film is None else self._film.samples

    @property
    def busy(self) -> bool:
        """True while a worker makes light that a later frame will begin anew with."""
        return self._indirect.busy

    @property
    def size(self) -> tuple[int, int]:
        """Width and height [pixels] of the picture, after the resolution scale."""
        return (0, 0) if self._film is None else self._film.size

    @property
    def textures(self) -> dict[str, gpu.types.GPUTexture]:
        """Every pass as RGBA32F, scene-linear, row 0 at the bottom; empty before the first frame."""
        return {} if self._film is None else self._film.textures

    def image(self, name: str) -> np.ndarray:
        """A pass as (h, w, 4) float32, row 0 at the bottom."""
        return download(self.textures[name])

    def reset(self) -> None:
        """Begin the picture anew with the next frame."""
        if self._film is not None:
            self._film.samples = 0

    def update(self, scene: Scene) -> None:
        """Show ``scene`` from now on. What is the same object as before stays on the GPU; what has moved is sent."""
        before, self.scene = self.scene, scene
        if before is scene:
            return
        if scene.world is not before.world:
            self._background = Background(scene.world)
        if not (_same(before.meshes, scene.meshes) and _same(before.materials, scene.materials)
                and self._surfaces is not None and self._surfaces.can_move(scene)):
            self._surfaces = _surfaces(scene, self._images)
            self._bounds = scene_bounds(scene)
        elif not _same(before.instances, scene.instances):
            self._surfaces.move(scene)
            self._bounds = scene_bounds(scene)
        self._indirect.follow(scene)
        self.reset()

    def frame(self, view: CameraView, size: tuple[int, int]) -> None:
        """Average one more sample of ``view`` in, at ``size`` (width, height) pixels before the resolution scale; another view or
        size begins anew."""
        scaled = tuple(max(1, round(side * self.settings.resolution_scale)) for side in size)
        if self._film is None or self._film.size != scaled:
            self._allocate(scaled)
        if self._indirect.update():
            self.reset()
        if not view.equals(self._view):
            self._view = view
            self.reset()
        index = self._film.samples
        numbers = _frame_numbers(index)
        offset = filter_offset(numbers[:2]) if index else np.zeros(2)
        self._gbuffer.draw(self._surfaces, view.drawn(scaled, offset, index))
        inputs = {**self._gbuffer.textures, "direct": self._direct, "irradiance": self._irradiance}
        self._light(view, inputs, index, numbers[2:])
        draw_indirect(self._indirect, inputs, self._irradiance)
        self._film.add(view, offset, inputs, self._background, self.settings.film_transparent)

    def _allocate(self, size: tuple[int, int]) -> None:
        self._film = Film(size, self._passes)
        self._gbuffer = GBuffer(*size)
        self._direct, self._irradiance = empty(*size), empty(*size)

    def _light(self, view: CameraView, inputs, index: int, jitter: np.ndarray) -> None:
        """Fill the texture of direct light: lamp by lamp, map by map."""
        self._direct.clear(format="FLOAT", value=(0.0,) * 4)
        if self._surfaces is None:
            return
        resolution = self.settings.shadow_resolution
        if self._shadow_map is None or self._shadow_map.resolution != resolution:
            self._shadow_map = ShadowMap(resolution)
        size = self._film.size
        pose = np.asarray(view.world_from_camera)
        camera = {"position_world": pose[:3, 3], "forward_world": -pose[:3, 2], "orthographic": int(view.orthographic),
                  "size": size}
        gbuffer = {f"gbuffer_{name}": inputs[name] for name in OUTPUTS}
        for number, light in enumerate(self.scene.lights):
            sample = sample_lamp(light, _lamp_numbers(index, number))
            for part in shadow_parts(sample, view, self._bounds, resolution, self.settings.shadow_cascades, jitter):
                if part.view is not None:
                    self._shadow_map.draw(self._surfaces, part.view, index)
                dispatch(DIRECT_LIGHT, size, uniforms={"lamp": sample.uniforms, "shadow": part.uniforms, "camera": camera},
                         samplers={"shadow_map": self._shadow_map.texture, "ggx_energy": self._ggx_energy, **gbuffer}, images={"direct": self._direct})


def scene_bounds(scene: Scene) -> np.ndarray:
    """Lowest and highest corner (2, 3) float64 of boxes around all instances."""
    boxes = [_box(mesh) for mesh in scene.meshes]
    corners = [np.zeros((1, 3))]
    for instance in scene.instances:
        if boxes[instance.mesh] is not None:
            matrix = np.asarray(instance.world_from_local, np.float64)
            corners.append(boxes[instance.mesh] @ matrix[:3, :3].T + matrix[:3, 3])
    points = np.concatenate(corners[1:] or corners)
    return np.array([points.min(axis=0), points.max(axis=0)])


def _box(mesh: Mesh) -> np.ndarray | None:
    if not len(mesh.vertices_local):
        return None
    ends = np.array([mesh.vertices_local.min(axis=0), mesh.vertices_local.max(axis=0)], np.float64)
    return np.stack(np.meshgrid(*ends.T, indexing="ij"), axis=-1).reshape(-1, 3)


def _surfaces(scene: Scene, images: Images) -> SurfacePass | None:
    return gbuffer_surfaces(scene, images) if any(len(scene.meshes[item.mesh].triangles) for item in scene.instances) else None


def _same(before: tuple[Mesh | Instance | Light, ...], after: tuple) -> bool:
    """True if both hold the very same objects, which are frozen."""
    return len(before) == len(after) and all(a is b for a, b in zip(before, after, strict=True))


def _frame_numbers(index: int) -> np.ndarray:
    return sobol_owen(1, _FRAME_DIMENSIONS, 0, start=index)[0]


def _lamp_numbers(index: int, lamp: int) -> np.ndarray:
    # A scramble of its own for every lamp: their points are as even as one lamp's, and not in step.
    return sobol_owen(1, _LAMP_DIMENSIONS, lamp + 1, start=index)[0]
