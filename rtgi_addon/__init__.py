"""RTGI: bake, preview, measure and ship real-time global illumination from Blender. Folders have ranks and import strictly lower
ones (tests/test_layers.py holds the list); what is new comes in as low as what it needs allows, and here comes nothing but the
door.

Importing this package imports neither Blender nor any dependency, so light transport runs under a plain Python as well.
"""


from importlib.util import find_spec


def register() -> None:
    """Add properties, operators, panels, handlers and the `rtgi` command to Blender. Raises ImportError without numpy."""
    if find_spec("numpy") is None:  # part of every Blender from blender.org; distributions may leave it out
        raise ImportError("RTGI needs numpy, which this Blender's Python lacks: install it (Debian: sudo apt install "
                          "python3-numpy) and restart Blender")
    from .blender import registration

    registration.register()


def unregister() -> None:
    """Take all of it out again; a running bake is cancelled and the last one stays whole."""
    from .blender import registration

    registration.unregister()
