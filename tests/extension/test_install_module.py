"""The zip in Blender's Python module: installed, enabled, baked with, rendered with, disabled, uninstalled, without a network.

RTGI_MODULES names other Pythons with a bpy module each, separated as in PATH: .ci/run makes those of every supported version.
"""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from extension_zip import PLATFORM, REPOSITORY

pytestmark = pytest.mark.slow

PYTHONS = [*filter(None, os.environ.get("RTGI_MODULES", "").split(os.pathsep))] or [sys.executable]
# Blender's own note of which extensions fit it.
BLENDERS_OWN = {"extensions/.cache/compat.dat"}


@pytest.fixture(scope="module", params=PYTHONS, ids=lambda python: Path(python).parts[-3])
def seen(request, archive, isolated, tmp_path_factory):
    """What tests/support/extension_session.py saw, and the files that were left in the user's folder."""
    pytest.importorskip("bpy", reason="needs Blender's Python module")
    folder = tmp_path_factory.mktemp("session")
    (folder / "user").mkdir()
    command = [*isolated, request.param, REPOSITORY / "tests/support/extension_session.py", "--", archive,
               REPOSITORY / "sample_blends/cornell_box.blend", folder, folder / "report.json"]
    environment = {**os.environ, "BLENDER_USER_RESOURCES": str(folder / "user")}
    ran = subprocess.run(list(map(str, command)), cwd=REPOSITORY, env=environment, capture_output=True, text=True, timeout=300,
                         check=False)
    assert (folder / "report.json").exists(), ran.stdout[-2000:] + ran.stderr[-2000:]
    seen = json.loads((folder / "report.json").read_text())
    assert "error" not in seen, seen["error"]
    left = {path.relative_to(folder / "user").as_posix() for path in (folder / "user").rglob("*") if path.is_file()}
    return {**seen, "left": left, "user": str(folder / "user"), "exit code": ran.returncode}


def test_there_was_no_network(seen, isolated):
    if not isolated:
        pytest.skip("a network namespace takes root: this run had whatever network there is")
    assert seen["network"] is False


def test_it_registers(seen):
    assert {"property Scene.rtgi", "property LightProbe.rtgi", "type RTGI_PT_bake", "operator rtgi.bake",
            "engine of RENDER_PT_output: RTGI"} <= set(seen["enabled"])
    assert seen["enabled again"] == seen["enabled"]


def test_it_is_the_zip_that_runs(seen):
    assert seen["package"].startswith(seen["user"])
    if PLATFORM not in ("windows-arm64", "linux-arm64"):
        assert seen["embreex"].startswith(seen["user"]) and "site-packages" in seen["embreex"]


def test_it_bakes_and_renders(seen):
    assert seen["bake"] == ["FINISHED"] and seen["render"] == ["FINISHED"] and seen["info"] == 0
    assert not [note for note in seen["notes"] if "Embree" in note]


def test_disabling_takes_everything_out(seen):
    assert seen["left after disabling"] == []


def test_uninstalling_leaves_nothing_behind(seen):
    assert seen["left after uninstalling"] == [] and seen["lost"] == []
    assert seen["left"] <= BLENDERS_OWN


def test_blender_ends_in_order(seen):
    assert seen["exit code"] == 0
