"""The overlays in viewports that another engine draws, and in ours while it shows no render."""

import traceback

import bpy

from ..ui.preview_settings import overlay_settings
from .engine import ENGINE_ID
from .layer import voxels_of
from .shown import shown_for

_handle = None
# What the overlays are of, and the overlays: None where they could not be made.
_of: tuple | None = None
_overlays = None


def wanted(context) -> bool:
    """Whether the viewport of ``context`` shows overlays that its engine does not draw itself."""
    space = context.space_data
    if space is None or space.type != "VIEW_3D" or not space.overlay.show_overlays:
        return False
    if context.engine == ENGINE_ID and space.shading.type == "RENDERED":
        return False
    settings = overlay_settings(context.scene)
    return settings.probes != "none" or settings.bounds or settings.voxels != "none"


def _draw() -> None:
    global _of, _overlays
    context = bpy.context
    if not wanted(context):
        return
    settings, field = overlay_settings(context.scene), shown_for(context.scene).field
    if field is None:
        return
    if _of is None or _of[0] != settings or _of[1] is not field:
        _of, _overlays = (settings, field), None
        try:
            from ...preview.plain_overlays import PlainOverlays  # importable once there is a GPU
            grids = field.grids() if settings.probes != "none" or settings.bounds else ()
            _overlays = PlainOverlays(settings, grids, voxels_of(field))
        except Exception:
            traceback.print_exc()
    if _overlays is not None:
        _overlays.draw()


def forget() -> None:
    """Let go of what was drawn: another file is open, or the add-on goes."""
    global _of, _overlays
    _of = _overlays = None


def register() -> None:
    """Draw with every viewport."""
    global _handle
    _handle = bpy.types.SpaceView3D.draw_handler_add(_draw, (), "WINDOW", "POST_VIEW")


def unregister() -> None:
    """Stop drawing."""
    global _handle
    bpy.types.SpaceView3D.draw_handler_remove(_handle, "WINDOW")
    _handle = None
    forget()
