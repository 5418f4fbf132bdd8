"""Blender's own panels shown for our engine as well: they name the engines that they are for."""

import bpy

# Those made for EEVEE alone that say what we read, and those made for every engine that they stand in for.
_FOR_EEVEE = {
    "DATA_PT_EEVEE_light", "DATA_PT_EEVEE_light_shadow", "NODE_DATA_PT_EEVEE_light", "EEVEE_MATERIAL_PT_context_material",
    "EEVEE_MATERIAL_PT_surface", "EEVEE_WORLD_PT_surface",
}
_REPLACED = {"DATA_PT_light", "NODE_DATA_PT_light", "DATA_PT_lightprobe"}


def add(engine: str) -> None:
    """Show for ``engine`` every panel that is there for engines without panels of their own, and those we read the settings of."""
    for name, engines in _panels():
        if name in _FOR_EEVEE or ("BLENDER_RENDER" in engines and name not in _REPLACED):
            engines.add(engine)


def remove(engine: str) -> None:
    """Undo ``add``."""
    for _, engines in _panels():
        engines.discard(engine)


def _panels():
    """(name, COMPAT_ENGINES) of every registered class that has them."""
    for name in dir(bpy.types):
        engines = getattr(getattr(bpy.types, name), "COMPAT_ENGINES", None)
        if isinstance(engines, set):
            yield name, engines
