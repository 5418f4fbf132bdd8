"""Light that goes through walls: thin ones, turned ones, ones that fall anywhere in the lattice; and bounces that make more of it.

Sources: M. Majercik et al., JCGT 8(2), 2019 (probes behind walls); C. Dachsbacher and M. Stamminger, I3D 2005, section 5
(RSM without visibility); A. Kaplanyan and C. Dachsbacher, I3D 2010 (blocking in light propagation volumes).
"""

from dataclasses import replace

import numpy as np

from .case import LOOKUP, Bench, Case, Sample, Variant
from .parts import box, brightness, grey, moved, point, quad, receivers, rotation, scene, spot, turned, volume

# Side of a lattice cell [m], and half lengths of the pair of rooms.
CELL, HALF = 0.5, np.array([2.0, 1.0, 1.0])
TRILINEAR = Variant("plain trilinear", {LOOKUP: {"visibility": False, "normal_weight": False}})
BACKFACE = Variant("normal weight alone", {LOOKUP: {"visibility": False}})
FITTED = Variant("fitted to surfaces", {"fit": True}, remedy=True)
VISIBLE = Variant("shadow rays to texels", {"visibility": True}, remedy=True)


def two_rooms(cells: float = 0.1, albedo: float = 0.7):
    """A lit room at −x and a black one at +x, with a wall of ``cells`` lattice cells between them; receivers of the lit one, then
    of the dark one."""
    half = 0.5 * cells * CELL
    wall = box("wall", (-half, -1.02, -1.02), (half, 1.02, 1.02))
    built = scene("two rooms", [box("rooms", -HALF, HALF, inward=True), wall], [grey(albedo)], [point((-1.3, 0.2, 0.3), 2.0)],
                  volumes=[volume(-HALF, HALF, np.round(2 * HALF / CELL))])
    return built, receivers(-HALF, (-half, 1, 1)), receivers((half, -1, -1), HALF)


def leak(field, lit, dark) -> float:
    """Mean irradiance of the dark receivers over that of the lit ones."""
    return float(brightness(field, *dark).mean() / brightness(field, *lit).mean())


def _wall_thickness(bench: Bench) -> list[Sample]:
    samples = []
    for cells in (0.01, 0.1, 0.5, 1.0, 2.0):
        built, lit, dark = two_rooms(cells)
        field = bench.bake(built, **_coarse(bench))
        samples.append(Sample(f"{cells:g} cells", leak(field, lit, dark), built, field))
    return samples


def _phase(bench: Bench) -> list[Sample]:
    samples = []
    built, lit, dark = two_rooms()
    for phase in (0.0, 0.2, 0.4, 0.6, 0.8):
        shift = np.eye(4)
        shift[:3, 3] = phase * CELL * np.array([1.0, 0.37, 0.61])
        shifted = moved(built, shift, volumes=False)
        field = bench.bake(shifted, **_coarse(bench))
        samples.append(Sample(f"{phase:g} of a cell", leak(field, turned(*lit, shift), turned(*dark, shift)), shifted, field))
    return samples


def _rotation(bench: Bench) -> list[Sample]:
    samples = []
    built, lit, dark = two_rooms()
    for degrees in (0.0, 10.0, 27.0, 45.0):
        turn = rotation((0.2, 0.1, 1.0), degrees)
        reach = np.abs(turn[:3, :3]) @ HALF
        resolution = np.ceil(2 * reach / CELL)
        covering = volume(-0.5 * CELL * resolution, 0.5 * CELL * resolution, resolution)
        rotated = replace(moved(built, turn), volumes=(covering,))
        field = bench.bake(rotated, **_coarse(bench))
        samples.append(Sample(f"{degrees:g} degrees", leak(field, turned(*lit, turn), turned(*dark, turn)), rotated, field))
    return samples


def _feedback(bench: Bench) -> list[Sample]:
    built, lit, dark = two_rooms(albedo=0.9)
    samples = []
    for name, settings in (("one bounce", {"bounces": 1, "further_bounces": False}), ("all bounces", {})):
        field = bench.bake(built, **_coarse(bench), **settings)
        samples.append(Sample(name, leak(field, lit, dark), built, field))
    return samples


def baffle_scene():
    """A spot lights the floor before a baffle in the open; receivers on the baffle's lit face, and on a wall behind it whose every
    line to the lit floor goes through the baffle."""
    built = scene("baffle", [quad("floor", (-3, -3, 0), (6, 0, 0), (0, 6, 0)), box("baffle", (0, -3, 0), (0.1, 3, 3)),
                             quad("wall behind", (2.5, -3, 0), (0, 0, 3), (0, 6, 0))],
                  [grey(0.7)], [spot((-1.5, 0, 2.5), (-1.5, 0, 0), 5.0, 50.0)],
                  volumes=[volume((-2.5, -2, 0), (2.5, 2, 2), (10, 8, 4))])
    y, z = (grid.ravel() for grid in np.meshgrid(np.linspace(-1, 1, 5), np.linspace(0.3, 1.6, 5)))
    front, back = (np.stack([np.full(25, x), y, z], axis=1).astype(np.float32) for x in (0.0, 2.5))
    facing = np.tile(np.float32([-1, 0, 0]), (25, 1))
    return built, (front, facing), (back, facing)


def _baffle(bench: Bench) -> list[Sample]:
    built, lit, dark = baffle_scene()
    field = bench.bake(built, bounces=1, further_bounces=False, **_coarse(bench))
    return [Sample("behind it", leak(field, lit, dark), built, field)]


def _coarse(bench: Bench) -> dict:
    """Settings that are cheap and as good as any for a leak; a cell of the light volumes is half one of the probes."""
    return {"probes": {"error": 0.05}, "vpl": {"lights": 512, "candidates": 4}, "rsm": {"resolution": 128},
            "lpv": {"resolution": 24, "cell_size": 0.5 * CELL, "map_resolution": 64, "steps": 128}}[bench.technique]


CASES = (
    Case("wall-thickness", "light leaks through a thin wall", "two closed rooms side by side, a lamp in one",
         "mean irradiance of the dark room's walls over that of the lit room's; the truth is 0", "the wall's thickness",
         0.005, _wall_thickness,
         {"probes": (TRILINEAR, BACKFACE, FITTED), "rsm": (VISIBLE,), "lpv": (Variant("without blocking", {"blocking": False}),)}),
    Case("lattice-phase", "a leak that comes and goes with the lattice's position", "the two rooms, wall of 0.1 cells",
         "as wall-thickness", "the lattice's phase against the wall", 0.005, _phase, {"probes": (TRILINEAR, BACKFACE, FITTED)}),
    Case("lattice-rotation", "a leak that comes and goes with the lattice's rotation", "the two rooms, turned about a slanted axis",
         "as wall-thickness", "the angle", 0.005, _rotation, {"probes": (TRILINEAR, BACKFACE, FITTED)}),
    Case("leak-feedback", "bounces feed a leak", "the two rooms with walls of albedo 0.9", "as wall-thickness",
         "one bounce, then all", 0.005, _feedback, {"probes": (FITTED,)}),
    Case("baffle", "bounced light passes a baffle", "a spot before a baffle in the open; of one bounce nothing gets behind it",
         "irradiance behind over that on the baffle's lit face; the truth is 0", "none", 0.005, _baffle,
         {"rsm": (VISIBLE,), "probes": (TRILINEAR, BACKFACE, FITTED), "lpv": (Variant("without blocking", {"blocking": False}),)}),
)
