"""What does fitting probes to how they are read do for light on surfaces, off them and in the air, and what does it cost?

    python benchmarks/fit.py [SAMPLE …] [--seeds 3] [--points 512]

For each sample, irradiance read from the probes of a bake at default settings, measured and fitted, held to the path tracer: at
points on surfaces under their own normals, and a fifth of a lattice cell off them under tilted ones, as in lookup.py; and at twice
as many points in the air, all over the volumes, each under a normal of its own. No bake has seen any of them; each seed draws
others and bakes anew. The relative RMSE has the reference's variance taken out. The leak is the mean at points on and off
surfaces that get less than a hundredth of the mean light, relative to that at the others. Seconds are those of all cores together.
Prints Markdown. Some minutes a sample and seed on two cores.
"""

from dataclasses import replace
from time import process_time

import numpy as np
from surface_errors import COLUMNS, figures, options_of, percent, row, show, table, yards

from rtgi_addon import techniques
from rtgi_addon.evaluate.measure import Yard
from rtgi_addon.evaluate.metrics import relative_rmse
from rtgi_addon.evaluate.receivers import Receivers
from rtgi_addon.numerics.grid import transform_points
from rtgi_addon.numerics.sampling import sphere_from_square
from rtgi_addon.progress import Progress
from rtgi_addon.techniques.base import BACKFACE_THRESHOLD
from rtgi_addon.techniques.lattice.placement import place_points

# How often points are drawn in the air before those that are still missing, inside geometry, are given up.
DRAWS = 8


def in_the_air(yard: Yard, count: int, seed: int) -> Receivers:
    """``count`` points all over the volumes, outside geometry, each under a normal of its own."""
    rng, volumes = np.random.default_rng([seed, 0x6F70]), yard.scene.volumes
    size = np.array([abs(np.linalg.det(np.asarray(volume.world_from_local)[:3, :3])) for volume in volumes])
    found = np.zeros((0, 3))
    for _ in range(DRAWS):
        owner = rng.choice(len(volumes), 2 * count, p=size / size.sum())
        local = rng.uniform(-1.0, 1.0, (len(owner), 3))
        points = np.concatenate([transform_points(volume.world_from_local, local[owner == number])
                                 for number, volume in enumerate(volumes)])
        placed = place_points(yard.context, volumes, points, np.sort(owner), False, Progress())
        found = np.concatenate([found, rng.permutation(points[placed.validity >= 1.0 - BACKFACE_THRESHOLD])])[:count]
        if len(found) == count:
            break
    return Receivers(found.astype(np.float32), sphere_from_square(rng.random((len(found), 2))).astype(np.float32),
                     np.zeros(len(found), bool))


def measured(yard: Yard, air: Receivers, air_truth, settings, seed: int) -> list[float]:
    """COLUMNS, the error in the air, and the CPU seconds of one bake."""
    started = process_time()
    field = techniques.get("probes").bake(yard.scene, settings, np.random.default_rng(seed), Progress())
    seconds = process_time() - started
    in_air = relative_rmse(field.irradiance(air.points, air.normals), air_truth.mean, air_truth.variance)
    return [*figures(yard, field.irradiance(yard.receivers.points, yard.receivers.normals)), in_air, seconds]


def compared(sample: str, options) -> np.ndarray:
    """What was ``measured`` (2, 6) of one sample, by probes as they were measured and fitted, averaged over seeds."""
    settings, runs = techniques.get("probes").Settings(), []
    for yard, seed in yards(sample, options):
        air = in_the_air(yard, 2 * options.points, seed)
        truth = yard.path_reference.irradiance(air)
        runs.append([measured(yard, air, truth, replace(settings, fit=fit), seed) for fit in (False, True)])
    return np.mean(runs, axis=0)


def main() -> None:
    """Measure what the command line names and print the table."""
    options = options_of(__doc__)
    lines, found = table("sample", *COLUMNS, "in the air", "CPU seconds", "after over before"), []
    for sample in options.samples:
        before, after = compared(sample, options)
        found.append(np.maximum(after, 1e-6) / np.maximum(before, 1e-6))
        cells = [f"{percent(was, digits)} → {percent(now, digits)}" for was, now, digits
                 in zip(before[:5], after[:5], (1, 1, 1, 2, 1), strict=True)]
        lines.append(row(sample, *cells, f"{before[5]:.1f} → {after[5]:.1f}", f"{after[5] / before[5]:.2f}"))
    means = np.exp(np.mean(np.log(found), axis=0))
    lines.append(row("geometric mean, after over before", *("" if np.isnan(mean) else f"{mean:.2f}" for mean in means[:5]), "",
                     f"{means[5]:.2f}"))
    show(lines)


if __name__ == "__main__":
    main()
