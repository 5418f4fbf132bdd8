"""What moves in a viewport, read again without touching geometry: lamps, cameras, volumes, and where instances are."""

from dataclasses import replace

import numpy as np

from ...scene import Omissions, Scene
from ...transport.context import same_values
from ..evaluated import evaluated_mesh
from ..remembered import reuse
from .extract import is_shown
from .lamp_profiles import is_answered, request_of, with_profile
from .lamps import linked, read_lamp
from .linking import read_links, resolve
from .roles import collections_of_objects, read_role
from .spheres import is_sphere, read_sphere
from .volumes import is_volume, read_volume


def refresh_scene(scene: Scene, depsgraph) -> Scene | None:
    """``scene`` with the lamps, volumes and transforms that ``depsgraph`` has now; None if it shows other objects than those, or a
    lamp with nodes that Cycles must be asked about.

    What has not changed stays the very same object, ``scene`` itself included. Geometry, materials, world and cameras are left as
    they are.
    """
    in_viewport, collections = depsgraph.mode == "VIEWPORT", collections_of_objects()
    lights, volumes, spheres, names, matrices, roles = [], [], [], [], [], []
    for item in depsgraph.object_instances:
        obj = item.object
        if not is_shown(item, in_viewport):
            continue
        if obj.type == "MESH":
            role = read_role(item, collections)
            if role.takes_part and _has_faces(obj):
                names.append(obj.name)
                matrices.append(np.array(item.matrix_world, np.float64))
                roles.append(role)
        elif obj.type == "LIGHT":
            light = read_lamp(obj, item.matrix_world, [])
            request = None if light is None else request_of(obj, item.matrix_world, _frame_number(depsgraph))
            if request is not None:
                if not is_answered(request):
                    return None
                with reuse():
                    light = with_profile(light, request, Omissions())
            if light is not None:
                lights.append((light, read_links(obj)))
        elif is_volume(obj):
            volumes.append(read_volume(obj, item.matrix_world))
        elif is_sphere(obj):
            spheres.append(read_sphere(obj, item.matrix_world))
    if names != [instance.name for instance in scene.instances]:
        return None
    identities = [role.identity for role in roles]
    lights = [linked(light, links, identities) for light, links in lights]
    placed = [replace(instance, world_from_local=matrix, linking=resolve(role.links, identities), **role.fields)
              for instance, matrix, role in zip(scene.instances, matrices, roles, strict=True)]
    instances = tuple(old if same_values(old, new) else new for old, new in zip(scene.instances, placed, strict=True))
    changed = {
        "instances": _kept(scene.instances, instances), "lights": _kept(scene.lights, _matched(scene.lights, lights)),
        "volumes": _kept(scene.volumes, _matched(scene.volumes, volumes)) if volumes else scene.volumes,
        "spheres": _kept(scene.spheres, _matched(scene.spheres, spheres)),
    }
    changed = {name: value for name, value in changed.items() if value is not getattr(scene, name)}
    return replace(scene, **changed) if changed else scene


def _frame_number(depsgraph) -> tuple[int, float]:
    return depsgraph.scene.frame_current, depsgraph.scene.frame_subframe


def _has_faces(obj) -> bool:
    with evaluated_mesh(obj) as mesh:
        return len(mesh.polygons) > 0


def _matched(before: tuple, after: list) -> tuple:
    """``after`` with every entry that equals the one before at its place replaced by it."""
    known = {entry.name: entry for entry in before}
    return tuple(known[entry.name] if entry.name in known and same_values(known[entry.name], entry) else entry for entry in after)


def _kept(before: tuple, after: tuple) -> tuple:
    same = len(before) == len(after) and all(old is new for old, new in zip(before, after, strict=True))
    return before if same else after
