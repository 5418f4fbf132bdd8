"""What the add-on puts into Blender, in order; taken out in reverse."""

from types import ModuleType

from . import cli, engine, handlers, output, translations
from .ui import (
    atlas_panels,
    bake_operators,
    chart,
    effect_panels,
    effect_settings,
    export,
    leaks,
    light_panels,
    light_settings,
    media,
    panels,
    placement,
    plan,
    presets,
    preview_panels,
    preview_settings,
    properties,
    role_properties,
    roles,
    select_named,
    series,
    sphere_panels,
    stability,
    styles,
    verify,
)

_MODULES = (
    translations, properties, role_properties, preview_settings, effect_settings, light_settings, presets, select_named,
    bake_operators, panels, placement, series, sphere_panels, roles, atlas_panels, verify, plan, chart, stability, leaks, media,
    export, preview_panels, light_panels, styles, effect_panels, engine, handlers, output, cli,
)
_registered: list[ModuleType] = []


def register() -> None:
    """Register every module; if one fails, those before it are taken out again, so that a second attempt starts clean."""
    try:
        for module in _MODULES:
            module.register()
            _registered.append(module)
    except Exception:
        unregister()
        raise


def unregister() -> None:
    """Unregister every module that was registered."""
    while _registered:
        _registered.pop().unregister()
