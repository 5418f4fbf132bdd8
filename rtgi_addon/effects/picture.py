"""A picture on the CPU: samples by rays, each lit, taken through the effects and averaged, as the preview does on the GPU; so many,
or until the picture is as near as was asked for."""

from collections.abc import Callable, Iterable, Iterator
from typing import NamedTuple

import numpy as np

from ..progress import Progress
from ..scene import Scene
from ..techniques.base import Field
from ..transport.context import LightContext
from ..transport.views.camera import CameraView
from ..transport.views.pixel_filter import sample_offset
from .base import EFFECT_PASSES, Chosen, apply_all, concerned
from .film import FIRST, Film
from .frame import Frame, History, Samples
from .kept_light import KeptLight
from .lit import draw_frame, draw_samples, light_context
from .passes import NOT_AVERAGED, pass_of

# Where all pixels have to go on alike, errors are looked at whenever they have half as many samples more.
_MORE = 2
# Where indirect light is what is noisy, so many samples have all pixels before single ones have more.
_WHOLE = 6, 8, 12, 16
# Where an error is asked for, the first samples of all pixels have so many times the rays that are set for indirect light, and
# later ones so many: most scenes know it well enough from few; where more are needed, a sample costs more than its rays, which are
# better spent on few samples.
_SPARE, _AMPLE = 0.5, 2.0
# Samples of single pixels that are drawn at once, as many as make the cost of each small beside that of its rays.
_AT_ONCE = 1 << 16
# The share of the progress that is over when errors are first looked at.
_FIRST_SHARE = 0.2


class Drawn(NamedTuple):
    """``pictures`` (h, w, 4) float32 by the names of their passes, row 0 at the bottom; the mean number of ``samples`` of a pixel;
    by how much the lit picture is thought to be off, relative to its mean, ``error`` (None: it was not asked for)."""

    pictures: dict[str, np.ndarray]
    samples: float
    error: float | None


def draw_picture(scene: Scene, field: Field | None, view: CameraView, size: tuple[int, int], *, shown: str = "combined",
                 samples: int = 64, effects: Iterable[Chosen] = (), transparent: bool = False, threads: int | None = None,
                 progress: Progress | None = None) -> np.ndarray:
    """The pass called ``shown`` (of those of preview.settings.PASSES or EFFECT_PASSES) as (h, w, 4) float32, row 0 at the bottom,
    averaged over ``samples``; see ``draw_pictures``."""
    return draw_pictures(scene, field, view, size, shown=(shown,), samples=samples, effects=effects, transparent=transparent,
                         threads=threads, progress=progress).pictures[shown]


def draw_pictures(scene: Scene | LightContext, field: Field | None, view: CameraView, size: tuple[int, int], *,
                  shown: tuple[str, ...] = ("combined",), samples: int = 64, error: float | None = None,
                  effects: Iterable[Chosen] = (), transparent: bool = False, threads: int | None = None,
                  progress: Progress | None = None) -> Drawn:
    """The passes ``shown``; ``effects`` make the combined pass of the lit picture, and those of EFFECT_PASSES. With ``error`` a
    pixel has up to ``samples``, until the combined picture is thought to be off by no more than that, as a root mean square
    relative to its mean: the noise of it, not what the effects themselves leave out. Where all ``effects`` are local, pixels have
    as many as they need, else all alike. The same for any number of ``threads``. Raises Cancelled."""
    progress = progress or Progress()
    context = scene if isinstance(scene, LightContext) else light_context(scene, threads)
    scene = scene.scene if isinstance(scene, LightContext) else scene
    effects, history = concerned(effects, scene), None
    once, averaged = (tuple(name for name in shown if (name in NOT_AVERAGED) == kept) for kept in (True, False))
    applied = "combined" in shown or error is not None or any(name in EFFECT_PASSES for name in shown)
    film, single, light = Film(size, averaged), {}, KeptLight()
    # The lit picture need not be whole where none but one effect, which gathers light itself, asks for it.
    alone = applied and field is None and len(effects) == 1 and "direct" not in shown
    lamps = effects[0].effect.lamps(effects[0].settings) if alone else None

    def sample(index: int, before: History | None = None, times: float = 1.0) -> Frame:
        frame = draw_frame(scene if context is None else context, field, view, size, index=index, offset=sample_offset(index),
                           transparent=transparent, history=before, lamps=lamps)
        return apply_all(frame, field, _gathering(effects, times)) if applied else frame

    def single_pixels(samples: Samples) -> Frame:
        return apply_all(draw_samples(context, field, view, samples, transparent=transparent, lamps=lamps), field, effects)

    first = (1 if not averaged else samples) if error is None else min(samples, FIRST)
    local = error is not None and context is not None and all(entry.effect.local for entry in effects)
    times = _SPARE if local else 1.0
    for index in range(first):
        progress.step(index / first * (1.0 if error is None else _FIRST_SHARE), "Drawing")
        if index == first // 2:
            film.look()
        frame = sample(index, history, times)
        history = frame.history
        film.add(frame)
        if local:
            light.add(frame, times)
        single.update({name: pass_of(frame, name) for name in once} if index == 0 else {})
    if error is not None:
        if local:
            _until_light_is_known(film, frame, lambda index: sample(index, None, _AMPLE), error, samples, light, progress)
            _where_needed(film, single_pixels, error, samples, light, progress)
        else:
            _everywhere(film, sample, history, error, samples, progress)
    pictures = {**{name: film.picture(name) for name in averaged}, **single}
    return Drawn(pictures, float(film.count.mean()), None if error is None else film.error())


def _gathering(effects: tuple[Chosen, ...], times: float) -> tuple[Chosen, ...]:
    """``effects`` with ``times`` as many rays for indirect light."""
    return tuple(Chosen(entry.effect, entry.effect.gathering(entry.settings, times)) for entry in effects)


def _until_light_is_known(film: Film, frame: Frame, draw: Callable[[int], Frame], error: float, most: int, light: KeptLight,
                          progress: Progress) -> None:
    """Samples of all pixels, of which ``frame`` is the last, until their ``light`` is good enough for those that refine the
    picture: pixels learn it from their neighbours, too, which single ones cannot."""
    for count in (*_WHOLE, 0):
        held, enough = light.settle(frame, film.allowed(error))
        first, last = int(film.count.max()), min(count, most)
        if enough or first >= last or not light.fits(last) or film.error() <= error:
            break
        film.look()
        for index in range(first, last):
            progress.step(_FIRST_SHARE, "Drawing")
            frame = draw(index)
            film.add(frame)
            light.add(frame, _AMPLE)
    film.hold(held)


def _where_needed(film: Film, draw: Callable[[Samples], Frame], error: float, most: int, light: KeptLight,
                  progress: Progress) -> None:
    """Samples of the pixels that need them, until ``film`` is within ``error``, or its pixels have ``most``."""
    reached = started = film.error()
    while reached > error:
        needed = film.needing(error, most)
        if not needed.any():
            return
        share, count = _done(started, reached, error), film.count[needed]
        film.look(needed)
        for done, samples in _batches(np.flatnonzero(needed), count, film.size, light):
            progress.step(share + 0.5 * done * (1.0 - share), "Drawing")
            film.add(draw(samples))
        reached = film.error()


def _batches(pixel: np.ndarray, count: np.ndarray, size: tuple[int, int], light: KeptLight) -> Iterator[tuple[float, Samples]]:
    """As many samples again as each ``pixel`` (n,) has, ``count`` (n,), and the share of all that came before. Counts double from
    look to look: pixels of different counts have no index in common. Samples of one index stay together: they are neighbours."""
    numbers = [(int(level) + step, np.flatnonzero(count == level)) for level in np.unique(count) for step in range(level)]
    total, before, drawn, batch = int(count.sum()), 0, 0, []
    for place, (number, rows) in enumerate(numbers):
        batch.append((number, pixel[rows]))
        drawn += len(rows)
        if drawn >= _AT_ONCE or place == len(numbers) - 1:
            index = np.concatenate([np.full(len(rows), number) for number, rows in batch])
            offsets = np.concatenate([np.broadcast_to(sample_offset(number), (len(rows), 2)) for number, rows in batch])
            yield before / total, Samples(size, np.concatenate([rows for _, rows in batch]), index, offsets, light)
            before, drawn, batch = before + drawn, 0, []


def _everywhere(film: Film, draw: Callable[[int, History | None], Frame], history: History | None, error: float, most: int,
                progress: Progress) -> None:
    """As ``_where_needed``, of all pixels alike, half as many again as these have."""
    reached = started = film.error()
    while reached > error:
        count = int(film.count.max())
        more = min(max(count // _MORE, 2), most - count) // 2 * 2
        if not more:
            return
        share = _done(started, reached, error)
        film.look()
        for step in range(more):
            progress.step(share, "Drawing")
            frame = draw(count + step, history)
            history = frame.history
            film.add(frame)
        reached = film.error()


def _done(started: float, reached: float, error: float) -> float:
    """The share of the progress that is over at the error ``reached``: the square of errors falls with the samples."""
    return _FIRST_SHARE + (1.0 - _FIRST_SHARE) * float(np.log(started / reached) / np.log(started / error))
