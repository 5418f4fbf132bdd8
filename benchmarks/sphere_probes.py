"""How far sphere probes are from Cycles: the panorama at a probe, its blurred levels, and pictures whose mirrors read them.

    python benchmarks/sphere_probes.py [samples...] [--resolution 128] [--rays 16] [--cycles-samples 64] [--picture 160 90]

Cycles renders an equirectangular panorama at each probe twice, with other seeds, lamps hidden from its camera (a probe does not
hold them) and nothing that trades bias for speed. The difference is the root mean square, as a share of the mean, over cells of
5.6 degrees by products with both renders, in which its noise cancels, weighted by solid angle. Levels: our own map against an
integral of its level 0 by every texel's exact lobe, at directions between texel centres. Pictures: `screen_reflections` on the
light of baked probes, with and without sphere probes, against Cycles' picture, over blocks of 4 x 4 pixels.
"""

import argparse
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import bpy
import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from rtgi_addon.blender.extract import extract_scene  # noqa: E402
from rtgi_addon.effects import Chosen, get  # noqa: E402
from rtgi_addon.effects.picture import draw_picture  # noqa: E402
from rtgi_addon.effects.spheres.bake import bake_spheres  # noqa: E402
from rtgi_addon.effects.spheres.maps import SphereMap, SphereProbes, level_alpha  # noqa: E402
from rtgi_addon.effects.spheres.prefilter import lobe  # noqa: E402
from rtgi_addon.effects.spheres.settings import SphereSettings  # noqa: E402
from rtgi_addon.exchange.exr_codec import decode  # noqa: E402
from rtgi_addon.jobs.field import bake_field  # noqa: E402
from rtgi_addon.numerics.octahedral import texel_directions, texel_solid_angles  # noqa: E402
from rtgi_addon.transport.views.camera import CameraView  # noqa: E402

SAMPLES = ("wet_floor", "metal_shop")
# Cells of a panorama up and across, and its pixels to a cell.
CELLS, FINE = (32, 64), 4
BLOCK = 4


def render(scene: bpy.types.Scene, size, samples: int, seed: int) -> np.ndarray:
    """Cycles' picture (h, w, 3), row 0 at the bottom."""
    cycles, settings = scene.cycles, scene.render.image_settings
    scene.render.resolution_x, scene.render.resolution_y = size
    scene.render.resolution_percentage, scene.render.engine = 100, "CYCLES"
    cycles.samples, cycles.seed = samples, seed
    cycles.use_denoising = cycles.use_adaptive_sampling = False
    cycles.max_bounces = cycles.glossy_bounces = cycles.diffuse_bounces = 64
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0
    settings.file_format, settings.color_depth, settings.exr_codec = "OPEN_EXR", "32", "ZIP"
    with tempfile.TemporaryDirectory() as folder:
        scene.render.filepath = str(Path(folder) / "picture.exr")
        bpy.ops.render.render(write_still=True)
        planes = decode(Path(scene.render.filepath).read_bytes())[0]
    return np.flipud(np.stack([planes[name] for name in "RGB"], axis=-1)).astype(np.float64)


def panorama(scene: bpy.types.Scene, centre, samples: int, seed: int) -> np.ndarray:
    """What Cycles sees from ``centre``, in Blender's equirectangular layout, without lamps."""
    data = bpy.data.cameras.new("Panorama")
    camera = bpy.data.objects.new("Panorama", data)
    scene.collection.objects.link(camera)
    before, lamps = scene.camera, {obj: obj.visible_camera for obj in scene.objects if obj.type == "LIGHT"}
    data.type, data.clip_start = "PANO", 1e-3
    owner = data if hasattr(data, "panorama_type") else data.cycles
    owner.panorama_type = "EQUIRECTANGULAR"
    camera.location, camera.rotation_euler = centre, (np.pi / 2, 0.0, -np.pi / 2)
    for obj in lamps:
        obj.visible_camera = False
    scene.camera = camera
    try:
        return render(scene, (CELLS[1] * FINE, CELLS[0] * FINE), samples, seed)
    finally:
        scene.camera = before
        for obj, visible in lamps.items():
            obj.visible_camera = visible
        bpy.data.objects.remove(camera)


def off(found: np.ndarray, references: list[np.ndarray], weight: np.ndarray) -> float:
    """The difference of ``found`` (n, 3) to what both ``references`` are noisy measures of, relative to their mean."""
    level = np.average(np.mean(references, axis=0).mean(axis=-1), weights=weight)
    products = np.prod([found - reference for reference in references], axis=0).mean(axis=-1)
    return float(np.sqrt(max(np.average(products, weights=weight), 0.0)) / level)


def cells(image: np.ndarray, size: int) -> np.ndarray:
    """Means over blocks of ``size`` pixels (n, 3)."""
    height, width = (side // size for side in image.shape[:2])
    return image[:height * size, :width * size].reshape(height, size, width, size, 3).mean(axis=(1, 3)).reshape(-1, 3)


def seen(item: SphereMap) -> np.ndarray:
    """Level 0 of a probe as a panorama of the same layout as Cycles'."""
    height, width = CELLS[0] * FINE, CELLS[1] * FINE
    azimuth = (0.5 - (np.arange(width) + 0.5) / width) * 2 * np.pi
    latitude = ((np.arange(height) + 0.5) / height - 0.5) * np.pi
    flat = np.cos(latitude)[:, None]
    directions = np.stack([flat * np.cos(azimuth), flat * np.sin(azimuth), np.repeat(np.sin(latitude)[:, None], width, axis=1)], -1)
    return SphereProbes([item])._read(0, directions.reshape(-1, 3), np.zeros(height * width)).reshape(height, width, 3)


def levels(item: SphereMap) -> list[str]:
    """How far each level is from the exact lobe's mean of level 0."""
    side, probes = item.resolution, SphereProbes([item])
    source, solid = texel_directions(side).astype(np.float64), texel_solid_angles(side)
    light, rng, said = item.levels[0].astype(np.float64).reshape(-1, 3), np.random.default_rng(1), []
    asked = rng.normal(size=(400, 3))
    asked /= np.linalg.norm(asked, axis=1)[:, None]
    for level in range(1, len(item.levels)):
        alpha = level_alpha(side, level)
        weight = lobe(asked @ source.T, alpha) * solid
        exact = weight @ light / weight.sum(axis=1)[:, None]
        found = probes._read(0, asked, np.full(len(asked), alpha))
        said.append(f"α {alpha:.3g}: {100 * np.sqrt(np.mean((found - exact) ** 2)) / exact.mean():.2f} %")
    return said


def main() -> int:
    """Measure what the command line names and print the figures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("samples", nargs="*", default=SAMPLES)
    parser.add_argument("--resolution", default="128")
    parser.add_argument("--rays", type=int, default=16)
    parser.add_argument("--cycles-samples", type=int, default=64)
    parser.add_argument("--picture", type=int, nargs=2, default=(160, 90))
    arguments = parser.parse_args()
    import addon_utils
    addon_utils.enable("cycles")
    for name in arguments.samples:
        bpy.ops.wm.open_mainfile(filepath=str(ROOT / "sample_blends" / f"{name}.blend"))
        scene = bpy.context.scene
        scene.render.resolution_x, scene.render.resolution_y = arguments.picture
        scene.render.resolution_percentage = 100
        read = extract_scene()
        started = time.process_time()
        baked = bake_spheres(read, None, SphereSettings(resolution=arguments.resolution, rays=arguments.rays))
        seconds = time.process_time() - started
        print(f"{name}: {len(baked.probes.maps)} probes of {arguments.resolution} texels, {seconds:.1f} s of CPU", *baked.notes)
        latitude = ((np.arange(CELLS[0]) + 0.5) / CELLS[0] - 0.5) * np.pi
        weight = np.repeat(np.cos(latitude), CELLS[1])
        for item in baked.probes.maps:
            cycles = [cells(panorama(scene, item.probe.centre_world, arguments.cycles_samples, seed), FINE) for seed in (1, 2)]
            ours = cells(seen(item), FINE)
            level = np.average(np.mean(cycles, axis=0).mean(axis=-1), weights=weight)
            bias = np.average(ours.mean(axis=-1), weights=weight) / level - 1.0
            print(f"  {item.probe.name}: panorama {100 * off(ours, cycles, weight):.1f} % off, mean {100 * bias:+.2f} %")
            print(f"    levels {', '.join(levels(item))}", flush=True)
        field = bake_field(read, "probes", {"error": 0.03})
        view, effect = CameraView.of(replace(read.cameras[0], resolution=tuple(arguments.picture))), get("screen_reflections")
        cycles = [cells(render(scene, arguments.picture, arguments.cycles_samples, seed), BLOCK) for seed in (1, 2)]
        for settings, label in (({}, "defaults"), ({"max_roughness": 0.0}, "fallback alone")):
            figures = []
            for spheres in (None, baked.probes):
                field.spheres = spheres
                picture = draw_picture(read, field, view, tuple(arguments.picture), samples=16,
                                       effects=[Chosen(effect, effect.Settings(**settings))])
                ours = cells(np.asarray(picture, np.float64)[..., :3], BLOCK)
                figures.append(100 * off(ours, cycles, np.ones(len(ours))))
            print(f"  picture, {label}: {figures[0]:.1f} % off without sphere probes, {figures[1]:.1f} % with", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
