"""Which group of lights a lamp or an object that shines belongs to (docs/techniques/transfer.md)."""

import bpy

# The custom property of objects, materials and collections that names a group.
PROPERTY = "rtgi_light_group"


def light_group(obj) -> str:
    """The group of ``obj``, evaluated or not, by its own property, by that of a material on it, by Blender's light group, or by the
    first of its collections, by name, with the property; "" if it is in none."""
    obj = obj.original
    owners = [obj, *(slot.material for slot in obj.material_slots if slot.material is not None)]
    named = next((name for name in map(_named, owners) if name), "") or obj.lightgroup
    return named or next((name for name in map(_named, sorted(_collections(obj), key=lambda each: each.name)) if name), "")


def _collections(obj):
    """The collections that hold ``obj``, and those that hold these."""
    found, waiting = set(obj.users_collection), list(obj.users_collection)
    while waiting:
        inner = waiting.pop()
        above = [each for each in bpy.data.collections if inner.name in each.children and each not in found]
        found.update(above)
        waiting += above
    return found


def _named(owner) -> str:
    value = owner.get(PROPERTY, "")
    return value.strip() if isinstance(value, str) else ""
