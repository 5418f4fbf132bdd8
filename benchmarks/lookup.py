"""How far off is the light that is read from probes, on surfaces and in the open, and how much of it is in dark rooms?

    python benchmarks/lookup.py [SAMPLE …] [--seeds 3] [--points 512]

For each sample, irradiance at points on surfaces under their own normals and a fifth of a lattice cell off them under tilted ones,
by the probes of a bake at default settings, held to the path tracer; each seed draws other points and bakes anew. The relative RMSE
has the reference's variance taken out. The leak is the mean at points that get less than a hundredth of the mean light, relative to
that at the others. Prints Markdown. A minute or two a sample and seed on two cores.
"""

import numpy as np
from surface_errors import COLUMNS, figures, options_of, percent, row, show, table, yards

from rtgi_addon import techniques


def main() -> None:
    """Measure what the command line names and print the table."""
    options, technique = options_of(__doc__), techniques.get("probes")
    lines = table("sample", *COLUMNS)
    for sample in options.samples:
        found = [figures(yard, yard.measure(technique, technique.Settings(), seed).estimates["surface"])
                 for yard, seed in yards(sample, options)]
        *errors, leak = np.mean(found, axis=0)
        lines.append(row(sample, *(percent(error) for error in errors), percent(leak, 2)))
    show(lines)


if __name__ == "__main__":
    main()
