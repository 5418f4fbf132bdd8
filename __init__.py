"""What Blender's extension system loads: the add-on itself is the package beside this file."""

import sys

if "register" in globals():  # Blender's Reload Scripts runs this file again and leaves the package below it as it was.
    for name in [name for name in sys.modules if name.startswith(f"{__package__}.")]:
        del sys.modules[name]

from .rtgi_addon import register, unregister

__all__ = ["register", "unregister"]
