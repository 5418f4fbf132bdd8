"""What an object or a lamp is to a bake, as its own property: ``Object.rtgi.bake`` and ``Light.rtgi.bake``.

Blender has a switch of its own for objects that only receive light (Visibility › Light Probes › Volume), and that stays the place
where it is kept; what Blender has no switch for is kept here.
"""

import bpy

from ...scene.lights import ALL_LIGHT, BOUNCES_ONLY, NOT_AT_ALL
from ...scene.scene import DYNAMIC, STATIC
from .properties import notify

LEFT_OUT = "NONE"
OBJECT_ROLES = (
    (STATIC, "Static", "Reflects light, throws shadows and receives light"),
    (DYNAMIC, "Dynamic", "Receives light, and the bake does not know it: for what moves in the game. The same as switching off "
                         "Visibility, Light Probes, Volume"),
    (LEFT_OUT, "Left Out", "As if the file did not have it: neither in bakes nor in RTGI's pictures and exports"),
)
LAMP_ROLES = (
    (ALL_LIGHT, "All", "Its direct light and all that surfaces reflect of it, for a lamp that the engine need not have"),
    (BOUNCES_ONLY, "Bounces", "What surfaces reflect of it; the engine adds its direct light"),
    (NOT_AT_ALL, "None", "Nothing: for a lamp that is switched or moves in the game"),
)
_NAMES = [name for name, *_ in OBJECT_ROLES]


def _role(group) -> int:
    if group.left_out:
        return _NAMES.index(LEFT_OUT)
    return _NAMES.index(DYNAMIC if group.id_data.hide_probe_volume else STATIC)


def _set_role(group, number: int) -> None:
    group.left_out = _NAMES[number] == LEFT_OUT
    if not group.left_out:
        group.id_data.hide_probe_volume = _NAMES[number] == DYNAMIC


class RTGI_PG_object(bpy.types.PropertyGroup):
    """What an object is to bakes."""

    left_out: bpy.props.BoolProperty(name="Left Out", description="Whether the object is left out of bakes", update=notify,
                                     options={"HIDDEN"})
    bake: bpy.props.EnumProperty(name="In Bakes", description="What this object is to bakes of RTGI", items=OBJECT_ROLES, get=_role,
                                 set=_set_role, update=notify)
    atlas: bpy.props.BoolProperty(name="Light Atlas", description="Bake this object's light at the texels of a UV map as well",
                                  update=notify)
    atlas_uv: bpy.props.StringProperty(name="UV Map", update=notify, description="The UV map of the light atlas, in which no two "
                                       "faces may overlap; without one that is called Lightmap, or else the one for renders")


class RTGI_PG_light(bpy.types.PropertyGroup):
    """What of a lamp is in bakes."""

    bake: bpy.props.EnumProperty(name="In Bakes", description="What of this lamp's light is in bakes of RTGI", items=LAMP_ROLES,
                                 default=BOUNCES_ONLY, update=notify)


_OWNERS = {"Object": RTGI_PG_object, "Light": RTGI_PG_light}


def is_left_out(obj) -> bool:
    """Whether ``obj``, evaluated or not, is as if the file did not have it."""
    group = getattr(obj.original, "rtgi", None)
    return group is not None and group.left_out


def atlas_map(obj) -> str | None:
    """The UV map at whose texels the light of ``obj``, evaluated or not, is baked ("": the usual one), None where it is not."""
    group = getattr(obj.original, "rtgi", None)
    return group.atlas_uv if group is not None and group.atlas else None


def lamp_role(lamp) -> str:
    """What of a lamp's data, evaluated or not, is in bakes (``scene.Lamp.bake``)."""
    return getattr(getattr(lamp.original, "rtgi", None), "bake", BOUNCES_ONLY)


def register() -> None:
    """Put the properties on objects and lamps."""
    for owner, group in _OWNERS.items():
        bpy.utils.register_class(group)
        getattr(bpy.types, owner).rtgi = bpy.props.PointerProperty(type=group, name="RTGI",
                                                                   description="Real-time global illumination")


def unregister() -> None:
    """Take them out; what files hold of them stays in the files."""
    for owner, group in _OWNERS.items():
        del getattr(bpy.types, owner).rtgi
        bpy.utils.unregister_class(group)
