"""Where a bake goes: the folder that is set, and a folder for this session while the file has no place of its own yet.

A file that was never saved has nothing for its folder to be relative to, and a first bake should not have to wait for that. Once
the file is saved, what was baked before moves beside it.
"""

import shutil
from pathlib import Path

import bpy
from bpy.app.handlers import persistent

from ..errors import BakeError
from .session import session

_UNSAVED = "rtgi_unsaved"


def output_folder(setting: str) -> Path:
    """The absolute folder for the ``output`` property. Raises BakeError if there is none."""
    if not setting.strip():
        raise BakeError("no output folder is set", "choose one in the render properties, under RTGI")
    if setting.startswith("//") and not bpy.data.filepath:
        return _of_this_session() / setting.removeprefix("//")
    return Path(bpy.path.abspath(setting)).resolve()


def is_temporary(folder) -> bool:
    """Whether ``folder`` goes when Blender quits."""
    return _of_this_session() in Path(folder).parents


def _of_this_session() -> Path:
    return Path(bpy.app.tempdir).resolve() / _UNSAVED


@persistent
def move_beside_file(path, *_) -> None:
    """The file is about to be saved at ``path``: move what was baked before that to where its scenes say, unless something is
    there. Before it is saved, so that it is saved with the new place."""
    if not path:  # the startup file
        return
    for scene in bpy.data.scenes:
        last, setting = scene.rtgi.last_bake, scene.rtgi.output
        if not (last.folder and is_temporary(last.folder) and Path(last.folder).is_dir() and setting.startswith("//")):
            continue
        target = Path(path).resolve().parent / setting.removeprefix("//")
        if not target.exists():
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.move(last.folder, target)
            last.folder = str(target)
            if scene.name in session.records:
                session.records[scene.name]["folder"] = last.folder


def register() -> None:
    """Watch for the file being saved."""
    bpy.app.handlers.save_pre.append(move_beside_file)


def unregister() -> None:
    """Stop watching."""
    if move_beside_file in bpy.app.handlers.save_pre:
        bpy.app.handlers.save_pre.remove(move_beside_file)
