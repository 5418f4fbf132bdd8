"""Make the sample .blend files: ``python sample_blends/build.py [names…]``, or with a real Blender
``blender -b -P sample_blends/build.py -- [names…]``.

Each sample is built from nothing, with fixed seeds, and saved compressed. Run it with the oldest supported Blender (the bpy
module 4.5), so that every later version opens the files without complaint. ``--thumbnails DIR`` also renders a small picture
of each with Cycles, to look at.
"""

import argparse
import sys
from pathlib import Path

import bpy

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))

from scenes import SAMPLES, kit  # noqa: E402  (the folder is not a package of the product)


def triangle_count() -> int:
    """Triangles of the evaluated scene, instances counted each time."""
    total, counted = 0, {}
    for item in bpy.context.evaluated_depsgraph_get().object_instances:
        obj = item.object
        if obj.type not in {"MESH", "CURVE", "FONT", "SURFACE"}:
            continue
        key = obj.data.as_pointer()
        if key not in counted:
            mesh = obj.to_mesh()
            counted[key] = len(mesh.loop_triangles)
            obj.to_mesh_clear()
        total += counted[key]
    return total


def thumbnail(path: Path) -> None:
    """Render the file that is open with few samples and a small size."""
    render = bpy.context.scene.render
    render.resolution_percentage, render.filepath = 50, str(path)
    render.image_settings.file_format = "PNG"
    bpy.context.scene.cycles.samples = 48
    bpy.context.scene.cycles.use_denoising = False
    bpy.ops.render.render(write_still=True)


def build(name: str, folder: Path) -> Path:
    """Build one sample into ``folder`` and leave it open."""
    kit.reset(name)
    SAMPLES[name]()
    path = folder / f"{name}.blend"
    bpy.context.preferences.filepaths.save_version = 0
    bpy.ops.wm.save_as_mainfile(filepath=str(path), compress=True)
    return path


def main(arguments: list[str]) -> int:
    """Build what the command line names (all by default) and print one line each."""
    parser = argparse.ArgumentParser(prog="build.py", description=__doc__)
    parser.add_argument("names", nargs="*", metavar="name", help=f"of {', '.join(SAMPLES)}")
    parser.add_argument("--out", type=Path, default=HERE, help="folder for the .blend files")
    parser.add_argument("--thumbnails", type=Path, help="also render a picture of each into this folder")
    options = parser.parse_args(arguments)
    unknown = [name for name in options.names if name not in SAMPLES]
    if unknown:
        parser.error(f"unknown sample {unknown[0]}; choose from {', '.join(SAMPLES)}")
    import addon_utils
    addon_utils.enable("cycles")
    for name in options.names or SAMPLES:
        path = build(name, options.out.resolve())
        print(f"{name}: {triangle_count():,} triangles, {path.stat().st_size / 1024:.0f} KiB", flush=True)
        if options.thumbnails:
            thumbnail(options.thumbnails.resolve() / f"{name}.png")
    return 0


if __name__ == "__main__":
    inside_blender = not sys.argv[0].endswith("build.py")
    after = sys.argv[sys.argv.index("--") + 1:] if "--" in sys.argv else []
    raise SystemExit(main(after if inside_blender else sys.argv[1:]))
