"""Where the library is not: everything runs, and one line says so."""

import os
import subprocess
import sys
from pathlib import Path

import scene_builders as build

from rtgi_addon import kernels
from rtgi_addon.jobs.bake import bake_scene
from rtgi_addon.transport.rays import embree

ROOT = Path(__file__).resolve().parents[2]


def says(**environment):
    """What a new process says of the kernels."""
    code = "from rtgi_addon import kernels; print(kernels.is_available(), kernels.missing())"
    ran = subprocess.run([sys.executable, "-c", code], cwd=ROOT, env={**os.environ, **environment}, capture_output=True, text=True,
                         check=True)
    return ran.stdout.strip()


def test_they_can_be_switched_off_and_replaced(tmp_path):
    assert says(RTGI_KERNELS="off") == "False RTGI_KERNELS=off"
    assert says(RTGI_KERNELS="OFF") == "False RTGI_KERNELS=off"
    nothing = tmp_path / "nothing.so"
    assert says(RTGI_KERNELS=str(nothing)).startswith(f"False {nothing} cannot be used")
    nothing.write_bytes(b"no library")
    assert says(RTGI_KERNELS=str(nothing)).startswith(f"False {nothing} cannot be used")


def test_the_report_says_so(tmp_path):
    with kernels.switched_off():
        summary = bake_scene(build.closed_box(), "probes", {"rays": 32, "texel_size": 1.0}, tmp_path / "bake")
    expected = "no compiled kernels" if embree.is_available() else "no Embree"
    said, = [warning for warning in summary.warnings if expected in warning]
    assert ("slower" in said and said in summary.to_text().replace("\n", " ").replace("  ", " ")) or expected in summary.to_text()
