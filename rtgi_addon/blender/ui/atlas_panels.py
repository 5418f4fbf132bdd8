"""The light atlas in the interface: which objects are in it, by which UV map, and how it is baked."""

from dataclasses import fields

import bpy
from bpy.app.translations import pgettext_iface as iface_
from bpy.app.translations import pgettext_rpt as rpt_

from ...effects.atlas.settings import ATLAS
from ...errors import BakeError
from ...exchange.atlas_files import INDEX
from ..atlas_materials import remove, set_up, shows_atlas
from ..bundles import bundle_folders
from ..session import session
from ..translations import sentence
from ..unwrap import unwrap
from .panel_kinds import Closed, InObject, InRender, split
from .panels import draw_setting
from .role_properties import atlas_map


class RTGI_OT_unwrap_atlas(bpy.types.Operator):
    """Give the selected meshes a UV map for the light atlas, called Lightmap: no overlaps, islands apart by its texels"""

    bl_idname = "rtgi.unwrap_atlas"
    bl_label = "Unwrap for Light Atlas"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        """Object mode, with a mesh."""
        return context.mode == "OBJECT" and context.object is not None and context.object.type == "MESH"

    def execute(self, context):
        """Unwrap them, and put them into the atlas; meshes that several objects share once."""
        chosen = [obj for obj in context.selected_objects if obj.type == "MESH"] or [context.object]
        editable = [obj for obj in chosen if obj.data.library is None and len(obj.data.polygons)]
        if not editable:
            self.report({"WARNING"}, rpt_("No mesh among the selected objects can be unwrapped"))
            return {"CANCELLED"}
        done = set()
        for obj in editable:
            if obj.data not in done:
                unwrap(context, obj, context.scene.rtgi.atlas.density)
                done.add(obj.data)
            obj.rtgi.atlas, obj.rtgi.atlas_uv = True, ""
        self.report({"INFO"}, rpt_("Unwrapped {0} meshes for the light atlas").format(len(done)))
        return {"FINISHED"}


class RTGI_OT_show_atlas(bpy.types.Operator):
    """Let EEVEE show the baked light atlas: materials of its objects get an output for EEVEE alone that reads its images"""

    bl_idname = "rtgi.show_atlas"
    bl_label = "Show in Materials"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context):
        """Set the materials up for the last bake, again after every other one."""
        folder = next((place for place in bundle_folders(context.scene) if (place / INDEX).is_file()), None)
        if folder is None:
            self.report({"ERROR"}, rpt_("No light atlas is baked: switch objects on for it, and bake"))
            return {"CANCELLED"}
        try:
            done = set_up(context.scene, folder)
        except BakeError as error:
            self.report({"ERROR"}, sentence(str(error)))
            return {"CANCELLED"}
        for note in done.notes:
            self.report({"WARNING"}, sentence(note))
        told = rpt_("{0} materials of {1} objects show the light atlas in EEVEE")
        self.report({"INFO"}, told.format(done.materials, done.objects))
        return {"FINISHED"}


class RTGI_OT_hide_atlas(bpy.types.Operator):
    """Take the nodes that show the light atlas out of all materials"""

    bl_idname = "rtgi.hide_atlas"
    bl_label = "Remove from Materials"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        """Only where there are some."""
        return shows_atlas(context.scene)

    def execute(self, context):
        """Leave materials as they were."""
        self.report({"INFO"}, rpt_("Removed from {0} materials").format(remove(context.scene)))
        return {"FINISHED"}


class RTGI_PT_object_atlas(Closed, InObject, bpy.types.Panel):
    """Whether an object's light is in the atlas, and by which UV map."""

    bl_label = "Light Atlas"
    bl_idname = "RTGI_PT_object_atlas"
    bl_parent_id = "RTGI_PT_object"

    @classmethod
    def poll(cls, context):
        """Meshes: what else is drawn has no UV maps to choose from."""
        return getattr(context, "object", None) is not None and context.object.type == "MESH"

    def draw_header(self, context):
        """The switch."""
        self.layout.enabled = not session.running
        self.layout.prop(context.object.rtgi, "atlas", text="")

    def draw(self, context):
        """The map, and how to get one."""
        column, obj = split(self.layout).column(), context.object
        column.enabled, column.active = not session.running, obj.rtgi.atlas
        column.prop_search(obj.rtgi, "atlas_uv", obj.data, "uv_layers", icon="GROUP_UVS")
        column.operator(RTGI_OT_unwrap_atlas.bl_idname, icon="UV")


class RTGI_PT_render_atlas(Closed, InRender, bpy.types.Panel):
    """How the light atlas is baked."""

    bl_label = "Light Atlas"
    bl_idname = "RTGI_PT_render_atlas"
    bl_parent_id = "RTGI_PT_render"

    def draw(self, context):
        """How many objects are in it, and its settings."""
        layout, group = split(self.layout), context.scene.rtgi.atlas
        count = sum(atlas_map(obj) is not None and not obj.hide_render for obj in context.scene.objects)
        text = iface_("{count} objects in the light atlas").format(count=count) if count else iface_(
            "No object: switch Light Atlas on in Object > RTGI")
        layout.label(text=text, translate=False, icon="UV" if count else "INFO")
        column = layout.column()
        column.enabled, column.active = not session.running, count > 0
        for item in fields(ATLAS.Settings):
            draw_setting(column, group, ATLAS, item)
        row = layout.row(align=True)
        row.enabled = not session.running
        row.operator(RTGI_OT_show_atlas.bl_idname, icon="MATERIAL")
        row.operator(RTGI_OT_hide_atlas.bl_idname, text="", icon="X")


_CLASSES = RTGI_OT_unwrap_atlas, RTGI_OT_show_atlas, RTGI_OT_hide_atlas, RTGI_PT_object_atlas, RTGI_PT_render_atlas
register, unregister = bpy.utils.register_classes_factory(_CLASSES)
