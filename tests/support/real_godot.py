"""Runs a real Godot for tests: RTGI_GODOT is the command that starts it, with a display where something is drawn."""

import os
import re
import shlex
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


def godot(project, *words):
    """Exit code and everything that Godot says about ``project``."""
    command = [*shlex.split(os.environ["RTGI_GODOT"]), "--audio-driver", "Dummy", "--path", str(project), *map(str, words)]
    ran = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=300, check=False)
    return ran.returncode, ran.stdout + ran.stderr


def complaints(said):
    """What Godot complains of in what it ``said``, but for what a machine without a sound card or a display does."""
    lines = [line for line in said.splitlines() if re.search(r"\b(ERROR|WARNING)\b", line)]
    return [line for line in lines if not re.search(r"V-Sync|vsync|ALSA|audio|dbus|libdecor|RADV|MESA", line, re.IGNORECASE)]


def imported(folder):
    """``folder`` after Godot has imported it."""
    code, said = godot(folder, "--headless", "--import")
    assert code == 0 and not complaints(said), said
    return folder


def drawing(said):
    """Skip where Godot found no driver to draw with."""
    if "Using Device" not in said:
        pytest.skip(f"this Godot cannot draw here: {(complaints(said) or said.splitlines())[-1:]}")


def replacing(text, wrong):
    """The damage that puts ``wrong`` in the place of ``text``."""
    def damage(whole):
        assert text in whole
        return whole.replace(text, wrong)

    return damage
