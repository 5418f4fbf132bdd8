"""What objects and lamps are to bakes, where their owners' other settings are, and for the active one in the sidebar."""

import bpy
from bpy.app.translations import pgettext_iface as iface_

from ...scene.lights import ALL_LIGHT, NOT_AT_ALL
from ...scene.scene import DYNAMIC
from ..session import session
from .panel_kinds import Closed, InData, InObject, ToolPanel, split
from .role_properties import is_left_out

# What has surfaces, by Blender's types of objects.
_SOLID = {"MESH", "CURVE", "SURFACE", "META", "FONT", "EMPTY"}


def _owner(obj):
    """What of an object holds its part in bakes: a lamp's data, or the object; None for what has none."""
    if obj is None:
        return None
    return obj.data if obj.type == "LIGHT" else obj if obj.type in _SOLID else None


def _draw_role(layout, owner) -> None:
    column = split(layout).column()
    column.enabled = not session.running
    column.prop(owner.rtgi, "bake")


class RTGI_PT_object(Closed, InObject, bpy.types.Panel):
    """What an object is to bakes."""

    bl_label = "RTGI"
    bl_idname = "RTGI_PT_object"

    @classmethod
    def poll(cls, context):
        """What has surfaces, or makes instances that have, in any engine."""
        obj = getattr(context, "object", None)
        return obj is not None and _owner(obj) == obj

    def draw(self, context):
        """Static, dynamic or left out."""
        _draw_role(self.layout, context.object)


class RTGI_PT_light(Closed, InData, bpy.types.Panel):
    """What of a lamp is in bakes."""

    bl_label = "RTGI"
    bl_idname = "RTGI_PT_light"

    @classmethod
    def poll(cls, context):
        """Lamps, in any engine."""
        return getattr(context, "light", None) is not None

    def draw(self, context):
        """All of it, its bounces, or nothing."""
        _draw_role(self.layout, context.light)


class RTGI_PT_active(ToolPanel, bpy.types.Panel):
    """The active object's part in bakes, and how many have one that is not the usual."""

    bl_label = "In Bakes"
    bl_idname = "RTGI_PT_active"

    def draw(self, context):
        """The choice for the active object; with Alt, Blender sets it for all that are selected."""
        layout, owner = self.layout, _owner(context.object)
        if owner is None:
            layout.label(text="Select an object or a lamp", icon="INFO")
        else:
            layout.label(text=context.object.name, translate=False)
            _draw_role(layout.column(), owner)
        for text in _counts(context.scene):
            layout.label(text=text, translate=False)


def _counts(scene):
    """Lines about what is not as it usually is."""
    objects = [obj for obj in scene.objects if not obj.hide_render]
    solid = [obj for obj in objects if _owner(obj) == obj]
    lamps = [obj.data.rtgi.bake for obj in objects if obj.type == "LIGHT"]
    found = ((iface_("Dynamic: {0}"), sum(obj.rtgi.bake == DYNAMIC for obj in solid)),
             (iface_("Left out: {0}"), sum(map(is_left_out, solid))),
             (iface_("Lamps in bakes as a whole: {0}"), lamps.count(ALL_LIGHT)),
             (iface_("Lamps that no bake knows: {0}"), lamps.count(NOT_AT_ALL)))
    return [text.format(count) for text, count in found if count]


_CLASSES = (RTGI_PT_object, RTGI_PT_light, RTGI_PT_active)
register, unregister = bpy.utils.register_classes_factory(_CLASSES)
