"""Which effects the user switches on, and how: ``Scene.rtgi_effects``, a switch and a group of settings for each."""

from dataclasses import fields

import bpy

from ...effects import Chosen, Effect, in_order, registry
from .properties import attribute, read_value, settings_group

_KIND = "effect"


def switch(name: str) -> str:
    """The property of ``Scene.rtgi_effects`` that switches the effect of that name on."""
    return attribute(name, f"use_{_KIND}")


def settings_of(scene: bpy.types.Scene, effect: Effect):
    """The property group that holds an effect's settings."""
    return getattr(scene.rtgi_effects, attribute(effect.name, _KIND))


def chosen_effects(scene: bpy.types.Scene) -> tuple[Chosen, ...]:
    """The effects that ``scene`` asks for, in order. Raises UsageError for a value out of range."""
    chosen = [effect for effect in registry().values() if getattr(scene.rtgi_effects, switch(effect.name))]
    return in_order(Chosen(effect, effect.Settings(**{item.name: read_value(effect, settings_of(scene, effect), item.name)
                                                      for item in fields(effect.Settings)})) for effect in chosen)


def _scene_group(groups: dict[str, type]) -> type:
    annotations = {}
    for name, group in groups.items():
        effect = registry()[name]
        annotations[switch(name)] = bpy.props.BoolProperty(name=effect.label, description=effect.description.rstrip("."),
                                                               default=effect.on_by_default)
        annotations[attribute(name, _KIND)] = bpy.props.PointerProperty(
            type=group, name=effect.label, description=f"Settings of the effect {effect.label}")
    return type("RTGI_PG_effects", (bpy.types.PropertyGroup,), {"__annotations__": annotations})


_registered: list[type] = []


def register() -> None:
    """Put the switches and settings on scenes."""
    groups = {name: settings_group(effect, overrides=False, kind=_KIND) for name, effect in registry().items()}
    for group in (*groups.values(), scene_group := _scene_group(groups)):
        bpy.utils.register_class(group)
        _registered.append(group)
    bpy.types.Scene.rtgi_effects = bpy.props.PointerProperty(
        type=scene_group, name="RTGI Effects", description="What is made of the lit picture before it is shown")


def unregister() -> None:
    """Take them out."""
    if hasattr(bpy.types.Scene, "rtgi_effects"):
        del bpy.types.Scene.rtgi_effects
    while _registered:
        bpy.utils.unregister_class(_registered.pop())
