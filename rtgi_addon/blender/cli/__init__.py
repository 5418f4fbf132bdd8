"""The command line: one set of subcommands behind two doors (docs/shell.md). A new one comes in as a module with a ``SUBCOMMAND``
and its place in `parser`; what it does is a job in `jobs/`, so that the panel has it as well.

`python -m rtgi_addon FILE SUBCOMMAND …`, or `rtgi …` after pip install, is ``main_module``;
`blender -b FILE --command rtgi SUBCOMMAND …` arrives at the handler that ``register`` gives to Blender. Exit codes: 0 done, 1
failed, 2 wrong usage, 130 cancelled; a failure is one line on stderr, and with `--json` an object on stdout as well. This module
and `info` do not import bpy.
"""

from .doors import main_module, register, unregister

__all__ = ["main_module", "register", "unregister"]
