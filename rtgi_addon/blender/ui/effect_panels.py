"""Where effects are switched on: Properties › Render › Preview › Effects while RTGI is the engine, a panel for each."""

from dataclasses import fields

import bpy

from ...effects import Effect, registry
from .effect_settings import settings_of, switch
from .panel_kinds import Closed, split
from .panels import draw_setting
from .preview_panels import OfOurEngine
from .ramps import RAMPS, draw_ramp
from .styles import STYLIZED, RTGI_PT_styles


class RTGI_PT_effects(Closed, OfOurEngine, bpy.types.Panel):
    """What is made of the lit picture before it is shown."""

    bl_label = "Effects"
    bl_idname = "RTGI_PT_effects"
    bl_parent_id = "RTGI_PT_preview"

    def draw(self, context):
        """Nothing of its own: every effect has a panel in here."""


class _EffectPanel(Closed, OfOurEngine):
    """Some of the settings of one effect."""

    effect: Effect
    shown: tuple = ()
    bl_parent_id = "RTGI_PT_effects"

    def draw(self, context):
        """The settings, grey while the effect is off."""
        layout = split(self.layout)
        layout.active = getattr(context.scene.rtgi_effects, switch(self.effect.name))
        group = settings_of(context.scene, self.effect)
        for item in self.shown:
            if self.effect.name == STYLIZED and item.name in RAMPS:
                draw_ramp(layout, context.scene, item)
            else:
                draw_setting(layout, group, self.effect, item)


class _SwitchedPanel(_EffectPanel):
    """An effect with its switch in the header."""

    def draw_header(self, context):
        """The switch."""
        self.layout.prop(context.scene.rtgi_effects, switch(self.effect.name), text="")


class _StylePanel(_SwitchedPanel):
    """The effect with styles."""

    def draw_header_preset(self, context):
        """The popover of styles."""
        RTGI_PT_styles.draw_panel_header(self.layout)


def panels_of(effect: Effect) -> list[type]:
    """The classes of an effect's panel and of those for the parts of it."""
    name = f"RTGI_PT_{switch(effect.name)}"
    items = {item.name: item for item in fields(effect.Settings)}
    order, parts = list(items), []
    for number, (label, first, last) in enumerate(effect.sections):
        members = order[order.index(first):order.index(last) + 1]
        part = f"{name}_{number}"
        parts.append(type(part, (_EffectPanel, bpy.types.Panel), {
            "__doc__": label, "bl_label": label, "bl_idname": part, "bl_parent_id": name, "effect": effect,
            "shown": tuple(items.pop(member) for member in members)}))
    return [type(name, (_StylePanel if effect.name == STYLIZED else _SwitchedPanel, bpy.types.Panel), {
        "__doc__": effect.description, "bl_label": effect.label, "bl_idname": name, "effect": effect,
        "shown": tuple(items.values())}), *parts]


_registered: list[type] = []


def register() -> None:
    """Register the panels, one for each effect in the order in which they are applied."""
    for panel in (RTGI_PT_effects, *(panel for effect in registry().values() for panel in panels_of(effect))):
        bpy.utils.register_class(panel)
        _registered.append(panel)


def unregister() -> None:
    """Take them out."""
    while _registered:
        bpy.utils.unregister_class(_registered.pop())
