"""What an effect is given: one sample of a picture, under the same names on the CPU and on the GPU (preview/effects/base.py)."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple, Protocol

import numpy as np

from ..scene import Scene
from ..transport.context import LightContext
from ..transport.lights.environment import Environment
from ..transport.views.camera import CameraView
from ..transport.views.gbuffer import GBuffer

# What Blender's own engines write for the depth of nothing.
NOWHERE = 1e10
# Under this name an effect that gathers light itself keeps what it found in the place of ``Frame.irradiance``.
GATHERED = "gathered"


@dataclass(frozen=True, eq=False)
class History:
    """The sample before, as it was lit, and what each effect made of it: ``images`` (h, w, 4) by the effect's name. It may have
    been seen from elsewhere (``frame.view``) and in another size."""

    frame: "Frame"
    images: Mapping[str, np.ndarray] = field(default_factory=dict)

    def places(self, points_world: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Where ``points_world`` (h, w, 3) were seen: pixel coordinates (h, w, 2) of the earlier frame, integers at pixels'
        centres, and (h, w) bool, False where they were behind the eye or beside the picture. For what does not move; whether
        something stood in front is for the caller to see in ``frame.gbuffer``."""
        shape = points_world.shape[:2]
        place, w = self.frame.view.project(points_world.reshape(-1, 3), self.frame.size, self.frame.offset)
        inside = (w > 0) & np.all((place >= 0) & (place <= 1), axis=1)
        return (place * self.frame.size - 0.5).reshape(*shape, 2), inside.reshape(shape)


class KnownLight(Protocol):
    """Indirect light that samples before have gathered (effects/kept_light.py)."""

    def at(self, pixel: np.ndarray, points: np.ndarray, normals: np.ndarray, width: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Irradiance (n, 3) [W·m⁻²] at ``points`` with unit ``normals`` (n, 3), seen by pixels of the numbers ``pixel`` (n,) that
        are ``width`` (n,) [m] wide there, and where it is known well enough (n,) bool."""


class Samples(NamedTuple):
    """n samples of single pixels of a picture of ``size`` (width, height) pixels: of the pixel number ``pixel`` (n,), which is
    row · width + column, the sample number ``index`` (n,), taken ``offset`` (n, 2) [pixels] from its centre. They are sorted by
    their index, those of one index by their pixel, and no two are the same. Those that refine a picture have indirect
    ``light`` from the samples before, where these know it."""

    size: tuple[int, int]
    pixel: np.ndarray
    index: np.ndarray
    offset: np.ndarray
    light: KnownLight | None = None

    def places(self) -> tuple[np.ndarray, np.ndarray]:
        """Where they are in the picture, (x, y) (n,) each in [0, 1]: seen without an offset, these show the same."""
        width, height = self.size
        return ((self.pixel % width + 0.5 - self.offset[:, 0]) / width, (self.pixel // width + 0.5 - self.offset[:, 1]) / height)


@dataclass(frozen=True, eq=False)
class Frame:
    """One sample of a picture of ``scene`` seen by ``view``: arrays have row 0 at the bottom.

    ``gbuffer`` (transport.views.gbuffer.GBuffer) is what is seen, with its position, normals, materials and indices. ``direct``
    (h, w, 4) float32 is the radiance [W·sr⁻¹·m⁻²] that surfaces reflect of lamps, with the luminance of the lamps' irradiance
    [W·m⁻²] in its fourth component, ``irradiance`` (h, w, 4) the indirect light that
    arrives at them [W·m⁻²], both 0 where nothing is seen. ``light`` (h, w, 4) is the light so far: the lit picture with emission
    and world, and what earlier effects made of it; premultiplied by its alpha.

    ``index`` counts the samples of a picture that stands still: noise and jitter that go by it settle as samples are averaged.
    ``offset`` (2,) [pixels] is where in the pixels this one was taken. ``transparent`` says that the film leaves the world out.
    ``history`` is the sample before, None where there is none. ``open_context`` makes ``context``. ``passes`` (h, w, 4) by name is
    what effects deliver beside their picture (Effect.passes), ``kept`` by their names what they remember for the sample that
    follows, which finds it in ``history.frame``.

    A ``bare`` one is for one effect alone, which gathers light itself: ``direct`` is what its ``Effect.lamps`` draws, and
    ``irradiance`` nothing.

    With ``samples`` it is a row of those, h = 1 and w = n, in which neighbours are none, and ``index`` and ``offset`` are None:
    each has its own.
    """

    scene: Scene
    view: CameraView
    gbuffer: GBuffer
    direct: np.ndarray
    irradiance: np.ndarray
    light: np.ndarray
    index: int | None = 0
    offset: tuple[float, float] | None = (0.0, 0.0)
    transparent: bool = False
    history: History | None = None
    open_context: Callable[[], LightContext | None] = lambda: None
    passes: dict[str, np.ndarray] = field(default_factory=dict)
    kept: dict[str, object] = field(default_factory=dict)
    samples: Samples | None = None
    bare: bool = False

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the picture [pixels]."""
        return self.gbuffer.size if self.samples is None else self.samples.size

    @cached_property
    def pixel(self) -> np.ndarray:
        """(h, w) the number, row · width + column, of every one's pixel in the picture."""
        return (np.arange(self.light[..., 0].size) if self.samples is None else self.samples.pixel).reshape(self.light.shape[:2])

    @cached_property
    def turn(self) -> np.ndarray:
        """(h, w) which of its pixel's samples every one is."""
        return np.broadcast_to(self.index if self.samples is None else self.samples.index, self.light.shape[:2])

    @property
    def context(self) -> LightContext | None:
        """The scene made ready for rays; None where it has no geometry."""
        return self.open_context()

    @cached_property
    def depth(self) -> np.ndarray:
        """(h, w) float32 along the middle of the view [m], as Blender's Depth pass; NOWHERE where nothing is seen."""
        along = (self.gbuffer.position[..., :3] - self.view.position.astype(np.float32)) @ self.view.forward.astype(np.float32)
        return np.where(self.gbuffer.seen, along, np.float32(NOWHERE))

    @cached_property
    def distance(self) -> np.ndarray:
        """(h, w) float32 from the eye to the surface [m]; for a parallel projection the depth, as in Cycles. NOWHERE where nothing
        is seen."""
        if self.view.orthographic:
            return self.depth
        towards = self.gbuffer.position[..., :3] - self.view.position.astype(np.float32)
        return np.where(self.gbuffer.seen, np.sqrt(np.sum(towards * towards, axis=-1)), np.float32(NOWHERE))

    @cached_property
    def footprint(self) -> np.ndarray:
        """(h, w) float32: how wide a pixel is at its surface, across the view [m]."""
        width = np.float32(2.0 / (abs(self.view.clip_from_camera[0, 0]) * self.size[0]))
        return np.full_like(self.depth, width) if self.view.orthographic else self.depth * width

    @cached_property
    def directions(self) -> np.ndarray:
        """(h, w, 3) float32 unit directions in which the pixels look, world."""
        width, height = self.size
        base, across, up = self.view.rays(self.size, (0.0, 0.0) if self.samples is not None else self.offset)
        if self.samples is None:
            x, y = np.meshgrid((np.arange(width) + 0.5) / width, (np.arange(height) + 0.5) / height)
        else:
            x, y = (part[None] for part in self.samples.places())
        directions = base + x[..., None] * across + y[..., None] * up
        return (directions / np.linalg.norm(directions, axis=-1, keepdims=True)).astype(np.float32)

    @cached_property
    def background(self) -> np.ndarray:
        """(h, w, 4) float32: what would be seen with no surface in the way; the world's radiance, or nothing for a transparent
        film."""
        result = np.zeros((*self.gbuffer.seen.shape, 4), np.float32)
        if not self.transparent:
            result[..., :3] = Environment(self.scene.world).radiance(self.directions.reshape(-1, 3)).reshape(result[..., :3].shape)
            result[..., 3] = 1.0
        return result

    def lit(self) -> "Frame":
        """This frame with ``light`` as its surfaces are lit: direct + albedo·irradiance/π + emission, over the background."""
        gbuffer, rows = self.gbuffer, self.gbuffer.rows
        everything = len(rows) == gbuffer.seen.size
        light = np.zeros((len(rows), 4), np.float32) if everything else self.background.reshape(-1, 4).copy()
        shown = gbuffer.shown(gbuffer.albedo) * gbuffer.shown(self.irradiance)
        shown *= np.float32(1.0 / np.pi)
        shown += gbuffer.shown(self.direct)
        shown += gbuffer.shown(gbuffer.emission)
        shown[:, 3] = 1.0
        light[rows] = shown
        return replace(self, light=light.reshape(*gbuffer.seen.shape, 4))
