"""Media: what fog, smoke and fire between the eye and surfaces take of their light, scatter towards the eye and give of their own.

A volume aligned with the view (`froxels`) is lit (`lighting`), added up from the eye on (`integrate`) and laid over the picture
between its columns; close about small lamps every pixel has their light by itself (`near`). Light of lamps is scattered by the
phase functions themselves and shadowed by surfaces and by media; what was reflected or scattered before comes from the bake's
field, through the moments of the phase functions (`ambient`): a bake of probes holds all orders of it. What it is not: a path
tracer. Light that turns in a medium is as fine as the field's lattice.

Sources: `froxels`, `integrate` and `near` name them.
"""

from dataclasses import dataclass

import numpy as np

from ...scene import Scene
from ..base import Effect, setting
from ..cached import cached_scene
from ..frame import Frame
from .froxels import Columns, Shape, shape_of
from .gathered import gathered as gathered_by_rays
from .history import MOST, Kept, followed, is_lit_alike, share_before
from .integrate import SeenThrough, gather, seen_through
from .lighting import Surroundings, lit_slices
from .near import near_lamps, near_light

_ALL, _FIRST = "all", "lamps"


@dataclass(frozen=True)
class MediaSettings:
    """What a user may set."""

    tile: int = setting(8, "Tile", "Pixels along the side of a column of the volume: what is finer in fog and smoke is blurred",
                        "px", 1, 64)
    slices: int = setting(64, "Slices", "Parts that the volume's columns are cut into, finer near the eye", "", 4, 256)
    reach: float | None = setting(None, "Range", "Distance from the eye to which media are seen; unset as far as there are any",
                                  "m", 0.01, 1e6)
    steady: bool = setting(True, "Steady", "Go on from the light in media of the sample before while the view moves; as soon as "
                           "anything is lit otherwise, nothing of it counts")
    orders: str = setting(_ALL, "Orders", "What media scatter: all light, by as many orders as the bake knows, or that of lamps "
                          "alone, once", choices=(_ALL, _FIRST))
    rays: int = setting(0, "Rays", "From every slice in each sample of the picture to where light that it scatters comes from: "
                        "right however coarse the bake's lattice is beside the medium, and slow; 0 takes that light from the bake",
                        "", 0, 64)


class MediaEffect(Effect):
    """See the module's docstring."""

    name, label = "media", "Media"
    description = "What fog, smoke and fire take, scatter and give between the eye and surfaces"
    stage = "media"
    passes = ("volume_direct", "volume_indirect", "transmittance")
    on_by_default = True
    Settings = MediaSettings

    def concerns(self, scene: Scene) -> bool:
        """See Effect.concerns."""
        return any(medium.visible_camera for medium in scene.media)

    def has_gpu_half(self, settings: MediaSettings) -> bool:
        """See Effect.has_gpu_half: rays are for the CPU."""
        return settings.rays == 0

    def sweep(self, pixels: int) -> tuple[MediaSettings, ...]:
        """Orders of scattering, columns and slices."""
        return (MediaSettings(tile=16), MediaSettings(orders=_FIRST), MediaSettings(slices=16), MediaSettings(slices=32),
                MediaSettings(), MediaSettings(slices=128), MediaSettings(tile=4), MediaSettings(tile=2), MediaSettings(rays=1))

    def apply(self, frame: Frame, field, settings: MediaSettings) -> np.ndarray:
        """See Effect.apply."""
        seen = self.seen(frame, field, settings)
        if seen is None:
            return frame.light
        for name, light in zip(self.passes, (seen.direct, seen.indirect, seen.transmittance), strict=True):
            frame.passes[name] = np.concatenate([light, np.ones_like(light[..., :1])], axis=-1)
        left = seen.transmittance.mean(axis=-1, keepdims=True)
        alpha = 1.0 - left * (1.0 - frame.light[..., 3:])
        return np.concatenate([frame.light[..., :3] * seen.transmittance + seen.direct + seen.indirect, alpha], axis=-1)

    def seen(self, frame: Frame, field, settings: MediaSettings) -> SeenThrough | None:
        """What media do in every pixel of ``frame``; None where there are none to be seen."""
        shape = shape_of(frame.scene, frame.view, frame.size, settings.tile, settings.slices, settings.reach)
        if shape is None:
            return None
        around = Surroundings.of(frame.scene, frame.context, field)
        kept = self._kept(frame, field) if settings.steady else None
        number = frame.index if kept is None else kept.number + 1
        columns = Columns.of(shape, frame.view, number, frame.offset)
        distance = np.where(frame.gbuffer.seen, frame.distance, np.float32(np.inf))
        rays = settings.rays if frame.context is not None and settings.orders == _ALL else 0
        near = near_lamps(around, shape, frame.view)
        slices = lit_slices(around, columns, number, near, _furthest(distance, shape), settings.orders == _ALL and not rays,
                            rays and (lambda *parts: gathered_by_rays(cached_scene(frame.context, frame), *parts,
                                                                      frame.context.threads)), rays)
        count = 0 if kept is None else kept.count
        share = share_before(count, frame.index)
        if share > 0:
            slices = followed(kept, columns, slices, share)
        if settings.steady:
            frame.kept[self.name] = Kept(frame.scene, field, shape, frame.view, frame.offset, columns.jitter, slices,
                                         min(count + 1, MOST - 1), number)
        gathered = gather(slices)
        seen = seen_through(gathered, shape, columns.jitter, distance)
        if near:
            seen = seen._replace(direct=seen.direct + near_light(around, near, gathered, columns, frame.view, number, frame.offset,
                                                                 distance))
        return seen

    def _kept(self, frame: Frame, field) -> Kept | None:
        """What the sample before left, if it is of any use."""
        kept = None if frame.history is None else frame.history.frame.kept.get(self.name)
        return kept if kept is not None and kept.lit_by is field and is_lit_alike(kept.scene, frame.scene) else None


def _furthest(distance: np.ndarray, shape: Shape) -> np.ndarray:
    """The most distant surface (columns,) [m] in the pixels between which each column is looked up."""
    across, up = shape.columns
    padded = np.zeros((up * shape.tile, across * shape.tile), np.float32)
    padded[:distance.shape[0], :distance.shape[1]] = distance
    of_tile = padded.reshape(up, shape.tile, across, shape.tile).max(axis=(1, 3))
    around = np.pad(of_tile, 1)
    return np.max([around[j:j + up, i:i + across] for j in range(3) for i in range(3)], axis=0).ravel()


EFFECT = MediaEffect()
