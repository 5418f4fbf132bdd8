"""Where the preview is set: Properties › Render and View Layer while RTGI is the engine, and the 3D view's header."""

import bpy
from bpy.app.translations import pgettext_iface as iface_

from ...techniques import get
from ...techniques.voxels.settings import VoxelSettings
from ..engine import ENGINE_ID
from ..engine.shown import shown_for
from ..engine.viewport import STALE, is_stale
from ..translations import sentence
from .panel_kinds import Closed, InRender, split
from .preview_settings import LIVE_SHOWN, live_property
from .sidebar import draw_lines

# Width of a popover [px].
_POPOVER = 260


class OfOurEngine(InRender):
    """A panel in the properties editor that is there for our engine alone."""

    @classmethod
    def poll(cls, context):
        """Our engine only."""
        return context.engine == ENGINE_ID


class RTGI_PT_preview(OfOurEngine, bpy.types.Panel):
    """What a preview shows and how fast."""

    bl_label = "Preview"
    bl_idname = "RTGI_PT_preview"

    def draw(self, context):
        """Technique, samples, what to show, and which bake that is."""
        layout, scene = split(self.layout), context.scene
        preview = scene.rtgi_preview
        layout.prop(scene.rtgi, "technique")
        column = layout.column(align=True)
        column.prop(preview, "samples", text="Viewport Samples")
        if preview.gather == "bake":
            column.prop(preview, "render_samples")
        column = layout.column(align=True)
        column.prop(preview, "gather")
        if preview.gather == "rays":
            column.prop(preview, "gather_error")
            column.prop(preview, "gather_samples")
        layout.prop(preview, "mode")
        layout.prop(preview, "resolution_scale")
        if issubclass(get(scene.rtgi.technique).Settings, VoxelSettings):
            layout.prop(preview, "camera_points")
        shown = shown_for(scene)
        if shown.note:
            draw_lines(layout, sentence(shown.note), context.region.width, "INFO")
        elif is_stale(scene, shown):
            draw_lines(layout, iface_(STALE), context.region.width, "ERROR")


class RTGI_PT_preview_live(Closed, OfOurEngine, bpy.types.Panel):
    """Probes without a bake."""

    bl_label = "Live Probes"
    bl_parent_id = "RTGI_PT_preview"

    @classmethod
    def poll(cls, context):
        """Where probes are shown."""
        return super().poll(context) and context.scene.rtgi.technique == "probes"

    def draw_header(self, context):
        """The switch."""
        self.layout.prop(context.scene.rtgi_preview, "live_probes", text="")

    def draw(self, context):
        """How much work a frame may be, and how fast it follows."""
        layout, preview = split(self.layout), context.scene.rtgi_preview
        layout.active = preview.live_probes
        for item in LIVE_SHOWN:
            layout.prop(preview, live_property(item))


class RTGI_PT_preview_shadows(Closed, OfOurEngine, bpy.types.Panel):
    """Shadow maps."""

    bl_label = "Shadow Maps"
    bl_parent_id = "RTGI_PT_preview"

    def draw(self, context):
        """Their size and number."""
        layout, preview = split(self.layout), context.scene.rtgi_preview
        layout.prop(preview, "shadow_resolution", text="Resolution")
        layout.prop(preview, "shadow_cascades")
        layout.prop(preview, "shadow_views")


class RTGI_PT_preview_compare(bpy.types.Panel):
    """Two techniques side by side: a popover of the 3D view's header."""

    bl_label = "Compare"
    bl_space_type = "VIEW_3D"
    bl_region_type = "HEADER"

    def draw(self, context):
        """The other technique and where the line is."""
        layout, scene = split(self.layout), context.scene
        layout.prop(scene.rtgi_preview, "compare", text="Split the Viewport")
        column = layout.column()
        column.active = scene.rtgi_preview.compare
        column.prop(scene.rtgi_preview, "compare_technique")
        column.prop(scene.rtgi_preview, "split")
        other = shown_for(scene, scene.rtgi_preview.compare_technique)
        if scene.rtgi_preview.compare and other.note:
            draw_lines(layout, sentence(other.note), _POPOVER, "INFO")


def draw_overlays(self, context):
    """In Blender's own Overlays popover, in any engine: the probes, their volumes, voxels, and where the light is off."""
    if context.space_data is None or context.space_data.type != "VIEW_3D":
        return
    layout, preview = self.layout, context.scene.rtgi_preview
    column = layout.column()
    column.active = context.space_data.overlay.show_overlays
    column.label(text="Light Probes of RTGI")
    column.row().prop(preview, "probes", expand=True)
    row = column.row()
    row.active = preview.probes != "none"
    row.prop(preview, "probe_size")
    if issubclass(get(context.scene.rtgi.technique).Settings, VoxelSettings):
        column.label(text="Voxels")
        column.row().prop(preview, "voxels", expand=True)
        row = column.row()
        row.active = preview.voxels != "none"
        row.prop(preview, "voxel_level")
    row = column.row(align=True)
    row.prop(preview, "bounds")
    if context.engine == ENGINE_ID:
        row.prop(preview, "leaks")
        column.prop(preview, "overlays_in_renders")


class RTGI_PT_film(Closed, OfOurEngine, bpy.types.Panel):
    """Blender's own switches for the film."""

    bl_label = "Film"

    def draw(self, context):
        """Transparent film."""
        split(self.layout).prop(context.scene.render, "film_transparent", text="Transparent")


class RTGI_PT_passes(OfOurEngine, bpy.types.Panel):
    """Which passes a render delivers."""

    bl_label = "Passes"
    bl_context = "view_layer"

    def draw(self, context):
        """Blender's switches and ours."""
        layout, layer = split(self.layout), context.view_layer
        column = layout.column(heading="Data")
        column.prop(layer, "use_pass_z")
        column.prop(layer, "use_pass_normal")
        column = layout.column(heading="Light")
        column.prop(layer, "use_pass_diffuse_color", text="Albedo")
        column.prop(layer.rtgi, "use_direct")
        column.prop(layer.rtgi, "use_indirect")
        column.prop(layer.rtgi, "use_irradiance")
        column = layout.column(heading="Media")
        column.prop(layer.rtgi, "use_volume_direct")
        column.prop(layer.rtgi, "use_volume_indirect")
        column.prop(layer.rtgi, "use_transmittance")
        column.prop(layer.rtgi, "use_mirror_confidence")
        column.prop(layer.rtgi, "use_mirror_distance")


def draw_header(self, context):
    """In the 3D view's header: technique, what is shown, the menu that compares, and a warning when the bake does not fit the
    scene."""
    if context.engine != ENGINE_ID or context.space_data.shading.type != "RENDERED":
        return
    scene = context.scene
    row = self.layout.row(align=True)
    row.prop(scene.rtgi, "technique", text="")
    row.prop(scene.rtgi_preview, "mode", text="")
    row.popover("RTGI_PT_preview_compare", text="", icon="MOD_MIRROR")
    shown = shown_for(scene)
    if (shown.field is None and shown.live is None) or is_stale(scene, shown):
        row.operator("rtgi.bake", text="", icon="ERROR")


_CLASSES = (RTGI_PT_preview, RTGI_PT_preview_live, RTGI_PT_preview_shadows, RTGI_PT_preview_compare, RTGI_PT_film,
            RTGI_PT_passes)


def register() -> None:
    """Register the panels and extend the header."""
    for cls in _CLASSES:
        bpy.utils.register_class(cls)
    bpy.types.VIEW3D_MT_editor_menus.append(draw_header)
    bpy.types.VIEW3D_PT_overlay.append(draw_overlays)


def unregister() -> None:
    """Take them out."""
    bpy.types.VIEW3D_PT_overlay.remove(draw_overlays)
    bpy.types.VIEW3D_MT_editor_menus.remove(draw_header)
    for cls in reversed(_CLASSES):
        bpy.utils.unregister_class(cls)
