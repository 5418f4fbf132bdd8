"""The part of a chart that effects have: their pictures, drawn and held to those of a reference, one setting after the other."""

from collections.abc import Callable
from dataclasses import asdict

import numpy as np

from .. import effects
from ..effects import Effect
from ..effects.spheres.settings import SphereSettings
from ..errors import BakeError, UsageError
from ..evaluate.pictures import (
    PictureChart,
    PicturePoint,
    PictureReference,
    PictureStep,
    PictureYard,
    charted,
    field_for,
    picture_size,
    sweep_of,
)
from ..progress import Progress
from ..scene import Scene
from ..storage.parts import Parts
from .field import bake_field

# Of the progress of pictures: the reference until the first, the bake that they are lit by until the second.
_RENDERED, _BAKED = 0.3, 0.4
_REFERENCE = "pictures of the reference"


def known_effects(names: list[str] | None) -> list[str] | None:
    """``names`` of effects that a chart is asked for. Raises UsageError for one that there is not or that no chart measures."""
    for name in names or ():
        if not effects.get(name).sweep(1):
            some = [effect.name for effect in effects.registry().values() if effect.sweep(1)]
            raise UsageError(f"the effect {name!r} draws as nothing looks: no picture says how right it is",
                             f"choose of {', '.join(some)}")
    return names


class PictureSurvey:
    """The pictures of a chart of ``scene``; what ``parts`` has of an earlier run is not drawn again. ``left_out`` says what is not
    measured."""

    def __init__(self, scene: Scene, names: list[str] | None, reference: PictureReference | None, most_seconds: float,
                 threads: int | None, parts: Parts):
        self.scene, self.reference, self.most_seconds, self.threads = scene, reference, most_seconds, threads
        self.left_out: list[str] = []
        self.chart: PictureChart | None = None
        self._parts, self._effects = parts, charted(scene, names)
        self._field = None
        for name in names or ():
            if not effects.get(name).concerns(scene):
                self.left_out.append(f"{name}: there is nothing for it to do in this scene")

    def run(self, progress: Progress, on_point: Callable[[], None]) -> None:
        """All pictures; ``on_point`` is called after each. Raises BakeError, Cancelled."""
        if not self._effects or self.reference is None:
            return
        if not self.scene.cameras:
            self.left_out.append("pictures of effects: the scene has no camera")
            return
        camera = self.scene.cameras[0]
        size = picture_size(camera)
        truth = self._truth(camera, size, progress.span(0.0, _RENDERED))
        if truth is None:
            return
        yard = PictureYard(self.scene, truth, size, self.reference.kind, self.threads)
        work = [(effect, number, settings) for effect in self._effects
                for number, settings in enumerate(sweep_of(effect, size[0] * size[1]))]
        points: list[PicturePoint] = []
        for done, (effect, number, settings) in enumerate(work):
            span = progress.span(_RENDERED, 1.0).span(done / len(work), (done + 1) / len(work))
            span.step(0.0, f"{effect.label}, picture {number + 1} of {len(sweep_of(effect, size[0] * size[1]))}")
            if any(point.effect == effect.name and point.last.seconds > self.most_seconds for point in points):
                self.left_out.append(f"{effect.name}, picture {number + 1}: a cheaper one took more than {self.most_seconds:g} s")
                continue
            points.append(self._point(yard, effect, number, settings, span))
            self.chart = PictureChart(camera.name, size, yard.reference(), tuple(points))
            on_point()

    def _truth(self, camera, size, progress: Progress) -> np.ndarray | None:
        stored = self._parts.load(_REFERENCE)
        if stored is None:
            progress.step(0.0, f"Pictures by {self.reference.kind}")
            try:
                truth = self.reference.pictures(camera, size, progress)
            except BakeError as error:
                self.left_out.append(f"pictures of effects: {error}")
                return None
            self._parts.save(_REFERENCE, {"truth": np.asarray(truth, np.float32)})
            return truth
        return stored[0]["truth"]

    def _point(self, yard: PictureYard, effect: Effect, number: int, settings, progress: Progress) -> PicturePoint:
        name = f"picture of {effect.name}, {number}"
        stored = self._parts.load(name)
        if stored is None:
            field = self._lit_by(progress.span(0.0, _BAKED)) if field_for(effect, settings, True) else None
            point = yard.measure(effect, settings, field, progress.span(_BAKED, 1.0))
            self._parts.save(name, {}, {"point": asdict(point)})
            return point
        values = stored[1]["point"]
        return PicturePoint(**{**values, "steps": tuple(PictureStep(*step) for step in values["steps"])})

    def _lit_by(self, progress: Progress):
        """Probes at their defaults, baked once, with sphere probes where an effect shows what those saw; nothing where the scene
        has no volume."""
        if self._field is None and self.scene.volumes:
            spheres = SphereSettings() if any(effect.reads_spheres for effect in self._effects) else None
            self._field = bake_field(self.scene, "probes", threads=self.threads, progress=progress, spheres=spheres)
        return self._field
