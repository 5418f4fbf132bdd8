"""Room for Blender as a Python module, which ends in a segmentation fault where there is none."""

import sys

from ...errors import BakeError
from ...machine.memory import address_bytes_left

# What importing Blender 5.2 takes of address space, most of it for libraries and never touched, and some for a small file.
BLENDER_BYTES = 1300 << 20


def require_room_for_blender() -> None:
    """Raise BakeError if a limit of this process leaves too little address space to load Blender, unless it is loaded."""
    left = None if "bpy" in sys.modules else address_bytes_left()
    if left is not None and left < BLENDER_BYTES:
        raise BakeError(f"Blender alone takes {BLENDER_BYTES / 2**30:.1f} GiB of address space, and the process's limit leaves "
                        f"{left / 2**30:.1f}", "raise the limit (ulimit -v)")
