"""The open scene as a .glb, for the sample scene of an export: Blender's own glTF exporter writes it."""

from pathlib import Path

import bpy

from ..errors import BakeError
from ..exchange.engines.glb import set_lamps
from ..scene import SunLight
from .extract.lamps import read_lamp


def export_model(path: Path) -> tuple[str, ...]:
    """Write what renders of the open scene to ``path``: meshes with modifiers, materials, cameras, lamps in Blender's own units.

    Returns notes on lamps that glTF cannot hold. Raises BakeError if the exporter is switched off or fails.
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
    set_lamps(path, _strengths())
    lamps = sorted(item.name for item in bpy.context.scene.objects
                   if item.type == "LIGHT" and item.data.type == "AREA" and not item.hide_render)
    return (f"glTF has no area lamps: the model lacks {', '.join(lamps)}",) if lamps else ()


def _strengths() -> dict:
    """Strengths (3,) by the name of a lamp's data, as a bake reads them; the exporter takes those of lamps with nodes from the
    nodes alone."""
    depsgraph, strengths = bpy.context.evaluated_depsgraph_get(), {}
    for item in bpy.context.scene.objects:
        if item.type == "LIGHT" and item.data.type != "AREA":
            light = read_lamp(item.evaluated_get(depsgraph), item.matrix_world, [])
            if light is not None:
                strengths[item.data.name] = light.irradiance if isinstance(light, SunLight) else light.intensity
    return strengths
