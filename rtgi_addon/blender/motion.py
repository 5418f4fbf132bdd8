"""What moves in a scene, as far as a plan has to know: lamps, and things that light falls on."""

import bpy

from ..evaluate.plan.look import Motion

# Modifiers that move a mesh from frame to frame by themselves.
_MOVING_MODIFIERS = {"ARMATURE", "CLOTH", "SOFT_BODY", "OCEAN", "WAVE", "FLUID", "DYNAMIC_PAINT", "EXPLODE", "MESH_SEQUENCE_CACHE"}
_LIT = {"MESH", "CURVE", "SURFACE", "META", "FONT", "CURVES", "POINTCLOUD"}


def find_motion(context=None) -> Motion:
    """The names of what moves among the objects of the scene that are rendered: by animation, drivers, physics, a constraint to
    something that moves, or a parent that does."""
    scene = (context or bpy.context).scene
    moving: dict[str, bool] = {}
    shown = [obj for obj in scene.objects if not obj.hide_render]
    return Motion(tuple(obj.name for obj in shown if obj.type == "LIGHT" and _moves(obj, moving)),
                  tuple(obj.name for obj in shown if obj.type in _LIT and _moves(obj, moving)))


def _moves(obj, known: dict[str, bool]) -> bool:
    """Whether ``obj`` or what it follows moves; ``known`` keeps what was found, and ends circles of parents and constraints."""
    if obj.name not in known:
        known[obj.name] = False
        followed = [obj.parent, *(getattr(constraint, "target", None) for constraint in obj.constraints if constraint.enabled)]
        known[obj.name] = any(_is_animated(block) for block in (obj, obj.data, getattr(obj.data, "shape_keys", None))) \
            or (obj.rigid_body is not None and obj.rigid_body.type == "ACTIVE") \
            or any(modifier.type in _MOVING_MODIFIERS for modifier in obj.modifiers if modifier.show_render) \
            or any(constraint.type == "FOLLOW_PATH" for constraint in obj.constraints if constraint.enabled) \
            or any(_moves(other, known) for other in followed if other is not None)
    return known[obj.name]


def _is_animated(block) -> bool:
    data = getattr(block, "animation_data", None)
    return data is not None and (data.action is not None or len(data.drivers) > 0
                                 or any(len(track.strips) for track in data.nla_tracks))
