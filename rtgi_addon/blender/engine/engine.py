"""The render engine RTGI: what Blender calls, handed on to `final` and `viewport`."""

import traceback

import bpy
from bpy.app.translations import pgettext_rpt as rpt_

from ...errors import BakeError, Cancelled
from ..translations import sentence
from . import final, passes
from .viewport import Viewport

ENGINE_ID = "RTGI"


class RTGI_RenderEngine(bpy.types.RenderEngine):
    """Shows a scene under the light that was baked for it"""

    bl_idname = ENGINE_ID
    bl_label = "RTGI"
    bl_use_preview = False
    bl_use_gpu_context = True
    bl_use_eevee_viewport = True  # for Material Preview
    bl_use_shading_nodes_custom = False
    bl_use_postprocess = True

    def __init__(self, *args, **kwargs):
        super().__init__(*args, **kwargs)
        self._viewport = Viewport()

    def update_render_passes(self, scene=None, renderlayer=None):
        """Blender asks which passes a view layer will have."""
        passes.register_passes(self, scene, renderlayer)

    def render(self, depsgraph):
        """One view layer of one frame. Blender swallows exceptions; a reported error makes the operator raise."""
        try:
            final.render(self, depsgraph)
        except Cancelled:
            return
        except BakeError as error:
            self.report({"ERROR"}, sentence(str(error)))
        except Exception as error:
            traceback.print_exc()
            self.report({"ERROR"}, rpt_("The render failed with {kind}: {error} (details in the console)").format(
                kind=type(error).__name__, error=error))

    def view_update(self, context, depsgraph):
        """The scene has changed, or a viewport has begun to show it."""
        self._viewport.update(self, context, depsgraph)

    def view_draw(self, context, depsgraph):
        """Draw one more sample into the viewport."""
        self._viewport.draw(self, context, depsgraph)
