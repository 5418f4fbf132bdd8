"""One life of the extension in a Blender: install the zip, bake, check, render, disable, uninstall; what was seen goes to a file.

    blender -b --python tests/support/extension_session.py -- ZIP FILE.blend FOLDER REPORT.json
    python tests/support/extension_session.py -- ZIP FILE.blend FOLDER REPORT.json          with the bpy module

BLENDER_USER_RESOURCES must name an empty folder.
"""

import errno
import json
import os
import socket
import sys
import traceback
from importlib.machinery import PathFinder
from pathlib import Path

import bpy

import addon_utils  # isort: skip  (bpy puts it on the path)

NAME = "bl_ext.user_default.rtgi_addon"


def named(function) -> str:
    """Where a function comes from; a callable object by its class."""
    return f"{function.__module__}.{getattr(function, '__qualname__', type(function).__name__)}"


def traces() -> set[str]:
    """Everything that an add-on could leave in Blender, whoever it belongs to."""
    found = {f"type {name}" for name in dir(bpy.types)}
    for name in dir(bpy.types):
        kind = getattr(bpy.types, name)
        if hasattr(kind, "bl_rna"):
            found |= {f"property {name}.{key}" for key in kind.bl_rna.properties.keys()}
        found |= {f"engine of {name}: {engine}" for engine in getattr(kind, "COMPAT_ENGINES", None) or ()}
        # Whoever adds to what is drawn makes a list of it, with Blender's own function at its head.
        found |= {f"drawn in {name}: {named(function)}" for function in getattr(getattr(kind, "draw", None), "_draw_funcs", ())
                  if named(function) != f"{kind.__module__}.{name}.draw"}
    for event in dir(bpy.app.handlers):
        handlers = getattr(bpy.app.handlers, event)
        if isinstance(handlers, list):
            found |= {f"handler {event}: {named(handler)}" for handler in handlers}
    found |= {f"operator {group}.{name}" for group in dir(bpy.ops) for name in dir(getattr(bpy.ops, group))}
    for configuration in bpy.context.window_manager.keyconfigs:
        for keys in configuration.keymaps:
            found |= {f"key {configuration.name} {keys.name} {item.idname}" for item in keys.keymap_items}
    found |= {f"driver name {name}" for name in bpy.app.driver_namespace}
    found |= {f"add-on {name}" for name in bpy.context.preferences.addons.keys()}
    return found


class OwnWheels:
    """Finds embreex among the extension's wheels alone: Python may have its own, which comes first until Blender starts again."""

    def find_spec(self, name, path=None, target=None):
        if name == "embreex":
            return PathFinder.find_spec(name, [path for path in sys.path if os.environ["BLENDER_USER_RESOURCES"] in path])
        return None


def has_network() -> bool:
    """Whether a connection can be tried at all."""
    try:
        socket.create_connection(("192.0.2.1", 80), timeout=1).close()
    except OSError as error:
        return error.errno not in (errno.ENETUNREACH, errno.EHOSTUNREACH)
    return True


def run(archive: str, blend: str, folder: Path, seen: dict) -> None:
    """Do it all and fill ``seen``."""
    seen["blender"], seen["python"] = bpy.app.version_string, sys.version.split()[0]
    seen["network"] = has_network()
    sys.meta_path.insert(0, OwnWheels())
    addon_utils.enable("bl_pkg")
    before = traces()

    bpy.ops.extensions.package_install_files(filepath=archive, repo="user_default", enable_on_install=True)
    seen["enabled"] = sorted(traces() - before)
    package = sys.modules[f"{NAME}.rtgi_addon"]
    import embreex
    seen["package"], seen["embreex"] = package.__file__, embreex.__file__

    doors = sys.modules[f"{NAME}.rtgi_addon.blender.cli.doors"]
    bpy.ops.wm.open_mainfile(filepath=blend)
    scene = bpy.context.scene
    scene.rtgi.output, scene.rtgi.mode, scene.rtgi.technique_probes.rays = str(folder / "bake"), "RAYS", 32
    seen["bake"] = sorted(bpy.ops.rtgi.bake())
    seen["notes"] = json.loads((folder / "bake/bake.json").read_text())["notes"]

    scene.render.engine = "RTGI"
    scene.render.resolution_x = scene.render.resolution_y = 32
    scene.rtgi_preview.render_samples = 1
    scene.render.filepath = str(folder / "f12.png")
    seen["render"] = sorted(bpy.ops.render.render(write_still=True))
    scene.render.engine = "BLENDER_WORKBENCH"
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=False)

    # From here on the descriptors 1 and 2 lead nowhere: see cli/streams.py.
    seen["info"] = doors.main_blender(["info", str(folder / "bake"), "--json"])

    bpy.ops.preferences.addon_disable(module=NAME)
    seen["left after disabling"] = sorted(traces() - before)
    bpy.ops.preferences.addon_enable(module=NAME)
    seen["enabled again"] = sorted(traces() - before)
    repositories = [repository.module for repository in bpy.context.preferences.extensions.repos if repository.enabled]
    bpy.ops.extensions.package_uninstall(repo_index=repositories.index("user_default"), pkg_id="rtgi_addon")
    seen["left after uninstalling"] = sorted(traces() - before)
    seen["lost"] = sorted(before - traces())
    seen["search path"] = [path for path in sys.path if os.environ["BLENDER_USER_RESOURCES"] in path]


def main() -> None:
    """Run, and report what was seen or where it ended."""
    archive, blend, folder, report = sys.argv[sys.argv.index("--") + 1:]
    seen = {}
    try:
        run(archive, blend, Path(folder), seen)
    except BaseException:
        seen["error"] = traceback.format_exc()
    Path(report).write_text(json.dumps(seen, indent=1))
    if bpy.app.version < (5, 0):
        os._exit(0)  # the module of 4.5 may hang in its own exit after any render on the GPU, EEVEE's without an add-on too


if __name__ == "__main__":
    main()
