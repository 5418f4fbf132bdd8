"""What mirrors show: effects that reflect, where what is reflected leaves the picture, is thin, or hides behind something.

The truth is the emission that mirrored rays find. Sources: M. McGuire, M. Mara, JCGT 3(4), 2014 (thickness, strides); Y. Uludag,
GPU Pro 5, 2014 (what is beside the picture or behind something in it).
"""

from dataclasses import dataclass, replace

import numpy as np

from ... import effects
from ...effects.frame import Frame, History
from ...effects.lit import draw_frame, light_context, seen_surfaces
from ...scene import Camera, Channel, Material, Scene
from ...transport.context import LightContext
from ...transport.rays.tracer import offset_origins
from ...transport.vectors import dot
from ...transport.views.camera import CameraView
from ...transport.views.pixel_filter import sample_offset
from .case import Bench, Case, Sample, Variant
from .parts import box, grey, point, quad, scene, sphere

SIZE = 96, 54
# Rays of a pixel, so that single ones do not decide.
RAYS = 4
FIELD_OF_VIEW = 40.0
# Half a turn of the eye leaves nothing of the screen in the picture.
TURNS = 0.0, 10.0, 20.0, 30.0, 45.0, 60.0
POLE_SAMPLES = 8
WIDTHS = 0.4, 0.1, 0.03
THICKNESSES = 0.01, 0.05, 0.25, 1.0, 5.0
ROUGHNESSES = 0.0, 0.25, 0.5, 0.75, 1.0
HIDING = 0.3, 0.8, 2.0
# Frames before a change and after it, of which the first within SETTLED of the change counts.
BEFORE, AFTER, SETTLED = 4, 8, 0.1
_SETTINGS = {"ray_traced": {"diffuse_rays": 0, "glossy_rays": RAYS}, "screen_reflections": {"rays": RAYS}}


def mirror(roughness: float = 0.0) -> Material:
    """White metal."""
    return replace(grey(1.0, name="mirror"), base_color=Channel.of(1.0), metallic=Channel.of(1.0), roughness=Channel.of(roughness))


def glow(strength: float = 1.0) -> Material:
    """Black but for its emission."""
    return replace(grey(0.0, strength, name="glow"), specular=Channel.of(0.0))


def _dark() -> Material:
    return replace(grey(0.0, name="dark"), specular=Channel.of(0.0))


def _pool(*meshes, lamps=()) -> Scene:
    """A mirror for a floor and ``meshes`` of the materials mirror, glow, dark and grey over it, and ``lamps``; nothing else that
    shines."""
    floor = quad("floor", (-20.0, -20.0, 0.0), (40.0, 0.0, 0.0), (0.0, 40.0, 0.0))
    wall = replace(grey(0.8), specular=Channel.of(0.0))
    return scene("pool", [floor, *meshes], [mirror(), glow(), _dark(), wall], lamps)


def eye(turn: float = 0.0, down: float = 8.0, position=(0.0, 0.0, 1.6)) -> CameraView:
    """Looks along +y, turned aside and down by degrees."""
    aside, pitch, half = np.radians(turn), np.radians(down), np.tan(np.radians(FIELD_OF_VIEW) / 2.0)
    back = -np.array([np.sin(aside) * np.cos(pitch), np.cos(aside) * np.cos(pitch), -np.sin(pitch)])
    right = np.array([np.cos(aside), -np.sin(aside), 0.0])
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = np.stack([right, np.cross(back, right), back], axis=1), position
    near, far = 0.05, 100.0
    clip = np.array([[SIZE[1] / SIZE[0] / half, 0, 0, 0], [0, 1 / half, 0, 0],
                     [0, 0, -(far + near) / (far - near), -2 * far * near / (far - near)], [0, 0, -1, 0]])
    return CameraView.of(Camera("eye", pose, clip, SIZE))


@dataclass(frozen=True, eq=False)
class _Shown:
    """What the floor shows (n, 3) and should (n, 3)."""

    found: np.ndarray
    true: np.ndarray

    def off(self, level: float) -> float:
        """Mean difference, relative to ``level``."""
        return float(np.abs(self.found - self.true).mean() / max(level, 1e-9))


def _shown(bench: Bench, built: Scene, view: CameraView, samples: int = 1, **settings) -> _Shown:
    """The floor of ``built`` by the bench's effect, in so many ``samples`` of its pixels, and what its mirrored rays find."""
    bench.progress.check()
    context = light_context(built, bench.threads)
    parts = [_sample(bench, context, view, index, settings) for index in range(samples)]
    return _Shown(*(np.concatenate([getattr(part, name) for part in parts]) for name in ("found", "true")))


def _drawn(bench: Bench, context: LightContext, view: CameraView, index: int, settings: dict,
           history: History | None = None) -> tuple[Frame, np.ndarray]:
    """Sample ``index`` and what the bench's effect makes of it."""
    effect = effects.get(bench.technique)
    frame = draw_frame(context, None, view, SIZE, index=index, offset=sample_offset(index), history=history)
    wanted = {name: value for name, value in settings.items() if name in effect.Settings.__dataclass_fields__}
    wanted = {**_SETTINGS[bench.technique], **wanted, **bench.settings}
    return frame, effect.apply(frame, None, effect.Settings(**wanted))


def _sample(bench: Bench, context: LightContext, view: CameraView, index: int, settings: dict) -> _Shown:
    frame, picture = _drawn(bench, context, view, index, settings)
    floor = frame.gbuffer.instance[frame.gbuffer.seen] == 0
    surfaces = seen_surfaces(frame.gbuffer, view).take(np.flatnonzero(floor))
    away = surfaces.towards_eye
    mirrored = (2.0 * dot(surfaces.faces, away)[:, None] * surfaces.faces - away).astype(np.float32)
    starts = offset_origins(surfaces.points, surfaces.faces, mirrored)
    hits = context.tracers.view.intersect(starts, mirrored)
    true, rows = np.zeros((len(mirrored), 3)), np.flatnonzero(hits.primitive >= 0)
    primitive = hits.primitive[rows]
    cosine = -dot(context.geometry.normals_world[primitive], mirrored[rows])
    true[rows] = context.surfaces.emission(primitive, hits.u[rows], hits.v[rows], cosine)
    return _Shown(picture[frame.gbuffer.seen][floor][:, :3], true)


def _pan(bench: Bench) -> list[Sample]:
    built = _pool(quad("screen", (-2.5, 6.0, 0.2), (5.0, 0.0, 0.0), (0.0, 0.0, 2.2), 1))
    level, samples = None, []
    for turn in TURNS:
        shown = _shown(bench, built, eye(turn))
        level = shown.true.mean() if level is None else level
        samples.append(Sample(f"turned {turn:g}°", shown.off(level)))
    return samples


def _pole(bench: Bench) -> list[Sample]:
    samples = []
    for width in WIDTHS:
        pole = quad("pole", (0.03 - 0.5 * width, 4.0, 0.05), (width, 0.0, 0.0), (0.0, 0.0, 0.75), 1)
        shown = _shown(bench, _pool(pole), eye(down=14.0), POLE_SAMPLES)
        samples.append(Sample(f"{100 * width:g} cm wide", abs(float(shown.found.mean() / shown.true.mean()) - 1.0)))
    return samples


def _thickness(bench: Bench) -> list[Sample]:
    """A thin board before a screen: behind it rays pass, up to ``thickness`` they meet it all the same."""
    built = _pool(quad("screen", (-6.0, 6.0, 0.05), (12.0, 0.0, 0.0), (0.0, 0.0, 3.0), 1),
                  box("board", (-0.8, 3.0, 0.6), (0.8, 3.02, 1.4), 2))
    samples = []
    for thickness in THICKNESSES:
        shown = _shown(bench, built, eye(), thickness=thickness)
        samples.append(Sample(f"{thickness:g} m", shown.off(shown.true.mean())))
    return samples


def _hidden(bench: Bench) -> list[Sample]:
    """A dark board hides part of a screen from the eye, which the floor before it mirrors all the same."""
    samples = []
    for width in HIDING:
        built = _pool(quad("screen", (-3.0, 6.0, 0.05), (6.0, 0.0, 0.0), (0.0, 0.0, 3.0), 1),
                      box("board", (-0.5 * width, 3.0, 0.9), (0.5 * width, 3.02, 2.2), 2))
        shown = _shown(bench, built, eye())
        samples.append(Sample(f"{width:g} m wide", shown.off(shown.true.mean())))
    return samples


def _after(bench: Bench, before: Scene, after: Scene) -> tuple[np.ndarray, list[np.ndarray], np.ndarray]:
    """The floor (h, w), NaN beside it, after some frames of ``before``, after each of some more of ``after`` that have these for a
    history, and in ``after`` alone."""
    history, shown, view = None, [], eye()
    for count, built in ((BEFORE, before), (AFTER, after)):
        bench.progress.check()
        context = light_context(built, bench.threads)
        for index in range(count):
            frame, picture = _drawn(bench, context, view, index, {}, history)
            history = History(replace(frame, history=None), {bench.technique: picture})
            shown.append(_floor(frame, picture))
    return shown[BEFORE - 1], shown[BEFORE:], _floor(*_drawn(bench, light_context(after, bench.threads), view, 0, {}))


def _floor(frame: Frame, picture: np.ndarray) -> np.ndarray:
    return np.where(frame.gbuffer.instance == 0, picture[..., 0], np.nan)


def _switched(bench: Bench) -> list[Sample]:
    """A lamp that lights a mirrored wall, off and on: frames beyond the first until nine tenths of the change are there."""
    wall = quad("wall", (-2.5, 6.0, 0.2), (5.0, 0.0, 0.0), (0.0, 0.0, 2.2), 3)
    dark, lit = (_pool(wall, lamps=lamps) for lamps in ((), (point((0.0, 4.5, 1.5), 20.0),)))
    samples = []
    for name, first, second in (("off", lit, dark), ("on", dark, lit)):
        before, frames, alone = _after(bench, first, second)
        start, end = np.nanmean(before), np.nanmean(alone)
        late = [abs(float(np.nanmean(frame) - end)) > SETTLED * abs(float(start - end)) for frame in frames]
        samples.append(Sample(name, float(max((index + 1 for index, is_late in enumerate(late) if is_late), default=0))))
    return samples


def _ghosts(bench: Bench) -> list[Sample]:
    """A mirrored screen jumps aside: what is left of it in the frame after, where nothing shines now."""
    samples = []
    for way in (0.5, 1.5, 3.0):
        before, after = (_pool(quad("screen", (left, 6.0, 0.2), (1.0, 0.0, 0.0), (0.0, 0.0, 2.2), 1)) for left in (-1.5, way - 1.5))
        start, frames, alone = _after(bench, before, after)
        gone = (start > 0.5) & (alone < 0.01)
        samples.append(Sample(f"{way:g} m aside", float(np.abs(frames[0] - alone)[gone].mean() / start[gone].mean())))
    return samples


def _furnace(bench: Bench) -> list[Sample]:
    """A white ball where all is equally bright, by roughness."""
    effect, samples = effects.get(bench.technique), []
    for roughness in ROUGHNESSES:
        bench.progress.check()
        room = box("room", (-2.0, -2.0, -2.0), (2.0, 2.0, 2.0), 1, inward=True)
        built = scene("furnace", [sphere("ball", 0.5, 16, inward=False), room], [mirror(roughness), glow()], [],
                      world=(1.0, 1.0, 1.0))
        frame = draw_frame(light_context(built, bench.threads), None, eye(0.0, 0.0, (0.0, -1.6, 0.0)), SIZE)
        wanted = {name: value for name, value in _SETTINGS[bench.technique].items() if name != "diffuse_rays"}
        ball = frame.gbuffer.instance == 0
        found = effect.apply(frame, None, effect.Settings(**{**wanted, **bench.settings}))[ball][:, :3]
        samples.append(Sample(f"roughness {roughness:g}", abs(float(found.mean()) - 1.0)))
    return samples


CASES = (
    Case("reflection-pan", "Reflections vanish with what they show",
         "a mirror before a bright screen, from which the eye turns away",
         "mean difference of the mirror from what its rays find, relative to the mean before the turn",
         "turn of the eye", 0.05, _pan),
    Case("reflected-pole", "Thin things are missing in mirrors", "a mirror before a bright pole, 7 to half a pixel wide",
         "share of the pole's reflected light that is missing or too much", "width of the pole", 0.1, _pole,
         {"screen_reflections": (Variant("16 even steps", {"search": "linear", "steps": 16}),)}),
    Case("reflection-thickness", "Things smear or tear by a guess at how deep they are",
         "a mirror before a thin dark board before a bright screen",
         "mean difference of the mirror from what its rays find, relative",
         "thickness that surfaces are taken to have", 0.05, _thickness),
    Case("reflection-hidden", "Mirrors miss what stands in the eye's way",
         "a mirror before a bright screen, part of which a dark board hides from the eye",
         "mean difference of the mirror from what its rays find, relative", "width of the board", 0.05, _hidden),
    Case("reflection-switched", "Mirrors show light that is off", "a mirror before a wall that a lamp lights, switched off and on",
         "frames beyond the first until nine tenths of the change are shown", "switch", 0.5, _switched),
    Case("reflection-ghosts", "Mirrors show what has gone", "a mirror before a bright screen that jumps aside",
         "what is left of the screen where it was, relative, in the first frame", "way of the screen", 0.01, _ghosts),
    Case("reflection-furnace", "Mirrors lose or make light", "a white metal ball where everything is equally bright",
         "difference of the ball's mean brightness from that", "roughness", 0.02, _furnace),
)
