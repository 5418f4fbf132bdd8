"""Evaluated data as it is to be read."""

from collections.abc import Iterator
from contextlib import contextmanager

import bpy


@contextmanager
def evaluated_mesh(obj) -> Iterator[bpy.types.Mesh]:
    """The evaluated mesh of a MESH object, whole, for as long as the context lasts.

    Of an object in Edit Mode ``obj.data`` is a shell around the BMesh under edit, without faces to read: F12 takes what
    ``to_mesh`` makes of it (the modifiers shown in Edit Mode), and so does this.
    """
    if not obj.data.is_editmode:
        yield obj.data
        return
    try:
        yield obj.to_mesh()
    finally:
        obj.to_mesh_clear()
