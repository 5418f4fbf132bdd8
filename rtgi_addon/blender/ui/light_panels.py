"""Where light is changed by sliders: Properties › Render › Preview › Light while RTGI is the engine."""

import bpy

from ...techniques.transfer.columns import OTHER
from ..extract.light_groups import light_group
from ..session import redraw
from .preview_panels import OfOurEngine


class RTGI_OT_find_light_groups(bpy.types.Operator):
    """List the light groups of the scene's lamps and objects (custom property rtgi_light_group, or Blender's own light groups)"""

    bl_idname = "rtgi.find_light_groups"
    bl_label = "Find Light Groups"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context):
        """Groups that are listed keep what was set; those that are gone go."""
        groups = context.scene.rtgi_light.groups
        found = {light_group(obj) or OTHER for obj in context.scene.objects if obj.type in {"LIGHT", "MESH"}}
        for index in reversed(range(len(groups))):
            if groups[index].name not in found:
                groups.remove(index)
        for name in sorted(found - {group.name for group in groups}, key=lambda name: (name == OTHER, name)):
            groups.add().name = name
        redraw()
        return {"FINISHED"}


class RTGI_PT_light_controls(OfOurEngine, bpy.types.Panel):
    """Sliders for the light of viewports and renders."""

    bl_label = "Light"
    bl_idname = "RTGI_PT_light_controls"
    bl_parent_id = "RTGI_PT_preview"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        """Sky, sun, groups."""
        layout, light = self.layout, context.scene.rtgi_light
        layout.use_property_split = True
        layout.prop(light, "sky_turn")
        layout.prop(light, "use_sun_path")
        column = layout.column()
        column.active = light.use_sun_path
        for name in ("hour", "day", "latitude"):
            column.prop(light, name)
        layout.prop(light, "exact_sun")
        for group in light.groups:
            column = layout.column(heading=group.name, translate=False, align=True)
            column.prop(group, "strength")
            column.prop(group, "color")
        layout.operator("rtgi.find_light_groups")


_CLASSES = RTGI_OT_find_light_groups, RTGI_PT_light_controls
register, unregister = bpy.utils.register_classes_factory(_CLASSES)
