"""What the add-on puts into Blender, in order; taken out in reverse."""

from types import ModuleType

from . import (
    chart_ui,
    dependencies,
    engine,
    handlers,
    leaks_ui,
    operators,
    panels,
    preview_panels,
    preview_settings,
    properties,
    stability_ui,
)

_registered: list[ModuleType] = []


def _modules() -> list[ModuleType]:
    """Everything, less what cannot be imported while required packages are missing: then the panels say what to install."""
    modules = [properties, preview_settings, operators, panels, chart_ui, stability_ui, leaks_ui, preview_panels, engine, handlers]
    if not dependencies.missing_required():
        from . import cli

        modules.append(cli)
    return modules


def register() -> None:
    """Register every module; if one fails, those before it are taken out again, so that a second attempt starts clean."""
    dependencies.missing.cache_clear()
    try:
        for module in _modules():
            module.register()
            _registered.append(module)
    except Exception:
        unregister()
        raise


def unregister() -> None:
    """Unregister every module that was registered."""
    while _registered:
        _registered.pop().unregister()
