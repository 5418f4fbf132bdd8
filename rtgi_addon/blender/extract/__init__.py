"""Reading the open .blend into a ``Scene``: the only way from Blender to light transport. One module for each kind of thing that a
file has; another kind comes in as one more, with its dataclass in `scene/`. Nothing that is read here keeps Blender's own data
alive.
"""

from .extract import extract_scene, files_of_blend

__all__ = ["extract_scene", "files_of_blend"]
