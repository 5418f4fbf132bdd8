"""Presets of the render panel, through Blender's own mechanism: Draft, Preview and Final come with the add-on and say how exact
every technique is to be; the user's own hold the technique and all of its settings, as files among Blender's presets."""

from pathlib import Path

import bpy
from bl_ui.utils import PresetPanel
from bpy.app.translations import pgettext_iface as iface_
from bpy.app.translations import pgettext_tip as tip_

from ...techniques import PRESETS, registry
from .preset_operators import FOLDER, AddPreset, ApplyPreset, setting_paths
from .properties import GOALS, attribute

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

    def draw(self, context):
        """Those of the add-on from quick to exact, then the user's own."""
        layout = self.layout
        layout.emboss, layout.operator_context = "PULLDOWN_MENU", "EXEC_DEFAULT"
        for name in PRESETS:
            button = layout.operator(self.preset_operator, text=iface_(name.capitalize()), translate=False)
            button.filepath = str(Path(FOLDER) / "presets" / self.preset_subdir / f"{name.capitalize()}.py")
        layout.separator()
        self.path_menu([path for path in bpy.utils.preset_paths(self.preset_subdir) if not Path(path).is_relative_to(FOLDER)],
                       self.preset_operator, filter_ext=lambda end: end.lower() == ".py", add_operator=self.preset_add_operator,
                       display_name=lambda name: bpy.path.display_name(name, title_case=False))


class RTGI_OT_apply_preset(ApplyPreset, bpy.types.Operator):
    """Bake with the settings of this preset"""

    bl_idname = "rtgi.apply_preset"
    bl_label = "Apply RTGI Preset"
    preset_menu = RTGI_PT_presets.__name__

    @classmethod
    def description(cls, context, properties):
        """What the presets of the add-on are for, and cost."""
        return tip_(TOOLTIPS.get(Path(properties.filepath).stem.lower(), cls.__doc__))


class RTGI_OT_add_preset(AddPreset, bpy.types.Operator):
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
        return ["rtgi.technique", "rtgi.device", "rtgi.mode",
                *setting_paths(technique, f"rtgi.{attribute(technique.name)}", frozenset(GOALS))]


_CLASSES = (RTGI_PT_presets, RTGI_OT_apply_preset, RTGI_OT_add_preset)


def register() -> None:
    """Register the popover and its operators, and show Blender where the add-on's presets are."""
    for cls in _CLASSES:
        bpy.utils.register_class(cls)
    bpy.utils.register_preset_path(FOLDER)


def unregister() -> None:
    """Take them out; what the user saved stays."""
    bpy.utils.unregister_preset_path(FOLDER)
    for cls in reversed(_CLASSES):
        bpy.utils.unregister_class(cls)
