"""How far pictures of media are from Cycles': samples through their own cameras, drawn by rays, bake included.

    python benchmarks/media_vs_cycles.py [samples...] [--size 160 90] [--cycles-samples 256] [--samples 16] [--tile 2]
        [--error 0.02] [--scattering S A] [--rays N] [--ray-traced]

Cycles renders every picture twice with other seeds and nothing that trades bias for speed. The difference is the root mean square
over blocks of 4 x 4 pixels from products with both of its renders, in which its noise cancels, as a share of the picture's mean:
of the whole picture, and of the light that media scatter (both passes together: Cycles counts what the world's light gives once as
direct, and what media give of their own as emission). ``--scattering S A`` gives media that scatter other coefficients: 1.8 0.2
in media_box is an optical depth of 2 at albedo 0.9. ``--rays`` are those of media (media.rays), ``--ray-traced`` lights surfaces by
rays as well.
"""

import argparse
import sys
import tempfile
import time
from pathlib import Path

import bpy
import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from rtgi_addon.blender.extract import extract_scene  # noqa: E402
from rtgi_addon.effects import Chosen, get  # noqa: E402
from rtgi_addon.effects.picture import draw_picture  # noqa: E402
from rtgi_addon.exchange.exr_codec import decode  # noqa: E402
from rtgi_addon.jobs.field import bake_field  # noqa: E402
from rtgi_addon.transport.views.camera import CameraView  # noqa: E402

SAMPLES = ("media_box", "fog_hall", "smoke")
BLOCK = 4
# As versions of Blender name them.
SCATTERED = ("Volume Direct", "VolumeDir", "Volume Indirect", "VolumeInd")


def open_sample(name: str, size, scattering) -> bpy.types.Scene:
    """Open a sample at ``size`` pixels, with other coefficients of what scatters if they are given."""
    bpy.ops.wm.open_mainfile(filepath=str(ROOT / "sample_blends" / f"{name}.blend"))
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y = size
    scene.render.resolution_percentage = 100
    for material in bpy.data.materials if scattering else ():
        for node in material.node_tree.nodes:
            if node.bl_idname == "ShaderNodeVolumeCoefficients" and any(node.inputs["Scatter Coefficients"].default_value):
                node.inputs["Scatter Coefficients"].default_value = (scattering[0],) * 3
                node.inputs["Absorption Coefficients"].default_value = (scattering[1],) * 3
    return scene


def by_cycles(scene: bpy.types.Scene, samples: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """The whole picture and what media scatter (h, w, 3), row 0 at the bottom."""
    cycles, settings, layer = scene.cycles, scene.render.image_settings, bpy.context.view_layer
    scene.render.engine, cycles.samples, cycles.seed = "CYCLES", max(samples // 2, 1), seed
    cycles.use_denoising = cycles.use_adaptive_sampling = False
    cycles.max_bounces = cycles.volume_bounces = 64
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0
    layer.cycles.use_pass_volume_direct = layer.cycles.use_pass_volume_indirect = True
    if hasattr(settings, "media_type"):
        settings.media_type = "MULTI_LAYER_IMAGE"
    settings.file_format, settings.color_depth, settings.exr_codec = "OPEN_EXR_MULTILAYER", "32", "ZIP"
    if hasattr(settings, "use_exr_interleave"):
        settings.use_exr_interleave = True
    with tempfile.TemporaryDirectory() as folder:
        scene.render.filepath = str(Path(folder) / "picture.exr")
        bpy.ops.render.render(write_still=True)
        planes = decode(Path(scene.render.filepath).read_bytes())[0]

    def of(name):
        found = [planes.get(f"{layer.name}.{name}.{channel}") for channel in "RGB"]
        return 0.0 if found[0] is None else np.flipud(np.stack(found, axis=-1)).astype(np.float64)

    return of("Combined"), sum(of(name) for name in SCATTERED)


def blocks(image: np.ndarray) -> np.ndarray:
    """Means over blocks."""
    height, width = (side // BLOCK * BLOCK for side in image.shape[:2])
    return image[:height, :width].reshape(height // BLOCK, BLOCK, width // BLOCK, BLOCK, 3).mean(axis=(1, 3))


def off(image: np.ndarray, references: list[np.ndarray], scale: float) -> float:
    """The difference of ``image`` to what both ``references`` are noisy pictures of, as a share of ``scale``."""
    first, second = (blocks(image) - blocks(reference) for reference in references)
    return float(np.sqrt(max(np.mean(first * second), 0.0)) / scale)


def main() -> int:
    """Measure what the command line names and print a row each."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("names", nargs="*", metavar="sample", default=SAMPLES)
    parser.add_argument("--size", type=int, nargs=2, default=(160, 90))
    parser.add_argument("--cycles-samples", type=int, default=256)
    parser.add_argument("--samples", type=int, default=16)
    parser.add_argument("--tile", type=int, default=2)
    parser.add_argument("--error", type=float, default=0.02)
    parser.add_argument("--rays", type=int, default=0)
    parser.add_argument("--ray-traced", action="store_true")
    parser.add_argument("--scattering", type=float, nargs=2)
    options = parser.parse_args()
    import addon_utils
    addon_utils.enable("cycles")
    rows = ["| sample | whole picture | mean | scattered light | mean | without media | CPU s a sample |",
            "|---|---:|---:|---:|---:|---:|---:|"]
    effect = get("media")
    for name in options.names:
        scene = open_sample(name, options.size, options.scattering)
        whole, scattered = zip(*(by_cycles(scene, options.cycles_samples, seed) for seed in range(2)), strict=True)
        extracted = extract_scene()
        field = bake_field(extracted, "probes", {"error": options.error})
        view = CameraView.of(extracted.cameras[0])
        chosen, started = [Chosen(effect, effect.Settings(tile=options.tile, rays=options.rays))], time.process_time()
        if options.ray_traced:
            chosen.append(Chosen(get("ray_traced"), get("ray_traced").Settings()))
        images = {shown: draw_picture(extracted, field, view, tuple(options.size), shown=shown, samples=options.samples,
                                      effects=chosen)[..., :3] for shown in ("combined", "volume_direct", "volume_indirect")}
        seconds = (time.process_time() - started) / (3 * options.samples)
        bare = draw_picture(extracted, field, view, tuple(options.size), samples=options.samples)[..., :3]
        mean, of_media = np.mean(whole), np.mean(scattered)
        own = sum(np.where(medium.emission > 0, 1.0, 0.0).sum() for medium in extracted.media)
        light = images["volume_direct"] + images["volume_indirect"]
        cells = ["-", "-"] if own else [f"{off(light, scattered, mean):.1%}", f"{light.mean() / of_media - 1:+.1%}"]
        rows.append(f"| {name} | {off(images['combined'], whole, mean):.1%} | {images['combined'].mean() / mean - 1:+.1%} | "
                    f"{cells[0]} | {cells[1]} | {off(bare, whole, mean):.1%} | {seconds:.2f} |")
    print("\n".join(rows), flush=True)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
