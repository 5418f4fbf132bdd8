"""What the add-on puts into Blender, in order; taken out in reverse."""

from types import ModuleType

from . import (
    chart_ui,
    cli,
    engine,
    export_ui,
    handlers,
    leaks_ui,
    operators,
    panels,
    plan_ui,
    preset_ui,
    preview_panels,
    preview_settings,
    properties,
    stability_ui,
    translations,
)

_MODULES = (
    translations, properties, preview_settings, preset_ui, operators, panels, plan_ui, chart_ui, stability_ui, leaks_ui, export_ui,
    preview_panels, engine, handlers, cli,
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
