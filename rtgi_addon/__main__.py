"""`python -m rtgi_addon FILE.blend SUBCOMMAND …` with Blender as a Python module."""

import os
import shutil
import sys

from .blender.cli import main_module


def leave(code: int):
    """End the process with ``code``. Blender's module tears down C++ state at exit, in which it prints, hangs (4.5 with a render
    engine registered) and can crash: after our work is on the disk nothing there may change the exit code."""
    sys.stdout.flush()
    sys.stderr.flush()
    if "bpy" not in sys.modules:
        sys.exit(code)
    # What the teardown would have removed.
    shutil.rmtree(sys.modules["bpy"].app.tempdir, ignore_errors=True)
    os._exit(code)


if __name__ == "__main__":
    leave(main_module(sys.argv[1:]))
