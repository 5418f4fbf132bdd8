"""What the add-on puts into Blender, in order; taken out in reverse."""

from . import cli, handlers, operators, panels, properties

_MODULES = (properties, operators, panels, handlers, cli)


def register() -> None:
    """Register every module; if one fails, those before it are taken out again, so that a second attempt starts clean."""
    done = []
    try:
        for module in _MODULES:
            module.register()
            done.append(module)
    except Exception:
        for module in reversed(done):
            module.unregister()
        raise


def unregister() -> None:
    """Unregister every module."""
    for module in reversed(_MODULES):
        module.unregister()
