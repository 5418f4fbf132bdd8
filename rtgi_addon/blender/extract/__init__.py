"""Reading the open .blend into a ``Scene``: the only way from Blender to light transport."""

from .extract import extract_scene

__all__ = ["extract_scene"]
