"""Styles as presets of the effect's panel, through Blender's own mechanism: those of the product and the user's own."""

import bpy
from bl_ui.utils import PresetPanel

from ...effects import get
from ..styles import FOLDER, STYLIZED, VARIABLE
from .preset_operators import AddPreset, ApplyPreset, setting_paths
from .ramps import RAMPS, RTGI_OT_edit_ramp, show_ramp


class RTGI_PT_styles(PresetPanel, bpy.types.Panel):
    """Styles."""

    bl_label = "RTGI Styles"
    preset_subdir = FOLDER
    preset_operator = "rtgi.apply_style"
    preset_add_operator = "rtgi.add_style"


class RTGI_OT_apply_style(ApplyPreset, bpy.types.Operator):
    """Draw in this style"""

    bl_idname = "rtgi.apply_style"
    bl_label = "Apply RTGI Style"
    preset_menu = RTGI_PT_styles.__name__

    def execute(self, context):
        """Blender runs the file; what the ramps' widgets show follows."""
        result = super().execute(context)
        if result == {"FINISHED"}:
            for name in RAMPS:
                show_ramp(context.scene, name)
        return result


class RTGI_OT_add_style(AddPreset, bpy.types.Operator):
    """Keep the settings of the effect as a style, or remove one"""

    bl_idname = "rtgi.add_style"
    bl_label = "Add RTGI Style"
    preset_menu = RTGI_PT_styles.__name__
    preset_subdir = FOLDER
    preset_defines = [f"{VARIABLE} = bpy.context.scene.rtgi_effects.effect_{STYLIZED}"]

    @property
    def preset_values(self) -> list[str]:
        """All settings of the effect, as paths that Blender writes into the file."""
        return setting_paths(get(STYLIZED), VARIABLE)


_CLASSES = (RTGI_PT_styles, RTGI_OT_apply_style, RTGI_OT_add_style, RTGI_OT_edit_ramp)


def register() -> None:
    """Register the popover and the operators, and give scenes a place for ramps."""
    for cls in _CLASSES:
        bpy.utils.register_class(cls)
    bpy.types.Scene.rtgi_ramps = bpy.props.PointerProperty(
        type=bpy.types.ShaderNodeTree, name="RTGI Ramps", description="Holds the color ramps of the stylized effect")


def unregister() -> None:
    """Take them out."""
    if hasattr(bpy.types.Scene, "rtgi_ramps"):
        del bpy.types.Scene.rtgi_ramps
    for cls in reversed(_CLASSES):
        bpy.utils.unregister_class(cls)
