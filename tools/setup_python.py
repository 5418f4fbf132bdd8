"""Find the Python that bpy needs, wherever it is. Standard library only."""

from __future__ import annotations

import glob
import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

from setup_system import SetupError, apt_has, apt_install, may_apt, say

# The Pythons that bpy has wheels for, newest Blender first: 5.2 LTS and 5.0.
SUPPORTED = ("3.13", "3.11")

FOLDERS = (
    "{PYENV_ROOT}/versions/*/bin", "~/.pyenv/versions/*/bin", "/usr/local/bin", "/usr/bin", "/opt/*/bin", "/opt/python/*/bin",
    "{UV_PYTHON_INSTALL_DIR}/*/bin", "~/.local/share/uv/python/*/bin", "~/.local/bin", "~/.asdf/installs/python/*/bin",
    "~/.local/share/mise/installs/python/*/bin", "{CONDA_PREFIX}/bin", "/opt/conda/envs/*/bin", "/opt/homebrew/bin",
    "/Library/Frameworks/Python.framework/Versions/*/bin", "~/AppData/Local/Programs/Python/Python3*",
    *(f"~/{conda}{env}/bin" for conda in ("miniconda3", "anaconda3", "miniforge3", "mambaforge") for env in ("", "/envs/*")),
)

PROBE = """
import json, struct, sys, sysconfig
missing = []
for name in ("ssl", "zlib", "ctypes", "venv", "ensurepip"):
    try:
        __import__(name)
    except ImportError:
        missing.append(name)
print(json.dumps({
    "version": list(sys.version_info[:3]), "missing": missing,
    "fits": sys.implementation.name == "cpython" and struct.calcsize("P") == 8 and sys.version_info.releaselevel == "final"
            and not sysconfig.get_config_var("Py_GIL_DISABLED")}))
"""


def candidates(own_folder):
    """Paths of every interpreter worth asking, each real file once, PATH first; none from ``own_folder``."""
    forced = os.environ.get("RTGI_PYTHON")
    if forced:
        found = shutil.which(forced)
        if found is None:
            raise SetupError(f"RTGI_PYTHON={forced} is no program: give the path of a Python {' or '.join(SUPPORTED)}")
        return [found]
    folders = os.environ.get("PATH", "").split(os.pathsep)
    for pattern in FOLDERS:
        if all(os.environ.get(name) for name in re.findall(r"{(\w+)}", pattern)):
            folders += sorted(glob.glob(os.path.expanduser(pattern.format(**os.environ))))
    suffix = ".exe" if os.name == "nt" else ""
    names = [name + suffix for name in (*(f"python{version}" for version in SUPPORTED), "python3", "python")]
    paths, seen = [], set()
    for path in [*(Path(folder, name) for name in names for folder in folders if folder), Path(sys.executable)]:
        real = os.path.realpath(path)
        # An active virtual environment is first on PATH, and must not build itself anew.
        if real not in seen and os.access(path, os.X_OK) and path.parent != own_folder:
            seen.add(real)
            paths.append(str(path))
    return paths


def probe(path):
    """What the interpreter says about itself, or None if it does not run (a pyenv shim without its version, for one)."""
    try:
        answer = subprocess.run([path, "-I", "-c", PROBE], capture_output=True, text=True, timeout=30)
        return json.loads(answer.stdout.strip().splitlines()[-1]) if answer.returncode == 0 else None
    except (OSError, ValueError, IndexError, subprocess.TimeoutExpired):
        return None


def find_interpreter(own_folder):
    """Return (path, "3.13" or "3.11") of the newest interpreter that can carry bpy, installing Debian's where that may be done.

    Raises SetupError that lists what was found and says what to install.
    """
    usable, incomplete, rejected = {}, {}, []
    for path in candidates(own_folder):
        facts = probe(path)
        version = "{}.{}".format(*facts["version"]) if facts else None
        if facts is None:
            rejected.append(f"{path} does not run")
        elif version not in SUPPORTED:
            rejected.append("{} is Python {}.{}.{}".format(path, *facts["version"]))
        elif not facts["fits"]:
            rejected.append(f"{path} is not a released 64-bit CPython with its lock")
        elif facts["missing"]:
            rejected.append(f"{path} lacks {', '.join(facts['missing'])}")
            incomplete.setdefault(version, path)
        else:
            usable.setdefault(version, []).append((facts["version"], path))
    for version in SUPPORTED:
        if version in usable:
            return max(usable[version], key=lambda found: found[0])[1], version
        # Debian ships Python without ensurepip until its -venv package is there.
        if incomplete.get(version, "").startswith("/usr/bin/") and may_apt():
            say(f"{incomplete[version]} lacks its venv module: installing python{version}-venv with apt-get")
            apt_install([f"python{version}-venv"])
            return incomplete[version], version
    if may_apt() and not os.environ.get("RTGI_PYTHON"):
        for version in SUPPORTED:
            packages = [f"python{version}", f"python{version}-venv"]
            if apt_has(packages):
                say(f"there is no Python {' or '.join(SUPPORTED)}: installing {' '.join(packages)} with apt-get")
                apt_install(packages)
                return f"/usr/bin/python{version}", version
    remedy = (f"sudo apt-get install python{min(incomplete, key=SUPPORTED.index)}-venv, then run again" if incomplete
              else f"install Python {SUPPORTED[0]} or {SUPPORTED[1]} (pyenv, uv, conda or the system's packages), then run again")
    raise SetupError(f"no usable Python {' or '.join(SUPPORTED)} (found: {'; '.join(rejected) or 'none'}): {remedy}")
