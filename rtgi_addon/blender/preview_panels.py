"""Where the preview is set: Properties › Render and View Layer while RTGI is the engine, and the 3D view's header."""

import bpy
from bpy.app.translations import pgettext_iface as iface_

from .engine import ENGINE_ID
from .engine.shown import shown_for
from .engine.viewport import STALE, is_stale
from .panels import draw_lines
from .translations import sentence


class _OfOurEngine:
    """A panel in the properties editor that is there for our engine alone."""

    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "render"

    @classmethod
    def poll(cls, context):
        """Our engine only."""
        return context.engine == ENGINE_ID


class RTGI_PT_preview(_OfOurEngine, bpy.types.Panel):
    """What a preview shows and how fast."""

    bl_label = "Preview"
    bl_idname = "RTGI_PT_preview"

    def draw(self, context):
        """Technique, samples, what to show, and which bake that is."""
        layout, scene = self.layout, context.scene
        layout.use_property_split = True
        layout.use_property_decorate = False
        preview = scene.rtgi_preview
        layout.prop(scene.rtgi, "technique")
        column = layout.column(align=True)
        column.prop(preview, "samples", text="Viewport Samples")
        column.prop(preview, "render_samples")
        layout.prop(preview, "mode")
        layout.prop(preview, "resolution_scale")
        shown = shown_for(scene)
        if shown.note:
            draw_lines(layout, sentence(shown.note), context.region.width, "INFO")
        elif is_stale(scene, shown):
            draw_lines(layout, iface_(STALE), context.region.width, "ERROR")


class RTGI_PT_preview_shadows(_OfOurEngine, bpy.types.Panel):
    """Shadow maps."""

    bl_label = "Shadow Maps"
    bl_parent_id = "RTGI_PT_preview"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        """Their size and number."""
        layout, preview = self.layout, context.scene.rtgi_preview
        layout.use_property_split = True
        layout.use_property_decorate = False
        layout.prop(preview, "shadow_resolution", text="Resolution")
        layout.prop(preview, "shadow_cascades")
        layout.prop(preview, "shadow_views")


class RTGI_PT_preview_overlays(_OfOurEngine, bpy.types.Panel):
    """What is drawn over the picture."""

    bl_label = "Overlays"
    bl_parent_id = "RTGI_PT_preview"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        """Probes, bounds, leaks."""
        layout, preview = self.layout, context.scene.rtgi_preview
        layout.use_property_split = True
        layout.use_property_decorate = False
        layout.prop(preview, "probes")
        layout.prop(preview, "probe_size")
        column = layout.column(heading="Show")
        column.prop(preview, "bounds")
        column.prop(preview, "leaks")
        column.prop(preview, "overlays_in_renders")


class RTGI_PT_preview_compare(_OfOurEngine, bpy.types.Panel):
    """Two techniques side by side."""

    bl_label = "Compare"
    bl_parent_id = "RTGI_PT_preview"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        """The other technique and where the line is."""
        layout, scene = self.layout, context.scene
        layout.use_property_split = True
        layout.use_property_decorate = False
        layout.prop(scene.rtgi_preview, "compare", text="Split the Viewport")
        if not scene.rtgi_preview.compare:
            return
        layout.prop(scene.rtgi_preview, "compare_technique")
        layout.prop(scene.rtgi_preview, "split")
        other = shown_for(scene, scene.rtgi_preview.compare_technique)
        if other.note:
            draw_lines(layout, sentence(other.note), context.region.width, "INFO")


class RTGI_PT_film(_OfOurEngine, bpy.types.Panel):
    """Blender's own switches for the film."""

    bl_label = "Film"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        """Transparent film."""
        self.layout.use_property_split = True
        self.layout.prop(context.scene.render, "film_transparent", text="Transparent")


class RTGI_PT_passes(_OfOurEngine, bpy.types.Panel):
    """Which passes a render delivers."""

    bl_label = "Passes"
    bl_context = "view_layer"

    def draw(self, context):
        """Blender's switches and ours."""
        layout, layer = self.layout, context.view_layer
        layout.use_property_split = True
        layout.use_property_decorate = False
        column = layout.column(heading="Data")
        column.prop(layer, "use_pass_z")
        column.prop(layer, "use_pass_normal")
        column = layout.column(heading="Light")
        column.prop(layer, "use_pass_diffuse_color", text="Albedo")
        column.prop(layer.rtgi, "use_direct")
        column.prop(layer.rtgi, "use_indirect")
        column.prop(layer.rtgi, "use_irradiance")


def draw_header(self, context):
    """In the 3D view's header: technique, what is shown, and a warning when the bake does not fit the scene."""
    if context.engine != ENGINE_ID or context.space_data.shading.type != "RENDERED":
        return
    scene = context.scene
    row = self.layout.row(align=True)
    row.prop(scene.rtgi, "technique", text="")
    row.prop(scene.rtgi_preview, "mode", text="")
    row.prop(scene.rtgi_preview, "compare", text="", icon="MOD_MIRROR")
    if scene.rtgi_preview.compare:
        row.prop(scene.rtgi_preview, "compare_technique", text="")
    shown = shown_for(scene)
    if (shown.field is None and shown.live is None) or is_stale(scene, shown):
        row.operator("rtgi.bake", text="", icon="ERROR")


_CLASSES = (RTGI_PT_preview, RTGI_PT_preview_shadows, RTGI_PT_preview_overlays, RTGI_PT_preview_compare, RTGI_PT_film,
            RTGI_PT_passes)


def register() -> None:
    """Register the panels and extend the header."""
    for cls in _CLASSES:
        bpy.utils.register_class(cls)
    bpy.types.VIEW3D_HT_header.append(draw_header)


def unregister() -> None:
    """Take them out."""
    bpy.types.VIEW3D_HT_header.remove(draw_header)
    for cls in reversed(_CLASSES):
        bpy.utils.unregister_class(cls)
