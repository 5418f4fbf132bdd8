"""How far a light atlas is from the path tracer on the surfaces that it covers, and how visible its seams are.

    python benchmarks/atlas.py [samples...] [--even] [--density 8] [--rays 256] [--points 384] [--noise 0.01] [--seed 7]

Every object of a sample is unwrapped as the panel does it (Blender's Smart UV Project, islands two texels apart), and its islands
are fitted to the light on them; `--even` leaves that out.
Error: relative RMSE of irradiance under the surfaces' own normals at points that rays from the volumes' open probes meet, less the
reference's noise. Steps: between what is read on both sides of a seam and, of places half a texel to both
sides of points inside islands, between what is read there; the largest of each, and the 99th percentile.
"""

import argparse
import sys
import time
from pathlib import Path

import bpy
import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

import rtgi_addon  # noqa: E402
from rtgi_addon.blender.extract import extract_scene  # noqa: E402
from rtgi_addon.blender.unwrap import unwrap  # noqa: E402
from rtgi_addon.effects.atlas.bake import bake_atlas  # noqa: E402
from rtgi_addon.effects.atlas.borders import seams_of  # noqa: E402
from rtgi_addon.effects.atlas.settings import AtlasSettings  # noqa: E402
from rtgi_addon.effects.atlas.sheet import bilinear  # noqa: E402
from rtgi_addon.effects.atlas.unwrapped import texture_space  # noqa: E402
from rtgi_addon.evaluate.metrics import relative_rmse  # noqa: E402
from rtgi_addon.evaluate.receivers import Receivers, open_probes  # noqa: E402
from rtgi_addon.evaluate.references import PathReference  # noqa: E402
from rtgi_addon.numerics.sampling import sphere_from_square  # noqa: E402
from rtgi_addon.techniques.lattice.focus import probes_of  # noqa: E402
from rtgi_addon.transport.context import LightContext  # noqa: E402

SAMPLES = ("cornell_box", "two_rooms", "sun_window")


def unwrapped(sample: str, density: float, fit: bool = False):
    """The scene of ``sample`` with all of its objects unwrapped and in the atlas, islands even or ``fit`` to their light."""
    path = Path(sample) if sample.endswith(".blend") else ROOT / "sample_blends" / f"{sample}.blend"
    bpy.ops.wm.open_mainfile(filepath=str(path.resolve()))
    for obj in bpy.context.scene.objects:
        if obj.type != "MESH" or obj.hide_render:
            continue
        obj.data = obj.data.copy()
        unwrap(bpy.context, obj, density)
        obj.rtgi.atlas, obj.rtgi.atlas_uv = True, "Lightmap"
    if fit:
        bpy.context.scene.rtgi.atlas.density = density
        bpy.ops.rtgi.fit_atlas()
    return extract_scene()


def points_on(context, atlas, count: int, seed: int):
    """Points of the atlas that rays from the volumes' probes meet: Receivers of those whose texels are known, and their places."""
    rng, geometry = np.random.default_rng(seed), context.geometry
    parts = {part.instance: part for part in atlas.sheet.parts}
    eyes = probes_of(context.scene.volumes)[open_probes(context, context.scene.volumes)]
    directions = sphere_from_square(rng.random((2 * count, 2)).astype(np.float32))
    hits = context.tracers.diffuse.intersect(eyes[rng.integers(len(eyes), size=len(directions))].astype(np.float32), directions)
    triangle = np.maximum(hits.primitive, 0)
    met = np.flatnonzero((hits.primitive >= 0) & np.isin(geometry.instance[triangle], list(parts))
                         & (np.einsum("ij,ij->i", geometry.normals_world[triangle], directions) < 0))[:count]
    triangle, u, v = triangle[met], hits.u[met], hits.v[met]
    places = np.zeros((len(met), 2))
    for index, part in parts.items():
        rows = np.flatnonzero(geometry.instance[triangle] == index)
        mesh = context.scene.meshes[context.scene.instances[index].mesh]
        st = texture_space(mesh.uv_layers[part.uv_map])[geometry.local_triangle[triangle[rows]]]
        a, b = u[rows, None].astype(np.float64), v[rows, None].astype(np.float64)
        places[rows] = (st[:, 0] * (1 - a - b) + st[:, 1] * a + st[:, 2] * b) * part.scale + part.offset
    known = bilinear(atlas.known.astype(np.float64), places) > 0.5
    smooth = context.surfaces.has_smooth_normals
    normals = context.surfaces.shading_normal(triangle, u, v) if smooth else geometry.normals_world[triangle]
    return Receivers(geometry.points(triangle, u, v)[known], normals[known], np.ones(known.sum(), bool)), places[known]


def steps(context, atlas, seed: int):
    """Largest step and 99th percentile of steps across seams, then of steps inside islands, in units of the mean irradiance."""
    sides = [np.concatenate(side) for side in zip(*(seams_of(part, context.scene) for part in atlas.sheet.parts), strict=True)]
    _, places = points_on(context, atlas, 20000, seed)
    rng = np.random.default_rng(seed)
    angle = rng.random(len(places)) * 2 * np.pi
    half = 0.5 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    inside = np.all([bilinear(atlas.known.astype(np.float64), places + sign * 2 * half) > 0.999 for sign in (-1, 1)], axis=0)
    light = [bilinear(atlas.irradiance, places[inside] + sign * half[inside]).mean(axis=1) for sign in (-1, 1)]
    mean = atlas.irradiance[atlas.known].mean()
    across = np.abs(np.subtract(*(bilinear(atlas.irradiance, side).mean(axis=1) for side in sides))) / mean
    within = np.abs(light[1] - light[0]) / mean
    return [(values.max(), np.quantile(values, 0.99)) if len(values) else (np.nan, np.nan) for values in (across, within)]


def main() -> None:
    """Measure, and print a table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("samples", nargs="*", default=SAMPLES)
    parser.add_argument("--even", action="store_true", help="leave islands as large as their surfaces")
    parser.add_argument("--density", type=float, default=8.0)
    parser.add_argument("--rays", type=int, default=256)
    parser.add_argument("--points", type=int, default=384)
    parser.add_argument("--noise", type=float, default=0.01)
    parser.add_argument("--seed", type=int, default=7, help="of the points")
    options = parser.parse_args()
    rtgi_addon.register()
    lines = ["| sample | sheet | texels | CPU time | error | noise of reference | seams, largest (99 %) | inside, largest (99 %) |",
             "|---|---:|---:|---:|---:|---:|---:|---:|"]
    for sample in options.samples:
        scene = unwrapped(sample, options.density, not options.even)
        started = time.process_time()
        atlas = bake_atlas(scene, None, AtlasSettings(density=options.density, rays=options.rays)).atlas
        seconds = time.process_time() - started
        context = LightContext(scene)
        receivers, places = points_on(context, atlas, options.points, options.seed)
        truth = PathReference(context, options.noise).irradiance(receivers)
        error = relative_rmse(atlas.read(places, receivers.normals), truth.mean, truth.variance)
        across, within = steps(context, atlas, 8)
        lines.append(f"| {sample} | {atlas.sheet.size[1]} x {atlas.sheet.size[0]} | {atlas.known.sum():,} | {seconds:.1f} s | "
                     f"{100 * error:.2f} % | {100 * truth.noise:.2f} % | {100 * across[0]:.1f} ({100 * across[1]:.1f}) % | "
                     f"{100 * within[0]:.1f} ({100 * within[1]:.1f}) % |")
    print("\n".join(["", *lines]))


if __name__ == "__main__":
    main()
