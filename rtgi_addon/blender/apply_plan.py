"""Write a plan into a scene: technique and settings, resolutions of volumes, which of their probes are left out, and the volumes
that it places in others."""

import bpy
import numpy as np
from mathutils import Matrix

from ..errors import BakeError
from ..evaluate.plan import Plan
from ..scene import ProbeVolume
from .extract.volumes import is_volume
from .ui.properties import attribute


def apply_plan(scene: bpy.types.Scene, plan: Plan) -> list[bpy.types.Object]:
    """Write ``plan`` into ``scene`` and return the volumes' objects, as ``plan.volumes`` are.

    A volume that was fitted for the plan is added; what earlier plans placed in volumes of this one goes, and what this one places
    takes their parent's settings and moves with it. Raises BakeError, before anything is changed, for a volume that is gone.
    """
    found = {obj.name: obj for obj in scene.objects if is_volume(obj)}
    own = [volume for volume in plan.volumes if not volume.planned]
    for volume in own:
        if volume.name not in found and not volume.fitted:
            raise BakeError(f"the volume {volume.name} is no longer there", "plan again")
    _write_settings(scene.rtgi, plan)
    names = {volume.name for volume in own}
    for obj in found.values():
        if obj.data.rtgi.planned in names:
            bpy.data.objects.remove(obj)
    for volume in own:
        if volume.name not in found:
            found[volume.name] = _added(scene, volume)
        _write_volume(found[volume.name].data, volume, plan.technique)
    objects = {volume.name: found[volume.name] for volume in own}
    for volume in plan.volumes:
        if volume.planned:
            parent = next(one for one in own if one.name == volume.planned)
            objects[volume.name] = _placed(volume, parent, objects[parent.name])
            _write_volume(objects[volume.name].data, volume, plan.technique)
    return [objects[volume.name] for volume in plan.volumes]


def _write_settings(settings, plan: Plan) -> None:
    settings.technique = plan.technique
    group = getattr(settings, attribute(plan.technique))
    for name, value in plan.settings.items():
        setattr(group, name, value)
    if "error" in plan.settings:
        settings.mode = "ERROR"


def _write_volume(data, volume: ProbeVolume, technique: str) -> None:
    data.resolution_x, data.resolution_y, data.resolution_z = volume.resolution
    values = data.rtgi
    values.planned = volume.planned
    values.near_surfaces = volume.near is not None
    if volume.near is not None:
        values.clearance, values.outside, values.outermost = volume.near.clearance, volume.near.outside, volume.near.outermost
    own = getattr(values, attribute(technique))
    # What a volume does differently was not planned with.
    for name in own.bl_rna.properties.keys():
        if name.startswith("override_"):
            setattr(own, name, False)


def _added(scene, volume: ProbeVolume) -> bpy.types.Object:
    data = bpy.data.lightprobes.new("Probe Volume", "VOLUME")
    obj = bpy.data.objects.new(data.name, data)
    scene.collection.objects.link(obj)
    obj.matrix_world = _matrix(volume.world_from_local)
    return obj


def _placed(volume: ProbeVolume, parent: ProbeVolume, holder) -> bpy.types.Object:
    """A volume within ``holder``, the object of ``parent``, which moves with it."""
    data = holder.data.copy()
    data.name = volume.name
    obj = bpy.data.objects.new(volume.name, data)
    for collection in holder.users_collection:
        collection.objects.link(obj)
    obj.hide_render, obj.hide_viewport = holder.hide_render, holder.hide_viewport
    obj.parent = holder
    obj.matrix_parent_inverse.identity()
    obj.matrix_basis = _matrix(np.linalg.inv(np.asarray(parent.world_from_local, np.float64)) @ volume.world_from_local)
    return obj


def _matrix(matrix: np.ndarray) -> Matrix:
    return Matrix([[float(value) for value in row] for row in np.asarray(matrix, np.float64)])
