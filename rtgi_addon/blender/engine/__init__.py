"""The render engine RTGI: F12 (`final`), viewports (`viewport`, `live`), and which bake they show (`shown`). What Blender asks of
an engine comes in here; what draws is `preview/`, what is set is `blender/ui/`.
"""

import bpy
from bpy.app.handlers import persistent

from .. import remembered
from . import elsewhere, live, panels_compat, shown, warm_up
from .engine import ENGINE_ID, RTGI_RenderEngine

__all__ = ["ENGINE_ID", "RTGI_RenderEngine", "register", "unregister"]


@persistent
def forget_before_load(*_) -> None:
    """Another file is coming: nothing that was read of this one holds."""
    live.forget()
    shown.forget()
    elsewhere.forget()
    remembered.forget()


def register() -> None:
    """Add the engine to Blender's list, and to the panels that make sense for it."""
    bpy.utils.register_class(RTGI_RenderEngine)
    panels_compat.add(ENGINE_ID)
    bpy.app.handlers.load_pre.append(forget_before_load)
    warm_up.register()
    elsewhere.register()


def unregister() -> None:
    """Take it out; scenes that use it fall back to Blender's own choice until it comes again."""
    elsewhere.unregister()
    warm_up.unregister()
    bpy.app.handlers.load_pre.remove(forget_before_load)
    forget_before_load()
    panels_compat.remove(ENGINE_ID)
    bpy.utils.unregister_class(RTGI_RenderEngine)
