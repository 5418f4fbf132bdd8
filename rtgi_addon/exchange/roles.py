"""What lamps and objects are to a bake, as its manifest says it by their names: engines treat them accordingly."""

from ..scene import Scene
from ..scene.lights import ALL_LIGHT, BOUNCES_ONLY, NOT_AT_ALL
from ..scene.scene import STATIC
from ..techniques import Field

# How the manifest says it, and the command line.
ALL, BOUNCES, NONE = (role.lower() for role in (ALL_LIGHT, BOUNCES_ONLY, NOT_AT_ALL))
LAMP_ROLES = (ALL, BOUNCES, NONE)
INDIRECT_ONLY = "indirect only"


def lamp_roles(scene: Scene, field: Field) -> dict[str, str]:
    """Of every lamp of ``scene``, which was baked to ``field``, by name: one of LAMP_ROLES."""
    held = field.direct_lamps
    return {light.name: NONE if light.bake == NOT_AT_ALL else ALL if held is None or light.name in held else BOUNCES
            for light in scene.lights}


def object_roles(scene: Scene) -> dict[str, str]:
    """Of the objects of ``scene`` that are not part of the bake, by name: "dynamic"."""
    return {instance.name: instance.bake.lower() for instance in scene.instances if instance.bake != STATIC}


def direct_lamps(manifest: dict) -> frozenset[str] | None:
    """``Field.direct_lamps`` of the bundle with this ``manifest``."""
    if "lamps" not in manifest:
        return None if manifest.get("includes_direct") else frozenset()
    return frozenset(name for name, role in manifest["lamps"].items() if role == ALL)


def light_text(lamps: dict[str, str], includes_direct: bool) -> str:
    """What light a bake of ``lamps`` holds, in a few words."""
    held, left_out = ([name for name, role in lamps.items() if role == wanted] for wanted in (ALL, NONE))
    if includes_direct and len(held) + len(left_out) == len(lamps):
        text = "direct and indirect"
    else:
        text = f"indirect, and the direct light of {', '.join(held)}" if held else INDIRECT_ONLY
    return text + (f"; none of {', '.join(left_out)}" if left_out else "")
