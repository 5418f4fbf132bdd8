"""Geometry that a technique meets anywhere: solids over the lattice, corners, meshes that are not what they should be, any scale.

Sources: M. Majercik et al., "Dynamic Diffuse Global Illumination with Ray-Traced Irradiance Fields", JCGT 8(2), 2019 (relocation,
the normal bias); T. Kollig and A. Keller, MCQMC 2004 (virtual lights near corners).
"""

from dataclasses import replace
from itertools import pairwise

import numpy as np

from ...errors import BakeError
from ...scene import Scene
from ...scene.checks import check_scene, require
from ...transport.context import LightContext
from ...transport.paths.reference import irradiance_at
from .case import LOOKUP, Bench, Case, Sample, Variant
from .parts import (
    ONE,
    REFERENCE_SEED,
    box,
    brightness,
    grey,
    mesh,
    moved,
    point,
    quad,
    receivers,
    rms_change,
    room_with_block,
    scene,
    turned,
    volume,
)


def _solid_phase(bench: Bench) -> list[Sample]:
    """The change of irradiance a phase step, at points of the walls and of the block."""
    built, cell = room_with_block(), 0.5
    walls, block = receivers(-ONE, ONE, 3), receivers((-0.1, -0.4, -1.0), (0.6, 0.4, -0.2), 2)
    top = block[1][:, 2] > -0.5
    points, normals = np.concatenate([walls[0], block[0][top]]), np.concatenate([walls[1], -block[1][top]])
    frames, samples = [], []
    for step in range(9):
        shift = np.eye(4)
        shift[:3, 3] = step / 8 * cell * np.array([1.0, 0.6, 0.8])
        shifted = moved(built, shift, volumes=False)
        field = bench.bake(shifted, **_coarse(bench))
        frames.append(brightness(field, *turned(points, normals, shift)))
        samples.append((shifted, field))
    mean = np.mean(frames)
    changes = [np.sqrt(np.mean((after - before) ** 2)) / mean for before, after in pairwise(frames)]
    return [Sample(f"{step}/8 of a cell", float(change), *samples[step + 1]) for step, change in enumerate(changes)]


def _grazing_corner(bench: Bench) -> list[Sample]:
    """Too much light, relative to the mean, near the edge of a corner that probes see at a grazing angle."""
    low, high = np.array([-2.0, -1.0, -1.0]), np.array([2.0, 1.0, 1.0])
    # The lamp stands round a corner: a partition leaves a gap on one side, and its end is the edge.
    partition = box("partition", (-0.05, -1.0, -1.0), (0.05, 0.3, 1.0))
    built = scene("corner", [box("room", low, high, inward=True), partition], [grey(0.5)], [point((-1.2, -0.5, 0.1), 2.0)],
                  volumes=[volume(low, high, (8, 4, 4))])
    z = np.linspace(-0.7, 0.7, 8)
    samples, field = [], bench.bake(built, **_coarse(bench))
    context = LightContext(built, bench.threads)
    for share in (0.01, 0.05, 0.2, 0.5, 1.0):
        distance = share * 0.5
        points = np.concatenate([
            np.stack([np.full(8, 0.05), np.full(8, 0.3 - distance), z], axis=1),     # the partition's dark face, by its end
            np.stack([np.full(8, 0.05 + distance), np.full(8, -1.0), z], axis=1),    # the wall that meets it
            np.stack([np.full(8, 0.05 + distance), 0.6 * z - 0.3, np.full(8, -1.0)], axis=1)]).astype(np.float32)
        normals = np.repeat(np.float32([[1, 0, 0], [0, 1, 0], [0, 0, 1]]), 8, axis=0)
        exact = irradiance_at(context, points, normals, 1024, bounces=_bounces(bench), seed=REFERENCE_SEED)
        mean = exact.mean.mean()
        excess = (brightness(field, points, normals) - exact.mean.mean(axis=1)).reshape(3, 8).mean(axis=1) / mean
        samples.append(Sample(f"{share:g} cells away", float(max(excess.max(), 0.0)), built, field))
    return samples


def _edge_bias(bench: Bench) -> list[Sample]:
    """Too much or too little light along the edge of a plain room, relative to the truth there."""
    built = scene("room", [box("room", -ONE, ONE, inward=True)], [grey(0.6)], [point((0.3, -0.2, 0.4), 1.0)],
                  volumes=[volume(-ONE, ONE, (4, 4, 4))])
    context, field = LightContext(built, bench.threads), bench.bake(built, **_coarse(bench))
    along = np.linspace(-0.8, 0.8, 9)
    samples = []
    for distance in (0.005, 0.02, 0.1, 0.3):
        points = np.concatenate([np.stack([along, np.full(9, -1.0), np.full(9, -1 + distance)], axis=1),
                                 np.stack([np.full(9, 1 - distance), along, np.full(9, 1.0)], axis=1)]).astype(np.float32)
        normals = np.repeat(np.float32([[0, 1, 0], [0, 0, -1]]), 9, axis=0)
        exact = irradiance_at(context, points, normals, 1024, bounces=_bounces(bench), seed=REFERENCE_SEED).mean.mean(axis=1)
        ratio = brightness(field, points, normals) / exact
        samples.append(Sample(f"{distance:g} m from the edge", float(abs(ratio.mean() - 1.0)), built, field))
    return samples


def _bounces(bench: Bench) -> int | None:
    return 1 if bench.technique == "rsm" else None


def _odd_scenes() -> dict[str, Scene]:
    """Scenes that ought to be lit as ``room_with_block`` is, each with something wrong with its meshes."""
    plain = room_with_block()
    room, block = plain.meshes
    flipped = replace(room, triangles=room.triangles[:, ::-1].copy())
    half_flipped = replace(block, triangles=np.concatenate([block.triangles[:6], block.triangles[6:, ::-1]]))
    slivers = mesh("block", np.concatenate([block.vertices_local, block.vertices_local[:1]]),
                   np.concatenate([block.triangles, [[0, 8, 1], [2, 2, 2]]]))
    fin = quad("fin", (-0.1, -0.4, -1.0), (0.35, 0.4, 0.0), (0, 0, 0.8))
    return {"flipped walls": _with(plain, flipped, block), "half the block's normals flipped": _with(plain, room, half_flipped),
            "faces without area": _with(plain, room, slivers), "the block twice": _with(plain, room, block, block),
            "a fin inside the block": _with(plain, room, block, fin),
            "albedo 1.2 on what no light meets": replace(
                _with(plain, room, block, box("kernel", (0.1, -0.1, -0.8), (0.3, 0.1, -0.6), material=1)),
                materials=(*plain.materials, grey(1.2, name="too white")))}


def _with(plain: Scene, *meshes) -> Scene:
    return replace(scene(plain.name, meshes, plain.materials, plain.lights), volumes=plain.volumes)


def _degenerate(bench: Bench) -> list[Sample]:
    """The change of mean irradiance on the walls by what should change nothing."""
    points, normals = receivers(-ONE, ONE, 4)
    expected = brightness(bench.bake(room_with_block(), **_coarse(bench)), points, normals)
    samples = []
    for name, odd in _odd_scenes().items():
        field = bench.bake(odd, **_coarse(bench))
        samples.append(Sample(name, rms_change(brightness(field, points, normals), expected), odd, field))
    return samples


def _lattice_on_walls(bench: Bench) -> list[Sample]:
    """The error of mean irradiance where a layer of probes lies in a wall's very plane, or cells end on it."""
    points, normals = receivers(-ONE, ONE, 4)
    built = room_with_block()
    expected = irradiance_at(LightContext(built, bench.threads), points, normals, 512, bounces=_bounces(bench), seed=REFERENCE_SEED)
    truth, samples = expected.mean.mean(axis=1), []
    for name, low, high, count in (("cells end on the walls", -1.0, 1.0, 4), ("probes on the walls", -1.25, 1.25, 5),
                                   ("probes 0.1 mm inside the walls", -1.2501, 1.2501, 5),
                                   ("probes 0.1 mm before the walls", -1.2499, 1.2499, 5)):
        placed = replace(built, volumes=(volume(low * ONE, high * ONE, (count,) * 3),))
        field = bench.bake(placed, **_coarse(bench))
        samples.append(Sample(name, float(abs(brightness(field, points, normals).mean() / truth.mean() - 1.0)), placed, field))
    return samples


def _refusals(bench: Bench) -> list[Sample]:
    """0 for each broken scene that is refused by a BakeError which names the culprit, 1 for one that is not."""
    plain = room_with_block()
    room, block = plain.meshes
    torn = replace(block, vertices_local=np.where(np.arange(8)[:, None] == 3, np.float32(np.nan), block.vertices_local))
    instances = (plain.instances[0], replace(plain.instances[1], world_from_local=np.full((4, 4), np.nan)))
    broken = {"a NaN vertex": (_with(plain, room, torn), "block"), "no geometry": (_with(plain), plain.name),
              "a NaN transform": (replace(plain, instances=instances), "block"),
              "a NaN albedo": (replace(plain, materials=(grey(np.nan),)), "wall")}
    samples = []
    for name, (built, culprit) in broken.items():
        try:
            require(check_scene(built))
            bench.bake(built, **_coarse(bench))
            refused = False
        except BakeError as error:
            refused = culprit in error.cause
        samples.append(Sample(name, 0.0 if refused else 1.0))
    return samples


def _scale(bench: Bench) -> list[Sample]:
    """The change of irradiance when the whole scene, its lattice and its light grow together."""
    points, normals = receivers(-ONE, ONE, 3)
    built, samples, expected = room_with_block(), [], None
    for name, scale, offset in (("2 m", 1.0, 0.0), ("1 mm", 0.5e-3, 0.0), ("10 km", 5e3, 0.0), ("2 m, 100 m away", 1.0, 100.0),
                                ("10 km, 500 km away", 5e3, 5e5)):
        grown = np.diag([scale, scale, scale, 1.0])
        grown[:3, 3] = offset
        taken = moved(built, grown, intensity=scale * scale)
        field = bench.bake(taken, **_coarse(bench))
        seen = brightness(field, *turned(points, normals, grown))
        expected = seen if expected is None else expected
        samples.append(Sample(name, rms_change(seen, expected), taken, field))
    return samples


def _coarse(bench: Bench) -> dict:
    return {"probes": {"error": 0.02}, "vpl": {"lights": 1024, "candidates": 4}, "rsm": {"resolution": 256},
            "lpv": {"map_resolution": 64, "steps": 128}}[bench.technique]


CASES = (
    Case("probe-in-geometry", "probes jump as they enter geometry", "a room with a block, four probes a side",
         "RMS change of irradiance on walls and block from one step to the next, over its mean", "the lattice's phase in eighths",
         0.05, _solid_phase, {"probes": (Variant("without virtual offset", {"virtual_offset": False}),)}),
    Case("grazing-corner", "corners too bright where probes see them at a grazing angle",
         "a lamp round the end of a partition, probes half a metre apart",
         "light too much, averaged along a line beside the edge, over the mean there by path tracing", "distance from the edge",
         0.1, _grazing_corner, {"probes": (Variant("without normal bias", {LOOKUP: {"normal_bias": 0.0}}),),
                                "rsm": (Variant("shadow rays to texels", {"visibility": True}, remedy=True),)}),
    Case("edge-bias", "edges of a room too bright or too dark", "a plain room with a lamp",
         "deviation of the mean along two edges from path tracing", "distance from the edge", 0.05, _edge_bias,
         {"probes": (Variant("without normal bias", {LOOKUP: {"normal_bias": 0.0}}),)}),
    Case("degenerate-mesh", "meshes that are not manifold", "a room with a block, and odd copies of it",
         "RMS change of irradiance on the walls, over its mean", "what is odd", 0.03, _degenerate),
    Case("lattice-on-walls", "a layer of the lattice in the plane of a wall", "a room with a block",
         "error of the walls' mean irradiance against path tracing", "where the layer lies", 0.05, _lattice_on_walls,
         {"probes": (Variant("without virtual offset", {"virtual_offset": False}),
                     Variant("without virtual offset, bias and lift", {"virtual_offset": False, LOOKUP: {"normal_bias": 0.0}}))}),
    Case("refusal", "broken input baked all the same", "a room with a block, broken",
         "1 if it is not refused with the culprit's name", "what is broken", 0.0, _refusals),
    Case("scale", "results that depend on the scene's size or place", "a room with a block, its lamp as strong as its size asks",
         "RMS change of irradiance on the walls, over its mean", "size and distance from the origin", 0.02, _scale),
)
