"""Presets of the render panel, through Blender's own mechanism: Draft, Preview and Final come with the add-on and say how exact
every technique is to be; the user's own hold the technique and all of its settings, as files among Blender's presets."""

from dataclasses import fields
from pathlib import Path

import bpy
from bl_operators.presets import AddPresetBase
from bl_ui.utils import PresetPanel
from bpy.app.translations import pgettext_tip as tip_

from ..techniques import registry
from .properties import GOALS, attribute, value_type

# What the presets of the add-on are for, and cost; docs/panel.md has the other techniques' figures and how they were measured.
TOOLTIPS = {
    "draft": "To see where light goes: probes with 10% error (0.2 s of processor time for the 64 of the Cornell box)",
    "preview": "To judge a picture: probes with 3% error (0.3 s of processor time for the 64 of the Cornell box)",
    "final": "To ship: probes with 1% error (0.8 s of processor time for the 64 of the Cornell box)",
}


class RTGI_PT_presets(PresetPanel, bpy.types.Panel):
    """Presets of a bake's quality."""

    bl_label = "RTGI Presets"
    preset_subdir = "rtgi"
    preset_operator = "rtgi.apply_preset"
    preset_add_operator = "rtgi.add_preset"


class RTGI_OT_apply_preset(bpy.types.Operator):
    """Bake with the settings of this preset"""

    bl_idname = "rtgi.apply_preset"
    bl_label = "Apply RTGI Preset"
    bl_options = {"REGISTER", "UNDO", "INTERNAL"}

    filepath: bpy.props.StringProperty(
        name="File", description="The preset", subtype="FILE_PATH", options={"HIDDEN", "SKIP_SAVE"})

    @classmethod
    def description(cls, context, properties):
        """What the presets of the add-on are for, and cost."""
        return tip_(TOOLTIPS.get(Path(properties.filepath).stem.lower(), cls.__doc__))

    def execute(self, context):
        """Blender runs the file; here it becomes one step of undo."""
        try:
            return bpy.ops.script.execute_preset(filepath=self.filepath, menu_idname=RTGI_PT_presets.__name__)
        except RuntimeError as error:
            self.report({"ERROR"}, str(error).strip())
            return {"CANCELLED"}


class RTGI_OT_add_preset(AddPresetBase, bpy.types.Operator):
    """Keep the technique and its settings as a preset, or remove one"""

    bl_idname = "rtgi.add_preset"
    bl_label = "Add RTGI Preset"
    preset_menu = RTGI_PT_presets.__name__
    preset_subdir = RTGI_PT_presets.preset_subdir
    preset_defines = ["rtgi = bpy.context.scene.rtgi"]

    @property
    def preset_values(self) -> list[str]:
        """The technique of the current scene and whatever can be set of it, as paths that Blender writes into the file."""
        technique = registry()[bpy.context.scene.rtgi.technique]
        paths = ["rtgi.technique", "rtgi.device", "rtgi.mode"]
        for item in fields(technique.Settings):
            if value_type(technique, item.name)[1] and item.name not in GOALS:
                paths.append(f"rtgi.{attribute(technique.name)}.use_{item.name}")
            paths.append(f"rtgi.{attribute(technique.name)}.{item.name}")
        return paths

    def remove(self, context, filepath: str) -> None:
        """Blender asks for it: what lies in its extensions it protects itself, what lies in a clone is protected here."""
        if Path(filepath).is_relative_to(_FOLDER):
            raise PermissionError(f"{Path(filepath).stem} belongs to the add-on")
        Path(filepath).unlink()


_FOLDER = str(Path(__file__).parent)
_CLASSES = (RTGI_PT_presets, RTGI_OT_apply_preset, RTGI_OT_add_preset)


def register() -> None:
    """Register the popover and its operators, and show Blender where the add-on's presets are."""
    for cls in _CLASSES:
        bpy.utils.register_class(cls)
    bpy.utils.register_preset_path(_FOLDER)


def unregister() -> None:
    """Take them out; what the user saved stays."""
    bpy.utils.unregister_preset_path(_FOLDER)
    for cls in reversed(_CLASSES):
        bpy.utils.unregister_class(cls)
