"""The zip in a real Blender without a network, from the shell, as the README says. RTGI_BLENDER_OFFLINE holds the command, such as

    RTGI_BLENDER_OFFLINE='python tools/debian_tree.py run TREE --no-network --bind /tmp -- blender'
"""

import json
import os

import numpy as np
import pytest
from extension_zip import REPOSITORY

from rtgi_addon.exchange.bundle import read_bundle

pytestmark = [pytest.mark.slow, pytest.mark.skipif("RTGI_BLENDER_OFFLINE" not in os.environ,
                                                   reason="RTGI_BLENDER_OFFLINE names no real Blender")]

SAMPLE = REPOSITORY / "sample_blends/cornell_box.blend"
WHERE = "import embreex; print('EMBREE', embreex.__file__)"
BLENDERS_OWN = {"extensions/.cache/compat.dat", "config/userpref.blend"}


def files(folder):
    return {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}


def test_from_the_zip_to_a_bake_and_back(blender, archive, tmp_path):
    """Install, bake, check, render, remove: every step a Blender of its own."""
    user, out = tmp_path / "user", tmp_path / "bake"
    ran = blender("--command", "extension", "install-file", "-r", "user_default", "-e", archive)
    assert ran.returncode == 0 and 'Installed "rtgi_addon"' in ran.stdout, ran.stdout + ran.stderr

    ran = blender("-b", SAMPLE, "--command", "rtgi", "bake", "--out", out, "--rays", 256)
    assert ran.returncode == 0, ran.stderr
    # Nobody but us speaks: OpenEXR's library, for one, must not.
    assert not [line for line in ran.stderr.splitlines() if "EXR_ERR" in line or "Traceback" in line]
    bundle = read_bundle(out)
    assert np.isfinite(bundle.field.grids()[0].sh).all() and "5.2" in bundle.manifest["blender"]
    assert not [note for note in bundle.manifest["notes"] if "Embree" in note]

    ran = blender("-b", "--python-expr", WHERE)
    assert f"EMBREE {user}/extensions/.local/lib/" in ran.stdout, ran.stdout

    ran = blender("-b", "--command", "rtgi", "info", out, "--json")
    assert ran.returncode == 0 and json.loads(ran.stdout[ran.stdout.index("{"):ran.stdout.rindex("}") + 1])
    picture = tmp_path / "x.png"
    ran = blender("-b", SAMPLE, "--gpu-backend", "vulkan", "--command", "rtgi", "render", "--bundle", out, "--out", picture,
                  "--scale", 0.1, "--samples", 2)
    assert ran.returncode == 0 and picture.stat().st_size > 1000, ran.stderr

    # The file is open, so Blender writes its model itself.
    ran = blender("-b", SAMPLE, "--command", "rtgi", "export", out, "--engine", "godot", "--out", tmp_path / "project")
    assert ran.returncode == 0 and (tmp_path / "project/model.glb").stat().st_size > 1000, ran.stderr

    ran = blender("--command", "extension", "remove", "rtgi_addon")
    assert ran.returncode == 0, ran.stdout + ran.stderr
    assert files(user) <= BLENDERS_OWN
    ran = blender("-b", "--command", "rtgi", "info", out)
    assert ran.returncode != 0


def test_nothing_is_left_in_a_running_blender(blender, archive, tmp_path):
    """The same life in one process, with what Blender itself holds before and after."""
    report = tmp_path / "report.json"
    ran = blender("-b", "--gpu-backend", "vulkan", "--python", REPOSITORY / "tests/support/extension_session.py", "--",
                  archive, SAMPLE, tmp_path, report)
    assert report.exists(), ran.stdout[-2000:] + ran.stderr[-2000:]
    seen = json.loads(report.read_text())
    assert "error" not in seen, seen["error"]
    assert seen["network"] is False
    assert seen["package"].startswith(str(tmp_path / "user")) and seen["embreex"].startswith(str(tmp_path / "user"))
    assert "operator rtgi.bake" in seen["enabled"] and seen["enabled again"] == seen["enabled"]
    assert seen["bake"] == ["FINISHED"] and seen["render"] == ["FINISHED"] and seen["info"] == 0
    assert seen["left after disabling"] == [] and seen["left after uninstalling"] == [] and seen["lost"] == []
    assert files(tmp_path / "user") <= BLENDERS_OWN
