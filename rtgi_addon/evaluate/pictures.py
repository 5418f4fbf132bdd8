"""What effects make of a picture, against time: every setting of an effect's sweep drawn through the scene's camera on the CPU, and
held to a reference's picture.

Like is held to like: effects that belong to the scene (``Effect.on_by_default``) are in every picture, one that lights surfaces
itself has no bake, the others have that of probes at their defaults, which is no part of their time. What prepares the scene for
rays is, and so is what an effect keeps for later samples, such as a surface cache.

The noise of the reference is taken out of all figures by products with two pictures of it whose noise is independent; that of what
is measured is in them, as in the picture that a user gets, and less so in ``coarse``.
"""

from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import NamedTuple, Protocol

import numpy as np

from ..effects import Chosen, Effect, concerned, registry
from ..effects.base import apply_all
from ..effects.lit import draw_frame, light_context
from ..progress import Progress
from ..scene import Camera, Scene
from ..techniques.base import Field
from ..transport.views.camera import CameraView
from ..transport.views.pixel_filter import sample_offset
from .costs import Costs, metered
from .setting_labels import setting_label

# The longer side of the pictures [pixels], their samples, and after how many of these the picture is looked at.
LONGER_SIDE, SAMPLES = 160, 16
LOOKED_AT = 1, 4, SAMPLES
# Side of the blocks of pixels that errors are looked at by as well.
BLOCK = 4
# The longer side of the picture that loads an effect's code and tables before any is timed.
_WARM_SIDE = 16
# What the picture without an effect is called.
WITHOUT = "without"


class PictureReference(Protocol):
    """An independent renderer. ``kind`` names it in reports."""

    kind: str

    def pictures(self, camera: Camera, size: tuple[int, int], progress: Progress) -> np.ndarray:
        """Two pictures (2, h, w, 3) of radiance through ``camera`` with independent noise, row 0 at the bottom, of ``size`` (width,
        height) and through the film's own filter (transport/views/pixel_filter.py); lamps themselves are not seen."""


class PictureStep(NamedTuple):
    """A picture after so many ``samples``: ``error`` its RMSE and ``bias`` its mean difference to the reference, both relative to
    the reference's mean; what it took until then, ``seconds`` of wall clock and ``cpu_seconds`` of all threads."""

    samples: int
    seconds: float
    cpu_seconds: float
    error: float
    bias: float


@dataclass(frozen=True)
class PicturePoint:
    """One setting of one effect. ``label`` says what differs from the defaults, or that it is the picture without the effect;
    ``coarse`` is the error of the last step over means of BLOCK x BLOCK pixels: what is left of it from a few steps away."""

    effect: str
    effect_label: str
    label: str
    default: bool
    settings: dict
    steps: tuple[PictureStep, ...]
    coarse: float

    @property
    def last(self) -> PictureStep:
        """After all samples."""
        return self.steps[-1]


@dataclass(frozen=True)
class PictureChart:
    """All pictures of one scene through ``camera``, ``size`` (width, height). ``reference`` holds kind, noise (of a pixel of the
    mean of its two pictures, relative to their mean) and floor, the least error that can be told from none."""

    camera: str
    size: tuple[int, int]
    reference: dict
    points: tuple[PicturePoint, ...]

    def effects(self) -> list[str]:
        """Names of the effects that were measured, in order."""
        return list(dict.fromkeys(point.effect for point in self.points))

    def of(self, effect: str) -> list[PicturePoint]:
        """The points of ``effect``."""
        return [point for point in self.points if point.effect == effect]


class PictureYard:
    """What pictures of one ``scene`` share: size, and the reference's ``truth`` (2, h, w, 3), row 0 at the bottom."""

    def __init__(self, scene: Scene, truth: np.ndarray, size: tuple[int, int], kind: str, threads: int | None = None):
        self.scene, self.size, self.kind, self.threads = scene, size, kind, threads
        self.truth = np.asarray(truth, np.float64)
        self._view, self._warm = CameraView.of(scene.cameras[0]), set()

    def reference(self) -> dict:
        """See PictureChart.reference."""
        noise = picture_noise(self.truth)
        return {"kind": self.kind, "noise": noise, "floor": noise / self.truth[0].size ** 0.25}

    def measure(self, effect: Effect, settings, field: Field | None, progress: Progress | None = None) -> PicturePoint:
        """Draw the picture with ``effect`` set up as ``settings`` (None: without it) over ``field``. Raises Cancelled."""
        progress = progress or Progress()
        chosen = [Chosen(other, other.Settings()) for other in registry().values()
                  if other.on_by_default and other.name != effect.name]
        chosen = concerned(chosen if settings is None else [*chosen, Chosen(effect, settings)], self.scene)
        field = field_for(effect, settings, field)
        if (effect.name, settings is None) not in self._warm:
            self._warm.add((effect.name, settings is None))
            self._draw(chosen, field, fitted(self.size, _WARM_SIDE), 1, lambda *_: None, progress.span(0.0, 0.1))
        steps, total = [], np.zeros(self.truth.shape[1:])

        def look(count: int, sample: np.ndarray, costs: Costs) -> None:
            np.add(total, sample, out=total)
            if count in LOOKED_AT:
                error, bias = picture_error(total / count, self.truth)
                steps.append(PictureStep(count, costs.seconds, costs.cpu_seconds, error, bias))

        self._draw(chosen, field, self.size, SAMPLES, look, progress.span(0.1, 1.0))
        coarse, _ = picture_error(block_means(total / SAMPLES), np.stack([block_means(each) for each in self.truth]))
        default = effect.Settings()
        label = WITHOUT if settings is None else setting_label(settings, default)
        return PicturePoint(effect.name, effect.label, label, settings == default, {} if settings is None else asdict(settings),
                            tuple(steps), coarse)

    def _draw(self, chosen, field: Field | None, size: tuple[int, int], samples: int, look: Callable, progress: Progress) -> None:
        """Draw as effects.picture does; ``look`` is told each sample's number from 1, its picture, and the costs so far, of which
        looking is no part."""
        context, history, spent = None, None, Costs()
        for index in range(samples):
            progress.step(index / samples, "Drawing")
            with metered() as costs:
                if index == 0:
                    # Anew for every setting: what an effect keeps with it is part of what the picture takes.
                    context = light_context(self.scene, self.threads)
                frame = draw_frame(self.scene if context is None else context, field, self._view, size, index=index,
                                   offset=sample_offset(index), history=history)
                frame = apply_all(frame, field, chosen)
                history = frame.history
            spent = Costs(spent.seconds + costs.seconds, spent.cpu_seconds + costs.cpu_seconds)
            look(index + 1, frame.light[..., :3].astype(np.float64), spent)


def sweep_of(effect: Effect, pixels: int) -> list:
    """What is measured of ``effect`` in pictures of so many ``pixels``: None, the picture without it, and its settings."""
    settings = effect.sweep(pixels)
    return [None, *settings] if settings else []


def charted(scene: Scene, names: list[str] | None = None) -> list[Effect]:
    """The effects, all or those in ``names``, of which there is something to chart in ``scene``."""
    return [effect for effect in registry().values() if (names is None or effect.name in names)
            and effect.sweep(1) and effect.concerns(scene)]


def field_for(effect: Effect, settings, field: Field | None) -> Field | None:
    """What lights the picture with ``effect`` as ``settings`` say (None: without it): nothing where it lights surfaces itself."""
    return None if effect.stage == "light" and settings is not None else field


def picture_size(camera: Camera) -> tuple[int, int]:
    """Width and height of a chart's pictures, in the proportions of ``camera``'s."""
    return fitted(camera.resolution, LONGER_SIDE)


def fitted(size: tuple[int, int], longer: int) -> tuple[int, int]:
    """``size`` made so small or so large that its longer side is ``longer``."""
    scale = longer / max(size)
    return max(round(size[0] * scale), 1), max(round(size[1] * scale), 1)


def picture_error(found: np.ndarray, truth: np.ndarray) -> tuple[float, float]:
    """Relative RMSE and bias of ``found`` (h, w, 3) to what both of ``truth`` (2, h, w, 3) are noisy pictures of: their noise is
    independent and cancels in the product."""
    level = max(float(np.mean(truth)), 1e-30)
    first, second = found - truth
    return float(np.sqrt(max(float(np.mean(first * second)), 0.0))) / level, float(found.mean() - np.mean(truth)) / level


def block_means(picture: np.ndarray) -> np.ndarray:
    """Means (h', w', 3) over blocks of BLOCK x BLOCK pixels of ``picture`` (h, w, 3); what is left at its edges is cut."""
    height, width = (max(side // BLOCK, 1) for side in picture.shape[:2])
    kept = picture[:height * BLOCK, :width * BLOCK]
    if min(kept.shape[:2]) < BLOCK:
        return kept
    return kept.reshape(height, BLOCK, width, BLOCK, 3).mean(axis=(1, 3))


def picture_noise(truth: np.ndarray) -> float:
    """The noise of a pixel of the mean of two pictures ``truth`` (2, h, w, 3), relative to their mean."""
    return 0.5 * float(np.sqrt(np.mean((truth[0] - truth[1]) ** 2))) / max(float(np.mean(truth)), 1e-30)
