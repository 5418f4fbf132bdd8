"""The lights of a scene apart: its world, its suns, and every group of lamps and emissive objects, each in a context of its own.

All contexts have the same triangles in the same order, so that texels and hits of one are those of the others.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from ...scene import Scene, World
from ...scene.baked import baked_part
from ...scene.lights import SunLight
from ...scene.scene import Instance
from ...transport.context import LightContext

# The kinds of columns, of which the first two occur once and have these names.
WORLD, SUNS, GROUP = "world", "suns", "group"
# The group of what is in none.
OTHER = "other"


@dataclass(frozen=True, eq=False)
class LightColumn:
    """One light: its ``name`` and ``kind``, and ``context``, in which nothing else shines."""

    name: str
    kind: str
    context: LightContext


def dark_context(scene: Scene, threads: int | None) -> LightContext:
    """The context of ``scene`` without any light, and without media."""
    return LightContext(_dark(baked_part(scene)), threads)


def light_columns(scene: Scene, dark: LightContext) -> Iterator[LightColumn]:
    """The lights of ``scene`` that shine, one after the other; ``dark`` is its ``dark_context``."""
    scene, unlit = baked_part(scene), dark.scene
    if not scene.world.is_black:
        yield LightColumn(WORLD, WORLD, LightContext(replace(unlit, world=scene.world), dark.threads, same_surfaces=dark))
    suns = tuple(light for light in scene.lights if is_loose_sun(light))
    if suns:
        yield LightColumn(SUNS, SUNS, LightContext(replace(unlit, lights=suns), dark.threads, same_surfaces=dark))
    for name in group_names(scene):
        lamps = tuple(light for light in scene.lights if not is_loose_sun(light) and group_of(light) == name)
        shining = [index for index, instance in enumerate(scene.instances)
                   if group_of(instance) == name and _shines(scene, instance)]
        if not shining:
            context = LightContext(replace(unlit, lights=lamps), dark.threads, same_surfaces=dark)
        else:
            context = LightContext(replace(_shining(scene, unlit, shining), lights=lamps), dark.threads)
        yield LightColumn(name, GROUP, context)


def group_names(scene: Scene) -> list[str]:
    """The groups in which something of ``scene`` shines, by name, those of a user before OTHER."""
    names = {group_of(light) for light in scene.lights if not is_loose_sun(light)}
    names |= {group_of(instance) for instance in scene.instances if _shines(scene, instance)}
    return sorted(names, key=lambda name: (name == OTHER, name))


def group_of(owner) -> str:
    """The group of a lamp or an instance."""
    return owner.light_group or OTHER


def is_loose_sun(light) -> bool:
    """Whether ``light`` is a sun that no group switches: those are in the column of suns, which other suns replace."""
    return isinstance(light, SunLight) and not light.light_group


def materials_of(scene: Scene, instance: Instance) -> dict[int, int]:
    """The materials on an ``instance``, by their indices in its mesh."""
    override = instance.material_override or {}
    return {int(index): override.get(int(index), int(index)) for index in np.unique(scene.meshes[instance.mesh].triangle_material)}


def _shines(scene: Scene, instance: Instance) -> bool:
    return any(scene.materials[index].is_emissive for index in materials_of(scene, instance).values())


def _dark(scene: Scene) -> Scene:
    materials = tuple(material.shining(0.0) if material.is_emissive else material for material in scene.materials)
    return replace(scene, lights=(), world=World.constant(0.0), materials=materials, media=())


def _shining(scene: Scene, unlit: Scene, shining: list[int]) -> Scene:
    """``unlit`` with the materials of ``scene`` on the instances ``shining``."""
    count, instances = len(unlit.materials), list(unlit.instances)
    for index in shining:
        own = materials_of(scene, scene.instances[index])
        override = {old: count + new if scene.materials[new].is_emissive else new for old, new in own.items()}
        instances[index] = replace(instances[index], material_override=override)
    return replace(unlit, materials=(*unlit.materials, *scene.materials), instances=tuple(instances))
