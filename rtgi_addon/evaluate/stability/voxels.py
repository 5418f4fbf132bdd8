"""Where voxels fail: walls of few voxels, turned and shifted; steps and resolutions; things that move by less than a voxel, are
thinner than one, or meet in one.

Sources: C. Crassin et al., Computer Graphics Forum 30(7), 2011 (leaks of filtered voxels); Godot issues 80123 and 83025 (leaks and
corners of VoxelGI).
"""

from dataclasses import replace

import numpy as np

from ...scene import Camera
from ...transport.context import LightContext
from ...transport.paths.reference import irradiance_at
from .case import Bench, Case, Sample, Variant
from .leaks import HALF, leak, two_rooms
from .motion import flicker
from .parts import ONE, box, brightness, grey, moved, quad, receivers, rms_change, room_with_block, rotation, scene, turned, volume

# Side of the voxels here [m].
VOXEL = 0.1
# Frames of something that moves, and by how much of a voxel in each.
FRAMES, CREEP = 8, 0.125
# Side of the finer voxels where there are two grids [m].
_FINEST = 0.04
# Paths of the yardstick.
_PATHS, _SEED = 1024, 7
# Other cells than voxels have: what each technique is swept over.
_STEPS = {"cone_tracing": ("step", (1.0, 0.5, 0.25)), "voxel_march": ("rays", (32, 128, 512))}


def _quick(bench: Bench) -> dict:
    """Light of lamps alone, for what asks where it gets to."""
    return {"voxel_size": VOXEL, "light": "voxels", "bounces": 0}


def _wall(bench: Bench) -> list[Sample]:
    samples = []
    for thickness in (1, 2, 4):
        for degrees in (0.0, 20.0, 45.0):
            built, lit, dark = two_rooms(2.0 * thickness * VOXEL)
            turn = rotation((0.2, 0.1, 1.0), degrees)
            # Half a voxel of phase, another one along each axis.
            turn[:3, 3] = VOXEL * np.array([0.3, 0.17, 0.41])
            reach = np.abs(turn[:3, :3]) @ HALF
            rotated = replace(moved(built, turn), volumes=(volume(-reach, reach, (4, 4, 4)),))
            field = bench.bake(rotated, **_quick(bench))
            samples.append(Sample(f"{thickness} voxels, {degrees:g} degrees", leak(field, turned(*lit, turn), turned(*dark, turn)),
                                  rotated, field))
    return samples


def _step(bench: Bench) -> list[Sample]:
    built, (points, normals) = room_with_block(), receivers(-ONE, ONE, 4)
    name, values = _STEPS[bench.technique]
    fields = [bench.bake(built, **{**_quick(bench), name: value}) for value in values]
    light = [brightness(field, points, normals) for field in fields]
    return [Sample(f"{name} {value:g}", rms_change(found, light[-1]), built, field)
            for value, found, field in zip(values[:-1], light[:-1], fields[:-1], strict=True)]


def _motion(bench: Bench) -> list[Sample]:
    """A block that glides over a voxel: what is left of each point's light after its own straight line in time."""
    points, normals = receivers(-ONE, ONE, 3)
    frames, field, built = [], None, None
    for frame in range(FRAMES):
        x = -0.1 + CREEP * VOXEL * frame
        built = scene("gliding block", [box("room", -ONE, ONE, inward=True), box("block", (x, -0.4, -1.0), (x + 0.7, 0.4, -0.2))],
                      [grey(0.6)], room_with_block().lights, volumes=[volume(-ONE, ONE, (4, 4, 4))])
        field = bench.bake(built, **_quick(bench))
        frames.append(brightness(field, points, normals))
    return [Sample(f"{FRAMES} frames of {CREEP:g} voxels", flicker(np.array(frames)), built, field)]


def _along_the_floor() -> tuple[np.ndarray, np.ndarray]:
    x, y = np.meshgrid(np.linspace(-0.9, 0.9, 25), np.linspace(-0.5, 0.5, 3))
    points = np.stack([x.ravel(), y.ravel() - 0.4, np.full(x.size, -0.999)], axis=1).astype(np.float32)
    points = points[(np.abs(points[:, 1]) > 0.45) | (points[:, 0] < -0.15)]
    return points, np.tile(np.float32([0, 0, 1]), (len(points), 1))


def _border(bench: Bench) -> list[Sample]:
    """Two nested grids about a probe volume that is carried along a floor: the border of the finer one crosses the receivers."""
    points, normals = _along_the_floor()
    frames, field, built = [], None, None
    for frame in range(FRAMES):
        along = -0.3 + 0.5 * _FINEST * frame
        built = replace(room_with_block(), volumes=(volume((along - 0.2, -0.3, -0.95), (along + 0.2, 0.1, -0.55), (4, 4, 4)),))
        field = bench.bake(built, **{**_quick(bench), "voxel_size": _FINEST, "cascades": 2, "reach": 20.0, "rays": 256})
        frames.append(brightness(field, points, normals))
    return [Sample(f"{FRAMES} frames of half a voxel", flicker(np.array(frames)), built, field)]


def _dolly(bench: Bench) -> list[Sample]:
    """Two nested grids about a camera that goes on by less than a voxel a frame, and by more than one in all, so that they snap;
    nothing in the scene moves."""
    points, normals = _along_the_floor()
    before, samples = None, []
    for step in range(5):
        world_from_camera = np.eye(4)
        world_from_camera[:3, 3] = -0.5 + 0.3 * _FINEST * step, -0.4, -0.7
        camera = Camera("camera", world_from_camera, np.eye(4), (64, 36))
        built = replace(room_with_block(), cameras=(camera,))
        field = bench.bake(built, **{**_quick(bench), "voxel_size": _FINEST, "cascades": 2, "center": "camera", "rays": 256})
        frame = brightness(field, points, normals)
        if before is not None:
            samples.append(Sample(f"frame {step}", rms_change(frame, before), built, field))
        before = frame
    return samples


def _pole(bench: Bench) -> list[Sample]:
    """A floor under a grey sky with a pole on it: what the pole keeps from the floor around it, in parts of the light there."""
    samples = []
    for width in (2.0, 1.0, 0.5, 0.25):
        half = 0.5 * width * VOXEL
        built = scene("pole", [quad("floor", (-1, -1, 0), (2, 0, 0), (0, 2, 0)), box("pole", (0.013 - half, 0.017 - half, 0.0),
                                                                                  (0.013 + half, 0.017 + half, 1.5))],
                      [grey(0.0)], world=1.0, volumes=[volume((-1, -1, 0), (1, 1, 1.5), (4, 4, 3))])
        angle = 2.0 * np.pi * (np.arange(12) + 0.3) / 12
        points = np.stack([0.4 * np.cos(angle), 0.4 * np.sin(angle), np.zeros(12)], axis=1).astype(np.float32)
        normals = np.tile(np.float32([0, 0, 1]), (12, 1))
        field = bench.bake(built, **{**_quick(bench), "rays": 512})
        exact = irradiance_at(LightContext(built, bench.threads), points, normals, _PATHS, seed=_SEED).mean.mean()
        off = float(abs(brightness(field, points, normals).mean() / exact - 1.0))
        samples.append(Sample(f"{width:g} voxels", off, built, field))
    return samples


def _corner(bench: Bench) -> list[Sample]:
    """Glowing walls and a black floor: light on the floor near the corner, which fills half of what is seen there."""
    built = scene("corner", [quad("floor", (-1, -1, 0), (2, 0, 0), (0, 2, 0)), quad("wall", (1, -1, 0), (0, 0, 2), (0, 2, 0), 1)],
                  [grey(0.0), grey(0.0, 1.0, "glow")], volumes=[volume((-1, -1, 0), (1, 1, 2), (4, 4, 4))])
    field, samples = bench.bake(built, **{**_quick(bench), "rays": 256}), []
    context = LightContext(built, bench.threads)
    for away in (0.25, 0.5, 1.0, 2.0, 4.0):
        y = np.linspace(-0.5, 0.5, 9)
        points = np.stack([np.full(9, 1.0 - away * VOXEL), y, np.zeros(9)], axis=1).astype(np.float32)
        normals = np.tile(np.float32([0, 0, 1]), (9, 1))
        exact = irradiance_at(context, points, normals, _PATHS, seed=_SEED).mean.mean()
        off = float(abs(brightness(field, points, normals).mean() / exact - 1.0))
        samples.append(Sample(f"{away:g} voxels off", off, built, field))
    return samples


SIX = {"cone_tracing": (Variant("six cones", {"cones": 6}),)}

CASES = (
    Case("voxel-walls", "light leaks through walls of few voxels", "two closed rooms side by side, a lamp in one",
         "mean irradiance of the dark room's walls over that of the lit room's; the truth is 0",
         "the wall's thickness and its tilt", 0.005, _wall, SIX),
    Case("voxel-steps", "light that depends on how one steps through voxels", "a room with a block",
         "RMS change of irradiance at the walls against the finest, over its mean", "length of steps, or number of rays", 0.02,
         _step, SIX),
    Case("voxel-motion", "light flickers as something moves by less than a voxel", "a room with a block that glides",
         "RMS over eight frames of what is left after a straight line in time, over the mean", "an eighth of a voxel a frame",
         0.005, _motion, SIX),
    Case("voxel-cascades", "light steps where the border of a finer grid passes", "a room with a block, two grids on the move",
         "RMS over eight frames of what is left after a straight line in time, over the mean", "half a finest voxel a frame",
         0.005, _border, SIX),
    Case("voxel-dolly", "cascades pop as the camera moves by less than a voxel", "a room with a block, two grids about a camera",
         "RMS change from one frame to the next, over the mean; the truth is 0", "frames 0.3 of a finest voxel apart", 0.01, _dolly,
         SIX),
    Case("voxel-pole", "what is thinner than a voxel hides too much or too little", "a pole on a floor under a grey sky",
         "deviation of the irradiance around its foot from path tracing", "the pole's width", 0.02, _pole, SIX),
    Case("voxel-corner", "a corner within a voxel is lost", "a black floor at a glowing wall",
         "deviation of the floor's irradiance from path tracing", "distance from the corner", 0.1, _corner, SIX),
)
