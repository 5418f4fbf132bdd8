"""The command line: one set of subcommands behind two doors (FORMATS.md).

`python -m rtgi_addon FILE SUBCOMMAND …` is ``main_module``; `blender -b FILE --command rtgi SUBCOMMAND …` arrives at the
handler that ``register`` gives to Blender. Exit codes: 0 done, 1 failed, 2 wrong usage, 130 cancelled; a failure is one line on
stderr. This module and `info` do not import bpy.
"""

from .doors import main_module, register, unregister

__all__ = ["main_module", "register", "unregister"]
