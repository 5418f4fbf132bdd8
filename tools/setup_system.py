"""What the set-up needs from the system: Debian packages, and the shared libraries that bpy opens. Standard library only."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys

# What a machine without a desktop lacks for `import bpy`, and libEGL, which Blender opens once its gpu module starts.
DEBIAN_PACKAGE = {
    "libEGL.so.1": "libegl1", "libGL.so.1": "libgl1", "libGLX.so.0": "libglx0", "libICE.so.6": "libice6",
    "libOpenGL.so.0": "libopengl0", "libSM.so.6": "libsm6", "libX11.so.6": "libx11-6", "libXau.so.6": "libxau6",
    "libXext.so.6": "libxext6", "libXfixes.so.3": "libxfixes3", "libXi.so.6": "libxi6", "libXrender.so.1": "libxrender1",
    "libXxf86vm.so.1": "libxxf86vm1", "libgomp.so.1": "libgomp1", "libstdc++.so.6": "libstdc++6", "libuuid.so.1": "libuuid1",
    "libvulkan.so.1": "libvulkan1", "libxcb.so.1": "libxcb1", "libxkbcommon.so.0": "libxkbcommon0",
}

# Software OpenGL, for `--device gpu` and its tests on a machine without a graphics card.
SOFTWARE_GPU = ("libegl1", "libegl-mesa0", "libgl1-mesa-dri")
# Asks the product itself whether Blender would find a driver; its folder holds no requirement of its own.
ASK_FOR_DRIVER = """
import sys
sys.path.insert(0, sys.argv[1])
from rtgi_addon.preview import context
try:
    context.require_driver()
except Exception as error:
    sys.exit(str(error))
"""


class SetupError(Exception):
    """What is missing and what to do, as one line."""


def say(line):
    """Print one line of progress at once, so that it stands above what pip and apt-get print."""
    print(f"setup: {line}", flush=True)


def last_line(text, otherwise="no message"):
    """The line of a program's output that says what went wrong."""
    lines = [line for line in text.splitlines() if line.strip()]
    return lines[-1].strip() if lines else otherwise


def may_apt():
    """True if system packages can be installed without asking anybody."""
    root = hasattr(os, "geteuid") and os.geteuid() == 0
    return root and shutil.which("apt-get") is not None and not os.environ.get("RTGI_NO_APT")


def apt_has(packages):
    """True if the package lists, refreshed first, offer every one of ``packages``."""
    _apt_get("update")
    return subprocess.run(["apt-cache", "show", *packages], capture_output=True).returncode == 0


def apt_install(packages):
    """Install Debian packages, refreshing the package lists first. Raises SetupError with apt-get's own last words."""
    _apt_get("update")
    _apt_get("install", "-y", "--no-install-recommends", *packages)


def _apt_get(command, *arguments):
    result = subprocess.run(["apt-get", command, "-qq", *arguments], text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                            stdin=subprocess.DEVNULL, env={**os.environ, "DEBIAN_FRONTEND": "noninteractive"})
    if result.returncode != 0:
        raise SetupError(f"`apt-get {' '.join([command, *arguments])}` failed ({last_line(result.stdout)}): mend it, run again")


def missing_libraries(bpy_module, python):
    """Names of the shared libraries that ``bpy_module`` (a path) wants and the system lacks; ``python`` tries the ones that
    Blender opens only later."""
    if not sys.platform.startswith("linux") or shutil.which("ldd") is None:
        return []
    listing = subprocess.run(["ldd", bpy_module], capture_output=True, text=True).stdout
    missing = set(re.findall(r"^\s*(\S+) => not found", listing, re.MULTILINE))
    opened = subprocess.run([python, "-I", "-c", "import ctypes; ctypes.CDLL('libEGL.so.1')"], capture_output=True)
    if opened.returncode != 0:
        missing.add("libEGL.so.1")
    return sorted(missing)


def provide_libraries(bpy_module, python):
    """Install the libraries that bpy lacks, saying so. Raises SetupError with the command to run where that is not ours to do."""
    missing = missing_libraries(bpy_module, python)
    if not missing:
        return
    packages = sorted({DEBIAN_PACKAGE[name] for name in missing if name in DEBIAN_PACKAGE})
    unknown = [name for name in missing if name not in DEBIAN_PACKAGE]
    if packages and may_apt():
        say(f"Blender needs {', '.join(missing)}: installing {' '.join(packages)} with apt-get")
        apt_install(packages)
        unknown = missing_libraries(bpy_module, python)
        if not unknown:
            return
    elif packages and shutil.which("apt-get"):
        also = f" (and whatever provides {', '.join(unknown)})" if unknown else ""
        raise SetupError(f"Blender needs {', '.join(missing)}: sudo apt-get install {' '.join(packages)}{also}, then run again")
    raise SetupError(f"Blender needs {', '.join(unknown or missing)}: install them (any package manager), then run again")


def provide_gpu_driver(root, python):
    """Where Blender would find no GPU driver, not even a software one, install that if it may be done, else say what to install.

    The GPU is optional: nothing here fails the set-up.
    """
    def reason():
        answer = subprocess.run([python, "-I", "-c", ASK_FOR_DRIVER, str(root)], capture_output=True, text=True)
        return "" if answer.returncode == 0 else last_line(answer.stderr)

    lacking = reason()
    if not lacking:
        return
    if may_apt():
        say(f"there is no GPU driver: installing {' '.join(SOFTWARE_GPU)} with apt-get, which draw in software")
        try:
            apt_install(SOFTWARE_GPU)
            lacking = reason()
        except SetupError as error:
            lacking = str(error)
    if lacking:
        say(f"going on without a GPU: {lacking}")
