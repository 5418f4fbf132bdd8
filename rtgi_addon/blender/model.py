"""The open scene as a .glb, for the sample scene of an export: Blender's own glTF exporter writes it."""

from pathlib import Path

import bpy

from ..errors import BakeError


def export_model(path: Path) -> None:
    """Write what renders of the open scene to ``path``: meshes with modifiers, materials, cameras, lamps in Blender's own units.

    Raises BakeError if the exporter is switched off or fails.
    """
    if not hasattr(bpy.types, "EXPORT_SCENE_OT_gltf"):
        raise BakeError("Blender's glTF exporter is switched off", "enable glTF 2.0 format in the preferences, or export without "
                                                                   "the model")
    try:
        bpy.ops.export_scene.gltf(filepath=str(path), export_format="GLB", use_renderable=True, export_apply=True,
                                  export_cameras=True, export_lights=True, export_import_convert_lighting_mode="COMPAT")
    except RuntimeError as error:
        reason = (str(error).strip().splitlines() or ["unknown"])[-1].removeprefix("Error: ")
        raise BakeError(f"Blender cannot write this scene as glTF ({reason})",
                        "give a .glb of your own, or export without the model") from error
