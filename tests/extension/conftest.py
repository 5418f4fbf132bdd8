"""The extension's zip for this machine, built as `make extension` builds it, and ways to run things without a network."""

import os
import shlex
import shutil
import subprocess

import pytest
from extension_zip import PLATFORM, REPOSITORY, build_extension


@pytest.fixture(scope="session")
def wheels():
    """Where `make extension` keeps its wheels."""
    return REPOSITORY / "dist/wheels"


@pytest.fixture(scope="session")
def archive(tmp_path_factory, wheels):
    """The zip for this machine; skips where its wheels are neither kept nor to be had."""
    pytest.importorskip("bpy", reason="the bpy module holds Blender's extension tool")
    output = tmp_path_factory.mktemp("dist")
    ran = build_extension("--platform", PLATFORM, "--output", output, "--wheels", wheels)
    if "connect to the network" in ran.stderr:
        pytest.skip(ran.stderr.strip())
    assert ran.returncode == 0, ran.stderr
    path, = output.glob("*.zip")
    return path


@pytest.fixture(scope="session")
def isolated():
    """The words before a command that then finds no network; none where that takes rights that this user lacks."""
    unshare = ["unshare", "--net"]
    if shutil.which("unshare") and subprocess.run([*unshare, "true"], capture_output=True, check=False).returncode == 0:
        return unshare
    return []


@pytest.fixture
def blender(tmp_path):
    """Start the real Blender of RTGI_BLENDER_OFFLINE with a user folder of its own; returns the finished process."""
    (tmp_path / "user").mkdir()

    def start(*arguments):
        environment = {**os.environ, "BLENDER_USER_RESOURCES": str(tmp_path / "user")}
        command = [*shlex.split(os.environ["RTGI_BLENDER_OFFLINE"]), *map(str, arguments)]
        return subprocess.run(command, cwd=REPOSITORY, env=environment, capture_output=True, text=True, timeout=300, check=False)

    return start
