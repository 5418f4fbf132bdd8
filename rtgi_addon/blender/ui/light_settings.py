"""Light by sliders: ``Scene.rtgi_light``, for viewports and renders; a bake holds the light of the file itself."""

import math

import bpy

from ...scene import Scene
from ...techniques.transfer.controls import LightControls, controlled
from ..session import redraw


def _redraw(_self, _context) -> None:
    redraw()


class RTGI_PG_light_group(bpy.types.PropertyGroup):
    """One group of lights; its name is the group's."""

    strength: bpy.props.FloatProperty(
        name="Strength", description="What the light of this group is multiplied by", default=1.0, min=0.0, soft_max=10.0,
        update=_redraw)
    color: bpy.props.FloatVectorProperty(name="Color", description="What colour the light of this group is multiplied by", size=3,
                                         default=(1.0, 1.0, 1.0), min=0.0, soft_max=1.0, subtype="COLOR", update=_redraw)


class RTGI_PG_light_controls(bpy.types.PropertyGroup):
    """What is made of the file's light."""

    sky_turn: bpy.props.FloatProperty(
        name="Sky Turn", description="Turn the world about the vertical, counterclockwise from above", subtype="ANGLE",
        update=_redraw)
    use_sun_path: bpy.props.BoolProperty(
        name="Sun by Hour", description="Let suns that are in no light group stand where the sun does, with +Y north",
        update=_redraw)
    hour: bpy.props.FloatProperty(name="Hour", description="Solar time of the day", default=12.0, min=0.0, max=24.0,
                                  update=_redraw)
    day: bpy.props.IntProperty(
        name="Day of Year", description="Day of the year, which decides how high the sun climbs", default=172, min=1, max=365,
        update=_redraw)
    latitude: bpy.props.FloatProperty(name="Latitude", description="Where on Earth the scene is", subtype="ANGLE",
                                      default=math.radians(50.0), min=-math.pi / 2, max=math.pi / 2, update=_redraw)
    exact_sun: bpy.props.BoolProperty(
        name="Exact Sun", description="Follow suns by rays instead of by radiance transfer's table of directions: renders wait for "
                                      "it, viewports show it once the light stands still", update=_redraw)
    groups: bpy.props.CollectionProperty(
        type=RTGI_PG_light_group, name="Light Groups", description="Groups of lamps and emissive objects, and how strong they are")


def controls_of(scene: bpy.types.Scene) -> LightControls:
    """What the sliders of ``scene`` say."""
    light = scene.rtgi_light
    groups = tuple((group.name, tuple(group.strength * channel for channel in group.color)) for group in light.groups)
    hour = light.hour if light.use_sun_path else None
    return LightControls(math.degrees(light.sky_turn), hour, math.degrees(light.latitude), light.day, groups, light.exact_sun)


def in_its_light(read: Scene, scene: bpy.types.Scene) -> Scene:
    """``read``, which is ``scene``, in the light that its sliders make."""
    return controlled(read, controls_of(scene))


_CLASSES = RTGI_PG_light_group, RTGI_PG_light_controls


def register() -> None:
    """Put the properties on scenes."""
    for cls in _CLASSES:
        bpy.utils.register_class(cls)
    bpy.types.Scene.rtgi_light = bpy.props.PointerProperty(type=RTGI_PG_light_controls, name="RTGI Light",
                                                           description="What viewports and renders make of the file's light")


def unregister() -> None:
    """Take them out."""
    del bpy.types.Scene.rtgi_light
    for cls in reversed(_CLASSES):
        bpy.utils.unregister_class(cls)
