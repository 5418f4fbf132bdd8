"""Sphere probes in the interface: how they are baked among the scene's settings, and what of a Light Probe Sphere counts."""

from dataclasses import fields

import bpy
from bpy.app.translations import pgettext_iface as iface_

from ...effects.spheres.settings import SPHERES
from ..extract.spheres import is_sphere
from ..session import session
from .panel_kinds import Closed, InData, InRender, split
from .panels import draw_setting


class RTGI_PT_render_spheres(Closed, InRender, bpy.types.Panel):
    """How sphere probes are baked."""

    bl_label = "Sphere Probes"
    bl_idname = "RTGI_PT_render_spheres"
    bl_parent_id = "RTGI_PT_render"

    def draw_header(self, context):
        """The switch."""
        self.layout.enabled = not session.running
        self.layout.prop(context.scene.rtgi.spheres, "bake", text="")

    def draw(self, context):
        """How many there are, and their settings."""
        layout, group = split(self.layout), context.scene.rtgi.spheres
        count = sum(is_sphere(obj) and not obj.hide_render for obj in context.scene.objects)
        text = iface_("{count} Light Probe Spheres in the scene").format(count=count) if count else iface_(
            "No Light Probe Sphere: add one with Add > Light Probe > Sphere")
        layout.label(text=text, translate=False, icon="OUTLINER_OB_LIGHTPROBE" if count else "INFO")
        column = layout.column()
        column.enabled, column.active = not session.running, group.bake
        for item in fields(SPHERES.Settings):
            if item.name != "bake":
                draw_setting(column, group, SPHERES, item)


class RTGI_PT_sphere(InData, bpy.types.Panel):
    """The settings of a Light Probe Sphere that count, where RTGI is the engine."""

    bl_label = "Probe"
    bl_idname = "RTGI_PT_sphere"

    @classmethod
    def poll(cls, context):
        """Light Probe Spheres, our engine."""
        probe = getattr(context, "lightprobe", None)
        return probe is not None and probe.type in {"SPHERE", "CUBEMAP", "CUBE"} and context.engine == "RTGI"

    def draw(self, context):
        """Influence, clipping and parallax, as Blender names them."""
        layout, probe = split(self.layout), context.lightprobe
        column = layout.column()
        column.enabled = not session.running
        column.prop(probe, "influence_type")
        column.prop(probe, "influence_distance", text="Size" if probe.influence_type == "BOX" else "Radius")
        column.prop(probe, "falloff")
        clip = column.column(align=True)
        clip.prop(probe, "clip_start")
        clip.prop(probe, "clip_end", text="End")
        column.prop(probe, "use_custom_parallax")
        if probe.use_custom_parallax:
            column.prop(probe, "parallax_type")
            column.prop(probe, "parallax_distance", text="Size" if probe.parallax_type == "BOX" else "Radius")


_CLASSES = RTGI_PT_render_spheres, RTGI_PT_sphere
register, unregister = bpy.utils.register_classes_factory(_CLASSES)
