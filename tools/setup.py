"""Make ``.venv`` with everything the product, its demo and its tests need. Standard library only; any Python from 3.8 runs it.

A second run is instant, an interrupted one is repaired by running again. ``RTGI_PYTHON`` forces an interpreter, ``RTGI_VENV``
another folder; ``RTGI_NO_APT=1`` forbids installing system packages.
"""

from __future__ import annotations

import glob
import hashlib
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

from setup_python import find_interpreter
from setup_system import SetupError, last_line, provide_gpu_driver, provide_libraries, say

ROOT = Path(__file__).resolve().parent.parent
REQUIREMENTS = ROOT / "tools" / "requirements.txt"
VENV = Path(os.path.abspath(os.environ.get("RTGI_VENV") or ROOT / ".venv"))
STAMP = VENV / "rtgi-setup.json"
KERNELS = VENV / "rtgi-kernels.sha256"
BIN = VENV / ("Scripts" if os.name == "nt" else "bin")
PYTHON = BIN / ("python.exe" if os.name == "nt" else "python")

IMPORT_ALL = """
import importlib.util, platform, OpenEXR, matplotlib, numpy, bpy
if importlib.util.find_spec("embreex"):
    import embreex
print(f"Blender {bpy.app.version_string}, Python {platform.python_version()}, numpy {numpy.__version__}")
"""


def lock():
    """Hold this file until the process ends, so that two set-ups at once do the work one after the other."""
    try:
        import fcntl
    except ImportError:  # Windows
        return None
    held = open(__file__)
    fcntl.flock(held, fcntl.LOCK_EX)
    return held


def write_stamp(content):
    """Replace the stamp in one step: a crash leaves the old one or the new one."""
    partial = STAMP.with_suffix(".part")
    partial.write_text(json.dumps(content) + "\n")
    os.replace(partial, STAMP)


def state(wanted):
    """How far the environment has come: 'new', 'installed' (packages in, not yet seen to work) or 'ready'.

    It counts only if it was made as ``wanted`` and its interpreter is still there; without RTGI_PYTHON any interpreter will do.
    """
    try:
        stamp = json.loads(STAMP.read_text())
        same = stamp["requirements"] == wanted["requirements"] and wanted["forced"] in ("", stamp["forced"])
        return stamp["state"] if same and PYTHON.exists() else "new"
    except (OSError, ValueError, KeyError):
        return "new"


def clear_folder():
    """Empty the environment's folder but for the stamp, which says 'unfinished' from now on. Raises SetupError if not ours."""
    if VENV.exists() and not STAMP.exists() and any(VENV.iterdir()):
        raise SetupError(f"{VENV} was not made by this set-up: rename it, or set RTGI_VENV to another folder")
    VENV.mkdir(parents=True, exist_ok=True)
    write_stamp({})
    for entry in VENV.iterdir():
        if entry == STAMP:
            continue
        if entry.is_dir() and not entry.is_symlink():
            shutil.rmtree(entry)
        else:
            entry.unlink()


def install(wanted):
    """Build the virtual environment from nothing and fill it. Raises SetupError."""
    interpreter, version = find_interpreter(BIN)
    if VENV.exists():
        say(f"{VENV.name} is unfinished or out of date: making it anew")
    clear_folder()
    say(f"Python {version} from {interpreter}")
    made = subprocess.run([interpreter, "-I", "-m", "venv", str(VENV)], text=True, stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT)
    if made.returncode != 0:
        raise SetupError(f"{interpreter} cannot make {VENV} ({last_line(made.stdout)}): mend that and run again")
    say("installing the packages of tools/requirements.txt (bpy alone is about 400 MB)")
    pip = [str(PYTHON), "-m", "pip", "install", "--disable-pip-version-check", "--no-input", "--only-binary", ":all:"]
    if subprocess.run([*pip, "-r", str(REQUIREMENTS)]).returncode != 0:
        raise SetupError("pip failed on tools/requirements.txt (its message is above): check network and disk, then run again")
    write_stamp({**wanted, "state": "installed"})


def finish(wanted):
    """Provide the system libraries that Blender needs, and a GPU driver if one can be had, and see that everything can be imported.

    Raises SetupError.
    """
    for module in glob.glob(str(VENV / "lib" / "python*" / "site-packages" / "bpy" / "__init__*.so")):
        provide_libraries(module, str(PYTHON))
        provide_gpu_driver(ROOT, str(PYTHON))
    imported = subprocess.run([str(PYTHON), "-I", "-c", IMPORT_ALL], capture_output=True, text=True)
    if imported.returncode != 0:
        raise SetupError(f"`import bpy` fails ({last_line(imported.stderr)}): provide what it names, then run again")
    write_stamp({**wanted, "state": "ready"})
    say(f"ready: {last_line(imported.stdout)}")


def provide_kernels():
    """Build and install the compiled kernels unless they are there, of these sources. Without them numpy does their work: that they
    cannot be built is said, and stops nothing."""
    build = ROOT / "tools" / "build_kernels.py"
    digest = hashlib.sha256()
    for path in [*sorted((ROOT / "rtgi_addon" / "kernels" / "src").glob("*.[ch]")), build, ROOT / "tools" / "kernels.txt"]:
        digest.update(path.read_bytes())
    if KERNELS.exists() and KERNELS.read_text() == digest.hexdigest():
        return
    say("building the compiled kernels")
    ran = subprocess.run([str(PYTHON), str(build), "--install"], capture_output=True, text=True)
    if ran.returncode != 0:
        say(f"{last_line(ran.stderr)}; bakes go through numpy until then, which takes some 2.2 times as long")
        return
    KERNELS.write_text(digest.hexdigest())


def main():
    """Set up if that is needed. Returns the exit code."""
    held = None
    try:
        held = lock()
        digest = hashlib.sha256(REQUIREMENTS.read_bytes()).hexdigest()
        wanted = {"requirements": digest, "forced": os.environ.get("RTGI_PYTHON", "")}
        if state(wanted) == "new":
            install(wanted)
        if state(wanted) == "installed":
            finish(wanted)
        provide_kernels()
    except SetupError as error:
        print(f"setup: {error}", file=sys.stderr)
        return 1
    except OSError as error:
        print(f"setup: {error}: mend that and run again", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("setup: interrupted: run it again to finish", file=sys.stderr)
        return 130
    finally:
        if held is not None:
            held.close()
    return 0


if __name__ == "__main__":
    sys.exit(main())
