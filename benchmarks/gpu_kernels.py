"""Milliseconds of the techniques' inner loops on a GPU in a bare OpenGL context, without Blender, beside numpy on every core.

    python benchmarks/gpu_kernels.py [--receivers 100000] [--repeats 7] [--cells 32] [--steps 8]

Needs moderngl (pip install moderngl). The GPU's time is that of its work alone, with everything on the GPU already, until it says
that it has finished; numpy's is that of the same step. Medians count. The last column is the largest difference between the two,
relative to the largest value. Prints Markdown.
"""

import argparse
import sys
import time
from pathlib import Path
from statistics import median

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "tests/support")]

import scene_builders as build  # noqa: E402
from shadow_maps import prepared  # noqa: E402

from benchmarks.bare_gl import BareContext  # noqa: E402
from rtgi_addon.preview import programs  # noqa: E402
from rtgi_addon.preview.atlas import Atlas  # noqa: E402
from rtgi_addon.preview.packing import FLUX_SCALE, face_blocks, fold, light_rows, map_texels, step_values, unfold  # noqa: E402
from rtgi_addon.techniques.lpv.geometry_volume import Surfels, face_blocking, inject_surfels  # noqa: E402
from rtgi_addon.techniques.lpv.grid import LpvGrid  # noqa: E402
from rtgi_addon.techniques.lpv.propagation import propagate  # noqa: E402
from rtgi_addon.techniques.rsm.gather import Pattern, gather, rotations  # noqa: E402
from rtgi_addon.techniques.vpl.gather import gather_visible  # noqa: E402
from rtgi_addon.techniques.vpl.virtual_lights import VirtualLights  # noqa: E402

CHANNELS = ("red", "green", "blue")


def on_gpu(bare: BareContext, repeats: int, work) -> float:
    """Median milliseconds of ``work()`` until the GPU has finished, after a run that is not counted."""
    work()
    bare.gl.finish()
    found = []
    for _ in range(repeats):
        started = time.perf_counter()
        work()
        bare.gl.finish()
        found.append(1e3 * (time.perf_counter() - started))
    return median(found)


def on_cpu(repeats: int, work):
    """The result of ``work()`` and its median milliseconds."""
    result, found = work(), []
    for _ in range(repeats):
        started = time.perf_counter()
        result = work()
        found.append(1e3 * (time.perf_counter() - started))
    return result, median(found)


def unit(rng, count: int) -> np.ndarray:
    """Random directions (n, 3) float32."""
    vectors = rng.normal(size=(count, 3))
    return (vectors / np.linalg.norm(vectors, axis=1, keepdims=True)).astype(np.float32)


def row(name: str, gpu: float, cpu: float, difference: float) -> str:
    """One line of the table."""
    return f"| {name} | {gpu:.2f} | {cpu:.1f} | {cpu / gpu:.1f} | {difference:.0e} |"


def propagation(bare: BareContext, cells: int, steps: int, repeats: int) -> str:
    """A light propagation volume among random blockers."""
    rng, grid = np.random.default_rng(0), LpvGrid((0.0, 0.0, 0.0), 1.0, (cells,) * 3)
    count = 4 * cells**2
    surfels = Surfels(rng.random((count, 3)) * cells, unit(rng, count), rng.random(count), rng.random((count, 3)))
    blocking, atlas = face_blocking(inject_surfels(grid, surfels)), Atlas.of(grid.resolution)
    light = rng.random((4, 3, cells, cells, cells), dtype=np.float32)
    faces, blockers, kept = (bare.upload(texels) for texels in face_blocks(atlas, blocking))
    first = [bare.upload(atlas.pack(np.moveaxis(light[:, channel], 0, -1) * FLUX_SCALE)) for channel in range(3)]
    spare = [[bare.empty(*atlas.size) for _ in CHANNELS] for _ in range(2)]
    total = [bare.empty(*atlas.size) for _ in CHANNELS]
    values = {**step_values(atlas, blocking), "accumulate": 1}

    def work():
        current = first
        for step in range(steps):
            following = spare[step % 2]
            images = {f"{kind}_{name}": textures[i] for kind, textures in (("next", following), ("total", total))
                      for i, name in enumerate(CHANNELS)}
            bare.dispatch(programs.LPV_PROPAGATE, atlas.size, uniforms={"parameters": values}, images=images,
                          samplers={**{f"light_{name}": current[i] for i, name in enumerate(CHANNELS)}, "faces": faces,
                                    "blockers": blockers, "kept": kept})
            current = following

    gpu = on_gpu(bare, repeats, work)
    expected, cpu = on_cpu(repeats, lambda: propagate(light, blocking, steps))
    # The image sums up over all runs: start it again for the comparison.
    total[:] = [bare.empty(*atlas.size) for _ in CHANNELS]
    work()
    found = np.stack([np.moveaxis(atlas.unpack(bare.download(part)) / FLUX_SCALE, -1, 0) for part in total], axis=1)
    found += light * blocking.area.reshape(grid.shape)
    return row(f"LPV propagation, {cells}³ cells, {steps} steps, blocking", gpu, cpu,
               np.abs(found - expected).max() / expected.max())


def receivers_of(bare: BareContext, count: int, rows: np.ndarray):
    """The texture of receivers and the image of their irradiance."""
    texels = fold(rows)
    width = min(count, 4096)
    return bare.upload(texels), bare.empty(width, -(-count // width))


def virtual_lights(bare: BareContext, count: int, repeats: int) -> str:
    """1,000 virtual point lights, all of them seen."""
    rng = np.random.default_rng(1)
    lights = VirtualLights.of(4 * rng.random((1000, 3)), unit(rng, 1000), rng.random((1000, 3)))
    points, normals = (4 * rng.random((count, 3))).astype(np.float32), unit(rng, count)
    rows = np.zeros((count, 7), np.float32)
    rows[:, :3], rows[:, 4:] = points, normals
    receivers, image = receivers_of(bare, count, rows)
    samplers = {"receivers": receivers, "lights": bare.upload(fold(light_rows(lights))), "visibility": bare.empty(1, 1)}
    values = {"count": count, "first_row": 0, "lights": lights.count, "has_visibility": 0, "clamp_at": 10.0}
    return gathered(bare, f"1,000 VPLs × {count:,} receivers, unshadowed", programs.VPL_GATHER, image, values, samplers, repeats,
                    count, lambda: gather_visible(lights, points, normals, None, 10.0))


def shadow_map(bare: BareContext, count: int, repeats: int) -> str:
    """One reflective shadow map of 512² texels, 400 samples a receiver."""
    scene = build.open_plane(world=0.0, half_size=4.0)
    lamp = build.point_light((0.0, 0.0, 2.0))
    _, maps = prepared(build.scene(scene.meshes, scene.materials, [lamp], volumes=scene.volumes), 512, threads=None)
    item, pattern, rng = maps[-1], Pattern(), np.random.default_rng(2)
    points, normals = (4 * rng.random((count, 3)) - 2).astype(np.float32), unit(rng, count)
    points[:, 2] = 0.1 + 3 * rng.random(count)
    shift = rotations(points, pattern.seed)
    receivers, image = receivers_of(
        bare, count, np.concatenate([points, shift[:, :1], normals, shift[:, 1:], item.centres(points)], axis=1))
    size, (disk, flux) = item.view.resolution, item.places(pattern)
    samplers = {"receivers": receivers, "pattern": bare.upload(fold(np.concatenate([disk, flux]))),
                "texels": bare.upload(map_texels(item)), "cumulative": bare.upload(item.cumulative.reshape(size, size))}
    values = {"size": size, "count": count, "first_row": 0, "in_disk": len(disk), "by_flux": len(flux),
              "disk_radius": pattern.disk_radius}
    name = f"RSM {size}², {item.samples} samples × {count:,} receivers"
    return gathered(bare, name, programs.RSM_GATHER, image, values, samplers, repeats, count,
                    lambda: gather((item,), points, normals, pattern))


def gathered(bare, name, program, image, values, samplers, repeats, count, numpy_work) -> str:
    """Time a gather both ways."""
    def work():
        bare.dispatch(program, (image.width, image.height), uniforms={"parameters": values}, samplers=samplers,
                      images={"irradiance": image})

    gpu = on_gpu(bare, repeats, work)
    expected, cpu = on_cpu(max(repeats // 2, 1), numpy_work)
    image.write(np.zeros((image.height, image.width, 4), np.float32).tobytes())
    work()
    found = unfold(bare.download(image), count, 3)
    return row(name, gpu, cpu, np.abs(found - expected).max() / expected.max())


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--receivers", type=int, default=100_000)
    parser.add_argument("--repeats", type=int, default=7)
    parser.add_argument("--cells", type=int, default=32)
    parser.add_argument("--steps", type=int, default=8)
    options = parser.parse_args()
    bare = BareContext()
    print(f"{bare.description}; numpy {np.__version__}\n")
    print("| kernel | GPU ms | numpy ms | ratio | difference |\n|---|---|---|---|---|")
    print(propagation(bare, options.cells, options.steps, options.repeats), flush=True)
    print(virtual_lights(bare, options.receivers, options.repeats), flush=True)
    print(shadow_map(bare, options.receivers, options.repeats), flush=True)


if __name__ == "__main__":
    main()
