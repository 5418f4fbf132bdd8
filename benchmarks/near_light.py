"""The wall beside a glowing bar: as its probes say, as probes that were fitted say, and with the bar's own light at each point.

    python benchmarks/near_light.py [--rays 1024] [--nodes 4] [--threads 2]

A closed room 2 m wide with a bar of a metre. RMSE over the mean at 8 x 8 points of the wall against paths. Prints Markdown.
"""

import argparse
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "tests/support")]

import scene_builders as build  # noqa: E402

from rtgi_addon.evaluate.receivers import Receivers  # noqa: E402
from rtgi_addon.evaluate.references import PathReference  # noqa: E402
from rtgi_addon.progress import Progress  # noqa: E402
from rtgi_addon.techniques import get  # noqa: E402
from rtgi_addon.techniques.lattice.near_light import near_light  # noqa: E402
from rtgi_addon.transport.context import LightContext  # noqa: E402
from rtgi_addon.transport.rays.tracer import offset_origins  # noqa: E402

DISTANCES, SAMPLES, NOISE = (0.06, 0.1, 0.18, 0.33), 64, 0.02


def room(distance: float, nodes: int):
    """The room with the bar's side ``distance`` [m] off the wall at y = 1."""
    scene = build.scene([build.cube("room", 1.0, inward=True), build.cube("bar", 1.0, material_index=1)],
                        [build.material("wall", 0.5), build.material("glow", 0.0, 5.0)],
                        volumes=[build.volume(resolution=(nodes,) * 3, half_size=1.0)])
    bar = replace(scene.instances[1], world_from_local=build.transform((0.0, 0.98 - distance, 0.1), (0.5, 0.02, 0.03)))
    return replace(scene, instances=(scene.instances[0], bar))


def errors(distance: float, options) -> list[str]:
    """A row: the wall's light from probes, from fitted ones, and from probes with the bar's light at each point."""
    scene, technique = room(distance, options.nodes), get("probes")
    plain, fitted = (technique.bake(scene, technique.Settings(rays=options.rays, fit=fit), np.random.default_rng(1), Progress(),
                                    threads=options.threads) for fit in (False, True))
    side = np.linspace(-0.75, 0.75, 8)
    x, z = (part.ravel() for part in np.meshgrid(side, side))
    points = np.stack([x, np.ones_like(x), z], axis=1).astype(np.float32)
    normals = np.tile(np.float32([0, -1, 0]), (len(points), 1))
    receivers = Receivers(offset_origins(points, normals, normals), normals, np.ones(len(points), bool))
    true = PathReference(LightContext(scene, options.threads), NOISE, 1_000_000).irradiance(receivers).mean
    context = LightContext(scene, options.threads, whole=True)
    near = near_light(context, plain)

    def off(light) -> str:
        return f"{100 * np.sqrt(np.mean((light - true) ** 2)) / true.mean():.1f} %"

    def at_points():
        own = [near.irradiance(context, points, normals, normals, index) for index in range(SAMPLES)]
        return near.left.irradiance(points, normals) + np.mean(own, axis=0)

    refused = not any(grid.fitted for grid in fitted.grids())
    return [off(plain.irradiance(points, normals)), "refused" if refused else off(fitted.irradiance(points, normals)),
            "as probes" if near is None else off(at_points())]


def main():
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rays", type=int, default=1024)
    parser.add_argument("--nodes", type=int, default=4)
    parser.add_argument("--threads", type=int, default=2)
    options = parser.parse_args()
    print("| off the wall | probes | fitted | at each point |\n|---|---:|---:|---:|")
    for distance in DISTANCES:
        print(f"| {distance:g} m |", " | ".join(errors(distance, options)), "|", flush=True)


if __name__ == "__main__":
    main()
