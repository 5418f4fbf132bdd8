"""What operators of presets share: those of a bake, of media and of styles are Blender's own mechanism with the same two cares."""

from dataclasses import fields
from pathlib import Path

import bpy
from bl_operators.presets import AddPresetBase

from .properties import value_type

# Blender looks for presets/rtgi, presets/rtgi_media and presets/rtgi_style in it.
FOLDER = str(Path(__file__).parents[1])


class ApplyPreset:
    """Applies the preset of ``filepath`` as one step of undo. An operator names the popover in ``preset_menu``."""

    bl_options = {"REGISTER", "UNDO", "INTERNAL"}
    preset_menu = ""

    filepath: bpy.props.StringProperty(
        name="File", description="The preset", subtype="FILE_PATH", options={"HIDDEN", "SKIP_SAVE"})

    def execute(self, context):
        """Blender runs the file; here it becomes one step of undo."""
        try:
            return bpy.ops.script.execute_preset(filepath=self.filepath, menu_idname=self.preset_menu)
        except RuntimeError as error:
            self.report({"ERROR"}, str(error).strip())
            return {"CANCELLED"}


class AddPreset(AddPresetBase):
    """Keeps a preset, or removes one of the user's own."""

    def remove(self, context, filepath: str) -> None:
        """Blender asks for it: what lies in its extensions it protects itself, what lies in a clone is protected here."""
        if Path(filepath).is_relative_to(FOLDER):
            raise PermissionError(f"{Path(filepath).stem} belongs to the add-on")
        Path(filepath).unlink()


def setting_paths(owner, variable: str, always: frozenset[str] = frozenset()) -> list[str]:
    """All settings of ``owner``, a technique or an effect, as paths below ``variable`` that Blender writes into a preset. Those
    ``always`` set have no switch of their own."""
    paths = []
    for item in fields(owner.Settings):
        if value_type(owner, item.name)[1] and item.name not in always:
            paths.append(f"{variable}.use_{item.name}")
        paths.append(f"{variable}.{item.name}")
    return paths
