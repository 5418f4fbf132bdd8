"""`python -m rtgi_addon FILE.blend SUBCOMMAND …`, or `rtgi …` where it was installed with pip, with Blender as a Python module."""

import os
import shutil
import sys

from .interrupts import Interrupts


def leave(code: int):
    """End the process with ``code``. Blender's module tears down C++ state at exit, in which it prints, hangs (4.5 with a render
    engine registered) and can crash: after our work is on the disk nothing there may change the exit code."""
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except (AttributeError, OSError, ValueError):
            # Closed by whoever started us.
            pass
    if "bpy" not in sys.modules:
        # Python's own end would flush once more, and complain.
        os._exit(code)
    # What the teardown would have removed.
    shutil.rmtree(sys.modules["bpy"].app.tempdir, ignore_errors=True)
    os._exit(code)


def main() -> int:
    """The exit code. Signals are heeded from here on, while numpy and Blender are still to be loaded."""
    with Interrupts() as interrupts:
        try:
            from .blender.cli import main_module
            return main_module(sys.argv[1:], interrupts)
        except KeyboardInterrupt:
            os.write(2, b"rtgi: cancelled\n")
            return 130


def run():
    """What `rtgi` starts. Never returns."""
    leave(main())


if __name__ == "__main__":
    run()
