"""What shaders ask about the object or instance they are on, answered from a dependency graph as Cycles answers it.

Checked against renders of Cycles 5.2: Object Info, Particle Info, Attribute nodes of every type, coordinates from instancers.
"""

import math

import numpy as np

from .attributes import elements
from .circumstances import PLACEMENT

_MASK = 0xFFFFFFFF
# Factor by which Cycles' hash of a name goes on from letter to letter.
_NAME_FACTOR = 37
# Jenkins' lookup3: the state before any word, and the steps of its `final`: by how many bits what is turned, into which word.
_LOOKUP3_START = 0xDEADBEEF
_LOOKUP3_FINAL = ((14, "c", "b"), (11, "a", "c"), (25, "b", "a"), (16, "c", "b"), (4, "a", "c"), (14, "b", "a"), (24, "c", "b"))
# Ends the list of a DepsgraphObjectInstance's persistent indices, innermost first.
_NO_INDEX = 0x7FFFFFFF
_NOTHING = (0.0, 0.0, 0.0, 0.0)


class Placements:
    """Answers for the instances of one dependency graph; only while it lives. ``scene`` is the original scene."""

    def __init__(self, scene, depsgraph):
        self._scene, self._layer = scene, depsgraph.view_layer_eval
        self._evaluated_scene = depsgraph.scene_eval
        self._instancers: dict[tuple, tuple | None] = {}

    def answers(self, asked: frozenset, item) -> tuple:
        """((question, numbers), …) for those of ``asked`` that a ``DepsgraphObjectInstance`` answers for itself, in a fixed order:
        instances with equal answers look alike. Numbers are floats: RGBA of attributes, 16 of a matrix, 1 or 3 of the rest."""
        mine = sorted(question for question in asked if question[0] in PLACEMENT)
        return tuple((question, _ANSWERS[question[0]](self, item, *question[1:])) for question in mine)

    def _world(self, item) -> tuple:
        return tuple(float(x) for row in item.matrix_world for x in row)

    def _object(self, item, output: str) -> tuple:
        obj = item.object
        if output == "Location":
            return tuple(item.matrix_world.translation)
        if output == "Color":
            return tuple(obj.color[:3])
        if output == "Alpha":
            return (float(obj.color[3]),)
        if output == "Object Index":
            return (float(obj.pass_index),)
        if output == "Random":
            number = item.random_id & _MASK if item.is_instance else _hash(_hash_of_name(obj.name), 0)
            return (number / _MASK,)
        return (0.0,)

    def _particle(self, item, output: str) -> tuple:
        system, index = item.particle_system if item.is_instance else None, item.persistent_id[0]
        particle = system.particles[index] if system is not None and 0 <= index < len(system.particles) else None
        if output == "Random":
            return (_hash(0 if particle is None else index, 0) / _MASK,)
        if particle is None:
            return _NOTHING[:3] if output in ("Location", "Velocity", "Angular Velocity") else (0.0,)
        if output == "Index":
            return (float(index),)
        if output == "Age":
            return (self._scene.frame_current_final - particle.birth_time,)
        found = getattr(particle, output.lower().replace(" ", "_"), 0.0)
        return (float(found),) if isinstance(found, (int, float)) else tuple(found)

    def _instancer(self, item, output: str) -> tuple:
        if not item.is_instance:
            return _NOTHING[:3]
        return (*item.uv, 0.0) if output == "UV" else tuple(item.orco)

    def _attribute(self, item, kind: str, name: str) -> tuple:
        """RGBA of an object's, an instancer's or a view layer's attribute (`BKE_object_dupli_find_rgba_attribute`)."""
        owners = [item.object, item.object.data]
        if kind == "VIEW_LAYER":
            owners = [self._layer, self._evaluated_scene, self._evaluated_scene.world]
        elif kind == "INSTANCER" and item.is_instance:
            system = item.particle_system
            found = None if system is None else _property(system.settings, name)
            found = self._instance_attribute(item, name) if found is None else found
            if found is not None:
                return found
            owners = [item.parent, None if item.parent is None else item.parent.data, *owners]
        return next((found for owner in owners if (found := _property(owner, name)) is not None), _NOTHING)

    def _instance_attribute(self, item, name: str) -> tuple | None:
        """RGBA of an attribute on instances made by geometry nodes, the innermost that has it; None if none does."""
        parent = item.parent
        if parent is None or not hasattr(parent, "evaluated_geometry"):
            return None
        key = parent.as_pointer(), name
        if key not in self._instancers:
            self._instancers[key] = _instances_of(parent.evaluated_geometry(), name)
        level, found = self._instancers[key], None
        # Persistent indices are listed from the inside out; the first of nested geometry counts the parts of one geometry.
        for index in reversed([index for index in item.persistent_id if index != _NO_INDEX]):
            if level is None or index >= len(level[0]):
                break
            values, references, inner = level[1], level[0], level[2]
            found = found if values is None else tuple(values[index])
            level = inner[references[index]] if references[index] < len(inner) else None
        return found


_ANSWERS = {"world": Placements._world, "object": Placements._object, "particle": Placements._particle,
            "instancer": Placements._instancer, "attribute": Placements._attribute}


def _instances_of(geometry, name: str) -> tuple | None:
    """(reference index (n,), RGBA (n, 4) of attribute ``name`` or None, the same of each reference) of a geometry's instances."""
    points = geometry.instances_pointcloud()
    if points is None:
        return None
    count = len(points.points)
    references = np.zeros(count, np.int32)
    index = points.attributes.get(".reference_index")
    if index is not None:
        index.data.foreach_get("value", references)
    inner = [_instances_of(reference, name) if hasattr(reference, "instances_pointcloud") else None
             for reference in geometry.instance_references()]
    values = elements(points.attributes.get(name))
    return references, None if values is None else values[0], inner


def _property(owner, name: str) -> tuple | None:
    """RGBA of a custom property of ``owner``, or of a property of Blender's own by its name or path; None without one."""
    if owner is None or not name or ("[" in name and not name.startswith('["')):
        return None
    try:
        value = owner[name] if name in owner.keys() else owner.path_resolve(name)
    except (TypeError, ValueError, KeyError, AttributeError):
        return None
    if isinstance(value, (bool, int, float)):
        return (float(value),) * 3 + (1.0,)
    if isinstance(value, str):
        return None
    try:
        numbers = [float(x) for x in value]
    except (TypeError, ValueError):
        return None
    if not 1 <= len(numbers) <= 4 or not all(map(math.isfinite, numbers)):
        return None
    return (*numbers, *(0.0, 0.0, 0.0, 1.0)[len(numbers):])


def _hash_of_name(name: str) -> int:
    """Cycles' hash of an object's name (`hash_string`)."""
    result = 0
    for byte in name.encode():
        result = (result * _NAME_FACTOR + byte) & _MASK
    return result


def _hash(first: int, second: int) -> int:
    """Cycles' `hash_uint2`: the last round of Jenkins' lookup3."""
    a = b = c = (_LOOKUP3_START + (2 << 2) + 13) & _MASK
    a, b = (a + first) & _MASK, (b + second) & _MASK
    for turn, to, by in _LOOKUP3_FINAL:
        values = {"a": a, "b": b, "c": c}
        values[to] = ((values[to] ^ values[by]) - ((values[by] << turn | values[by] >> (32 - turn)) & _MASK)) & _MASK
        a, b, c = values["a"], values["b"], values["c"]
    return c
