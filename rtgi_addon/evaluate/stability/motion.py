"""Light that should move smoothly: lamps that creep by a tenth of a texel a frame, cameras that move by less than a cell.

Sources: S. Laine et al., "Incremental Instant Radiosity", EGSR 2007 (virtual lights that stay); C. Dachsbacher and M. Stamminger,
I3D 2005, section 5 (flicker of RSM); A. Kaplanyan and C. Dachsbacher, I3D 2010 (cascades snapped to whole cells).
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ...scene import Camera, Scene, SunLight
from .case import ANEW, Bench, Case, Sample, Variant
from .parts import ONE, box, brightness, grey, quad, receivers, room_with_block, rotation, scene, spot, volume

# A map of this many texels a side is what a step is a tenth of.
TEXELS = 128
FRAMES = 8
# A sun that is swept over a table of directions turns by so much a frame [degrees].
SWEEP = 1.0
# What a lamp creeps in a frame, in such texels.
CREEP = 0.1
# Side of the finest cascade's cells under the camera that moves [m].
DOLLY_CELL = 0.125
# A spot's map is this wide on the floor [m].
SPOT_WIDTH = 1.2


def spot_frame(step: int) -> Scene:
    """The room with its spot where it is after ``step`` frames."""
    x = step * CREEP * SPOT_WIDTH / TEXELS
    return replace(room_with_block(), lights=(spot((-0.4 + x, -0.3, 0.9), (-0.5 + x, -0.3, -1.0), 4.0, 40.0),))


def _point_frame(step: int) -> Scene:
    built = room_with_block()
    (lamp,) = built.lights
    shift = np.float32([step * CREEP * 2.0 / (TEXELS / 6**0.5), 0, 0])
    return replace(built, lights=(replace(lamp, position_world=lamp.position_world + shift),))


def _sun_frame(step: int) -> Scene:
    return yard(np.degrees(step * CREEP * 3.0 / TEXELS))


def yard(degrees: float) -> Scene:
    """A yard with a pillar and a wall under a sun that has turned by ``degrees`` about +Z."""
    turn = rotation((0, 0, 1), degrees)
    direction = turn[:3, :3] @ np.array([0.5, 0.2, -1.0])
    sun = SunLight("sun", (direction / np.linalg.norm(direction)).astype(np.float32), np.full(3, 3.0, np.float32))
    return scene("yard", [quad("ground", (-1.5, -1.5, 0), (3, 0, 0), (0, 3, 0)), box("pillar", (-0.2, -0.3, 0), (0.3, 0.2, 0.9)),
                          quad("wall", (1.2, -1.5, 0), (0, 0, 1.5), (0, 3, 0))],
                 [grey(0.6)], [sun], volumes=[volume((-1, -1, 0), (1, 1, 1.5), (4, 4, 3))])


def _yard_receivers() -> tuple[np.ndarray, np.ndarray]:
    y, z = (grid.ravel() for grid in np.meshgrid(np.linspace(-0.8, 0.8, 6), np.linspace(0.1, 1.2, 6)))
    points = np.concatenate([np.stack([np.full(36, 1.2), y, z], 1), np.stack([z - 1.3, y, np.full(36, 0.0)], 1)])
    return points.astype(np.float32), np.repeat(np.float32([[-1, 0, 0], [0, 0, 1]]), 36, axis=0)


def _light_motion(bench: Bench) -> list[Sample]:
    room = receivers(-ONE, ONE, 3)
    lamps: dict[str, tuple[Callable[[int], Scene], tuple[np.ndarray, np.ndarray]]] = {
        "spot": (spot_frame, room), "point": (_point_frame, room), "sun": (_sun_frame, _yard_receivers())}
    samples = []
    for name, (frame, (points, normals)) in lamps.items():
        field, frames = None, []
        for step in range(FRAMES):
            if field is None or bench.settings.get(ANEW):
                field = bench.bake(frame(step), **coarse(bench))
            else:
                field = field.relight(frame(step))
            frames.append(brightness(field, points, normals))
        samples.append(Sample(name, flicker(np.array(frames)), frame(FRAMES - 1), field))
    return samples


def _sun_sweep(bench: Bench) -> list[Sample]:
    """The error's change over time, against probes whose texels are lit by the very sun: a constant error is none."""
    truth = replace(bench, technique="probes", settings={})
    swept, exact = bench.bake(yard(0.0), **coarse(bench)), truth.bake(yard(0.0), **coarse(truth))
    points, normals = _yard_receivers()
    errors, light = [], []
    for step in range(FRAMES):
        built = yard(step * SWEEP)
        light.append(brightness(exact.relight(built), points, normals))
        errors.append(brightness(swept.relight(built), points, normals) - light[-1])
    moved = np.array(errors) - np.mean(errors, axis=0)
    return [Sample(f"{FRAMES} frames of {SWEEP:.0f}°", float(np.sqrt(np.mean(moved**2)) / np.mean(light)), built, swept)]


def flicker(frames: np.ndarray) -> float:
    """RMS of what is left of ``frames`` (t, n) after each point's best straight line in time, over their mean: the lamp's own
    steady motion is none."""
    time = np.arange(len(frames)) - 0.5 * (len(frames) - 1)
    slope = time @ frames / (time @ time)
    residual = frames - frames.mean(axis=0) - time[:, None] * slope
    # A straight line takes two of the t degrees of freedom.
    return float(np.sqrt((residual**2).sum() / (residual.size * (1 - 2 / len(frames)))) / frames.mean())


def _camera_dolly(bench: Bench) -> list[Sample]:
    """The change of the picture from one frame to the next; nothing in the scene moves."""
    points, normals = receivers(-ONE, ONE, 4)
    before, samples = None, []
    for step in range(13):
        world_from_camera = np.eye(4)
        world_from_camera[:3, 3] = -0.2 + step * 0.125 * DOLLY_CELL, 0.05, 0.1
        camera = Camera("camera", world_from_camera, np.eye(4), (64, 36))
        built = replace(room_with_block(), cameras=(camera,))
        nested = {"center": "camera", "cascades": 2, "cell_size": DOLLY_CELL, "resolution": 12}
        field = bench.bake(built, **{**coarse(bench), **nested})
        frame = brightness(field, points, normals)
        if before is not None:
            samples.append(Sample(f"frame {step}", float(np.sqrt(np.mean((frame - before) ** 2)) / frame.mean()), built, field))
        before = frame
    return samples


def coarse(bench: Bench) -> dict:
    """Settings of the bench's technique that are quick enough for many frames."""
    return {"probes": {"error": 0.05}, "vpl": {"lights": 512, "candidates": 4}, "rsm": {"resolution": TEXELS},
            "lpv": {"map_resolution": 64, "steps": 64}, "transfer": {"rays": 1024, "sites": 0}}[bench.technique]


CASES = (
    Case("light-motion", "light flickers as its lamp creeps", "a room with a block under a spot, then a point; a yard under a sun",
         "RMS over eight frames of what is left after a straight line in time, over the mean", "the lamp", 0.005, _light_motion,
         {"vpl": (Variant("virtual lights sampled anew each frame", {ANEW: True}),)}),
    Case("sun-sweep", "light wobbles as a sun crosses the directions of a table", "a yard with a pillar and a wall under a sun",
         "standard deviation over eight frames of the error against probes that are relit exactly, over the mean",
         "the sun, a degree a frame", 0.01, _sun_sweep, {"transfer": (Variant("64 directions", {"sun_side": 8}),)}),
    Case("camera-dolly", "cascades pop as the camera moves", "a room with a block, two cascades about a camera",
         "RMS change from one frame to the next, over the mean; the truth is 0", "frames an eighth of a cell apart", 0.01,
         _camera_dolly, {"lpv": (Variant("one cascade", {"cascades": 1, "resolution": 24}),)}),
)
