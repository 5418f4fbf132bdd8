"""Which part of a file a command reads: its scene, view layer and frame, with scripts or not, whole or not."""

import argparse
import math
from dataclasses import replace

from ...errors import BakeError, UsageError
from ...exchange.roles import LAMP_ROLES
from ...scene import Scene

OBJECT_ROLES = ("static", "dynamic", "none")
_SHOWN_NAMES = 12
# Blender's last frame (MAXFRAMEF).
LAST_FRAME = 1048574


def add_part(parser: argparse.ArgumentParser) -> None:
    """The options of every command that takes a FILE."""
    part = parser.add_argument_group("what to read of the FILE")
    part.add_argument("--import", dest="imported", metavar="FILE.glb", help="read a glTF file through Blender's importer")
    part.add_argument("--scene", metavar="NAME", help="default: the scene that was open when the file was saved")
    part.add_argument("--view-layer", metavar="NAME", help="default: the scene's active one")
    part.add_argument("--frame", type=_frame, metavar="F", help="default: the frame that the file was saved at")
    part.add_argument("--object", action="append", default=[], metavar="NAME=ROLE", dest="object_roles", type=_role(OBJECT_ROLES),
                      help=f"what an object is to the bake, whatever the file says: {', '.join(OBJECT_ROLES)}; may be repeated")
    part.add_argument("--lamp", action="append", default=[], metavar="NAME=ROLE", dest="lamp_roles", type=_role(LAMP_ROLES),
                      help=f"what of a lamp is in the bake: {', '.join(LAMP_ROLES)}; may be repeated")
    part.add_argument("--atlas", action="append", default=[], metavar="OBJECT[=UVMAP]", dest="atlas_objects",
                      help="bake this object's light at the texels of a UV map as well (default: that of the file, else one called "
                           "Lightmap, else the one for renders); may be repeated")
    part.add_argument("--enable-scripts", action="store_true",
                      help="run the Python in the file: drivers, and texts set to register. Only for files that you trust")
    part.add_argument("--accept-missing", action="store_true",
                      help="go on although libraries are missing or drivers were not run; the report says which")


def choose_part(arguments: argparse.Namespace) -> None:
    """Make the scene, view layer and frame that were asked for those of Blender's context, and give objects and lamps their roles.
    Raises UsageError for unknown names."""
    import bpy
    windows = bpy.context.window_manager.windows
    scene = bpy.context.scene
    if arguments.scene is not None:
        scene = _named(bpy.data.scenes, arguments.scene, "scene")
    if arguments.scene is not None or arguments.view_layer is not None:
        layer = None if arguments.view_layer is None else _named(scene.view_layers, arguments.view_layer, "view layer")
        if not len(windows):
            raise BakeError("this Blender has no window, where alone a scene can be chosen", "leave out --scene and --view-layer")
        for window in windows:
            window.scene = scene
            window.view_layer = layer or window.view_layer
    if arguments.frame is not None:
        whole = math.floor(arguments.frame)
        scene.frame_set(whole, subframe=arguments.frame - whole)
    for name, role in arguments.object_roles:
        _named(bpy.data.objects, name, "object").rtgi.bake = role.upper()
    for name, role in arguments.lamp_roles:
        lamps = {obj.name: obj for obj in bpy.data.objects if obj.type == "LIGHT"}
        if name not in lamps:
            raise _unknown("lamp", name, list(lamps))
        lamp = lamps[name]
        if lamp.data.users > 1:  # others that share its data stay as they are
            lamp.data = lamp.data.copy()
        lamp.data.rtgi.bake = role.upper()
    for text in arguments.atlas_objects:
        # A name may hold an equals sign.
        name, uv = (text, "") if text in bpy.data.objects else text.rpartition("=")[::2] if "=" in text else (text, "")
        group = _named(bpy.data.objects, name, "object").rtgi
        group.atlas, group.atlas_uv = True, uv or group.atlas_uv
    for name, uv in getattr(arguments, "shown_atlas", ()):
        if name in bpy.data.objects:
            bpy.data.objects[name].rtgi.atlas, bpy.data.objects[name].rtgi.atlas_uv = True, uv


def accepted(scene: Scene, arguments: argparse.Namespace) -> Scene:
    """``scene`` as it is to be worked on: with `--accept-missing`, what is missing is told and refuses nothing."""
    if not arguments.accept_missing:
        return scene
    return replace(scene, omissions=tuple(replace(omission, remedy="") for omission in scene.omissions))


def _named(known, name: str, kind: str):
    found = known.get(name)
    if found is None:
        raise _unknown(kind, name, [entry.name for entry in known])
    return found


def _unknown(kind: str, name: str, known: list[str]) -> UsageError:
    more = f" and {len(known) - _SHOWN_NAMES} more" if len(known) > _SHOWN_NAMES else ""
    return UsageError(f"unknown {kind} {name!r}",
                      f"choose one of {', '.join(known[:_SHOWN_NAMES])}{more}" if known else f"the file has no {kind}")


def _role(known: tuple[str, ...]):
    """A type of argument: a name and one of the roles ``known``."""
    def parse(text: str) -> tuple[str, str]:
        # From the right: names may hold an equals sign.
        name, equals, role = text.rpartition("=")
        if not equals or not name or role not in known:
            raise argparse.ArgumentTypeError(f"{text!r} is not NAME={'|'.join(known)}")
        return name, role

    return parse


def _frame(text: str) -> float:
    value = float(text)
    if not abs(value) <= LAST_FRAME:
        raise argparse.ArgumentTypeError(f"{text} is not a frame")
    return value
