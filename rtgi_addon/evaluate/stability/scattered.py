"""Where probes that are scattered fail: light from another storey, from the wrong side of a wall, and steps where cells meet.

Source: M. Gilabert and N. Stefanov, GDC 2012 (a grid that names the nearest probe of each cell).
"""

import numpy as np

from ...progress import Progress
from ...scene import Scene
from ...techniques.probes.settings import ProbeSettings
from ...techniques.scattered.scatter import scatter
from ...techniques.scattered.settings import SCATTERED, ScatterSettings
from .case import Bench, Case, Sample
from .leaks import BACKFACE, CELL, TRILINEAR, leak, two_rooms
from .parts import box, brightness, grey, point, receivers, scene, volume

# Steps of a receiver that crosses cells, and its way through the lit room.
STEPS, FROM, TO = 2000, (-1.8, -0.7, -0.6), (-0.3, 0.6, 0.7)
_ERROR = 0.05


def scattered(bench: Bench, built: Scene) -> Scene:
    """``built`` with its probes scattered."""
    return scatter(built, ScatterSettings(SCATTERED), ProbeSettings(error=_ERROR), bench.seed, bench.threads, Progress()).scene


def house(thickness: float):
    """Two storeys of 4 × 4 × 2.5 m with a floor of that ``thickness`` [m] between them and a lamp in the upper one; receivers of
    the upper, then of the lower one."""
    lower, upper = ((-2, -2, -2.5 - thickness), (2, 2, -thickness)), ((-2, -2, 0), (2, 2, 2.5))
    low, high = np.array(lower[0]), np.array(upper[1])
    built = scene("house", [box("lower", *lower, inward=True), box("upper", *upper, inward=True)], [grey(0.7)],
                  [point((0.3, 0.2, 1.6), 4.0)], volumes=[volume(low, high, np.round((high - low) / (1.6 * CELL)))])
    return built, receivers(*upper), receivers(*lower)


def _storeys(bench: Bench) -> list[Sample]:
    samples = []
    for thickness in (0.02, 0.2, 0.5):
        built, lit, dark = house(thickness)
        built = scattered(bench, built)
        field = bench.bake(built, error=_ERROR)
        samples.append(Sample(f"{thickness:g} m", leak(field, lit, dark), built, field))
    return samples


def _wall(bench: Bench) -> list[Sample]:
    samples = []
    for cells in (0.02, 0.1, 0.5, 1.0):
        built, lit, dark = two_rooms(cells)
        built = scattered(bench, built)
        field = bench.bake(built, error=_ERROR)
        samples.append(Sample(f"{cells:g} cells", leak(field, lit, dark), built, field))
    return samples


def _border(bench: Bench) -> list[Sample]:
    """A receiver that crosses cells under each normal: how much its steps of light change from one to the next, at most; a jump is
    such a change, a slope is none."""
    built, *_ = two_rooms()
    built = scattered(bench, built)
    field = bench.bake(built, error=_ERROR)
    share = np.linspace(0.0, 1.0, STEPS)[:, None]
    way = ((1.0 - share) * FROM + share * TO).astype(np.float32)
    samples = []
    for name, normal in (("up", (0, 0, 1)), ("aside", (1, 0, 0))):
        light = brightness(field, way, np.tile(np.float32(normal), (STEPS, 1)))
        samples.append(Sample(name, float(np.abs(np.diff(light, n=2)).max() / light.mean()), built, field))
    return samples


CASES = (
    Case("scattered-storeys", "scattered probes light another storey", "two storeys, a lamp in the upper one, probes scattered",
         "mean irradiance of the lower storey's walls over that of the upper one's; the truth is 0", "the thickness of the floor",
         0.005, _storeys, {"probes": (TRILINEAR, BACKFACE)}),
    Case("scattered-wall", "scattered probes light the wrong side of a wall", "the two rooms, probes scattered",
         "as wall-thickness", "the wall's thickness", 0.005, _wall, {"probes": (TRILINEAR, BACKFACE)}),
    Case("scattered-border", "light steps where cells of scattered probes meet", "a receiver that glides through the lit room",
         "largest change between two of 2,000 steps of its light, over the mean", "its normal", 0.002, _border),
)
