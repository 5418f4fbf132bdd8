"""How far is a bake at default settings from Cycles in files made by other people, and why?

    python benchmarks/real_scenes.py FILE… [--world IMAGE] [--probes 20] [--noise 0.004] [--seconds 120]

FILE is a .blend, .glb or .gltf; ``--world`` puts an environment image around each of them in place of its world. Every file is
opened, extracted and baked as the command line does it, and some of its usable probes, far from one another, are rendered with
Cycles. Differences are taken apart in three steps, each a relative RMSE of the SH coefficients at the same probes:

- *Cycles*: the bake against Cycles on the file as it is. Signed bias (of the mean radiance) and the worst probe belong to it.
- *matte*: the same, both sides anew, with every material's gloss, bumps and Oren-Nayar roughness taken away. What is left is
  what extraction or transport get wrong; what went away is what diffuse transport cannot know.
- *path*: the bake against the path reference on the very Scene that was baked: what the bake alone gets wrong.

The variance of every reference is subtracted. A file that has nothing to bake prints the product's own reason.

Cycles' pixels find the small sun of an image by chance alone. With ``--world`` Cycles therefore renders what surfaces reflect
and emit, and what a probe sees of the world itself is added from the path reference, which samples it (extraction's worlds are
held to Cycles in the tests).
"""

import argparse
import sys
import time
from dataclasses import replace
from pathlib import Path

import bpy
import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from rtgi_addon import techniques  # noqa: E402
from rtgi_addon.blender.cli.open_file import open_file  # noqa: E402
from rtgi_addon.blender.cli.streams import Streams  # noqa: E402
from rtgi_addon.blender.cycles.reference import CyclesSettings, points_in_the_open, render_probes  # noqa: E402
from rtgi_addon.blender.extract import extract_scene  # noqa: E402
from rtgi_addon.errors import BakeError  # noqa: E402
from rtgi_addon.evaluate.metrics import relative_rmse, signed_bias  # noqa: E402
from rtgi_addon.numerics import grid as lattice  # noqa: E402
from rtgi_addon.progress import Progress  # noqa: E402
from rtgi_addon.scene import Channel  # noqa: E402
from rtgi_addon.scene.checks import check_scene, require  # noqa: E402
from rtgi_addon.transport.context import LightContext  # noqa: E402
from rtgi_addon.transport.paths.reference import probe_sh  # noqa: E402

# Inputs of shader nodes that make a surface shine or bump, and what switches each off.
GLOSS = {"Metallic": 0.0, "Specular IOR Level": 0.0, "Coat Weight": 0.0, "Sheen Weight": 0.0, "Transmission Weight": 0.0,
         "Subsurface Weight": 0.0, "Diffuse Roughness": 0.0}


def open_scene(path: Path, world: Path | None) -> None:
    """Open ``path`` and, given an image, light it by that alone besides its lamps."""
    open_file(str(path))
    if world is None:
        return
    scene = bpy.context.scene
    scene.world = bpy.data.worlds.new("image")
    if bpy.app.version < (5, 0):
        scene.world.use_nodes = True
    tree = scene.world.node_tree
    image = tree.nodes.new("ShaderNodeTexEnvironment")
    image.image = bpy.data.images.load(str(world))
    background = next(node for node in tree.nodes if node.bl_idname == "ShaderNodeBackground")
    tree.links.new(image.outputs["Color"], background.inputs["Color"])
    scene.world.cycles_visibility.camera = False


def make_matte() -> None:
    """Take gloss, bumps and rough diffuse reflection from every material of the open file; colours and emission stay."""
    for material in bpy.data.materials:
        if material.node_tree is None:
            continue
        tree = material.node_tree
        for node in list(tree.nodes):
            if node.bl_idname == "ShaderNodeBsdfAnisotropic":
                _replace_by_diffuse(tree, node)
                continue
            values = dict(GLOSS, Roughness=0.0) if node.bl_idname == "ShaderNodeBsdfDiffuse" else GLOSS
            for name in (*values, "Normal", "Coat Normal"):
                socket = node.inputs.get(name) if node.bl_idname.startswith("ShaderNodeBsdf") else None
                if socket is None:
                    continue
                for link in list(socket.links):
                    tree.links.remove(link)
                if name in values:
                    socket.default_value = values[name]


def _replace_by_diffuse(tree, node) -> None:
    diffuse = tree.nodes.new("ShaderNodeBsdfDiffuse")
    diffuse.inputs["Color"].default_value = node.inputs["Color"].default_value
    for link in list(node.inputs["Color"].links):
        tree.links.new(link.from_socket, diffuse.inputs["Color"])
    for link in list(node.outputs[0].links):
        tree.links.new(diffuse.outputs[0], link.to_socket)


def bake() -> tuple:
    """Scene, grids and seconds of one bake of the open file at default settings."""
    started = time.perf_counter()
    scene = extract_scene()
    require(check_scene(scene))
    method = techniques.get("probes")
    field = method.bake(scene, method.Settings(), np.random.default_rng(0), Progress())
    return scene, field.grids(), time.perf_counter() - started


def choose(grids, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Positions (n, 3) of at most ``count`` usable probes in the open, and their flat indices over all ``grids``."""
    volumes = [grid.volume for grid in grids]
    points = np.concatenate([lattice.lattice_points(v.world_from_local, v.resolution).reshape(-1, 3) for v in volumes])
    usable = np.flatnonzero(np.concatenate([g.usable.ravel() for g in grids]))
    usable = usable[np.unique(np.linspace(0, len(usable) - 1, 400).astype(int))]
    clearance = 0.1 * min(float(lattice.cell_size(v.world_from_local, v.resolution).min()) for v in volumes)
    chosen = usable[points_in_the_open(bpy.context.scene, points[usable], clearance, count)]
    return points[chosen], chosen


def coefficients(grids, chosen: np.ndarray) -> np.ndarray:
    """SH (n, k, 3) of the probes with flat indices ``chosen``."""
    return np.concatenate([g.sh.reshape(-1, *g.sh.shape[3:]) for g in grids])[chosen]


def cycles(points: np.ndarray, noise: float, seconds: float) -> tuple[np.ndarray, np.ndarray]:
    """SH and variance at ``points`` by Cycles, until its relative noise or the time is reached."""
    estimates, started = [], time.perf_counter()
    while True:
        settings = CyclesSettings(resolution=96, samples=8, first_seed=500 + len(estimates))
        estimates.append(render_probes(points, settings)["sh"])
        if len(estimates) < 4:
            continue
        mean, variance = np.mean(estimates, axis=0), np.var(estimates, axis=0, ddof=1) / len(estimates)
        if variance.sum() <= noise**2 * np.square(mean).sum() or time.perf_counter() - started > seconds:
            return mean, variance


def world_seen(scene, points: np.ndarray) -> np.ndarray:
    """SH (n, k, 3) of what ``points`` see of the world between the surfaces of ``scene``."""
    dark = tuple(replace(material, emission=Channel.of(0.0)) for material in scene.materials)
    return probe_sh(LightContext(replace(scene, materials=dark)), points, 2, 1 << 16, bounces=0, seed=7).mean


def path_reference(scene, points: np.ndarray, noise: float, seconds: float) -> tuple[np.ndarray, np.ndarray]:
    """SH and variance at ``points`` by the path reference on the extracted ``scene``."""
    context, samples, started = LightContext(scene), 1024, time.perf_counter()
    while True:
        estimate = probe_sh(context, points, 2, samples, seed=9)
        variance = np.square(estimate.standard_error.astype(np.float64))
        spent = time.perf_counter() - started
        if variance.sum() <= noise**2 * np.square(estimate.mean).sum() or 5 * spent > seconds:
            return estimate.mean.astype(np.float64), variance
        samples *= 4


def measure(path: Path, options, say) -> str:
    """One row of the table."""
    open_scene(path, options.world)
    scene, grids, seconds = bake()
    for note in scene.notes:
        say(f"  {note}")
    points, chosen = choose(grids, options.probes)
    baked = coefficients(grids, chosen)
    reference, variance = cycles(points, options.noise, options.seconds)
    world = 0.0 if options.world is None else world_seen(scene, points)
    reference = reference + world
    worst = max(relative_rmse(baked[i:i + 1], reference[i:i + 1], variance[i:i + 1]) for i in range(len(baked)))
    bias = signed_bias(baked, reference)
    path_sh, path_variance = path_reference(scene, points, options.noise, options.seconds)
    say(f"  noise: Cycles {_noise(reference, variance):.2%}, path {_noise(path_sh, path_variance):.2%}; path against Cycles "
        f"{relative_rmse(path_sh, reference, variance + path_variance):.2%}, bias {signed_bias(path_sh, reference).value:+.2%}")
    open_scene(path, options.world)
    make_matte()
    _, matte_grids, _ = bake()
    matte_reference, matte_variance = cycles(points, options.noise, options.seconds)
    matte_reference = matte_reference + world
    matte = coefficients(matte_grids, chosen)
    matte_bias = signed_bias(matte, matte_reference)
    say(f"  matte: noise {_noise(matte_reference, matte_variance):.2%}, bias {matte_bias.value:+.2%}")
    name = path.name if options.world is None else f"{path.name} in {options.world.name}"
    triangles = sum(len(scene.meshes[instance.mesh].triangles) for instance in scene.instances)
    usable = np.concatenate([g.usable.ravel() for g in grids])
    return (f"| {name} | {triangles:,} | {len(usable):,} | {usable.mean():.1%} | {seconds:.1f} | "
            f"{relative_rmse(baked, reference, variance):.2%} | {bias.value:+.2%} ± {bias.standard_error:.2%} | {worst:.2%} | "
            f"{relative_rmse(matte, matte_reference, matte_variance):.2%} | "
            f"{relative_rmse(baked, path_sh, path_variance):.2%} |")


def _noise(mean, variance) -> float:
    return float(np.sqrt(variance.sum() / np.square(mean).sum()))


def main() -> int:
    """Measure every file, print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", nargs="+", type=Path, metavar="FILE", help=".blend, .glb or .gltf")
    parser.add_argument("--world", type=Path, help="environment image to light each file with, in place of its world")
    parser.add_argument("--probes", type=int, default=20, help="how many probes are compared")
    parser.add_argument("--noise", type=float, default=0.004, help="relative noise at which a reference is good enough")
    parser.add_argument("--seconds", type=float, default=120.0, help="most seconds for each reference")
    options = parser.parse_args()
    import addon_utils
    addon_utils.enable("cycles")
    streams = Streams()
    sys.stderr = streams.err

    def say(text):
        print(text, file=streams.out, flush=True)

    rows = []
    for path in options.files:
        say(path.name)
        try:
            rows.append(measure(path, options, say))
        except BakeError as error:
            say(f"  {error}")
    say("| file | triangles | probes | usable | seconds | Cycles | bias | worst probe | matte | path |\n"
        "|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|")
    say("\n".join(rows))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
