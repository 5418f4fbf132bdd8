"""How far the preview's pictures are from Cycles: the samples through their own cameras, bake included.

    python benchmarks/preview_vs_cycles.py [samples...] [--density 1 3] [--size 640 360] [--cycles-samples 256] [--no-eevee]
        [--no-field]
    blender -b --python benchmarks/preview_vs_cycles.py -- [the same]

Cycles renders every picture twice with other seeds, hidden lamps, the same pixel filter and nothing that trades bias for speed.
Direct is the light of lamps reflected once, from a render without bounces whose lamps are a light group of their own; indirect is
all other light on surfaces: their own emission and the world behind them are taken off. Held against it: the engine's passes of the
same name, lit by probes baked at default settings on the file's own lattice (``--density F``: F times as many along every side).

Differences are mean |x - r| over mean r, of all colour channels of the pixels that show a surface, where |x - r| is the root mean
square over blocks of 8 x 8 pixels from products with both of Cycles' renders, in which its noise cancels: never below the true
mean. "Relative" is the mean of |x - r| / r over blocks instead, where r is at least a hundredth of its mean. "Noise" is that of
the average of Cycles' renders, pixel by pixel, which would be in the first otherwise. "Field" is the difference of irradiance
between the baked field and the path reference at the points that a coarse grid of pixels sees: it tells the lattice's error from
the renderer's.

What Cycles and EEVEE rendered is kept in benchmarks/results for later runs of that size with no more samples (``--again``
renders anew). A sheet a sample goes to benchmarks/results/preview_SAMPLE.png: RTGI, EEVEE after a bake of its own volumes
(grown by one of their cells on every side, without which EEVEE shows the world on walls that a volume ends at), and Cycles; below,
the indirect light of RTGI, the signed difference, and the indirect light of Cycles. ``--overview FILE.jpg`` puts the first row of
all into one picture.
"""

import argparse
import json
import sys
import tempfile
import time
from pathlib import Path

import bpy
import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from benchmarks.preview import seen_by  # noqa: E402
from rtgi_addon.blender.cli.streams import Streams  # noqa: E402
from rtgi_addon.blender.cycles.reference import CyclesSettings, rendering  # noqa: E402
from rtgi_addon.blender.extract import extract_scene  # noqa: E402
from rtgi_addon.blender.gpu_context import open_context  # noqa: E402
from rtgi_addon.evaluate.receivers import Receivers  # noqa: E402
from rtgi_addon.evaluate.references import PathReference, Truth  # noqa: E402
from rtgi_addon.jobs.field import bake_field  # noqa: E402
from rtgi_addon.preview.settings import PreviewSettings  # noqa: E402
from rtgi_addon.scene import Scene  # noqa: E402
from rtgi_addon.transport.context import LightContext  # noqa: E402
from rtgi_addon.transport.rays.tracer import offset_origins  # noqa: E402
from rtgi_addon.transport.vectors import luminance  # noqa: E402

RESULTS = ROOT / "benchmarks/results"
HELD_TO = ("cornell_box", "sky_courtyard", "sun_window")
SAMPLES = (*HELD_TO, "two_rooms", "corridor_door_ajar", "furnace", "integrating_sphere", "outdoor_hdri", "many_lights",
           "adversarial", "atrium")
PARTS = ("direct", "indirect", "combined")
LAMPS = "rtgi_lamps"
# Passes of what surfaces and the world send to the camera themselves, as versions of Blender name them.
SEEN_ITSELF = ("Emit", "Emission", "Env", "Environment")
# The grid of pixels at which the path reference says what the field itself is off by.
FIELD_GRID, FIELD_NOISE, FIELD_PATHS = (24, 14), 0.015, 6_000_000
# Rays of each of EEVEE's samples: a quarter of its default, whose noise is far below its leaks.
EEVEE_RAYS = 512
# Side [pixels] of the blocks in which Cycles' noise is averaged out.
BLOCK = 8


def open_sample(name: str, size: tuple[int, int], density: float = 1.0) -> bpy.types.Scene:
    """Open a sample at ``size`` pixels, its lattices refined ``density`` times along every side."""
    bpy.ops.wm.open_mainfile(filepath=str(ROOT / "sample_blends" / f"{name}.blend"))
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y = size
    scene.render.resolution_percentage = 100
    for data in bpy.data.lightprobes:
        for side in ("resolution_x", "resolution_y", "resolution_z"):
            if hasattr(data, side):
                setattr(data, side, max(round(getattr(data, side) * density), 1))
    bpy.context.view_layer.update()
    return scene


def field_truth(scene: Scene, threads: int | None) -> tuple[Receivers, Truth]:
    """Points on the surfaces that the first camera sees, and the path reference's irradiance there."""
    position, normal = (texels.reshape(-1, 4)[:, :3] for texels in seen_by(scene, scene.cameras[0], FIELD_GRID))
    seen = np.any(normal != 0, axis=1)
    receivers = Receivers(offset_origins(position[seen], normal[seen], normal[seen]), normal[seen], np.ones(seen.sum(), bool))
    return receivers, PathReference(LightContext(scene, threads), FIELD_NOISE, FIELD_PATHS).irradiance(receivers)


def render_rtgi(name: str, size, density: float, samples: int, threads: int | None, held: tuple | None,
                measured: bool = True) -> dict:
    """Passes (h, w, 3), row 0 at the top, which pixels show a surface, seconds, and if ``measured`` the difference of the field to
    ``held`` (what ``field_truth`` returns, made here for None)."""
    from rtgi_addon.preview.renderer import PreviewRenderer
    from rtgi_addon.transport.views.camera import CameraView
    open_sample(name, size, density)
    started = time.perf_counter()
    scene = extract_scene()
    field = bake_field(scene, "probes", threads=threads)
    baked = time.perf_counter()
    renderer = PreviewRenderer(scene, field, PreviewSettings(samples=samples), (*PARTS, "object"))
    for _ in range(samples):
        renderer.frame(CameraView.of(scene.cameras[0]), scene.cameras[0].resolution)
    found = {part: np.flipud(renderer.image(part))[..., :3].astype(np.float64) for part in PARTS}
    found["seen"] = np.flipud(renderer.image("object"))[..., 0] > 0.5
    drawn = time.perf_counter()
    renderer.close()
    off = None
    if measured:
        receivers, truth = held = held or field_truth(scene, threads)
        off = np.abs(field.irradiance(receivers.points, receivers.normals) - truth.mean).mean()
        off = float(off / truth.mean.mean()) if truth.mean.size and truth.mean.mean() > 0 else 0.0
    return {**found, "held": held, "bake_seconds": baked - started, "draw_seconds": drawn - baked, "field": off,
            "probes": sum(grid.sh[..., 0, 0].size for grid in field.grids())}


def render_cycles(name: str, size, samples: int, threads: int | None) -> dict:
    """Passes (2, h, w, 3), one of each seed, row 0 at the top, and seconds of the whole."""
    scene = open_sample(name, size)
    camera = scene.camera
    started = time.perf_counter()
    layer = bpy.context.view_layer
    layer.use_pass_emit = layer.use_pass_environment = True
    layer.lightgroups.add(name=LAMPS)
    for obj in bpy.data.objects:
        if obj.type == "LIGHT":
            obj.lightgroup = LAMPS
    found: dict[str, list] = {part: [] for part in PARTS}
    with rendering(scene, CyclesSettings(samples=max(samples // 2, 1), threads=threads)), tempfile.TemporaryDirectory() as folder:
        scene.camera = camera
        scene.render.resolution_x, scene.render.resolution_y = size
        scene.cycles.pixel_filter_type, scene.cycles.filter_width = "BLACKMAN_HARRIS", 1.5
        for seed in range(2):
            scene.cycles.seed = seed
            whole = _render(scene, folder)
            bounces = scene.cycles.max_bounces
            scene.cycles.max_bounces = 0
            direct = _render(scene, folder)[f"Combined_{LAMPS}"]
            scene.cycles.max_bounces = bounces
            found["combined"].append(whole["Combined"])
            found["direct"].append(direct)
            found["indirect"].append(whole["Combined"] - direct - sum(whole[item] for item in SEEN_ITSELF if item in whole))
    return {**{part: np.array(images) for part, images in found.items()}, "seconds": time.perf_counter() - started}


def render_eevee(name: str, size, samples: int) -> np.ndarray:
    """EEVEE's picture (h, w, 3) of the sample with its volumes, grown by a cell, baked; row 0 at the top."""
    scene = open_sample(name, size)
    engines = {item.identifier for item in bpy.types.RenderSettings.bl_rna.properties["engine"].enum_items}
    scene.render.engine = next((engine for engine in ("BLENDER_EEVEE_NEXT", "BLENDER_EEVEE") if engine in engines), "BLENDER_EEVEE")
    scene.eevee.taa_render_samples = samples
    for probe in (obj for obj in scene.objects if obj.type == "LIGHT_PROBE" and obj.data.type == "VOLUME"):
        # Up to 1.25 cells within a volume's border EEVEE dithers it with what lies outside, here the world.
        counts = [getattr(probe.data, f"resolution_{axis}") for axis in "xyz"]
        probe.scale = [scale * (count + 2) / count for scale, count in zip(probe.scale, counts, strict=True)]
        for axis, count in zip("xyz", counts, strict=True):
            setattr(probe.data, f"resolution_{axis}", count + 2)
        probe.data.bake_samples = EEVEE_RAYS
    bpy.context.view_layer.update()
    bpy.ops.object.lightprobe_cache_bake(subset="ALL")
    with tempfile.TemporaryDirectory() as folder:
        return _render(scene, folder)["Combined"]


def _render(scene, folder) -> dict[str, np.ndarray]:
    """Render; every colour pass (h, w, 3) float64 of the view layer by name, row 0 at the top."""
    import OpenEXR
    settings = scene.render.image_settings
    if hasattr(settings, "media_type"):
        settings.media_type = "MULTI_LAYER_IMAGE"
    settings.file_format, settings.color_depth = "OPEN_EXR_MULTILAYER", "32"
    path = Path(folder) / "render.exr"
    scene.render.filepath = str(path)
    bpy.ops.render.render(scene=scene.name, write_still=True)
    if hasattr(settings, "media_type"):
        settings.media_type = "IMAGE"
    settings.file_format, settings.color_depth = "OPEN_EXR", "32"  # `rendering` puts things back from here
    planes: dict[str, dict] = {}
    for part in OpenEXR.File(str(path), separate_channels=True).parts:
        for name, channel in part.channels.items():
            _, entry, letter = name.rsplit(".", 2)
            planes.setdefault(entry, {})[letter] = channel.pixels
    return {entry: np.stack([channels[letter] for letter in "RGB"], axis=-1).astype(np.float64)
            for entry, channels in planes.items() if set("RGB") <= set(channels)}


def difference(found: np.ndarray, cycles: np.ndarray, seen: np.ndarray) -> dict:
    """The figures of one part: ``found`` (h, w, 3) against ``cycles`` (2, h, w, 3) where ``seen`` (h, w); None for black."""
    true, own = cycles.mean(axis=0, dtype=np.float64)[seen], found[seen].astype(np.float64)
    level = float(true.mean())
    if level <= 1e-6:
        return {"difference": None, "bias": None, "noise": None, "relative": None}
    row, column = np.nonzero(seen)
    _, block = np.unique(row // BLOCK * seen.shape[1] + column // BLOCK, return_inverse=True)
    first, second = (half[seen].astype(np.float64) for half in cycles)
    count = np.bincount(block)
    squares = np.bincount(block, ((own - first) * (own - second)).mean(axis=1)) / count
    off, mean = np.sqrt(np.maximum(squares, 0.0)), np.bincount(block, true.mean(axis=1)) / count
    return {"difference": float((off * count).sum() / count.sum()) / level, "bias": float((own - true).mean()) / level,
            "noise": 0.5 * float(np.abs(first - second).mean()) / level,
            "relative": float((off / np.maximum(mean, 0.01 * level) * count).sum() / count.sum())}


def displayed(linear: np.ndarray) -> np.ndarray:
    """Scene-linear colours as sRGB, 0 to 1: what the samples' Standard view shows."""
    clipped = np.clip(linear, 0.0, 1.0)
    return np.where(clipped <= 0.0031308, 12.92 * clipped, 1.055 * clipped ** (1 / 2.4) - 0.055)


def sheet(rows: list[list[tuple[str, np.ndarray | None]]], path: Path) -> None:
    """Pictures with titles in a table; None leaves a place empty."""
    import matplotlib
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    height, width = next(picture for _, picture in rows[0] if picture is not None).shape[:2]
    figure, axes = plt.subplots(len(rows), len(rows[0]), figsize=(4.0 * len(rows[0]), (4.0 * height / width + 0.3) * len(rows)),
                                squeeze=False)
    for axis, (title, picture) in zip(axes.ravel(), (item for row in rows for item in row), strict=True):
        axis.axis("off")
        if picture is not None:
            axis.imshow(picture, interpolation="lanczos")
            axis.set_title(title, fontsize=9)
    figure.tight_layout(pad=0.3)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=100, **({"pil_kwargs": {"quality": 85}} if path.suffix in (".jpg", ".jpeg") else {}))
    plt.close(figure)


def signed_colours(error: np.ndarray) -> np.ndarray:
    """Signed relative differences (h, w) as colours: blue is too dark, red too bright; full at a quarter."""
    from matplotlib import colormaps
    return colormaps["RdBu_r"](np.clip(0.5 + 2.0 * error, 0.0, 1.0))[..., :3]


def kept(name: str, samples: int, render, again: bool) -> dict:
    """The arrays that are kept as ``name`` with at least so many samples, or what ``render()`` returns, kept from now on."""
    stored = {int(path.stem.rsplit("_", 1)[1]): path for path in RESULTS.glob(f"{name}_*.npz")}
    if max(stored, default=0) >= samples and not again:
        with np.load(stored[max(stored)]) as data:
            return {"samples": max(stored), **{key: data[key] for key in data.files}}
    found = {key: np.asarray(value, np.float32) for key, value in render().items()}
    np.savez_compressed(RESULTS / f"{name}_{samples}.npz", **found)
    return {"samples": samples, **found}


def compare(name: str, options, say) -> tuple[list[dict], list]:
    """The rows of one sample, one for each density, and the first row of its sheet."""
    size = tuple(options.size)
    tag = f"{name}_{size[0]}x{size[1]}"
    cycles = kept(f"cycles_{tag}", options.cycles_samples,
                  lambda: render_cycles(name, size, options.cycles_samples, options.threads), options.again)
    eevee = None if options.no_eevee else kept(f"eevee_{tag}", options.eevee_samples,
                                               lambda: {"combined": render_eevee(name, size, options.eevee_samples)},
                                               options.again)["combined"]
    results, held = [], None
    for density in options.density:
        found = render_rtgi(name, size, density, options.samples, options.threads, held, not options.no_field)
        seen, held = found["seen"], found["held"]
        results.append({"sample": name, "density": density, "size": size, "probes": found["probes"], "field": found["field"],
                        "bake_seconds": found["bake_seconds"], "draw_seconds": found["draw_seconds"],
                        "cycles_seconds": float(cycles["seconds"]), "samples": options.samples,
                        "cycles_samples": cycles["samples"],
                        **{part: difference(found[part], cycles[part], seen) for part in PARTS}})
        if eevee is not None and density == options.density[0]:
            results[-1]["eevee"] = difference(eevee, cycles["combined"], seen)
        say(line(results[-1]))
    true = cycles["combined"].mean(axis=0)
    # The last density is the one that is shown.
    level = max(float(luminance(true[seen]).mean()), 1e-9)
    signed = np.where(seen, (luminance(found["combined"]) - luminance(true)) / np.maximum(luminance(true), 0.1 * level), 0.0)
    best = 100 * (results[-1]["combined"]["difference"] or 0.0)
    first = [(f"{name}: RTGI, {results[-1]['probes']:,} probes, {best:.1f} %", displayed(found["combined"])),
             ("EEVEE, its volume baked", None if eevee is None else displayed(eevee)), ("Cycles", displayed(true))]
    below = [("RTGI, indirect", displayed(found["indirect"])), ("RTGI less Cycles (full colour: 25 %)", signed_colours(signed)),
             ("Cycles, indirect", displayed(cycles["indirect"].mean(axis=0)))]
    sheet([first, below], RESULTS / f"preview_{name}.png")
    return results, first


def percent(value: float | None) -> str:
    """A share for the table."""
    return "-" if value is None else f"{100 * value:.1f} %"


def line(row: dict) -> str:
    """A row of the table."""
    parts = " | ".join(percent(row[part]["difference"]) for part in PARTS)
    eevee = percent(row["eevee"]["difference"]) if "eevee" in row else ""
    return (f"| {row['sample']} | {row['probes']:,} | {parts} | {percent(row['combined']['bias'])} "
            f"| {percent(row['combined']['relative'])} | {percent(row['field'])} | {percent(row['combined']['noise'])} | {eevee} |")


def main() -> int:
    """Compare what the command line names; print the table, write sheets and benchmarks/results/preview_vs_cycles.json."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", metavar="sample", help=f"default: {', '.join(HELD_TO)}; or of {', '.join(SAMPLES)}")
    parser.add_argument("--density", type=float, nargs="+", default=[1.0], help="lattices this many times as fine")
    parser.add_argument("--size", type=int, nargs=2, default=(640, 360))
    parser.add_argument("--samples", type=int, default=64)
    parser.add_argument("--cycles-samples", type=int, default=256)
    parser.add_argument("--threads", type=int)
    parser.add_argument("--eevee-samples", type=int, default=16)
    parser.add_argument("--again", action="store_true")
    parser.add_argument("--no-eevee", action="store_true")
    parser.add_argument("--no-field", action="store_true", help="without the path reference, which can take longer than the rest")
    parser.add_argument("--overview", type=Path)
    after = sys.argv[sys.argv.index("--") + 1:] if "--" in sys.argv else sys.argv[1:]
    options = parser.parse_args(after)
    open_context()
    streams = Streams()

    def say(text):
        print(text, file=streams.out, flush=True)

    say("| sample | probes | direct | indirect | combined | bias | relative | field | noise | EEVEE |\n" + "|---" * 10 + "|")
    path = RESULTS / "preview_vs_cycles.json"
    RESULTS.mkdir(parents=True, exist_ok=True)
    rows = json.loads(path.read_text()) if path.exists() else []
    pictures = []
    for name in options.names or HELD_TO:
        found, first = compare(name, options, say)
        pictures.append(first)
        rows = [row for row in rows if (row["sample"], row["density"]) not in {(name, item["density"]) for item in found}] + found
        path.write_text(json.dumps(rows, indent=1))
    if options.overview:
        sheet(pictures, options.overview)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
