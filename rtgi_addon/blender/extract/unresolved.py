"""What a file refers to and Blender could not bring: data from libraries and files that are not there, and drivers whose Python was
not run.

Blender goes on without a word, with empties, default materials and zeros; light that comes from such data cannot be known.
"""

import stat
from pathlib import Path

import bpy

from ...errors import BakeError
from ...scene import Omissions

_SHOWN_NAMES = 4
_FIND = "restore it, or choose File > External Data > Find Missing Files; or remove what needs it"


def require_files() -> None:
    """Raise BakeError for a pipe or a device in the place of a file that Blender reads: it would wait for it for ever, or read on
    and on. To be asked before anything is evaluated."""
    for block in (*bpy.data.images, *bpy.data.cache_files, *bpy.data.volumes, *bpy.data.fonts):
        if not block.filepath or block.filepath == "<builtin>" or getattr(block, "packed_file", None) is not None:
            continue
        path = bpy.path.abspath(block.filepath, library=block.library)
        try:
            kind = Path(path).stat().st_mode
        except (OSError, ValueError):
            continue
        if not (stat.S_ISREG(kind) or stat.S_ISDIR(kind)):
            raise BakeError(f"{block.bl_rna.name.lower()} {block.name!r} is read from {path}, a pipe, a device or a socket",
                            "give it a file, or remove it")


def note_unresolved(scene, view_layer, omissions: Omissions) -> None:
    """Say to ``omissions`` what of ``view_layer`` of ``scene`` is missing, by library, file or driver and the objects concerned.

    After the dependency graph was evaluated: whether a driver is valid is known only then.
    """
    usage = _Usage(scene, view_layer)
    if len(bpy.data.libraries):
        _note_missing_data(usage, omissions)
    _note_missing_files(usage, omissions)
    _note_texture_limit(scene, usage, omissions)
    if bpy.app.autoexec_fail:
        _note_scripts(usage, omissions)


def _note_missing_data(usage, omissions) -> None:
    lost: dict[object, dict] = {}
    for block in _blocks():
        if block.library is not None and block.is_missing:
            concerned = usage.of(block)
            if concerned:
                lost.setdefault(block.library, {})[block] = concerned
    for library, blocks in lost.items():
        state = "is missing" if library.is_missing else "has changed"
        names = [_named(block, concerned) for block, concerned in blocks.items()]
        omissions.add(f"library {library.filepath} {state}, and {_listed(names)} is not there",
                      objects=sorted(set().union(*blocks.values())), remedy=_FIND)


def _note_missing_files(usage, omissions) -> None:
    """Of caches of geometry (Alembic, USD), OpenVDB files and fonts; images are the materials' business. A sequence is looked for
    by its folder: which of its files is read depends on the frame."""
    for block in (*bpy.data.cache_files, *bpy.data.volumes, *bpy.data.fonts):
        if not block.filepath or block.filepath == "<builtin>" or getattr(block, "packed_file", None) is not None:
            continue
        path = Path(bpy.path.abspath(block.filepath, library=block.library))
        concerned = () if (path.parent if getattr(block, "is_sequence", False) else path).exists() else usage.of(block)
        if concerned:
            omissions.add(f"file {block.filepath} is missing, and with it {_named(block, concerned)}", objects=sorted(concerned),
                          remedy=_FIND)


def _note_texture_limit(scene, usage, omissions) -> None:
    """Of images that Cycles makes smaller before it renders: *Simplify > Texture Limit*. Here they are whole."""
    limit = getattr(getattr(scene, "cycles", None), "texture_limit_render", "OFF")
    if not scene.render.use_simplify or limit == "OFF":
        return
    for image in bpy.data.images:
        # Asked for its size an image is read: only one that somebody uses.
        concerned = usage.of(image) if image.users else ()
        if concerned and max(image.size) > int(limit):
            omissions.add(f"image {image.name} is read whole, and Cycles makes it no larger than {limit} pixels "
                          f"(Simplify > Texture Limit)", objects=sorted(concerned))


def _note_scripts(usage, omissions) -> None:
    for block in _blocks():
        expressions = [curve.driver.expression for owner in (block, getattr(block, "node_tree", None))
                       for curve in getattr(getattr(owner, "animation_data", None), "drivers", ())
                       if curve.driver.type == "SCRIPTED" and not curve.driver.is_valid]
        concerned = usage.of(block) if expressions else ()
        if concerned:
            omissions.add(f"{_named(block, concerned)} is driven by Python that was not run: {_listed(expressions)}",
                          objects=sorted(concerned), remedy="allow the file's scripts if you trust it (--enable-scripts, or Allow "
                                                            "Execution), or delete the driver")
    for text in bpy.data.texts:
        if text.use_module:
            omissions.add(f"text {text.name} is to run when the file is opened, and was not run")


def _named(block, concerned) -> str:
    """A datablock's name, with the objects that need it unless it is one of that name."""
    return block.name if concerned == {block.name} else f"{block.name} (for {_listed(sorted(concerned))})"


class _Usage:
    """Which objects of a view layer a datablock is part of."""

    def __init__(self, scene, view_layer):
        self._scene, self._layer = scene, view_layer
        self._shown, waiting = set(), list(view_layer.objects)
        while waiting:
            obj = waiting.pop()
            if obj not in self._shown:
                self._shown.add(obj)
                if obj.instance_type == "COLLECTION" and obj.instance_collection is not None:
                    waiting.extend(obj.instance_collection.all_objects)
        self._users = None

    def of(self, block) -> set[str]:
        """Names of the objects in the view layer that use ``block`` over any number of steps, or of the scene itself."""
        if self._users is None:
            self._users = bpy.data.user_map()
        found, seen, waiting = set(), {block}, [block]
        while waiting:
            now = waiting.pop()
            if isinstance(now, bpy.types.Object) and now in self._shown:
                found.add(now.name)
            elif isinstance(now, bpy.types.Scene):
                if now == self._scene:
                    found.add(now.name)
            else:
                users = {user for user in self._users.get(now, ()) if user not in seen and self._carries(now, user)}
                seen |= users
                waiting.extend(users)
        return found

    def _carries(self, block, user) -> bool:
        """True if ``user`` shows what ``block`` gives it. Every object hangs in collections and scenes, which may be switched off:
        the view layer's own list says which are shown; a collection that is missing itself has no objects to ask."""
        if isinstance(block, bpy.types.Object):
            return not isinstance(user, (bpy.types.Collection, bpy.types.Scene))
        if isinstance(block, bpy.types.Collection) and isinstance(user, bpy.types.Scene):
            return not any(layer.exclude for layer in _layer_collections(self._layer.layer_collection, block))
        return True


def _layer_collections(layer, collection):
    if layer.collection == collection:
        yield layer
    for child in layer.children:
        yield from _layer_collections(child, collection)


def _blocks():
    """Every datablock of the file."""
    for name, declared in bpy.data.bl_rna.properties.items():
        if declared.type == "COLLECTION" and name != "libraries":
            yield from getattr(bpy.data, name)


def _listed(names) -> str:
    names = list(dict.fromkeys(names))
    more = f" (and {len(names) - _SHOWN_NAMES} more)" if len(names) > _SHOWN_NAMES else ""
    return ", ".join(names[:_SHOWN_NAMES]) + more
