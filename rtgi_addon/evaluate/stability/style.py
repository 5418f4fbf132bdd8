"""Pictures in a style: lines that crawl as the view moves by less than a pixel, and bands that shimmer as a lamp does.

Sources: G. Papaioannou, *Real-Time Dynamic Global Illumination* (2020), last chapter; P. Bénard, A. Bousseau and J. Thollot,
"State-of-the-Art Report on Temporal Coherence for Stylized Animations", Computer Graphics Forum 30(8), 2011 (flicker, shower door).
"""

import numpy as np

from ...effects import Frame
from ...effects.lit import light_context
from ...effects.stylized import EFFECT
from ...effects.stylized.edges import find_borders
from ...effects.stylized.strokes import draw_lines
from ...effects.stylized.tone import banded
from ...numerics.sampling import sobol_owen
from ...transport.views.camera import CameraView
from ...transport.views.gbuffer import draw_gbuffer
from .case import Bench, Case, Sample
from .motion import CREEP, FRAMES, SPOT_WIDTH, TEXELS, coarse, flicker, spot_frame
from .parts import ONE, box, brightness, grey, quad, receivers, scene

# Pixels of a picture of lines, how far it moves from frame to frame, and samples that a settled frame is the mean of.
SIZE, PAN, PAN_FRAMES, SETTLED = (96, 64), 0.15, 16, 8
# Bands of the shimmer, and how wide a step is as a share of the key light.
BANDS, STEP = 4, 0.03


def _line_crawl(bench: Bench) -> list[Sample]:
    """How much the area that lines cover varies while a still life pans by less than a pixel a frame."""
    shown = scene("still life", [quad("table", (-3, -3, 0), (6, 0, 0), (0, 6, 0)), box("block", (-0.7, -0.4, 0), (0.7, 0.9, 1.1)),
                                 box("pole", (0.9, 0.5, 0), (0.06, 0.06, 1.4))], [grey(0.5)], [])
    context, view, samples = light_context(shown, bench.threads), _view(), []
    values = EFFECT.parameters(EFFECT.Settings(), shown)
    nothing = np.zeros((SIZE[1], SIZE[0], 4), np.float32)
    for name, count in (("one sample", 1), (f"{SETTLED} samples", SETTLED)):
        frames = []
        for step in range(PAN_FRAMES):
            bench.progress.check()
            shift = np.array([step * PAN, 0.37 * step * PAN])
            covered = 0.0
            for jitter in sobol_owen(count, 2, 7) - 0.5 if count > 1 else np.zeros((1, 2)):
                gbuffer = draw_gbuffer(context, view, SIZE, shift + jitter)
                frame = Frame(shown, view, gbuffer, nothing, nothing, nothing, offset=tuple(shift + jitter))
                covered += float(draw_lines(find_borders(frame, values), values["line_widest"]).coverage.sum())
            frames.append([covered / count])
        samples.append(Sample(name, flicker(np.array(frames)), shown))
    return samples


def _view() -> CameraView:
    world_from_camera = np.eye(4)
    back = np.array([1.6, -3.0, 2.2]) / np.linalg.norm([1.6, -3.0, 2.2])
    right = np.cross([0, 0, 1.0], back) / np.linalg.norm(np.cross([0, 0, 1.0], back))
    world_from_camera[:3, :3] = np.stack([right, np.cross(back, right), back], axis=1)
    world_from_camera[:3, 3] = 3.6 * back + (0, 0, 0.5)
    near, far = 0.05, 50.0
    clip = np.array([[1.8 * SIZE[1] / SIZE[0], 0, 0, 0], [0, 1.8, 0, 0],
                     [0, 0, -(far + near) / (far - near), -2 * far * near / (far - near)], [0, 0, -1, 0]])
    return CameraView(world_from_camera, clip)


def _band_shimmer(bench: Bench) -> list[Sample]:
    """Flicker of banded light under a spot that creeps, at the receivers of a room."""
    points, normals = receivers(-ONE, ONE, 3)
    field, frames = None, []
    for step in range(FRAMES):
        field = bench.bake(spot_frame(step), **coarse(bench)) if field is None else field.relight(spot_frame(step))
        frames.append(brightness(field, points, normals))
    frames = np.array(frames)
    tones = (frames / (2 * frames[0].mean())).astype(np.float32)
    return [Sample("spot", flicker(banded(tones, BANDS, STEP).astype(np.float64)), spot_frame(FRAMES - 1), field)]


CASES = (
    Case("line-crawl", "lines thicken and thin as the view moves by less than a pixel", "a block and a pole on a table",
         f"RMS of the area under lines over {PAN_FRAMES} frames {PAN:g} pixels apart, after a straight line, over the mean",
         "samples a frame", 0.01, _line_crawl),
    Case("band-shimmer", "bands jump as light flickers below their steps", "a room with a block under a spot that creeps by "
         f"{CREEP * SPOT_WIDTH / TEXELS * 1000:.1f} mm a frame", f"RMS over 8 frames of light in {BANDS} bands, after a straight "
         "line in time, over the mean", "the lamp", 0.01, _band_shimmer),
)
