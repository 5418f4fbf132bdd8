"""What moves in a viewport, read again without touching geometry: lamps, cameras, volumes, and where instances are."""

from dataclasses import replace

import numpy as np

from ...scene import Scene
from .extract import is_shown
from .lamps import read_lamp
from .volumes import is_volume, read_volume


def refresh_scene(scene: Scene, depsgraph) -> Scene | None:
    """``scene`` with the lamps, volumes and transforms that ``depsgraph`` has now; None if it shows other objects than those.

    What has not changed stays the very same object, ``scene`` itself included. Geometry, materials, world and cameras are left as
    they are.
    """
    in_viewport = depsgraph.mode == "VIEWPORT"
    lights, volumes, names, matrices = [], [], [], []
    for item in depsgraph.object_instances:
        obj = item.object
        if not is_shown(item, in_viewport):
            continue
        if obj.type == "MESH":
            if obj.visible_diffuse and len(obj.data.polygons):
                names.append(obj.name)
                matrices.append(np.array(item.matrix_world, np.float64))
        elif obj.type == "LIGHT":
            light = read_lamp(obj, item.matrix_world, [])
            if light is not None:
                lights.append(light)
        elif is_volume(obj):
            volumes.append(read_volume(obj, item.matrix_world))
    if names != [instance.name for instance in scene.instances]:
        return None
    instances = tuple(
        instance if np.array_equal(instance.world_from_local, matrix) else replace(instance, world_from_local=matrix)
        for instance, matrix in zip(scene.instances, matrices, strict=True))
    changed = {
        "instances": _kept(scene.instances, instances), "lights": _kept(scene.lights, _matched(scene.lights, lights)),
        "volumes": _kept(scene.volumes, _matched(scene.volumes, volumes)) if volumes else scene.volumes,
    }
    changed = {name: value for name, value in changed.items() if value is not getattr(scene, name)}
    return replace(scene, **changed) if changed else scene


def _matched(before: tuple, after: list) -> tuple:
    """``after`` with every entry that equals the one before at its place replaced by it."""
    known = {entry.name: entry for entry in before}
    return tuple(known[entry.name] if entry.name in known and _equal(known[entry.name], entry) else entry for entry in after)


def _kept(before: tuple, after: tuple) -> tuple:
    same = len(before) == len(after) and all(old is new for old, new in zip(before, after, strict=True))
    return before if same else after


def _equal(old, new) -> bool:
    if type(old) is not type(new):
        return False
    return all(np.array_equal(value, vars(new)[name]) if isinstance(value, np.ndarray) else value == vars(new)[name]
               for name, value in vars(old).items())
