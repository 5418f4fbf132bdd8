"""Probes that are kept up to date while the scene changes: how far light lags, what it leaves behind, and how it flickers at rest.

Frames here are those in which every probe has its turn. Sources: Z. Majercik et al., JCGT 8(2), 2019, section 5 (hysteresis against
lag and noise); NVIDIA's RTXGI-DDGI, issue 10 (small emitters flicker).
"""

import math
from dataclasses import replace

import numpy as np

from ...numerics.grid import transform_points
from ...scene import Scene
from ...techniques.probes.live import LiveProbes, LiveSettings
from .case import Bench, Case, Sample, Variant
from .parts import ONE, box, brightness, grey, point, quad, receivers, scene, volume

# Updates before anything is measured, and over which flicker is.
SETTLED, FRAMES = 40, 24
SIDE = 4
# The noise at which a probe is good enough to be measured against.
ENOUGH = 0.05
# What stays behind is told from the noise of few rays by many in every update, against light that is as free of it.
MANY, CLEAN = 256, 0.02
# The share of a change that counts as followed, and that which counts as all.
FOLLOWED, WHOLE = 0.9, 0.99
# Nobody waits longer.
REST = 400


def _live(bench: Bench, built: Scene, **settings) -> LiveProbes:
    wanted = {"rays": 1 << 22, "noise": ENOUGH, **settings, **bench.settings}
    return LiveProbes(built, LiveSettings(**wanted), bench.seed, bench.threads, bench.progress.span(0.0, 0.0))


def _run(bench: Bench, live: LiveProbes, frames: int) -> None:
    for _ in range(frames):
        bench.progress.check()
        live.wake()
        live.frame()


def _settled(bench: Bench, live: LiveProbes) -> None:
    """Rays until nothing is left to gather."""
    for _ in range(REST):
        bench.progress.check()
        if live.settled:
            return
        live.frame()


def _room(albedo: float, intensity: float = 1.0) -> Scene:
    return scene("room", [box("room", -ONE, ONE, inward=True)], [grey(albedo)], [point((0.3, -0.2, 0.6), intensity)],
                 volumes=[volume(-ONE, ONE, (SIDE,) * 3)])


def _switch(bench: Bench) -> list[Sample]:
    """Frames that the mean light needs for nine tenths of a lamp that is switched off, more than light that nothing reflects."""
    points, normals = receivers(-ONE, ONE, 3)
    samples = []
    for albedo in (0.2, 0.5):
        live = _live(bench, _room(albedo), rays_per_probe=16)
        _settled(bench, live)
        left, full, frames = [1.0], brightness(live.field, points, normals).mean(), 0
        live.follow(_room(albedo, 0.0))
        while left[-1] > 1.0 - FOLLOWED and frames < REST:
            _run(bench, live, 1)
            frames += 1
            left.append(brightness(live.field, points, normals).mean() / full)
        # Between two frames light falls as a power.
        part = math.log(left[-2] / (1.0 - FOLLOWED)) / math.log(left[-2] / left[-1]) if left[-1] > 0 else 1.0
        found, alone = frames - 1 + part, math.log(1.0 - FOLLOWED) / math.log(live.settings.hysteresis)
        samples.append(Sample(f"albedo {albedo:g}: {found:.1f} frames, {alone:.1f} without bounces", found / alone - 1.0,
                              _room(albedo), live.field))
    return samples


def _passage(step: float) -> Scene:
    """A room with a block that stands ``step`` of the way from one side to the other."""
    built = scene("room with a block that moves", [box("room", -ONE, ONE, inward=True), box("block", -0.3 * ONE, 0.3 * ONE)],
                  [grey(0.5)], [point((0.0, 0.0, 0.8), 1.0)], volumes=[volume(-ONE, ONE, (SIDE,) * 3)])
    shift = np.eye(4)
    shift[:3, 3] = -0.65 + 1.3 * step, 0.1, -0.55
    return replace(built, instances=(built.instances[0], replace(built.instances[1], world_from_local=shift)))


def _ghosts(bench: Bench) -> list[Sample]:
    """What the light is off, about where the block began, behind probes that never saw it there."""
    points, normals = receivers(-ONE, ONE, 6)
    near = np.linalg.norm(points - transform_points(_passage(0.0).instances[1].world_from_local, np.zeros((1, 3))), axis=1) < 0.9
    fresh = _live(bench, _passage(1.0), noise=CLEAN)
    _settled(bench, fresh)
    truth = brightness(fresh.field, points[near], normals[near])
    live = _live(bench, _passage(0.0), rays_per_probe=MANY)
    _settled(bench, live)
    for step in range(1, 9):
        live.follow(_passage(step / 8.0))
        _run(bench, live, 1)
    whole = math.ceil(math.log(1.0 - WHOLE) / math.log(live.settings.hysteresis))
    # While it moves, light is late by design: what stays is the failure.
    _run(bench, live, whole)
    off = brightness(live.field, points[near], normals[near]) - truth
    return [Sample(f"{whole} frames after it stands", float(np.sqrt(np.mean(off**2)) / truth.mean()), _passage(1.0), live.field)]


def _noise(bench: Bench) -> list[Sample]:
    """The standard deviation of light over frames in which nothing changes, while probes go on as if something did."""
    points, normals = receivers(-ONE, ONE, 3)
    panel = quad("panel", (0.1, 0.1, 0.9), (0, 0.2, 0), (0.2, 0, 0), 1)
    lit = {"a lamp": _room(0.5), "a small emitter": replace(_room(0.5), lights=(), meshes=(*_room(0.5).meshes, panel),
                                                           materials=(grey(0.5), grey(0.5, 20.0, "glow")))}
    lit["a small emitter"] = _with_instances(lit["a small emitter"])
    samples = []
    for name, built in lit.items():
        live = _live(bench, built)
        _run(bench, live, SETTLED)
        frames = []
        for _ in range(FRAMES):
            _run(bench, live, 1)
            frames.append(brightness(live.field, points, normals))
        frames = np.array(frames)
        samples.append(Sample(name, float(np.sqrt(frames.var(axis=0, ddof=1).mean()) / frames.mean()), built, live.field))
    return samples


def _with_instances(built: Scene) -> Scene:
    return replace(built, instances=scene("", built.meshes, built.materials).instances)


CASES = (
    Case("live-switch", "live probes follow a lamp late", "a room whose lamp is switched off",
         "frames to nine tenths of the change, more than the hysteresis alone takes, as a share of those", "the room's albedo", 0.1,
         _switch),
    Case("live-ghosts", "live probes keep light of what has moved on", "a room that a block crosses in eight frames",
         "RMS error where it stood, against probes that never saw it there, over the mean, after the frames to 99 % of a change",
         "the block", 0.03, _ghosts),
    Case("live-noise", "live probes flicker where nothing changes", "a room under a lamp, then under a small emitter",
         "standard deviation over 24 frames, over the mean", "what lights it", 0.02, _noise,
         {"probes": (Variant("hysteresis 0.97", {"hysteresis": 0.97}, remedy=True),)}),
)
