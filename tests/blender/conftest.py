"""A real Blender with a window, for the tests that need one (see test_window.py)."""

import os
import shlex
import subprocess
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).resolve().parents[2]
ADDON = "bl_ext.user_default.rtgi_addon"


@pytest.fixture(scope="module")
def blender(tmp_path_factory):
    """Start that Blender with ``arguments`` and this repository installed as an extension; returns the finished process."""
    user = tmp_path_factory.mktemp("user")
    (user / "extensions/user_default").mkdir(parents=True)
    (user / "extensions/user_default/rtgi_addon").symlink_to(REPOSITORY)

    def start(*arguments):
        command = [*shlex.split(os.environ["RTGI_BLENDER"]), "--factory-startup", "--addons", ADDON, *map(str, arguments)]
        environment = {**os.environ, "BLENDER_USER_RESOURCES": str(user)}
        return subprocess.run(command, cwd=REPOSITORY, env=environment, capture_output=True, text=True, timeout=900, check=False)

    return start
