"""Media in pictures, where volumes that are aligned with the view are known to fail: slices that are seen, flicker as they move on,
ghosts of what moves, media thinner than a slice, lamps closer than a cell.

Nothing is baked: what is scattered is light of lamps, for which there are closed forms. Sources: B. Wronski, SIGGRAPH 2014;
S. Hillaire, SIGGRAPH 2015; B. Sun et al., "A Practical Analytic Single Scattering Model for Real Time Rendering", SIGGRAPH 2005
(the integral that a lamp in fog is held to).
"""

from dataclasses import replace

import numpy as np

from ...effects import get
from ...effects.frame import Frame, History
from ...effects.lit import draw_frame
from ...scene import DensityGrid, Medium, Scene
from ...transport.views.camera import CameraView
from ...transport.views.pixel_filter import sample_offset
from .case import Bench, Case, Sample
from .motion import flicker
from .parts import box, grey, point, rms_change, scene

# Pictures are of this size, of one column a tile; of one pixel where a closed form is along one ray.
SIZE, TILE = (32, 24), 4
# Samples that make a picture without noise to speak of.
SETTLED = 64
FRAMES = 8
# Scattering and absorption of the fog [1/m].
SCATTERING, ABSORPTION = 0.05, 0.01


def _stage(*media: Medium, lamp=None) -> Scene:
    """Media and a lamp in the dark; a block aside, for a scene needs something and pictures follow fog as far as ten times that."""
    built = scene("fog", [box("block", (29, 9, -10), (30, 10, -9))], [grey(0.0)], [] if lamp is None else [lamp])
    return replace(built, media=media)


def _fog() -> Medium:
    return Medium("fog", np.full(3, SCATTERING), np.full(3, ABSORPTION))


def _slab(begin: float, end: float, depth: float) -> Medium:
    """An absorbing slab across the view from ``begin`` to ``end`` [m], of optical ``depth``."""
    matrix = np.diag([0.5 * (end - begin), 50.0, 50.0, 1.0])
    matrix[0, 3] = 0.5 * (begin + end)
    return Medium("slab", absorption=np.full(3, depth / (end - begin)), grid=DensityGrid(matrix, np.ones((1, 1, 1), np.float32)))


def _view(width: float, forward: float = 0.0, aside: float = 0.0) -> CameraView:
    """A camera at (``forward``, ``aside``, 0) that looks along x; ``width`` is half its view at a metre's distance."""
    pose = np.eye(4)
    pose[:3, :3] = np.array([[0, -1, 0], [0, 0, 1], [-1, 0, 0]], np.float64).T
    pose[:3, 3] = forward, aside, 0.0
    near, far = 0.01, 1e4
    clip = np.array([[1 / width, 0, 0, 0], [0, SIZE[0] / SIZE[1] / width, 0, 0],
                     [0, 0, -(far + near) / (far - near), -2 * far * near / (far - near)], [0, 0, -1, 0]])
    return CameraView(pose, clip)


def _drawn(bench: Bench, built: Scene, view: CameraView, size=SIZE, index: int = 0, history: Frame | None = None,
           **settings) -> Frame:
    """A frame with the passes of media in it, taken in its pixels where a picture's sample of that number is."""
    bench.progress.check()
    effect = get("media")
    frame = draw_frame(built, None, view, size, index=index, offset=sample_offset(index),
                       history=None if history is None else History(history))
    effect.apply(frame, None, effect.Settings(**{"tile": TILE, **settings}))
    return frame


def _settled(bench: Bench, built: Scene, view: CameraView, name: str, size=SIZE, samples: int = SETTLED, **settings) -> np.ndarray:
    """The pass ``name`` (h, w, 3), averaged over samples."""
    return np.mean([_drawn(bench, built, view, size, index, steady=False, **settings).passes[name][..., :3]
                    for index in range(samples)], axis=0, dtype=np.float64)


def _steps(bench: Bench) -> list[Sample]:
    built, exact, samples = _stage(_slab(2.0, 4.0, 1.0)), np.exp(-1.0), []
    for slices in (4, 8, 16, 32, 64, 128):
        found = _settled(bench, built, _view(1e-4), "transmittance", (1, 1), 4, slices=slices, tile=1)
        samples.append(Sample(f"{slices} slices", float(abs(found.mean() / exact - 1.0))))
    return samples


def _phase(bench: Bench) -> list[Sample]:
    built, samples = _stage(_fog(), lamp=point((6.0, 1.0, 0.5))), []
    # The limits of slices lie closest near the eye; what moves with it by less than one must not be seen to.
    frames = [_settled(bench, built, _view(0.5, forward=0.02 * step), "volume_direct", samples=16).mean(axis=2).ravel()
              for step in range(FRAMES)]
    samples.append(Sample("forward, by parts of a slice", flicker(np.array(frames))))
    # The lamp crosses pixels, so that each of them changes; all of their light together does not.
    pixel = 2 * 0.5 * 6.0 / SIZE[0]
    frames = [[_settled(bench, built, _view(0.5, aside=0.25 * pixel * step), "volume_direct").mean()]
              for step in range(FRAMES)]
    samples.append(Sample("aside, by quarters of a pixel", flicker(np.array(frames))))
    return samples


def _ghosts(bench: Bench) -> list[Sample]:
    samples = []
    for name, lamp_step, eye_step in (("the lamp moves", 0.2, 0.0), ("the eye moves", 0.0, 0.1)):
        before = None
        for step in range(FRAMES):
            built = _stage(_fog(), lamp=point((5.0, -0.8 + lamp_step * step, 0.3)))
            view = _view(0.5, aside=eye_step * step)
            before = _drawn(bench, built, view, index=step, history=before)
        found = before.passes["volume_direct"][..., :3].mean(axis=2)
        expected = _settled(bench, built, view, "volume_direct").mean(axis=2)
        alone = _drawn(bench, built, view, index=FRAMES - 1, steady=False).passes["volume_direct"][..., :3].mean(axis=2)
        # What one sample by itself is off is noise, and no ghost.
        samples.append(Sample(name, max(rms_change(found, expected) - rms_change(alone, expected), 0.0)))
    return samples


def _thin(bench: Bench) -> list[Sample]:
    samples = []
    for thickness in (0.5, 0.1, 0.02, 0.004):
        built = _stage(_fog(), _slab(12.0, 12.0 + thickness, 0.5))
        found = _settled(bench, built, _view(1e-4), "transmittance", (1, 1), 16, tile=1)
        bare = _settled(bench, _stage(_fog()), _view(1e-4), "transmittance", (1, 1), 16, tile=1)
        samples.append(Sample(f"{1000 * thickness:g} mm", float(abs(found.mean() / bare.mean() / np.exp(-0.5) - 1.0))))
    return samples


def airlight(distance: float, along: float) -> float:
    """Radiance that fog scatters once along an endless ray of a lamp of 1 W/sr, ``distance`` [m] off it at ``along`` [m]."""
    # t = along + h·tan(angle) takes the lamp's peak out: dt/(h² + (t - along)²) = d(angle)/h.
    nodes, weights = np.polynomial.legendre.leggauss(400)
    low, high = np.arctan2(-along, distance), 0.5 * np.pi
    angle = 0.5 * (high - low) * (nodes + 1.0) + low
    place = along + distance * np.tan(angle)
    extinction = SCATTERING + ABSORPTION
    passed = np.exp(-extinction * (place + distance / np.cos(angle)))
    return float(SCATTERING / (4.0 * np.pi) / distance * np.sum(weights * passed) * 0.5 * (high - low))


def _lamp_near(bench: Bench) -> list[Sample]:
    samples = []
    for distance in (1.0, 0.3, 0.1, 0.03):
        built = _stage(_fog(), lamp=point((4.0, distance, 0.0)))
        found = _settled(bench, built, _view(1e-4), "volume_direct", (1, 1), tile=1)
        samples.append(Sample(f"{100 * distance:g} cm off the ray", float(abs(found.mean() / airlight(distance, 4.0) - 1.0))))
    return samples


CASES = (
    Case("media-steps", "what a medium takes hangs on the number of slices", "a slab of optical depth 1 before the eye",
         "error of its transmittance, relative to e^-1", "slices of the volume", 0.01, _steps),
    Case("media-phase", "shafts crawl as slices and columns move on with the eye", "a lamp in fog",
         "RMS over eight frames of what is left after a straight line in time, over the mean", "the eye, by parts of a cell", 0.01,
         _phase),
    Case("media-ghosts", "light in fog lags behind what moves", "a lamp in fog, and a history of seven frames",
         "RMS error of the last frame over that of one sample by itself, over the mean", "what moves", 0.02, _ghosts),
    Case("media-thin", "a medium thinner than a slice is missed, or counted as one", "a slab of optical depth 0.5 at 12 m",
         "error of its transmittance, relative to e^-0.5", "thickness", 0.01, _thin),
    Case("media-lamp-near", "lamps closer than a cell flash or are cut off", "a point lamp beside one ray through fog",
         "error of what is scattered, relative to the airlight integral", "distance", 0.02, _lamp_near),
)
