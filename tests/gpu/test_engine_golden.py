"""F12 of the Cornell box against a picture that was looked at, pixel by pixel within its noise.

The golden (tests/goldens/f12_cornell_box.npz) holds the mean of many samples and the variance of a mean of 16. After a change
of the picture that is meant, `python tests/gpu/test_engine_golden.py` writes it again.
"""

import os
import sys
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
GOLDEN = ROOT / "tests/goldens/f12_cornell_box.npz"
SIZE, SAMPLES, GROUPS = 48, 16, 8
UPDATE = "if the change is meant, run `python tests/gpu/test_engine_golden.py`"
# Drivers rasterize and filter with their own rounding.
ROUNDING = 2e-3


def renders(samples, out):
    """Mean pictures (h, w, 3) after every number of ``samples``, through Blender's render operator."""
    import bpy

    import rtgi_addon
    from rtgi_addon.exchange.exr_codec import decode
    bpy.ops.wm.open_mainfile(filepath=str(ROOT / "sample_blends/cornell_box.blend"))
    rtgi_addon.register()
    scene = bpy.context.scene
    try:
        scene.rtgi.output, scene.rtgi.mode, scene.rtgi.technique_probes.rays = str(out / "bake"), "RAYS", 1024
        bpy.ops.rtgi.bake()
        scene.render.engine = "RTGI"
        scene.render.resolution_x = scene.render.resolution_y = SIZE
        scene.rtgi_preview.shadow_resolution = 512
        settings = scene.render.image_settings
        if hasattr(settings, "media_type"):
            settings.media_type = "IMAGE"
        settings.file_format, settings.color_depth, settings.exr_codec = "OPEN_EXR", "32", "ZIP"
        for count in samples:
            scene.rtgi_preview.render_samples = count
            scene.render.filepath = str(out / f"{count}.exr")
            bpy.ops.render.render(write_still=True)
            channels, _ = decode(Path(scene.render.filepath).read_bytes())
            yield np.stack([channels[name] for name in "RGB"], axis=-1)
    finally:
        scene.render.engine = "BLENDER_WORKBENCH"
        rtgi_addon.unregister()


def test_the_picture_is_the_one_that_was_looked_at(gpu_device, empty_blend, tmp_path):
    found = next(renders([SAMPLES], tmp_path))
    with np.load(GOLDEN) as golden:
        mean, variance = golden["mean"], golden["variance"]
    z = (found - mean) / np.sqrt(variance + np.square(ROUNDING * (1.0 + mean)))
    assert np.mean(np.square(z)) < 2.0, f"mean z² {np.mean(np.square(z)):.2f}: {UPDATE}"
    assert np.mean(np.abs(z) > 4.0) < 0.01, f"{100 * np.mean(np.abs(z) > 4.0):.1f} % of values are off: {UPDATE}"
    assert abs(np.mean(found) / np.mean(mean) - 1.0) < 0.005, UPDATE


def main() -> None:
    """Write the golden again."""
    import tempfile
    with tempfile.TemporaryDirectory() as folder:
        counts = [SAMPLES * (group + 1) for group in range(GROUPS)]
        sums = [count * picture for count, picture in zip(counts, renders(counts, Path(folder)), strict=True)]
    groups = np.diff(np.array([np.zeros_like(sums[0]), *sums]), axis=0) / SAMPLES
    np.savez_compressed(GOLDEN, mean=(sums[-1] / counts[-1]).astype(np.float32), variance=groups.var(axis=0).astype(np.float32))
    print(f"{GOLDEN}: mean {sums[-1].mean() / counts[-1]:.4f}, relative noise {np.sqrt(groups.var(axis=0).mean()):.4f}")


if __name__ == "__main__":
    sys.path.insert(0, str(ROOT))
    main()
    sys.stdout.flush()
    # Blender's module would hang or crash in its own teardown.
    os._exit(0)
