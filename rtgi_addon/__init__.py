"""RTGI: bake, preview, measure and ship real-time global illumination from Blender.

Importing this package imports neither Blender nor any dependency, so light transport runs under a plain Python as well.
"""


def register() -> None:
    """Add properties, operators, panels, handlers and the `rtgi` command to Blender."""
    from .blender import registration

    registration.register()


def unregister() -> None:
    """Take all of it out again; a running bake is cancelled and the last one stays whole."""
    from .blender import registration

    registration.unregister()
