"""Make one virtual environment per supported Blender, with its bpy module and numpy alone, to try the extension in each.

    python tools/blender_modules.py DIR        prints their interpreters, separated as in PATH

Each takes about 1 GB and is kept for the next run. A Blender whose Python is not on this machine is left out, and named on
stderr. Standard library only.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

from setup_python import candidates, probe

# (bpy, the Python it is built for, the numpy it is built with)
BLENDERS = (
    ("4.5.15", "3.11", "1.26.4"),
    ("5.0.1", "3.11", "1.26.4"),
    ("5.1.2", "3.13", "2.5.5"),
    ("5.2.3", "3.13", "2.5.5"),
)


def interpreters() -> dict[str, str]:
    """A usable interpreter of every Python version on this machine: "3.11" → path."""
    found = {}
    for path in candidates(own_folder=None):
        facts = probe(path)
        if facts and facts["fits"] and not facts["missing"]:
            found.setdefault("{}.{}".format(*facts["version"]), path)
    return found


def provide(folder: Path, interpreter: str, packages: list[str]) -> str:
    """The Python of an environment in ``folder`` with exactly ``packages``, made unless it is there. Raises CalledProcessError."""
    python, stamp = folder / "bin/python", folder / "rtgi-packages.txt"
    wanted = "\n".join(packages)
    if stamp.exists() and stamp.read_text() == wanted and python.exists():
        return str(python)
    shutil.rmtree(folder, ignore_errors=True)
    subprocess.run([interpreter, "-I", "-m", "venv", str(folder)], check=True, stdout=sys.stderr)
    subprocess.run([str(python), "-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--no-input", "--no-cache-dir",
                    "--only-binary", ":all:", *packages], check=True, stdout=sys.stderr)
    stamp.write_text(wanted)
    return str(python)


def main() -> int:
    """Make them all; 1 if one that could be made was not."""
    if len(sys.argv) != 2:
        print(__doc__, file=sys.stderr)
        return 2
    known, made, failed = interpreters(), [], False
    for blender, version, numpy in BLENDERS:
        if version not in known:
            print(f"Blender {blender} is left out: there is no Python {version} here", file=sys.stderr)
            continue
        try:
            folder = Path(sys.argv[1]).resolve() / f"bpy-{blender}"
            made.append(provide(folder, known[version], [f"bpy=={blender}", f"numpy=={numpy}"]))
        except (subprocess.CalledProcessError, OSError) as error:
            print(f"Blender {blender} could not be installed: {error}", file=sys.stderr)
            failed = True
    print(os.pathsep.join(made))
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
