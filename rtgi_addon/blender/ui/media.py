"""The section Media of the sidebar: what was found of fog, smoke and fire, and how pictures show it; presets of its quality through
Blender's own mechanism."""

from dataclasses import fields
from pathlib import Path

import bpy
from bl_ui.utils import PresetPanel
from bpy.app.translations import pgettext_iface as iface_
from bpy.app.translations import pgettext_tip as tip_

from ...effects import get
from ...transport.media.summary import MediumFound
from ..session import session
from .effect_settings import settings_of, switch
from .panel_kinds import ToolPanel, split
from .panels import draw_setting
from .preset_operators import AddPreset, ApplyPreset, setting_paths
from .presets import RTGI_PT_presets
from .sidebar import draw_lines

MEDIA, FOLDER = "media", "rtgi_media"
# Media that are listed at most.
_MOST = 8
TOOLTIPS = {
    "draft": "To move about in: columns of 16 pixels in 32 slices",
    "preview": "To judge a picture: columns of 8 pixels in 64 slices",
    "final": "For small smoke and sharp shafts: columns of 3 pixels in 96 slices, ten times the work",
}


class RTGI_PT_media_presets(PresetPanel, bpy.types.Panel):
    """Presets of media."""

    bl_label = "Media Presets"
    preset_subdir = FOLDER
    preset_operator = "rtgi.apply_media_preset"
    preset_add_operator = "rtgi.add_media_preset"
    draw = RTGI_PT_presets.draw


class RTGI_OT_apply_media_preset(ApplyPreset, bpy.types.Operator):
    """Show media as this preset says"""

    bl_idname = "rtgi.apply_media_preset"
    bl_label = "Apply Media Preset"
    preset_menu = RTGI_PT_media_presets.__name__

    @classmethod
    def description(cls, context, properties):
        """What the presets of the add-on are for, and cost."""
        return tip_(TOOLTIPS.get(Path(properties.filepath).stem.lower(), cls.__doc__))


class RTGI_OT_add_media_preset(AddPreset, bpy.types.Operator):
    """Keep how media are shown as a preset, or remove one"""

    bl_idname = "rtgi.add_media_preset"
    bl_label = "Add Media Preset"
    preset_menu = RTGI_PT_media_presets.__name__
    preset_subdir = FOLDER
    preset_defines = [f"media = bpy.context.scene.rtgi_effects.effect_{MEDIA}"]

    @property
    def preset_values(self) -> list[str]:
        """All settings, as paths that Blender writes into the file."""
        return setting_paths(get(MEDIA), "media")


class RTGI_PT_media(ToolPanel, bpy.types.Panel):
    """What fills the air."""

    bl_label = "Media"

    def draw_header(self, context):
        """Whether pictures show media."""
        self.layout.prop(context.scene.rtgi_effects, switch(MEDIA), text="")

    def draw_header_preset(self, context):
        """The popover of presets."""
        RTGI_PT_media_presets.draw_panel_header(self.layout)

    def draw(self, context):
        """What was found when the scene was last read, and how it is shown."""
        layout, scene, effect = self.layout, context.scene, get(MEDIA)
        found = session.media.get(scene.name)
        if found is None:
            layout.operator("rtgi.check", text="Find Media", icon="VIEWZOOM")
        elif not found:
            layout.label(text="No fog, smoke or fire was found", icon="INFO")
        else:
            for medium in found[:_MOST]:
                draw_lines(layout, line_of(medium), context.region.width, "OUTLINER_OB_VOLUME")
            if len(found) > _MOST:
                layout.label(text=iface_("and {count} more").format(count=len(found) - _MOST), translate=False)
        column = split(layout.column())
        column.active = getattr(scene.rtgi_effects, switch(MEDIA))
        for item in fields(effect.Settings):
            draw_setting(column, settings_of(scene, effect), effect, item)


def line_of(medium: MediumFound) -> str:
    """A medium in one line, in the user's language."""
    if medium.mean_free_path == float("inf"):
        return iface_("{name}: glows, and takes no light").format(name=medium.name)
    text = iface_("{name}: mean free path from {path} m, albedo {albedo}, g {g}") if medium.varies else iface_(
        "{name}: mean free path {path} m, albedo {albedo}, g {g}")
    line = text.format(name=medium.name, path=f"{medium.mean_free_path:.3g}", albedo=f"{medium.albedo:.2f}", g=f"{medium.g:.2f}")
    return line + iface_(", glows") if medium.glows else line


_CLASSES = (RTGI_PT_media_presets, RTGI_OT_apply_media_preset, RTGI_OT_add_media_preset, RTGI_PT_media)
register, unregister = bpy.utils.register_classes_factory(_CLASSES)
