"""How many probes does scattered placement leave, and how far off is the light that is read from them?

    python benchmarks/scattered.py [SAMPLE …] [--seeds 3] [--points 512]

For each sample, errors at receivers as in lookup.py, of bakes at the error of the preset preview: the sample's lattice, half of it
along each axis, and probes scattered no denser than the lattice, thinned by several errors. Bytes are those of SH and distances in
the halves that engines hold, with the words of a scattered volume's nodes. Prints Markdown.
"""

from dataclasses import replace

import numpy as np
from surface_errors import COLUMNS, figures, options_of, percent, row, show, table, yards

from rtgi_addon import techniques
from rtgi_addon.evaluate.measure import scaled_resolution
from rtgi_addon.progress import Progress
from rtgi_addon.techniques.scattered.scatter import scatter
from rtgi_addon.techniques.scattered.settings import SCATTERED, ScatterSettings

THINNING = (0.02, 0.05, 0.1)


def size_of(field) -> int:
    """Bytes of the probes of ``field`` in an engine."""
    total = 0
    for grid in field.grids():
        total += grid.validity.size * (8 * 9 + 4 * (grid.visibility_size + 2) ** 2)
        total += 0 if grid.volume.scattered is None else 4 * grid.volume.scattered.index.size
    return total


def main() -> None:
    """Measure what the command line names and print the table."""
    options, technique = options_of(__doc__), techniques.get("probes")
    settings = technique.Settings(**technique.presets["preview"])
    lines = table("sample", "placement", "probes", "kB", *COLUMNS)
    for sample in options.samples:
        found = {}
        for yard, seed in yards(sample, options):
            coarse = replace(yard.scene, volumes=tuple(
                replace(volume, resolution=scaled_resolution(volume.resolution, 0.5)) for volume in yard.scene.volumes))
            scenes = {"lattice": yard.scene, "half of it": coarse}
            for error in THINNING:
                chosen = ScatterSettings(SCATTERED, error)
                scenes[f"scattered, {error:g}"] = scatter(yard.scene, chosen, settings, seed, yard.threads, Progress()).scene
            for name, scene in scenes.items():
                field = technique.bake(scene, settings, np.random.default_rng(seed), Progress(), threads=yard.threads)
                light = field.irradiance(yard.receivers.points, yard.receivers.normals)
                probes = sum(int(grid.counts.sum()) for grid in field.grids())
                found.setdefault(name, []).append([probes, size_of(field) / 1000.0, *figures(yard, light)])
        for name, rows in found.items():
            probes, size, *errors, leak = np.mean(rows, axis=0)
            lines.append(row(sample, name, f"{probes:,.0f}", f"{size:,.0f}", *(percent(error) for error in errors),
                             percent(leak, 2)))
    show(lines)


if __name__ == "__main__":
    main()
