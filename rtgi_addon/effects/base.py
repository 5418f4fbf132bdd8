"""The interface every effect keeps, and how effects follow one another.

A picture begins with lit surfaces; effects of each of STAGES in turn make another picture of it; the film averages what the last
one returns. Reflections therefore show surfaces without the medium between, media lie over reflections, style draws over all.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable
from dataclasses import dataclass, fields, replace
from typing import ClassVar

import numpy as np

from ..scene import Scene
from ..techniques.base import Field, setting, validate_settings
from .frame import Frame, History

__all__ = ["EFFECT_PASSES", "STAGES", "Chosen", "Effect", "apply_all", "concerned", "in_order", "notes_of", "setting",
           "validate_settings"]

# What the effects of a stage do to the picture, in order: replace the light of surfaces by better light, add what they mirror, put
# media between them and the eye, draw in another style.
STAGES = ("light", "reflections", "media", "style")
# What effects deliver beside the picture, and what it is in every pixel where none does.
EFFECT_PASSES = {"volume_direct": 0.0, "volume_indirect": 0.0, "transmittance": 1.0, "mirror_confidence": 0.0,
                 "mirror_distance": 0.0}


class Effect(ABC):
    """One view-dependent effect: a name, a frozen ``Settings`` dataclass made of ``setting``, a place among STAGES, and ``apply``.

    ``passes`` are the pictures that it delivers beside its own, of EFFECT_PASSES: ``apply`` leaves them in ``Frame.passes``.
    ``on_by_default`` is for what belongs to the scene and costs nothing where it is not.

    Effects of one stage follow each other by name. An effect is immutable: what it must remember from frame to frame it finds in
    ``Frame.history``.
    """

    name: ClassVar[str]
    label: ClassVar[str]
    description: ClassVar[str]
    stage: ClassVar[str]
    passes: ClassVar[tuple[str, ...]] = ()
    on_by_default: ClassVar[bool] = False
    # Whether it shows what sphere probes saw.
    reads_spheres: ClassVar[bool] = False
    # Whether a pixel's picture is right where few others are given: those of a part of the picture may then have more samples.
    local: ClassVar[bool] = False
    Settings: ClassVar[type]
    # Parts of the panel, folded until they are opened: (label, the first and the last of their settings).
    sections: ClassVar[tuple[tuple[str, str, str], ...]] = ()

    @abstractmethod
    def apply(self, frame: Frame, field: Field | None, settings) -> np.ndarray:
        """The picture (h, w, 4) float32 that this effect makes of ``frame.light``: scene-linear radiance [W·sr⁻¹·m⁻²],
        premultiplied by its alpha, row 0 at the bottom. ``field`` is the indirect light that the surfaces were lit with, None where
        only the world's was shown. Nothing of ``frame`` is written to but ``passes`` and ``kept``. The same for any number
        of threads."""

    def concerns(self, scene: Scene) -> bool:
        """Whether there is anything in ``scene`` for it to do: where there is not, it need not be applied."""
        return True

    def mirrors(self, settings) -> bool:
        """Whether it adds what glossy layers reflect beside lamps: two that do add it twice."""
        return False

    def gathering(self, settings, times: float):
        """``settings`` with ``times`` as many rays for the light that it keeps as GATHERED: the same where it gathers none."""
        return settings

    def lamps(self, settings) -> Callable | None:
        """What draws the light of lamps for it alone, in place of ``lit.direct_light`` and called as that is with (context,
        gbuffer, view, index), in frames without a field whose lit picture nobody else asks for: these are ``Frame.bare``. None:
        it takes frames as all do."""
        return None

    def has_gpu_half(self, settings) -> bool:
        """Whether its half on the GPU, if it has one of its own, does what ``settings`` ask for."""
        return True

    def sweep(self, pixels: int) -> tuple:
        """Settings from cheap to dear that a chart measures in pictures of so many ``pixels``, the defaults among them. None where
        no picture could say what is right: an effect that draws in a style is not charted."""
        return ()

    def note(self, scene) -> str:
        """What of ``scene`` the effect does not follow, with names, as a sentence that users are told; or nothing."""
        return ""

    def parameters(self, settings, scene) -> dict:
        """What the two halves of the effect compute from, by name: numbers, booleans and triples, derived once from ``settings``
        and ``scene``. The GPU's half finds each in GLSL as ``effect.NAME``. The settings themselves unless an effect says
        otherwise; of those with choices the index of the one that is chosen."""
        values = {}
        for item in fields(settings):
            value, choices = getattr(settings, item.name), item.metadata.get("choices")
            values[item.name] = choices.index(value) if choices else value
        return values


@dataclass(frozen=True)
class Chosen:
    """An effect that is switched on, with its settings."""

    effect: Effect
    settings: object


def in_order(chosen: Iterable[Chosen]) -> tuple[Chosen, ...]:
    """Effects in the order in which they are applied. Raises UsageError for settings out of range."""
    chosen = tuple(chosen)
    for entry in chosen:
        validate_settings(entry.settings)
    return tuple(sorted(chosen, key=lambda entry: (STAGES.index(entry.effect.stage), entry.effect.name)))


def notes_of(chosen: Iterable[Chosen], scene) -> tuple[str, ...]:
    """What ``chosen`` effects do not follow of ``scene`` (see Effect.note), and which of them show the same light twice."""
    chosen = tuple(chosen)
    mirrors = [entry.effect.name for entry in in_order(chosen) if entry.effect.mirrors(entry.settings)]
    twice = f"reflections are shown by each of {', '.join(mirrors)}: switch all but one off" if len(mirrors) > 1 else ""
    return tuple(filter(None, (*(entry.effect.note(scene) for entry in chosen), twice)))


def concerned(chosen: Iterable[Chosen], scene: Scene) -> tuple[Chosen, ...]:
    """Those of ``chosen`` that have something to do in ``scene``, in the order in which they are applied."""
    return tuple(entry for entry in in_order(chosen) if entry.effect.concerns(scene))


def apply_all(frame: Frame, field: Field | None, chosen: Iterable[Chosen]) -> Frame:
    """``frame`` with the picture after all of ``chosen`` as its light, and the history that the next frame is to be given."""
    first, images = frame, {}
    for entry in in_order(chosen):
        image = np.asarray(entry.effect.apply(frame, field, entry.settings), np.float32)
        if image.shape != frame.light.shape:
            raise ValueError(f"the effect {entry.effect.name!r} returned {image.shape} for a picture of {frame.light.shape}")
        images[entry.effect.name] = image
        frame = replace(frame, light=image)
    return replace(frame, history=History(replace(first, history=None), images))
