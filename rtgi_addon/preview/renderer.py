"""The preview's pictures: G-buffer, direct light through shadow maps, indirect light of a field, averaged over jittered frames."""

from collections.abc import Iterable
from dataclasses import replace
from functools import partial

import gpu
import numpy as np

from ..effects import Chosen, concerned, in_order
from ..effects.atlas.relight import STALE_ATLAS
from ..effects.atlas.sheet import LightAtlas
from ..effects.lit import light_context
from ..effects.spheres.maps import SphereProbes
from ..scene import Instance, Material, Mesh, Scene
from ..scene.lights import NOT_AT_ALL, lamps_to_add
from ..techniques.base import Field, validate_settings
from ..techniques.lattice.near_light import NearLight, may_have_near_light, near_light
from ..transport.context import changed_surfaces, same_values
from ..transport.views.camera import CameraView
from ..transport.views.drawn_instances import seen_by_cameras
from ..transport.views.pixel_filter import sample_offset
from .camera_points import PointLight, lattice, read_points
from .capture import Drawn
from .direct_light import DirectLight
from .effects import make_halves
from .effects.base import Before, GpuFrame
from .film import Background, Film, Made
from .gbuffer import GBuffer, gbuffer_surfaces
from .indirect import FRAME_SAMPLES, make_indirect
from .indirect_pass import Indirect, draw_indirect
from .light_atlas import AtlasLight
from .materials import Images
from .near_light import NearPass
from .settings import PASSES, PreviewSettings
from .surfaces import SurfacePass
from .textures import download, empty

STALE_SPHERES = "sphere probes saw other lamps or another world: mirrors show the field's light until the next bake"


class PreviewRenderer:
    """Renders ``scene`` with the indirect light of ``field``; None: what ``live``, the settings of a technique that needs no bake,
    makes of what is drawn, else the world's own, unshadowed. All of it is GPU work: main thread only. ``passes`` of PASSES are
    what frames are kept of. ``baked`` is the scene that ``field`` was baked from (None: ``scene``): its geometry goes on
    reflecting when lamps move, in techniques that cannot do without a bake. Their ``scene`` must begin with the lamps and the
    world of the bake. ``effects`` (of effects.Chosen) make the combined pass of the lit picture.
    """

    def __init__(self, scene: Scene, field: Field | None = None, settings: PreviewSettings | None = None,
                 passes: tuple[str, ...] = PASSES, baked: Scene | None = None, live=None,
                 effects: Iterable[Chosen] = ()):
        self.settings = settings or PreviewSettings()
        validate_settings(self.settings)
        self.scene, self.field, self._passes = scene, field, tuple(passes)
        self._images = Images()
        self._surfaces = _surfaces(scene, self._images)
        self._bounds, self._shown = scene_bounds(scene), seen_by_cameras(scene)
        self._background = Background(scene.world)
        self._lamps = DirectLight(self.settings)
        self._baked = baked or scene
        near = _near_light(self._baked, field)
        self._near = None if near is None else NearPass(near, self.settings)
        self._indirect: Indirect = make_indirect(field, self._baked, samples=FRAME_SAMPLES, live=live, near=near)
        if self._indirect.captures and (field is None or self._baked is not scene):
            self._capture()
        self._lit_as_baked, self._atlas_light = True, AtlasLight()
        self._effects = in_order(effects)
        self._halves = make_halves(concerned(self._effects, scene))
        self._gbuffer: GBuffer | None = None
        self._film: Film | None = None
        self._view: CameraView | None = None
        self._before: Before | None = None

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

    @property
    def notes(self) -> tuple[str, ...]:
        """What else of the scene is not followed: by light that needs no bake, by sphere probes, and by the light atlas."""
        stale = [] if self.field is None else [
            told for told, baked, shown in ((STALE_SPHERES, self.field.spheres, self._spheres),
                                            (STALE_ATLAS, self.field.atlas, self._atlas)) if baked is not None and shown is None]
        return *getattr(self._indirect, "notes", ()), *stale

    @property
    def _spheres(self) -> SphereProbes | None:
        """What sphere probes saw, under lamps and a world that are as they were."""
        return self.field.spheres if self.field is not None and self._lit_as_baked else None

    @property
    def _atlas(self) -> LightAtlas | None:
        """The light atlas, where it holds the light that is shown: of a bake that follows light by its transfer, the relit one."""
        if self.field is None or self.field.atlas is None:
            return None
        if self.field.transfer is not None:
            return self._indirect.atlas
        follows = self._indirect.captures or getattr(self._indirect, "follows_surfaces", False)
        moved = follows and changed_surfaces(self._baked, self.scene)
        return self.field.atlas if self._lit_as_baked and not moved else None

    @property
    def lit_by(self) -> Field | None:
        """The field whose light is shown: the one that was given, or what takes its place without a bake and is known here."""
        return getattr(self._indirect, "field", None) or self.field

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

    def configure(self, settings: PreviewSettings, passes: tuple[str, ...], effects: Iterable[Chosen] = ()) -> None:
        """Draw with other ``settings`` and ``effects`` and keep other ``passes`` from now on; surfaces and indirect light stay as
        they are."""
        validate_settings(settings)
        if replace(settings, samples=self.settings.samples, mode=self.settings.mode) != self.settings:
            self._lamps = DirectLight(settings)
            self._near = None if self._near is None else NearPass(self._near.near, settings)
        if tuple(passes) != self._passes:
            self._film = None
        self._effects = in_order(effects)
        self._apply_effects()
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
        if lit and self.field is not None and (self.field.spheres or self.field.atlas) is not None:
            # Other lamps or another world: the bake's light may follow them, what sphere probes saw and texels hold does not.
            self._lit_as_baked = same_values((scene.lights, scene.world), (self._baked.lights, self._baked.world))
        if edited or (moved and (self._surfaces is None or not self._surfaces.can_move(scene))):
            self._images.keep(scene)
            self._surfaces = _surfaces(scene, self._images, self._surfaces)
        elif moved:
            self._surfaces.move(scene)
        if moved:
            self._bounds, self._shown = scene_bounds(scene), seen_by_cameras(scene)
        self._apply_effects()
        if self._indirect.captures:
            if lit or moved:
                self._capture()
        elif getattr(self._indirect, "follows_surfaces", False):
            if lit or moved or scene.volumes is not before.volumes or scene.media is not before.media:
                self._indirect.follow(scene)
        elif lit:
            self._indirect.follow(replace(self._baked, lights=scene.lights, world=scene.world))
        self.reset()

    def _apply_effects(self) -> None:
        effects = concerned(self._effects, self.scene)
        if effects != tuple(half.chosen for half in self._halves):
            self._halves = make_halves(effects)

    @property
    def _drawn(self) -> Drawn:
        return Drawn(self.scene, self._surfaces, self._bounds)

    def _capture(self) -> None:
        # Lamps that no bake knows shine, and nothing that they light does.
        scene = replace(self.scene, lights=tuple(light for light in self.scene.lights if light.bake != NOT_AT_ALL))
        self._indirect.capture(replace(self._drawn, scene=scene))

    def take_light(self) -> bool:
        """Take over what a worker has made of the light since the last frame; True if the picture begins anew with it."""
        changed = self._indirect.update()
        if changed:
            self.reset()
        return changed

    def look_from(self, eye: np.ndarray) -> None:
        """Tell light that a worker makes about a viewer where ``eye`` (3,) is: of a viewport, which is no camera of the scene."""
        look_from = getattr(self._indirect, "look_from", None)
        if look_from is not None:
            look_from(eye)

    def frame(self, view: CameraView, size: tuple[int, int]) -> None:
        """Average one more sample of ``view`` in, at ``size`` (width, height) pixels before the resolution scale; another view or
        size begins anew."""
        scaled = tuple(max(1, round(side * self.settings.resolution_scale)) for side in size)
        if self._film is None or self._film.size != scaled:
            self._allocate(scaled)
        self.take_light()
        if not view.equals(self._view):
            self._view = view
            self.reset()
        index = self._film.samples
        offset = sample_offset(index)
        self._gbuffer.draw(self._surfaces, view.drawn(scaled, offset, index), self._shown)
        inputs = {**self._gbuffer.textures, "direct": self._direct, "irradiance": self._irradiance}
        if self._surfaces is not None:
            # What the bake holds of lamps would be lit twice.
            added = lamps_to_add(self.scene.lights, self._indirect.direct_lamps)
            self._lamps.draw(self.scene, added, self._surfaces, self._bounds, view, index, inputs, self._direct)
        self._put_in(view, index)
        draw_indirect(self._indirect, inputs, self._irradiance)
        if self._near is not None and self._surfaces is not None:
            self._near.draw(self.scene, self._surfaces, self._bounds, index, inputs, self._irradiance)
        self._atlas_light.draw(self._atlas, self.scene, self._gbuffer.textures, self._irradiance)
        self._film.add(view, offset, inputs, self._background, self.settings.film_transparent,
                       partial(self._with_effects, offset) if self._halves else None)
        self._before = Before(self.scene, view, tuple(offset))

    def _put_in(self, view: CameraView, index: int) -> None:
        """Give light that takes in what a camera sees the points of what has moved (``moved``: techniques.voxels.moved.Moved)."""
        moved = getattr(self._indirect, "moved", None)
        if moved is None or not self.settings.camera_points:
            return
        seen = np.flatnonzero(moved.unknown & self._shown)
        boxes = [box for box in (instance_corners(self.scene, index) for index in seen) if box is not None]
        of = lattice(view, np.array(boxes), self.size, self.settings.camera_points, index) if boxes else None
        points = None
        if of is not None:
            points = read_points(of, view, self.size, index, self.gbuffer, PointLight(self._lamps, self._drawn, self._indirect))
        self._indirect.put_in(points)

    def _with_effects(self, offset, light: gpu.types.GPUTexture) -> Made:
        """What all effects make of the lit picture ``light``."""
        passes = {}
        for half in self._halves:
            light = half.draw(GpuFrame(
                self._drawn, self.lit_by, self._view, self.size, self.gbuffer, self._direct, self._irradiance, light,
                self._background, self._film.samples, tuple(offset), self.settings.film_transparent, self._before,
                self._lamps, lamps_to_add(self.scene.lights, self._indirect.direct_lamps), passes, self._indirect, self._spheres))
            passes.update(half.passes)
        return Made(light, passes)

    def _allocate(self, size: tuple[int, int]) -> None:
        self._film = Film(size, self._passes)
        self._gbuffer = GBuffer(*size)
        self._direct, self._irradiance = empty(*size), empty(*size)
        self._before = None


def _near_light(scene: Scene, field: Field | None) -> NearLight | None:
    """See techniques.lattice.near_light; rays are only asked where it may be something."""
    if not may_have_near_light(scene, field):
        return None
    context = light_context(scene)
    return None if context is None else near_light(context, field)


def scene_bounds(scene: Scene) -> np.ndarray:
    """Lowest and highest corner (2, 3) float64 of boxes around all instances."""
    boxes = [_box(mesh) for mesh in scene.meshes]
    corners = [np.zeros((1, 3))]
    for instance in scene.instances:
        if boxes[instance.mesh] is not None:
            corners.append(_placed(boxes[instance.mesh], instance))
    points = np.concatenate(corners[1:] or corners)
    return np.array([points.min(axis=0), points.max(axis=0)])


def instance_corners(scene: Scene, index: int) -> np.ndarray | None:
    """World corners (8, 3) of the box around an instance, None if it has no vertices."""
    instance = scene.instances[index]
    box = _box(scene.meshes[instance.mesh])
    return None if box is None else _placed(box, instance)


def _placed(corners: np.ndarray, instance: Instance) -> np.ndarray:
    matrix = np.asarray(instance.world_from_local, np.float64)
    return corners @ matrix[:3, :3].T + matrix[:3, 3]


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
