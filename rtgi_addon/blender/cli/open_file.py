"""Getting a scene into Blender: a .blend, a glTF file, or what is open already."""

import re
import stat
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import bpy

from ...errors import BakeError
from ...scene import Omission
from ...storage.files import disk_error
from ...storage.paths import resolved
from ..ui import properties, role_properties
from .gltf import import_gltf

_GLTF = (".glb", ".gltf")


@contextmanager
def known_properties() -> Iterator[None]:
    """Register the add-on's properties, through which volumes' overrides and what objects and lamps are to bakes are read, for as
    long as the add-on itself is not enabled: in Blender as a Python module it never is."""
    if hasattr(bpy.types.LightProbe, "rtgi"):
        yield
        return
    with ExitStack() as stack:
        for module in (properties, role_properties):
            module.register()
            stack.callback(module.unregister)
        yield


def open_file(name: str, scripts: bool = False) -> tuple[Omission, ...]:
    """Open a .blend (``scripts``: and run its Python), or import a .glb or .gltf into an empty file; returns what of that Blender
    did not take in. Raises BakeError for a file that is missing, damaged, of a newer Blender or of another kind."""
    path = _existing(name)
    if path.suffix.lower() in _GLTF:
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        return _import_gltf(path)
    if path.suffix.lower().startswith(".blend"):
        _open_blend(path, scripts)
        return ()
    raise BakeError(f"{path} is neither a .blend nor a .glb or .gltf", "convert it, or correct the path")


def take_open_file(imported: str | None, scripts: bool = False) -> tuple[Omission, ...]:
    """Take the file that Blender was started with (``scripts``: with its Python run), and import the glTF file ``imported`` into
    it, or in place of the startup scene if there is none; returns what of that Blender did not take in. Raises BakeError if there
    is neither."""
    if not bpy.data.filepath:
        # Blender goes on with its startup scene after a FILE that it could not read.
        file = next((word for word in sys.argv[1:] if word.lower().endswith(".blend")), None)
        if file is not None:
            raise BakeError(f"Blender {bpy.app.version_string} could not read {file}, which is missing or damaged",
                            "correct the path, or restore the file from a backup")
        if imported is None:
            raise BakeError("no .blend is open", "name one before --command, or give --import FILE.glb")
        bpy.data.batch_remove(list(bpy.data.objects))
        bpy.context.scene.world = None
    else:
        if scripts and bpy.app.autoexec_fail:
            _open_blend(Path(bpy.data.filepath), scripts)
        _require_known_version(Path(bpy.data.filepath))
    return () if imported is None else _import_gltf(_existing(imported))


def _existing(name: str) -> Path:
    path = resolved(name, "the path")
    try:
        kind = path.stat().st_mode
    except FileNotFoundError:
        raise BakeError(f"there is no file {path}", "correct the path") from None
    except OSError as error:
        raise disk_error(path, error, doing="read") from error
    if not stat.S_ISREG(kind):
        raise BakeError(f"{path} is not a file", "correct the path")
    return path


def _open_blend(path: Path, scripts: bool) -> None:
    try:
        bpy.ops.wm.open_mainfile(filepath=str(path), load_ui=False, use_scripts=scripts)
    except RuntimeError as error:
        raise BakeError(f"{path} is not a .blend that Blender {bpy.app.version_string} can read, {_reason(error)}",
                        "restore it from a backup, or save it again with the Blender that made it") from error
    _require_known_version(path)


def _require_known_version(path: Path) -> None:
    """Blender opens files of newer versions and drops what it does not know: their bakes would be silently wrong."""
    saved, running = tuple(bpy.data.version[:2]), tuple(bpy.app.version[:2])
    if saved > running:
        raise BakeError(f"{path} was saved by Blender {saved[0]}.{saved[1]}, newer than this Blender {running[0]}.{running[1]}",
                        f"bake with Blender {saved[0]}.{saved[1]} or later")


def _import_gltf(path: Path) -> tuple[Omission, ...]:
    if path.suffix.lower() not in _GLTF:
        raise BakeError(f"{path} is not a .glb or .gltf", "correct the path")
    try:
        return import_gltf(path)
    except RuntimeError as error:
        raise BakeError(f"{path} is not glTF that Blender can import, {_reason(error)}",
                        "export it again, or import it in Blender and save a .blend") from error


def _reason(error: RuntimeError) -> str:
    """Blender's own reason without its prefixes and the path, which the message names already."""
    text = str(error).strip().splitlines()[-1].removeprefix("Error: ")
    text = re.sub(r"""^Loading ["'].*?["'] failed: """, "", text)
    text = re.sub(r"""^Failed to read blend file ["'].*["']: """, "", text)
    text = re.sub(r""" in file ["'].*["']$""", "", text)
    return text[:1].lower() + text[1:].rstrip(".")
