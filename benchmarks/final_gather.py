"""How near pictures by the effect `ray_traced` come to Cycles, and how much faster than Cycles without its denoiser.

    python benchmarks/final_gather.py [samples...] [--samples N] [--cycles-samples 512] [--again] [--set NAME=VALUE]
        [--effect screen_reflections] [--fit] [--density F]

Both draw the combined picture of a sample's own camera at 320 x 180 on the CPU, the effect at its own defaults and without a bake:
its light cache is part of its time. It has samples where the picture needs them until it thinks that it is within what the sample
is held to (``render --gather rays``), or with ``--samples`` as many everywhere. Cycles renders twice with other seeds and nothing
that trades bias for speed, lamps hidden from the camera, the same pixel filter.

Error is the RMSE of all colour channels of the pixels that show a surface, relative to the picture's mean there. Of the effect it
is the root of the mean of (x - a)(x - b) over both renders a and b: their noise is not in it, its own is. Of Cycles it is the noise
of one render, from (a - b)^2; time to an error falls with the square, so the ratio is Cycles' CPU seconds for the effect's error
over those that the effect took: user time of all threads, opening the file and reading the scene left out on both sides. Cycles'
pictures and their time are kept in benchmarks/results (``--again`` renders anew). Sheets of the pictures go there, too.

``--effect`` measures another effect; one that is not of the stage "light" on the picture that probes at default settings light, and
sphere probes where it shows them, as ``render --effect`` does; their bake is no part of its time. ``--fit`` fits the probes, and
``--density F`` refines their lattices F times along every side.
"""

import argparse
import json
import resource
import sys
import tempfile
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from benchmarks.preview_vs_cycles import RESULTS, _render, displayed, kept, open_sample, sheet, signed_colours  # noqa: E402
from rtgi_addon.blender.cli.streams import Streams  # noqa: E402
from rtgi_addon.blender.cycles.reference import CyclesSettings, rendering  # noqa: E402
from rtgi_addon.blender.extract import extract_scene  # noqa: E402
from rtgi_addon.effects import Chosen, get  # noqa: E402
from rtgi_addon.effects.base import apply_all  # noqa: E402
from rtgi_addon.effects.gathering import MOST_SAMPLES  # noqa: E402
from rtgi_addon.effects.lit import draw_frame, light_context  # noqa: E402
from rtgi_addon.effects.picture import draw_pictures  # noqa: E402
from rtgi_addon.effects.spheres.settings import SphereSettings  # noqa: E402
from rtgi_addon.jobs.field import bake_field  # noqa: E402
from rtgi_addon.scene import Scene  # noqa: E402
from rtgi_addon.techniques import Field  # noqa: E402
from rtgi_addon.transport.vectors import luminance  # noqa: E402
from rtgi_addon.transport.views.camera import CameraView  # noqa: E402
from rtgi_addon.transport.views.pixel_filter import sample_offset  # noqa: E402

SAMPLES = ("cornell_box", "two_rooms", "sun_window", "sky_courtyard", "atrium", "wet_floor", "metal_shop")
# What the pictures are held to: the error of each, and how many times as fast as Cycles.
HELD_TO, HELD_RATIO = {"wet_floor": 0.03, "metal_shop": 0.03}, 20.0
SIZE = 320, 180


def user_seconds() -> float:
    """CPU time of all threads of this process so far."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_utime


def render_cycles(name: str, samples: int, threads: int | None) -> dict:
    """The pictures (2, h, w, 3) of two seeds, row 0 at the top, with CPU seconds of one."""
    scene = open_sample(name, SIZE)
    camera, pictures = scene.camera, []
    with rendering(scene, CyclesSettings(samples=samples, threads=threads)), tempfile.TemporaryDirectory() as folder:
        scene.camera = camera
        scene.render.resolution_x, scene.render.resolution_y = SIZE
        scene.cycles.pixel_filter_type, scene.cycles.filter_width = "BLACKMAN_HARRIS", 1.5
        started = user_seconds()
        for seed in range(2):
            scene.cycles.seed = seed
            pictures.append(_render(scene, folder)["Combined"])
    return {"pictures": np.array(pictures), "seconds": 0.5 * (user_seconds() - started)}


def draw(scene: Scene, samples: int, chosen: Chosen, threads: int | None,
         field: Field | None = None) -> tuple[dict[int, np.ndarray], dict[int, float], np.ndarray]:
    """Pictures (h, w, 3) after every power of 4 samples and the last, row 0 at the top; the CPU seconds of each; what shows a
    surface."""
    view = CameraView.of(scene.cameras[0])
    total, pictures, seconds, started = np.zeros((SIZE[1], SIZE[0], 4)), {}, {}, user_seconds()
    context, history, covered = light_context(scene, threads), None, np.zeros((SIZE[1], SIZE[0]))
    for index in range(samples):
        frame = draw_frame(context, field, view, SIZE, index=index, offset=sample_offset(index), history=history)
        frame = apply_all(frame, field, [chosen])
        history, covered = frame.history, covered + frame.gbuffer.seen
        total += frame.light
        if index + 1 in (1, 4, 16, 64, 256, samples):
            pictures[index + 1] = np.flipud(total[..., :3] / (index + 1))
            seconds[index + 1] = user_seconds() - started
    return pictures, seconds, np.flipud(covered == samples)


def draw_within(scene: Scene, error: float, chosen: Chosen, threads: int | None) -> tuple:
    """The picture (h, w, 3) that is thought to be within ``error``, row 0 at the top; the mean of its pixels' samples, what its
    error is thought to be, CPU seconds, and what shows a surface."""
    started = user_seconds()
    drawn = draw_pictures(light_context(scene, threads), None, CameraView.of(scene.cameras[0]), SIZE, shown=("combined", "albedo"),
                          samples=MOST_SAMPLES, error=error, effects=[chosen], threads=threads)
    seconds, (picture, albedo) = user_seconds() - started, (np.flipud(drawn.pictures[name]) for name in ("combined", "albedo"))
    return picture[..., :3], drawn.samples, drawn.error, seconds, albedo[..., 3] > 0.999


def errors(found: np.ndarray, cycles: np.ndarray, seen: np.ndarray) -> tuple[float, float, float]:
    """Relative RMSE of ``found`` (h, w, 3) and of one of the renders ``cycles`` (2, h, w, 3), and the bias of the former."""
    (first, second), own = (part[seen].astype(np.float64) for part in cycles), found[seen]
    level = float(0.5 * (first + second).mean())
    off = np.sqrt(max(float(((own - first) * (own - second)).mean()), 0.0))
    noise = np.sqrt(0.5 * float(np.square(first - second).mean()))
    return off / level, noise / level, float(own.mean() - level) / level


def measure(name: str, options, say) -> dict:
    """One sample's row, and its sheet."""
    cycles = kept(f"gather_{name}", options.cycles_samples,
                  lambda: render_cycles(name, options.cycles_samples, options.threads), options.again)
    open_sample(name, SIZE, options.density)
    scene, effect = extract_scene(), options.chosen.effect
    row = {"sample": name, "cycles_samples": cycles["samples"], "cycles_seconds": float(cycles["seconds"]), "steps": []}
    if options.samples is None:
        found, mean, thought, taken, seen = draw_within(scene, HELD_TO.get(name, 0.02), options.chosen, options.threads)
        row["thought"], pictures, seconds = thought, {mean: found}, {mean: taken}
    else:
        field = None if effect.stage == "light" else bake_field(
            scene, "probes", {"fit": options.fit}, threads=options.threads,
            spheres=SphereSettings() if effect.reads_spheres else None)
        pictures, seconds, seen = draw(scene, options.samples, options.chosen, options.threads, field)
    for count, picture in pictures.items():
        off, noise, bias = errors(picture, cycles["pictures"], seen)
        row["steps"].append({"samples": count, "error": off, "bias": bias, "seconds": seconds[count], "cycles_noise": noise,
                             "ratio": row["cycles_seconds"] * (noise / max(off, 1e-9)) ** 2 / seconds[count]})
        say(line(row, row["steps"][-1]))
    true, last = cycles["pictures"].mean(axis=0), pictures[max(pictures)]
    level = float(luminance(true[seen]).mean())
    signed = np.where(seen, (luminance(last) - luminance(true)) / np.maximum(luminance(true), 0.1 * level), 0.0)
    exposure = min(1.0, 0.5 / max(level, 1e-9))
    sheet([[(f"{name}: {effect.name}, {100 * off:.1f} %", displayed(exposure * last)), ("Cycles", displayed(exposure * true)),
            ("difference (full colour: 25 %)", signed_colours(signed))]], RESULTS / f"gather_{name}_{effect.name}.png")
    return row


def line(row: dict, step: dict) -> str:
    """A row of the table."""
    return (f"| {row['sample']} | {step['samples']:.1f} | {100 * step['error']:.2f} % | {100 * step['bias']:+.2f} % | "
            f"{100 * HELD_TO.get(row['sample'], 0.02):.0f} % | {step['seconds']:.1f} | "
            f"{step['seconds'] * step['ratio']:.0f} | {step['ratio']:.1f}× |")


def main() -> int:
    """Measure what the command line names; print the table, write sheets and benchmarks/results/final_gather.json."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", metavar="sample", help=f"default: all of {', '.join(SAMPLES)}")
    parser.add_argument("--samples", type=int, help="as many for every pixel; default: as the picture needs")
    parser.add_argument("--cycles-samples", type=int, default=512)
    parser.add_argument("--threads", type=int)
    parser.add_argument("--again", action="store_true")
    parser.add_argument("--effect", default="ray_traced")
    parser.add_argument("--fit", action="store_true", help="fit the probes to what surfaces read")
    parser.add_argument("--density", type=float, default=1.0, help="lattices this many times as fine")
    parser.add_argument("--set", action="append", default=[], metavar="NAME=VALUE", help="settings of the effect")
    after = sys.argv[sys.argv.index("--") + 1:] if "--" in sys.argv else sys.argv[1:]
    options = parser.parse_args(after)
    values = dict(item.split("=") for item in options.set)
    effect = get(options.effect)
    options.chosen = Chosen(effect, effect.Settings(**{name: json.loads(value) for name, value in values.items()}))
    if options.samples is None and not effect.local:
        parser.error("--effect needs --samples unless it is one whose pixels may have more than others")
    streams = Streams()

    def say(text):
        print(text, file=streams.out, flush=True)

    say("| sample | samples | error | bias | held to | CPU [s] | Cycles for that error, CPU [s] | ratio |\n|---|" + "---:|" * 7)
    RESULTS.mkdir(parents=True, exist_ok=True)
    rows = [measure(name, options, say) for name in options.names or SAMPLES]
    (RESULTS / "final_gather.json").write_text(json.dumps(rows, indent=1))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
