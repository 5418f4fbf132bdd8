"""The open scene as a .glb, for the sample scene of an export: Blender's own glTF exporter writes it."""

from pathlib import Path
from typing import NamedTuple

import bpy
import numpy as np

from ..errors import BakeError
from ..exchange.engines.glb import correct
from ..scene import Omissions, World
from .extract.lamp_profiles import request_of, with_profile
from .extract.lamps import read_lamp
from .extract.world import read_world
from .realized import realized_scene
from .remembered import reuse
from .ui.role_properties import is_left_out


class Model(NamedTuple):
    """Of a model: names of the lamps that it lacks, of those that shine alike everywhere in it, as bright as they are on average;
    what else it does not hold, one line each; and the sky around it."""

    missing: tuple[str, ...]
    even: tuple[str, ...]
    lost: tuple[str, ...]
    sky: World


def export_model(path: Path) -> Model:
    """Write what renders of the open scene and is not left out to ``path``, as bakes read it: every instance with its own
    materials, modifiers applied, cameras, lamps in Blender's own units.

    Returns what glTF cannot hold. Raises BakeError if the exporter is switched off or fails.
    """
    if not hasattr(bpy.types, "EXPORT_SCENE_OT_gltf"):
        raise BakeError("Blender's glTF exporter is switched off", "enable glTF 2.0 format in the preferences, or export without "
                                                                   "the model")
    scene = bpy.context.scene
    with realized_scene() as made:
        try:
            with bpy.context.temp_override(scene=made.scene, view_layer=made.scene.view_layers[0]):
                bpy.ops.export_scene.gltf(filepath=str(path), export_format="GLB", use_active_scene=True, export_cameras=True,
                                          export_lights=True, export_animations=False,
                                          export_import_convert_lighting_mode="COMPAT")
        except RuntimeError as error:
            reason = (str(error).strip().splitlines() or ["unknown"])[-1].removeprefix("Error: ")
            raise BakeError(f"Blender cannot write this scene as glTF ({reason})",
                            "give a .glb of your own, or export without the model") from error
        names, lost = made.names, tuple(made.lost)
    strengths, even = _strengths()
    correct(path, strengths, names)
    missing = sorted(item.name for item in scene.objects
                     if item.type == "LIGHT" and item.data.type == "AREA" and not (item.hide_render or is_left_out(item)))
    with reuse():
        sky = read_world(scene.world, [])
    return Model(tuple(missing), even, lost, sky)


def _strengths() -> tuple[dict, tuple[str, ...]]:
    """Strengths (3,) by the name of a lamp's data, as a bake reads them, for the exporter takes those of lamps with nodes from the
    nodes alone; and the names of lamps whose light differs by direction or distance."""
    scene, depsgraph, strengths, shaped = bpy.context.scene, bpy.context.evaluated_depsgraph_get(), {}, []
    frame_number = scene.frame_current, scene.frame_subframe
    pending = []
    for item in scene.objects:
        if item.type == "LIGHT" and item.data.type != "AREA":
            evaluated = item.evaluated_get(depsgraph)
            light = read_lamp(evaluated, item.matrix_world, [])
            if light is not None:
                pending.append((item.data.name, light, request_of(evaluated, item.matrix_world, frame_number)))
    for name, light, request in pending:
        with reuse():
            found = light if request is None else with_profile(light, request, Omissions())
        strengths[name] = np.zeros(3) if found is None else found.strength
        if found is not None and found.profile is not None:
            shaped.append(found.name)
    return strengths, tuple(sorted(shaped))
