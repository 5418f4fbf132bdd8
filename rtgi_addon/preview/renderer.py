"""The preview's pictures: G-buffer, direct light through shadow maps, indirect light of a field, averaged over jittered frames."""

from dataclasses import replace

import gpu
import numpy as np

from ..numerics.sampling import sobol_owen
from ..scene import Instance, Material, Mesh, Scene
from ..techniques.base import Field, validate_settings
from .camera_view import CameraView
from .capture import Drawn
from .direct_light import DirectLight
from .film import Background, Film
from .gbuffer import GBuffer, gbuffer_surfaces
from .indirect import FRAME_SAMPLES, make_indirect
from .indirect_pass import Indirect, draw_indirect
from .materials import Images
from .pixel_filter import filter_offset
from .settings import PASSES, PreviewSettings
from .surfaces import SurfacePass
from .textures import download, empty

_FILTER_SEED = 0


class PreviewRenderer:
    """Renders ``scene`` with the indirect light of ``field``; None: what ``live``, the settings of a technique that needs no bake,
    makes of what is drawn, else the world's own, unshadowed. All of it is GPU work: main thread only. ``passes`` of PASSES are
    what frames are kept of. ``baked`` is the scene that ``field`` was baked from (None: ``scene``): its geometry goes on
    reflecting when lamps move, in techniques that cannot do without a bake. Their ``scene`` must begin with the lamps and the
    world of the bake.
    """

    def __init__(self, scene: Scene, field: Field | None = None, settings: PreviewSettings | None = None,
                 passes: tuple[str, ...] = PASSES, baked: Scene | None = None, live=None):
        self.settings = settings or PreviewSettings()
        validate_settings(self.settings)
        self.scene, self.field, self._passes = scene, field, tuple(passes)
        self._images = Images()
        self._surfaces = _surfaces(scene, self._images)
        self._bounds = scene_bounds(scene)
        self._background = Background(scene.world)
        self._lamps = DirectLight(self.settings)
        self._baked = baked or scene
        self._indirect: Indirect = make_indirect(field, self._baked, samples=FRAME_SAMPLES, live=live)
        if self._indirect.captures and (field is None or self._baked is not scene):
            self._capture()
        self._gbuffer: GBuffer | None = None
        self._film: Film | None = None
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
    def error(self) -> str:
        """Why indirect light does not follow the scene any more, or nothing."""
        return self._indirect.error or ""

    def close(self) -> None:
        """Stop workers; this renderer is not used again."""
        self._indirect.close()

    @property
    def size(self) -> tuple[int, int]:
        """Width and height [pixels] of the picture, after the resolution scale."""
        return (0, 0) if self._film is None else self._film.size

    @property
    def textures(self) -> dict[str, gpu.types.GPUTexture]:
        """Every pass as RGBA32F, scene-linear, row 0 at the bottom; empty before the first frame."""
        return {} if self._film is None else self._film.textures

    @property
    def gbuffer(self) -> dict[str, gpu.types.GPUTexture]:
        """The surfaces of the latest sample (gbuffer.GBuffer.textures); empty before the first frame."""
        return {} if self._gbuffer is None else self._gbuffer.textures

    def image(self, name: str) -> np.ndarray:
        """A pass as (h, w, 4) float32, row 0 at the bottom."""
        return download(self.textures[name])

    def reset(self) -> None:
        """Begin the picture anew with the next frame."""
        if self._film is not None:
            self._film.samples = 0

    def configure(self, settings: PreviewSettings, passes: tuple[str, ...]) -> None:
        """Draw with other ``settings`` and keep other ``passes`` from now on; surfaces and indirect light stay as they are."""
        validate_settings(settings)
        if replace(settings, samples=self.settings.samples, mode=self.settings.mode) != self.settings:
            self._lamps = DirectLight(settings)
        if tuple(passes) != self._passes:
            self._film = None
        self.settings, self._passes = settings, tuple(passes)
        self.reset()

    def update(self, scene: Scene) -> None:
        """Show ``scene`` from now on. What is the same object as before stays on the GPU; what has moved is sent."""
        before, self.scene = self.scene, scene
        if before is scene:
            return
        if scene.world is not before.world:
            self._background = Background(scene.world)
        lit = scene.world is not before.world or not _same(before.lights, scene.lights)
        edited = not (_same(before.meshes, scene.meshes) and _same(before.materials, scene.materials))
        moved = edited or not _same(before.instances, scene.instances)
        if edited or (moved and (self._surfaces is None or not self._surfaces.can_move(scene))):
            self._images.keep(scene)
            self._surfaces = _surfaces(scene, self._images, self._surfaces)
        elif moved:
            self._surfaces.move(scene)
        if moved:
            self._bounds = scene_bounds(scene)
        if self._indirect.captures:
            if lit or moved:
                self._capture()
        elif lit:
            self._indirect.follow(replace(self._baked, lights=scene.lights, world=scene.world))
        self.reset()

    def _capture(self) -> None:
        self._indirect.capture(Drawn(self.scene, self._surfaces, self._bounds))

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
        offset = filter_offset(sobol_owen(1, 2, _FILTER_SEED, start=index)[0]) if index else np.zeros(2)
        self._gbuffer.draw(self._surfaces, view.drawn(scaled, offset, index))
        inputs = {**self._gbuffer.textures, "direct": self._direct, "irradiance": self._irradiance}
        # A bake that holds the lamps' light would be lit twice.
        if self._surfaces is not None and not self._indirect.includes_direct:
            self._lamps.draw(self.scene, self._surfaces, self._bounds, view, index, inputs, self._direct)
        draw_indirect(self._indirect, inputs, self._irradiance)
        self._film.add(view, offset, inputs, self._background, self.settings.film_transparent)

    def _allocate(self, size: tuple[int, int]) -> None:
        self._film = Film(size, self._passes)
        self._gbuffer = GBuffer(*size)
        self._direct, self._irradiance = empty(*size), empty(*size)


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


def _surfaces(scene: Scene, images: Images, before: SurfacePass | None = None) -> SurfacePass | None:
    is_empty = not any(len(scene.meshes[item.mesh].triangles) for item in scene.instances)
    return None if is_empty else gbuffer_surfaces(scene, images, before)


def _same(before: tuple[Mesh | Instance | Material, ...], after: tuple) -> bool:
    """True if both hold the very same objects, which are frozen."""
    return len(before) == len(after) and all(a is b for a, b in zip(before, after, strict=True))
